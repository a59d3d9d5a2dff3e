// SPDX-License-Identifier: LGPL-2.1-or-later
// What frames put in place of a background's cells between two solves.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/learn/robust/frame_follower.h"
#include "core/learn/robust/in_blocks.h"
#include "core/learn/robust/learning_steps.h"
#include "core/passes/median_block.h"
#include "core/passes/read_samples.h"

namespace qdmd {

void FrameFollower::mend(const Learner::Compared& frame, BackgroundModel* model) {
  const Gain light = model->light(frame.t);
  const BackgroundModel* const of_window = frame.live ? nullptr : model;
  const Cells background = this->background();
  if (frame.live) {
    look_ahead(frame, model);
  } else {
    looks_.follow(unclipped_cells(frame.around.slot(frame.at), light, looks_), light, frame.number);
    // What was absorbed is background until it goes.
    if (absorbed_.any()) {
      std::vector<int> uncovered = looks_.uncovered(background);
      std::erase_if(uncovered, [&](int cell) { return !absorbed_.has(cell); });
      mend_uncovered(std::move(uncovered), looks_, frame, light, of_window, model);
    }
  }
  if (absorb_frames_ == 0) return;
  StandingLooks& looks = frame.live ? memory_.looks() : looks_;
  const std::vector<int>& stood = looks.stood(background, absorb_frames_);
  for (int cell : stood) absorbed_.add(cell, looks.since(cell));
  if (!stood.empty()) mend(stood, looks, frame, lit_frames(frame, light, of_window), model);
}

// With each frame as it comes: what it shows is known from now on.
void FrameFollower::look_ahead(const Learner::Compared& frame, BackgroundModel* model) {
  if (!context_.follows(context_.room.models)) return;
  const int slot = frame.around.slot(frame.at);
  const Gain light = !model ? kSameLight : frame.live ? model->light(frame.t) : this->light(slot);
  // What a camera showed while it looked for its exposure is no proof of anything.
  if (exposure_.follow(Cells(context_.room.frames->cells(), slot), context_.grid.cells()))
    memory_.forget();
  memory_.follow(unclipped_cells(slot, light, memory_.looks()), light, frame.number);
  if (!model) return;
  follow_disturbances(Cells(context_.room.frames->cells(), slot), light, frame.number);
  if (disturbances_.goes_on()) return;
  const Cells background = this->background();
  model->set_time(frame.t);
  const SampleRange range = context_.range();
  const ContourPictures pictures = {
      frame.around, frame.at, {light, range}, model, {model->light(frame.t), range}, context_.rgb};
  std::vector<int> left = memory_.judge(background, [&](const std::vector<int>& region) {
    return contours_of(context_.grid, region, pictures);
  });
  if (memory_.any_news()) calm_ = 0;
  note_uncovered(left, memory_.looks(), frame.number);
  if (!frame.mends) return;
  // What had stood for so long was background, and frames that wait still show it.
  if (!frame.live && absorb_frames_ > 0)
    std::erase_if(left,
                  [&](int cell) { return memory_.looks().before_stood(cell) >= absorb_frames_; });
  mend_uncovered(std::move(left), memory_.looks(), frame, light, nullptr, model);
}

// The background in use may be older than what is known; of a disturbance, it need not be newer.
void FrameFollower::follow_disturbances(const Cells& frame, const Gain& light, int64_t number) {
  const Cells background = this->background();
  std::array<float, kChannels> unit;
  for (size_t c = 0; c < kChannels; ++c) unit[c] = 1 / std::min(light[c], 1.0f);
  const auto apart = [&](size_t c, size_t cell) {
    const float level = frame.of[c][cell], known = background.of[c][cell],
                expected = known * light[c];
    return is_bound(level, expected, known, light[c]) ? 0 : unit[c] * std::abs(level - expected);
  };
  const float most = kChannels * steps::contours::kLooksDiffer;
  int differing = 0;
  // What bounds say only makes less of a difference: few cells ask for them.
  in_blocks(context_.grid.cells(), [&](size_t first, size_t count) {
    float sum[kTogether] = {};
    for (size_t c = 0; c < kChannels; ++c) {
      const float *const level = frame.of[c] + first, *const known = background.of[c] + first;
      for (size_t i = 0; i < count; ++i)
        sum[i] += unit[c] * std::abs(level[i] - known[i] * light[c]);
    }
    for (size_t i = 0; i < count; ++i) {
      const size_t cell = first + i;
      if (sum[i] > most)
        differing += apart(0, cell) + apart(1, cell) + apart(2, cell) > most ? 1 : 0;
    }
  });
  disturbances_.follow(static_cast<double>(differing) / static_cast<double>(context_.grid.cells()),
                       number);
}

// For those who want to be told of it: nothing here depends on it.
void FrameFollower::note_uncovered(const std::vector<int>& cells, const StandingLooks& looks,
                                   int64_t number) {
  if (cells.empty()) return;
  const Grid& grid = context_.grid;
  std::vector<uint8_t> marks(grid.cells());
  for (int cell : cells) marks[static_cast<size_t>(cell)] = 1;
  CellRegions regions(grid);
  for (const std::vector<int>& region : regions.find(marks)) {
    int top = grid.rows, left = grid.cols, bottom = 0, right = 0;
    std::vector<int64_t> since, stood;
    for (int cell : region) {
      top = std::min(top, cell / grid.cols), bottom = std::max(bottom, cell / grid.cols + 1);
      left = std::min(left, cell % grid.cols), right = std::max(right, cell % grid.cols + 1);
      since.push_back(looks.since(cell));
      stood.push_back(looks.before_stood(cell));
    }
    const auto middle = [](std::vector<int64_t>* of) {
      const auto at = of->begin() + std::ssize(*of) / 2;
      std::nth_element(of->begin(), at, of->end());
      return *at;
    };
    const int x = grid.left(left), y = grid.top(top);
    uncovered_.add(
        {x, y, grid.left(right) - x, grid.top(bottom) - y, middle(&since), middle(&stood), number},
        2 * steps::proofs::kMoves);
  }
}

// of_window: the model whose window the frames are of, which knows their light; null: they came
// after it.
FrameFollower::LitFrames FrameFollower::lit_frames(const Learner::Compared& frame,
                                                   const Gain& light,
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

void FrameFollower::mend_uncovered(std::vector<int> cells, const StandingLooks& looks,
                                   const Learner::Compared& frame, const Gain& light,
                                   const BackgroundModel* of_window, BackgroundModel* model) {
  // Nothing is computed where nothing was uncovered.
  if (cells.empty()) return;
  const LitFrames lit = lit_frames(frame, light, of_window);
  looks.leave_out_hidden(context_.room.frames->cells(), lit.slots(), &cells);
  mend(cells, looks, frame, lit, model);
}

void FrameFollower::mend(const std::vector<int>& cells, const StandingLooks& looks,
                         const Learner::Compared& frame, const LitFrames& lit,
                         BackgroundModel* model) {
  if (cells.empty()) return;
  calm_ = 0;
  model->freeze_but_for_light(frame.t);
  replace(cells, looks, lit, model);
  if (context_.options.depth > 8) replace_deep(cells, lit, model);
}

// replace() with whole samples.
void FrameFollower::replace_deep(const std::vector<int>& cells, const LitFrames& lit,
                                 BackgroundModel* model) const {
  const SnapshotRange& frames = lit.frames;
  const size_t count = static_cast<size_t>(frames.size()), half = count / 2;
  const double unit = 1.0 / (1 << bits_below(frames.depth()));
  const SampleRange range = context_.range();
  for (int cell : cells) {
    const int row = cell / context_.grid.cols, col = cell % context_.grid.cols;
    for (int y = context_.grid.top(row); y < context_.grid.top(row + 1); ++y)
      for (int x = context_.grid.left(col); x < context_.grid.left(col + 1); ++x) {
        const auto p = static_cast<size_t>(y) * static_cast<size_t>(context_.grid.width) +
                       static_cast<size_t>(x);
        float level[kChannels];
        for (int c = 0; c < kChannels; ++c) {
          // In order: there are a few.
          double samples[Learner::kMendingFrames];
          for (int t = 0; t < frames.size(); ++t) {
            const SampleLight light(lit.at[static_cast<size_t>(t)].light, range);
            const auto channel = static_cast<size_t>(c);
            const double sample =
                read_sample(frames, t, c, p) / static_cast<double>(light.gain[channel]) +
                static_cast<double>(light.back(channel).offset) / unit;
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
void FrameFollower::replace(const std::vector<int>& cells, const StandingLooks& looks,
                            const LitFrames& lit, BackgroundModel* model) {
  const SnapshotRange& frames = lit.frames;
  const auto count = static_cast<size_t>(frames.size());
  MedianFrame at[Learner::kMendingFrames] = {};  // of blocks of one row
  for (size_t i = 0; i < count; ++i) at[i].take_out({lit.at[i].light, context_.range()});
  const auto stride = static_cast<size_t>(context_.grid.width);
  for (int cell : cells) {
    const int row = cell / context_.grid.cols, col = cell % context_.grid.cols;
    const int left = context_.grid.left(col), right = context_.grid.left(col + 1);
    for (int y = context_.grid.top(row); y < context_.grid.top(row + 1); ++y)
      for (int x = left; x < right; x += kMedianBlock) {
        const auto width = static_cast<size_t>(std::min(kMedianBlock, right - x));
        const size_t first = static_cast<size_t>(y) * stride + static_cast<size_t>(x);
        uint8_t room[Learner::kMendingFrames][kChannels][kMedianBlock];
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
