// The engine on simulated scenes, against their true backgrounds and masks.
#include <cmath>

#include "core/engine/engine.h"
#include "core/scene/scene.h"
#include "gtest/gtest.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 96, kHeight = 72, kFrames = 100;

using scene::Picture;

template <typename Byte>
BasicImageView<Byte> view_of(Picture& picture) {
  BasicImageView<Byte> view;
  for (int c = 0; c < 3; ++c) view.channel[c] = picture.samples.data() + c;
  view.width = picture.width;
  view.height = picture.height;
  view.pixel_stride = 3;
  view.row_stride = 3 * picture.width;
  return view;
}

// How far pictures are from the truth, and masks from the labels.
struct Score {
  double input = 0, background = 0;  // mean absolute error in levels, of all frames
  double worst = 0;                  // of the worst frame's background
  double recall = 0, precision = 0;  // of the mask; shadows and parts do not count
};

double mean_difference(const Picture& a, const Picture& b) {
  double sum = 0;
  for (size_t i = 0; i < a.samples.size(); ++i) sum += std::abs(a.samples[i] - b.samples[i]);
  return sum / static_cast<double>(a.samples.size());
}

Score separate(const char* text, const DmdOptions& dmd, uint64_t seed) {
  scene::SceneOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.seed = seed;
  scene::Scene scene(options, text);
  std::vector<Picture> truths;
  std::vector<scene::Plane> labels;
  Score score;
  EngineOptions engine_options;
  engine_options.window_size = kFrames;
  engine_options.dmd = dmd;
  Engine backgrounds, masks;
  for (Engine* engine : {&backgrounds, &masks})
    EXPECT_TRUE(engine->configure(engine_options, kWidth, kHeight).ok());
  for (int t = 0; t < kFrames; ++t) {
    scene.render(t, scene::kFrame | scene::kTruth | scene::kLabels);
    truths.push_back(scene.background());
    labels.push_back(scene.labels());
    score.input += mean_difference(scene.frame(), scene.background()) / kFrames;
    Picture frame = scene.frame();
    for (Engine* engine : {&backgrounds, &masks})
      EXPECT_TRUE(engine->push(view_of<const uint8_t>(frame)).ok());
  }
  double hits = 0, objects = 0, alarms = 0;
  for (size_t t = 0; t < kFrames; ++t) {
    Picture picture(kWidth, kHeight);
    backgrounds.pop(Output::background, view_of<uint8_t>(picture));
    const double error = mean_difference(picture, truths[t]);
    score.background += error / kFrames;
    score.worst = std::max(score.worst, error);
    masks.pop(Output::mask, view_of<uint8_t>(picture));
    for (size_t p = 0; p < labels[t].samples.size(); ++p) {
      const uint8_t label = labels[t].samples[p];
      const bool marked = picture.samples[3 * p] != 0;
      objects += label == scene::kObjectLabel;
      hits += label == scene::kObjectLabel && marked;
      alarms += label == scene::kBackgroundLabel && marked;
    }
  }
  score.recall = hits / std::max(objects, 1.0);
  score.precision = hits / std::max(hits + alarms, 1.0);
  return score;
}

DmdOptions rank(int kept) {
  DmdOptions options;
  options.rank = kept;
  return options;
}

class Separation : public testing::TestWithParam<uint64_t> {};

TEST_P(Separation, MaskIsTheMover) {
  for (const char* text : {"default", "noise=3", "low-rate=5"}) {
    SCOPED_TRACE(text);
    const Score score = separate(text, rank(1), GetParam());
    EXPECT_GT(score.recall, 0.9);
    EXPECT_GT(score.precision, 0.8);
  }
}

// A mode's noise is that of the frames divided by the root of their number; what is left is the
// faint ghost of a least-squares method.
TEST_P(Separation, NoiseIsAveragedOut) {
  for (const int kept : {0, 1, 3}) {
    const Score score = separate("noise=6", rank(kept), GetParam());
    const Score still = separate("default", rank(kept), GetParam());
    EXPECT_LT(score.background, score.input / 2);
    EXPECT_LT(score.background, still.background + 1.5);
  }
}

// L(t) varies in time: any one picture for the whole window is wrong by half of the change at one
// end of it, some 25 levels.
TEST_P(Separation, AFadeIsFollowed) {
  for (const int kept : {0, 1}) {
    const Score fading = separate("fade=0.4:duration=4,noise=2", rank(kept), GetParam());
    EXPECT_LT(fading.worst, 5);
    EXPECT_GT(fading.recall, 0.9);
  }
}

// The mover stands for most of the window: one mode holds both or none, several take him apart.
TEST_P(Separation, RankOneIsSteadyWhereSomebodyStops) {
  const Score one = separate("stop=8", rank(1), GetParam());
  EXPECT_LT(one.background, one.input * 1.2);
  EXPECT_GT(one.recall, 0.8);
}

TEST_P(Separation, MovingBackgroundsStayInTheirPlace) {
  const Score still = separate("default", rank(1), GetParam());
  for (const char* text : {"leaves", "water", "flicker"}) {
    const Score score = separate(text, rank(1), GetParam());
    EXPECT_LT(score.background, still.background + 4) << text;
    EXPECT_GT(score.recall, 0.9) << text;
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, Separation, testing::Values(11, 12, 13));

}  // namespace
}  // namespace qdmd::test
