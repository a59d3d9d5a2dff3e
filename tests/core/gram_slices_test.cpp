// SPDX-License-Identifier: LGPL-2.1-or-later
// The Gram matrix by any number of threads and in slices of pixels: the same bits.
#include <mutex>
#include <optional>
#include <thread>

#include "core/gram/gram.h"
#include "core/parallel/pool.h"
#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

Window random_window(int frames, size_t pixels, std::mt19937& rng) {
  Window window(frames, pixels);
  for (int t = 0; t < frames; ++t) append_frame(window, random_picture(pixels, rng));
  return window;
}

// ---- Threads ----

TEST(SlidingGramThreads, AnyNumberGivesTheSameBitsOverSlides) {
  // Sizes without padding and with 63, 62, 1 bytes of it; the largest have several parts.
  for (size_t pixels : {1u, 63u, 64u, 65u, 8'193u, 40'000u, 76'800u, 100'001u})
    for (int group : {1, 3}) {
      std::mt19937 rng(82);
      constexpr int kCapacity = 6, kMostThreads = 3;
      Window window(kCapacity, pixels);
      std::vector<std::unique_ptr<Pool>> pools;
      for (int threads = 1; threads <= kMostThreads; ++threads)
        pools.push_back(std::make_unique<Pool>(threads));
      std::vector<SlidingGram> grams;
      for (const Kernel& kernel : kernels())
        for (const auto& pool : pools) grams.emplace_back(kCapacity, pool.get(), kernel);
      for (int frame = 1; frame <= 2 * kCapacity + group; ++frame) {
        append_frame(window, random_picture(pixels, rng));
        if (frame % group > 0) continue;
        for (auto& gram : grams) gram.add_newest(window, group);
        const auto expected = grams[0].matrix(window);
        for (size_t k = 1; k < grams.size(); ++k)
          ASSERT_EQ(grams[k].matrix(window), expected)
              << kernels()[k / kMostThreads].name << ", " << k % kMostThreads + 1 << " threads, "
              << pixels << " pixels, " << group << " at a time, frame " << frame;
      }
      EXPECT_EQ(grams[0].matrix(window), gram_of(window)) << pixels << " pixels";
    }
}

struct Call {
  std::thread::id thread;
  size_t first, length;
};

std::mutex calls_mutex;
std::vector<Call> calls;

// The fastest kernel, with a record of its calls.
constexpr Kernel kRecorder = {
    "recorder", [](const uint8_t* const* rows, size_t row_count, const uint8_t* const* cols,
                   size_t col_count, size_t first, size_t length, int64_t* out) noexcept {
      kernels().front().add_dot_products(rows, row_count, cols, col_count, first, length, out);
      const std::lock_guard lock(calls_mutex);
      calls.push_back({std::this_thread::get_id(), first, length});
    }};

std::vector<Call> recorded(const Window& window, int threads, size_t first, size_t length) {
  Pool pool(threads);
  SlidingGram gram(window.capacity(), &pool, kRecorder);
  calls.clear();
  gram.add_slice(window, window.size(), first, length);
  std::sort(calls.begin(), calls.end(),
            [](const Call& a, const Call& b) { return a.first < b.first; });
  return calls;
}

