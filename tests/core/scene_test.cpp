// SPDX-License-Identifier: LGPL-2.1-or-later
// What holds for every scene: the same bytes however a frame is reached, true truth, any size.
#include "core/scene/scene.h"

#include <algorithm>
#include <limits>
#include <random>
#include <stdexcept>

#include "tests/core/scene_util.h"

namespace qdmd::test {
namespace {

using scene::Scene;

struct Size {
  int width, height;
};

constexpr Size kSizes[] = {{1, 1}, {2, 3}, {17, 9}, {64, 48}};

// ---- Determinism ----

TEST(Scene, TheSeedDecidesTheBytes) {
  for (const auto& name : scene_names()) {
    Scene a(options(64, 48, 25, 7), name), again(options(64, 48, 25, 7), name),
        other(options(64, 48, 25, 8), name);
    for (const int64_t k : {0, 61, 170}) {
      const Shot shot = shoot(&a, k);
      EXPECT_TRUE(shot == shoot(&again, k)) << name << " frame " << k;
      const Shot different = shoot(&other, k);
      EXPECT_NE(shot.frame, different.frame) << name << " frame " << k;
      EXPECT_NE(shot.background, different.background) << name << " frame " << k;
    }
  }
}

TEST(Scene, SeekingEqualsPlaying) {
  // Two frames a second: 10 s, in which bags and vans come and go and lamps are switched.
  constexpr size_t kFrames = 20;
  std::mt19937 rng(11);
  for (const Size& size : kSizes)
    for (const auto& name : scene_names()) {
      const auto how = options(size.width, size.height, 2);
      Scene played(how, name);
      std::vector<Shot> shots;
      for (size_t k = 0; k < kFrames; ++k) shots.push_back(shoot(&played, static_cast<int64_t>(k)));
      std::vector<size_t> order(kFrames);
      for (size_t k = 0; k < kFrames; ++k) order[k] = k;
      std::shuffle(order.begin(), order.end(), rng);
      Scene sought(how, name);
      for (const size_t k : order) {
        EXPECT_TRUE(shoot(&sought, static_cast<int64_t>(k)) == shots[k])
            << name << ' ' << size.width << 'x' << size.height << " frame " << k;
        // A scene that has never made another frame.
        if (k % 7 == 0) {
          Scene fresh(how, name);
          EXPECT_TRUE(shoot(&fresh, static_cast<int64_t>(k)) == shots[k])
              << name << ' ' << size.width << 'x' << size.height << " first frame " << k;
        }
      }
    }
}

TEST(Scene, AskingForLessGivesTheSameBytes) {
  auto names = scene_names();
  names.insert(names.end(), {"shadow,motion-blur", "shadow,jitter,defocus",
                             "shadow,motion-blur,jitter,defocus,remove,leaves,noise"});
  for (const auto& name : names) {
    const auto how = options(33, 24, 3);
    Scene full(how, name), partial(how, name);
    for (int64_t k = 0; k < 24; ++k) {
      const Shot all = shoot(&full, k);
      // One scene is asked for one thing after the other: nothing of the last call may be left.
      for (const unsigned wanted : {scene::kLabels, scene::kFrame, scene::kTruth, scene::kBoxes}) {
        Shot expected = all;
        if (wanted != scene::kFrame) expected.frame.clear();
        if (wanted != scene::kTruth) expected.background.clear();
        if (wanted != scene::kLabels) expected.labels.clear();
        if (wanted != scene::kBoxes) expected.boxes.clear();
        EXPECT_TRUE(shoot(&partial, k, wanted) == expected)
            << name << " frame " << k << " asked for " << wanted;
      }
    }
  }
}

// ---- Truth ----

bool keeps_background(const std::vector<scene::NamedEffect>& effects) {
  return std::none_of(effects.begin(), effects.end(), [](const scene::NamedEffect& effect) {
    return effect.info->stages & (scene::kAir | scene::kSensor | scene::kLink);
  });
}

TEST(Scene, FrameIsBackgroundWhereTheLabelIsZero) {
  std::vector<std::string> names = scene_names();
  names.insert(names.end(),
               {"shadow,motion-blur=1,jitter=3,defocus=2,fade,bands,exposure",
                "leaves,water,flicker,shadow,abandon,bootstrap,jitter,light-switch",
                "clutter,remove,stop=2,camouflage,motion-blur,defocus",
                "trees=0.5,remove,shadow=0.7:softness=3,mirror,motion-blur,jitter,defocus",
                "shadow=1:length=3"});
  int scenes = 0;
  for (const auto& name : names) {
    const auto effects = scene::parse_scene(name);
    if (!keeps_background(effects)) continue;
    ++scenes;
    for (const Size& size : kSizes) {
      Scene scene(options(size.width, size.height, 5), effects);
      size_t wrong = 0, unlike = 0;
      for (int64_t k = 0; k < 60; ++k) {
        const Shot shot = shoot(&scene, k);
        ASSERT_EQ(shot.frame.size(), shot.labels.size() * 3);
        ASSERT_EQ(shot.background.size(), shot.frame.size());
        for (size_t i = 0; i < shot.labels.size(); ++i) {
          const uint8_t label = shot.labels[i];
          wrong += label != scene::kBackgroundLabel && label != scene::kShadowLabel &&
                   label != scene::kPartLabel && label != scene::kObjectLabel;
          if (label != scene::kBackgroundLabel) continue;
          for (size_t c = 0; c < 3; ++c)
            unlike += shot.frame[3 * i + c] != shot.background[3 * i + c];
        }
      }
      EXPECT_EQ(wrong, 0u) << name;
      EXPECT_EQ(unlike, 0u) << name << ' ' << size.width << 'x' << size.height;
    }
  }
  EXPECT_GE(scenes, 20);
}

TEST(Scene, TheMoverIsSeenAgainstTheBackground) {
  Scene scene(options(160, 120), "default");
  size_t objects = 0, same = 0, other_labels = 0;
  for (int64_t k = 0; k < 500; k += 5) {
    const Shot shot = shoot(&scene, k);
    for (size_t i = 0; i < shot.labels.size(); ++i) {
      other_labels += shot.labels[i] != 0 && shot.labels[i] != scene::kObjectLabel;
      if (shot.labels[i] != scene::kObjectLabel) continue;
      ++objects;
      same += std::equal(&shot.frame[3 * i], &shot.frame[3 * i] + 3, &shot.background[3 * i]);
    }
  }
  EXPECT_EQ(other_labels, 0u);
  EXPECT_GT(objects, 30000u);
  // Two unrelated colours out of some ten thousand: one in a hundred would be far too many.
  EXPECT_LT(same, objects / 100);
}

// The smallest box around the labels of objects.
scene::Box bounds(const std::vector<uint8_t>& labels, int width) {
  int left = width, right = 0, top = std::numeric_limits<int>::max(), bottom = 0;
  for (size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] < scene::kPartLabel) continue;
    const int x = static_cast<int>(i) % width, y = static_cast<int>(i) / width;
    left = std::min(left, x), right = std::max(right, x + 1);
    top = std::min(top, y), bottom = y + 1;
  }
  return right > left ? scene::Box{left, top, right - left, bottom - top} : scene::Box{};
}

