// SPDX-License-Identifier: LGPL-2.1-or-later
// The engine on simulated scenes, against their true backgrounds and masks.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

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
  double kept = 0;                   // squared error of the backgrounds over that of the frames
  double covered = 0;                // share of the frames in which the most covered pixel is so
  double moved = 0;                  // mean absolute distance of the truths from their mean picture
  double recall = 0, precision = 0;  // of the mask; shadows and parts do not count
};

double mean_difference(const Picture& a, const Picture& b) {
  double sum = 0;
  for (size_t i = 0; i < a.samples.size(); ++i) sum += std::abs(a.samples[i] - b.samples[i]);
  return sum / static_cast<double>(a.samples.size());
}

double squared_difference(const Picture& a, const Picture& b) {
  double sum = 0;
  for (size_t i = 0; i < a.samples.size(); ++i) sum += std::pow(a.samples[i] - b.samples[i], 2);
  return sum;
}

// The share of the frames in which the pixel that is covered most is covered.
double share_covered(const std::vector<scene::Plane>& labels) {
  std::vector<int> frames(labels.front().samples.size());
  for (const auto& plane : labels)
    for (size_t p = 0; p < frames.size(); ++p)
      frames[p] += plane.samples[p] != scene::kBackgroundLabel;
  return *std::max_element(frames.begin(), frames.end()) / static_cast<double>(labels.size());
}

double distance_from_mean(const std::vector<Picture>& pictures) {
  std::vector<double> mean(pictures.front().samples.size());
  for (const Picture& picture : pictures)
    for (size_t i = 0; i < mean.size(); ++i)
      mean[i] += picture.samples[i] / static_cast<double>(pictures.size());
  double sum = 0;
  for (const Picture& picture : pictures)
    for (size_t i = 0; i < mean.size(); ++i) sum += std::abs(picture.samples[i] - mean[i]);
  return sum / static_cast<double>(pictures.size() * mean.size());
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
  double input_squares = 0, background_squares = 0;
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
    input_squares += squared_difference(scene.frame(), scene.background());
    Picture frame = scene.frame();
    for (Engine* engine : {&backgrounds, &masks})
      EXPECT_TRUE(engine->push(view_of<const uint8_t>(frame)).ok());
  }
  for (Engine* engine : {&backgrounds, &masks}) EXPECT_TRUE(engine->drain().ok());
  double hits = 0, objects = 0, alarms = 0;
  for (size_t t = 0; t < kFrames; ++t) {
    EXPECT_TRUE(backgrounds.next() && masks.next());
    Picture picture(kWidth, kHeight);
    backgrounds.next()->pop(Output::background, view_of<uint8_t>(picture));
    const double error = mean_difference(picture, truths[t]);
    score.background += error / kFrames;
    background_squares += squared_difference(picture, truths[t]);
    score.worst = std::max(score.worst, error);
    masks.next()->pop(Output::mask, view_of<uint8_t>(picture));
    for (size_t p = 0; p < labels[t].samples.size(); ++p) {
      const uint8_t label = labels[t].samples[p];
      const bool marked = picture.samples[3 * p] != 0;
      objects += label == scene::kObjectLabel;
      hits += label == scene::kObjectLabel && marked;
      alarms += label == scene::kBackgroundLabel && marked;
    }
  }
  score.kept = background_squares / input_squares;
  score.covered = share_covered(labels);
  score.moved = distance_from_mean(truths);
  score.recall = hits / std::max(objects, 1.0);
  score.precision = hits / std::max(hits + alarms, 1.0);
  return score;
}

DmdOptions rank(int kept) {
  DmdOptions options;
  options.rank = kept;
  return options;
}

// A mean of m / 2 frames with that noise (the default looks at every second one), rounded to 8
// bits: 0.8 sigma / sqrt(m / 2) is the mean absolute value of its noise, and rounding moves a level
// by a quarter on average.
double noise_left(double sigma) { return 0.8 * sigma / std::sqrt(kFrames / 2) + 0.25; }

// A mean of the frames keeps of a mover's energy at a pixel the share of the frames in which he is
// there; a mode keeps no more than at the pixel where he is most. The absolute error does not tell:
// a faint ghost in every frame has as much as he himself in few.
void expect_ghost_of_mean(const Score& score) { EXPECT_LT(score.kept, score.covered); }

class Separation : public testing::TestWithParam<uint64_t> {};

// ---- What a user gets who sets nothing ----

