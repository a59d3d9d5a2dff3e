// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/foreground/soft_mask.h"

#include <algorithm>
#include <cstring>

#include "core/passes/residual.h"

namespace qdmd {
namespace {

constexpr int kWholeTile = kSoftTile + 2 * soft_halo(kMostSoftness);
// Shares of the threshold: less contrast is no edge, and what becomes foreground changes by more.
constexpr double kFlat = 1.0 / 4, kStill = 1;

int tiles_along(int size) { return size / kSoftTile + (size % kSoftTile != 0); }

// Repeats the first and the last of the samples first .. end - 1 of a row.
void repeat_ends(uint8_t* row, int first, int end, int count) {
  std::memset(row, row[first], static_cast<size_t>(first));
  std::memset(row + end, row[end - 1], static_cast<size_t>(count - end));
}

}  // namespace

struct SoftMask::Frame {
  const Decision& decision;
  const uint8_t* const* x;
  int softness;
  float flat;  // levels
  int still;
};

struct SoftMask::Tile {
  int width, height, halo;  // pixels; the sides are without the halo
  // With it.
  alignas(64) uint8_t guide[kWholeTile * kWholeTile], white[kWholeTile * kWholeTile];
};

SoftMask::SoftMask(int width, int height)
    : width_(width),
      height_(height),
      rows_(tiles_along(height)),
      cols_(tiles_along(width)),
      alpha_(static_cast<size_t>(width) * static_cast<size_t>(height)),
      guide_(alpha_.size()),
      white_(alpha_.size()),
      had_edge_(static_cast<size_t>(rows_) * static_cast<size_t>(cols_)) {}

uint64_t SoftMask::bytes(int width, int height) {
  return 3 * static_cast<uint64_t>(width) * static_cast<uint64_t>(height) +
         static_cast<uint64_t>(tiles_along(width)) * static_cast<uint64_t>(tiles_along(height));
}

void SoftMask::forget() {
  if (softness_ > 0) std::fill(had_edge_.begin(), had_edge_.end(), uint8_t{0});
  softness_ = 0;
}

void SoftMask::make(const Decision& decision, const uint8_t* const x[3], const SoftEdge& edge,
                    const IgnoredAreas& ignored, Pool* pool) {
  const int softness = std::clamp(edge.softness, 1, kMostSoftness);
  if (softness != softness_) forget();
  const Frame frame = {decision, x, softness, static_cast<float>(kFlat * edge.threshold),
                       static_cast<int>(std::clamp(kStill * edge.threshold, 1.0, 255.0))};
  const auto tile = [&](size_t i) {
    make_tile(frame, static_cast<int>(i) / cols_, static_cast<int>(i) % cols_);
  };
  if (pool)
    pool->run(had_edge_.size(), tile);
  else
    for (size_t i = 0; i < had_edge_.size(); ++i) tile(i);
  ignored.clear_rows(0, height_, width_, alpha_.data());
  softness_ = softness;
}

void SoftMask::make_tile(const Frame& frame, int row, int col) {
  const int left = col * kSoftTile, top = row * kSoftTile;
  const auto at = [this](int x, int y) {
    return static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
  };
  Tile tile;
  tile.width = std::min(kSoftTile, width_ - left);
  tile.height = std::min(kSoftTile, height_ - top);
  tile.halo = soft_halo(frame.softness);
  const auto size = static_cast<size_t>(tile.width), width = static_cast<size_t>(width_);
  const uint8_t* const mask = frame.decision.mask();
  uint8_t& had_edge = had_edge_[static_cast<size_t>(row * cols_ + col)];

  const int first_x = std::max(0, left - tile.halo), first_y = std::max(0, top - tile.halo);
  const int end_x = std::min(width_, left + tile.width + tile.halo);
  const int end_y = std::min(height_, top + tile.height + tile.halo);
  if (!is_mixed(mask + at(first_x, first_y), width, static_cast<size_t>(end_x - first_x),
                static_cast<size_t>(end_y - first_y))) {
    for (int y = top; y < top + tile.height; ++y)
      std::memset(alpha_.data() + at(left, y), mask[at(left, y)], size);
    had_edge = 0;
    return;
  }

  copy_halo(frame, left, top, &tile);
  alignas(64) uint8_t soft[kSoftTile * kSoftTile];
  soften_tile(tile.guide, tile.white, kWholeTile, tile.width, tile.height, frame.softness,
              frame.flat, soft, kSoftTile);
  const size_t first = at(left, top);
  const bool stands = had_edge && !has_moved(mask + first, white_.data() + first, width, size,
                                             static_cast<size_t>(tile.height));
  for (int y = 0; y < tile.height; ++y) {
    std::memcpy(white_.data() + at(left, top + y), mask + at(left, top + y), size);
    const uint8_t* const guide = tile.guide + (y + tile.halo) * kWholeTile + tile.halo;
    uint8_t* const known = guide_.data() + at(left, top + y);
    uint8_t* const alpha = alpha_.data() + at(left, top + y);
    if (stands) {
      settle(soft + y * kSoftTile, guide, frame.still, size, known, alpha);
    } else {
      std::memcpy(alpha, soft + y * kSoftTile, size);
      std::memcpy(known, guide, size);
    }
  }
  had_edge = 1;
}

// The border's pixels stand for those outside.
void SoftMask::copy_halo(const Frame& frame, int left, int top, Tile* tile) const {
  const int halo = tile->halo, whole = tile->width + 2 * halo;
  // Columns of the tile that are in the picture.
  const int first = std::max(0, halo - left), end = std::min(whole, width_ - left + halo);
  const auto count = static_cast<size_t>(end - first);
  int made = -1;  // the picture's row that the tile's last row has
  for (int i = 0; i < tile->height + 2 * halo; ++i) {
    uint8_t* const guide = tile->guide + i * kWholeTile;
    uint8_t* const white = tile->white + i * kWholeTile;
    const int y = std::clamp(top + i - halo, 0, height_ - 1);
    if (y == made) {
      std::memcpy(guide, guide - kWholeTile, static_cast<size_t>(whole));
      std::memcpy(white, white - kWholeTile, static_cast<size_t>(whole));
      continue;
    }
    made = y;
    const auto start = static_cast<size_t>(y) * static_cast<size_t>(width_) +
                       static_cast<size_t>(left + first - halo);
    const uint8_t* const x[3] = {frame.x[0] + start, frame.x[1] + start, frame.x[2] + start};
    const uint8_t* level[3];
    frame.decision.level(y, level);
    for (const uint8_t*& plane : level) plane += left + first - halo;
    residual_norm(x, level, count, guide + first);
    std::memcpy(white + first, frame.decision.mask() + start, count);
    repeat_ends(guide, first, end, whole);
    repeat_ends(white, first, end, whole);
  }
}

}  // namespace qdmd
