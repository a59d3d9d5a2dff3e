// SPDX-License-Identifier: LGPL-2.1-or-later
// Soft edges of masks: the filter against its definition, and what it makes of pictures.
#include "core/foreground/soft_mask.h"

#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/foreground/picture.h"
#include "tests/core/engine_util.h"
#include "tests/core/mask_util.h"
#include "tests/core/simd_targets.h"

namespace qdmd::test {
namespace {

constexpr Levels kVideoLevels = {{16, 128, 128}, {235, 128, 128}};

TEST(SoftMask, BytesOfTheLongestRowDoNotOverflow) {
  constexpr uint64_t kLongest = std::numeric_limits<int>::max();
  EXPECT_EQ(SoftMask::bytes(static_cast<int>(kLongest), 1),
            3 * kLongest + (kLongest + kSoftTile - 1) / kSoftTile);
}

// ---- The filter ----

// A picture that goes on as its border does.
struct Plane {
  int width, height;
  std::vector<double> samples;

  Plane(int w, int h) : width(w), height(h), samples(static_cast<size_t>(w * h)) {}
  double& at(int x, int y) {
    return samples[static_cast<size_t>(std::clamp(y, 0, height - 1) * width +
                                       std::clamp(x, 0, width - 1))];
  }
};

// He, Sun, Tang 2010 in double precision, by the definition; `guide` is halved, as the pass has it.
// Both have 2 softness more pixels on each side than what is returned.
std::vector<double> guided(Plane guide, Plane white, int softness, double smooth) {
  const int r = softness;
  Plane a(guide.width, guide.height), b = a;
  const auto mean = [r](Plane& plane, int x, int y, auto of) {
    double sum = 0;
    for (int dy = -r; dy <= r; ++dy)
      for (int dx = -r; dx <= r; ++dx) sum += of(plane, x + dx, y + dy);
    return sum / ((2 * r + 1) * (2 * r + 1));
  };
  const auto own = [](Plane& plane, int x, int y) { return plane.at(x, y); };
  const auto halved = [](Plane& plane, int x, int y) { return std::floor(plane.at(x, y) / 2); };
  const auto squared = [](Plane& plane, int x, int y) {
    return std::pow(std::floor(plane.at(x, y) / 2), 2);
  };
  const auto both = [&white](Plane& plane, int x, int y) {
    return std::floor(plane.at(x, y) / 2) * white.at(x, y);
  };
  for (int y = r; y < guide.height - r; ++y)
    for (int x = r; x < guide.width - r; ++x) {
      const double i = mean(guide, x, y, halved), p = mean(white, x, y, own);
      const double variance = mean(guide, x, y, squared) - i * i;
      a.at(x, y) = (mean(guide, x, y, both) - i * p) / (variance + smooth * smooth / 4);
      b.at(x, y) = p - a.at(x, y) * i;
    }
  std::vector<double> out;
  for (int y = 2 * r; y < guide.height - 2 * r; ++y)
    for (int x = 2 * r; x < guide.width - 2 * r; ++x)
      out.push_back(255 * std::clamp(mean(a, x, y, own) * halved(guide, x, y) + mean(b, x, y, own),
                                     0.0, 1.0));
  return out;
}

// Memory before inaccessible pages.
struct TileCase {
  int width, height, softness, halo;
  size_t stride;
  BeforeTheEdge<uint8_t> guide, white;

