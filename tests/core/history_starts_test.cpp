// SPDX-License-Identifier: LGPL-2.1-or-later
// From which looks on cells count, beside the slow way of finding that.
#include "core/learn/robust/history_starts.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

namespace qdmd::test {
namespace {

std::vector<int64_t> every(int64_t first, int64_t step, int count) {
  std::vector<int64_t> numbers(static_cast<size_t>(count));
  for (size_t i = 0; i < numbers.size(); ++i) numbers[i] = first + step * static_cast<int64_t>(i);
  return numbers;
}

TEST(HistoryStarts, LeavesOutTheLooksFromBefore) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 200; ++trial) {
    const size_t cells = 1 + random() % 40;
    // Frames by number, with gaps.
    std::vector<int64_t> numbers(1 + random() % 30);
    int64_t number = static_cast<int64_t>(random() % 100);
    for (int64_t& at : numbers) at = number += 1 + static_cast<int64_t>(random() % 5);
    HistoryStarts starts(cells);
    std::vector<int64_t> since(cells, HistoryStarts::kNever);
    for (size_t i = random() % 60; i > 0; --i) {
      const size_t cell = random() % cells;
      // From before all of them to after all.
      since[cell] = static_cast<int64_t>(random() % 300);
      starts.add(static_cast<int>(cell), since[cell]);
    }
    FirstLooks looks(cells);
    for (uint16_t& from : looks.from) from = static_cast<uint16_t>(random() % numbers.size());
    const FirstLooks before = looks;
    starts.leave_out(numbers, &looks);
    for (size_t cell = 0; cell < cells; ++cell) {
      size_t from = 0;
      while (from < numbers.size() && numbers[from] < since[cell]) ++from;
      // One look is left in any case: the newest.
      from = std::max<size_t>(before.from[cell], std::min(from, numbers.size() - 1));
      ASSERT_EQ(looks.from[cell], from) << "trial " << trial << ", cell " << cell;
      const bool added = since[cell] != HistoryStarts::kNever;
      ASSERT_EQ(looks.earlier_counts[cell], added ? 0 : 1);
      ASSERT_EQ(starts.has(static_cast<int>(cell)), added);
      ASSERT_EQ(starts.since(static_cast<int>(cell)), since[cell]);
    }
  }
}

// What earlier windows showed counts again in the solve after the next: it has the look by then.
TEST(HistoryStarts, IsFreshForOneSolve) {
  HistoryStarts starts(3), solve(3);
  const std::vector<int64_t> numbers = every(0, 10, 10);
  const auto looks_of_next_solve = [&] {
    starts.hand_over(&solve);
    FirstLooks looks(3);
    solve.leave_out(numbers, &looks);
    return looks;
  };
  EXPECT_FALSE(solve.any());
  starts.hand_over(&solve);
  EXPECT_FALSE(solve.any());
  starts.add(1, 35);
  FirstLooks looks = looks_of_next_solve();
  EXPECT_TRUE(solve.any());
  EXPECT_EQ(looks.earlier_counts, (std::vector<uint8_t>{1, 0, 1}));
  EXPECT_EQ(looks.from, (std::vector<uint16_t>{0, 4, 0}));
  looks = looks_of_next_solve();
  EXPECT_EQ(looks.earlier_counts, (std::vector<uint8_t>{1, 1, 1}));
  EXPECT_EQ(looks.from, (std::vector<uint16_t>{0, 4, 0}));
  // Another cell is news, the first one is none.
  starts.add(2, 60);
  looks = looks_of_next_solve();
  EXPECT_EQ(looks.earlier_counts, (std::vector<uint8_t>{1, 1, 0}));
  EXPECT_EQ(looks.from, (std::vector<uint16_t>{0, 4, 6}));
  // The first one is news again where something left there again.
  starts.add(1, 75);
  looks = looks_of_next_solve();
  EXPECT_EQ(looks.earlier_counts, (std::vector<uint8_t>{1, 0, 1}));
  EXPECT_EQ(looks.from, (std::vector<uint16_t>{0, 8, 6}));
}

// What is added while a solve works is of the next one.
TEST(HistoryStarts, ASolveKnowsWhatWasKnownWhenItBegan) {
  HistoryStarts starts(2), solve(2);
  starts.add(0, 10);
  starts.hand_over(&solve);
  starts.add(1, 20);
  EXPECT_TRUE(solve.has(0));
  EXPECT_FALSE(solve.has(1));
  starts.forget();
  EXPECT_TRUE(solve.has(0));
  EXPECT_FALSE(starts.any());
  EXPECT_FALSE(starts.has(0));
  starts.hand_over(&solve);
  EXPECT_FALSE(solve.any());
  EXPECT_FALSE(solve.has(0));
  FirstLooks looks(2);
  solve.leave_out(every(0, 1, 50), &looks);
  EXPECT_EQ(looks.from, (std::vector<uint16_t>{0, 0}));
  EXPECT_EQ(looks.earlier_counts, (std::vector<uint8_t>{1, 1}));
}

}  // namespace
}  // namespace qdmd::test
