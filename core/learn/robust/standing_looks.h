// SPDX-License-Identifier: LGPL-2.1-or-later
// What each cell of the picture shows, and since when: passers-by aside.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/learn/robust/contour.h"
#include "core/learn/robust/learning_steps.h"
#include "core/model/learnt.h"
#include "core/passes/grid.h"

namespace qdmd {

// Where a frame lies, and its light.
struct LitSlot {
  int slot = 0;
  Gain light = kSameLight;
};

// A cell's look is what it showed last for kSteady frames in a row.
class StandingLooks {
 public:
  static QDMD_STEP int kSteady = steps::looks::kSteady;
  // A cell shows the same as long as it is within so many levels, sum of the channels: noise of
  // cells' means is far below.
  static QDMD_STEP float kSame = steps::looks::kSame;

  StandingLooks() = default;
  // Takes all memory.
  explicit StandingLooks(const Grid& grid);
  static uint64_t bytes(const Grid& grid);

  // Nothing is known.
  void forget();
  // The next frame of the stream, its levels divided by `gain`. number: counts frames.
  void follow(const float* const frame[3], const Gain& gain, int64_t number);
  // What a cell shows and showed, for a file and back, as it was with frame `now`. read() is false,
  // and changes nothing, where frames have shown another look since.
  void write(size_t cell, int64_t now, LearntPlace* out) const;
  bool read(size_t cell, int64_t now, const LearntPlace& from);
  // The look of a cell, where it is known.
  float level(int cell, int channel) const { return looks_.plane(0, channel)[cell]; }
  // The frame with which its look came. What was hidden for no longer than it had been there goes
  // on to be what it was.
  int64_t since(int cell) const { return cells_[static_cast<size_t>(cell)].look.since; }
  // How many frames have shown it since it came last.
  int frames(int cell) const { return frames_[static_cast<size_t>(cell)]; }
  // The newest frame that showed the look before; kNever: there was none.
  static constexpr int64_t kNever = INT64_MIN;
  int64_t before_until(int cell) const {
    const Cell& of = cells_[static_cast<size_t>(cell)];
    return of.had_before ? of.before.last : kNever;
  }
  // For how many frames that look had been there.
  int64_t before_stood(int cell) const {
    const Cell& of = cells_[static_cast<size_t>(cell)];
    return of.had_before ? of.before.last - of.before.since : 0;
  }
  // True where the cell shows its look now.
  bool shows_look(int cell) const { return shows(static_cast<size_t>(cell)); }
  const GridFrames& levels() const { return looks_; }
  // Marks the cells that show their look now, where it is another than the background's, and makes
  // a list of them.
  void find_differing(const float* const background[3], std::vector<uint8_t>* differs,
                      std::vector<int>* differing) const;
  int64_t newest() const { return number_; }
  // True where something passed before the cell's look in that frame, one of the last kHistory.
  static constexpr int kHistory = 256;
  bool passed(int cell, int64_t number) const {
    if (number > number_ || number <= number_ - kHistory) return false;
    const auto at = static_cast<size_t>(cell);
    return passed_[row_of(number) + at / 64] >> (at % 64) & 1;
  }

  // Good until the next call of either:
  // What was uncovered: cells whose look has lasted for kSteady frames and is not the background's,
  // in regions where the background has the stronger contour.
  const std::vector<int>& uncovered(const float* const background[3]);
  // Takes out of a list of cells those that show something else than their look in more than one,
  // or in half, of the frames that lie in these slots of `frames`, each in its own light: somebody
  // passes there.
  void leave_out_hidden(const GridFrames& frames, std::span<const LitSlot> slots,
                        std::vector<int>* of) const;
  // True where uncovered() saw enough cells whose look is not the background's and has come within
  // the last kNewsFrames frames, be it uncovered or something that stops.
  bool any_news() const { return news_ >= kLeastNews; }
  static QDMD_STEP int kNewsFrames = steps::looks::kNewsFrames;
  static QDMD_STEP size_t kLeastNews = steps::looks::kLeastNews;
  // What has stood for `frames` frames: regions of cells whose look is not the background's, half
  // of which came so long ago, with the cells next to them.
  const std::vector<int>& stood(const float* const background[3], int64_t frames);

 private:
  // The frames that showed it, from the first to the last one.
  struct Look {
    int64_t since = 0, last = 0;
  };
  // What it shows (the last frame is known once another one shows something else), the one before,
  // which lasted for nothing if there was none, and when that came which may become the next.
  struct Cell {
    Look look, before;
    int64_t next_since = 0;
    bool had_before = false;
  };
  size_t words() const { return (frames_.size() + 63) / 64; }
  // Numbers before those of the stream are negative.
  size_t row_of(int64_t number) const {
    return static_cast<size_t>(number & (kHistory - 1)) * words();
  }
  bool shows(size_t cell) const { return frames_[cell] >= kSteady && next_frames_[cell] == 0; }
  void see_other(size_t cell, const std::array<float, kChannels>& level);
  void take_next(size_t cell);

  Grid grid_;
  GridFrames looks_;  // what it shows, what may become the next look, and the one before
  std::vector<Cell> cells_;
  // By cells: how many frames showed the look, and what may become the next one; 0: there is
  // none.
  std::vector<int> frames_, next_frames_;
  int64_t number_ = 0, previous_ = 0;  // of the newest frame, and of the one before
  std::vector<uint64_t> passed_;       // a bit a cell, kHistory frames
  std::vector<uint8_t> differs_;
  std::vector<int> found_;
  size_t news_ = 0;
};

}  // namespace qdmd
