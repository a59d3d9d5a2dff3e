// SPDX-License-Identifier: LGPL-2.1-or-later
// Memory in large pages: where it begins, what is in it, and that the system is asked for them.
#include "core/base/large_vector.h"

#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <limits>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/parallel/pool.h"
#include "core/planes/snapshot_range.h"

namespace qdmd::test {
namespace {

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

bool wants_large_pages(const void* at) { return flags_of(at).find(" hg ") != std::string::npos; }

// Where the system gives large pages to those who ask, and tells; a system that is not there but
// pretended may do neither.
bool has_large_pages_for_those_who_ask() {
  std::string said;
  std::ifstream enabled("/sys/kernel/mm/transparent_hugepage/enabled");
  std::getline(enabled, said);
  if (said.find("[madvise]") == std::string::npos) return false;
  size_t size = 0;
  std::ifstream("/sys/kernel/mm/transparent_hugepage/hpage_pmd_size") >> size;
  void* const probe =
      mmap(nullptr, 2 * kLargePage, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (size != kLargePage || probe == MAP_FAILED) return false;
  const bool before = wants_large_pages(probe);
  madvise(probe, 2 * kLargePage, MADV_HUGEPAGE);
  const bool after = wants_large_pages(probe);
  munmap(probe, 2 * kLargePage);
  // The C library may ask for all that it has.
  const auto plain = std::make_unique_for_overwrite<uint8_t[]>(5 * kLargePage);
  return after && !before && !wants_large_pages(plain.get() + 2 * kLargePage);
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
  if (!has_large_pages_for_those_who_ask()) GTEST_SKIP() << "no large pages for those who ask";
  const LargeVector<uint8_t> two_and_a_half(5 * kLargePage / 2, 1);
  for (const size_t at : {size_t{0}, kLargePage, 2 * kLargePage - 1})
    EXPECT_TRUE(wants_large_pages(two_and_a_half.data() + at)) << at;
  EXPECT_FALSE(wants_large_pages(two_and_a_half.data() + 2 * kLargePage));
  const LargeVector<uint8_t> small(kLargePage - 1, 1);
  EXPECT_FALSE(wants_large_pages(small.data() + kLargePage / 2));
}

// What the C library keeps for others is as it was.
TEST(LargeVector, LeavesNoWishBehind) {
  if (!has_large_pages_for_those_who_ask()) GTEST_SKIP() << "no large pages for those who ask";
  // From its second round on, the library takes such memory from what it keeps.
  for (int round = 0; round < 3; ++round) {
    const LargeVector<uint8_t> large(4 * kLargePage, 1);
    EXPECT_TRUE(wants_large_pages(large.data()));
  }
  // All of it: they stay until the last one is looked at.
  std::vector<std::unique_ptr<uint8_t[]>> plain;
  for (int i = 0; i < 20; ++i) {
    plain.push_back(std::make_unique_for_overwrite<uint8_t[]>(kLargePage / 3));
    EXPECT_FALSE(wants_large_pages(plain.back().get() + kLargePage / 6)) << i;
  }
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

// Pages of the memory that are there; nothing where the system does not tell.
size_t pages_there(const uint8_t* data, size_t bytes) {
  const auto page = static_cast<size_t>(sysconf(_SC_PAGESIZE));
  std::vector<unsigned char> there((bytes + page - 1) / page);
  auto* const first = const_cast<uint8_t*>(data);
  if (mincore(first, bytes, there.data()) != 0) return 0;
  return static_cast<size_t>(std::count_if(there.begin(), there.end(),
                                           [](unsigned char flags) { return (flags & 1) != 0; }));
}

// The system may know no such thing; then nothing happens.
bool takes_pages() {
  LargeVector<uint8_t> bytes(3 * kLargePage);
  take_pages(bytes.data(), 2 * kLargePage);
  return pages_there(bytes.data(), 2 * kLargePage) * static_cast<size_t>(sysconf(_SC_PAGESIZE)) ==
         2 * kLargePage;
}

TEST(TakePages, LeavesWhatIsWritten) {
  LargeVector<uint8_t> bytes(3 * kLargePage, 7);
  // Whole pages or not, of any address.
  take_pages(bytes.data(), bytes.size());
  take_pages(bytes.data() + 5, kLargePage);
  take_pages(bytes.data() + 4095, 1);
  take_pages(bytes.data(), 0);
  EXPECT_TRUE(std::all_of(bytes.begin(), bytes.end(), [](uint8_t byte) { return byte == 7; }));
}

// A short stream in a long window takes what it fills, and a few large pages more.
TEST(TakePages, TakesSlotsAsTheyCome) {
  // The C library writes to all that it gives while tests run.
  ASSERT_EQ(mallopt(M_PERTURB, 0), 1);
  if (!takes_pages()) GTEST_SKIP() << "the system takes no pages before they are written";
  constexpr size_t kPixels = 500000;  // three planes are no whole number of large pages
  constexpr int kSlots = 40;
  const auto page = static_cast<size_t>(sysconf(_SC_PAGESIZE));
  for (int threads : {1, 2, 3, 8}) {
    Pool pool(threads);
    PlaneSlots slots(kSlots, kPixels);
    const uint8_t* const begin = slots.plane(0, 0);
    for (int slot = 0; slot < kSlots; ++slot) {
      slots.take_pages(slot, &pool);
      slots.take_pages(slot, nullptr);
      const size_t filled = static_cast<size_t>(slots.plane(slot, 2) - begin) + kPixels;
      EXPECT_EQ(pages_there(begin, filled), (filled + page - 1) / page) << slot;
      EXPECT_LE(pages_there(begin, slots.bytes()) * page, filled + 4 * kLargePage) << slot;
      std::fill_n(slots.plane(slot, 0), kPixels, static_cast<uint8_t>(slot));
      std::fill_n(slots.plane(slot, 2), kPixels, static_cast<uint8_t>(slot));
    }
    for (int slot = 0; slot < kSlots; ++slot) {
      slots.take_pages(slot, &pool);
      EXPECT_EQ(slots.plane(slot, 0)[kPixels - 1], slot);
      EXPECT_EQ(slots.plane(slot, 2)[0], slot);
    }
  }
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