TEST(SlidingGramThreads, PartsCoverThePixelsOnceAndStartAtCacheLines) {
  std::mt19937 rng(83);
  const Window window = random_window(5, 200'000, rng);
  for (size_t first : {0, 1, 63, 64, 99})
    for (size_t length : {100'000, 100'003, 99'968})
      for (int threads : {1, 2, 3, 4}) {
        const auto parts = recorded(window, threads, first, length);
        ASSERT_GE(parts.size(), static_cast<size_t>(threads));
        size_t next = first;
        for (const Call& part : parts) {
          EXPECT_EQ(part.first, next);
          EXPECT_TRUE(next == first || part.first % 64 == 0);
          next += part.length;
        }
        EXPECT_EQ(next, first + length);
      }
}

TEST(SlidingGramThreads, SmallWorkStaysInTheCallersThread) {
  std::mt19937 rng(84);
  const Window window = random_window(3, 40'000, rng);
  for (size_t length : {1, 63, 64, 65, 1000, 40'000}) {  // less than four million products
    const auto parts = recorded(window, 8, 0, length);
    ASSERT_EQ(parts.size(), 1u) << length;
    EXPECT_EQ(parts[0].thread, std::this_thread::get_id());
  }
}

// ---- Many snapshots at once ----

TEST(SlidingGram, MoreSnapshotsAtOnceThanRowsOfAProduct) {
  std::mt19937 rng(85);
  constexpr int kFrames = 50;
  const Window window = random_window(kFrames, 777, rng);
  const auto expected = gram_of(window);
  for (int count : {15, 16, 17, 31, 33, 50}) {
    SlidingGram gram(kFrames);
    // All but the newest `count`, which then come at once.
    if (count < kFrames)
      gram.add_slice({window, 0, kFrames - count}, kFrames - count, 0, window.plane_size());
    gram.add_newest(window, count);
    EXPECT_EQ(gram.matrix(window), expected) << count << " at once";
  }
}

// ---- Slices ----

TEST(SlidingGramSlices, OfAnySizeGiveTheBitsOfOneCall) {
  std::mt19937 rng(86);
  constexpr int kFrames = 9;
  constexpr size_t kPixels = 9'001;
  const Window window = random_window(kFrames, kPixels, rng);
  const auto expected = gram_of(window);
  Pool pool(2);
  for (const Kernel& kernel : kernels())
    for (size_t size : {1u, 3u, 63u, 64u, 65u, 255u, 4095u, 4097u, 9'000u, 9'001u}) {
      if (size < 63 && std::string(kernel.name) == "reference") continue;
      SlidingGram gram(kFrames, &pool, kernel);
      for (int twice = 0; twice < 2; ++twice) {  // The first slice forgets what was there.
        for (size_t first = 0; first < kPixels; first += size)
          gram.add_slice(window, kFrames, first, std::min(size, kPixels - first));
        ASSERT_EQ(gram.matrix(window), expected) << kernel.name << ", slices of " << size;
      }
    }
}

TEST(SlidingGramSlices, ComeInAnyOrderAfterTheFirst) {
  std::mt19937 rng(87);
  constexpr int kFrames = 4;
  const Window window = random_window(kFrames, 1000, rng);
  SlidingGram gram(kFrames);
  gram.add_slice(window, kFrames, 0, 101);
  gram.add_slice(window, kFrames, 700, window.plane_size() - 700);
  gram.add_slice(window, kFrames, 333, 367);
  gram.add_slice(window, kFrames, 101, 232);
  EXPECT_EQ(gram.matrix(window), gram_of(window));
}

// As live mode does it: a group's work is spread over the frames that follow it.
TEST(SlidingGramSlices, OfAGroupWhileTheWindowSlides) {
  std::mt19937 rng(88);
  constexpr int kSpan = 5, kGroup = 3;
  constexpr size_t kPixels = 500, kSlice = 171;  // three slices
  // Room for those that arrive before a group is complete.
  Window window(kSpan + kGroup - 1, kPixels);
  SlidingGram gram(window.capacity());
  std::optional<SnapshotRange> span;
  for (int frame = 1; frame <= 40; ++frame) {
    append_frame(window, random_picture(kPixels, rng));
    if (frame % kGroup == 0) span = SnapshotRange(window).newest(std::min(window.size(), kSpan));
    if (!span) continue;
    const size_t first = kSlice * static_cast<size_t>(frame % kGroup);
    gram.add_slice(*span, kGroup, first, std::min(kSlice, window.plane_size() - first));
    if (frame % kGroup < kGroup - 1) continue;
    // The group is complete; the newest two frames are in none yet.
    const Eigen::Index known = kChannels * (window.size() - 2), size = kChannels * span->size();
    EXPECT_EQ(gram.matrix(*span), gram_of(window).block(known - size, known - size, size, size))
        << frame;
  }
}

TEST(SlidingGramSlices, OfSeveralThreadsAndLargePictures) {
  std::mt19937 rng(89);
  constexpr int kFrames = 20;
  constexpr size_t kPixels = 150'001;
  const Window window = random_window(kFrames, kPixels, rng);
  Pool pool(3);
  SlidingGram whole(kFrames), sliced(kFrames, &pool);
  whole.add_newest(window, kFrames);
  for (size_t first = 0; first < kPixels; first += 49'999)
    sliced.add_slice(window, kFrames, first, std::min<size_t>(49'999, kPixels - first));
  EXPECT_EQ(sliced.matrix(window), whole.matrix(window));
}

TEST(SlidingGramSlices, OfAPoolThatGrowsAndShrinks) {
  std::mt19937 rng(97);
  constexpr int kFrames = 20;
  const Window window = random_window(kFrames, 150'001, rng);
  Pool pool(1);
  SlidingGram whole(kFrames), gram(kFrames, &pool);
  whole.add_newest(window, kFrames);
  for (int threads : {1, 2, 8, 3, 12, 1}) {
    pool.resize(threads);
    gram.add_newest(window, kFrames);
    EXPECT_EQ(gram.matrix(window), whole.matrix(window)) << threads;
  }
}

}  // namespace
}  // namespace qdmd::test
