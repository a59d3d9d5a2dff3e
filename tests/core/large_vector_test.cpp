// Memory in large pages: where it begins, what is in it, and that the system is asked for them.
#include "core/base/large_vector.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdint>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>

#include "core/gram/window.h"

namespace qdmd::test {
namespace {

constexpr size_t kLargePage = size_t{2} << 20;

uintptr_t address_of(const void* at) { return reinterpret_cast<uintptr_t>(at); }

// What the kernel says of the memory: "hg" is in it where large pages are wanted.
std::string flags_of(const void* at) {
  std::ifstream maps("/proc/self/smaps");
  bool found = false;
  for (std::string line; std::getline(maps, line);) {
    uintptr_t begin = 0, end = 0;
    char dash = 0;
    std::istringstream range(line);
    if (range >> std::hex >> begin >> dash >> end && dash == '-')
      found = begin <= address_of(at) && address_of(at) < end;
    else if (found && line.starts_with("VmFlags:"))
      return line + ' ';
  }
  return {};
}

bool knows_large_pages() {
  struct stat state;
  return stat("/sys/kernel/mm/transparent_hugepage", &state) == 0 &&
         !flags_of(std::string(100, ' ').data()).empty();
}

TEST(LargeVector, BeginsAtWholeVectorsAndLargePages) {
  for (const size_t size : {size_t{1}, size_t{63}, size_t{1000}, kLargePage - 1}) {
    const LargeVector<uint8_t> small(size);
    EXPECT_EQ(address_of(small.data()) % kLargeAlignment, 0u) << size;
  }
  for (const size_t size : {kLargePage, kLargePage + 1, 5 * kLargePage}) {
    const LargeVector<uint8_t> large(size);
    EXPECT_EQ(address_of(large.data()) % kLargePage, 0u) << size;
  }
}

TEST(LargeVector, AsksForLargePagesAsFarAsTheyAreWhole) {
  if (!knows_large_pages()) GTEST_SKIP() << "this system has no large pages that one could ask for";
  const LargeVector<uint8_t> two_and_a_half(5 * kLargePage / 2, 1);
  for (const size_t at : {size_t{0}, kLargePage, 2 * kLargePage - 1})
    EXPECT_NE(flags_of(two_and_a_half.data() + at).find(" hg "), std::string::npos) << at;
  EXPECT_EQ(flags_of(two_and_a_half.data() + 2 * kLargePage).find(" hg "), std::string::npos);
  const LargeVector<uint8_t> small(kLargePage - 1, 1);
  EXPECT_EQ(flags_of(small.data() + kLargePage / 2).find(" hg "), std::string::npos);
}

TEST(LargeVector, HoldsWhatItIsTold) {
  LargeVector<float> levels(3 << 20, 2.5f);
  levels.resize(4 << 20, 1);
  EXPECT_EQ(levels.front(), 2.5f);
  EXPECT_EQ(levels[(3 << 20) - 1], 2.5f);
  EXPECT_EQ(levels[3 << 20], 1);
  EXPECT_EQ(levels.back(), 1);
  const float* const data = levels.data();
  const LargeVector<float> moved = std::move(levels);
  EXPECT_EQ(moved.data(), data);
  EXPECT_EQ(LargeVector<float>(moved), moved);
}

// All that can fail says so in one way.
TEST(LargeVector, ThatIsTooLongTakesNoMemory) {
  constexpr size_t kMost = std::numeric_limits<size_t>::max();
  LargeAllocator<float> allocator;
  EXPECT_THROW(allocator.allocate(kMost), std::bad_alloc);
  EXPECT_THROW(allocator.allocate(kMost / sizeof(float)), std::bad_alloc);
  EXPECT_THROW(PlaneSlots(std::numeric_limits<int>::max(), kMost / 8), std::bad_alloc);
  EXPECT_THROW(PlaneSlots(4, kMost / 16), std::bad_alloc);
}

}  // namespace
}  // namespace qdmd::test
