// SPDX-License-Identifier: LGPL-2.1-or-later
// Frames of every layout in, and pictures of every layout out, sample by sample.
#include "core/foreground/picture.h"

#include <cmath>

#include "core/passes/planes.h"
#include "tests/core/layouts.h"

namespace qdmd::test {
namespace {

std::mt19937 rng(2102);

std::vector<uint8_t> random_samples(size_t count) {
  std::vector<uint8_t> samples(count);
  for (uint8_t& sample : samples) sample = static_cast<uint8_t>(rng() >> 9);
  return samples;
}

TEST(SplitChannels, SamplesGoToAllPixelsThatShareThem) {
  on_every_target([] {
    for (const VideoLayout& layout : kVideoLayouts)
      for (const auto& [width, height] : kVideoSizes)
        for (int gap : {0, 7}) {
          SCOPED_TRACE(std::string(layout.name) + " " + std::to_string(width) + "x" +
                       std::to_string(height));
          VideoPicture frame(layout, width, height, gap);
          frame.fill_randomly(rng);
          for (int first : {0, height - 1, height / 2}) {
            const int count = std::max(1, height - first - (first > 0));
            std::array<std::unique_ptr<BeforeTheEdge<uint8_t>>, 3> planes;
            uint8_t* to[3];
            for (size_t c = 0; c < 3; ++c) {
              planes[c] =
                  std::make_unique<BeforeTheEdge<uint8_t>>(static_cast<size_t>(width * height));
              std::fill(planes[c]->begin(), planes[c]->end(), VideoPicture::kCanary);
              to[c] = planes[c]->data();
            }
            split_channels(frame.view<const uint8_t>(), first, count, 0, to);
            for (int y = 0; y < height; ++y)
              for (int x = 0; x < width; ++x)
                for (int c = 0; c < 3; ++c)
                  ASSERT_EQ(to[c][y * width + x], y >= first && y < first + count
                                                      ? frame.sample(c, x, y)
                                                      : VideoPicture::kCanary)
                      << "channel " << c << " at " << x << " " << y << ", rows from " << first;
          }
        }
  });
}

TEST(SplitChannels, SeesAlphaOfEveryLayout) {
  for (const VideoLayout& layout : kVideoLayouts)
    for (const auto& size : kVideoSizes) {
      const int width = size.first, height = size.second;
      VideoPicture frame(layout, width, height, 3);
      if (!frame.has(3)) continue;
      std::vector<uint8_t> planes(static_cast<size_t>(3 * width * height));
      uint8_t* const to[3] = {planes.data(), planes.data() + width * height,
                              planes.data() + 2 * width * height};
      const auto constant = [&] {
        return split_channels(frame.view<const uint8_t>(), 0, height, 200, to);
      };
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) frame.sample(3, x, y) = 200;
      EXPECT_TRUE(constant()) << layout.name;
      for (const auto& [x, y] : {std::pair{0, 0}, {width - 1, height - 1}, {width / 2, 0}}) {
        frame.sample(3, x, y) ^= 4;
        EXPECT_FALSE(constant()) << layout.name << " at " << x << " " << y;
        frame.sample(3, x, y) ^= 4;
      }
    }
}

// A frame and what its pictures are made of.
struct Scene {
  int width, height;
  std::vector<uint8_t> x[3], level[3], hard, soft, shaded, alpha;
  BackgroundModel model;