TEST(Scene, BoxesFitTheLabels) {
  for (const char* name : {"default", "jitter=2", "camouflage", "shadow"}) {
    Scene scene(options(160, 120), name);
    int seen = 0;
    for (int64_t k = 0; k < 500; ++k) {
      const Shot shot = shoot(&scene, k);
      const scene::Box box = bounds(shot.labels, 160);
      // The picture falls in steps of 1/256 pixel: nearer than that the box may be one wider.
      const auto near_whole = [](double shift) {
        return shift != 0 && std::abs(shift - std::round(shift)) <= 1.0 / 256;
      };
      if (near_whole(shot.shift_x) || near_whole(shot.shift_y)) continue;
      if (shot.boxes.empty()) {
        EXPECT_TRUE(box.empty()) << name << " frame " << k;
        continue;
      }
      ASSERT_EQ(shot.boxes.size(), 1u) << name;
      // The part of a figure that is in view may be smaller than its box there.
      if (shot.boxes[0].x > 0 && shot.boxes[0].right() < 160) {
        EXPECT_EQ(shot.boxes[0], box) << name << " frame " << k;
        ++seen;
      } else {
        EXPECT_EQ(scene::intersection(shot.boxes[0], box), box) << name << " frame " << k;
      }
    }
    EXPECT_GT(seen, 200) << name;
  }
}

