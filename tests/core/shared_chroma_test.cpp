// SPDX-License-Identifier: LGPL-2.1-or-later
// Inner products of frames whose chroma samples are shared: the same bits as those of frames in
// which each pixel has its own.
#include "core/gram/shared_chroma.h"

#include "core/gram/block_sums.h"
#include "core/gram/gram.h"
#include "tests/core/simd_targets.h"
#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

TEST(BlockSums, AreTwoDigits) {
  std::mt19937 rng(2103);
  on_every_target([&] {
    for (size_t count : {1, 2, 3, 15, 16, 17, 31, 32, 33, 63, 64, 65, 127, 128, 129, 130, 641})
      for (bool two_rows : {false, true}) {
        BeforeTheEdge<uint8_t> above(count), below(count), high((count + 1) / 2),
            low((count + 1) / 2);
        for (uint8_t& sample : above) sample = static_cast<uint8_t>(rng() >> 9);
        for (uint8_t& sample : below) sample = static_cast<uint8_t>(rng() >> 9);
        if (count > 5) above[0] = above[1] = below[0] = below[1] = 255;
        block_sums(above.data(), two_rows ? below.data() : nullptr, count, high.data(), low.data());
        for (size_t k = 0; k < high.size(); ++k) {
          int sum = 0;
          for (size_t p = 2 * k; p < std::min(count, 2 * k + 2); ++p)
            sum += above[p] + (two_rows ? below[p] : 0);
          ASSERT_EQ(4 * high[k] + low[k], sum) << k << " of " << count;
          ASSERT_LT(low[k], 4);
        }
      }
  });
}

// Frames in two forms: with chroma of their own size, and with it spread to all pixels.
struct Frames {
  ChromaShape shape;
  Window shared, spread;
  std::mt19937 rng{2104};

  Frames(const ChromaShape& shape_, int capacity)
      : shape(shape_), shared(capacity, shape), spread(capacity, shape.pixels()) {}

  // levels: only black and white, or all.
  void append(bool extremes) {
    const int slot = shared.append(), wide = spread.append();
    for (int c = 0; c < kChannels; ++c) {
      const size_t count = c == 0 ? shape.pixels() : shape.samples();
      for (size_t p = 0; p < count; ++p)
        shared.plane(slot, c)[p] =
            static_cast<uint8_t>(extremes ? 255 * (rng() % 8 > 0) : rng() >> 9);
      for (int y = 0; y < shape.height; ++y)
        for (int x = 0; x < shape.width; ++x)
          spread.plane(wide, c)[y * shape.width + x] =
              c == 0 ? shared.plane(slot, c)[y * shape.width + x]
                     : shared.plane(slot,
                                    c)[y / shape.rows * shape.chroma_width() + x / shape.columns];
    }
  }
};

TEST(SharedChroma, HasTheProductsOfAllPixels) {
  for (int rows : {1, 2})
    for (const auto& [width, height] : {std::pair{1, 1},
                                        {2, 1},
                                        {1, 2},
                                        {3, 3},
                                        {5, 4},
                                        {8, 6},
                                        {64, 31},
                                        {67, 34},
                                        {133, 41},
                                        {2101, 7}})
      for (const Kernel& kernel : kernels())
        for (int threads : {1, 3}) {
          SCOPED_TRACE(std::string(kernel.name) + " " + std::to_string(width) + "x" +
                       std::to_string(height) + ", " + std::to_string(rows) + " rows, " +
                       std::to_string(threads) + " threads");
          constexpr int kCapacity = 19;
          Frames frames({width, height, 2, rows}, kCapacity);
          Pool pool(threads);
          SlidingGram gram(kCapacity, frames.shape, 8, &pool, kernel),
              plain(kCapacity, &pool, kernel);
          // More at once than are multiplied together, and past the end of the ring.
          for (int group : {1, 3, 18, 2}) {
            for (int i = 0; i < group; ++i) frames.append(group == 3);
            gram.add_rows(frames.shared, group, 0, frames.shape.chroma_height());
            plain.add_newest(frames.spread, group);
            ASSERT_EQ(gram.matrix(frames.shared), plain.matrix(frames.spread)) << group;
          }
        }
}

TEST(SharedChroma, InSlicesOfRows) {
  Frames frames({301, 75, 2, 2}, 6);
  Pool pool(2);
  SlidingGram gram(6, frames.shape, 8, &pool), plain(6);
  for (int turn = 0; turn < 3; ++turn) {
    for (int i = 0; i < 4; ++i) frames.append(false);
    for (int first = 0; first < 38;) {
      const int count = std::min(1 + first * turn, 38 - first);
      gram.add_rows(frames.shared, 4, first, count);
      first += count;
    }
    plain.add_newest(frames.spread, 4);
    ASSERT_EQ(gram.matrix(frames.shared), plain.matrix(frames.spread));
  }
}

TEST(SharedChroma, MoreThreadsLater) {
  Frames frames({640, 361, 2, 2}, 5);
  Pool pool(1);
  SlidingGram gram(5, frames.shape, 8, &pool), plain(5);
  for (int threads : {1, 3, 2}) {
    pool.resize(threads);
    for (int i = 0; i < 5; ++i) frames.append(false);
    gram.add_rows(frames.shared, 5, 0, frames.shape.chroma_height());
    plain.add_newest(frames.spread, 5);
    ASSERT_EQ(gram.matrix(frames.shared), plain.matrix(frames.spread)) << threads;
  }
}

}  // namespace
}  // namespace qdmd::test