  TileCase(int w, int h, int softness_, std::mt19937& rng)
      : width(w),
        height(h),
        softness(softness_),
        halo(soft_halo(softness_)),
        stride(static_cast<size_t>(w + 2 * halo)),
        guide(stride * static_cast<size_t>(h + 2 * halo)),
        white(guide.size()) {
    // A ragged edge, noise, and in some cases nothing but extremes.
    const int extremes = static_cast<int>(rng() % 4);
    for (size_t p = 0; p < guide.size(); ++p) {
      const bool inside = p % stride > stride / 2 + rng() % 3;
      guide[p] = static_cast<uint8_t>(extremes == 0 ? (rng() % 2 ? 255 : 0)
                                                    : rng() % 40 + (inside ? 60 : 0));
      white[p] = (extremes == 1 ? rng() % 2 : inside) ? 255 : 0;
    }
  }
  std::vector<uint8_t> soften(float smooth) {
    BeforeTheEdge<uint8_t> out(static_cast<size_t>(width * height));
    soften_tile(guide.data(), white.data(), stride, width, height, softness, smooth, out.data(),
                static_cast<size_t>(width));
    return {out.begin(), out.end()};
  }
  std::vector<double> expected(double smooth) {
    Plane levels(static_cast<int>(stride), height + 2 * halo), mask = levels;
    for (size_t p = 0; p < guide.size(); ++p)
      levels.samples[p] = guide[p], mask.samples[p] = white[p] / 255;
    return guided(levels, mask, softness, smooth);
  }
};

TEST(SoftEdge, IsAGuidedFilterWithTheSameBitsEverywhere) {
  std::mt19937 rng(350);
  for (auto [width, height] : {std::pair{1, 1}, {64, 64}, {17, 3}, {2, 64}, {63, 40}})
    for (int softness : {1, 2, 3, 7, kMostSoftness})
      for (float smooth : {0.0f, 4.5f, 40.0f}) {
        TileCase tile(width, height, softness, rng);
        SCOPED_TRACE(testing::Message()
                     << width << "x" << height << " " << softness << " " << smooth);
        const auto expected = tile.expected(std::max(smooth, kLeastSmooth));
        std::vector<uint8_t> first;
        on_every_target([&] {
          const auto soft = tile.soften(smooth);
          if (first.empty()) first = soft;
          ASSERT_EQ(soft, first);
          // Lines are rounded to 1 / 65536, times 127 levels.
          for (size_t p = 0; p < soft.size(); ++p) ASSERT_NEAR(soft[p], expected[p], 1.01) << p;
        });
      }
}

TEST(SoftEdge, IsTheMaskWhereThereIsNoEdge) {
  std::mt19937 rng(351);
  for (int softness : {1, 4, kMostSoftness})
    for (uint8_t colour : {uint8_t{0}, uint8_t{255}}) {
      TileCase tile(64, 64, softness, rng);
      std::fill(tile.white.begin(), tile.white.end(), colour);
      EXPECT_FALSE(is_mixed(tile.white.data(), tile.stride, tile.stride, 64));
      for (uint8_t sample : tile.soften(10)) ASSERT_EQ(sample, colour);
      tile.white[63 * tile.stride + tile.stride - 1] ^= 255;
      EXPECT_TRUE(is_mixed(tile.white.data(), tile.stride, tile.stride, 64));
      EXPECT_FALSE(is_mixed(tile.white.data(), tile.stride, tile.stride - 1, 64));
      EXPECT_FALSE(is_mixed(tile.white.data(), tile.stride, tile.stride, 63));
    }
}

TEST(SoftEdge, FadesToBlack) {
  on_every_target([] {
    BeforeTheEdge<uint8_t> x(256), alpha(256), out(256);
    for (int black : {0, 16, 128, 255})
      for (int a = 0; a < 256; ++a) {
        std::iota(x.begin(), x.end(), uint8_t{0});
        std::fill(alpha.begin(), alpha.end(), static_cast<uint8_t>(a));
        fade(x.data(), alpha.data(), static_cast<uint8_t>(black), 256, out.data());
        for (int i = 0; i < 256; ++i)
          ASSERT_EQ(out[size_t(i)], std::lround((i * a + black * (255 - a)) / 255.0))
              << i << " " << a;
      }
  });
}

TEST(SoftEdge, SettlesWhereTheGuideDoesNotMove) {
  on_every_target([] {
    constexpr size_t kCount = 1000;
    std::mt19937 rng(353);
    BeforeTheEdge<uint8_t> soft(kCount), guide(kCount), known(kCount), alpha(kCount);
    for (int most : {1, 18, 255}) {
      for (size_t p = 0; p < kCount; ++p) {
        soft[p] = static_cast<uint8_t>(rng() % 5 ? rng() % 256 : p % 2 * 255);
        alpha[p] = static_cast<uint8_t>(rng() % 2 ? rng() % 256 : soft[p]);
        guide[p] = static_cast<uint8_t>(rng() % 256);
        known[p] = static_cast<uint8_t>(
            std::clamp<int>(guide[p] + static_cast<int>(rng() % 41) - 20, 0, 255));
      }
      const std::vector<uint8_t> alphas(alpha.begin(), alpha.end()),
          before(known.begin(), known.end());
      settle(soft.data(), guide.data(), most, kCount, known.data(), alpha.data());
      for (size_t p = 0; p < kCount; ++p) {
        const int away = before[p] - guide[p], left = alphas[p] - soft[p];
        const double known_stays =
            15.0 / 16 * std::clamp(2 - 2.0 * std::abs(away) / most, 0.0, 1.0);
        const bool whole = soft[p] == 0 || soft[p] == 255;
        const double far = whole ? 1 : std::clamp((std::abs(left) - 32) / 64.0, 0.0, 1.0);
        const double kept = known_stays * (1 - far / 2);
        // Weights are in 1/256, and what they weigh is rounded.
        ASSERT_NEAR(known[p], guide[p] + known_stays * away, 2) << p;
        ASSERT_NEAR(alpha[p], soft[p] + kept * left, 2.5) << p;
        if (kept == 0) {
          ASSERT_EQ(alpha[p], soft[p]);
          ASSERT_EQ(known[p], guide[p]);
        }
        if (2 * std::abs(away) < most && std::abs(left) <= 8 && !whole) {
          ASSERT_EQ(alpha[p], alphas[p]) << "noise moves nothing";
        }
      }
    }
    for (int t = 0; t < 100; ++t)
      settle(soft.data(), guide.data(), 18, kCount, known.data(), alpha.data());
    for (size_t p = 0; p < kCount; ++p) {
      ASSERT_EQ(known[p], guide[p]);
      ASSERT_NEAR(alpha[p], soft[p], soft[p] == 0 || soft[p] == 255 ? 0 : 8);
    }
  });
}

TEST(SoftEdge, KnowsAMaskThatMoved) {
  constexpr size_t kStride = 50, kWidth = 40, kHeight = 30;
  const auto box = [](size_t left) {
    std::vector<uint8_t> mask(kStride * kHeight);
    for (size_t y = 5; y < 25; ++y)
      std::fill_n(mask.begin() + y * kStride + left, 10, uint8_t{255});
    return mask;
  };
  on_every_target([&] {
    const auto moved = [&](size_t left) {
      return has_moved(box(left).data(), box(10).data(), kStride, kWidth, kHeight);
    };
    // The thing's outline has 60 pixels; each column that it moves by changes 40.
    EXPECT_FALSE(moved(10));
    EXPECT_FALSE(moved(13));
    EXPECT_TRUE(moved(14));
    EXPECT_TRUE(moved(22));
    EXPECT_TRUE(has_moved(std::vector<uint8_t>(kStride * kHeight).data(), box(10).data(), kStride,
                          kWidth, kHeight));
  });
}

// ---- Pictures ----

struct Softened {
  Softened(const Floor& background)
      : watcher(background), soft(background.width, background.height) {}
  std::vector<uint8_t> operator()(const Floor& frame, int softness, Pool* pool = nullptr,
                                  const IgnoredAreas& ignored = {}) {
    hard = watcher.mask_of(frame, &ignored, pool);
    const uint8_t* const x[3] = {frame.level[0].data(), frame.level[1].data(),
                                 frame.level[2].data()};
    soft.make(watcher.decision(), x, {softness, watcher.threshold}, ignored, pool);
    return {soft.alpha(), soft.alpha() + frame.pixels()};
  }
  Watcher watcher;
  SoftMask soft;
  std::vector<uint8_t> hard;
};

// How much of a pixel a disc covers.
double covered(double x, double y, double middle_x, double middle_y, double radius) {
  int inside = 0;
  for (int i = 0; i < 16; ++i)
    inside +=
        std::hypot(x + (i % 4 - 1.5) / 4 - middle_x, y + (i / 4 - 1.5) / 4 - middle_y) < radius;
  return inside / 16.0;
}

struct Disc {
  double x = 80, y = 60, radius = 30;
  std::array<int, 3> colour = {60, 90, 170};

