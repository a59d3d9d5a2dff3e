// SPDX-License-Identifier: LGPL-2.1-or-later
// Hard shadows of a simulated street in the sun, at the defaults: in each family of formats, and
// for each wish for shadows.
#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "core/engine/engine.h"
#include "core/passes/rgb_colours.h"
#include "core/scene/scene.h"
#include "gtest/gtest.h"
#include "tests/core/layouts.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 320, kHeight = 240, kFrames = 130;
constexpr size_t kFirst = 30;  // frame that is looked at
constexpr Levels kVideo = {{16, 128, 128}, {235, 128, 128}};

struct Format {
  const char* layout;
  Colours colours = Colours::rgb;
  SampleBits bits = {};

  Levels levels() const { return colours == Colours::yuv ? kVideo : Levels{}; }
  VideoPicture picture() const {
    const auto* const found = std::ranges::find_if(
        kVideoLayouts, [&](const VideoLayout& of) { return std::string_view(of.name) == layout; });
    return {bits.is_deep() ? of_words(*found) : *found, kWidth, kHeight, 0, bits};
  }
};
constexpr Format kRgb = {"BGR"}, kI420 = {"I420", Colours::yuv}, kNv12 = {"NV12", Colours::yuv},
                 kP010 = {"NV12", Colours::yuv, {10, 6}};

// A scene's frames with their labels.
struct Street {
  std::vector<scene::Picture> frames;
  std::vector<std::vector<uint8_t>> labels;

  explicit Street(const std::string& text) {
    scene::SceneOptions options;
    options.seed = 14;
    scene::Scene scene(options, text);
    for (int t = 0; t < kFrames; ++t) {
      scene.render(t, scene::kFrame | scene::kLabels);
      frames.push_back(scene.frame());
      labels.push_back(scene.labels().samples);
    }
  }
};

// Pixels that share a sample have their mean.
void copy(const scene::Picture& frame, const Format& format, VideoPicture* picture) {
  const RgbColours rgb(format.colours, format.levels());
  for (int c = 0; c < 3; ++c) {
    const ChannelAt& at = picture->layout_of(c);
    for (int y = 0; y < kHeight; y += at.rows)
      for (int x = 0; x < kWidth; x += at.columns) {
        float sum = 0;
        for (int i = 0; i < at.rows; ++i)
          for (int j = 0; j < at.columns; ++j) {
            const uint8_t* const pixel = frame.at(x + j, y + i);
            sum += rgb.sample({static_cast<float>(pixel[0]), static_cast<float>(pixel[1]),
                               static_cast<float>(pixel[2])})[static_cast<size_t>(c)];
          }
        const float mean = sum / static_cast<float>(at.rows * at.columns);
        if (format.bits.is_deep())
          picture->put_word(c, x, y, static_cast<int>(std::lround(4 * mean)));
        else
          picture->sample(c, x, y) = static_cast<uint8_t>(std::lround(mean));
      }
  }
}

// Shares of the labels that have a colour in the mask.
struct Shares {
  double white = 0, grey = 0;
};
struct Taken {
  Shares shadow, people;
};

