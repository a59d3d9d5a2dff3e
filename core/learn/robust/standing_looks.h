// What each cell of the picture shows, and since when: passers-by aside.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/learn/robust/contour.h"
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
  static constexpr int kSteady = 10;
  // A cell shows the same as long as it is within so many levels, sum of the channels: noise of
  // cells' means is far below.
  static constexpr float kSame = 12;

  StandingLooks() = default;
  // Takes all memory.
  explicit StandingLooks(const Grid& grid);
  static uint64_t bytes(const Grid& grid);

  // Nothing is known.
  void forget();
  // The next frame of the stream, its levels divided by `gain`. number: counts frames.
  void follow(const float* const frame[3], const Gain& gain, int64_t number);
  // The look of a cell, where it is known.
  float level(int cell, int channel) const { return looks_.plane(0, channel)[cell]; }
  // The frame with which its look came. What was hidden for no longer than it had been there goes
  // on to be what it was.
  int64_t since(int cell) const { return cells_[static_cast<size_t>(cell)].look.since; }

  // Good until the next call of either:
  // What was uncovered: cells whose look has lasted for kSteady frames and is not the background's,
  // in regions where the background has the stronger contour.
  // counts: null, or what says of a region of such cells whether it may be one.
  using Counts = std::function<bool(const std::vector<int>& region)>;
  const std::vector<int>& uncovered(const float* const background[3],
                                    const Counts& counts = nullptr);
  // Takes out of a list of cells those that show something else than their look in more than one,
  // or in half, of the frames that lie in these slots of `frames`, each in its own light: somebody
  // passes there.
  void leave_out_hidden(const GridFrames& frames, std::span<const LitSlot> slots,
                        std::vector<int>* of) const;
  // Cells whose look was not the background's in the last uncovered().
  size_t differing() const { return differing_; }
  // True where uncovered() saw enough cells whose look is not the background's and has come within
  // the last kNewsFrames frames, be it uncovered or something that stops.
  bool any_news() const { return news_ >= kLeastNews; }
  static constexpr int kNewsFrames = 25;
  static constexpr size_t kLeastNews = 3 * kLeastRegion;
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
  };
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
  std::vector<uint8_t> differs_;
  std::vector<int> found_;
  size_t news_ = 0, differing_ = 0;
};

}  // namespace qdmd
