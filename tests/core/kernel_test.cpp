// SPDX-License-Identifier: LGPL-2.1-or-later
// Every kernel against integers of any size.
#include "core/gram/kernel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cstring>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "core/planes/snapshot_range.h"

namespace qdmd::test {
namespace {

using boost::multiprecision::cpp_int;
using Planes = std::vector<std::vector<uint8_t>>;

// 64 bits hold a block's sum by a wide margin (65536 * 255^2 < 2^32); the sum of the blocks has no
// limit. Adding hundreds of millions of products to a cpp_int one by one would take far longer than
// all kernels together.
cpp_int exact_dot(const std::vector<uint8_t>& x, const std::vector<uint8_t>& y) {
  constexpr size_t kBlock = 65536;
  cpp_int sum = 0;
  for (size_t start = 0; start < x.size(); start += kBlock) {
    uint64_t block = 0;
    for (size_t p = start; p < std::min(x.size(), start + kBlock); ++p)
      block += uint64_t{x[p]} * y[p];
    sum += block;
  }
  return sum;
}

Planes random_planes(size_t count, size_t length, std::mt19937& rng) {
  Planes planes(count, std::vector<uint8_t>(length));
  // Four samples a draw: distributions are slow at 1920x1080.
  for (auto& plane : planes)
    for (size_t p = 0; p < length; p += 4) {
      const auto samples = static_cast<uint32_t>(rng());
      std::memcpy(plane.data() + p, &samples, std::min<size_t>(4, length - p));
    }
  return planes;
}

// Where narrow factors change sign, pairs of products saturate, and sums are largest.
Planes extreme_planes(size_t length) {
  Planes planes;
  for (int level : {0, 1, 127, 128, 255}) planes.emplace_back(length, static_cast<uint8_t>(level));
  for (size_t phase : {size_t{0}, size_t{1}}) {
    planes.emplace_back(length);
    for (size_t p = phase; p < length; p += 2) planes.back()[p] = 255;
  }
  for (size_t p : {size_t{0}, length - 1}) {
    planes.emplace_back(length);
    planes.back()[p] = 255;
  }
  return planes;
}

struct Size {
  size_t width, height;
};

class KernelExactness : public testing::TestWithParam<Size> {
 protected:
  static size_t pixels() { return GetParam().width * GetParam().height; }

