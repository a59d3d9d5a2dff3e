#include "core/background/engine.h"

#include <algorithm>
#include <thread>

#include "core/background/planes.h"
#include "core/background/stopwatch.h"

namespace qdmd {
namespace {

// Frames that enter the Gram matrix together in batch mode: few enough that little is left to do
// when a window is full, enough that they fill a register tile and the window is not read from
// memory for each of them.
constexpr int kGramGroup = 16;

// Pixels whose share of a pass is worth waking a thread for.
constexpr size_t kPixelsPerPart = 32768;

int thread_count(int threads) {
  if (threads > 0) return threads;
  // Zero where the system does not tell.
  return static_cast<int>(std::clamp<unsigned>(std::thread::hardware_concurrency(), 1,
                                               unsigned{EngineOptions::kMaxThreads}));
}

// Calls pass(first_row, row_count) for bands of a picture's rows.
template <typename Pass>
void for_bands(Pool& pool, int width, int height, Pass pass) {
  const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  const auto bands =
      static_cast<int>(std::clamp<size_t>(pixels / kPixelsPerPart, 1, static_cast<size_t>(height)));
  pool.run(static_cast<size_t>(bands), [&](size_t band) {
    const auto row = [&](size_t b) {
      return static_cast<int>(int64_t{height} * static_cast<int64_t>(b) / bands);
    };
    pass(row(band), row(band + 1) - row(band));
  });
}

}  // namespace

Status Engine::configure(const EngineOptions& options, int width, int height) {
  const Status status = check_options(options, width, height);
  if (!status.ok()) return status;
  // The old window goes first: two at once would break the promise of max-memory.
  close();
  const EngineLayout layout = layout_of(options, width, height);
  const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  options_ = options;
  width_ = width;
  height_ = height;
  threads_ = options.threads;
  const int threads = thread_count(options.threads);
  pool_ = std::make_unique<Pool>(threads);
  side_ = std::make_unique<SideThread>(threads > 1);
  DmdOptions dmd = options.dmd;
  const bool live = options.mode == Mode::live;
  // Where frames make room for others before their model is used, its modes are pictures.
  if (live) dmd.max_modes = BackgroundModel::most_modes(options.window_size);
  solver_ = WindowSolver(dmd, options.iterations, layout.capacity, width, height,
                         layout.sample_step, live, pool_.get());
  live_ = LiveSolver(schedule_of(options, pixels), &solver_, side_.get());
  const bool robust = options.dmd.method == Method::robust;
  budget_.begin(front_of_efforts({1, robust ? options.iterations : 1, layout.sample_step}, robust,
                                 width, height),
                live ? schedule_of(options, pixels).hop_size() : options.window_size);
  alpha_ = AlphaStore(layout.capacity);
  window_ = Window(layout.capacity, pixels);
  return {};
}

void Engine::close() {
  flush();
  window_ = Window();
  alpha_ = AlphaStore();
  solver_ = WindowSolver();
  live_ = LiveSolver();
  side_.reset();
  pool_.reset();
  solves_ = 0;
}

void Engine::flush() {
  if (side_) live_.stop();
  window_.clear();
  solver_.clear();
  solver_.forget();
  live_.restart(false);
  pending_ = ready_ = not_in_gram_ = 0;
  has_model_ = start_new_window_ = frozen_ = skip_solve_ = follows_light_ = false;
  stretch_frames_ = 0;
  stretch_seconds_ = stretch_solve_ = 0;
  budget_.solve_next();
}

// Makes room for the frame and splits it.
void Engine::take_in(const ImageView& frame) {
  const int slot = window_.append();
  uint8_t* const planes[3] = {window_.plane(slot, 0), window_.plane(slot, 1),
                              window_.plane(slot, 2)};
  const uint8_t alpha = first_alpha(frame);
  if (split_channels(frame, 0, height_, alpha, planes))
    alpha_.set_constant(slot, alpha);
  else
    alpha_.set(slot, frame);
  ++pending_;
}

Status Engine::push(const ImageView& frame) {
  if (!configured())
    return {Status::Code::not_configured, "configure the engine before pushing frames"};
  if (ready_ > 0)
    return {Status::Code::frames_are_waiting, "pop the frames that are ready before pushing more"};
  if (frame.width != width_ || frame.height != height_)
    return {Status::Code::invalid_options, "configure the engine anew for frames of another size"};
  if (options_.mode == Mode::batch && pending_ == 0) begin_stretch();
  double seconds = 0;
  {
    const Stopwatch watch(&seconds);
    follow_threads();
    if (options_.mode == Mode::live)
      push_live(frame);
    else
      push_batch(frame);
  }
  // A live frame that begins a stretch belongs to it. What it waited for is counted as work.
  ++stretch_frames_;
  stretch_seconds_ += seconds - live_.take_wait_seconds();
  return {};
}

// The pictures are the same for any number.
void Engine::follow_threads() {
  if (threads_ == options_.threads || !side_->idle()) return;
  options_.threads = std::clamp(threads_, 0, EngineOptions::kMaxThreads);
  threads_ = options_.threads;
  const int threads = thread_count(threads_);
  pool_->resize(threads);
  side_->set_active(threads > 1);
}

// The stretch before is over: its cost is known. Decides whether the next one is solved, and how.
void Engine::begin_stretch() {
  SolveCost cost;
  if (stretch_solve_ > 0 && !skip_solve_) {
    // The solver knows its parts, but not what came with them.
    cost = solver_.report().cost;
    cost.once = std::max(0.0, cost.once + stretch_solve_ - cost.sum());
  }
  budget_.add(stretch_frames_, stretch_seconds_, cost);
  stretch_frames_ = 0;
  stretch_seconds_ = stretch_solve_ = 0;
  skip_solve_ = !budget_.next();
  if (!skip_solve_) solver_.set_effort(budget_.effort());
  // Whoever lets go of a background wants another.
  if (freeze_) budget_.solve_next();
}

void Engine::push_batch(const ImageView& frame) {
  const bool freeze = freeze_ || skip_solve_;
  if (pending_ == 0 && has_model_ && freeze != frozen_) {
    // The model may still read its window, whose frames are about to make room. Frames that came
    // meanwhile are in no Gram matrix.
    if (freeze) {
      if (!freeze_) solver_.model().set_light(kSameLight);
      solver_.model().freeze_at(window_.size() - 1);
    } else {
      start_new_window_ = true;
    }
    frozen_ = freeze;
  }
  if (pending_ == 0) follows_light_ = frozen_ && !freeze_;
  if (start_new_window_) {
    side_->finish();
    window_.clear();
    solver_.clear();
    start_new_window_ = false;
    not_in_gram_ = 0;
  }
  take_in(frame);
  solver_.append(window_);
  // Frames of the window before are left out: they count only if this window ends early.
  if (++not_in_gram_ == std::min(kGramGroup, options_.window_size) && !frozen_)
    add_group(not_in_gram_);
  if (pending_ == options_.window_size) solve();
}

// Goes on beside the frames that follow.
void Engine::add_group(int frames) {
  side_->finish();
  not_in_gram_ = 0;
  group_ = Group{SnapshotRange(window_).newest(pending_), frames};
  // What a std::function holds without memory of its own.
  side_->start([this] { solver_.add_to_gram(group_->span, group_->frames); });
}

// Batch: a model for the window as it is.
void Engine::solve() {
  ready_ = pending_;
  if (frozen_) {
    not_in_gram_ = 0;
    return;
  }
  const Stopwatch watch(&stretch_solve_);
  side_->finish();
  const SnapshotRange window(window_);
  if (pending_ < window_.size())
    solver_.add_to_gram(window, pending_);
  else if (not_in_gram_ > 0)
    solver_.add_to_gram(window, not_in_gram_);
  not_in_gram_ = 0;
  solver_.decompose(window);
  solver_.build();
  solver_.finish(options_.foreground_threshold);
  solver_.publish();
  has_model_ = true;
  ++solves_;
}

void Engine::push_live(const ImageView& frame) {
  const auto count = [this](bool published) {
    if (!published) return;
    // It may have been asked for while the solve was under way.
    set_foreground_threshold(options_.foreground_threshold);
    has_model_ = true;
    frozen_ = false;
    ++solves_;
  };
  const bool freeze = freeze_ && has_model_;
  if (!freeze) count(live_.settle());
  if (freeze) budget_.solve_next();
  if (freeze || start_new_window_) {
    live_.stop();
    if (has_model_ && !frozen_) {
      solver_.model().freeze_at(live_.time());
      frozen_ = true;
    }
    window_.clear();
    solver_.clear();
    live_.restart(has_model_);
    start_new_window_ = false;
  }
  take_in(frame);
  // Frozen, too: its ring keeps in step with the window's.
  solver_.append(window_);
  if (!freeze) {
    const auto solve_now = [this] {
      // The work of the stretch is over, whoever did it.
      stretch_solve_ = live_.take_solve_seconds();
      stretch_seconds_ += live_.take_gram_seconds() + stretch_solve_;
      begin_stretch();
      return !skip_solve_ || !has_model_;
    };
    count(live_.start(window_, options_.foreground_threshold, live_.small() || !has_model_,
                      solve_now));
  }
  if (!frozen_) solver_.follow_light(window_.slot(window_.size() - 1));
  ready_ = 1;
}

Status Engine::drain() {
  if (!configured())
    return {Status::Code::not_configured, "configure the engine before draining it"};
  if (options_.mode == Mode::batch && pending_ > ready_) solve();
  start_new_window_ = true;
  // An old background says nothing of what comes after.
  budget_.solve_next();
  return {};
}

void Engine::set_foreground_threshold(double threshold) {
  options_.foreground_threshold = threshold;
  ForegroundStatistics& foreground = solver_.report().foreground;
  foreground.threshold = threshold > 0 ? threshold : automatic_threshold(foreground.noise);
}

// What is needed for the next frame's pictures.
OutputTask Engine::next_task(Output output) {
  const int index = window_.size() - pending_;
  const int slot = window_.slot(index);
  BackgroundModel& model = solver_.model();
  if (follows_light_) solver_.follow_light(slot);
  model.set_time(options_.mode == Mode::live ? live_.time() : index);
  return {{window_.plane(slot, 0), window_.plane(slot, 1), window_.plane(slot, 2)},
          &model,
          output,
          solver_.report().foreground.threshold,
          options_.foreground_threshold > 0 ? nullptr : model.limits(),
          alpha_.samples(slot),
          alpha_.constant(slot)};
}

void Engine::foreground(uint8_t* mask, uint8_t* residual) {
  if (ready_ == 0) return;
  write_foreground(next_task(Output::mask), 0, window_.pixels(), mask, residual);
}

bool Engine::write_background(const MutableImageView& out) {
  if (!has_model_ || window_.size() == 0) return false;
  solver_.model().set_time(options_.mode == Mode::live ? live_.time() : window_.size() - 1);
  OutputTask task = {};
  task.model = &solver_.model();
  task.output = Output::background;
  task.constant_alpha = 255;
  // The background needs no frame, but rows of one are skipped over.
  for (int c = 0; c < kChannels; ++c) task.x[c] = window_.plane(window_.slot(0), c);
  write_output(task, out, 0, height_);
  return true;
}

void Engine::pop(Output output, const MutableImageView& out) {
  if (ready_ == 0) return;
  const Stopwatch watch(&stretch_seconds_);
  const OutputTask task = next_task(output);
  if (side_->idle())
    for_bands(*pool_, width_, height_,
              [&](int first, int count) { write_output(task, out, first, count); });
  else
    write_output(task, out, 0, height_);
  --pending_;
  --ready_;
}

}  // namespace qdmd
