// SPDX-License-Identifier: LGPL-2.1-or-later
// What objects do to the ground: the soft edge of a shadow, and a floor that mirrors.
#include <algorithm>

#include "tests/core/scene_util.h"

namespace qdmd::test {
namespace {

using scene::Box;
using scene::Scene;

constexpr int kWidth = 160, kHeight = 120;

uint8_t label_at(const Shot& shot, int x, int y) {
  return shot.labels[static_cast<size_t>(y * kWidth + x)];
}

const uint8_t* at(const std::vector<uint8_t>& picture, int x, int y) {
  return &picture[static_cast<size_t>(y * kWidth + x) * 3];
}

// ---- Soft shadows ----

// The share of a square around a pixel on which a hard shadow falls; less than 0 where an object or
// the frame's edge hides a part of the square.
double shade(const Shot& hard, int x, int y, int softness) {
  int dark = 0;
  for (int v = y - softness; v <= y + softness; ++v)
    for (int u = x - softness; u <= x + softness; ++u) {
      if (u < 0 || u >= kWidth || v < 0 || v >= kHeight) return -1;
      const uint8_t label = label_at(hard, u, v);
      if (label != scene::kBackgroundLabel && label != scene::kShadowLabel) return -1;
      dark += label == scene::kShadowLabel;
    }
  const int side = 2 * softness + 1;
  return static_cast<double>(dark) / (side * side);
}

TEST(SceneSoftShadow, FadesOverItsSoftness) {
  constexpr double kDepth = 0.65;
  for (const int softness : {1, 3, 8}) {
    const std::string text = "bootstrap=5,shadow=0.65:length=1.2";
    Scene hard(options(kWidth, kHeight), text),
        soft(options(kWidth, kHeight), text + ":softness=" + std::to_string(softness));
    int edges = 0, cores = 0;
    for (int64_t k = 0; k < 50; k += 5) {
      const Shot sharp = shoot(&hard, k), faded = shoot(&soft, k);
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const double share = shade(sharp, x, y, softness);
          if (share < 0) continue;
          edges += share > 0 && share < 1, cores += share == 1;
          // The share is rounded to 1/255 first.
          const bool dark = share * 255 >= 0.5;
          ASSERT_EQ(label_at(faded, x, y), dark ? scene::kShadowLabel : scene::kBackgroundLabel);
          for (int c = 0; c < 3; ++c) {
            const double bright = at(faded.background, x, y)[c];
            ASSERT_NEAR(at(faded.frame, x, y)[c], bright * (1 - kDepth * share),
                        0.5 + bright * kDepth * 0.5 / 255 + 1e-9)
                << softness << " frame " << k << " at " << x << ", " << y;
          }
        }
    }
    EXPECT_GT(edges, 3000) << softness;
    // A person's shadow is hardly 7 pixels wide.
    EXPECT_GT(cores, softness == 1 ? 300 : -1) << softness;
  }
}

// Shadows fall from outside into the frame: a canvas that is larger sees no more of them.
TEST(SceneSoftShadow, FadesBeyondTheFrameAsInIt) {
  const std::string text = "shadow:length=1:softness=6,bootstrap=5";
  // A blur of no width on a canvas with a margin.
  Scene narrow(options(kWidth, kHeight), text),
      wide(options(kWidth, kHeight), text + ",defocus=0.001");
  int seen = 0;
  for (int64_t k = 0; k < 300; k += 5) {
    const Shot a = shoot(&narrow, k), b = shoot(&wide, k);
    EXPECT_EQ(a.frame, b.frame) << k;
    for (int y = 0; y < kHeight; ++y) seen += label_at(a, kWidth - 1, y) == scene::kShadowLabel;
  }
  EXPECT_GT(seen, 50);
}

// ---- The mirror ----

TEST(SceneMirror, ShowsWhoStandsOnTheFloorUpsideDown) {
  for (const auto& [strength, reach] : {std::pair{0.35, 0.8}, {1.0, 1.0}, {0.1, 0.3}}) {
    Scene scene(options(kWidth, kHeight),
                "mirror=" + std::to_string(strength) + ":reach=" + std::to_string(reach)),
        plain(options(kWidth, kHeight), "default");
    int mirrored = 0, marked = 0, expected_marks = 0;
    for (int64_t k = 20; k < 100; k += 4) {
      const Shot shot = shoot(&scene, k), none = shoot(&plain, k);
      EXPECT_EQ(shot.background, none.background);
      EXPECT_EQ(shot.boxes, none.boxes);
      ASSERT_EQ(none.boxes.size(), 1u);
      const Box box = none.boxes[0];
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          marked += label_at(shot, x, y) == scene::kShadowLabel;
          const int below = y - box.bottom(), from = box.bottom() - 1 - below;
          if (below < 0 || from < 0 || label_at(none, x, from) != scene::kObjectLabel) continue;
          const double share = strength * (1 - (below + 0.5) / (reach * box.height));
          // Rounded to 1/256; what is near the end may be either.
          if (share < 0.6 / 256) continue;
          ++expected_marks;
          ASSERT_EQ(label_at(shot, x, y), scene::kShadowLabel) << k;
          for (int c = 0; c < 3; ++c) {
            const double floor = at(none.frame, x, y)[c], image = at(none.frame, x, from)[c];
            ASSERT_NEAR(at(shot.frame, x, y)[c], floor + share * (image - floor), 1 + 1e-9) << k;
            mirrored += std::abs(at(shot.frame, x, y)[c] - floor) > 5;
          }
        }
    }
    // Nothing else is marked, but a row at the end.
    EXPECT_GT(expected_marks, 1000);
    EXPECT_LE(marked, expected_marks + 20 * 30);
    EXPECT_GE(marked, expected_marks);
    EXPECT_GT(mirrored, 500) << strength;
  }
}

TEST(SceneMirror, AShadowLiesOnTheFloorThatMirrors) {
  Scene both(options(kWidth, kHeight), "mirror=0.5:reach=1,shadow,bootstrap=4"),
      shadow(options(kWidth, kHeight), "shadow,bootstrap=4"),
      mirror(options(kWidth, kHeight), "mirror=0.5:reach=1,bootstrap=4");
  size_t together = 0;
  for (int64_t k = 0; k < 100; k += 5) {
    const Shot a = shoot(&both, k), b = shoot(&shadow, k), c = shoot(&mirror, k);
    for (size_t i = 0; i < a.labels.size(); ++i) {
      ASSERT_EQ(a.labels[i], std::max(b.labels[i], c.labels[i])) << k;
      if (a.labels[i] != scene::kShadowLabel) continue;
      // What is only one of the two is as without the other.
      if (b.labels[i] == 0)
        ASSERT_TRUE(std::equal(&a.frame[3 * i], &a.frame[3 * i] + 3, &c.frame[3 * i])) << k;
      else if (c.labels[i] == 0)
        ASSERT_TRUE(std::equal(&a.frame[3 * i], &a.frame[3 * i] + 3, &b.frame[3 * i])) << k;
      else
        ++together;
    }
  }
  EXPECT_GT(together, 20u);
}

}  // namespace
}  // namespace qdmd::test
