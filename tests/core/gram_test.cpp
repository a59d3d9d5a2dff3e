// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/gram/gram.h"

#include <algorithm>
#include <cstring>

#include "core/gram/kernel.h"
#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

// ---- dot_products ----

using Planes = std::vector<std::vector<uint8_t>>;

int64_t naive_dot(const std::vector<uint8_t>& x, const std::vector<uint8_t>& y) {
  int64_t sum = 0;
  for (size_t p = 0; p < x.size(); ++p) sum += int64_t{x[p]} * int64_t{y[p]};
  return sum;
}

void expect_exact(const Planes& rows, const Planes& cols, size_t length) {
  std::vector<const uint8_t*> row_pointers, col_pointers;
  for (const auto& row : rows) row_pointers.push_back(row.data());
  for (const auto& col : cols) col_pointers.push_back(col.data());
  for (const Kernel& kernel : kernels()) {
    // Sums are added to what `out` holds, and nothing behind it is touched.
    std::vector<int64_t> out(rows.size() * cols.size() + 1, -12345);
    kernel.add_dot_products(row_pointers.data(), rows.size(), col_pointers.data(), cols.size(), 0,
                            length, out.data());
    for (size_t i = 0; i < rows.size(); ++i)
      for (size_t j = 0; j < cols.size(); ++j)
        EXPECT_EQ(out[j * rows.size() + i] + 12345, naive_dot(rows[i], cols[j]))
            << kernel.name << " length " << length << " row " << i << " col " << j;
    EXPECT_EQ(out.back(), -12345) << kernel.name;
  }
}

// Around vector widths, around blocks of 4096 and 8192 pixels, and several blocks.
constexpr size_t kLengths[] = {1,    2,    3,    15,   16,    17,    31,    33,
                               63,   64,   65,   127,  255,   1000,  4095,  4096,
                               4097, 8191, 8192, 8193, 12289, 16384, 16385, 70000};

TEST(DotProducts, RandomPixels) {
  std::mt19937 rng(61);
  std::uniform_int_distribution<int> level(0, 255);
  for (size_t length : kLengths) {
    Planes rows(3, std::vector<uint8_t>(length)), cols(7, std::vector<uint8_t>(length));
    for (auto* planes : {&rows, &cols})
      for (auto& plane : *planes)
        for (auto& sample : plane) sample = static_cast<uint8_t>(level(rng));
    expect_exact(rows, cols, length);
  }
}

TEST(DotProducts, ExtremePixels) {
  // 255 * 255 is what overflows a signed 8-bit factor or a saturating 16-bit pair of products.
  for (size_t length : kLengths) {
    const std::vector<uint8_t> white(length, 255), black(length, 0), middle(length, 128);
    const Planes all = {white, black, middle};
    expect_exact(all, all, length);
  }
}

TEST(DotProducts, SumsBeyond32Bits) {
  // 255^2 * 70000 = 4.55e9 does not fit 32 bits, signed or unsigned.
  const std::vector<uint8_t> white(70000, 255);
  const uint8_t* pointer = white.data();
  for (const Kernel& kernel : kernels()) {
    int64_t out = 0;
    kernel.add_dot_products(&pointer, 1, &pointer, 1, 0, white.size(), &out);
    EXPECT_EQ(out, int64_t{255} * 255 * 70000) << kernel.name;
    EXPECT_GT(out, int64_t{UINT32_MAX}) << kernel.name;
  }
}

TEST(DotProducts, EveryShapeOfTile) {
  std::mt19937 rng(62);
  std::uniform_int_distribution<int> level(0, 255);
  const size_t length = 130;
  Planes planes(13, std::vector<uint8_t>(length));
  for (auto& plane : planes)
    for (auto& sample : plane) sample = static_cast<uint8_t>(level(rng));
  for (size_t rows = 1; rows <= 7; ++rows)
    for (size_t cols = 1; cols <= 13; ++cols)
      expect_exact({planes.begin(), planes.begin() + static_cast<ptrdiff_t>(rows)},
                   {planes.begin(), planes.begin() + static_cast<ptrdiff_t>(cols)}, length);
}

