// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/foreground/overlays.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <cstring>

namespace qdmd {
namespace {

constexpr int kSide = 8;
// Blocks along a tile. What changes in the tiles around a block is near it.
constexpr int kTile = 4;
// Blocks beside text that are its line, if they change with it.
constexpr int kLineColumns = 16, kLineRows = 3;
// Pixels around text that its edge may reach.
constexpr int kRim = 3;
// Fewer pixels of a block change by chance, at the edge of something.
constexpr int kLeastPixels = 12;

int blocks_in(int pixels) { return (pixels + kSide - 1) / kSide; }
int tiles_in(int pixels) { return (blocks_in(pixels) + kTile - 1) / kTile; }

}  // namespace

Overlays::Overlays(int width, int height, const DecisionConstants& constants)
    : width_(width),
      height_(height),
      cols_(blocks_in(width)),
      rows_(blocks_in(height)),
      tile_cols_(tiles_in(width)),
      tile_rows_(tiles_in(height)),
      enough_(static_cast<int>(constants.text_changes)),
      rests_(std::min(static_cast<int>(constants.text_rests), (kKept - 1) / 2)),
      share_(constants.text_share),
      most_(constants.most_text) {
  const size_t blocks = static_cast<size_t>(cols_) * static_cast<size_t>(rows_);
  blocks_.resize(blocks);
  pixels_.resize(size_t{kKept} * static_cast<size_t>(tile_cols_) * static_cast<size_t>(tile_rows_));
  found_.reserve(blocks);
  text_.reserve(blocks);
}

uint64_t Overlays::bytes(int width, int height) {
  const uint64_t blocks = uint64_t(blocks_in(width)) * uint64_t(blocks_in(height));
  const uint64_t tiles = uint64_t(tiles_in(width)) * uint64_t(tiles_in(height));
  return blocks * (sizeof(Block) + 2 * sizeof(uint32_t)) + kKept * tiles * sizeof(uint32_t);
}

void Overlays::forget() {
  std::fill(blocks_.begin(), blocks_.end(), Block{});
  std::fill(pixels_.begin(), pixels_.end(), 0u);
  text_.clear();
}

// A bit for each white sample of a block: bit i of byte j is that of row i and column j.
uint64_t Overlays::read(const uint8_t* mask, int col, int row) const {
  const int x = col * kSide, y = row * kSide;
  const int wide = std::min(kSide, width_ - x), tall = std::min(kSide, height_ - y);
  const uint8_t* at =
      mask + static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
  uint64_t found = 0;
  for (int i = 0; i < tall; ++i, at += width_) {
    uint64_t samples = 0;
    if (wide == kSide)
      std::memcpy(&samples, at, sizeof samples);
    else
      std::memcpy(&samples, at, static_cast<size_t>(wide));
    found |= samples & uint64_t{0x0101010101010101} << i;
  }
  return found;
}

bool Overlays::changes(uint64_t before, uint64_t now) const {
  const int changed = std::popcount(before ^ now);
  return changed >= kLeastPixels && changed >= share_ * std::popcount(before | now);
}

// How many pixels changed in that frame, in the block's tile and those next to it.
uint32_t Overlays::pixels_around(size_t block, int64_t frame) {
  const int col = static_cast<int>(block) % cols_ / kTile,
            row = static_cast<int>(block) / cols_ / kTile;
  const uint32_t* const pixels = pixels_of(frame);
  uint32_t sum = 0;
  for (int y = std::max(0, row - 1); y <= std::min(tile_rows_ - 1, row + 1); ++y)
    for (int x = std::max(0, col - 1); x <= std::min(tile_cols_ - 1, col + 1); ++x)
      sum += pixels[static_cast<size_t>(y * tile_cols_ + x)];
  return sum;
}

// True where at most half as many pixels changed in each of the frames first .. last.
bool Overlays::is_alone(size_t block, int64_t frame, int64_t first, int64_t last) {
  const uint32_t now = pixels_around(block, frame);
  for (int64_t t = first; t <= last; ++t)
    if (2 * pixels_around(block, t) > now) return false;
  return true;
}

// True where text beside that block changed in the same frame.
bool Overlays::changes_with_text(size_t block, int64_t frame) const {
  const int col = static_cast<int>(block) % cols_, row = static_cast<int>(block) / cols_;
  return std::any_of(text_.begin(), text_.end(), [&](uint32_t text) {
    return blocks_[text].changed == frame &&
           std::abs(static_cast<int>(text) % cols_ - col) <= kLineColumns &&
           std::abs(static_cast<int>(text) / cols_ - row) <= kLineRows;
  });
}

void Overlays::find_changes(const uint8_t* mask) {
  found_.clear();
  uint32_t* const pixels = pixels_of(frame_);
  std::fill_n(pixels, tiles(), 0u);
  for (int row = 0; row < rows_; ++row)
    for (int col = 0; col < cols_; ++col) {
      const auto block = static_cast<size_t>(row * cols_ + col);
      Block& of = blocks_[block];
      const uint64_t now = read(mask, col, row);
      if (now == of.white) continue;
      pixels[static_cast<size_t>(row / kTile * tile_cols_ + col / kTile)] +=
          static_cast<uint32_t>(std::popcount(now ^ of.white));
      if (changes(of.white, now)) found_.push_back(static_cast<uint32_t>(block));
      of.white = now;
    }
  // No text is so large: that was the light, or a codec's key frame.
  if (static_cast<double>(found_.size()) > most_ * static_cast<double>(blocks_.size()))
    found_.clear();
  for (const uint32_t block : found_) {
    Block& of = blocks_[block];
    // Little that changes after it hides nothing.
    if (frame_ - of.changed >= rests_ ||
        pixels_around(block, frame_) > 2 * pixels_around(block, of.changed))
      of.changed = frame_;
  }
}

// The blocks that changed in that frame, when it is known what followed.
void Overlays::judge(int64_t frame) {
  for (size_t block = 0; block < blocks_.size(); ++block) {
    Block& of = blocks_[block];
    if (of.changed != frame) continue;
    if (is_alone(block, frame, frame - rests_, frame - 1) &&
        is_alone(block, frame, frame + 1, frame + rests_)) {
      of.said = std::min(2 * enough_, of.said + 1);
      of.pixels = pixels_around(block, frame);
      if (!is_text(of) && changes_with_text(block, frame)) of.said = enough_;
    } else if (pixels_around(block, frame) >= of.pixels) {
      of.said = std::max(0, of.said - 1);
    }
  }
}

void Overlays::clear(size_t block, uint8_t* mask) const {
  const int x = static_cast<int>(block) % cols_ * kSide,
            y = static_cast<int>(block) / cols_ * kSide;
  const int left = std::max(0, x - kRim), right = std::min(width_, x + kSide + kRim);
  for (int row = std::max(0, y - kRim); row < std::min(height_, y + kSide + kRim); ++row)
    std::memset(
        mask + static_cast<size_t>(row) * static_cast<size_t>(width_) + static_cast<size_t>(left),
        0, static_cast<size_t>(right - left));
}

void Overlays::take_out(uint8_t* mask) {
  find_changes(mask);
  judge(frame_ - rests_);
  text_.clear();
  for (size_t block = 0; block < blocks_.size(); ++block)
    if (is_text(blocks_[block])) text_.push_back(static_cast<uint32_t>(block));
  for (const uint32_t block : text_) clear(block, mask);
  // Until it is known whether that was at once, it is taken for it.
  if (!text_.empty())
    for (size_t block = 0; block < blocks_.size(); ++block) {
      const int64_t changed = blocks_[block].changed;
      if (frame_ - changed < rests_ && changes_with_text(block, changed)) clear(block, mask);
    }
  ++frame_;
}

}  // namespace qdmd