  static void expect_exact(const Planes& planes) {
    const size_t count = planes.size();
    std::vector<const uint8_t*> pointers;
    for (const auto& plane : planes) pointers.push_back(plane.data());
    std::vector<cpp_int> expected(count * count);
    for (size_t i = 0; i < count; ++i)
      for (size_t j = i; j < count; ++j)
        expected[i * count + j] = expected[j * count + i] = exact_dot(planes[i], planes[j]);
    for (const Kernel& kernel : kernels()) {
      std::vector<int64_t> out(count * count);
      kernel.add_dot_products(pointers.data(), count, pointers.data(), count, 0, planes[0].size(),
                              out.data());
      for (size_t k = 0; k < out.size(); ++k)
        ASSERT_EQ(cpp_int(out[k]), expected[k])
            << kernel.name << ", planes " << k / count << " and " << k % count;
    }
  }
};

TEST_P(KernelExactness, RandomPixels) {
  std::mt19937 rng(71);
  constexpr size_t kFrames = 3;
  expect_exact(random_planes(kFrames * kChannels, pixels(), rng));
}

TEST_P(KernelExactness, ExtremePixels) { expect_exact(extreme_planes(pixels())); }

INSTANTIATE_TEST_SUITE_P(Sizes, KernelExactness,
                         testing::Values(Size{1, 1}, Size{3, 1}, Size{63, 1}, Size{64, 1},
                                         Size{65, 1}, Size{255, 1}, Size{2049, 1}, Size{4095, 1},
                                         Size{4097, 1}, Size{65793, 1}, Size{65794, 1},
                                         Size{320, 240}, Size{1920, 1080}),
                         [](const testing::TestParamInfo<Size>& size) {
                           return std::to_string(size.param.width) + "x" +
                                  std::to_string(size.param.height);
                         });

// Tiles that are not full, in rows, in columns and in pixels, at any alignment.
TEST(Kernels, AnyNumberOfRowsAndColumns) {
  std::mt19937 rng(72);
  constexpr size_t kMost = 101;
  const Planes planes = random_planes(kMost, 5000, rng);
  const Kernel& reference = kernels().back();
  for (const size_t row_count : {1, 2, 3, 15, 16, 17, 32, 33, 48, 49, 101})
    for (const size_t col_count : {1, 3, 4, 5, 7, 8, 9, 96, 101})
      for (const size_t length : {1, 2, 5, 257, 4099}) {
        std::vector<const uint8_t*> rows, cols;
        for (size_t i = 0; i < row_count; ++i) rows.push_back(planes[kMost - 1 - i].data() + i % 5);
        for (size_t j = 0; j < col_count; ++j) cols.push_back(planes[j].data() + j % 3);
        std::vector<int64_t> expected(row_count * col_count), out(row_count * col_count);
        reference.add_dot_products(rows.data(), row_count, cols.data(), col_count, 0, length,
                                   expected.data());
        for (const Kernel& kernel : kernels()) {
          std::fill(out.begin(), out.end(), 0);
          kernel.add_dot_products(rows.data(), row_count, cols.data(), col_count, 0, length,
                                  out.data());
          ASSERT_EQ(out, expected) << kernel.name << ", " << row_count << " x " << col_count << ", "
                                   << length << " pixels";
        }
      }
}

std::vector<const uint8_t*> pointers_to(const Planes& planes) {
  std::vector<const uint8_t*> pointers;
  for (const auto& plane : planes) pointers.push_back(plane.data());
  return pointers;
}

// What every kernel adds to `out` equals what the reference adds.
void expect_equal_to_reference(const std::vector<const uint8_t*>& rows,
                               const std::vector<const uint8_t*>& cols, size_t first,
                               size_t length) {
  const auto added = [&](const Kernel& kernel) {
    std::vector<int64_t> out(rows.size() * cols.size());
    // Something to add to, other at each place.
    std::iota(out.begin(), out.end(), int64_t{-70});
    kernel.add_dot_products(rows.data(), rows.size(), cols.data(), cols.size(), first, length,
                            out.data());
    return out;
  };
  const auto expected = added(kernels().back());
  for (const Kernel& kernel : kernels())
    ASSERT_EQ(added(kernel), expected) << kernel.name << ", " << rows.size() << " x " << cols.size()
                                       << ", " << length << " pixels from " << first;
}

// As a group of frames meets itself and all before: half of the group's products are mirror images.
TEST(Kernels, RowsThatAreTheLastColumns) {
  std::mt19937 rng(73);
  const Planes planes = random_planes(160, 5000, rng);
  const auto all = pointers_to(planes);
  for (const ptrdiff_t row_count : {1, 2, 7, 15, 16, 17, 24, 25, 33, 47, 48, 49, 51, 96, 97, 101})
    for (const ptrdiff_t before : {0, 1, 3, 4, 7, 8, 9, 48, 59})
      for (const size_t length : {1, 6, 300, 4099}) {
        const std::vector<const uint8_t*> cols(all.begin(), all.begin() + before + row_count);
        const std::vector<const uint8_t*> rows(cols.begin() + before, cols.end());
        expect_equal_to_reference(rows, cols, 0, length);
      }
}

TEST(Kernels, RowsThatAreNearlyTheLastColumns) {
  std::mt19937 rng(74);
  const Planes planes = random_planes(70, 300, rng);
  const auto cols = pointers_to(planes);
  for (const size_t other : {0, 1, 30, 48, 49}) {
    std::vector<const uint8_t*> rows(cols.end() - 50, cols.end());
    rows[other] = cols[3];
    expect_equal_to_reference(rows, cols, 0, 300);
  }
  // In another order, and the first columns instead of the last.
  expect_equal_to_reference({cols.rbegin(), cols.rbegin() + 50}, cols, 0, 300);
  expect_equal_to_reference({cols.begin(), cols.begin() + 50}, cols, 0, 300);
  // More rows than columns.
  expect_equal_to_reference(cols, {cols.begin(), cols.begin() + 50}, 0, 300);
}

TEST(Kernels, AnyRangeOfPixels) {
  std::mt19937 rng(75);
  const Planes planes = random_planes(57, 9000, rng);
  const auto cols = pointers_to(planes);
  const std::vector<const uint8_t*> rows(cols.end() - 50, cols.end());
  for (const size_t first : {0, 1, 2, 3, 63, 64, 65, 4095})
    for (const size_t length : {0, 1, 3, 63, 64, 65, 255, 4097})
      expect_equal_to_reference(rows, cols, first, length);
}

// A kernel's blocks are of 2048 or 4096 pixels, and of nearly equal sizes where there are several.
TEST(Kernels, PixelsAroundWholeBlocks) {
  std::mt19937 rng(76);
  const Planes planes = random_planes(20, 65537, rng);
  const auto cols = pointers_to(planes);
  const std::vector<const uint8_t*> rows(cols.begin(), cols.begin() + 3);
  for (const size_t length : {2048, 4096, 6144, 8192, 12288, 16384, 32768, 65536})
    for (const size_t off : {0, 1, 2, 3, 4, 5})
      expect_equal_to_reference(rows, cols, 0, length - off);
  for (const size_t length : {2049, 4097, 8193, 65537})
    expect_equal_to_reference(rows, cols, 0, length);
}

// Zeros and the largest levels, where 32 bits are narrowest, in full and in partial tiles.
TEST(Kernels, BlackAndWhiteOfAllSizes) {
  constexpr size_t kMost = 65793 + 1;
  const Planes shades = {std::vector<uint8_t>(kMost, 0), std::vector<uint8_t>(kMost, 255)};
  for (const size_t length :
       {1, 3, 63, 64, 65, 255, 2048, 4095, 4096, 4097, 32768, 33025, 33026, 65536, 65793, 65794})
    for (const size_t count : {1, 9, 50}) {
      // All black, all white, and one of the other shade.
      for (const size_t shade : {0, 1}) {
        std::vector<const uint8_t*> planes(count, shades[shade].data());
        const auto expected_of = [&](size_t i, size_t j) {
          const bool white = planes[i] == shades[1].data() && planes[j] == shades[1].data();
          return white ? int64_t{255} * 255 * static_cast<int64_t>(length) : 0;
        };
        for (const bool with_other : {false, true}) {
          if (with_other) planes[count / 2] = shades[1 - shade].data();
          for (const Kernel& kernel : kernels()) {
            if (std::string(kernel.name) == "reference" && count > 9) continue;
            std::vector<int64_t> out(count * count);
            kernel.add_dot_products(planes.data(), count, planes.data(), count, 0, length,
                                    out.data());
            for (size_t k = 0; k < out.size(); ++k)
              ASSERT_EQ(out[k], expected_of(k % count, k / count))
                  << kernel.name << ", " << count << " planes of " << length << " pixels";
          }
        }
      }
    }
}

TEST(Kernels, WhiteOfAMegapixel) {
  constexpr size_t kPixels = 1 << 20;
  const Planes planes(9, std::vector<uint8_t>(kPixels, 255));
  const auto pointers = pointers_to(planes);
  const std::vector<int64_t> expected(81, int64_t{255} * 255 * kPixels);
  for (const Kernel& kernel : kernels()) {
    std::vector<int64_t> out(81);
    kernel.add_dot_products(pointers.data(), 9, pointers.data(), 9, 0, kPixels, out.data());
    EXPECT_EQ(out, expected) << kernel.name;
  }
}

TEST(Kernels, HaveNamesOfTheirOwn) {
  for (const Kernel& kernel : kernels())
    for (const Kernel& other : kernels())
      EXPECT_EQ(&kernel == &other, std::string(kernel.name) == other.name);
}

}  // namespace
}  // namespace qdmd::test
