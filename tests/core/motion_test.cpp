// SPDX-License-Identifier: LGPL-2.1-or-later
// How a camera moved, against the simulator's truth.
#include <algorithm>
#include <numbers>
#include <random>
#include <utility>

#include "core/align/stabilizer.h"
#include "tests/core/scene_util.h"

namespace qdmd::test {
namespace {

using scene::Scene;

constexpr int kWidth = 320, kHeight = 240;

std::vector<uint8_t> grey_of(const Scene& scene) {
  std::vector<uint8_t> grey(scene.frame().samples.size() / 3);
  for (size_t i = 0; i < grey.size(); ++i) grey[i] = scene.frame().samples[3 * i + 1];
  return grey;
}
Pose truth_of(const Scene& scene) { return {scene.shift_x(), scene.shift_y(), scene.turn(), 1}; }

TEST(Pose, PutsTogetherAndTakesBack) {
  const Point middle = middle_of(kWidth, kHeight);
  const Pose a = {3, -2, 0.02, 1.01}, b = {-7, 1.5, -0.03, 0.99};
  const auto near = [](Point p, Point q) {
    return std::hypot(p.x - q.x, p.y - q.y) < 1e-10 * kWidth;
  };
  for (const Point p : {Point{0, 0}, Point{319, 17}, Point{160, 239}}) {
    const Point inner = affine(b, middle)(p.x, p.y);
    EXPECT_TRUE(near(affine(compose(a, b), middle)(p.x, p.y), affine(a, middle)(inner.x, inner.y)));
    const Point there = affine(a, middle)(p.x, p.y);
    EXPECT_TRUE(near(affine(inverse(a), middle)(there.x, there.y), p));
  }
  EXPECT_TRUE(Pose().is_rest());
  EXPECT_DOUBLE_EQ(largest_way({3, 4, 0, 1}, {}, kWidth, kHeight), 5);
}

// The errors of frames 1 .. count - 1 compared with frame 0, sorted. The reference's own fraction
// of a pixel, which is blurred into it, is the same in all and no motion: the mean error is taken
// out.
struct Tracked {
  std::vector<double> errors;
  double most = 0;  // pixels from rest
  int lost = 0;
};
Tracked track(const std::string& text, int frames, bool turns, int width = kWidth,
              int height = kHeight) {
  Scene scene(options(width, height), text);
  MotionFinder finder(width, height);
  Tracked tracked;
  std::vector<Pose> found, truth;
  Pose before, first;
  for (int t = 0; t < frames; ++t) {
    scene.render(t, scene::kFrame);
    const std::vector<uint8_t> grey = grey_of(scene);
    if (t == 0) {
      finder.take_reference(grey.data(), {});
      first = truth_of(scene);
      continue;
    }
    const Motion motion = finder.find(grey.data(), before, Pose(), turns);
    tracked.lost += motion.found ? 0 : 1;
    before = motion.pose;
    tracked.most = std::max(tracked.most, largest_way(before, {}, width, height));
    found.push_back(before);
    truth.push_back(compose(inverse(first), truth_of(scene)));
  }
  Point mean;
  for (size_t i = 0; i < found.size(); ++i) {
    mean.x += (found[i].x - truth[i].x) / static_cast<double>(found.size());
    mean.y += (found[i].y - truth[i].y) / static_cast<double>(found.size());
  }
  for (size_t i = 0; i < found.size(); ++i) {
    Pose right = truth[i];
    right.x += mean.x;
    right.y += mean.y;
    tracked.errors.push_back(turns ? largest_way(found[i], right, width, height)
                                   : std::hypot(found[i].x - right.x, found[i].y - right.y));
  }
  std::sort(tracked.errors.begin(), tracked.errors.end());
  return tracked;
}
double at_95(const Tracked& tracked) { return tracked.errors[tracked.errors.size() * 95 / 100]; }

TEST(Motion, OfACameraThatShakesIsWithinATenthOfAPixel) {
  for (const char* text : {"basic,jitter=2", "basic,jitter=5", "basic,bootstrap,jitter=2",
                           "basic,fade,jitter=2", "camera-jitter"}) {
    const Tracked tracked = track(text, 120, false);
    EXPECT_LT(at_95(tracked), 0.1) << text;
    EXPECT_GT(tracked.most, 2) << text;
    EXPECT_EQ(tracked.lost, 0) << text;
  }
  for (const auto& [width, height] : {std::pair{64, 48}, {160, 120}, {768, 576}})
    EXPECT_LT(at_95(track("basic,jitter=2", 40, false, width, height)), 0.1) << width;
}

TEST(Motion, OfACameraThatTurnsToo) {
  const Tracked tracked = track("basic,jitter=2:rotation=1", 120, true);
  // At the corners of the picture.
  EXPECT_LT(at_95(tracked), 0.15);
  EXPECT_EQ(tracked.lost, 0);
}

TEST(Motion, OfACameraThatStandsStillIsNone) {
  for (const char* text :
       {"basic", "basic,bootstrap", "basic,clutter", "basic,clutter=0.95", "intermittent-motion",
        "background-motion", "illumination-changes", "dynamic-background", "basic,night",
        "basic,rain", "basic,snow", "basic,water"})
    EXPECT_EQ(track(text, 150, false).most, 0) << text;
}

// A camera in the sun: what is too bright grows and shrinks with the exposure, and nothing moves.
TEST(Motion, IsNotThatOfTheExposure) {
  for (const auto& [seed, mean] : {std::pair{1, 2.6}, {3, 2.6}, {4, 2.0}, {2, 4.0}}) {
    Scene scene(options(kWidth, kHeight, 25, seed), "basic");
    MotionFinder finder(kWidth, kHeight);
    Pose before;
    for (int t = 0; t < 300; ++t) {
      scene.render(t, scene::kFrame);
      std::vector<uint8_t> grey = grey_of(scene);
      const double exposure =
          mean * (1 + 0.25 * std::sin(2 * std::numbers::pi * static_cast<double>(t) / 100));
      for (uint8_t& sample : grey)
        sample = static_cast<uint8_t>(std::min(255.0, std::round(exposure * sample)));
      if (t == 0) {
        finder.take_reference(grey.data(), {});
        continue;
      }
      before = finder.find(grey.data(), before, Pose(), false).pose;
      EXPECT_TRUE(before.is_rest()) << seed << ", " << t << ": " << before.x << " " << before.y;
    }
  }
}

// A bus that fills half of the picture and drives on.
TEST(Motion, IsNotThatOfABusBeforeTheCamera) {
  Scene scene(options(kWidth, kHeight), "basic"),
      shaken(options(kWidth, kHeight), "basic,jitter=2");
  Scene bus(options(kWidth, kHeight, 25, 99), "basic");
  bus.render(0, scene::kFrame);
  const std::vector<uint8_t> texture = grey_of(bus);
  const auto drive_by = [&](int t, double share, std::vector<uint8_t>* grey) {
    const int first = static_cast<int>(kHeight * (1 - share));
    for (int y = first; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        (*grey)[static_cast<size_t>(y * kWidth + x)] =
            texture[static_cast<size_t>((kHeight - 1 - y) * kWidth + (x + 5 * t) % kWidth)];
  };
  MotionFinder still(kWidth, kHeight), moving(kWidth, kHeight);
  Pose before, first;
  std::vector<double> errors;
  for (int t = 0; t < 60; ++t) {
    scene.render(t, scene::kFrame);
    shaken.render(t, scene::kFrame);
    std::vector<uint8_t> grey = grey_of(scene), of_shaken = grey_of(shaken);
    if (t == 0) {
      still.take_reference(grey.data(), {});
      moving.take_reference(of_shaken.data(), {});
      first = truth_of(shaken);
      continue;
    }
    if (t > 10) drive_by(t, 0.5, &grey), drive_by(t, 0.4, &of_shaken);
    EXPECT_TRUE(still.find(grey.data(), {}, {}, false).pose.is_rest()) << t;
    before = moving.find(of_shaken.data(), before, {}, false).pose;
    const Pose truth = compose(inverse(first), truth_of(shaken));
    errors.push_back(std::hypot(before.x - truth.x, before.y - truth.y));
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() * 9 / 10], 0.2);
}

// A box that walks along a bare wall is all that has edges.
TEST(Motion, IsNotThatOfAllThereIsToSee) {
  const auto wall = [](int t) {
    std::vector<uint8_t> grey(size_t{kWidth} * kHeight);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const int left = 100 + 2 * t;
        const bool box = x >= left && x < left + 60 && y >= 80 && y < 160;
        grey[static_cast<size_t>(y * kWidth + x)] =
            static_cast<uint8_t>(box ? 30 + 90 * ((x - left) / 6 % 2) : 100 + x / 4);
      }
    return grey;
  };
  MotionFinder finder(kWidth, kHeight);
  finder.take_reference(wall(0).data(), {});
  for (int t = 0; t < 12; ++t)
    EXPECT_TRUE(finder.find(wall(t).data(), {}, {}, false).pose.is_rest()) << t;
}

TEST(Motion, OfAnythingIsSomething) {
  std::mt19937 rng(3);
  for (const auto& [width, height] :
       {std::pair{1, 1}, {2, 2}, {7, 6}, {8, 8}, {320, 1}, {1, 240}}) {
    const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
    std::vector<uint8_t> black(pixels, 0), noise(pixels);
    for (auto& sample : noise) sample = static_cast<uint8_t>(rng() >> 13);
    for (const bool turns : {false, true}) {
      MotionFinder finder(width, height);
      for (const auto* reference : {&black, &noise}) {
        finder.take_reference(reference->data(), {});
        for (const auto* frame : {&black, &noise}) {
          const Motion motion = finder.find(frame->data(), {}, {}, turns);
          EXPECT_TRUE(std::isfinite(motion.pose.x) && std::isfinite(motion.pose.y));
        }
      }
    }
  }
}

TEST(Stabilizer, FollowsADriftAndThenBeginsAnotherView) {
  Scene scene(options(160, 120), "noise,jitter=0:drift=12:way=100");
  Stabilizer stabilizer(Stabilize::translation, Colours::rgb, 160, 120);
  double most = 0;
  Point canvas;
  Pose before;
  for (int t = 0; t < 120; ++t) {
    scene.render(t, scene::kFrame);
    const Pose pose = stabilizer.follow(grey_of(scene).data(), {});
    canvas.x += stabilizer.canvas_moved().x;
    canvas.y += stabilizer.canvas_moved().y;
    // A frame that shows too little of the scene has the pose of the one before it.
    const bool followed = pose != std::exchange(before, pose);
    if (stabilizer.views() == 0 && followed && pose != Pose()) {
      EXPECT_NEAR(pose.x, scene.shift_x() - canvas.x, 0.15) << t;
      EXPECT_NEAR(pose.y, scene.shift_y() - canvas.y, 0.15) << t;
    }
    most = std::max(most, std::hypot(pose.x, pose.y));
  }
  // An eighth of 160 pixels.
  EXPECT_GT(most, 17);
  EXPECT_LE(most, 20);
  EXPECT_GE(stabilizer.views(), 1u);
}

}  // namespace
}  // namespace qdmd::test