// Boxes are those of sharp figures: a lens out of focus smears the rim of one that stands outside
// into the frame, where it has labels but no box.
TEST(Scene, WhateverIsSeenOfASharpObjectHasABox) {
  Scene sharp(options(160, 120), "default"), blurred(options(160, 120), "defocus=4");
  for (int64_t k = 0; k < 500; ++k) {
    const Shot shot = shoot(&sharp, k);
    EXPECT_TRUE(!shot.boxes.empty() || bounds(shot.labels, 160).empty()) << k;
    EXPECT_EQ(shoot(&blurred, k).boxes, shot.boxes) << k;
  }
}

// ---- Sizes, ends of ranges, options ----

TEST(Scene, EveryShapeOfFrame) {
  for (const Size& size :
       {Size{1, 1}, Size{1, 2}, Size{2, 1}, Size{3, 3}, Size{1, 300}, Size{300, 1}, Size{5, 200}})
    for (const auto& name : scene_names()) {
      Scene scene(options(size.width, size.height, 3), name);
      EXPECT_EQ(scene.width(), size.width);
      EXPECT_EQ(scene.height(), size.height);
      const auto pixels = static_cast<size_t>(size.width) * static_cast<size_t>(size.height);
      for (const int64_t k : {0, 7, 20, 1000003}) {
        const Shot shot = shoot(&scene, k);
        EXPECT_EQ(shot.frame.size(), 3 * pixels) << name;
        EXPECT_EQ(shot.background.size(), 3 * pixels) << name;
        EXPECT_EQ(shot.labels.size(), pixels) << name;
        for (const scene::Box& box : shot.boxes) {
          EXPECT_FALSE(box.empty()) << name;
          EXPECT_EQ(scene::intersection(box, {0, 0, size.width, size.height}), box) << name;
        }
      }
    }
}

TEST(Scene, EveryParameterAtTheEndsOfItsRange) {
  for (const scene::EffectInfo* info : scene::effects())
    for (size_t p = 0; p < info->parameters.size(); ++p)
      for (const double value : {info->parameters[p].minimum, info->parameters[p].maximum}) {
        scene::NamedEffect effect{info, {}};
        for (const auto& parameter : info->parameters) effect.values.push_back(parameter.standard);
        effect.values[p] = value;
        Scene scene(options(16, 12), {effect});
        for (const int64_t k : {0, 3, 9}) {
          const Shot shot = shoot(&scene, k);
          EXPECT_EQ(shot.frame.size(), 16u * 12 * 3) << info->name;
          if (!keeps_background({effect})) continue;
          size_t unlike = 0;
          for (size_t i = 0; i < shot.frame.size(); ++i)
            unlike += shot.labels[i / 3] == scene::kBackgroundLabel &&
                      shot.frame[i] != shot.background[i];
          EXPECT_EQ(unlike, 0u) << info->name << ' ' << info->parameters[p].name << '=' << value;
        }
      }
}

TEST(Scene, RefusesOptionsOutOfRange) {
  const auto refused = [](int width, int height, double rate, const char* word) {
    try {
      Scene scene(options(width, height, rate), "default");
      ADD_FAILURE() << width << 'x' << height << ' ' << rate;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  for (const int side : {0, -1, 16385, std::numeric_limits<int>::max()}) {
    refused(side, 8, 25, "16384");
    refused(8, side, 25, "16384");
  }
  for (const double rate :
       {0.0, -1.0, 9e-4, 1.1e6, std::nan(""), std::numeric_limits<double>::infinity()})
    refused(8, 8, rate, "frames_per_second");
  for (const double rate : {1e-3, 1e6}) EXPECT_NO_THROW(Scene(options(8, 8, rate), "default"));
  EXPECT_NO_THROW(Scene(options(16384, 1), "default").render(3, kEverything));
  EXPECT_NO_THROW(Scene(options(1, 2000), "default").render(3, kEverything));
}

TEST(Scene, LengthIsReported) {
  EXPECT_EQ(Scene(options(4, 3), "default").length(), 0);
  EXPECT_EQ(Scene(options(4, 3), "length").length(), 100);
  EXPECT_EQ(Scene(options(4, 3), "length=1e9").length(), 1000000000);
  EXPECT_EQ(Scene(options(4, 3), "very-long").length(), 20000);
  EXPECT_EQ(Scene(options(4, 3), "very-short").length(), 10);
}

}  // namespace
}  // namespace qdmd::test
