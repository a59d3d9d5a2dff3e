// SPDX-License-Identifier: LGPL-2.1-or-later
// From when on a place is known, and what changes that: one cell, frame by frame.
#include "core/learn/robust/shown_counts.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/learn/robust/stable_frames.h"

namespace qdmd::test {
namespace {

using steps::proofs::kLasts, steps::proofs::kYoungFrames;

// A picture of few cells, all alike.
class Place {
 public:
  // So many frames show that level while the background is that one.
  void see(float level, float background, int64_t frames) {
    for (int64_t i = 0; i < frames; ++i, ++number_) {
      const std::vector<float> shown(grid_.cells(), level), behind(grid_.cells(), background);
      const float* const now[3] = {shown.data(), shown.data(), shown.data()};
      const float* const of[3] = {behind.data(), behind.data(), behind.data()};
      looks_.follow(now, kSameLight, number_);
      looks_.find_differing(of, &differs_, &differing_);
      counts_.count(looks_, differs_, of);
    }
  }
  bool is_known() const { return counts_.is_known(0, looks_.newest() - looks_.since(0) + 1); }
  bool shows_other() const { return counts_.shows_other(0); }
  void grow_up() { counts_.grow_up(); }

 private:
  Grid grid_ = Grid(64, 48);
  StandingLooks looks_{grid_};
  ShownCounts counts_{grid_.cells()};
  std::vector<uint8_t> differs_ = std::vector<uint8_t>(grid_.cells());
  std::vector<int> differing_;
  int64_t number_ = 0;
};

TEST(ShownCounts, APlaceIsKnownAfterThreeSecondsAndStaysSoWhileSomebodyStandsThere) {
  Place place;
  place.see(100, 100, kLasts - 5);
  EXPECT_FALSE(place.is_known());
  place.see(100, 100, 10 + StandingLooks::kSteady);
  EXPECT_TRUE(place.is_known());
  EXPECT_FALSE(place.shows_other());
  place.see(40, 100, 400);
  EXPECT_TRUE(place.shows_other());
  EXPECT_TRUE(place.is_known());
}

TEST(ShownCounts, OthersThatHideItForMostOfTheTimeLeaveItUnknown) {
  Place place;
  float other = 20;
  for (int turn = 0; turn < 8; ++turn, other += 8) {
    place.see(200, 200, 12);
    place.see(other, 200, 2 * StandingLooks::kSteady + 20);
  }
  EXPECT_FALSE(place.is_known());
  // As long as that does not last, it is known after enough frames.
  place.see(200, 200, kYoungFrames);
  EXPECT_TRUE(place.is_known());
}

TEST(ShownCounts, AnotherLightIsNoOtherBackground) {
  Place place;
  place.see(100, 100, 150);
  // The exposure follows who comes: what is behind him is brighter, and nobody sees it.
  place.see(40, 100, 50);
  place.see(50, 118, 100);
  EXPECT_TRUE(place.is_known());
  EXPECT_TRUE(place.shows_other());
  // He moves: for a moment there is no look.
  place.see(80, 118, 2);
  EXPECT_TRUE(place.shows_other());
  place.see(118, 118, 30);
  EXPECT_FALSE(place.shows_other());
  EXPECT_TRUE(place.is_known());
}

TEST(ShownCounts, AnotherBackgroundBeginsAnew) {
  Place place;
  place.see(100, 100, 150);
  place.see(40, 100, 30);
  // What stands there becomes background: it has been seen for 31 frames.
  place.see(40, 40, 1);
  EXPECT_FALSE(place.is_known());
  place.see(40, 40, kLasts);
  EXPECT_TRUE(place.is_known());
  Place grown_up;
  grown_up.see(40, 40, 20);
  EXPECT_FALSE(grown_up.is_known());
  grown_up.grow_up();
  grown_up.see(40, 40, 1);
  EXPECT_TRUE(grown_up.is_known());
}

}  // namespace
}  // namespace qdmd::test