Taken taken_in(const Street& street, const Format& format, Shadows shadows = Shadows::background) {
  EngineOptions options;
  options.window_size = 60;
  options.shadows = shadows;
  options.colours = format.colours;
  options.levels = format.levels();
  options.depth = format.bits.depth;
  VideoPicture picture = format.picture(), mask = format.picture();
  options.chroma_columns = picture.layout_of(1).columns;
  options.chroma_rows = picture.layout_of(1).rows;
  Engine engine;
  EXPECT_TRUE(engine.configure(options, kWidth, kHeight).ok());
  // Of the levels of the first channel, in the highest 8 bits.
  const auto level_of = [&](int x, int y) {
    const uint8_t* const at = &mask.sample(0, x, y);
    return format.bits.is_deep() ? (at[0] | at[1] << 8) >> format.bits.shift >> 2 : at[0];
  };
  const int white = format.levels().white[0], black = format.levels().black[0];
  Taken sums;
  double shadow = 0, people = 0;
  size_t popped = 0;
  const auto pop = [&] {
    for (; engine.next(); ++popped) {
      engine.next()->pop(Output::mask, mask.view<uint8_t>());
      if (popped < kFirst) continue;
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const uint8_t label = street.labels[popped][static_cast<size_t>(y * kWidth + x)];
          if (label != scene::kShadowLabel && label != scene::kObjectLabel) continue;
          const bool in_shadow = label == scene::kShadowLabel;
          (in_shadow ? shadow : people) += 1;
          Shares& of = in_shadow ? sums.shadow : sums.people;
          const int level = level_of(x, y);
          of.white += level == white;
          of.grey += level != white && level != black;
        }
    }
  };
  for (const scene::Picture& frame : street.frames) {
    copy(frame, format, &picture);
    EXPECT_TRUE(engine.push(picture.view<const uint8_t>()).ok());
    pop();
  }
  EXPECT_TRUE(engine.drain().ok());
  pop();
  EXPECT_GT(shadow, 20000);
  EXPECT_GT(people, 100000);
  return {{sums.shadow.white / shadow, sums.shadow.grey / shadow},
          {sums.people.white / people, sums.people.grey / people}};
}

// The third one leaves the sky's blue light.
constexpr const char* kShadows[] = {"shadow=0.65:length=0.9:softness=2", "shadow=0.8:length=0.9",
                                    "shadow=0.75:length=0.9:blue=0.1"};
Street street_with(const char* shadow) {
  return Street(std::string("basic,bootstrap=3,") + shadow);
}

TEST(HardShadows, AreNoForegroundInASimulatedStreet) {
  for (const char* shadow : kShadows) {
    SCOPED_TRACE(shadow);
    const Taken taken = taken_in(street_with(shadow), kRgb);
    EXPECT_LT(taken.shadow.white, 0.4);
    EXPECT_GT(taken.people.white, 0.96);
    EXPECT_EQ(taken.shadow.grey + taken.people.grey, 0);
  }
}

TEST(HardShadows, AreNoForegroundInYuvAndInMoreBits) {
  const Street street = street_with(kShadows[0]);
  for (const Format& format : {kI420, kNv12, kP010}) {
    SCOPED_TRACE(std::string(format.layout) + ", " + std::to_string(format.bits.depth) + " bits");
    const Taken taken = taken_in(street, format);
    EXPECT_LT(taken.shadow.white, 0.4);
    EXPECT_GT(taken.people.white, 0.96);
    EXPECT_EQ(taken.shadow.grey + taken.people.grey, 0);
  }
}

TEST(HardShadows, AreMarkedOrForegroundIfOneWishes) {
  const Street street = street_with(kShadows[0]);
  for (const Format& format : {kRgb, kP010}) {
    SCOPED_TRACE(std::string(format.layout) + ", " + std::to_string(format.bits.depth) + " bits");
    const Taken marked = taken_in(street, format, Shadows::marked);
    EXPECT_LT(marked.shadow.white, 0.4);
    EXPECT_GT(marked.people.white, 0.96);
    EXPECT_LT(marked.people.grey, 0.03);
    const Taken all = taken_in(street, format, Shadows::foreground);
    // The soft edge of a shadow shows less than half of it.
    EXPECT_GT(all.shadow.white, 0.6);
    EXPECT_GT(all.people.white, 0.96);
    EXPECT_EQ(all.shadow.grey + all.people.grey, 0);
    // What is taken is marked, with the soft edges, which are no edges of a mask then.
    EXPECT_GE(marked.shadow.white + marked.shadow.grey, all.shadow.white);
    EXPECT_NEAR(marked.shadow.white + marked.shadow.grey, all.shadow.white, 0.1);
  }
}

}  // namespace
}  // namespace qdmd::test