TEST_P(Separation, TheDefaultLeavesNoGhost) {
  for (const char* text : {"default", "low-rate=5", "stop=8"}) {
    SCOPED_TRACE(text);
    const Score score = separate(text, EngineOptions().dmd, GetParam());
    // A pixel in a thousand may be off by some levels, none is for long.
    EXPECT_LT(score.worst, 0.01);
    // Some pixels of edges show a part of the mover that differs less than what is inside.
    EXPECT_GT(score.recall, 0.98);
    EXPECT_GT(score.precision, 0.99);
  }
}

TEST_P(Separation, TheDefaultLeavesTheNoiseOfAMean) {
  for (const auto& [text, sigma] :
       {std::pair{"noise=3", 3.0}, {"noise=6", 6.0}, {"fade=0.4:duration=4,noise=2", 2.0}}) {
    SCOPED_TRACE(text);
    const Score score = separate(text, EngineOptions().dmd, GetParam());
    EXPECT_LT(score.worst, noise_left(sigma));
    // Three of his channels' noise hide him where he is as bright as what is behind him.
    EXPECT_GT(score.recall, 0.9);
    EXPECT_GT(score.precision, 0.99);
  }
}

// The truth moves, and one picture stands for it. Of a pixel with two states it may be the one that
// is there a third of the time, or less where every second frame is looked at: twice as far from
// the truth as their mean.
TEST_P(Separation, TheDefaultIsNearAMovingBackground) {
  for (const auto& [text, precision] :
       {std::pair{"leaves", 0.6}, {"water", 0.9}, {"flicker", 0.6}}) {
    SCOPED_TRACE(text);
    const Score score = separate(text, EngineOptions().dmd, GetParam());
    EXPECT_LT(score.background, 2 * score.moved);
    EXPECT_GT(score.recall, 0.9);
    // A mask that is white everywhere has 0.02.
    EXPECT_GT(score.precision, precision);
  }
}

// ---- Plain Q-DMD ----

TEST_P(Separation, MaskIsTheMover) {
  for (const char* text : {"default", "noise=3", "low-rate=5"}) {
    SCOPED_TRACE(text);
    const Score score = separate(text, rank(1), GetParam());
    EXPECT_GT(score.recall, 0.9);
    EXPECT_GT(score.precision, 0.8);
    expect_ghost_of_mean(score);
  }
}

// A mode's noise is that of the frames divided by the root of their number; what is left is the
// faint ghost of a least-squares method.
TEST_P(Separation, NoiseIsAveragedOut) {
  for (const int kept : {0, 1, 3}) {
    const Score score = separate("noise=6", rank(kept), GetParam());
    const Score still = separate("default", rank(kept), GetParam());
    EXPECT_LT(score.background, score.input / 2);
    EXPECT_LT(score.background, still.background + noise_left(6));
    expect_ghost_of_mean(score);
    expect_ghost_of_mean(still);
  }
}

// L(t) varies in time: any one picture for the whole window is wrong by half of the change at one
// end of it, some 25 levels.
TEST_P(Separation, AFadeIsFollowed) {
  for (const int kept : {0, 1}) {
    const Score fading = separate("fade=0.4:duration=4,noise=2", rank(kept), GetParam());
    EXPECT_LT(fading.worst, 5);
    expect_ghost_of_mean(fading);
    EXPECT_GT(fading.recall, 0.9);
    EXPECT_GT(fading.precision, 0.9);
  }
}

// The mover stands for most of the window: one mode holds both or none, several take him apart.
TEST_P(Separation, RankOneIsSteadyWhereSomebodyStops) {
  const Score one = separate("stop=8", rank(1), GetParam());
  EXPECT_LT(one.background, one.input * 1.2);
  expect_ghost_of_mean(one);
  EXPECT_GT(one.recall, 0.8);
  // He and his ghost, where he stood or will, are equally large.
  EXPECT_GT(one.precision, 0.5);
}

// No farther from the truth than the ghost and the mean of what moves, which is the triangle
// inequality, or one state of it as above.
TEST_P(Separation, MovingBackgroundsStayInTheirPlace) {
  const Score still = separate("default", rank(1), GetParam());
  for (const auto& [text, precision] :
       {std::pair{"leaves", 0.25}, {"water", 0.5}, {"flicker", 0.5}}) {
    const Score score = separate(text, rank(1), GetParam());
    EXPECT_LT(score.background, still.background + std::min(4.0, 2 * score.moved)) << text;
    EXPECT_GT(score.recall, 0.9) << text;
    // A mask that is white everywhere has 0.02.
    EXPECT_GT(score.precision, precision) << text;
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, Separation, testing::Values(11, 12, 13));

}  // namespace
}  // namespace qdmd::test
