// SPDX-License-Identifier: LGPL-2.1-or-later
// What stood somewhere before a restart, and what was known of it, is known after it.
#include <cmath>
#include <functional>
#include <random>

#include "core/model/learnt_file.h"
#include "tests/core/learnt_version_2.h"
#include "tests/core/robust_util.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 96, kHeight = 64;
constexpr size_t kPixels = size_t{kWidth} * kHeight;
// The scene is known by then; he has come, and stands.
constexpr int kComes = 230, kStands = 282;
constexpr int kNobody = -1000;

// Blocks of 12x8 pixels.
int block_level(int seed, size_t channel, int x, int y) {
  const int block = 7919 * (seed + x / 12) + 104729 * (y / 8) + 31 * static_cast<int>(channel);
  return 60 + block % 127;
}

// A wall with a dark sign, and blocks above and below. The sign's edges are stronger than those of
// a man before it: they say that the sign has come, and the man is behind it. Or a wall without.
enum class Wall { sign, bare };
int wall_level(Wall wall, size_t channel, int x, int y) {
  if (y < 16 || y >= 48) return block_level(1, channel, x, y);
  const bool sign = wall == Wall::sign && x >= 44 && x < 52 && y >= 20 && y < 44;
  return (sign ? 60 : 120) + 6 * static_cast<int>(channel) + (x + y) % 5;
}

// The picture with a man whose left edge is at `left`.
std::vector<uint8_t> picture(Wall wall, int t, int left) {
  std::minstd_rand rng(static_cast<unsigned>(t + 1));
  std::vector<uint8_t> planes;
  for (size_t channel = 0; channel < 3; ++channel)
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const bool man = x >= left && x < left + 8 && y >= 20 && y < 44;
        const int level = man ? 155 + (x - left) % 3 : wall_level(wall, channel, x, y);
        planes.push_back(static_cast<uint8_t>(level + static_cast<int>(rng() / 1000 % 5) - 2));
      }
  return planes;
}
// Where he is who comes at kComes, and stays.
int walks_in(int t) { return t < kComes ? kNobody : std::min(44, t - kComes - 8); }

class Camera {
 public:
  explicit Camera(const EngineOptions& options, int64_t absorb_frames = 0, Wall wall = Wall::sign)
      : wishes_(first_wishes(options)), wall_(wall) {
    EXPECT_TRUE(engine_.configure(options, kWidth, kHeight).ok());
    wishes_.absorb_frames = absorb_frames;
  }
  // Frames first .. end - 1.
  void film(int first, int end, const std::function<int(int t)>& left_of) {
    for (int t = first; t < end; ++t) push(picture(wall_, t, left_of(t)));
  }
  void push(const std::vector<uint8_t>& planes) {
    PackedPicture packed(kWidth, kHeight);
    packed.fill(planes);
    EXPECT_TRUE(engine_.push(packed.in(), &wishes_).ok());
    take();
  }
  void end() {
    EXPECT_TRUE(engine_.drain().ok());
    take();
  }
  Learnt save() {
    Learnt learnt, read;
    EXPECT_TRUE(engine_.learnt(&learnt));
    EXPECT_TRUE(unpack(pack(learnt), &read).ok());
    return read;
  }
  void load(const Learnt& learnt) { EXPECT_TRUE(engine_.learn_from(learnt).ok()); }
  // Of the frames that left: the share of the sign that is foreground, and how far the background
  // is from the sign.
  const std::vector<double>& white() const { return white_; }
  const std::vector<double>& away() const { return away_; }

 private:
  void take() {
    while (engine_.next()) {
      PackedPicture mask(kWidth, kHeight), background(kWidth, kHeight);
      engine_.next()->write(Output::background, {}, background.out());
      engine_.next()->pop(Output::mask, mask.out());
      double white = 0, away = 0;
      for (int y = 22; y < 42; ++y)
        for (int x = 45; x < 51; ++x) {
          const auto p = static_cast<size_t>(y * kWidth + x);
          white += mask.at(0, p) > 0;
          for (size_t c = 0; c < 3; ++c)
            away += std::abs(background.at(c, p) - wall_level(wall_, c, x, y)) / 3.0;
        }
      white_.push_back(white / 120);
      away_.push_back(away / 120);
    }
  }

  Engine engine_;
  Wishes wishes_;
  Wall wall_;
  std::vector<double> white_, away_;
};

class Restart : public testing::TestWithParam<Mode> {
 protected:
  EngineOptions options(Mode mode) const {
    EngineOptions options = robust_of(50);
    options.mode = mode;
    return options;
  }
  EngineOptions options() const { return options(GetParam()); }
  // What is known after so many frames of `left_of`.
  Learnt known_after(int frames, const std::function<int(int t)>& left_of = walks_in,
                     int64_t absorb_frames = 0, Wall wall = Wall::sign) const {
    Camera camera(options(), absorb_frames, wall);
    camera.film(0, frames, left_of);
    return camera.save();
  }
};
INSTANTIATE_TEST_SUITE_P(Modes, Restart, testing::Values(Mode::batch, Mode::live),
                         [](const auto& mode) {
                           return mode.param == Mode::live ? "Live" : "Batch";
                         });

void expect_foreground(const Camera& camera, size_t first, size_t end) {
  ASSERT_LE(end, camera.white().size());
  for (size_t t = first; t < end; ++t) {
    ASSERT_GT(camera.white()[t], 0.9) << t;
    ASSERT_LT(camera.away()[t], 4) << t;
  }
}
void expect_background(const Camera& camera, size_t first, size_t end) {
  ASSERT_LE(end, camera.white().size());
  for (size_t t = first; t < end; ++t) ASSERT_LT(camera.white()[t], 0.1) << t;
}

