// SPDX-License-Identifier: LGPL-2.1-or-later
// Which pixels become landmarks, against the loop over each pixel by itself.
#include "core/align/landmarks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>
#include <tuple>
#include <vector>

namespace qdmd::test {
namespace {

struct Pixel {
  int x, y;
};

struct Picture {
  int width, height;
  std::vector<uint8_t> levels;

  int at(int x, int y) const { return levels[static_cast<size_t>(y * width + x)]; }
  GreyView view() const { return {levels.data(), width, height}; }
};

// `kinds` levels below 128: few of them make many pixels equally steep.
Picture random_picture(int width, int height, int kinds, uint32_t seed) {
  Picture picture = {width, height, std::vector<uint8_t>(static_cast<size_t>(width * height))};
  std::mt19937 engine(seed);
  std::uniform_int_distribution<int> kind(0, kinds - 1);
  for (uint8_t& level : picture.levels)
    level = static_cast<uint8_t>(kind(engine) * 127 / (kinds - 1));
  return picture;
}

// Sobel's slope, 8 times that of a pixel.
int slope(const Picture& picture, int x, int y, bool upright) {
  int sum = 0;
  for (int i = -1; i <= 1; ++i) {
    const int weight = i == 0 ? 2 : 1;
    sum += weight * (upright ? picture.at(x + 1, y + i) - picture.at(x - 1, y + i)
                             : picture.at(x + i, y + 1) - picture.at(x + i, y - 1));
  }
  return std::abs(sum);
}

// The steepest pixel of each square, in one direction and the other by turns; the first of equal
// ones. Two pixels along the border have none, and less than 5 levels a pixel is no edge.
std::vector<Pixel> landmarks_of(const Picture& picture, int most, const IgnoredAreas& ignored,
                                int scale) {
  std::vector<Pixel> found;
  const double area = static_cast<double>(picture.width) * picture.height;
  const int side = std::max(3, static_cast<int>(std::ceil(std::sqrt(area / most))));
  for (int row = 0; row < (picture.height - 4) / side; ++row)
    for (int col = 0; col < (picture.width - 4) / side; ++col) {
      Pixel best = {};
      int steepest = 0;
      for (int y = 2 + row * side; y < 2 + (row + 1) * side; ++y)
        for (int x = 2 + col * side; x < 2 + (col + 1) * side; ++x) {
          const int here = slope(picture, x, y, (row + col) % 2 == 0);
          if (here > steepest) steepest = here, best = {x, y};
        }
      if (steepest >= 40 && !ignored.has(best.x * scale, best.y * scale) &&
          static_cast<int>(found.size()) < most)
        found.push_back(best);
    }
  return found;
}

// The picture, 128 levels brighter everywhere but in what a landmark at one of the pixels looks at.
Picture changed_beside(const Picture& picture, const std::vector<Pixel>& pixels) {
  Picture changed = picture;
  for (uint8_t& level : changed.levels) level = static_cast<uint8_t>(level + 128);
  for (const Pixel& pixel : pixels)
    for (int y = pixel.y - 1; y <= pixel.y + 1; ++y)
      for (int x = pixel.x - 1; x <= pixel.x + 1; ++x)
        changed.levels[static_cast<size_t>(y * picture.width + x)] =
            static_cast<uint8_t>(picture.at(x, y));
  return changed;
}

void expect_landmarks(const Picture& picture, int most, const IgnoredAreas& ignored, int scale) {
  SCOPED_TRACE(testing::Message() << picture.width << "x" << picture.height << ", most " << most);
  const std::vector<Pixel> expected = landmarks_of(picture, most, ignored, scale);
  Landmarks landmarks(most);
  landmarks.choose(picture.view(), ignored, scale);
  ASSERT_EQ(landmarks.count(), static_cast<int>(expected.size()));
  ASSERT_GE(landmarks.count(), Landmarks::kFewest);
  // A landmark at any other place sees a brighter pixel: 8 levels at least.
  constexpr double kSame = 1.0 / 32;
  const auto share = [&](const std::vector<Pixel>& pixels) {
    return landmarks.share_within(changed_beside(picture, pixels).view(), 0, 0, {}, kSame);
  };
  EXPECT_EQ(share(expected), 1);
  // And the test sees those that are elsewhere, but for what a neighbour covers.
  std::vector<Pixel> moved = expected;
  for (Pixel& pixel : moved) pixel.x += pixel.x < picture.width / 2 ? 1 : -1;
  EXPECT_LT(share(moved), 0.5);
}

TEST(Landmarks, AreTheSteepestPixelOfEachPart) {
  for (const auto& [width, height, most] :
       {std::tuple{64, 48, 100}, {97, 31, 60}, {33, 130, 500}, {320, 240, 200}, {20, 20, 400}})
    for (uint32_t seed = 1; seed <= 3; ++seed)
      expect_landmarks(random_picture(width, height, 256, seed), most, {}, 1);
}

TEST(Landmarks, AreTheFirstOfPixelsThatAreEquallySteep) {
  for (uint32_t seed = 1; seed <= 5; ++seed)
    expect_landmarks(random_picture(120, 80, 3, seed), 60, {}, 1);
}

// Rows of a part are looked at in pieces.
TEST(Landmarks, OfPartsThatAreWiderThanWhatIsLookedAtTogether) {
  for (int kinds : {4, 256}) expect_landmarks(random_picture(1000, 700, kinds, 9), 40, {}, 1);
}

TEST(Landmarks, AreNotInIgnoredAreas) {
  IgnoredAreas ignored;
  ASSERT_TRUE(ignored.add({60, 40, 100, 60}));
  const Picture picture = random_picture(120, 80, 256, 4);
  expect_landmarks(picture, 80, ignored, 2);
  EXPECT_LT(landmarks_of(picture, 80, ignored, 2).size(), landmarks_of(picture, 80, {}, 2).size());
}

TEST(Landmarks, AreNotInNoise) {
  Picture picture = random_picture(80, 60, 256, 5);
  // A slope of 4 levels at most.
  for (uint8_t& level : picture.levels) level = static_cast<uint8_t>(100 + level % 5);
  Landmarks landmarks(100);
  landmarks.choose(picture.view(), {}, 1);
  EXPECT_EQ(landmarks.count(), 0);
  // Nor where there is no room for one.
  for (int side : {1, 4, 6}) {
    const Picture small = random_picture(side, side, 256, 6);
    landmarks.choose(small.view(), {}, 1);
    EXPECT_EQ(landmarks.count(), 0) << side;
  }
}

}  // namespace
}  // namespace qdmd::test
