// SPDX-License-Identifier: LGPL-2.1-or-later
// Work beside the caller, the pool that it uses, and the caller that helps where it waits.
#include "core/parallel/workers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace qdmd::test {
namespace {

using namespace std::chrono_literals;

std::thread::id here() { return std::this_thread::get_id(); }

// Waits for something that comes: a minute is for work that hangs.
void wait_for(const std::atomic<bool>& flag) {
  const auto end = std::chrono::steady_clock::now() + 1min;
  while (!flag && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  ASSERT_TRUE(flag);
}

TEST(Workers, NobodyElseHasThePoolWhileWorkGoesOnBeside) {
  Workers workers(2);
  EXPECT_EQ(workers.idle_pool(), &workers.pool());
  std::promise<void> go;
  workers.start([wait = go.get_future().share()] { wait.wait(); });
  EXPECT_EQ(workers.idle_pool(), nullptr);
  go.set_value();
  workers.finish();
  EXPECT_EQ(workers.idle_pool(), &workers.pool());
}

// With the caller there are as many threads as were asked for: one beside it has no other helper.
TEST(Workers, WorkBesideACallerThatIsBusyHasAThreadLess) {
  Workers workers(2);
  std::set<std::thread::id> seen;
  std::mutex mutex;
  std::atomic<bool> done = false;
  workers.start([&] {
    for (int round = 0; round < 50; ++round)
      workers.pool().run(20, [&](size_t) {
        const std::lock_guard lock(mutex);
        seen.insert(here());
      });
    done = true;
  });
  wait_for(done);
  workers.finish();
  EXPECT_EQ(seen.size(), 1u);
  EXPECT_FALSE(seen.contains(here()));
  // Once it is over, the caller has the other thread again.
  std::atomic<int> begun = 0;
  workers.pool().run(2, [&](size_t) {
    ++begun;
    while (begun < 2) std::this_thread::yield();
  });
}

TEST(Workers, ACallerThatWaitsHelps) {
  for (int threads : {2, 3}) {
    Workers workers(threads);
    std::atomic<bool> helped = false;
    std::vector<int> done(2000);
    // Unguarded: ThreadSanitizer would see two calls with one number that overlap.
    std::vector<int> of_worker(static_cast<size_t>(threads));
    const auto caller = here();
    workers.start([&] {
      // Until the caller has come.
      for (int round = 0; !helped && round < 100000; ++round)
        workers.pool().run(4, [&](size_t, size_t) {
          if (here() == caller) helped = true;
          std::this_thread::yield();
        });
      workers.pool().run(done.size(), [&](size_t part, size_t worker) {
        ++done[part];
        ++of_worker[worker];
      });
    });
    workers.finish();
    EXPECT_TRUE(helped);
    EXPECT_EQ(done, std::vector<int>(done.size(), 1));
    int sum = 0;
    for (const int parts : of_worker) sum += parts;
    EXPECT_EQ(sum, static_cast<int>(done.size()));
  }
}

TEST(Workers, WhatWorkBesideWroteIsSeenByItsCaller) {
  // Unguarded, over many short pieces: ThreadSanitizer watches.
  Workers workers(3);
  std::vector<int> values(64);
  for (int round = 0; round < 500; ++round) {
    workers.start([&] {
      for (int run = 0; run < 3; ++run)
        workers.pool().run(values.size(), [&](size_t part) { ++values[part]; });
    });
    if (round % 3 == 0) std::this_thread::yield();
    workers.finish();
    workers.pool().run(values.size(), [&](size_t part) { ++values[part]; });
    ++values[0];
  }
  EXPECT_EQ(values[0], 500 * 5);
  EXPECT_EQ(std::count(values.begin() + 1, values.end(), 500 * 4), 63);
}

TEST(Workers, ExceptionsOfWorkBesideLeaveThePoolUsable) {
  Workers workers(2);
  for (int k = 0; k < 50; ++k) {
    workers.start([&] {
      workers.pool().run(3, [](size_t) {});
      throw std::runtime_error("no memory");
    });
    if (k % 2 == 0)
      EXPECT_THROW(workers.finish(), std::runtime_error);
    else
      workers.abandon();
    ASSERT_NE(workers.idle_pool(), nullptr);
    int done = 0;
    workers.pool().run(1, [&](size_t) { ++done; });
    EXPECT_EQ(done, 1);
  }
}

TEST(Workers, HelpEndsWithTheShareThatWasAskedFor) {
  Workers workers(2);
  std::promise<void> go;
  const auto begun = std::chrono::steady_clock::now();
  workers.start([wait = go.get_future().share()] { wait.wait(); });
  // Nothing to help with: its own time counts alone.
  workers.help_until_done(20ms);
  EXPECT_GE(std::chrono::steady_clock::now() - begun, 19ms);
  EXPECT_FALSE(workers.idle());
  EXPECT_GE(workers.done(), 19ms);
  // What is done is done.
  workers.help_until_done(1ms);
  EXPECT_FALSE(workers.idle());
  go.set_value();
  // Long before the hour is over.
  workers.help_until_done(1h);
  workers.finish();
  const auto done = workers.done();
  std::this_thread::sleep_for(2ms);
  EXPECT_EQ(workers.done(), done);
}

TEST(Workers, TimeThatTheCallerHelpedCounts) {
  Workers workers(2);
  const auto begun = std::chrono::steady_clock::now();
  std::atomic<int> parts = 0;
  workers.start([&] {
    workers.pool().run(40, [&](size_t) {
      ++parts;
      std::this_thread::sleep_for(1ms);
    });
  });
  workers.finish();
  const auto took = std::chrono::steady_clock::now() - begun;
  EXPECT_EQ(parts, 40);
  // All parts slept a millisecond, in one thread or the other.
  EXPECT_GE(workers.done(), 40ms);
  EXPECT_LE(workers.done(), 2 * took);
}

TEST(Workers, OneThreadDoesAllAtOnce) {
  Workers workers(1);
  std::thread::id id;
  EXPECT_TRUE(workers.start([&] { workers.pool().run(3, [&](size_t) { id = here(); }); }));
  EXPECT_EQ(id, here());
  EXPECT_TRUE(workers.idle());
  workers.help_until_done(1h);
  workers.finish();
}

}  // namespace
}  // namespace qdmd::test
