#include "core/background/window_solver.h"

#include "core/background/stopwatch.h"
#include "core/dmd/decompose.h"

namespace qdmd {
namespace {

// Pixels whose share of a pass is worth waking a thread for.
constexpr size_t kPixelsPerPart = 16384;

size_t sampled(int size, int step) { return static_cast<size_t>((size + step - 1) / step); }

// Where slice `index` of `count` begins.
size_t slice_start(size_t length, int index, int count) {
  if (index == count) return length;
  const size_t units = length / BackgroundModel::kSliceUnit;
  return units * static_cast<size_t>(index) / static_cast<size_t>(count) *
         BackgroundModel::kSliceUnit;
}

}  // namespace

uint64_t WindowSolver::sample_bytes(int capacity, int width, int height, int sample_step) {
  if (sample_step <= 1) return 0;
  return Window::bytes(capacity, sampled(width, sample_step) * sampled(height, sample_step));
}

WindowSolver::WindowSolver(const DmdOptions& options, int iterations, int capacity, int width,
                           int height, int sample_step, bool keep_pictures, Pool* pool)
    : options_(options),
      width_(width),
      height_(height),
      sample_step_(sample_step),
      iterations_(iterations),
      keep_pictures_(keep_pictures),
      pool_(pool) {
  if (robust()) {
    robust_ = RobustSolver(options, iterations, sample_step, capacity, width, height, pool);
    return;
  }
  gram_ = SlidingGram(capacity, pool);
  if (sample_step_ > 1)
    samples_ = Window(capacity, sampled(width, sample_step) * sampled(height, sample_step));
}

void WindowSolver::clear() {
  samples_.clear();
  gram_seconds_ = 0;
  appended_ = 0;
}

void WindowSolver::append(const Window& window) {
  const int slot = window.slot(window.size() - 1);
  if (robust()) robust_.append(window, slot);
  ++appended_;
  if (robust() || sample_step_ == 1) return;
  samples_.append();
  for (int c = 0; c < kChannels; ++c) {
    uint8_t* to = samples_.plane(slot, c);
    for (int row = 0; row < height_; row += sample_step_) {
      const uint8_t* from = window.plane(slot, c) + static_cast<ptrdiff_t>(row) * width_;
      for (int col = 0; col < width_; col += sample_step_) *to++ = from[col];
    }
  }
}

void WindowSolver::add_to_gram(const SnapshotRange& span, int frames, int index, int count) {
  if (robust()) return;
  const Stopwatch watch(&gram_seconds_);
  const SnapshotRange columns = sample_step_ > 1 ? span.in(samples_) : span;
  const size_t first = slice_start(columns.plane_size(), index, count);
  gram_.add_slice(columns, frames, first,
                  slice_start(columns.plane_size(), index + 1, count) - first);
}

void WindowSolver::decompose(const SnapshotRange& snapshots) {
  decomposed_ = SolveReport();
  const Stopwatch watch(&decomposed_.solve_time);
  if (!robust()) {
    const SnapshotRange columns = sample_step_ > 1 ? snapshots.in(samples_) : snapshots;
    Decomposition decomposition = qdmd::decompose(columns, gram_.matrix(columns), options_);
    decomposed_.dmd = decomposition.summary;
    background_ = std::move(decomposition.background);
  }
  decomposed_.window_frames = snapshots.size();
  decomposed_.sample_step = sample_step_;
  decomposed_.iterations = robust() ? iterations_ : 1;
  decomposed_.gram_time = gram_seconds_;
  gram_seconds_ = 0;
  snapshots_ = snapshots;
  fresh_ = std::min(1.0f, static_cast<float>(appended_) / static_cast<float>(snapshots.size()));
  appended_ = 0;
}

void WindowSolver::build(int index, int count) {
  if (index == 0) {
    next_report_ = decomposed_;
    if (robust()) {
      next_report_.dmd = robust_.solve(*snapshots_, fresh_, &models_[next()]);
      next_report_.cost = robust_.cost();
      next_report_.solve_time = next_report_.cost.sum();
    } else {
      models_[next()].begin(*snapshots_, background_, keep_pictures_);
    }
  }
  if (robust()) return;
  const size_t pixels = snapshots_->pixels();
  const size_t first = slice_start(pixels, index, count);
  const size_t length = slice_start(pixels, index + 1, count) - first;
  const auto parts = static_cast<int>(std::max<size_t>(1, length / kPixelsPerPart));
  pool_->run(static_cast<size_t>(parts), [&](size_t part) {
    const size_t start = slice_start(length, static_cast<int>(part), parts);
    models_[next()].build_slice(first + start,
                                slice_start(length, static_cast<int>(part) + 1, parts) - start);
  });
}

void WindowSolver::finish(double fixed_threshold) {
  next_report_.foreground = foreground_statistics(*snapshots_, models_[next()], fixed_threshold);
}

void WindowSolver::set_effort(const Effort& effort) {
  if (!robust()) return;
  sample_step_ = effort.sample_step;
  iterations_ = effort.iterations;
  robust_.set_effort(effort.iterations, effort.sample_step);
}

void WindowSolver::follow_light(int slot) {
  if (robust()) model().set_light(robust_.light(slot));
}

void WindowSolver::publish() {
  newest_ = next();
  if (robust()) robust_.publish();
  report_ = next_report_;
}

}  // namespace qdmd