  Scene(int width_, int height_) : width(width_), height(height_) {
    const auto pixels = static_cast<size_t>(width * height);
    for (int c = 0; c < 3; ++c) x[c] = random_samples(pixels), level[c] = random_samples(pixels);
    hard = random_samples(pixels), soft = random_samples(pixels);
    shaded = random_samples(pixels), alpha = random_samples(pixels);
    for (size_t p = 0; p < pixels; ++p) {
      hard[p] = hard[p] & 1 ? 255 : 0;
      shaded[p] = shaded[p] & 1 ? 255 : 0;
      // Runs of what masks mostly are.
      if (p % 16 < 8) soft[p] = hard[p];
    }
    model.freeze_as({8, {level[0], level[1], level[2]}, {}}, nullptr, pixels);
    model.set_time(0);
  }
};

struct Asked {
  Output output;
  bool soft, shaded, own_alpha;
};

// What pixel p is in channel c (alpha: 3).
int shown(const Scene& scene, const Asked& asked, const Levels& levels, bool has_alpha, int c,
          size_t p) {
  const auto at = static_cast<size_t>(c);
  const int mask = asked.soft ? scene.soft[p] : scene.hard[p];
  if (c == 3) {
    const int own = asked.own_alpha ? scene.alpha[p] : 200;
    return asked.output == Output::cutout ? static_cast<int>(std::lround(own * mask / 255.0)) : own;
  }
  const int x = scene.x[at][p], l = scene.level[at][p];
  const int black = levels.black[at], white = levels.white[at];
  switch (asked.output) {
    case Output::background:
      return l;
    case Output::foreground:
      return std::min(black + std::abs(x - l), white);
    case Output::mask: {
      const int grey = asked.shaded && scene.shaded[p] ? std::max(mask, 127) : mask;
      return black + static_cast<int>(std::lround((white - black) * grey / 255.0));
    }
    case Output::cutout:
      break;
  }
  if (has_alpha) return mask > 0 ? x : black;
  return static_cast<int>(std::lround((x * mask + black * (255 - mask)) / 255.0));
}

void expect_picture(Scene& scene, const VideoLayout& layout, const Asked& asked,
                    const Levels& levels, int gap) {
  VideoPicture out(layout, scene.width, scene.height, gap),
      expected(layout, scene.width, scene.height, gap);
  OutputTask task = {{scene.x[0].data(), scene.x[1].data(), scene.x[2].data()},
                     &scene.model,
                     asked.output,
                     asked.soft ? scene.soft.data() : scene.hard.data(),
                     asked.shaded ? scene.shaded.data() : nullptr,
                     asked.own_alpha ? scene.alpha.data() : nullptr,
                     200,
                     asked.soft};
  const MutableImageView view = out.view<uint8_t>();
  const int together = rows_together(view);
  // In two bands, as threads do it.
  const int middle = scene.height / 2 / together * together;
  if (middle > 0) write_picture(task, levels, view, 0, middle);
  write_picture(task, levels, view, middle, scene.height - middle);

  const bool grey = std::string(layout.name) == "GRAY";
  for (int c = 0; c < 4; ++c) {
    if (!out.has(c) || (grey && c != 2)) continue;
    const ChannelAt& at = out.layout_of(c);
    for (int top = 0; top < scene.height; top += at.rows)
      for (int left = 0; left < scene.width; left += at.columns) {
        int sum = 0, count = 0;
        for (int y = top; y < std::min(scene.height, top + at.rows); ++y)
          for (int x = left; x < std::min(scene.width, left + at.columns); ++x, ++count)
            sum += shown(scene, asked, levels, out.has(3), c,
                         static_cast<size_t>(y * scene.width + x));
        expected.sample(c, left, top) = static_cast<uint8_t>((sum + count / 2) / count);
      }
  }
  ASSERT_EQ(out.bytes(), expected.bytes());
}

constexpr Levels kFull = {}, kLimited = {{16, 128, 128}, {235, 128, 128}},
                 kFullChroma = {{0, 128, 128}, {255, 128, 128}},
                 kLimitedRgb = {{16, 16, 16}, {235, 235, 235}};

TEST(WritePicture, IsTheMeanOfWhatItsPixelsAre) {
  on_every_target([] {
    for (const auto& [width, height] : kVideoSizes) {
      Scene scene(width, height);
      for (const VideoLayout& layout : kVideoLayouts)
        for (Output output : {Output::background, Output::foreground, Output::mask, Output::cutout})
          for (const Levels& levels : {kFull, kLimited, kFullChroma, kLimitedRgb})
            for (bool soft : {false, true}) {
              if (soft && (output == Output::background || output == Output::foreground)) continue;
              SCOPED_TRACE(std::string(layout.name) + " " + std::to_string(width) + "x" +
                           std::to_string(height) + ", output " +
                           std::to_string(static_cast<int>(output)) + (soft ? ", soft" : ", hard") +
                           ", black " + std::to_string(levels.black[0]));
              const bool odd = (width + levels.black[0]) % 3 == 0;
              expect_picture(scene, layout, {output, soft, output == Output::mask && odd, odd},
                             levels, odd ? 0 : 9);
              if (testing::Test::HasFatalFailure()) return;
            }
    }
  });
}

}  // namespace
}  // namespace qdmd::test
