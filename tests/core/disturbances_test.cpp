// SPDX-License-Identifier: LGPL-2.1-or-later
// Which frames are known to be disturbed, by how many cells do not show the background.
#include "core/learn/robust/disturbances.h"

#include <gtest/gtest.h>

#include <functional>

namespace qdmd::test {
namespace {

// Follows frames 0 .. count - 1 of such shares.
Disturbances after(int count, const std::function<double(int frame)>& share) {
  Disturbances disturbances;
  for (int t = 0; t < count; ++t) disturbances.follow(share(t), t);
  return disturbances;
}

TEST(Disturbances, AMomentIsDisturbedFromItsFirstFrameToItsLast) {
  const Disturbances found = after(300, [](int t) { return t >= 200 && t < 225 ? 0.4 : 0.05; });
  EXPECT_FALSE(found.goes_on());
  for (int t = 0; t < 300; ++t) EXPECT_EQ(found.has(t), t >= 200 && t < 225) << t;
}

TEST(Disturbances, FramesToComeAreDisturbedWhileItGoesOn) {
  const Disturbances found = after(210, [](int t) { return t >= 200 ? 0.4 : 0.05; });
  EXPECT_TRUE(found.goes_on());
  EXPECT_FALSE(found.has(199));
  EXPECT_TRUE(found.has(200));
  EXPECT_TRUE(found.has(215));
}

TEST(Disturbances, WhatLastsIsTheScene) {
  const Disturbances found = after(300, [](int t) { return t >= 200 ? 0.4 : 0.05; });
  EXPECT_FALSE(found.goes_on());
  for (int t = 0; t < 300; ++t) EXPECT_FALSE(found.has(t)) << t;
}

// Leaves hide most of the picture again and again; a bus comes in ten frames.
TEST(Disturbances, WhatIsUsualOrComesSlowlyIsNone) {
  const auto leaves = [](int t) { return t / 10 % 2 ? 0.8 : 0.2; };
  EXPECT_FALSE(after(305, leaves).goes_on());
  const Disturbances bus = after(300, [](int t) {
    return t < 200 ? 0.05 : t < 210 ? 0.05 + 0.05 * (t - 199) : t < 240 ? 0.55 : 0.05;
  });
  for (int t = 0; t < 300; ++t) {
    EXPECT_FALSE(after(300, leaves).has(t)) << t;
    EXPECT_FALSE(bus.has(t)) << t;
  }
}

// Nobody knows what is usual before so many frames.
TEST(Disturbances, TheFirstFramesOfASceneAreNone) {
  const Disturbances found = after(80, [](int t) { return t >= 50 && t < 60 ? 0.4 : 0.05; });
  for (int t = 0; t < 80; ++t) EXPECT_FALSE(found.has(t)) << t;
}

TEST(Disturbances, OnlyTheNewestMomentsAreKept) {
  const Disturbances found = after(3000, [](int t) { return t > 100 && t % 50 < 5 ? 0.4 : 0.05; });
  EXPECT_TRUE(found.has(2952));
  EXPECT_TRUE(found.has(2202));
  EXPECT_FALSE(found.has(2152));
}

}  // namespace
}  // namespace qdmd::test
