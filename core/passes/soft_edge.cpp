// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/soft_edge.h"

#include <algorithm>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/soft_edge.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {
namespace {

// A row of a tile with its halo.
constexpr int kWhole = kSoftTile + 4 * kMostSoftness;
// Windows of a row whose lines are needed: those of half of the halo, too.
constexpr int kLines = kSoftTile + 2 * kMostSoftness;
// Lines are in 1 / kOne of a level of the guide, and of the mask.
constexpr int kOne = 65536;

// Rows go in blocks, without a loop for what is left over; what is behind their end is of no use.
constexpr int kBlock = 16;
constexpr int in_blocks(int count) { return (count + kBlock - 1) / kBlock * kBlock; }

// Sums over windows, modulo 2^32: what comes of them fits. With what sum_along() reads behind them.
struct Row {
  alignas(64) uint32_t at[in_blocks(kWhole) + 3 * kBlock] = {};
};

}  // namespace

// Plain loops, which the compiler makes vectors of for each instruction set.

// out[i] = row[i] + .. + row[i + size - 1], by sums of 1, 2, 4 .. samples. rooms: two
// for these.
void sum_along(const Row& row, int count, int size, Row* rooms, Row* out) {
  const uint32_t* now = row.at;
  for (int step = 1, done = 0;; step *= 2) {
    if (size & step) {
      const uint32_t* HWY_RESTRICT const from = now + done;
      uint32_t* HWY_RESTRICT const to = out->at;
      if (done == 0)
        for (int i = 0; i < count; i += kBlock)
          for (int k = i; k < i + kBlock; ++k) to[k] = from[k];
      else
        for (int i = 0; i < count; i += kBlock)
          for (int k = i; k < i + kBlock; ++k) to[k] += from[k];
      done += step;
    }
    if (done == size) return;
    const uint32_t* HWY_RESTRICT const from = now;
    uint32_t* HWY_RESTRICT const to = rooms[(step & 0x55555555) != 0].at;
    for (int i = 0; i < count + size; i += kBlock)
      for (int k = i; k < i + kBlock; ++k) to[k] = from[k] + from[k + step];
    now = to;
  }
}

// Columns of windows: sums over some rows of the guide, the mask, their product, and the square.
struct Columns {
  Row guide, white, both, square;

  // Samples are readable in whole blocks.
  template <int kSign>
  void add(const uint8_t* HWY_RESTRICT levels, const uint8_t* HWY_RESTRICT mask, int count) {
    for (int i = 0; i < count; i += kBlock)
      for (int k = i; k < i + kBlock; ++k) {
        const uint32_t level = levels[k] >> 1, is_white = mask[k] & 1;
        guide.at[k] += static_cast<uint32_t>(kSign) * level;
        white.at[k] += static_cast<uint32_t>(kSign) * is_white;
        both.at[k] += static_cast<uint32_t>(kSign) * (level * is_white);
        square.at[k] += static_cast<uint32_t>(kSign) * (level * level);
      }
  }
};

// Lines of a row of windows, slope and offset.
struct Lines {
  alignas(64) uint32_t slope[in_blocks(kLines)], offset[in_blocks(kLines)];
};

// a = cov / (var + smooth^2), b = mean of the mask - a mean of the guide. A float is made of a
// whole number and used once, so that nothing is rounded differently where a processor multiplies
// and adds at once.
void find_lines(const Row& guide, const Row& white, const Row& both, const Row& square, int count,
                uint32_t pixels, float flat, Lines* HWY_RESTRICT lines) {
  const float share = 1 / static_cast<float>(pixels);
  for (int i = 0; i < count; i += kBlock)
    for (int k = i; k < i + kBlock; ++k) {
      const uint32_t levels = guide.at[k], whites = white.at[k];
      // pixels^2 cov, and half of pixels^2 var.
      const auto covariance = static_cast<int32_t>(pixels * both.at[k] - levels * whites);
      const auto variance = static_cast<int32_t>((pixels * square.at[k] - levels * levels) >> 1);
      const float a =
          static_cast<float>(covariance) * (kOne / 2) / (static_cast<float>(variance) + flat);
      const auto whole = static_cast<uint32_t>(static_cast<int32_t>(a));
      lines->slope[k] = whole;
      const auto b = static_cast<int32_t>(kOne * whites - whole * levels);
      lines->offset[k] = static_cast<uint32_t>(static_cast<int32_t>(static_cast<float>(b) * share));
    }
}

