#include "core/background/robust/median_picture.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/background/robust/median_picture.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {
namespace {

// Pixels that are sorted side by side: some rows of a cell.
constexpr size_t kRun = 128;
// kMedianFrames and one that is never taken: a power of two.
constexpr size_t kMost = 32;

// Sorts `count` samples, a power of two, of each of kRun pixels: Batcher's odd-even merge sort,
// whose comparisons do not depend on the samples. Plain loops, which the compiler makes vectors of.
void sort_samples(uint8_t (*samples)[kRun], size_t count) {
  for (size_t p = 1; p < count; p *= 2)
    for (size_t k = p; k >= 1; k /= 2)
      for (size_t j = k % p; j + k < count; j += 2 * k)
        for (size_t i = 0; i < std::min(k, count - j - k); ++i) {
          if ((i + j) / (2 * p) != (i + j + k) / (2 * p)) continue;
          uint8_t* HWY_RESTRICT low = samples[i + j];
          uint8_t* HWY_RESTRICT high = samples[i + j + k];
          for (size_t x = 0; x < kRun; ++x) {
            const uint8_t a = low[x], b = high[x];
            low[x] = a < b ? a : b;
            high[x] = a < b ? b : a;
          }
        }
}

// The median of count <= kMost samples of each pixel; the mean of the middle two, rounded up, where
// count is even. Sorts them.
void take_median(uint8_t (*samples)[kRun], size_t count, uint8_t* median) {
  size_t room = 1;
  while (room < count) room *= 2;
  for (size_t i = count; i < room; ++i) std::memset(samples[i], 255, kRun);
  sort_samples(samples, room);
  const uint8_t* low = samples[(count - 1) / 2];
  const uint8_t* high = samples[count / 2];
  for (size_t x = 0; x < kRun; ++x) median[x] = static_cast<uint8_t>((low[x] + high[x] + 1) / 2);
}

}  // namespace

// The pixels of `height` rows of `width` samples, kRun at most in all, that begin at rows[3 i + c]
// in frame i's channel c, of `count` frames, and lie `stride` apart. inverse[3 i + c]: what they
// are multiplied by. The results lie like the frames' samples.
void median_block(const uint8_t* const* rows, const float* inverse, size_t count, size_t width,
                  size_t height, size_t stride, uint8_t* const* background, uint8_t* spread) {
  alignas(64) uint8_t samples[kChannels][kMost][kRun], sorted[kMost][kRun], median[kChannels][kRun];
  const auto scatter = [&](const uint8_t* from, uint8_t* to) {
    for (size_t y = 0; y < height; ++y) std::memcpy(to + y * stride, from + y * width, width);
  };
  const size_t used = width * height;
  for (size_t c = 0; c < kChannels; ++c) {
    for (size_t i = 0; i < count; ++i) {
      const uint8_t* from = rows[kChannels * i + c];
      uint8_t* to = samples[c][i];
      for (size_t y = 0; y < height; ++y) std::memcpy(to + y * width, from + y * stride, width);
      std::memset(to + used, 0, kRun - used);
      const float factor = inverse[kChannels * i + c];
      if (factor == 1) continue;
      for (size_t x = 0; x < kRun; ++x) {
        const float level = static_cast<float>(to[x]) * factor + 0.5f;
        to[x] = static_cast<uint8_t>(static_cast<int>(level < 255.0f ? level : 255.0f));
      }
    }
    std::memcpy(sorted, samples[c], count * kRun);
    take_median(sorted, count, median[c]);
    scatter(median[c], background[c]);
  }
  for (size_t i = 0; i < count; ++i)
    for (size_t x = 0; x < kRun; ++x) {
      const int r = samples[0][i][x] - median[0][x], g = samples[1][i][x] - median[1][x],
                b = samples[2][i][x] - median[2][x];
      const float norm = std::sqrt(static_cast<float>(r * r + g * g + b * b));
      sorted[i][x] = static_cast<uint8_t>(static_cast<int>(norm < 63.75f ? 4 * norm : 255.0f));
    }
  // One frame says nothing of a spread.
  if (count > 1)
    take_median(sorted, count, median[0]);
  else
    std::memset(median[0], 0, kRun);
  scatter(median[0], spread);
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(median_block);

constexpr int kBlockPixels = 128;

}  // namespace

void median_picture(const Grid& grid, const StableFrames& stable,
                    const std::vector<LitPicture>& frames, Pool* pool, uint8_t* const background[3],
                    uint8_t* spread) {
  // A row of cells a part.
  pool->run(static_cast<size_t>(grid.rows), [&](size_t part) {
    const int row = static_cast<int>(part);
    for (int col = 0; col < grid.cols; ++col) {
      const auto& shown =
          stable.of_cell[part * static_cast<size_t>(grid.cols) + static_cast<size_t>(col)];
      const size_t known = shown.size(), count = std::min<size_t>(known, kMedianFrames);
      const uint8_t* planes[kChannels * kMedianFrames];
      float inverse[kChannels * kMedianFrames];
      for (size_t i = 0; i < count; ++i) {
        const LitPicture& frame =
            frames[static_cast<size_t>(shown[(2 * i + 1) * known / (2 * count)])];
        for (size_t c = 0; c < kChannels; ++c) {
          planes[kChannels * i + c] = frame.plane[c];
          inverse[kChannels * i + c] = 1 / frame.gain[c];
        }
      }
      const int left = grid.left(col), right = grid.left(col + 1);
      const int width = std::min(kBlockPixels, right - left), height = kBlockPixels / width;
      for (int y = grid.top(row); y < grid.top(row + 1); y += height)
        for (int x = left; x < right; x += width) {
          const auto first =
              static_cast<size_t>(y) * static_cast<size_t>(grid.width) + static_cast<size_t>(x);
          const uint8_t* rows[kChannels * kMedianFrames];
          for (size_t i = 0; i < kChannels * count; ++i) rows[i] = planes[i] + first;
          uint8_t* const out[3] = {background[0] + first, background[1] + first,
                                   background[2] + first};
          HWY_DYNAMIC_DISPATCH(median_block)
          (rows, inverse, count, static_cast<size_t>(std::min(width, right - x)),
           static_cast<size_t>(std::min(height, grid.top(row + 1) - y)),
           static_cast<size_t>(grid.width), out, spread + first);
        }
    }
  });
}

}  // namespace qdmd
#endif
