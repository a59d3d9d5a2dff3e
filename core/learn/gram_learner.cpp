#include "core/learn/gram_learner.h"

#include <algorithm>

#include "core/dmd/qdmd.h"
#include "core/passes/sampling.h"

namespace qdmd {
namespace {

// The coarsest step that moved the background of no sequence of docs/sampling.md by more than 0.1
// level: there is none above 1.
constexpr int kChosenStep = 1;

// Pixels whose share of a pass is worth waking a thread for.
constexpr size_t kPixelsPerPart = 16384;

constexpr size_t kUnit = BackgroundModel::kSliceUnit;

}  // namespace

GramLearner::GramLearner(const LearnOptions& options, int width, int height)
    : options_(options),
      width_(width),
      height_(height),
      step_(options.sample_step > 0 ? options.sample_step : kChosenStep) {}

uint64_t GramLearner::bytes(int window_size, int capacity, Models models, int threads) const {
  const auto pixels = static_cast<size_t>(width_) * static_cast<size_t>(height_);
  DmdOptions dmd = options_.dmd;
  if (models == Models::two_of_live) dmd.max_modes = BackgroundModel::most_modes(window_size);
  const int pictures = options_.method == Method::dmd ? most_channel_pictures(dmd, window_size)
                                                      : most_pictures(dmd, window_size);
  const double seen = static_cast<double>(sample_count(width_, height_, step_));
  return SlidingGram::bytes(capacity, threads) +
         (options_.method == Method::dmd ? channel_decomposition_bytes(dmd, window_size)
                                         : decomposition_bytes(dmd, seen, window_size)) +
         (models == Models::one ? 1 : 2) *
             BackgroundModel::bytes(pixels, window_size, pictures, models == Models::two_of_live);
}

bool GramLearner::may_read_frames(int window_size) const {
  const int pictures = options_.method == Method::dmd
                           ? most_channel_pictures(options_.dmd, window_size)
                           : most_pictures(options_.dmd, window_size);
  return BackgroundModel::may_combine_directly(pictures, window_size);
}

double GramLearner::solve_seconds(int window_size) const {
  const double m = window_size, n = static_cast<double>(width_) * height_;
  // The pictures, which read the window once, and a small problem; or a factorization of pixels.
  double seconds = 1e-9 * n * m + 2e-8 * m * m * m;
  if (options_.method == Method::dmd) return seconds;
  switch (options_.dmd.solver) {
    case Solver::gram:
    case Solver::automatic:
      break;
    case Solver::gram_extended:
      seconds += 1e-7 * m * m * m;
      break;
    case Solver::qr:
      seconds += 1e-8 * n * m * m;
      break;
    case Solver::adjoint:
      seconds += 1e-7 * n * m * m;
      break;
  }
  return seconds;
}

uint64_t GramLearner::solver_bytes(int window_size) const {
  if (options_.method == Method::dmd || options_.dmd.solver != Solver::adjoint) return 0;
  return static_cast<uint64_t>(
      adjoint_bytes(static_cast<double>(sample_count(width_, height_, step_)), window_size));
}

void GramLearner::begin(const LearnerRoom& room) {
  room_ = room;
  if (room.models == Models::two_of_live)
    options_.dmd.max_modes = BackgroundModel::most_modes(room.window_size);
  gram_ = SlidingGram(room.frames->capacity(), room.pool);
}

SnapshotRange GramLearner::columns_of(const SnapshotRange& snapshots) const {
  return snapshots.in(room_.frames->samples());
}

void GramLearner::add(const SnapshotRange& span, int frames, Slice slice) {
  const Clock::Span span_of_time(*room_.clock, Clock::products);
  const SnapshotRange columns = columns_of(span);
  gram_.add_slice(columns, frames, slice.first(columns.plane_size(), kUnit),
                  slice.size(columns.plane_size(), kUnit));
}

void GramLearner::decompose(const SnapshotRange& snapshots) {
  const double products = room_.clock->spent().of(Clock::products);
  const double before = room_.clock->spent().of(Clock::solving);
  {
    const Clock::Span span_of_time(*room_.clock, Clock::solving);
    const SnapshotRange columns = columns_of(snapshots);
    Decomposition decomposition =
        options_.method == Method::dmd
            ? decompose_channels(gram_.matrix(columns), options_.dmd)
            : qdmd::decompose(columns, gram_.matrix(columns), options_.dmd);
    decomposed_ = {};
    decomposed_.dmd = decomposition.summary;
    background_ = std::move(decomposition.background);
  }
  decomposed_.window_frames = snapshots.size();
  decomposed_.sample_step = step_;
  decomposed_.gram_time = products - products_told_;
  decomposed_.solve_time = room_.clock->spent().of(Clock::solving) - before;
  products_told_ = products;
  snapshots_ = snapshots;
}

void GramLearner::build(Slice slice, BackgroundModel* model) {
  const Clock::Span span_of_time(*room_.clock, Clock::pictures);
  if (slice.index == 0) {
    built_ = decomposed_;
    model->begin(*snapshots_, background_, room_.models == Models::two_of_live);
  }
  const size_t first = slice.first(snapshots_->pixels(), kUnit),
               length = slice.size(snapshots_->pixels(), kUnit);
  const auto parts = static_cast<int>(std::max<size_t>(1, length / kPixelsPerPart));
  room_.pool->run(static_cast<size_t>(parts), [&](size_t part) {
    const Slice band = {static_cast<int>(part), parts};
    model->build_slice(first + band.first(length, kUnit), band.size(length, kUnit));
  });
}

}  // namespace qdmd
