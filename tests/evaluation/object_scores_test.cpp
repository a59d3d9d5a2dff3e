// SPDX-License-Identifier: LGPL-2.1-or-later
// The scores of trackers and of events, on cases that are counted by hand.
#include "tests/evaluation/object_scores.h"

#include <gtest/gtest.h>

namespace qdmd::evaluation {
namespace {

using Kind = ObjectEvent::Kind;

std::vector<NumberedBox> two(int64_t first, int64_t second) {
  return {{first, {0, 0, 10, 10}}, {second, {50, 0, 10, 10}}};
}

TEST(TrackingScores, OfTheTruthAreOne) {
  TrackingScores scores;
  for (int k = 0; k < 10; ++k) scores.add_frame(two(1, 2), two(7, 8));
  scores.finish();
  EXPECT_DOUBLE_EQ(1, scores.mota());
  EXPECT_DOUBLE_EQ(1, scores.idf1());
}

TEST(TrackingScores, NumbersThatAreExchangedAreTwoSwitches) {
  TrackingScores scores;
  for (int k = 0; k < 10; ++k) scores.add_frame(two(1, 2), k < 6 ? two(7, 8) : two(8, 7));
  scores.finish();
  EXPECT_EQ(2, scores.switches());
  EXPECT_DOUBLE_EQ(1 - 2 / 20.0, scores.mota());
  // Six frames of ten are each other's.
  EXPECT_DOUBLE_EQ(0.6, scores.idf1());
}

TEST(TrackingScores, CountWhatIsMissedAndWrong) {
  TrackingScores scores;
  const std::vector<NumberedBox> truth = {{1, {0, 0, 10, 10}}};
  // Less than half of both.
  scores.add_frame(truth, {{7, {4, 0, 10, 10}}});
  scores.add_frame(truth, {});
  scores.add_frame(truth, {{7, {1, 0, 10, 10}}});
  scores.add_frame({}, {{7, {1, 0, 10, 10}}});
  scores.finish();
  EXPECT_EQ(2, scores.missed());
  EXPECT_EQ(2, scores.wrong());
  EXPECT_DOUBLE_EQ(1 - 4 / 3.0, scores.mota());
  EXPECT_DOUBLE_EQ(2 * 1 / (3.0 + 3.0), scores.idf1());
}

TEST(EventScores, AreInTimeLateMissedOrWrong) {
  const ObjectBox here = {0, 0, 10, 10}, there = {90, 0, 10, 10};
  const std::vector<TimedEvent> truth = {{Kind::gone, 1, 100, here},
                                         {Kind::gone, 2, 100, there},
                                         {Kind::gone, 3, 300, here},
                                         {Kind::gone, 4, 995, here}};
  const std::vector<TimedEvent> told = {{Kind::gone, 7, 110, here},
                                        {Kind::gone, 8, 111, there},
                                        {Kind::gone, 9, 300, there},
                                        {Kind::stopped, 9, 300, here}};
  const auto nowhere = [](int64_t, int) -> const ObjectBox* { return nullptr; };
  const EventScores scores = score_events(truth, told, nowhere, Kind::gone, 999, nullptr);
  EXPECT_EQ(3, scores.true_events) << "one comes too late to be told";
  EXPECT_EQ(1, scores.in_time);
  EXPECT_EQ(1, scores.late);
  EXPECT_EQ(1, scores.missed);
  EXPECT_EQ(1, scores.wrong);
}

TEST(EventScores, FollowWhatMoves) {
  // Five pixels a frame.
  ObjectBox now;
  const auto moving = [&now](int64_t owner, int frame) -> const ObjectBox* {
    now = {5.0 * frame, 0, 10, 10};
    return owner == 1 ? &now : nullptr;
  };
  const auto at = [&](int frame) { return *moving(1, frame); };
  const auto in_time = [&](const ObjectBox& told, Kind kind) {
    const std::vector<TimedEvent> truth = {{kind, 1, 100, at(100)}},
                                  events = {{kind, 7, 104, told}};
    return score_events(truth, events, moving, kind, 999, nullptr).in_time;
  };
  EXPECT_EQ(1, in_time(at(104), Kind::appeared)) << "where it is when it is told";
  EXPECT_EQ(0, in_time(at(100), Kind::appeared)) << "where it was";
  EXPECT_EQ(1, in_time(at(100), Kind::gone)) << "where it was seen last";
  EXPECT_EQ(0, in_time(at(104), Kind::gone));
}

}  // namespace
}  // namespace qdmd::evaluation