template <int kSign>
void add_lines(const Lines& lines, int count, Row* HWY_RESTRICT slope, Row* HWY_RESTRICT offset) {
  for (int i = 0; i < count; i += kBlock)
    for (int k = i; k < i + kBlock; ++k) {
      slope->at[k] += static_cast<uint32_t>(kSign) * lines.slope[k];
      offset->at[k] += static_cast<uint32_t>(kSign) * lines.offset[k];
    }
}

void apply_lines(const Row& slope, const Row& offset, const uint8_t* HWY_RESTRICT levels, int count,
                 uint32_t pixels, uint8_t* HWY_RESTRICT out) {
  const float share = 255.0f / static_cast<float>(kOne * pixels);
  const uint32_t half = kOne * pixels / 510;
  for (int k = 0; k < count; ++k) {
    const uint32_t level = levels[k] >> 1;
    const auto sum = static_cast<int32_t>(slope.at[k] * level + offset.at[k] + half);
    const auto alpha = static_cast<int32_t>(static_cast<float>(sum) * share);
    out[k] = static_cast<uint8_t>(std::clamp(alpha, 0, 255));
  }
}

void soften(const uint8_t* guide, const uint8_t* white, size_t stride, int width, int height,
            int softness, float smooth, uint8_t* out, size_t out_stride) {
  const int along = 2 * softness + 1, columns = width + 4 * softness, lines = width + 2 * softness;
  const auto pixels = static_cast<uint32_t>(along * along);
  // Halves of levels, and half of the square.
  const float flat = smooth * smooth / 8 * static_cast<float>(pixels) * static_cast<float>(pixels);
  const auto row = [stride](const uint8_t* samples, int y) {
    return samples + static_cast<size_t>(y) * stride;
  };
  // Lines of the last `along` rows of windows; one of them is overwritten by the newest.
  Lines all_lines[2 * kMostSoftness + 1];
  Columns sums;
  Row window[4], rooms[2], slope_sums, offset_sums;
  uint8_t levels[in_blocks(kWhole)] = {}, mask[in_blocks(kWhole)] = {};
  const auto copy_row = [&](int y) {
    std::memcpy(levels, row(guide, y), static_cast<size_t>(columns));
    std::memcpy(mask, row(white, y), static_cast<size_t>(columns));
  };
  for (int y = 0; y < along - 1; ++y) copy_row(y), sums.add<1>(levels, mask, columns);
  for (int y = 0; y < height + 2 * softness; ++y) {
    // Windows whose first row is y.
    copy_row(y + along - 1);
    sums.add<1>(levels, mask, columns);
    const Row* const all[4] = {&sums.guide, &sums.white, &sums.both, &sums.square};
    for (int k = 0; k < 4; ++k) {
      sum_along(*all[k], lines, along, rooms, &window[k]);
    }
    Lines& newest = all_lines[y % along];
    if (y >= along) add_lines<-1>(newest, lines, &slope_sums, &offset_sums);
    find_lines(window[0], window[1], window[2], window[3], lines, pixels, flat, &newest);
    add_lines<1>(newest, lines, &slope_sums, &offset_sums);
    copy_row(y);
    sums.add<-1>(levels, mask, columns);
    const int done = y - 2 * softness;
    if (done < 0) continue;
    sum_along(slope_sums, width, along, rooms, &window[0]);
    sum_along(offset_sums, width, along, rooms, &window[1]);
    apply_lines(window[0], window[1], row(guide, y) + 2 * softness, width, pixels,
                out + static_cast<size_t>(done) * out_stride);
  }
}

