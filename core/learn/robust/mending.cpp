// What frames put in place of a background's cells between two solves.
#include <algorithm>
#include <utility>

#include "core/learn/robust/robust_learner.h"
#include "core/passes/median_block.h"
#include "core/passes/read_samples.h"

namespace qdmd {

void RobustLearner::mend(const Compared& frame, BackgroundModel* model) {
  const int slot = frame.around.slot(frame.at);
  const GridFrames& cells = room_.frames->cells();
  const float* const now[3] = {cells.plane(slot, 0), cells.plane(slot, 1), cells.plane(slot, 2)};
  const Gain light = model->light(frame.t);
  const BackgroundModel* const of_window = frame.live ? nullptr : model;
  looks_.follow(now, light, frame.number);
  const float* const background[3] = {background_cells_.plane(published_, 0),
                                      background_cells_.plane(published_, 1),
                                      background_cells_.plane(published_, 2)};
  // A window that is solved as a whole knows by itself what was uncovered, unless it was absorbed.
  if (frame.live || absorbed_.any()) {
    std::vector<int> uncovered = looks_.uncovered(background);
    if (looks_.any_news()) calm_ = 0;
    if (!frame.live) std::erase_if(uncovered, [&](int cell) { return !absorbed_.has(cell); });
    mend_uncovered(std::move(uncovered), looks_, frame, light, of_window, model);
  }
  if (absorb_frames_ == 0) return;
  const std::vector<int>& stood = looks_.stood(background, absorb_frames_);
  for (int cell : stood) absorbed_.add(cell, looks_.since(cell));
  if (!stood.empty()) mend(stood, looks_, frame, lit_frames(frame, light, of_window), model);
}

void RobustLearner::look_ahead(const Compared& frame, BackgroundModel* model) {
  if (!looks_ahead(room_.models) || !ahead_.follows()) return;
  const int slot = frame.around.slot(frame.at);
  const GridFrames& cells = room_.frames->cells();
  const float* const now[3] = {cells.plane(slot, 0), cells.plane(slot, 1), cells.plane(slot, 2)};
  const Gain light = model ? this->light(slot) : kSameLight;
  ahead_.follow(now, light, frame.number);
  if (!model || !ahead_.knows_background()) return;
  // What has stood for so long is background, even if it goes.
  if (absorb_frames_ > 0 && frame.number - stream_from_ >= absorb_frames_) return;
  const float* const background[3] = {background_cells_.plane(published_, 0),
                                      background_cells_.plane(published_, 1),
                                      background_cells_.plane(published_, 2)};
  mend_uncovered(ahead_.uncovered(background), ahead_.looks(), frame, light, nullptr, model);
}

// of_window: the model whose window the frames are of, which knows their light; null: they came
// after it.
RobustLearner::LitFrames RobustLearner::lit_frames(const Compared& frame, const Gain& light,
                                                   const BackgroundModel* of_window) {
  // The frame is one of them.
  const int from = frame.at % 2;
  LitFrames lit = {frame.around.newest(frame.around.size() - from).every(2), {}};
  for (int i = 0; i < lit.frames.size(); ++i) {
    const int slot = lit.frames.slot(i), later = from + 2 * i - frame.at;
    lit.at[static_cast<size_t>(i)] = {slot, later == 0  ? light
                                            : of_window ? of_window->light(frame.t + later)
                                                        : this->light(slot)};
  }
  return lit;
}

void RobustLearner::mend_uncovered(std::vector<int> cells, const StandingLooks& looks,
                                   const Compared& frame, const Gain& light,
                                   const BackgroundModel* of_window, BackgroundModel* model) {
  // Nothing is computed where nothing was uncovered.
  if (cells.empty()) return;
  const LitFrames lit = lit_frames(frame, light, of_window);
  looks.leave_out_hidden(room_.frames->cells(), lit.slots(), &cells);
  mend(cells, looks, frame, lit, model);
}

void RobustLearner::mend(const std::vector<int>& cells, const StandingLooks& looks,
                         const Compared& frame, const LitFrames& lit, BackgroundModel* model) {
  if (cells.empty()) return;
  calm_ = 0;
  model->freeze_but_for_light(frame.t);
  replace(cells, looks, lit, model);
  if (options_.depth > 8) replace_deep(cells, lit, model);
}

// replace() with whole samples.
void RobustLearner::replace_deep(const std::vector<int>& cells, const LitFrames& lit,
                                 BackgroundModel* model) const {
  const SnapshotRange& frames = lit.frames;
  const size_t count = static_cast<size_t>(frames.size()), half = count / 2;
  const double unit = 1.0 / (1 << bits_below(frames.depth()));
  for (int cell : cells) {
    const int row = cell / grid_.cols, col = cell % grid_.cols;
    for (int y = grid_.top(row); y < grid_.top(row + 1); ++y)
      for (int x = grid_.left(col); x < grid_.left(col + 1); ++x) {
        const auto p =
            static_cast<size_t>(y) * static_cast<size_t>(grid_.width) + static_cast<size_t>(x);
        float level[kChannels];
        for (int c = 0; c < kChannels; ++c) {
          // In order: there are a few.
          double samples[kMendingFrames];
          for (int t = 0; t < frames.size(); ++t) {
            const Gain& light = lit.at[static_cast<size_t>(t)].light;
            const double sample =
                read_sample(frames, t, c, p) / static_cast<double>(light[static_cast<size_t>(c)]);
            int at = t;
            for (; at > 0 && samples[at - 1] > sample; --at) samples[at] = samples[at - 1];
            samples[at] = sample;
          }
          const double middle = (samples[(count - 1) / 2] + samples[half]) / 2;
          level[c] = static_cast<float>(middle * unit);
        }
        const float* const out[3] = {&level[0], &level[1], &level[2]};
        model->replace(p, 1, out);
      }
  }
}

// The median of the frames in place of the background of these cells.
void RobustLearner::replace(const std::vector<int>& cells, const StandingLooks& looks,
                            const LitFrames& lit, BackgroundModel* model) {
  const SnapshotRange& frames = lit.frames;
  const auto count = static_cast<size_t>(frames.size());
  MedianFrame at[kMendingFrames] = {};  // of blocks of one row
  for (size_t i = 0; i < count; ++i)
    for (size_t c = 0; c < kChannels; ++c) at[i].inverse[c] = 1 / lit.at[i].light[c];
  const auto stride = static_cast<size_t>(grid_.width);
  for (int cell : cells) {
    const int row = cell / grid_.cols, col = cell % grid_.cols;
    const int left = grid_.left(col), right = grid_.left(col + 1);
    for (int y = std::max(grid_.top(row) - band_.first(), 0);
         y < std::min(grid_.top(row + 1) - band_.first(), band_.rows()); ++y)
      for (int x = left; x < right; x += kMedianBlock) {
        const auto width = static_cast<size_t>(std::min(kMedianBlock, right - x));
        const size_t first = static_cast<size_t>(y) * stride + static_cast<size_t>(x);
        uint8_t room[kMendingFrames][kChannels][kMedianBlock];
        for (size_t i = 0; i < count; ++i)
          for (size_t c = 0; c < kChannels; ++c)
            at[i].first[c] = read_samples(frames, static_cast<int>(i), static_cast<int>(c), first,
                                          width, room[i][c]);
        uint8_t level[kChannels][kMedianBlock], spread[kMedianBlock];
        uint8_t* const out[3] = {level[0], level[1], level[2]};
        median_block({width, 1}, at, count, stride, out, spread);
        model->replace(first, width, out);
      }
    for (int c = 0; c < kChannels; ++c)
      background_cells_.plane(published_, c)[cell] = looks.level(cell, c);
  }
}

}  // namespace qdmd
