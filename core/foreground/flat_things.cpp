// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/foreground/flat_things.h"

#include <cmath>
#include <cstdlib>
#include <utility>

#include "core/foreground/parts.h"

namespace qdmd {
namespace {

constexpr int kAlong = 4, kSamples = kAlong * kAlong;
// A sample's brightness is in quarters of a level.
constexpr int kQuarters = 4;
// One row of blocks in a few of a frame says enough, other rows of each frame.
constexpr int kTurns = 8;

}  // namespace

FlatThings::FlatThings(int width, int height, int step, Colours colours,
                       const DecisionConstants& constants)
    : constants_(constants),
      width_(width),
      height_(height),
      step_(step),
      side_(kAlong * step),
      cols_(width / side_),
      rows_(height / side_),
      yuv_(colours == Colours::yuv),
      same_(static_cast<int>(std::lround(kQuarters * kSamples * constants.same_brightness))) {
  const size_t blocks = static_cast<size_t>(cols_) * static_cast<size_t>(rows_);
  contrast_.resize(blocks);
  looks_.resize(blocks);
  part_.resize(blocks);
  size_.resize(blocks);
  flat_at_.resize(blocks);
  flat_.reserve(blocks);
  in_rows_ = RowLists<Flat>(static_cast<size_t>(rows_), static_cast<size_t>(cols_));
  near_.resize(static_cast<size_t>(cols_ + 1) * static_cast<size_t>(rows_ + 1));
}

uint64_t FlatThings::bytes(int width, int height, int step) {
  const auto cols = static_cast<uint64_t>(width / (kAlong * step)),
             rows = static_cast<uint64_t>(height / (kAlong * step));
  return cols * rows * (sizeof(float) + sizeof(uint8_t) + 3 * sizeof(uint32_t) + sizeof(Flat)) +
         RowLists<Flat>::bytes(rows, cols) + (cols + 1) * (rows + 1);
}

void FlatThings::forget() {
  frames_ = 0;
  std::fill(looks_.begin(), looks_.end(), uint8_t{0});
}

int FlatThings::bright(const uint8_t* const planes[3], size_t at) const {
  if (yuv_) return kQuarters * planes[0][at];
  return planes[0][at] + 2 * planes[1][at] + planes[2][at];
}

size_t FlatThings::first(int col, int row, size_t stride) const {
  return static_cast<size_t>(row * side_) * stride + static_cast<size_t>(col * side_);
}

bool FlatThings::differs(const Planes& planes, int col, int row) const {
  const uint8_t* at = planes.differing + first(col, row, planes.l_stride);
  for (int i = 0; i < kAlong; ++i, at += static_cast<size_t>(step_) * planes.l_stride)
    for (int j = 0; j < kAlong; ++j)
      if (at[j * step_] == 0) return false;
  return true;
}

FlatThings::Look FlatThings::look_at(const uint8_t* const planes[3], size_t first,
                                     size_t stride) const {
  Look look = {};
  int above[kAlong] = {};
  for (int i = 0; i < kAlong; ++i) {
    int before = 0;
    for (int j = 0; j < kAlong; ++j) {
      const int sample = bright(
          planes, first + static_cast<size_t>(i * step_) * stride + static_cast<size_t>(j * step_));
      look.bright += sample;
      if (j > 0) look.contrast += std::abs(sample - before);
      if (i > 0) look.contrast += std::abs(sample - above[j]);
      above[j] = before = sample;
    }
  }
  return look;
}

bool FlatThings::is_flat(const Look& look, const Look& level, size_t block) const {
  if (looks_[block] * kTurns < static_cast<int>(constants_.first_frames)) return false;
  if (look.bright >= constants_.hard.clipped * kQuarters * kSamples) return false;
  const double light =
      look.bright < level.bright ? static_cast<double>(look.bright) / level.bright : 1;
  return look.contrast < constants_.flat * light * static_cast<double>(contrast_[block]);
}

bool FlatThings::is_thing(size_t flat) const {
  return size_[flat] >= static_cast<uint32_t>(constants_.least_flat);
}

void FlatThings::learn(size_t block, int contrast) {
  const int looks = std::min(looks_[block] + 1, static_cast<int>(constants_.noise_samples));
  looks_[block] = static_cast<uint8_t>(looks);
  // The first one is all that is known.
  const float known = looks > 1 ? contrast_[block] : 0;
  contrast_[block] = known + (static_cast<float>(contrast) - known) / static_cast<float>(looks);
}

void FlatThings::find_flat(const Planes& planes, Pool* pool) {
  for (const Flat& flat : flat_) flat_at_[flat.block] = 0;
  const size_t pixels = static_cast<size_t>(width_) * static_cast<size_t>(height_);
  for_rows(pool, rows_, pixels, [&](int first, int size) {
    for (int row = first; row < first + size; ++row) find_flat_in(planes, row);
  });
  in_rows_.collect(&flat_);
  for (size_t flat = 0; flat < flat_.size(); ++flat)
    flat_at_[flat_[flat].block] = static_cast<uint32_t>(flat) + 1;
}

void FlatThings::find_flat_in(const Planes& planes, int row) {
  const auto of_row = static_cast<size_t>(row);
  in_rows_.clear(of_row);
  const bool learns = (row + frames_) % kTurns == 0;
  const uint8_t* const differing = planes.differing + first(0, row, planes.l_stride);
  for (int col = 0; col < cols_; ++col) {
    // Where nothing differs, nothing is flat.
    if (!learns) col = next_of(differing, col * side_, cols_ * side_, 255) / side_;
    if (col == cols_) return;
    const bool all = differs(planes, col, row);
    if (!all && !learns) continue;
    const auto block = static_cast<size_t>(row * cols_ + col);
    const Look look = look_at(planes.x, first(col, row, planes.x_stride), planes.x_stride);
    const Look level =
        all ? look_at(planes.l, first(col, row, planes.l_stride), planes.l_stride) : Look{};
    if (all && is_flat(look, level, block))
      in_rows_.add(of_row, {static_cast<uint32_t>(block), look.bright});
    else if (learns)
      learn(block, look.contrast);
  }
}

void FlatThings::find_things() {
  const auto part = [&](size_t flat) {
    return part_of(static_cast<uint32_t>(flat),
                   [&](uint32_t at) -> uint32_t& { return part_[at]; });
  };
  const auto join = [&](size_t flat, size_t block) {
    if (flat_at_[block] == 0) return;
    const size_t other = flat_at_[block] - 1;
    if (std::abs(flat_[flat].bright - flat_[other].bright) < same_) part_[part(flat)] = part(other);
  };
  const auto cols = static_cast<size_t>(cols_);
  for (size_t flat = 0; flat < flat_.size(); ++flat) {
    part_[flat] = static_cast<uint32_t>(flat);
    size_[flat] = 0;
    const size_t block = flat_[flat].block;
    if (block % cols > 0) join(flat, block - 1);
    if (block >= cols) join(flat, block - cols);
  }
  for (size_t flat = 0; flat < flat_.size(); ++flat) ++size_[part(flat)];
  for (size_t flat = 0; flat < flat_.size(); ++flat) size_[flat] = size_[part(flat)];
}

Rectangle FlatThings::around(const Flat& flat) const {
  const int col = static_cast<int>(flat.block) % cols_, row = static_cast<int>(flat.block) / cols_;
  const int left = std::max(0, (col - 1) * side_), right = std::min(width_, (col + 2) * side_);
  const int top = std::max(0, (row - 1) * side_), bottom = std::min(height_, (row + 2) * side_);
  return {left, top, right - left, bottom - top};
}

// What differs around the block, and is as bright.
void FlatThings::paint(const Planes& planes, const Flat& flat, uint8_t* foreground) const {
  const Rectangle area = around(flat);
  for (int y = area.y; y < area.y + area.height; ++y)
    for (int x = area.x; x < area.x + area.width; ++x) {
      const size_t at = static_cast<size_t>(y) * planes.l_stride + static_cast<size_t>(x);
      if (planes.differing[at] == 0 || foreground[at] != 0) continue;
      const size_t of_x = static_cast<size_t>(y) * planes.x_stride + static_cast<size_t>(x);
      if (std::abs(kSamples * bright(planes.x, of_x) - flat.bright) < same_) foreground[at] = 255;
    }
}

void FlatThings::keep(const Planes& planes, Pool* pool, uint8_t* foreground) {
  find_flat(planes, pool);
  find_things();
  ++frames_;
  if (std::exchange(any_, false)) std::fill(near_.begin(), near_.end(), uint8_t{0});
  for (size_t flat = 0; flat < flat_.size(); ++flat) {
    if (!is_thing(flat)) continue;
    any_ = true;
    paint(planes, flat_[flat], foreground);
    mark_near(flat_[flat]);
  }
}

void FlatThings::mark_near(const Flat& flat) {
  const int col = static_cast<int>(flat.block) % cols_, row = static_cast<int>(flat.block) / cols_;
  const int left = std::max(col - 1, 0), end = col + 2;
  for (int i = std::max(row - 1, 0); i < row + 2; ++i) {
    const auto first = near_.begin() + static_cast<ptrdiff_t>(i) * (cols_ + 1);
    std::fill(first + left, first + end, uint8_t{255});
  }
}

}  // namespace qdmd
