// SPDX-License-Identifier: LGPL-2.1-or-later
// What was spent where: spans inside spans, and on other threads.
#include "core/base/clock.h"

#include <gtest/gtest.h>

#include <thread>

namespace qdmd::test {
namespace {

// Takes a while, by the clock that spans read.
void work() {
  const auto start = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - start < std::chrono::microseconds(200)) {
  }
}
constexpr double kWork = 200e-6;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

TEST(Clock, BeginsWithNothing) {
  const Clock clock;
  EXPECT_EQ(clock.spent().all(), 0);
  EXPECT_EQ(clock.spent().of(Clock::waiting), 0);
}

// What a span inside takes is not charged twice: all kinds add up to the time that passed.
TEST(Clock, ASpanInsideIsChargedToItsOwnWork) {
  Clock clock;
  const auto start = std::chrono::steady_clock::now();
  {
    const Clock::Span outer(clock, Clock::frames);
    work();
    {
      const Clock::Span inner(clock, Clock::solving);
      work();
      {
        const Clock::Span innermost(clock, Clock::samples);
        work();
      }
      work();
    }
    work();
  }
  const double passed = seconds_since(start);
  const Clock::Spent spent = clock.spent();
  EXPECT_GE(spent.of(Clock::frames), 2 * kWork);
  EXPECT_GE(spent.of(Clock::solving), 2 * kWork);
  EXPECT_GE(spent.of(Clock::samples), kWork);
  EXPECT_EQ(spent.of(Clock::products), 0);
  EXPECT_LE(spent.all(), passed);
  EXPECT_DOUBLE_EQ(spent.of_solves(), spent.of(Clock::solving) + spent.of(Clock::samples));
}

TEST(Clock, WaitingIsNoWork) {
  Clock clock;
  {
    const Clock::Span span(clock, Clock::waiting);
    work();
  }
  EXPECT_GE(clock.spent().of(Clock::waiting), kWork);
  EXPECT_EQ(clock.spent().all(), 0);
}

TEST(Clock, ThreadsChargeTheirOwn) {
  Clock clock;
  const Clock::Span here(clock, Clock::waiting);
  std::thread([&clock] {
    const Clock::Span there(clock, Clock::products);
    work();
  }).join();
  EXPECT_GE(clock.spent().of(Clock::products), kWork);
  // The span here goes on: nothing of it is charged yet.
  EXPECT_EQ(clock.spent().of(Clock::waiting), 0);
}

TEST(Clock, DifferencesAndWhatOthersTimed) {
  Clock clock;
  clock.charge(Clock::pictures, 1.5);
  const Clock::Spent before = clock.spent();
  clock.charge(Clock::pictures, 2);
  clock.charge(Clock::frames, 4);
  const Clock::Spent since = clock.spent().since(before);
  EXPECT_DOUBLE_EQ(since.of(Clock::pictures), 2);
  EXPECT_DOUBLE_EQ(since.of(Clock::frames), 4);
  EXPECT_DOUBLE_EQ(since.all(), 6);
  EXPECT_DOUBLE_EQ(clock.spent().of(Clock::pictures), 3.5);
}

}  // namespace
}  // namespace qdmd::test