  double over(int col, int row) const { return covered(col, row, x, y, radius); }
  Floor on(const Floor& floor) const {
    Floor frame = floor;
    for (int row = 0; row < floor.height; ++row)
      for (int col = 0; col < floor.width; ++col)
        for (size_t c = 0; c < 3; ++c) {
          uint8_t& level = frame.level[c][frame.index(col, row)];
          level = static_cast<uint8_t>(std::lround(level + over(col, row) * (colour[c] - level)));
        }
    return frame;
  }
};

// No tiles, no history: the whole picture at once, as the definition has it.
void expect_no_seams(const Floor& floor, const Floor& frame, int softness) {
  SCOPED_TRACE(testing::Message() << floor.width << "x" << floor.height << " " << softness);
  Pool pool(3);
  Softened one(floor), three(floor);
  const auto alpha = one(frame, softness);
  EXPECT_EQ(three(frame, softness, &pool), alpha);
  const int halo = soft_halo(softness);
  Plane guide(floor.width + 2 * halo, floor.height + 2 * halo), white = guide;
  for (int y = 0; y < guide.height; ++y)
    for (int x = 0; x < guide.width; ++x) {
      const size_t p = frame.index(std::clamp(x - halo, 0, floor.width - 1),
                                   std::clamp(y - halo, 0, floor.height - 1));
      double squared = 0;
      for (int c = 0; c < 3; ++c) squared += std::pow(frame.level[c][p] - floor.level[c][p], 2);
      guide.at(x, y) = std::min(255.0, std::floor(std::sqrt(squared)));
      white.at(x, y) = one.hard[p] / 255;
    }
  const auto expected = guided(guide, white, softness, one.watcher.threshold / 4);
  for (size_t p = 0; p < alpha.size(); ++p) ASSERT_NEAR(alpha[p], expected[p], 1.01) << p;
}

TEST(SoftMask, HasNoSeams) {
  std::mt19937 rng(354);
  for (auto [width, height] : {std::pair{1, 1}, {1, 70}, {130, 2}, {65, 64}, {150, 131}})
    for (int softness : {1, 5}) {
      const Floor floor = grainy_floor(width, height, rng);
      const Disc disc = {width / 2.0, height / 3.0, std::min(width, height) / 2.5};
      expect_no_seams(floor, with_noise(disc.on(floor), 3, rng), softness);
    }
  // Edges next to where tiles meet. They are weak: what is far counts.
  const Floor floor = grainy_floor(131, 129, rng);
  for (int at = 55; at < 75; at += 3)
    for (const Rectangle& area :
         {Rectangle{at, 0, 200, 200}, {0, at, 200, 200}, {0, 0, at, 200}, {0, 0, 200, at}}) {
      Floor frame = floor;
      frame.paint(area, {150, 125, 130});
      expect_no_seams(floor, with_noise(frame, 3, rng), 5);
    }
}

// The share of the pixel that is covered: nearer to it than the hard mask, and much the same from
// frame to frame.
TEST(SoftMask, FollowsThePicturesEdgeAndIsSteady) {
  std::mt19937 rng(355);
  const Floor floor = grainy_floor(160, 120, rng);
  const Disc disc;
  const Floor still = disc.on(floor);
  for (double sigma : {2.0, 4.0})
    for (int softness : {1, 2, 4}) {
      SCOPED_TRACE(testing::Message() << "noise " << sigma << ", softness " << softness);
      Softened softened(floor);
      softened.watcher.threshold = std::max(18.0, 4 * std::sqrt(3.0) * sigma);
      std::vector<uint8_t> soft_before, hard_before;
      double soft_error = 0, hard_error = 0, soft_change = 0, hard_change = 0;
      for (int t = 0; t < 40; ++t) {
        const auto alpha = softened(with_noise(still, sigma, rng), softness);
        for (int y = 0; y < 120; ++y)
          for (int x = 0; x < 160; ++x) {
            const size_t p = still.index(x, y);
            soft_error += std::pow(alpha[p] / 255.0 - disc.over(x, y), 2);
            hard_error += std::pow(softened.hard[p] / 255.0 - disc.over(x, y), 2);
            if (t < 10) continue;
            soft_change += std::abs(alpha[p] - soft_before[p]);
            hard_change += std::abs(softened.hard[p] - hard_before[p]);
          }
        soft_before = alpha, hard_before = softened.hard;
      }
      EXPECT_LT(soft_error, 0.5 * hard_error);
      EXPECT_LT(soft_change, 0.5 * hard_change);
    }
}

// What moves leaves nothing behind, however little it differs: the edge is where it is in each
// frame.
TEST(SoftMask, KeepsUpWithWhatMoves) {
  std::mt19937 rng(356);
  const Floor floor = grainy_floor(160, 120, rng);
  for (int contrast : {30, 120})
    for (double speed : {0.3, 1.0, 4.0}) {
      SCOPED_TRACE(testing::Message() << contrast << " levels, " << speed << " pixels a frame");
      Softened softened(floor);
      double soft_error = 0, hard_error = 0, behind = 0;
      for (int t = 0; t < 25; ++t) {
        const Disc disc = {
            40 + speed * t, 60, 25, {150 - contrast, 125 - contrast, 100 + contrast}};
        const Floor frame = with_noise(disc.on(floor), 1, rng);
        const auto alpha = softened(frame, 2);
        for (int y = 0; y < 120; ++y)
          for (int x = 0; x < 160; ++x) {
            const size_t p = frame.index(x, y);
            soft_error += std::pow(alpha[p] / 255.0 - disc.over(x, y), 2);
            hard_error += std::pow(softened.hard[p] / 255.0 - disc.over(x, y), 2);
            // Where it was 3 pixels ago.
            if (x < disc.x && std::hypot(x - disc.x, y - disc.y) > disc.radius + 3)
              behind = std::max(behind, alpha[p] / 255.0);
          }
      }
      EXPECT_LT(soft_error, 0.6 * hard_error);
      EXPECT_LT(behind, 0.35);
    }
}

// Nothing is left of what jumped.
TEST(SoftMask, KnowsNothingOfAMaskThatWasElsewhere) {
  std::mt19937 rng(361);
  const Floor floor = grainy_floor(64, 64, rng);
  const auto disc_at = [&](double x) { return Disc{x, 30, 10, {120, 95, 130}}.on(floor); };
  Softened jumped(floor), fresh(floor);
  for (int t = 0; t < 5; ++t) jumped(disc_at(15), 3);
  EXPECT_EQ(jumped(disc_at(45), 3), fresh(disc_at(45), 3));
}

TEST(SoftMask, IsBackgroundWhereNothingIsLookedAt) {
  std::mt19937 rng(357);
  const Floor floor = grainy_floor(160, 120, rng);
  Softened softened(floor);
  IgnoredAreas ignored;
  ignored.add({85, 0, 1000, 120});
  for (int t = 0; t < 3; ++t) {
    const auto alpha = softened(Disc().on(floor), 4, nullptr, ignored);
    for (int y = 0; y < 120; ++y)
      for (int x = 85; x < 160; ++x) ASSERT_EQ(alpha[floor.index(x, y)], 0);
    EXPECT_EQ(alpha[floor.index(70, 60)], 255);
  }
}

// ---- The engine's pictures ----

struct Shown {
  std::vector<uint8_t> planes, alpha, hard;
};
// What is shown of the last of 20 frames, with a shadow beside a disc; the frame's own alpha is
// 200.
Shown last_of(const Floor& floor, const Floor& frame, Output output, int softness, Shadows shadows,
              Colours colours, bool with_alpha) {
  EngineOptions options;
  options.window_size = 20;
  options.colours = colours;
  // Masks tell what alpha is: theirs are full.
  if (colours == Colours::yuv && output == Output::cutout) options.levels = kVideoLevels;
  options.mask_softness = softness;
  options.shadows = shadows;
  Engine engine;
  EXPECT_TRUE(engine.configure(options, floor.width, floor.height).ok());
  PackedPicture picture(floor.width, floor.height, 4, with_alpha);
  Shown out;
  for (int t = 0; t < 20; ++t) {
    picture.fill((t < 19 ? floor : frame).planes());
    for (size_t p = 0; with_alpha && p < picture.pixels(); ++p) picture.at(3, p) = 200;
    EXPECT_TRUE(engine.push(picture.in()).ok());
  }
  EXPECT_TRUE(engine.drain().ok());
  while (engine.next()) {
    std::vector<uint8_t> residual(floor.pixels());
    out.hard.resize(floor.pixels());
    engine.next()->foreground(out.hard.data(), residual.data());
    engine.next()->pop(output, picture.out());
  }
  out.planes = picture.planes();
  for (size_t p = 0; p < picture.pixels(); ++p) out.alpha.push_back(picture.at(3, p));
  return out;
}

TEST(SoftMask, FadesCutouts) {
  std::mt19937 rng(358);
  const Floor floor = grainy_floor(160, 120, rng), frame = Disc().on(floor);
  const auto planes = frame.planes();
  const size_t pixels = floor.pixels();
  for (Colours colours : {Colours::rgb, Colours::yuv}) {
    const auto of = [&](Output output, int softness, bool with_alpha) {
      return last_of(floor, frame, output, softness, Shadows::foreground, colours, with_alpha);
    };
    const auto mask = of(Output::mask, 3, false), hard = of(Output::mask, 0, false),
               with_alpha = of(Output::cutout, 3, true), without = of(Output::cutout, 3, false);
    EXPECT_EQ(mask.hard, hard.hard) << "regions go by the hard mask";
    EXPECT_TRUE(std::equal(hard.hard.begin(), hard.hard.end(), hard.planes.begin()));
    size_t between = 0;
    for (size_t p = 0; p < pixels; ++p) {
      const int alpha = mask.planes[p];
      between += alpha > 0 && alpha < 255;
      ASSERT_EQ(with_alpha.alpha[p], std::lround(200 * alpha / 255.0));
      for (size_t c = 0; c < 3; ++c) {
        const int x = planes[c * pixels + p], black = colours == Colours::rgb ? 0
                                                      : c == 0                ? 16
                                                                              : 128;
        ASSERT_EQ(mask.planes[c * pixels + p], alpha);
        ASSERT_EQ(with_alpha.planes[c * pixels + p], alpha > 0 ? x : black);
        ASSERT_EQ(without.planes[c * pixels + p],
                  std::lround((x * alpha + black * (255 - alpha)) / 255.0));
      }
    }
    EXPECT_GT(between, 188u);
  }
}

TEST(SoftMask, LeavesMarkedShadowsGrey) {
  std::mt19937 rng(359);
  const Floor floor = grainy_floor(160, 120, rng);
  Floor frame = floor;
  for (int y = 0; y < 120; ++y)
    for (int x = 80; x < 160; ++x)
      for (auto& plane : frame.level) {
        uint8_t& level = plane[frame.index(x, y)];
        level = static_cast<uint8_t>(level * 0.65);
      }
  frame = Disc().on(frame);
  const auto of = [&](int softness, Shadows shadows) {
    return last_of(floor, frame, Output::mask, softness, shadows, Colours::rgb, false).planes;
  };
  const auto hard = of(0, Shadows::marked), soft = of(2, Shadows::background),
             marked = of(2, Shadows::marked);
  size_t grey = 0;
  for (size_t p = 0; p < floor.pixels(); ++p) {
    ASSERT_TRUE(hard[p] == 0 || hard[p] == 127 || hard[p] == 255);
    grey += hard[p] == 127;
    ASSERT_EQ(marked[p], hard[p] == 127 ? std::max<int>(soft[p], 127) : soft[p]) << p;
  }
  EXPECT_GT(grey, 4000u);
}

TEST(SoftMask, IsNeverDarkerThanAMark) {
  BackgroundModel none;
  std::vector<uint8_t> mask(256), shaded(256, 255);
  std::iota(mask.begin(), mask.end(), uint8_t{0});
  OutputTask task = {{mask.data(), mask.data(), mask.data()},
                     &none,
                     Output::mask,
                     mask.data(),
                     shaded.data(),
                     nullptr,
                     255};
  task.soft = true;
  PackedPicture picture(256, 1, 3);
  write_picture(task, {}, picture.out(), 0, 1);
  for (size_t p = 0; p < 256; ++p) ASSERT_EQ(picture.at(1, p), std::max<size_t>(p, 127));
}

}  // namespace
}  // namespace qdmd::test
