// SPDX-License-Identifier: LGPL-2.1-or-later
// What the element answers a LATENCY query, from rates and timestamps alone.
#include "gst/latency.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <initializer_list>
#include <utility>

namespace qdmd::test {
namespace {

constexpr GstClockTime kMost = GST_CLOCK_TIME_NONE / 8;

// Frames first .. first + count - 1, one each `interval`. Returns how often the promise grew.
int frames_in(Latency* latency, int first, int count, GstClockTime interval) {
  int grew = 0;
  for (int t = first; t < first + count; ++t) {
    const GstClockTime before = latency->promised();
    const bool more = latency->frame_in(static_cast<GstClockTime>(t) * interval);
    EXPECT_EQ(more, latency->promised() > before) << t;
    EXPECT_GE(latency->promised(), before) << t;
    grew += more;
  }
  return grew;
}

TEST(Latency, IsThatOfTheCapsRate) {
  Latency latency;
  EXPECT_EQ(0u, latency.promised());
  EXPECT_TRUE(latency.configure(24, 50, 1));
  EXPECT_EQ(24 * GST_SECOND / 50, latency.promised());
  EXPECT_FALSE(latency.configure(24, 50, 1)) << "the same";
  EXPECT_FALSE(latency.configure(48, 100, 1)) << "the same";
  EXPECT_TRUE(latency.configure(30, 30000, 1001));
  EXPECT_EQ(1001 * GST_MSECOND, latency.promised());
}

TEST(Latency, WithoutARateIsThatOf25FramesASecondUntilTimestampsTell) {
  Latency latency;
  EXPECT_TRUE(latency.configure(24, 0, 1));
  EXPECT_EQ(24 * GST_SECOND / 25, latency.promised());
  constexpr GstClockTime kInterval = GST_SECOND / 10;
  EXPECT_EQ(0, frames_in(&latency, 0, 8, kInterval)) << "too few to tell";
  EXPECT_EQ(1, frames_in(&latency, 8, 200, kInterval)) << "once";
  EXPECT_GE(latency.promised(), 24 * kInterval);
  EXPECT_LE(latency.promised(), 26 * kInterval);
}

TEST(Latency, OfCapsWithTwiceTheRateOfTheFrames) {
  Latency latency;
  EXPECT_TRUE(latency.configure(24, 50, 1));
  EXPECT_EQ(24 * GST_SECOND / 50, latency.promised());
  EXPECT_EQ(1, frames_in(&latency, 0, 200, GST_SECOND / 25));
  EXPECT_GE(latency.promised(), 24 * GST_SECOND / 25);
  EXPECT_LE(latency.promised(), 26 * GST_SECOND / 25);
}

TEST(Latency, OfTheRateThatTheCapsSayStaysWithTimestampsThatWaver) {
  for (GstClockTime waver : std::initializer_list<GstClockTime>{0, GST_MSECOND, 15 * GST_MSECOND}) {
    Latency latency;
    latency.configure(24, 25, 1);
    const GstClockTime promised = latency.promised();
    for (int t = 0; t < 500; ++t)
      EXPECT_FALSE(latency.frame_in(static_cast<GstClockTime>(t) * 40 * GST_MSECOND +
                                    (t % 3 == 1 ? waver : 0)))
          << t;
    EXPECT_EQ(promised, latency.promised());
  }
}

TEST(Latency, OfFasterFramesDoesNotShrink) {
  Latency latency;
  latency.configure(24, 25, 1);
  EXPECT_EQ(0, frames_in(&latency, 0, 200, GST_SECOND / 100));
  EXPECT_EQ(24 * GST_SECOND / 25, latency.promised());
}

TEST(Latency, ShrinksWithNewCapsAlone) {
  Latency latency;
  latency.configure(24, 25, 1);
  EXPECT_EQ(1, frames_in(&latency, 0, 100, GST_SECOND / 10));
  const GstClockTime grown = latency.promised();
  EXPECT_GT(grown, 24 * GST_SECOND / 25);
  latency.restart();
  EXPECT_EQ(grown, latency.promised());
  EXPECT_EQ(0, frames_in(&latency, 10000, 200, GST_SECOND / 100));
  EXPECT_EQ(grown, latency.promised());
  EXPECT_TRUE(latency.configure(24, 25, 1)) << "another one than before";
  EXPECT_EQ(24 * GST_SECOND / 25, latency.promised());
  // Nothing of the frames before is left.
  EXPECT_EQ(0, frames_in(&latency, 100000, 200, GST_SECOND / 25));
}

TEST(Latency, BreaksInTimeAreNoSlowFrames) {
  Latency latency;
  latency.configure(24, 25, 1);
  const GstClockTime promised = latency.promised();
  EXPECT_EQ(0, frames_in(&latency, 0, 20, GST_SECOND / 25));
  // Forwards, which the caller knows of; back, which shows.
  latency.restart();
  EXPECT_EQ(0, frames_in(&latency, 10000, 200, GST_SECOND / 25));
  EXPECT_EQ(0, frames_in(&latency, 0, 200, GST_SECOND / 25));
  EXPECT_EQ(promised, latency.promised());
  // Reverse playback.
  for (int t = 200; t > 0; --t)
    EXPECT_FALSE(latency.frame_in(static_cast<GstClockTime>(t) * GST_SECOND));
  EXPECT_EQ(promised, latency.promised());
}

TEST(Latency, PausesAreNoSlowFramesUnlessTheyAreBetweenAll) {
  Latency latency;
  latency.configure(24, 25, 1);
  const GstClockTime promised = latency.promised();
  constexpr GstClockTime kPause = 1000 * GST_SECOND, kInterval = GST_SECOND / 25;
  const auto after = [&](GstClockTime pause) {
    return [=](int t) { return t * kInterval + pause; };
  };
  GstClockTime past = 0;
  for (int round = 0; round < 4; ++round, past += kPause) {
    if (round > 0) latency.pause();
    for (int t = 0; t < 50; ++t) {
      EXPECT_FALSE(latency.frame_in(after(past)(50 * round + t)));
      // It came before the pause.
      if (round > 0) {
        EXPECT_FALSE(latency.frame_out(after(past - kPause)(50 * round - 1), 0));
      }
    }
  }
  EXPECT_EQ(promised, latency.promised());
  EXPECT_DOUBLE_EQ(25, latency.rate(50, 1));
  Latency slow;
  slow.configure(24, 25, 1);
  for (GstClockTime t = 0; t < 40; ++t) {
    slow.pause();
    slow.frame_in(10 * t * GST_SECOND);
  }
  EXPECT_DOUBLE_EQ(0.1, slow.rate(25, 1));
  EXPECT_GE(slow.promised(), 240 * GST_SECOND);
}

// By a clock that is corrected each second.
TEST(Latency, StepsBackDoNotChangeTheRate) {
  Latency latency;
  latency.configure(24, 50, 1);
  for (int second = 0; second < 40; ++second)
    for (int t = 0; t < 25; ++t)
      latency.frame_in(GST_SECOND + static_cast<GstClockTime>(25 * second + t) * 40 * GST_MSECOND -
                       static_cast<GstClockTime>(second) * 44 * GST_MSECOND);
  EXPECT_DOUBLE_EQ(25, latency.rate(50, 1));
}

TEST(Latency, FramesWithoutTimestampsTellNothing) {
  Latency latency;
  latency.configure(24, 25, 1);
  for (int t = 0; t < 100; ++t) {
    EXPECT_FALSE(latency.frame_in(GST_CLOCK_TIME_NONE));
    EXPECT_FALSE(latency.frame_out(GST_CLOCK_TIME_NONE, GST_SECOND));
    EXPECT_FALSE(latency.frame_out(0, GST_SECOND)) << "nobody knows the newest";
  }
  EXPECT_EQ(24 * GST_SECOND / 25, latency.promised());
}

TEST(Latency, FramesThatWaitedLonger) {
  Latency latency;
  latency.configure(24, 25, 1);
  frames_in(&latency, 0, 26, GST_SECOND / 25);
  EXPECT_FALSE(latency.frame_out(GST_SECOND / 25, 0)) << "24 frames";
  EXPECT_FALSE(latency.frame_out(2 * GST_SECOND, 0)) << "it is newer than the newest";
  EXPECT_TRUE(latency.frame_out(0, 0)) << "25 frames";
  EXPECT_GE(latency.promised(), GST_SECOND);
  EXPECT_FALSE(latency.frame_out(0, 0));
}

// Sinks have 20 ms in hand.
TEST(Latency, FramesThatASolveHeldUp) {
  Latency latency;
  latency.configure(24, 25, 1);
  const GstClockTime waited = 24 * GST_SECOND / 25;
  frames_in(&latency, 0, 25, GST_SECOND / 25);
  for (GstClockTime held : std::initializer_list<GstClockTime>{0, GST_MSECOND, 20 * GST_MSECOND})
    EXPECT_FALSE(latency.frame_out(0, held));
  EXPECT_EQ(waited, latency.promised());
  EXPECT_TRUE(latency.frame_out(0, 60 * GST_MSECOND));
  const GstClockTime grown = latency.promised();
  EXPECT_GE(grown, waited + 60 * GST_MSECOND);
  EXPECT_LE(grown, waited + 80 * GST_MSECOND);
  // The next one, a bit slower, is no surprise.
  EXPECT_FALSE(latency.frame_out(0, 65 * GST_MSECOND));
  EXPECT_FALSE(latency.frame_out(0, 0));
  EXPECT_EQ(grown, latency.promised());
}

// Where the solve is done with a frame with which none leaves, as the first one is, or with another
// frame than the one that brings its background into use.
TEST(Latency, OfASolveThatHeldUpAFrameWithWhichNoneLeaves) {
  Latency latency;
  latency.configure(24, 25, 1);
  const GstClockTime waited = 24 * GST_SECOND / 25;
  for (GstClockTime held : std::initializer_list<GstClockTime>{0, GST_MSECOND, 20 * GST_MSECOND})
    EXPECT_FALSE(latency.held_up(held));
  EXPECT_EQ(waited, latency.promised());
  EXPECT_TRUE(latency.held_up(60 * GST_MSECOND));
  const GstClockTime grown = latency.promised();
  EXPECT_GE(grown, waited + 60 * GST_MSECOND);
  EXPECT_LE(grown, waited + 80 * GST_MSECOND);
  EXPECT_FALSE(latency.held_up(65 * GST_MSECOND)) << "it does not add up";
  EXPECT_EQ(grown, latency.promised());
  // Frames come more slowly than was known.
  frames_in(&latency, 0, 100, GST_SECOND / 10);
  EXPECT_TRUE(latency.held_up(500 * GST_MSECOND));
  EXPECT_GE(latency.promised(), 24 * GST_SECOND / 10 + 500 * GST_MSECOND);
  EXPECT_LE(latency.promised(), 25 * GST_SECOND / 10 + 650 * GST_MSECOND);
}

// Upstream keeps frames while sinks wait for a solve, as many as it can.
TEST(Latency, OfWhatHoldsFramesUpIsNoMoreThanUpstreamKeeps) {
  Latency latency;
  latency.configure(24, 25, 1);
  const GstClockTime waited = 24 * GST_SECOND / 25;
  const auto answer = [&](bool live, GstClockTime min, GstClockTime max) {
    latency.add_to(live, &min, &max);
    return std::pair(min, max);
  };
  constexpr GstClockTime kAny = GST_CLOCK_TIME_NONE, kFrame = GST_SECOND / 25;
  EXPECT_EQ(answer(true, kFrame, 4 * kFrame), std::pair(kFrame + waited, 4 * kFrame + waited));
  EXPECT_EQ(answer(true, kFrame, kAny), std::pair(kFrame + waited, kAny));
  latency.held_up(GST_SECOND);
  const GstClockTime promised = latency.promised();
  EXPECT_GT(promised, waited + GST_SECOND);
  EXPECT_EQ(answer(true, kFrame, kAny), std::pair(kFrame + promised, kAny));
  EXPECT_EQ(answer(true, kFrame, 4 * kFrame), std::pair(4 * kFrame + waited, 4 * kFrame + waited));
  EXPECT_EQ(answer(true, kFrame, kFrame), std::pair(kFrame + waited, kFrame + waited));
  EXPECT_EQ(answer(true, kFrame, 0), std::pair(kFrame + waited, waited));
  EXPECT_EQ(answer(true, kFrame, 4 * GST_SECOND),
            std::pair(kFrame + promised, 4 * GST_SECOND + waited));
  // Files wait.
  EXPECT_EQ(answer(false, 0, kFrame), std::pair(promised, kFrame + waited));
}

TEST(Latency, OfLiveIsNone) {
  Latency latency;
  EXPECT_FALSE(latency.configure(0, 25, 1));
  EXPECT_FALSE(latency.configure(0, 0, 1));
  EXPECT_EQ(0, frames_in(&latency, 0, 100, GST_SECOND));
  EXPECT_FALSE(latency.frame_out(99 * GST_SECOND, 10 * GST_SECOND));
  EXPECT_FALSE(latency.frame_out(0, 10 * GST_SECOND));
  EXPECT_FALSE(latency.held_up(10 * GST_SECOND));
  EXPECT_EQ(0u, latency.promised());
}

TEST(Latency, IsNeverSoLongThatASumOverflows) {
  Latency latency;
  EXPECT_TRUE(latency.configure(2047, 1, 2147483647));
  EXPECT_GT(latency.promised(), 0u);
  EXPECT_LT(latency.promised(), kMost);
  const GstClockTime first = latency.promised();
  // Frames as far apart as timestamps can be, and held for as long.
  for (GstClockTime interval : std::initializer_list<GstClockTime>{
           GST_CLOCK_TIME_NONE / 1000, GST_CLOCK_TIME_NONE / 20, 2147483647 * GST_SECOND}) {
    for (bool known : {false, true}) {
      latency.configure(2047, known ? 25 : 1, known ? 1 : 2147483647);
      const int count =
          static_cast<int>(std::min<GstClockTime>(300, (GST_CLOCK_TIME_NONE - 1) / interval));
      frames_in(&latency, 0, count, interval);
      EXPECT_LT(latency.promised(), kMost);
      latency.frame_out(0, 0);
      EXPECT_LT(latency.promised(), kMost);
      for (GstClockTime held : {GST_CLOCK_TIME_NONE / 4, GST_CLOCK_TIME_NONE - 1}) {
        latency.frame_out(0, held);
        EXPECT_LT(latency.promised(), kMost);
        latency.held_up(held);
        EXPECT_LT(latency.promised(), kMost);
      }
    }
  }
  latency.configure(2047, 1, 2147483647);
  EXPECT_EQ(first, latency.promised());
}

}  // namespace
}  // namespace qdmd::test
