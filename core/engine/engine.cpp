#include "core/engine/engine.h"

#include <algorithm>
#include <string>
#include <utility>

#include "core/engine/batch_schedule.h"
#include "core/engine/live_schedule.h"
#include "core/passes/bands.h"
#include "core/passes/read_samples.h"
#include "core/passes/residual.h"

namespace qdmd {

// What an exception leaves half done is dropped.
template <typename Action>
auto Engine::flushed_if_it_throws(Action action) {
  try {
    return action();
  } catch (...) {
    flush();
    throw;
  }
}

Status Engine::configure(const EngineOptions& options, int width, int height) try {
  const Status status = check_options(options, width, height);
  if (!status.ok()) return status;
  // The old window goes first: two at once would break the promise of max-memory.
  close();
  options_ = options;
  layout_ = layout_of(options, width, height);
  const Band band = band_of(options, width, height);
  auto learner = learner_of(options, width, height);
  const bool live = options.mode == Mode::live;
  const LivePlan plan = plan_of(options, width, height);
  // What members tell each other has one order.
  workers_ = std::make_unique<Workers>(options.threads, !options.team);
  const uint64_t beside = layout_.bytes - layout_.store_bytes;
  frames_ =
      FrameStore(layout_.capacity, width, band, learner->contents(), options.max_memory - beside);
  // Its pages are touched once somebody wants more than the background.
  next_chroma_ = std::make_unique_for_overwrite<uint8_t[]>(
      room_for_planes(frames_.window().shape(), options.depth));
  pace_.begin(front_of_efforts(learner->sample_steps()),
              live ? plan.hop_size() : options.window_size);
  background_ = std::make_unique<Background>(
      std::move(learner),
      LearnerRoom{&frames_, options.window_size, models_of(options.mode, layout_.late_frames),
                  &workers_->pool(), &clock_},
      options.colours, options.steps, options.levels);
  if (options.mask_softness > 0) soft_mask_ = std::make_unique<SoftMask>(width, height);
  pass_wishes();
  background_->learner().set_absorb_frames(absorb_frames_);
  if (options.stabilize != Stabilize::off) {
    stabilizer_ = std::make_unique<Stabilizer>(options.stabilize, options.colours, width, height);
    restorer_ = std::make_unique<Restorer>(width, height, options.depth);
  }
  const Stage stage = {&frames_, background_.get(), workers_.get(), &pace_,
                       &clock_,  stabilizer_.get(), restorer_.get()};
  if (live)
    schedule_ = std::make_unique<LiveSchedule>(stage, plan);
  else
    schedule_ = std::make_unique<BatchSchedule>(stage, options.window_size, layout_.late_frames);
  return {};
} catch (...) {
  close();
  throw;
}

void Engine::close() {
  flush();
  schedule_.reset();
  // Its threads end before what they work on.
  workers_.reset();
  background_.reset();
  soft_mask_.reset();
  stabilizer_.reset();
  restorer_.reset();
  frames_ = FrameStore();
  next_chroma_.reset();
}

void Engine::flush() {
  queue_ = {};
  decided_ = softened_ = read_ = false;
  if (schedule_) {
    schedule_->restart();
    background_->forget();
    if (soft_mask_) soft_mask_->forget();
  }
  pace_.restart();
}

void Engine::begin_anew() {
  if (!configured() || pending() > 0) return;
  background_->forget();
  schedule_->go_on();
}

Status Engine::push(const ImageView& frame) {
  if (!configured())
    return {Status::Code::not_configured, "configure the engine before pushing frames"};
  if (ready())
    return {Status::Code::frames_are_waiting, "pop the frames that are ready before pushing more"};
  if (frame.width != frames_.width() || frame.height != frames_.height())
    return {Status::Code::invalid_options, "configure the engine anew for frames of another size"};
  if (frame.bits.depth != options_.depth)
    return {Status::Code::invalid_options, "configure the engine anew for samples of other depth"};
  const Clock::Span span(clock_, Clock::frames);
  const Spacing chroma = frame.spacing(1);
  const ChromaShape& shape = frames_.window().shape();
  if (shape.is_shared() && (chroma.columns != shape.columns || chroma.rows != shape.rows))
    return {Status::Code::invalid_options,
            "configure the engine anew for frames whose pixels share other samples"};
  return flushed_if_it_throws([&]() -> Status {
    workers_->follow();
    schedule_->begin_push();
    if (schedule_->push(frame, freeze_, &queue_)) return {};
    flush();
    return alpha_refused();
  });
}

Status Engine::alpha_refused() const {
  return {
      Status::Code::too_much_memory,
      "A window-size of " + describe(options_, frames_.width(), frames_.height()) +
          " whose alpha varies needs " +
          std::to_string(layout_.bytes - layout_.store_bytes + frames_.bytes_with_alpha()) +
          " bytes and max-memory allows " + std::to_string(options_.max_memory) +
          ": lower window-size, scale the video down, take the alpha out, or raise max-memory."};
}

Status Engine::drain() {
  if (!configured())
    return {Status::Code::not_configured, "configure the engine before draining it"};
  const Clock::Span span(clock_, Clock::frames);
  return flushed_if_it_throws([&]() -> Status {
    schedule_->drain(&queue_);
    // An old background says nothing of what comes after.
    pace_.solve_next();
    return {};
  });
}

uint64_t Engine::bytes() const {
  if (!configured()) return 0;
  const uint64_t soft = soft_mask_ ? SoftMask::bytes(frames_.width(), frames_.height()) : 0;
  return layout_.bytes - layout_.store_bytes - layout_.soft_bytes + frames_.bytes() + soft;
}

void Engine::set_foreground_threshold(double threshold) {
  options_.foreground_threshold = threshold;
  pass_wishes();
}

void Engine::set_ignored(const IgnoredAreas& areas) {
  ignored_ = areas;
  pass_wishes();
}

void Engine::set_masks_expected(bool expected) {
  masks_expected_ = expected;
  pass_wishes();
}

void Engine::pass_wishes() {
  if (background_)
    background_->set_wishes({options_.foreground_threshold, masks_expected_, ignored_, shadows_});
}

void Engine::set_threads(int threads) {
  if (workers_) workers_->ask_for(threads);
}

void Engine::set_absorb_frames(int64_t frames) {
  absorb_frames_ = frames;
  if (background_) background_->learner().set_absorb_frames(frames);
}

void Engine::set_shadows(Shadows shadows) {
  shadows_ = shadows;
  pass_wishes();
}

// What is needed for a picture of L at the time that it is set to.
OutputTask Engine::task_of(Output output) {
  OutputTask task = {};
  // The background needs no frame, but rows of one are skipped over.
  for (int c = 0; c < kChannels; ++c) task.x[c] = frames_.window().plane(0, 0);
  task.model = &background_->model();
  task.output = output;
  task.constant_alpha = static_cast<uint16_t>((1 << frames_.depth()) - 1);
  return task;
}

// What is needed for the next frame's pictures, without a mask.
OutputTask Engine::next_task(Output output) {
  const int index = frames_.size() - queue_.pending, slot = frames_.slot(index);
  schedule_->show(index);
  OutputTask task = task_of(output);
  if (output != Output::background) name_planes(slot, &task);
  task.alpha = frames_.alpha(slot);
  task.constant_alpha = frames_.constant_alpha(slot);
  return task;
}

// Where their samples are, or are going to be.
void Engine::name_planes(int slot, OutputTask* task) {
  next_ = PlaneRows(frames_.window().picture(slot), next_chroma_.get());
  for (int c = 0; c < kChannels; ++c) task->x[c] = next_.samples(c);
}

// Where pixels share samples, once a frame.
void Engine::read_next() {
  if (!read_) next_.read_all(workers_->idle_pool());
  read_ = true;
}

// Once a frame.
void Engine::decide_next(OutputTask* task) {
  if (!decided_) background_->decide(next_, workers_->idle_pool());
  decided_ = read_ = true;
  task->mask = background_->decision().mask();
  task->shaded = background_->decision().shaded();
}

// Once a frame.
void Engine::soften(OutputTask* task) {
  if (!soft_mask_) soft_mask_ = std::make_unique<SoftMask>(frames_.width(), frames_.height());
  const SoftEdge edge = {options_.mask_softness, background_->report().foreground.threshold};
  const uint8_t* const x[3] = {task->x[0].high, task->x[1].high, task->x[2].high};
  if (!softened_)
    soft_mask_->make(background_->decision(), x, edge, ignored_, workers_->idle_pool());
  softened_ = true;
  task->mask = soft_mask_->alpha();
  task->soft = true;
}

Pose Engine::next_pose() const {
  return queue_.pending > 0 ? frames_.pose(frames_.slot(frames_.size() - queue_.pending)) : Pose();
}

// From the canvas to where the next frame's camera looked. level: L is needed.
void Engine::return_to_frame(OutputTask* task, bool level) {
  const Pose pose = next_pose();
  if (pose.is_rest() || stabilize_output_) return;
  const int slot = frames_.slot(frames_.size() - queue_.pending);
  for (int c = 0; c < kChannels; ++c) task->x[c] = frames_.untouched(slot, c);
  Resampler* const resampler = &stabilizer_->resampler();
  Pool* const pool = workers_->idle_pool();
  if (level) {
    restorer_->write_canvas(*task->model, frames_.window().pixels(), pool);
    restorer_->restore_level(pose, task->x, resampler, pool);
    for (int c = 0; c < kChannels; ++c) task->level[c] = restorer_->level(c);
    task->level_stride = static_cast<size_t>(frames_.width());
  }
  // What is ignored has its place in the frame.
  const auto ignore = [&](uint8_t* mask) {
    ignored_.clear_rows(0, frames_.height(), frames_.width(), mask);
    return mask;
  };
  if (task->mask)
    task->mask = ignore(restorer_->restore_mask(pose, task->mask, !task->soft, resampler, pool));
  if (task->shaded)
    task->shaded = ignore(restorer_->restore_shaded(pose, task->shaded, resampler, pool));
}

void Engine::foreground(uint8_t* mask, uint8_t* residual) {
  if (!ready()) return;
  const Clock::Span span(clock_, Clock::frames);
  flushed_if_it_throws([&] {
    OutputTask task = next_task(Output::mask);
    decide_next(&task);
    return_to_frame(&task, true);
    std::copy_n(task.mask, frames_.window().pixels(), mask);
    const auto width = static_cast<size_t>(frames_.width());
    for (int y = 0; y < frames_.height(); ++y) {
      const size_t first = static_cast<size_t>(y) * width;
      const uint8_t* const x[3] = {task.x[0].high + first, task.x[1].high + first,
                                   task.x[2].high + first};
      const uint8_t* level[3];
      background_->decision().level(y, level);
      for (int c = 0; task.level[0] && c < kChannels; ++c) level[c] = task.level[c].high + first;
      residual_norm(x, level, width, residual + first);
    }
  });
}

bool Engine::write_background(const MutableImageView& out) {
  if (!configured() || !background_->known()) return false;
  schedule_->show_newest();
  write_picture(task_of(Output::background), options_.levels, out, band().own_begin(),
                band().own_rows());
  return true;
}

bool Engine::learnt(Learnt* learnt) {
  if (!configured() || !background_->known() || !band().is_whole()) return false;
  // What it threw, the next frame is told.
  workers_->rest();
  schedule_->show_newest();
  Learnt all;
  all.width = frames_.width();
  all.height = frames_.height();
  background_->remember(&all);
  *learnt = std::move(all);
  return true;
}

Status Engine::may_learn_from(const Learnt& learnt) const {
  if (!configured()) return {Status::Code::not_configured, "configure the engine before it learns"};
  if (!band().is_whole())
    return {Status::Code::invalid_options, "processes that share a window load no background"};
  if (learnt.width != frames_.width() || learnt.height != frames_.height())
    return {Status::Code::invalid_options,
            "it is the background of " + std::to_string(learnt.width) + "x" +
                std::to_string(learnt.height) + " video and this video is " +
                std::to_string(frames_.width()) + "x" + std::to_string(frames_.height()) +
                ": scale the video, or save the background of video of this size."};
  return {};
}

Status Engine::learn_from(const Learnt& learnt) {
  if (Status status = may_learn_from(learnt); !status.ok()) return status;
  workers_->rest();
  schedule_->learn_from(learnt, queue_);
  return {};
}

void Engine::write(Output output, const Levels& levels, const MutableImageView& out) {
  if (!ready()) return;
  const Clock::Span span(clock_, Clock::frames);
  flushed_if_it_throws([&] {
    OutputTask task = next_task(output);
    const bool masked = output == Output::mask || output == Output::cutout;
    if (masked)
      decide_next(&task);
    else if (output != Output::background)
      read_next();
    if (decided_ && !masked && !out.bits.is_deep()) {
      const uint8_t* level[3];
      background_->decision().level(0, level);
      std::copy_n(level, kChannels, task.level);
      task.level_stride = background_->decision().level_stride();
    }
    if (masked && options_.mask_softness > 0) soften(&task);
    return_to_frame(&task, output == Output::background || output == Output::foreground);
    const int top = band().own_begin(), height = band().own_rows(), together = rows_together(out);
    const int steps = (height + together - 1) / together;
    const auto write = [&](int first, int count) {
      const int row = first * together;
      write_picture(task, levels, out, top + row, std::min(count * together, height - row));
    };
    for_rows(workers_->idle_pool(), steps, frames_.window().pixels(), write);
  });
}

const uint8_t* Engine::whole_mask() {
  if (!ready()) return nullptr;
  const Clock::Span span(clock_, Clock::frames);
  return flushed_if_it_throws([&] {
    OutputTask task = next_task(Output::mask);
    decide_next(&task);
    return background_->decision().whole_mask();
  });
}

void Engine::skip() {
  if (!ready()) return;
  flushed_if_it_throws([&] { schedule_->leave(queue_); });
  if (soft_mask_ && !softened_) soft_mask_->forget();
  --queue_.pending;
  --queue_.ready;
  decided_ = softened_ = read_ = false;
}

void Engine::pop(Output output, const MutableImageView& out) {
  write(output, options_.levels, out);
  skip();
}

}  // namespace qdmd
