// SPDX-License-Identifier: LGPL-2.1-or-later
// One piece of work beside its caller: order, exceptions, and how it ends.
#include "core/parallel/side_thread.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "core/parallel/workers.h"

namespace qdmd::test {
namespace {

using namespace std::chrono_literals;

TEST(SideThread, WorkRunsBesideItsCaller) {
  SideThread side(true);
  std::promise<void> go;
  std::thread::id worker;
  side.start([&, wait = go.get_future().share()] {
    wait.wait();
    worker = std::this_thread::get_id();
  });
  // It cannot be over before the caller says so: start() has not waited for it.
  EXPECT_FALSE(side.idle());
  go.set_value();
  side.finish();
  EXPECT_TRUE(side.idle());
  EXPECT_NE(worker, std::this_thread::get_id());
  EXPECT_NE(worker, std::thread::id());
}

TEST(SideThread, WaitsNoLongerThanItIsTold) {
  const auto now = [] { return std::chrono::steady_clock::now(); };
  SideThread side(true);
  std::promise<void> go;
  side.start([wait = go.get_future().share()] { wait.wait(); });
  const auto then = now() + 5ms;
  side.wait_until(then);
  EXPECT_GE(now(), then);
  EXPECT_FALSE(side.idle());
  side.wait_until(now() - 1s);
  go.set_value();
  // Long before the hour is over.
  side.wait_until(now() + 1h);
  EXPECT_TRUE(side.idle());
  side.wait_until(now() + 1h);
  side.finish();
}

TEST(SideThread, InactiveDoesTheWorkAtOnce) {
  SideThread side(false);
  bool done = false;
  side.start([&] {
    std::this_thread::sleep_for(1ms);
    done = true;
  });
  EXPECT_TRUE(done);
  EXPECT_TRUE(side.idle());
  side.finish();
}

TEST(SideThread, FinishWithoutWorkReturns) {
  for (bool active : {false, true}) {
    SideThread side(active);
    EXPECT_TRUE(side.idle());
    side.finish();
    side.finish();
    side.start([] {});
    side.finish();
    side.finish();
    EXPECT_TRUE(side.idle());
  }
}

TEST(SideThread, ThousandsOfStartsRunInOrder) {
  for (bool active : {false, true}) {
    SideThread side(active);
    // Unguarded: ThreadSanitizer would see a finish() that does not wait.
    std::vector<int> seen;
    for (int k = 0; k < 5000; ++k) {
      side.start([&seen, k] { seen.push_back(k); });
      if (k % 3 == 0) side.idle();
      side.finish();
      ASSERT_EQ(seen.size(), static_cast<size_t>(k + 1));
      ASSERT_EQ(seen.back(), k);
    }
  }
}

TEST(SideThread, OneThreadForAllWork) {
  SideThread side(true);
  std::vector<std::thread::id> ids(100);
  for (auto& id : ids) {
    side.start([&id] { id = std::this_thread::get_id(); });
    side.finish();
  }
  for (const auto& id : ids) EXPECT_EQ(id, ids[0]);
}

TEST(SideThread, ExceptionsComeOutOfFinishOnce) {
  for (bool active : {false, true}) {
    SideThread side(active);
    for (int k = 0; k < 100; ++k) {
      EXPECT_NO_THROW(
          side.start([k] { throw std::runtime_error("no memory " + std::to_string(k)); }));
      try {
        side.finish();
        ADD_FAILURE() << "nothing was thrown";
      } catch (const std::runtime_error& error) {
        EXPECT_EQ(error.what(), "no memory " + std::to_string(k));
      }
      EXPECT_TRUE(side.idle());
      EXPECT_NO_THROW(side.finish());
      bool done = false;
      side.start([&] { done = true; });
      EXPECT_NO_THROW(side.finish());
      EXPECT_TRUE(done) << "work goes on after an exception";
    }
  }
}

TEST(SideThread, AnythingCanBeThrown) {
  SideThread side(true);
  side.start([] { throw 7; });
  EXPECT_THROW(side.finish(), int);
}

TEST(SideThread, DestructionWaitsForWhatRuns) {
  for (int k = 0; k < 20; ++k) {
    std::atomic<bool> begun = false, done = false;
    {
      SideThread side(true);
      side.start([&] {
        begun = true;
        std::this_thread::sleep_for(2ms);
        done = true;
      });
      // Half of them before the thread has woken.
      while (k % 2 == 0 && !begun) std::this_thread::yield();
    }
    EXPECT_TRUE(done);
  }
}

TEST(SideThread, DestructionSwallowsAnException) {
  for (bool active : {false, true}) {
    SideThread side(active);
    side.start([] { throw std::runtime_error("lost"); });
  }
}

TEST(SideThread, CanBeMadeAndDestroyedWithoutWork) {
  for (int k = 0; k < 200; ++k) SideThread side(k % 2 == 0);
}

TEST(SideThread, KeepsNothingOfWorkThatIsOver) {
  // A window that work has captured must not live on inside.
  const auto captured = std::make_shared<int>(7);
  SideThread side(true);
  side.start([captured] { EXPECT_EQ(*captured, 7); });
  side.finish();
  side.start([] {});
  side.finish();
  EXPECT_EQ(captured.use_count(), 1);
}

TEST(SideThread, IsSwitchedOnAndOff) {
  SideThread side(false);
  for (bool active : {true, true, false, false, true}) {
    side.set_active(active);
    std::thread::id worker;
    side.start([&] { worker = std::this_thread::get_id(); });
    side.finish();
    EXPECT_EQ(active, worker != std::this_thread::get_id());
  }
}

// Whatever the number of cores is.
TEST(SideThread, IsOneOfItsOwnUnlessThereIsToBeOneThread) {
  for (int threads : {0, 1, 2}) {
    Workers workers(threads);
    const auto expect_beside = [&](bool beside) {
      std::thread::id id;
      workers.start([&id] { id = std::this_thread::get_id(); });
      workers.finish();
      EXPECT_EQ(id != std::this_thread::get_id(), beside) << threads;
    };
    expect_beside(threads != 1);
    workers.ask_for(1);
    workers.follow();
    expect_beside(false);
    workers.ask_for(0);
    workers.follow();
    expect_beside(true);
  }
}

}  // namespace
}  // namespace qdmd::test
