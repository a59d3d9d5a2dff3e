// SPDX-License-Identifier: LGPL-2.1-or-later
// The start of a window's solve: a background picture of the frames that show it.
#include <algorithm>
#include <array>
#include <memory>
#include <numeric>

#include "core/learn/robust/window_solve.h"

namespace qdmd {
namespace {

// Levels, of each spread in steps of 1/4 level.
using Limits = std::array<uint8_t, 256>;

Limits limits_of_spreads(int spreads, int least) {
  Limits limits;
  for (int wide = 0; wide < 256; ++wide)
    limits[static_cast<size_t>(wide)] =
        static_cast<uint8_t>(std::clamp((spreads * wide + 3) / 4, least, 255));
  return limits;
}

}  // namespace

// The frames and what was seen before, in the light of this window.
WindowSolve::Looks WindowSolve::gather(const Known& known) {
  const SnapshotRange& snapshots = window_->snapshots;
  const size_t cells = context_.grid.cells();
  const FrameMemory& memory = *known.memory;
  const int m = snapshots.size();
  Looks looks;
  const int old = looks.old = memory.older_than(window_->first);
  choose_shown(known, old);
  GridFrames& here = looks.median;
  WindowLight light = {{}, false};
  const auto find_light = [&] {
    light = light_of(cells_of_shown(), static_cast<int>(shown_.size()), context_.room.pool, &here);
  };
  const bool nothing_known = !known.earlier->known() || known.history->young();
  if (shown_.empty()) {
    here = known.earlier->cells();
  } else {
    find_light();
    if (nothing_known && leave_out_disturbed(light, here)) find_light();
  }
  const int shown = static_cast<int>(shown_.size());
  const GridPictures frames = cells_of_shown();
  gains_.assign(static_cast<size_t>(m), kSameLight);
  for (size_t i = 0; i < shown_.size(); ++i)
    gains_[static_cast<size_t>(shown_[i])] = context_.of_format(light.gains[i]);
  carry_gains();
  clips_ = light.clips;
  Gain of_earlier = kSameLight;
  if (known.earlier->known()) {
    of_earlier = light_of_earlier(*known.earlier, here);
    clips_ = clips_ || has_ends(*known.earlier, of_earlier, here);
    if (clips_) {
      take_unit_of(known.earlier->cells(), of_earlier, &here);
      of_earlier = light_of_earlier(*known.earlier, here);
    }
  }

  const int of_window = std::min(shown, context_.parameters.start_frames);
  looks.count = of_window + old;
  looks.pictures.resize(static_cast<size_t>(looks.count));
  if (old > 0) {
    std::vector<LightScratch> scratch;
    for (size_t i = 0; i < context_.room.pool->threads(); ++i) scratch.emplace_back(cells);
    context_.room.pool->run(static_cast<size_t>(old), [&](size_t i, size_t worker) {
      const int k = static_cast<int>(i);
      looks.pictures[i] = {
          {memory.plane(k, 0), memory.plane(k, 1), memory.plane(k, 2)},
          context_.of_format(light_over(memory.cells(), memory.slot(k), here, 0, &scratch[worker])),
          memory.shape()};
    });
    for (int k = 0; k < old; ++k) {
      clips_ |= at_end(memory.cells(), memory.slot(k), looks.pictures[static_cast<size_t>(k)].gain);
      looks.cells.push_back(memory.cells().plane(memory.slot(k), 0));
      looks.numbers.push_back(memory.number(k));
    }
  }
  for (int i = 0; i < of_window; ++i) {
    const auto at = static_cast<int>(int64_t{i} * shown / of_window);
    const int t = shown_[static_cast<size_t>(at)];
    looks.pictures[static_cast<size_t>(old + i)] = {
        {snapshots.plane(t, 0), snapshots.plane(t, 1), snapshots.plane(t, 2)},
        gains_[static_cast<size_t>(t)],
        snapshots.shape()};
    looks.cells.push_back(frames.plane(at, 0));
    looks.numbers.push_back(window_->number(t));
    looks.snapshots.push_back(t);
  }
  if (!known.earlier->known()) return looks;
  looks.pictures.push_back(known.earlier->picture(of_earlier));
  looks.cells.push_back(known.earlier->cells().plane(0, 0));
  looks.recollection = known.earlier->recollection(context_.parameters.earlier_share *
                                                   static_cast<float>(looks.count));
  looks.recollection.older_frames = of_window > 0 ? old : 0;
  if (known.history->young()) looks.recollection.share.clear();
  return looks;
}

// The camera has no picture yet, or none any more, and other frames of the window have one.
bool WindowSolve::is_black(int slot) const {
  if (!any_black_) return false;
  const GridFrames& cells = context_.room.frames->cells();
  const float* const levels = cells.plane(slot, 0);
  return std::all_of(levels, levels + kChannels * cells.cells(),
                     [](float level) { return level < steps::light::kBlack; });
}

// Frames that something disturbs say nothing, where others do; nor do black ones.
void WindowSolve::choose_shown(const Known& known, int old) {
  const int m = window_->snapshots.size();
  shown_.clear();
  for (int t = 0; t < m; ++t)
    if (!known.earlier->known() || !known.history->disturbances().has(window_->number(t)))
      shown_.push_back(t);
  any_black_ = true;
  const auto shows = std::stable_partition(
      shown_.begin(), shown_.end(), [&](int t) { return !is_black(window_->snapshots.slot(t)); });
  any_black_ = shows != shown_.begin() && shows != shown_.end();
  if (any_black_) shown_.erase(shows, shown_.end());
  if (!shown_.empty() || old > 0) return;
  shown_.resize(static_cast<size_t>(m));
  std::iota(shown_.begin(), shown_.end(), 0);
}

GridPictures WindowSolve::cells_of_shown() const {
  const GridFrames& cells = context_.room.frames->cells();
  GridPictures frames(context_.grid.cells());
  frames.reserve(static_cast<int>(shown_.size()));
  for (int t : shown_) frames.add(cells.plane(window_->snapshots.slot(t), 0));
  return frames;
}

// In a first window nobody knows yet what is usual: most of its frames say that. Frames that differ
// from the median in much more of the picture, from one frame to the next, say nothing of the
// background (disturbances.h). They are a third at most. median: of those in shown_, in unit light.
// False where there are none.
bool WindowSolve::leave_out_disturbed(const WindowLight& light, const GridFrames& median) {
  const size_t cells = context_.grid.cells();
  const GridPictures frames = cells_of_shown();
  std::vector<double> shares(shown_.size());
  for (size_t i = 0; i < shares.size(); ++i) {
    const int frame = static_cast<int>(i);
    const Gain& gain = light.gains[i];
    size_t differing = 0;
    for (size_t cell = 0; cell < cells; ++cell) {
      const auto found = unclipped(
          {frames.plane(frame, 0)[cell], frames.plane(frame, 1)[cell],
           frames.plane(frame, 2)[cell]},
          {median.plane(0, 0)[cell], median.plane(0, 1)[cell], median.plane(0, 2)[cell]}, gain);
      float apart = 0;
      for (size_t c = 0; c < kChannels; ++c)
        apart += std::abs(found[c] / gain[c] - median.plane(0, static_cast<int>(c))[cell]);
      differing += apart > kChannels * steps::contours::kLooksDiffer;
    }
    shares[i] = static_cast<double>(differing) / static_cast<double>(cells);
  }
  std::vector<double> sorted = shares;
  const auto middle = sorted.begin() + static_cast<ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  // Behind leaves frames are always so.
  if (*middle > steps::disturbance::kLeast) return false;
  const double most = *middle + steps::disturbance::kLeast;
  // Objects come and go in steps. What was there before the window, or is after it, may stand there
  // for long, unless it is more than an object.
  std::vector<uint8_t> disturbed(shares.size());
  for (size_t first = 0; first < shares.size();) {
    size_t end = first;
    while (end < shares.size() && shares[end] > most) ++end;
    using steps::disturbance::kAtOnce, steps::proofs::kMostOfPicture;
    if (end > first) {
      const bool begins = first > 0 && shares[first] - shares[first - 1] > kAtOnce,
                 ends = end < shares.size() && shares[end - 1] - shares[end] > kAtOnce;
      const double least = *std::min_element(shares.begin() + static_cast<ptrdiff_t>(first),
                                             shares.begin() + static_cast<ptrdiff_t>(end));
      const bool is_all = (begins || ends) && least - *middle > kMostOfPicture;
      if ((begins && ends) || is_all)
        std::fill_n(disturbed.data() + first, end - first, uint8_t{1});
    }
    first = std::max(end, first + 1);
  }
  // What most frames show may be somebody who stands there.
  const auto all = std::count(disturbed.begin(), disturbed.end(), 1);
  if (all == 0 || 3 * all > std::ssize(disturbed)) return false;
  size_t i = 0;
  std::erase_if(shown_, [&](int) { return disturbed[i++] != 0; });
  return true;
}

bool WindowSolve::is_shown(int64_t number) const {
  const int64_t t = (number - window_->first) / window_->stride;
  const auto has = [&](int64_t at) {
    return at >= window_->snapshots.size() ||
           std::binary_search(shown_.begin(), shown_.end(), static_cast<int>(at));
  };
  return has(t) && (window_->number(static_cast<int>(t)) == number || has(t + 1));
}

// The background picture of the stable frames, its thresholds, and the light of each frame.
void WindowSolve::start(const Known& known) {
  Looks looks = gather(known);
  find_curves(&looks);
  const size_t cells = context_.grid.cells();
  // Cells in unit light: as they are, where that is theirs. Memory that nobody needs is not
  // touched.
  const size_t of_picture = kChannels * cells;
  const auto unlit = std::make_unique_for_overwrite<float[]>(looks.pictures.size() * of_picture);
  GridPictures chosen(cells);
  chosen.reserve(static_cast<int>(looks.pictures.size()));
  for (size_t i = 0; i < looks.pictures.size(); ++i) {
    const Gain& gain = looks.pictures[i].gain;
    if (!is_lit(gain)) {
      chosen.add(looks.cells[i]);
      continue;
    }
    float* const to = unlit.get() + i * of_picture;
    for (size_t c = 0; c < kChannels; ++c) {
      const float inverse = 1 / gain[c];
      const float* const channel = looks.cells[i] + c * cells;
      std::transform(channel, channel + cells, to + c * cells,
                     [inverse](float level) { return level * inverse; });
    }
    looks.curves[i].bend(cells, to);
    if (clips_) unclip(looks.cells[i], looks.median, gain, to);
    chosen.add(to);
  }
  const bool recalls = known.earlier->known();
  const FirstLooks first_looks = known.history->first_looks(looks.numbers, recalls);
  stable_ = find_stable_frames(context_.grid, chosen, looks.count,
                               recalls ? &looks.recollection : nullptr, context_.room.pool,
                               first_looks, &stable_room_, known.history->held());
  if (stable_.another_scene && looks.old > 0) {
    known.memory->forget();
    known.earlier->forget();
    start(known);
    return;
  }
  start_frames_ = looks.count;
  compared_ = looks.snapshots;
  if (clips_) prefer_darker(looks, chosen);
  take_background(looks, *known.earlier);
}

void WindowSolve::take_background(const Looks& looks, const EarlierWindow& earlier) {
  uint8_t* background[kChannels];
  for (size_t c = 0; c < kChannels; ++c) background[c] = reference_.level[c].data();
  const bool any_curve = std::any_of(looks.curves.begin(), looks.curves.end(),
                                     [](const LightCurve& curve) { return !curve.none(); });
  if (any_curve) choose_curves(looks);
  std::vector<uint8_t> spread(context_.pixels());
  ReadAhead ahead(window_->snapshots, looks.snapshots, context_.room.pool->threads());
  median_picture(context_.grid, stable_, looks.pictures, context_.room.pool, background,
                 spread.data(), context_.range(), &ahead);
  if (any_curve) follow_curves(looks);
  recall_spread(earlier, &spread);
  blur(spread.data(), reference_.width, reference_.height, context_.room.pool, spread_.data());
  const RobustParameters& parameters = context_.parameters;
  const Limits threshold = limits_of_spreads(parameters.spreads, parameters.least_threshold);
  Limits reach;
  for (int wide = 0; wide < 256; ++wide)
    reach[static_cast<size_t>(wide)] =
        static_cast<uint8_t>(std::max((wide + 4) / 8, parameters.least_reach));
  in_runs([&](size_t first, size_t size) {
    for (size_t p = first; p < first + size; ++p) {
      reference_.threshold[p] = threshold[spread_[p]];
      reach_[p] = reach[spread_[p]];
    }
  });
}

// One picture has no spread: the one that an earlier window found.
void WindowSolve::recall_spread(const EarlierWindow& earlier, std::vector<uint8_t>* spread) const {
  if (!earlier.known()) return;
  for (int row = 0; row < context_.grid.rows; ++row)
    for (int col = 0; col < context_.grid.cols; ++col) {
      const auto frames = stable_.of_cell[static_cast<size_t>(row * context_.grid.cols + col)];
      if (frames.size() > 1 || frames.front() != start_frames_) continue;
      for (int y = context_.grid.top(row); y < context_.grid.top(row + 1); ++y) {
        const ptrdiff_t start = static_cast<ptrdiff_t>(y) * context_.grid.width;
        std::copy(earlier.spread().begin() + start + context_.grid.left(col),
                  earlier.spread().begin() + start + context_.grid.left(col + 1),
                  spread->begin() + start + context_.grid.left(col));
      }
    }
}

void WindowSolve::write_limits(uint8_t* limits) {
  const RobustParameters& parameters = context_.parameters;
  const Limits limit = limits_of_spreads(parameters.spreads, parameters.least_limit);
  in_runs([&](size_t first, size_t size) {
    for (size_t p = first; p < first + size; ++p) limits[p] = limit[spread_[p]];
  });
}

}  // namespace qdmd
