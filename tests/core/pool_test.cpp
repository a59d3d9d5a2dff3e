// SPDX-License-Identifier: LGPL-2.1-or-later
// The thread pool: every part once, on any number of threads, with the caller among them.
#include "core/parallel/pool.h"

#include <gtest/gtest.h>
#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <numeric>
#include <set>
#include <system_error>
#include <thread>
#include <vector>

namespace qdmd::test {
namespace {

TEST(Pool, DoesEveryPartOnce) {
  for (int threads : {-1, 0, 1, 2, 3, 8}) {
    Pool pool(threads);
    EXPECT_EQ(pool.threads(), static_cast<size_t>(std::max(threads, 1)));
    for (size_t parts : {0, 1, 2, 3, 7, 1000}) {
      std::vector<int> done(parts);
      pool.run(parts, [&](size_t part) { ++done[part]; });
      EXPECT_EQ(done, std::vector<int>(parts, 1)) << threads << " threads";
    }
  }
}

TEST(Pool, WorkersHaveNumbersOfTheirOwn) {
  constexpr size_t kThreads = 4, kParts = 400;
  Pool pool(kThreads);
  // Unguarded: ThreadSanitizer would see two calls with one number that overlap.
  std::vector<std::vector<size_t>> parts_of(kThreads);
  std::vector<std::set<std::thread::id>> ids_of(kThreads);
  pool.run(kParts, [&](size_t part, size_t worker) {
    ASSERT_LT(worker, kThreads);
    parts_of[worker].push_back(part);
    ids_of[worker].insert(std::this_thread::get_id());
  });
  std::vector<size_t> all;
  for (const auto& parts : parts_of) all.insert(all.end(), parts.begin(), parts.end());
  std::sort(all.begin(), all.end());
  std::vector<size_t> expected(kParts);
  std::iota(expected.begin(), expected.end(), size_t{0});
  EXPECT_EQ(all, expected);
  for (size_t worker = 0; worker < kThreads; ++worker)
    EXPECT_LE(ids_of[worker].size(), 1u) << "one thread a worker";
  for (const auto id : ids_of[0]) EXPECT_EQ(id, std::this_thread::get_id());
}

TEST(Pool, ThreadsWorkAtTheSameTime) {
  Pool pool(3);
  // Each part waits for the other two: one thread alone would never end.
  std::atomic<int> begun = 0;
  pool.run(3, [&](size_t) {
    ++begun;
    while (begun < 3) std::this_thread::yield();
  });
  EXPECT_EQ(begun, 3);
}

TEST(Pool, WhatPartsWroteIsSeenByTheCallerAndByTheNextParts) {
  // Unguarded, over many short calls: ThreadSanitizer watches.
  Pool pool(4);
  std::vector<int> values(64);
  for (int round = 0; round < 2000; ++round) {
    pool.run(values.size(), [&](size_t part) { ++values[(part + round) % values.size()]; });
    values[round % values.size()] += 1;
  }
  int sum = 0;
  for (int value : values) sum += value;
  EXPECT_EQ(sum, 2000 * 64 + 2000);
}

TEST(Pool, OneSlowThreadLeavesItsPartsToTheOthers) {
  constexpr size_t kOthers = 49;
  Pool pool(2);
  std::atomic<size_t> others = kOthers;
  std::promise<void> all_others;
  pool.run(kOthers + 1, [&](size_t part) {
    // As slow as all others together: it ends only if other threads do them. A minute is for a
    // pool that hangs.
    if (part == 0)
      EXPECT_EQ(all_others.get_future().wait_for(std::chrono::minutes(1)),
                std::future_status::ready);
    else if (--others == 0)
      all_others.set_value();
  });
  EXPECT_EQ(others, 0U);
}

// What a thread had of a picture is still in its cache.
TEST(Pool, ThreadsBeginWithTheSamePartsInEveryCall) {
  constexpr size_t kThreads = 3, kParts = 7;
  Pool pool(kThreads);
  for (int call = 0; call < 50; ++call) {
    std::atomic<size_t> begun = 0;
    std::vector<size_t> worker_of(kParts, kThreads);
    pool.run(kParts, [&](size_t part, size_t worker) {
      worker_of[part] = worker;
      // Until all have begun: nobody has time to take what is another one's.
      if (++begun > kThreads) return;
      while (begun < kThreads) std::this_thread::yield();
    });
    for (size_t worker = 0; worker < kThreads; ++worker)
      EXPECT_EQ(worker_of[kParts * worker / kThreads], worker) << "call " << call;
  }
}

// Whether they still look for work then, sleep again, or have not woken.
TEST(Pool, RousedThreadsDoTheirParts) {
  Pool pool(3);
  for (int microseconds : {0, 20, 100, 2000})
    for (int call = 0; call < 20; ++call) {
      pool.rouse();
      if (call % 4 == 3) pool.rouse();
      std::this_thread::sleep_for(std::chrono::microseconds(microseconds));
      std::vector<int> done(9);
      pool.run(done.size(), [&](size_t part) { ++done[part]; });
      ASSERT_EQ(done, std::vector<int>(9, 1)) << microseconds;
    }
  // And nothing is left to do for those who are asleep when it ends.
  pool.rouse();
}

TEST(Pool, CanBeMadeAndDestroyedWithoutWork) {
  for (int k = 0; k < 50; ++k) Pool pool(k % 5);
}

TEST(Pool, WithoutMoreThreadsTheCallerDoesAll) {
  // No thread can have a stack larger than the address space.
  pthread_attr_t before, huge;
  ASSERT_EQ(pthread_getattr_default_np(&before), 0);
  ASSERT_EQ(pthread_attr_init(&huge), 0);
  ASSERT_EQ(pthread_attr_setstacksize(&huge, size_t{1} << 50), 0);
  ASSERT_EQ(pthread_setattr_default_np(&huge), 0);
  EXPECT_THROW(std::thread([] {}).join(), std::system_error);
  {
    Pool pool(4);
    EXPECT_EQ(pool.threads(), 1u);
    size_t done = 0;
    pool.run(10, [&](size_t, size_t worker) {
      EXPECT_EQ(worker, 0u);
      ++done;
    });
    EXPECT_EQ(done, 10u);
  }
  EXPECT_EQ(pthread_setattr_default_np(&before), 0);
  pthread_attr_destroy(&huge);
  pthread_attr_destroy(&before);
}

TEST(Pool, ChangesItsSize) {
  Pool pool(2);
  for (int threads : {4, 1, 3, 3, 0, 2}) {
    pool.resize(threads);
    EXPECT_EQ(pool.threads(), static_cast<size_t>(std::max(threads, 1)));
    for (size_t parts : {1, 5, 300}) {
      std::vector<int> done(parts);
      pool.run(parts, [&](size_t part, size_t worker) {
        ASSERT_LT(worker, pool.threads());
        ++done[part];
      });
      EXPECT_EQ(done, std::vector<int>(parts, 1)) << threads << " threads";
    }
  }
}

}  // namespace
}  // namespace qdmd::test