void settle_row(const uint8_t* HWY_RESTRICT soft, const uint8_t* HWY_RESTRICT guide, int most,
                size_t count, uint8_t* HWY_RESTRICT known, uint8_t* HWY_RESTRICT alpha) {
  // In 1/256; levels of alpha.
  constexpr int kKept = 240, kHalf = 128, kLittle = 32, kFar = 96;
  const int slope = 2 * 256 * kKept / std::max(most, 1);
  for (size_t i = 0; i < count; ++i) {
    const int away = known[i] - guide[i], moved = away < 0 ? -away : away;
    const int kept = std::clamp(2 * 256 * kKept - slope * moved, 0, 256 * kKept) >> 8;
    // Rounded towards 0: never so near that it stays away.
    known[i] = static_cast<uint8_t>(guide[i] + away * kept / 256);
    const int left = alpha[i] - soft[i], sign = left < 0 ? -1 : 1;
    const int steps = (kFar - left * sign) * (kHalf / (kFar - kLittle));
    const bool whole = soft[i] == 0 || soft[i] == 255;
    const int stays = kept * (kHalf + (whole ? 0 : std::clamp(steps, 0, kHalf))) >> 8;
    // Rounded to the nearest: what is near stays where it is.
    alpha[i] = static_cast<uint8_t>(soft[i] + (left * stays + 128 * sign) / 256);
  }
}

bool move_mask(const uint8_t* HWY_RESTRICT mask, const uint8_t* HWY_RESTRICT before, size_t stride,
               size_t width, size_t height) {
  size_t changes = 0, edges = 0;
  for (size_t y = 0; y < height; ++y) {
    const uint8_t *const row = mask + y * stride, *const old = before + y * stride;
    const uint8_t* const above = y > 0 ? row - stride : row;
    for (size_t x = 0; x < width; ++x) {
      changes += (row[x] ^ old[x]) & 1;
      edges += (row[x] ^ above[x]) & 1;
    }
    for (size_t x = 1; x < width; ++x) edges += (row[x] ^ row[x - 1]) & 1;
  }
  return changes > 2 * edges;
}

bool both_colours(const uint8_t* HWY_RESTRICT mask, size_t stride, size_t width, size_t height) {
  for (size_t y = 0; y < height; ++y) {
    const uint8_t* HWY_RESTRICT const row = mask + y * stride;
    uint8_t others = 0;
    for (size_t x = 0; x < width; ++x) others |= static_cast<uint8_t>(row[x] ^ mask[0]);
    if (others) return true;
  }
  return false;
}

void fade_row(const uint8_t* HWY_RESTRICT x, const uint8_t* HWY_RESTRICT alpha, uint8_t black,
              size_t count, uint8_t* HWY_RESTRICT out) {
  for (size_t i = 0; i < count; ++i) {
    const auto sum = static_cast<uint16_t>(x[i] * alpha[i] + black * (255 - alpha[i]) + 127);
    // sum / 255
    out[i] = static_cast<uint8_t>(static_cast<uint16_t>(sum + 1 + (sum >> 8)) >> 8);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {

HWY_EXPORT(soften);
HWY_EXPORT(settle_row);
HWY_EXPORT(move_mask);
HWY_EXPORT(both_colours);
HWY_EXPORT(fade_row);

void soften_tile(const uint8_t* guide, const uint8_t* white, size_t stride, int width, int height,
                 int softness, float smooth, uint8_t* out, size_t out_stride) {
  HWY_DYNAMIC_DISPATCH(soften)
  (guide, white, stride, width, height, softness, std::max(smooth, kLeastSmooth), out, out_stride);
}

void settle(const uint8_t* soft, const uint8_t* guide, int most, size_t count, uint8_t* known,
            uint8_t* alpha) {
  HWY_DYNAMIC_DISPATCH(settle_row)(soft, guide, most, count, known, alpha);
}

bool has_moved(const uint8_t* mask, const uint8_t* before, size_t stride, size_t width,
               size_t height) {
  return HWY_DYNAMIC_DISPATCH(move_mask)(mask, before, stride, width, height);
}

bool is_mixed(const uint8_t* mask, size_t stride, size_t width, size_t height) {
  return HWY_DYNAMIC_DISPATCH(both_colours)(mask, stride, width, height);
}

void fade(const uint8_t* x, const uint8_t* alpha, uint8_t black, size_t count, uint8_t* out) {
  HWY_DYNAMIC_DISPATCH(fade_row)(x, alpha, black, count, out);
}

}  // namespace qdmd
#endif