TEST(DotProducts, UnalignedPlanes) {
  std::mt19937 rng(63);
  std::uniform_int_distribution<int> level(0, 255);
  std::vector<uint8_t> x(400), y(400);
  for (auto& sample : x) sample = static_cast<uint8_t>(level(rng));
  for (auto& sample : y) sample = static_cast<uint8_t>(level(rng));
  for (ptrdiff_t offset = 0; offset < 64; offset += 7) {
    const uint8_t* row = x.data() + offset;
    const uint8_t* col = y.data() + 63 - offset;
    for (const Kernel& kernel : kernels()) {
      int64_t out = 0;
      kernel.add_dot_products(&row, 1, &col, 1, 0, 300, &out);
      EXPECT_EQ(out, naive_dot({row, row + 300}, {col, col + 300})) << kernel.name;
    }
  }
}

// ---- Window ----

TEST(Window, FillsSlotsInOrderAndDropsTheOldest) {
  Window window(3, 10);
  EXPECT_EQ(window.size(), 0);
  EXPECT_EQ(window.capacity(), 3);
  // Frame number f is stored in slot f % 3 and stays there.
  for (int f = 0; f < 8; ++f) {
    const int slot = window.append();
    EXPECT_EQ(slot, f % 3);
    std::memset(window.plane(slot, 0), f, window.pixels());
    EXPECT_EQ(window.size(), std::min(f + 1, 3));
    for (int index = 0; index < window.size(); ++index) {
      const int frame = f + 1 - window.size() + index;
      EXPECT_EQ(window.plane(window.slot(index), 0)[9], frame);
    }
  }
  window.clear();
  EXPECT_EQ(window.size(), 0);
  window.append();
  EXPECT_EQ(window.size(), 1);
}

TEST(Window, PlanesAreAlignedApartAndPaddedWithZeros) {
  for (size_t pixels : {size_t{1}, size_t{63}, size_t{64}, size_t{65}, size_t{1000}}) {
    Window window(2, pixels);
    EXPECT_EQ(window.plane_size() % 64, 0u);
    EXPECT_GE(window.plane_size(), pixels);
    EXPECT_LT(window.plane_size(), pixels + 64);
    EXPECT_EQ(Window::bytes(2, pixels), 2 * 3 * window.plane_size());
    for (int f = 0; f < 3; ++f) {
      const int slot = window.append();
      for (int c = 0; c < kChannels; ++c) {
        EXPECT_EQ(reinterpret_cast<uintptr_t>(window.plane(slot, c)) % 64, 0u);
        for (size_t p = pixels; p < window.plane_size(); ++p)
          ASSERT_EQ(window.plane(slot, c)[p], 0);
        std::memset(window.plane(slot, c), 10 * f + c + 1, pixels);
      }
    }
    // Neighbouring planes did not overwrite each other.
    for (int index = 0; index < 2; ++index)
      for (int c = 0; c < kChannels; ++c)
        for (size_t p = 0; p < pixels; ++p)
          ASSERT_EQ(window.plane(window.slot(index), c)[p], 10 * (index + 1) + c + 1);
  }
}

TEST(Window, BytesOfALargeWindowDoNotOverflow) {
  // 2048 frames of 8K video: 204 GB.
  EXPECT_EQ(Window::bytes(2048, size_t{7680} * 4320), uint64_t{2048} * 3 * 7680 * 4320);
}

// ---- Gram matrices ----

IntegerMatrix naive_gram(const Clip& clip) {
  const auto m = static_cast<Eigen::Index>(clip.size());
  IntegerMatrix gram(3 * m, 3 * m);
  for (Eigen::Index s = 0; s < 3 * m; ++s)
    for (Eigen::Index t = 0; t < 3 * m; ++t) {
      int64_t sum = 0;
      for (size_t p = 0; p < clip.pixels; ++p)
        sum += int64_t{clip.at(static_cast<size_t>(s / 3), static_cast<size_t>(s % 3), p)} *
               clip.at(static_cast<size_t>(t / 3), static_cast<size_t>(t % 3), p);
      gram(s, t) = sum;
    }
  return gram;
}

TEST(SlidingGram, EqualsTheNaiveGramWhileFillingUp) {
  std::mt19937 rng(64);
  const Clip clip = random_clip(77, 5, rng);
  Window window(5, clip.pixels);
  SlidingGram gram(5);
  EXPECT_EQ(gram.matrix(window).size(), 0);
  Clip seen(clip.pixels, 0);
  for (const auto& frame : clip.frames) {
    append_frame(window, frame);
    gram.add_newest(window);
    seen.frames.push_back(frame);
    EXPECT_EQ(gram.matrix(window), naive_gram(seen));
  }
}

