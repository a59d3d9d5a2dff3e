// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/gram_learner.h"

#include <algorithm>
#include <utility>

#include "core/dmd/qdmd.h"
#include "core/model/build_spread.h"
#include "core/passes/sampling.h"
#include "core/planes/read_ahead.h"

namespace qdmd {
namespace {

// The coarsest step that moved the background of no sequence of docs/sampling.md by more than 0.1
// level: there is none above 1.
constexpr int kChosenStep = 1;

// Pixels whose share of a pass is worth waking a thread for.
constexpr size_t kPixelsPerPart = 16384;

constexpr size_t kUnit = BackgroundModel::kSliceUnit;

// Turns a summary in units of the lowest of so many bits into one in levels. Sensitivity is a
// ratio.
void put_in_levels(int depth, DmdSummary* summary) {
  if (depth == 8) return;
  const double unit = 1.0 / (1 << bits_below(depth));
  summary->rounding_bound *= unit;
  if (!summary->spectrum) return;
  auto spectrum = *summary->spectrum;
  for (SpectrumMode& mode : spectrum) mode.amplitude *= unit;
  summary->spectrum = std::make_shared<const std::vector<SpectrumMode>>(std::move(spectrum));
}

}  // namespace

GramLearner::GramLearner(const LearnOptions& options, int width, int height)
    : options_(options),
      width_(width),
      height_(height),
      step_(options.sample_step > 0 ? options.sample_step : kChosenStep) {}

// Solvers that read pixels want each to have its own samples.
bool GramLearner::keeps_shared() const {
  return options_.keeps_shared() && options_.depth == 8 &&
         (options_.method == Method::dmd ||
          (options_.dmd.solver != Solver::qr && options_.dmd.solver != Solver::adjoint));
}

FrameContents GramLearner::contents() const {
  FrameContents contents;
  contents.sample_step = step_;
  contents.first_sample = (step_ - options_.first_row % step_) % step_;
  contents.depth = options_.depth;
  if (!keeps_shared()) return contents;
  contents.chroma_columns = options_.chroma_columns;
  contents.chroma_rows = options_.chroma_rows;
  return contents;
}

uint64_t GramLearner::bytes(int window_size, int capacity, Models models, int threads) const {
  const auto pixels = static_cast<size_t>(width_) * static_cast<size_t>(height_);
  DmdOptions dmd = options_.dmd;
  if (models == Models::two_of_live) dmd.max_modes = BackgroundModel::most_modes(window_size);
  const int pictures = options_.method == Method::dmd ? most_channel_pictures(dmd, window_size)
                                                      : most_pictures(dmd, window_size);
  const double seen = pixels_seen();
  const ChromaShape shape =
      step_ == 1 && keeps_shared()
          ? ChromaShape{width_, height_, options_.chroma_columns, options_.chroma_rows}
          : ChromaShape{};
  // One after the other: the decomposition, and pictures from chroma that is spread.
  const uint64_t decomposition = options_.method == Method::dmd
                                     ? channel_decomposition_bytes(dmd, window_size)
                                     : decomposition_bytes(dmd, seen, window_size);
  const uint64_t spread = keeps_shared() ? build_spread_bytes(window_size, threads) : 0;
  const bool keeps_pictures = keeps_shared() || models == Models::two_of_live;
  return SlidingGram::bytes(capacity, threads, shape, options_.depth) +
         std::max<uint64_t>(decomposition, spread) +
         (models == Models::one ? 1 : 2) *
             BackgroundModel::bytes(pixels, window_size, pictures, keeps_pictures, options_.depth);
}

bool GramLearner::may_read_frames(int window_size) const {
  const int pictures = options_.method == Method::dmd
                           ? most_channel_pictures(options_.dmd, window_size)
                           : most_pictures(options_.dmd, window_size);
  return !keeps_shared() && BackgroundModel::may_combine_directly(pictures, window_size);
}

double GramLearner::solve_seconds(int window_size, Models) const {
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
  return static_cast<uint64_t>(adjoint_bytes(pixels_seen(), window_size));
}

double GramLearner::pixels_seen() const {
  return static_cast<double>(sample_count(width_, height_, step_));
}

void GramLearner::begin(const LearnerRoom& room) {
  room_ = room;
  if (room.models == Models::two_of_live)
    options_.dmd.max_modes = BackgroundModel::most_modes(room.window_size);
  const PlaneSlots& samples = room.frames->samples();
  gram_ = SlidingGram(room.frames->capacity(), samples.shape(), samples.depth(), room.pool);
}

// What the decomposition sees has samples that pixels share.
bool GramLearner::shares_chroma() const { return room_.frames->samples().shape().is_shared(); }

SnapshotRange GramLearner::columns_of(const SnapshotRange& snapshots) const {
  return snapshots.in(room_.frames->samples());
}

void GramLearner::add(const SnapshotRange& span, int frames, Slice slice) {
  const Clock::Span span_of_time(*room_.clock, Clock::products);
  const SnapshotRange columns = columns_of(span);
  if (columns.on_disk()) return add_in_parts(columns, frames, slice);
  const Lines all = lines_of(columns, slice);
  // The first slice begins a group, however thin it is.
  if (slice.index == 0 || all.count > 0) add_lines(columns, frames, all);
}

// What slices are made of: rows of shared samples, or samples.
GramLearner::Lines GramLearner::lines_of(const SnapshotRange& columns, Slice slice) const {
  if (shares_chroma()) {
    const auto rows = static_cast<size_t>(columns.shape().chroma_height());
    return {slice.first(rows, 1), slice.size(rows, 1)};
  }
  return {slice.first(columns.plane_size(), kUnit), slice.size(columns.plane_size(), kUnit)};
}

void GramLearner::add_lines(const SnapshotRange& columns, int frames, Lines lines) {
  if (shares_chroma())
    gram_.add_rows(columns, frames, static_cast<int>(lines.first), static_cast<int>(lines.count));
  else
    gram_.add_slice(columns, frames, lines.first, lines.count);
}

// All products of a few pixels, and then those of the next ones: each pixel comes from the disk
// once, where one group of frames after another would read the window for each of them.
void GramLearner::add_in_parts(const SnapshotRange& columns, int frames, Slice slice) {
  const Lines all = lines_of(columns, slice);
  const ChromaShape& shape = columns.shape();
  const size_t of_line =
      shares_chroma() ? static_cast<size_t>(shape.width) * static_cast<size_t>(shape.rows) : 1;
  const size_t unit = shares_chroma() ? 1 : kUnit;
  ReadAhead ahead(columns, 1);
  const size_t part = std::max<size_t>(1, ahead.part() / of_line / unit) * unit;
  for (size_t done = 0; done == 0 || done < all.count; done += part) {
    const Lines lines = {all.first + done, std::min(part, all.count - done)};
    const size_t first = lines.first * of_line;
    if (first < columns.pixels())
      ahead.read(0, first, std::min(lines.count * of_line, columns.pixels() - first));
    add_lines(columns, frames, lines);
  }
}

void GramLearner::decompose(const SnapshotRange& snapshots) {
  const double products = room_.clock->spent().of(Clock::products);
  const double before = room_.clock->spent().of(Clock::solving);
  {
    const Clock::Span span_of_time(*room_.clock, Clock::solving);
    const SnapshotRange columns = columns_of(snapshots);
    auto pixels = static_cast<int64_t>(columns.pixels());
    if (options_.add) options_.add({&pixels, 1});
    // What a decomposition no longer needs of it, it gives back.
    IntegerMatrix gram = options_.add ? gram_.matrix(columns, options_.add) : gram_.matrix(columns);
    Decomposition decomposition =
        options_.method == Method::dmd
            ? decompose_channels(gram, options_.dmd)
            : qdmd::decompose(columns, std::move(gram), options_.dmd, static_cast<double>(pixels));
    decomposed_ = {};
    decomposed_.dmd = decomposition.summary;
    put_in_levels(options_.depth, &decomposed_.dmd);
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
    if (snapshots_->shape().is_shared())
      model->begin_from(snapshots_->size(), snapshots_->pixels(), background_);
    else
      model->begin(*snapshots_, background_, room_.models == Models::two_of_live);
  }
  const size_t first = slice.first(snapshots_->pixels(), kUnit),
               length = slice.size(snapshots_->pixels(), kUnit);
  if (snapshots_->shape().is_shared()) {
    build_spread(*snapshots_, first, length, room_.pool, model);
    return;
  }
  const auto parts = static_cast<int>(std::max<size_t>(1, length / kPixelsPerPart));
  ReadAhead ahead(*snapshots_, room_.pool->threads());
  room_.pool->run(static_cast<size_t>(parts), [&](size_t part, size_t worker) {
    const Slice piece = {static_cast<int>(part), parts};
    const size_t begin = first + piece.first(length, kUnit), count = piece.size(length, kUnit);
    ahead.read(worker, begin, count);
    model->build_slice(begin, count);
  });
}

}  // namespace qdmd
