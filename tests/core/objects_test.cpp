// SPDX-License-Identifier: LGPL-2.1-or-later
// Things that are followed through regions, and what is told of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <string>

#include "core/objects/assignment.h"
#include "core/objects/object_tracker.h"

namespace qdmd {
namespace {

using Kind = ObjectEvent::Kind;
constexpr int kWidth = 320, kHeight = 240;
constexpr int64_t kStep = 40'000'000;

Region region(double x, double y, double width, double height) {
  Region r;
  r.x = static_cast<int>(std::lround(x)), r.y = static_cast<int>(std::lround(y));
  r.width = static_cast<int>(width), r.height = static_cast<int>(height);
  r.area = r.width * r.height * 3 / 4;
  r.mean_residual = 50;
  return r;
}

// Pushes frames of 25 a second. Nothing has to settle.
class Tracking : public testing::Test {
 protected:
  Tracking() {
    options_.settle_seconds = 0;
    tracker_.begin(kWidth, kHeight, options_);
  }
  void push(std::vector<Region> regions, std::vector<RemovedPlace> removed = {}) {
    const auto& events = tracker_.push({regions, removed, time_, time_ + 7});
    for (const ObjectEvent& event : events) told_.push_back({event, frame()});
    time_ += kStep;
    for (const Object& object : tracker_.objects())
      EXPECT_TRUE(object.id >= 1) << "every region has a number";
  }
  int frame() const { return static_cast<int>(time_ / kStep); }
  // Of the thing whose box holds that place; 0: of none.
  int id_at(double x, double y) const {
    for (const Object& object : tracker_.objects())
      if (x >= object.box.x && x < object.box.right() && y >= object.box.y &&
          y < object.box.bottom())
        return object.id;
    return 0;
  }
  int count(Kind kind) const {
    return static_cast<int>(std::count_if(told_.begin(), told_.end(),
                                          [&](const auto& one) { return one.first.kind == kind; }));
  }
  const Object& first(Kind kind) const {
    static const Object kNone;
    for (const auto& [event, at] : told_)
      if (event.kind == kind) return event.object;
    return kNone;
  }
  int frame_of(Kind kind) const {
    for (const auto& [event, at] : told_)
      if (event.kind == kind) return at;
    return -1;
  }

