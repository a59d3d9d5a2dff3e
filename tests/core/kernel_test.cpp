// Every kernel against integers of any size.
#include "core/gram/kernel.h"

#include <boost/multiprecision/cpp_int.hpp>
#include <cstring>

#include "tests/core/test_util.h"

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
      std::vector<int64_t> out(count * count, -1);
      kernel.dot_products(pointers.data(), count, pointers.data(), count, planes[0].size(),
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
                         testing::Values(Size{1, 1}, Size{63, 1}, Size{64, 1}, Size{65, 1},
                                         Size{320, 240}, Size{1920, 1080}),
                         [](const testing::TestParamInfo<Size>& size) {
                           return std::to_string(size.param.width) + "x" +
                                  std::to_string(size.param.height);
                         });

TEST(Kernels, TheDefaultIsTheFirst) {
  ASSERT_FALSE(kernels().empty());
  const uint8_t samples[] = {255, 0, 7};
  const uint8_t* plane = samples;
  int64_t by_default = -1, by_first = -2;
  dot_products(&plane, 1, &plane, 1, 3, &by_default);
  kernels().front().dot_products(&plane, 1, &plane, 1, 3, &by_first);
  EXPECT_EQ(by_default, 255 * 255 + 7 * 7);
  EXPECT_EQ(by_default, by_first);
}

TEST(Kernels, HaveNamesOfTheirOwn) {
  for (const Kernel& kernel : kernels())
    for (const Kernel& other : kernels())
      EXPECT_EQ(&kernel == &other, std::string(kernel.name) == other.name);
}

}  // namespace
}  // namespace qdmd::test