TEST_P(Restart, WhoeverStoodIsForegroundStill) {
  // The other mode takes the file, too.
  for (Mode mode : {Mode::batch, Mode::live})
    for (int saved : {kStands + 8, kStands + 40, kStands + 140}) {
      SCOPED_TRACE(saved);
      const Learnt learnt = known_after(saved);
      Camera camera(options(mode));
      camera.load(learnt);
      camera.film(saved, saved + 230, walks_in);
      camera.end();
      expect_foreground(camera, 0, 230);
    }
}

TEST_P(Restart, TheTimeThatHeStoodCounts) {
  constexpr int kSaved = kStands + 100, kAbsorb = 250;
  Camera camera(options(), kAbsorb);
  camera.load(known_after(kSaved, walks_in, kAbsorb));
  camera.film(kSaved, kSaved + 250, walks_in);
  camera.end();
  const int end = kStands + kAbsorb - kSaved;
  // His look came a bit earlier where he had been before he stood.
  expect_foreground(camera, 0, static_cast<size_t>(end - 15));
  expect_background(camera, static_cast<size_t>(end + 10), 250);
}

TEST_P(Restart, WhatWasAbsorbedIsBackgroundUntilItGoes) {
  constexpr int kAbsorb = 120, kGoes = 170;
  const int absorbed = kStands + kAbsorb + (GetParam() == Mode::batch ? 60 : 0);
  // Before the next window is told, and after that.
  for (int saved : {absorbed + 3, absorbed + 40, absorbed + 110}) {
    SCOPED_TRACE(saved);
    const auto left_of = [&](int t) {
      return t < saved + kGoes ? walks_in(t) : 44 + 3 * (t - saved - kGoes);
    };
    Camera camera(options(), kAbsorb, Wall::bare);
    camera.load(known_after(saved, left_of, kAbsorb, Wall::bare));
    camera.film(saved, saved + kGoes + 100, left_of);
    camera.end();
    expect_background(camera, 0, kGoes - 1);
    expect_background(camera, kGoes + 50, kGoes + 100);
    for (size_t t = kGoes + 50; t < kGoes + 100; ++t) EXPECT_LT(camera.away()[t], 4) << t;
  }
}

TEST_P(Restart, WhoeverHasLeftMeanwhileIsGone) {
  const Learnt learnt = known_after(kStands + 100);
  Camera camera(options());
  camera.load(learnt);
  camera.film(0, 200, [](int) { return kNobody; });
  camera.end();
  expect_background(camera, 0, 200);
  for (double away : camera.away()) EXPECT_LT(away, 4);
}

// What comes is judged by what moved from the first frame on: a scene that was loaded is not new.
TEST_P(Restart, WhoeverComesThenIsForeground) {
  const Learnt learnt = known_after(kComes);
  Learnt before = learnt;
  before.earlier.value().places.clear();
  // So it is with a file of the version before.
  for (const Learnt& known : {learnt, before}) {
    Camera camera(options());
    camera.load(known);
    constexpr int kLater = 200;
    camera.film(kLater, kLater + 300, walks_in);
    camera.end();
    expect_foreground(camera, kStands + 5 - kLater, 300);
  }
}

// What frames have shown is newer than a file.
TEST_P(Restart, WhoeverStandsThereBeforeAFileIsLoadedStaysForeground) {
  const Learnt learnt = known_after(kComes);
  Camera camera(options());
  camera.film(0, kStands + 100, walks_in);
  camera.load(learnt);
  camera.film(kStands + 100, kStands + 300, walks_in);
  camera.end();
  expect_foreground(camera, kStands + 5, kStands + 300);
}

// What was known of a scene is known again when the camera is back.
TEST_P(Restart, AScenesReturnIsNone) {
  if (GetParam() == Mode::batch) GTEST_SKIP() << "windows that are collected tell of one scene";
  std::vector<uint8_t> other;
  for (size_t channel = 0; channel < 3; ++channel)
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        other.push_back(static_cast<uint8_t>(block_level(50, channel, x, y)));
  constexpr int kOther = kStands + 80, kBack = kOther + 60;
  Camera camera(options());
  camera.film(0, kOther, walks_in);
  for (int t = kOther; t < kBack; ++t) camera.push(other);
  camera.film(kBack, kBack + 200, walks_in);
  camera.end();
  expect_foreground(camera, kBack + 3, kBack + 200);
}

// A file of the version before is of use to the element of today.
TEST(Restarted, AFileOfTheVersionBefore) {
  Learnt learnt;
  ASSERT_TRUE(unpack(kLearntVersion2, &learnt).ok());
  for (Mode mode : {Mode::batch, Mode::live}) {
    EngineOptions options = robust_of(16);
    options.mode = mode;
    Engine engine;
    ASSERT_TRUE(engine.configure(options, 8, 6).ok());
    ASSERT_TRUE(engine.learn_from(learnt).ok());
    Learnt known;
    ASSERT_TRUE(engine.learnt(&known));
    EXPECT_EQ(known.earlier.value().weight, learnt.earlier.value().weight);
    EXPECT_EQ(known.earlier->looked, learnt.earlier->looked);
    for (const LearntPlace& place : known.earlier->places)
      EXPECT_EQ(place.since, LearntPlace::kNever);
    for (int t = 0; t < 40; ++t) {
      PackedPicture packed(8, 6);
      packed.fill(std::vector<uint8_t>(3 * 48, static_cast<uint8_t>(80 + t % 3)));
      ASSERT_TRUE(engine.push(packed.in()).ok());
      while (engine.next()) engine.next()->pop(Output::mask, packed.out());
    }
  }
}

}  // namespace
}  // namespace qdmd::test