TEST(SlidingGram, ManySlidesEqualAFreshStartBitForBit) {
  std::mt19937 rng(65);
  constexpr int kCapacity = 6;
  const size_t pixels = 8200;  // two kernel blocks
  Window window(kCapacity, pixels);
  SlidingGram sliding(kCapacity);
  for (int f = 0; f < 5 * kCapacity + 3; ++f) {
    append_frame(window, random_picture(pixels, rng));
    sliding.add_newest(window);
  }
  EXPECT_EQ(sliding.matrix(window), gram_of(window));
  window.clear();
  const auto picture = random_picture(pixels, rng);
  append_frame(window, picture);
  sliding.add_newest(window);
  EXPECT_EQ(sliding.matrix(window), naive_gram(static_clip(picture, 1))) << "after clear";
}

TEST(SlidingGram, SnapshotsAddedInGroups) {
  std::mt19937 rng(69);
  constexpr int kCapacity = 7;
  for (int group : {1, 2, 3, 4, 7}) {
    Window window(kCapacity, 100);
    SlidingGram gram(kCapacity);
    for (int frame = 1; frame <= 6 * group; ++frame) {
      append_frame(window, random_picture(100, rng));
      if (frame % group > 0) continue;
      gram.add_newest(window, group);
      EXPECT_EQ(gram.matrix(window), gram_of(window)) << group << " at a time, frame " << frame;
    }
  }
}

TEST(SlidingGram, PaddingAddsNothing) {
  // 65 pixels leave 63 bytes of padding in each plane.
  std::mt19937 rng(66);
  const Clip clip = random_clip(65, 4, rng);
  EXPECT_EQ(gram_of(to_window(clip)), naive_gram(clip));
}

TEST(QuaternionGram, IsTheGramOfQuaternionSnapshots) {
  std::mt19937 rng(67);
  const Clip clip = random_clip(50, 6, rng);
  const auto x = to_quaternions(clip);
  const auto g = quaternion_gram_of(clip);
  for (int s = 0; s < 6; ++s)
    for (int t = 0; t < 6; ++t) {
      Quaterniond sum;
      for (int p = 0; p < 50; ++p) sum += x.get(p, s).conj() * x.get(p, t);
      // Sums of integers below 2^53: exact, in any order.
      EXPECT_EQ(distance(g.get(s, t), sum), 0) << s << ' ' << t;
      EXPECT_EQ(distance(g.get(s, t), g.get(t, s).conj()), 0);
    }
}

TEST(ChannelGram, IsTheGramOfOneChannel) {
  std::mt19937 rng(68);
  const Clip clip = random_clip(40, 5, rng);
  const auto gram = gram_of(to_window(clip));
  for (int c = 0; c < kChannels; ++c) {
    Eigen::MatrixXd x(40, 5);
    for (int t = 0; t < 5; ++t)
      for (int p = 0; p < 40; ++p)
        x(p, t) = clip.at(static_cast<size_t>(t), static_cast<size_t>(c), static_cast<size_t>(p));
    EXPECT_EQ(channel_gram(gram, c), x.transpose() * x);  // integers again
  }
}

TEST(DistinctSnapshots, AreCountedByTheirPixels) {
  std::mt19937 rng(69);
  for (int round = 0; round < 50; ++round) {
    Clip clip = random_clip(40, 9, rng);
    for (size_t t = 1; t < clip.frames.size(); ++t) {
      const auto& other = clip.frames[rng() % t];
      switch (rng() % 5) {
        case 0:  // seen before
          clip.frames[t] = other;
          break;
        case 1:  // but for one level
          clip.frames[t] = other;
          clip.frames[t][rng() % 120] ^= 1;
          break;
        case 2:  // as long, and another picture
          clip.frames[t].assign(other.rbegin(), other.rend());
          break;
        case 3:
          std::fill(clip.frames[t].begin(), clip.frames[t].end(), uint8_t{0});
          break;
        default:
          break;
      }
    }
    const auto gram = gram_of(to_window(clip));
    int distinct = 0;
    for (size_t count = 0; count <= clip.frames.size(); ++count) {
      if (count > 0) {
        const auto newest = clip.frames.begin() + static_cast<ptrdiff_t>(count) - 1;
        const bool black = *newest == std::vector<uint8_t>(newest->size(), 0);
        distinct += !black && std::find(clip.frames.begin(), newest, *newest) == newest;
      }
      EXPECT_EQ(distinct_snapshots(gram, static_cast<int>(count)), distinct)
          << round << ' ' << count;
    }
  }
}

}  // namespace
}  // namespace qdmd::test
