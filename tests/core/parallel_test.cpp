// Inner products by several threads: the same bits, and which thread does what.
#include "core/gram/parallel.h"

#include <pthread.h>

#include <mutex>
#include <set>
#include <thread>

#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

// ---- Which thread does what ----

struct Call {
  std::thread::id thread;
  const uint8_t* start;
  size_t rows, length;
};

std::mutex calls_mutex;
std::vector<Call> calls;

// The fastest kernel, with a record of its calls.
constexpr Kernel kRecorder = {
    "recorder", [](const uint8_t* const* rows, size_t row_count, const uint8_t* const* cols,
                   size_t col_count, size_t length, int64_t* out) noexcept {
      dot_products(rows, row_count, cols, col_count, length, out);
      const std::lock_guard lock(calls_mutex);
      calls.push_back({std::this_thread::get_id(), cols[0], row_count, length});
    }};

// Planes of random samples whose products two ways can be compared.
class ParallelDotProducts : public testing::Test {
 protected:
  void set_planes(size_t count, size_t length) {
    length_ = length;
    samples_.resize(count * length);
    for (auto& sample : samples_) sample = static_cast<uint8_t>(rng_());
    planes_.clear();
    for (size_t k = 0; k < count; ++k) planes_.push_back(samples_.data() + k * length);
  }

  std::vector<int64_t> products(const Kernel& kernel, int threads) {
    const size_t count = planes_.size();
    std::vector<int64_t> out(count * count, -1);
    calls.clear();
    parallel_dot_products(kernel, threads, planes_.data(), count, planes_.data(), count, length_,
                          out.data());
    return out;
  }

  // The calls of kRecorder, in the order of their pixels.
  std::vector<Call> recorded(int threads) {
    const auto expected = products(kernels().front(), 1);
    EXPECT_EQ(products(kRecorder, threads), expected) << threads << " threads";
    std::sort(calls.begin(), calls.end(),
              [](const Call& a, const Call& b) { return a.start < b.start; });
    return calls;
  }

  static size_t threads_in(const std::vector<Call>& recorded_calls) {
    std::set<std::thread::id> ids;
    for (const Call& call : recorded_calls) ids.insert(call.thread);
    return ids.size();
  }

  std::mt19937 rng_{81};
  size_t length_ = 0;
  std::vector<uint8_t> samples_;
  std::vector<const uint8_t*> planes_;
};

TEST_F(ParallelDotProducts, PartsCoverThePixelsOnceAndStartAtCacheLines) {
  for (size_t length : {size_t{100'000}, size_t{100'003}, size_t{99'968}})
    for (int threads : {1, 2, 3, 4}) {
      set_planes(12, length);
      const auto parts = recorded(threads);
      ASSERT_EQ(parts.size(), static_cast<size_t>(threads));
      EXPECT_EQ(threads_in(parts), parts.size());
      const uint8_t* next = planes_[0];
      for (const Call& part : parts) {
        EXPECT_EQ(part.start, next);
        EXPECT_EQ((part.start - planes_[0]) % 64, 0);
        next += part.length;
      }
      EXPECT_EQ(next, planes_[0] + length);
      // The caller does one part itself.
      EXPECT_TRUE(std::any_of(parts.begin(), parts.end(), [](const Call& part) {
        return part.thread == std::this_thread::get_id();
      }));
    }
}

TEST_F(ParallelDotProducts, SmallWorkStaysInTheCallersThread) {
  for (size_t length : {1, 63, 64, 65, 1000, 19'000}) {
    set_planes(10, length);  // less than two million products
    const auto parts = recorded(8);
    ASSERT_EQ(parts.size(), 1u) << length;
    EXPECT_EQ(parts[0].thread, std::this_thread::get_id());
  }
  // Many planes of few pixels: nothing to split.
  set_planes(700, 65);
  EXPECT_EQ(threads_in(recorded(8)), 1u);
}

TEST_F(ParallelDotProducts, ManyRowsAreDoneInTurns) {
  // The sums of 700 x 700 pairs exceed what a thread holds at a time.
  set_planes(700, 200);
  const auto parts = recorded(3);
  EXPECT_GT(parts.size(), 3u);
  size_t pixel_rows = 0;
  for (const Call& part : parts) {
    EXPECT_LT(part.rows, 700u);
    pixel_rows += part.rows * part.length;
  }
  EXPECT_EQ(pixel_rows, 700u * 200u);
}

TEST_F(ParallelDotProducts, WithoutMoreThreadsTheCallerDoesAll) {
  // No thread can have a stack larger than the address space.
  pthread_attr_t before, huge;
  ASSERT_EQ(pthread_getattr_default_np(&before), 0);
  ASSERT_EQ(pthread_attr_init(&huge), 0);
  ASSERT_EQ(pthread_attr_setstacksize(&huge, size_t{1} << 50), 0);
  ASSERT_EQ(pthread_setattr_default_np(&huge), 0);
  EXPECT_THROW(std::thread([] {}).join(), std::system_error);
  set_planes(12, 100'000);
  const auto parts = recorded(4);
  EXPECT_EQ(pthread_setattr_default_np(&before), 0);
  pthread_attr_destroy(&huge);
  pthread_attr_destroy(&before);
  EXPECT_EQ(parts.size(), 4u);
  EXPECT_EQ(threads_in(parts), 1u);
}

// ---- The Gram matrix ----

TEST(SlidingGramThreads, AnyNumberGivesTheSameBitsOverSlides) {
  // Sizes without padding and with 63, 62, 1 bytes of it; from 40000 pixels on, threads start.
  for (size_t pixels : {1u, 63u, 64u, 65u, 8'193u, 40'000u, 76'800u, 100'001u})
    for (int group : {1, 3}) {
      std::mt19937 rng(82);
      constexpr int kCapacity = 6, kMostThreads = 3;
      Window window(kCapacity, pixels);
      std::vector<SlidingGram> grams;
      for (const Kernel& kernel : kernels())
        for (int threads = 1; threads <= kMostThreads; ++threads)
          grams.emplace_back(kCapacity, threads, kernel);
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

}  // namespace
}  // namespace qdmd::test
