// SPDX-License-Identifier: LGPL-2.1-or-later
// When the live mode does what: whole hops, warm-up, and work that never meets what comes next.
#include "core/engine/live_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

namespace qdmd::test {
namespace {

constexpr uint64_t kMega = uint64_t{1} << 20;

struct Setting {
  int window, hop;
  uint64_t bytes;  // of a frame
  int first_solve;

  std::string text() const {
    return "window " + std::to_string(window) + ", hop " + std::to_string(hop) + ", " +
           std::to_string(bytes) + " bytes a frame, first solve " + std::to_string(first_solve);
  }
};

// From pictures that need no spreading to pictures that are larger than a frame's share.
std::vector<Setting> settings() {
  std::vector<Setting> all;
  for (int window : {2, 3, 4, 5, 8, 16, 17, 20, 31, 32, 33, 60, 100, 200, 513, 2048})
    for (int hop : {0, 1, 2, 3, 7, 15, 16, 17, 18, 25, 31, 32, 33, 50, 64, 100, 2048})
      for (uint64_t bytes : {uint64_t{64}, uint64_t{230'400}, kMega, 6 * kMega, 25 * kMega,
                             40 * kMega, 1000 * kMega, uint64_t{1} << 40})
        for (bool kept : {false, true}) {
          if (hop > window) continue;
          const int used = LivePlan(window, hop, bytes).hop_size();
          all.push_back({window, hop, bytes, kept ? used : 1});
        }
  return all;
}

LivePlan schedule_of(const Setting& setting) {
  LivePlan schedule(setting.window, setting.hop, setting.bytes);
  schedule.restart(setting.first_solve);
  return schedule;
}

// Enough to be past the warm-up, and three windows more where they are short.
int frames_of(const Setting& setting) { return 5 * setting.window + 200; }

template <typename Check>
void for_every_setting(Check check) {
  for (const Setting& setting : settings()) {
    SCOPED_TRACE(setting.text());
    check(setting);
    if (testing::Test::HasFailure()) return;
  }
}

TEST(LivePlan, HopIsAQuarterOfTheWindowUnlessAskedFor) {
  EXPECT_EQ(LivePlan(100, 0, 1).hop_size(), 25);
  EXPECT_EQ(LivePlan(101, 0, 1).hop_size(), 25);
  EXPECT_EQ(LivePlan(2, 0, 1).hop_size(), 1);
  EXPECT_EQ(LivePlan(3, 0, 1).hop_size(), 1);
  EXPECT_EQ(LivePlan(7, 0, 1).hop_size(), 1);
  EXPECT_EQ(LivePlan(8, 0, 1).hop_size(), 2);
  EXPECT_EQ(LivePlan(100, 1, 1).hop_size(), 1);
  EXPECT_EQ(LivePlan(100, 100, 1).hop_size(), 100);
}

std::vector<int> solve_frames(LivePlan schedule, int frames) {
  std::vector<int> solves;
  for (int frame = 1; frame <= frames; ++frame)
    if (schedule.next().solve) solves.push_back(frame);
  return solves;
}

TEST(LivePlan, WarmUpGrowsByHalf) {
  EXPECT_EQ(solve_frames(LivePlan(100, 25, 64), 120),
            (std::vector{1, 2, 3, 4, 6, 9, 13, 19, 28, 42, 63, 88, 113}));
  EXPECT_EQ(solve_frames(LivePlan(100, 3, 64), 15), (std::vector{1, 2, 3, 4, 6, 9, 12, 15}));
  EXPECT_EQ(solve_frames(LivePlan(2, 1, 64), 5), (std::vector{1, 2, 3, 4, 5}));
  // The size of the pictures does not matter for when.
  EXPECT_EQ(solve_frames(LivePlan(100, 25, 64), 500),
            solve_frames(LivePlan(100, 25, 100 * kMega), 500));
}

TEST(LivePlan, RestartBeginsWithTheSolveThatItIsTold) {
  LivePlan schedule(100, 20, 64);
  for (int frame = 0; frame < 73; ++frame) schedule.next();
  EXPECT_EQ(schedule.frames(), 73);
  schedule.restart(20);
  EXPECT_EQ(schedule.frames(), 0);
  EXPECT_EQ(solve_frames(schedule, 130), (std::vector{20, 30, 45, 65, 85, 105, 125}));
  schedule.restart(1);
  EXPECT_EQ(solve_frames(schedule, 10), (std::vector{1, 2, 3, 4, 6, 9}));
}

TEST(LivePlan, SolvesAreAtMostAHopApart) {
  for_every_setting([](const Setting& setting) {
    const int hop = schedule_of(setting).hop_size();
    const auto solves = solve_frames(schedule_of(setting), frames_of(setting));
    ASSERT_FALSE(solves.empty());
    EXPECT_EQ(solves[0], setting.first_solve);
    for (size_t k = 1; k < solves.size(); ++k) {
      const int gap = solves[k] - solves[k - 1];
      ASSERT_LE(gap, hop) << "at " << solves[k];
      // Half of what is there, as long as that is less than a hop.
      if (solves[k - 1] >= 2 * hop || solves[k - 1] >= 2 * setting.window) {
        ASSERT_EQ(gap, hop) << "at " << solves[k];
      } else {
        ASSERT_EQ(gap, std::clamp(solves[k - 1] / 2, 1, hop)) << "at " << solves[k];
      }
    }
    EXPECT_LT(frames_of(setting) - solves.back(), hop);
  });
}

TEST(LivePlan, GroupsTakeInEveryFrameOnce) {
  for_every_setting([](const Setting& setting) {
    LivePlan schedule = schedule_of(setting);
    int64_t taken = 0;
    for (int frame = 1; frame <= frames_of(setting); ++frame) {
      const LivePlan::Step step = schedule.next();
      ASSERT_EQ(schedule.frames(), frame);
      ASSERT_GE(step.group, 0);
      ASSERT_LE(step.group, 16) << "a register tile's rows, at " << frame;
      ASSERT_LE(step.group, setting.window);
      taken += step.group;
      // A group is made of the newest frames.
      if (step.group > 0) {
        ASSERT_EQ(taken, frame);
      }
      if (step.solve) {
        ASSERT_EQ(taken, frame) << "a solve sees its last frame";
      }
    }
  });
}

TEST(LivePlan, ASlicedGroupIsOverBeforeTheNext) {
  for_every_setting([](const Setting& setting) {
    LivePlan schedule = schedule_of(setting);
    int free_from = 1;
    for (int frame = 1; frame <= frames_of(setting); ++frame) {
      const LivePlan::Step step = schedule.next();
      if (step.group == 0) continue;
      ASSERT_GE(frame, free_from) << "the group before is still under way";
      ASSERT_GE(step.gram_slices, 1);
      ASSERT_LE(step.gram_slices, 16);
      free_from = frame + step.gram_slices;
    }
  });
}

// LiveSchedule's order of work: in each frame first a slice of pictures, then a slice of products;
// the decomposition comes with the last of these.
TEST(LivePlan, PicturesAreOverBeforeTheNextDecomposition) {
  for_every_setting([](const Setting& setting) {
    LivePlan schedule = schedule_of(setting);
    int build_left = 0, gram_left = 0, build_slices = 0, solves = 0, published = 0;
    bool solve = false;
    for (int frame = 1; frame <= frames_of(setting); ++frame) {
      const LivePlan::Step step = schedule.next();
      if (step.group > 0) {
        gram_left = step.gram_slices;
        solve = step.solve;
        build_slices = step.build_slices;
      }
      if (build_left > 0 && --build_left == 0) ++published;
      if (gram_left > 0 && --gram_left == 0 && solve) {
        ASSERT_EQ(build_left, 0) << "frame " << frame << " would drop a solve";
        ASSERT_GE(build_slices, 1);
        ASSERT_LE(build_slices, schedule.hop_size());
        build_left = build_slices;
        ++solves;
      }
    }
    EXPECT_GE(published, solves - 1);
    EXPECT_GT(published, 0);
  });
}

// The engine's ring has the window and most_late_frames(): a solve's oldest frame must not be
// dropped before its pictures are done.
TEST(LivePlan, FramesOfASolveStayInTheRing) {
  for_every_setting([](const Setting& setting) {
    LivePlan schedule = schedule_of(setting);
    const int64_t capacity = setting.window + schedule.most_late_frames();
    ASSERT_EQ(schedule.at_once(), schedule.most_late_frames() == 0);
    for (int frame = 1; frame <= frames_of(setting); ++frame) {
      const LivePlan::Step step = schedule.next();
      if (step.group == 0 || schedule.at_once()) continue;
      // The last slice of pictures runs beside this frame.
      const int64_t last = frame + step.gram_slices - 1 + (step.solve ? step.build_slices : 0);
      const int64_t oldest = frame - std::min<int64_t>(frame, setting.window) + 1;
      ASSERT_LE(last - oldest + 1, capacity)
          << "the solve of frame " << frame << " needs its frames until " << last;
    }
  });
}

TEST(LivePlan, WhatIsSmallIsDoneAtOnce) {
  // A slice is 32 MiB of the window.
  EXPECT_TRUE(LivePlan(32, 8, kMega).at_once());
  EXPECT_FALSE(LivePlan(33, 8, kMega).at_once());
  EXPECT_FALSE(LivePlan(32, 8, kMega + 64).at_once());
  for_every_setting([](const Setting& setting) {
    LivePlan schedule = schedule_of(setting);
    if (!schedule.at_once()) return;
    for (int frame = 1; frame <= frames_of(setting); ++frame) {
      const LivePlan::Step step = schedule.next();
      ASSERT_EQ(step.gram_slices, 1);
      ASSERT_EQ(step.build_slices, 1);
    }
  });
}

TEST(LivePlan, ASolveInOnePieceIsDueSoonerWhereFramesAreSmall) {
  EXPECT_EQ(LivePlan::piece_frames(1, 0), 4);
  EXPECT_EQ(LivePlan::piece_frames(320 * 240, 0.015), 5);
  EXPECT_EQ(LivePlan::piece_frames(640 * 480, 0.015), 19);
  EXPECT_EQ(LivePlan::piece_frames(768 * 576, 0.015), 24);
  EXPECT_EQ(LivePlan::piece_frames(uint64_t{1} << 36, 0.015), 24);
  // Long windows, and more iterations, are more work for each of them.
  EXPECT_EQ(LivePlan::piece_frames(320 * 240, 0.03), 10);
  EXPECT_EQ(LivePlan::piece_frames(320 * 240, 0.085), 24);
  EXPECT_EQ(LivePlan::piece_frames(1, 1e9), 24);
  for (int frames : {4, 19, 24, 60}) {
    LivePlan plan(100, 25, 64, frames);
    EXPECT_TRUE(plan.in_one_piece());
    EXPECT_EQ(plan.most_late_frames(), std::min(frames, 25) - 1);
    plan.restart(1);
    for (int frame = 1; frame <= 500; ++frame) {
      const LivePlan::Step step = plan.next();
      if (step.solve && frame > 100) {
        ASSERT_EQ(step.build_slices, std::min(frames, 25));
      }
    }
  }
}

TEST(LivePlan, NoFrameReadsMuchMoreThanItsShare) {
  for_every_setting([](const Setting& setting) {
    LivePlan schedule = schedule_of(setting);
    const uint64_t whole = setting.bytes * static_cast<uint64_t>(setting.window);
    for (int frame = 1; frame <= frames_of(setting); ++frame) {
      const LivePlan::Step step = schedule.next();
      if (step.group == 0 || frame < 4 * setting.window) continue;
      // 32 MiB, or a sixteenth of the window, or as many slices as there are frames to the next.
      const auto slices = static_cast<uint64_t>(step.gram_slices);
      ASSERT_TRUE(whole / slices <= 32 * kMega || slices == 16 ||
                  step.gram_slices >= std::min(schedule.hop_size(), 8))
          << step.gram_slices << " slices at frame " << frame;
    }
  });
}

}  // namespace
}  // namespace qdmd::test