  ObjectOptions options_;
  ObjectTracker tracker_;
  int64_t time_ = 0;
  std::vector<std::pair<ObjectEvent, int>> told_;
};

// ---- Assignment ----

TEST(Assignment, IsTheBestOfAllOrders) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(0, 1);
  Assignment assignment;
  for (size_t rows = 0; rows <= 6; ++rows)
    for (size_t cols = 0; cols <= 6; ++cols) {
      std::vector<double> cost(rows * cols);
      for (double& one : cost) one = number(random);
      const std::vector<int> pairs = assignment.solve(cost, rows, cols);
      ASSERT_EQ(rows, pairs.size());
      double sum = 0;
      std::set<int> taken;
      for (size_t r = 0; r < rows; ++r) {
        if (pairs[r] < 0) continue;
        EXPECT_TRUE(taken.insert(pairs[r]).second) << "one column for two rows";
        sum += cost[r * cols + static_cast<size_t>(pairs[r])];
      }
      EXPECT_EQ(std::min(rows, cols), taken.size());
      // Every order of the longer side.
      std::vector<size_t> order(std::max(rows, cols));
      std::iota(order.begin(), order.end(), size_t{0});
      double best = 1e9;
      do {
        double all = 0;
        for (size_t i = 0; i < std::min(rows, cols); ++i)
          all += rows <= cols ? cost[i * cols + order[i]] : cost[order[i] * cols + i];
        best = std::min(best, all);
      } while (std::next_permutation(order.begin(), order.end()));
      EXPECT_NEAR(best, sum, 1e-9);
    }
}

// ---- Numbers ----

TEST_F(Tracking, OneThatCrossesHasOneNumberAndIsToldOfTwice) {
  for (int t = 0; t < 60; ++t) push({region(3 * t, 100, 30, 80)});
  EXPECT_EQ(1, id_at(3 * 59 + 5, 120));
  for (int t = 0; t < 40; ++t) push({});
  EXPECT_EQ(1, count(Kind::appeared));
  EXPECT_EQ(1, count(Kind::gone));
  EXPECT_NEAR(5, frame_of(Kind::appeared), 2);
  EXPECT_NEAR(59 + 25, frame_of(Kind::gone), 1);
  EXPECT_EQ(7, first(Kind::appeared).first_stamp) << "what was said of its first frame";
  EXPECT_EQ(2, count(Kind::appeared) + count(Kind::gone));
}

TEST_F(Tracking, AGapOfSomeFramesKeepsTheNumber) {
  for (int t = 0; t < 60; ++t)
    if (t < 20 || t > 28)
      push({region(3 * t, 100, 30, 80)});
    else
      push({});
  EXPECT_EQ(1, id_at(3 * 59 + 5, 120));
  EXPECT_EQ(0, count(Kind::gone));
}

TEST_F(Tracking, TwoThatPassEachOtherKeepTheirs) {
  // 30 wide each; while they meet, their region is one.
  int left = 0, right = 0;
  for (int t = 0; t < 80; ++t) {
    const double a = 20 + 3 * t, b = 270 - 3 * t;
    if (t == 15) left = id_at(a + 10, 150), right = id_at(b + 10, 150);
    if (std::abs(a - b) > 30)
      push({region(a, 100, 30, 80), region(b, 104, 30, 80)});
    else
      push({region(std::min(a, b), 100, std::abs(a - b) + 30, 84)});
  }
  ASSERT_NE(left, right);
  ASSERT_GT(left * right, 0);
  EXPECT_EQ(left, id_at(20 + 3 * 79 + 10, 150));
  EXPECT_EQ(right, id_at(270 - 3 * 79 + 10, 150));
  EXPECT_EQ(2, count(Kind::appeared));
  EXPECT_EQ(0, count(Kind::gone));
}

// Half a minute is missing while they meet: they are where their region is.
TEST_F(Tracking, MissingFramesMoveNobodyOutOfThePicture) {
  for (int t = 0; t < 35; ++t) {
    const double a = 20 + 3 * t, b = 270 - 3 * t;
    if (b - a > 30)
      push({region(a, 100, 30, 80), region(b, 104, 30, 80)});
    else
      push({region(a, 100, b - a + 30, 84)});
  }
  EXPECT_EQ(2, count(Kind::appeared));
  push({region(125, 100, 60, 84)});
  ASSERT_EQ(2u, tracker_.objects().size());
  time_ += 750 * kStep;
  push({region(125, 100, 60, 84)});
  for (const Object& object : tracker_.objects()) {
    EXPECT_GT(object.box.width, 10);
    EXPECT_NEAR(155, object.box.middle_x(), 40);
  }
  for (const ObjectEvent& event : tracker_.end()) {
    if (event.kind != Kind::gone) continue;
    EXPECT_NEAR(155, event.object.box.middle_x(), 40);
  }
}

TEST_F(Tracking, OneThatWalksBehindOneThatStandsKeepsItsNumber) {
  int stander = 0, walker = 0;
  for (int t = 0; t < 160; ++t) {
    const double a = 150 - std::max(0, 30 - t) * 3, b = 300 - 3 * std::max(0, t - 90);
    if (t == 85) stander = id_at(a + 10, 150);
    if (t == 100) walker = id_at(b + 10, 150);
    if (b > 320 || t < 90)
      push({region(a, 100, 30, 80)});
    else if (std::abs(a - b) > 30)
      push({region(a, 100, 30, 80), region(b, 104, 30, 80)});
    else
      push({region(std::min(a, b), 100, std::abs(a - b) + 30, 84)});
  }
  EXPECT_EQ(stander, id_at(160, 150));
  EXPECT_EQ(walker, id_at(300 - 3 * 69 + 10, 150));
  EXPECT_EQ(1, count(Kind::stopped)) << "who walks by moves nobody";
  EXPECT_EQ(0, count(Kind::moved_on));
}

TEST_F(Tracking, PiecesOfAThingAreOne) {
  for (int t = 0; t < 20; ++t) push({region(3 * t, 60, 30, 100)});
  const int id = id_at(3 * 19 + 10, 100);
  // Its middle is like the background.
  for (int t = 20; t < 40; ++t) push({region(3 * t, 60, 30, 30), region(3 * t + 2, 110, 26, 50)});
  ASSERT_EQ(1u, tracker_.objects().size());
  EXPECT_EQ(id, tracker_.objects()[0].id);
  EXPECT_EQ(100, tracker_.objects()[0].box.height);
  EXPECT_EQ(1, count(Kind::appeared));
}

TEST_F(Tracking, WhoGoesOutAndWhoComesInThereAreTwo) {
  for (int t = 0; t < 40; ++t) {
    const int left = 240 + 3 * t;
    push(left < 318 ? std::vector{region(left, 100, std::min(30, 320 - left), 80)}
                    : std::vector<Region>{});
  }
  const int before = first(Kind::appeared).id;
  for (int t = 0; t < 20; ++t) {
    const int left = 318 - 3 * t;
    push({region(left, 100, std::min(30, 320 - left), 80)});
  }
  EXPECT_NE(before, id_at(318 - 3 * 19 + 5, 120));
  EXPECT_EQ(2, count(Kind::appeared));
}

TEST_F(Tracking, NumbersAreNeverUsedTwice) {
  std::set<int> all;
  for (int round = 0; round < 3; ++round) {
    for (int t = 0; t < 40; ++t) push({region(3 * t, 100, 30, 80), region(10, 10, 8, 8)});
    for (const Object& object : tracker_.objects()) EXPECT_TRUE(all.insert(object.id).second);
    const auto events = tracker_.end();
    EXPECT_FALSE(events.empty());
    for (const ObjectEvent& event : events) EXPECT_TRUE(event.cut_off);
    EXPECT_TRUE(tracker_.end().empty());
  }
}

// ---- What is told ----

TEST_F(Tracking, ABagThatIsPutDownIsLeftBehind) {
  int person = 0;
  for (int t = 0; t < 130; ++t) {
    const int x = 60 + 3 * std::min(t, 60) + (t > 60 ? 3 * (t - 60) : 0);
    std::vector<Region> regions;
    // The bag, 24 wide, lies at 150 from frame 30 on; the person's region has it as long as both
    // touch.
    if (t < 30)
      regions = {region(x, 80, 30, 100)};
    else if (x < 150 + 24 + 4)
      regions = {region(150, 80, x + 30 - 150, 100)};
    else
      regions = {region(150, 150, 24, 30)};
    if (x >= 178 && x < 290) regions.push_back(region(x, 80, 30, 100));
    if (t == 29) person = id_at(x + 10, 100);
    if (t == 60) {
      EXPECT_EQ(person, id_at(x + 10, 100)) << "who goes on keeps the number";
    }
    push(regions);
  }
  EXPECT_EQ(1, count(Kind::left_behind));
  EXPECT_EQ(0, count(Kind::stopped));
  for (const auto& [event, at] : told_)
    if (event.kind == Kind::left_behind) {
      EXPECT_NE(person, event.object.id);
      EXPECT_EQ(150, event.object.box.x);
      // The person is further than half the bag's size from it in frame 45.
      EXPECT_NEAR(45 + 50, at, 6);
    }
}

TEST_F(Tracking, WhatStandsIsToldOnceAndWhenItGoesOn) {
  for (int t = 0; t < 200; ++t) {
    const int walked = std::min(t, 40) + std::max(0, t - 140);
    push({region(2 * walked, 100, 30, 80)});
  }
  EXPECT_EQ(1, count(Kind::stopped));
  EXPECT_EQ(1, count(Kind::moved_on));
  EXPECT_NEAR(40 + 50, frame_of(Kind::stopped), 4);
  EXPECT_NEAR(140 + 10, frame_of(Kind::moved_on), 6);
  EXPECT_EQ(2, count(Kind::motion_begins));
  EXPECT_EQ(1, count(Kind::motion_ends));
}

TEST_F(Tracking, NothingThatOnlyGrowsOrFluttersAppears) {
  for (int t = 0; t < 100; ++t) {
    std::vector<Region> regions = {region(200, 100, 5 + t, 50)};
    if (t % 3 == 0) regions.push_back(region(50 + t * 7 % 5, 50, 8, 8));
    push(regions);
  }
  EXPECT_TRUE(told_.empty());
}

TEST_F(Tracking, APersonAtASixtiethOfTheHeightIsAThing) {
  ObjectTracker large;
  large.begin(1920, 1080, options_);
  int appeared = 0;
  for (int t = 0; t < 60; ++t)
    for (const ObjectEvent& event :
         large.push({std::vector{region(100 + 2 * t, 500, 8, 18)}, {}, t * kStep, 0}))
      appeared += event.kind == Kind::appeared;
  EXPECT_EQ(1, appeared);
  EXPECT_LE(ObjectTracker::least_area(1080, options_), 8 * 18);
  for (int t = 0; t < 60; ++t) push({region(100 + 2 * t, 100, 2, 3)});
  EXPECT_TRUE(told_.empty()) << "smaller things are none";
}

TEST_F(Tracking, WhatWasTakenIsToldOnceWithItsWholePlace) {
  for (int t = 0; t < 100; ++t) {
    std::vector<RemovedPlace> removed;
    if (t == 30) removed.push_back({{100, 100, 30, 40}, 20});
    if (t == 40) removed.push_back({{140, 100, 30, 40}, 20});
    if (t == 45) removed.push_back({{100, 100, 5, 5}, 20});
    if (t == 50) removed.push_back({{20, 20, 30, 30}, 1});
    push({}, removed);
  }
  ASSERT_EQ(1u, told_.size());
  EXPECT_EQ(Kind::removed, told_[0].first.kind);
  EXPECT_EQ(100, told_[0].first.object.box.x);
  EXPECT_EQ(70, told_[0].first.object.box.width);
  EXPECT_GT(told_[0].first.object.id, 0);
}

TEST_F(Tracking, AFrameThatIsAllForegroundSaysNothing) {
  for (int t = 0; t < 40; ++t) push({region(3 * t, 100, 30, 80)});
  for (int t = 0; t < 40; ++t)
    tracker_.push({std::vector{region(0, 0, 320, 240)}, {}, time_ += kStep, 0});
  EXPECT_EQ(0, count(Kind::gone));
  ASSERT_EQ(1u, tracker_.objects().size());
  EXPECT_EQ(0, tracker_.objects()[0].id) << "no thing";
}

// A change of state, not a frame.
TEST_F(Tracking, TellsSeldom) {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> off(-1, 1);
  for (int t = 0; t < 2000; ++t) {
    std::vector<Region> regions;
    for (int k = 0; k < 5; ++k) {
      const int way = (t * (2 + k) / 2 + 60 * k) % 400;
      if (way < 290)
        regions.push_back(region(way + off(random), 20 + 44 * k + off(random), 26 + off(random),
                                 36 + off(random)));
    }
    push(regions);
  }
  const auto things = std::count_if(told_.begin(), told_.end(), [](const auto& one) {
    return one.first.kind == Kind::appeared || one.first.kind == Kind::gone;
  });
  EXPECT_LE(std::ssize(told_) - things, 2);
  std::map<int, int> of_id;
  for (const auto& [event, at] : told_) ++of_id[event.object.id];
  for (const auto& [id, events] : of_id) EXPECT_LE(events, 2) << id;
}

}  // namespace
}  // namespace qdmd
