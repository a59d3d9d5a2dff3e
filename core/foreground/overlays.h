// SPDX-License-Identifier: LGPL-2.1-or-later
// Text that a recorder draws into the picture, such as a clock, and lamps that blink: told by how
// they change.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/foreground/decision_steps.h"

namespace qdmd {

// Text changes in place: from one frame to the next, and then it rests. What moves changes frame by
// frame. So for each block of 8 x 8 pixels of the mask the pixels that change are counted around
// it, frame by frame: where one frame stands alone, with twice as many as any frame a little before
// and after it, the block changed at once. After some such changes it is no foreground.
// | much of a block's white changes                                      | it counts |
// |----------------------------------------------------------------------|-----------|
// | at once                                                              | 1         |
// | at once, in the frame in which text near it changes                  | as text   |
// | not at once, and as many pixels as with its last change at once      | -1        |
// | with much of the picture                                             | 0         |
class Overlays {
 public:
  // Takes all memory. For masks of width x height pixels.
  Overlays(int width, int height, const DecisionConstants& constants = {});
  static uint64_t bytes(int width, int height);

  void forget();
  // Learns from a mask (width * height samples, 255 or 0), the next frame's, and clears it where
  // text is.
  void take_out(uint8_t* mask);

 private:
  struct Block {
    uint64_t white = 0;       // by pixel, in the newest frame
    int64_t changed = kNone;  // the newest frame in which much of that changed
    int said = 0;             // how often it changed at once
    uint32_t pixels = 0;      // that changed around it when it last did
  };
  static constexpr int64_t kNone = INT64_MIN / 2;
  // Frames whose changes are kept, a power of two.
  static constexpr int kKept = 32;

  uint64_t read(const uint8_t* mask, int col, int row) const;
  bool changes(uint64_t before, uint64_t now) const;
  bool is_text(const Block& block) const { return block.said >= enough_; }
  uint32_t* pixels_of(int64_t frame) {
    return pixels_.data() + static_cast<size_t>(frame & (kKept - 1)) * tiles();
  }
  size_t tiles() const { return pixels_.size() / kKept; }
  uint32_t pixels_around(size_t block, int64_t frame);
  bool is_alone(size_t block, int64_t frame, int64_t first, int64_t last);
  bool changes_with_text(size_t block, int64_t frame) const;
  void find_changes(const uint8_t* mask);
  void judge(int64_t frame);
  void clear(size_t block, uint8_t* mask) const;

  int width_, height_, cols_, rows_, tile_cols_, tile_rows_, enough_, rests_;
  double share_, most_;
  int64_t frame_ = 0;
  std::vector<Block> blocks_;
  std::vector<uint32_t> pixels_;  // that changed in the newest frames, by tiles of some blocks
  std::vector<uint32_t> found_,
      text_;  // blocks that changed much in a frame; and all that are text
};

}  // namespace qdmd
