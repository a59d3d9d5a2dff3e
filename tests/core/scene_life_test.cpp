// SPDX-License-Identifier: LGPL-2.1-or-later
// What a camera on a wall sees in its life: people who come and stand, people who stood there and
// leave, moments without a picture, and another scene; for windows of any size, live and in batch.
#include <array>
#include <functional>
#include <random>
#include <tuple>

#include "tests/core/robust_util.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 96, kHeight = 72;
constexpr size_t kPixels = size_t{kWidth} * kHeight;
using Planes = std::vector<uint8_t>;

size_t at(int channel, int y, int x) {
  return static_cast<size_t>(channel) * kPixels + static_cast<size_t>(y * kWidth + x);
}

// ---- The world ----

// A picture whose left part, up to column `plain`, is plain; the rest has small stones of much
// contrast, whose edges are as strong as those of people.
Planes wall(unsigned seed, int plain = kWidth / 2) {
  constexpr int kStone = 3;
  std::mt19937 random(seed);
  Planes planes(3 * kPixels);
  for (int y = 0; y < kHeight; y += kStone)
    for (int x = 0; x < kWidth; x += kStone) {
      const int level =
          x < plain ? 111 + static_cast<int>(random() % 9) : 25 + static_cast<int>(random() % 181);
      for (int c = 0; c < 3; ++c)
        for (int yy = y; yy < y + kStone; ++yy)
          for (int xx = x; xx < x + kStone; ++xx)
            planes[at(c, yy, xx)] = static_cast<uint8_t>(level);
    }
  return planes;
}

// A person: a head, a jacket and trousers.
class Person {
 public:
  static constexpr int kWide = 12, kHigh = 32;
  explicit Person(std::mt19937* random) {
    for (auto& part : levels_) {
      // Of other colours than the wall: a shadow has those.
      const int sign = (*random)() % 2 ? 1 : -1;
      for (size_t c = 0; c < 3; ++c) {
        const auto off = 40 + static_cast<int>((*random)() % 20);
        part[c] = 118 + (c == 1 ? -sign : sign) * off;
      }
    }
  }
  static bool has(int y, int x) {
    if (y < 0 || y >= kHigh || x < 0 || x >= kWide) return false;
    return y >= 8 || (x >= 3 && x < 9);
  }
  int level(int channel, int y, int x) const {
    const size_t part = y < 8 ? 0 : y < 20 ? 1 : 2;
    return levels_[part][static_cast<size_t>(channel)] + (x + 2 * y) % 9;
  }

 private:
  std::array<std::array<int, 3>, 3> levels_{};
};

// Where somebody is: his upper left corner.
struct Walk {
  Person person;
  int top = 0;
  std::function<int(int frame)> left;

  bool covers(int frame, int y, int x) const { return Person::has(y - top, x - left(frame)); }
};

constexpr int kStep = 3;  // pixels a frame
// Comes from the nearer side and is there from frame `come` on; leaves to it from frame `leave` on.
std::function<int(int)> comes(int place, int come) {
  const int side = place < kWidth / 2 ? -1 : 1;
  return [=](int t) { return place + side * kStep * std::max(0, come - t); };
}
std::function<int(int)> leaves(int place, int leave) {
  const int side = place < kWidth / 2 ? -1 : 1;
  return [=](int t) { return place + side * kStep * std::max(0, t - leave); };
}
// Passes again and again.
std::function<int(int)> passes(int phase) {
  return [=](int t) { return 2 * ((t + phase) % 80) - 30; };
}

struct World {
  Planes wall;
  std::vector<Walk> walks;

  // What is there, and what a camera sees.
  Planes truth(int t) const {
    Planes planes = wall;
    for (const Walk& walk : walks)
      for (int y = 0; y < Person::kHigh; ++y)
        for (int x = 0; x < Person::kWide; ++x) {
          const int px = walk.left(t) + x, py = walk.top + y;
          if (!Person::has(y, x) || px < 0 || px >= kWidth || py < 0) continue;
          for (int c = 0; c < 3; ++c)
            planes[at(c, py, px)] = static_cast<uint8_t>(walk.person.level(c, y, x));
        }
    return planes;
  }
  bool somebody_at(int t, int y, int x) const {
    return std::any_of(walks.begin(), walks.end(),
                       [&](const Walk& walk) { return walk.covers(t, y, x); });
  }
};

// The noise of a camera, deviation 1.5 levels, in rows that begin anywhere in a table.
Planes with_noise(Planes planes, std::mt19937* random) {
  static const std::vector<int> kNoise = [] {
    std::mt19937 of_table(99);
    std::normal_distribution<double> normal(0, 1.5);
    std::vector<int> table(1 << 16);
    for (int& noise : table) noise = static_cast<int>(std::lround(normal(of_table)));
    return table;
  }();
  for (size_t row = 0; row < planes.size(); row += kWidth) {
    const size_t from = (*random)() % (kNoise.size() - kWidth);
    for (size_t x = 0; x < kWidth; ++x)
      planes[row + x] =
          static_cast<uint8_t>(std::clamp(planes[row + x] + kNoise[from + x], 0, 255));
  }
  return planes;
}

// ---- What comes out ----

struct Out {
  std::vector<uint8_t> mask;  // 1: foreground
  Planes background;

  // The share of somebody's pixels at a place that is foreground, and the background's distance
  // from a picture there.
  double white(const Walk& walk, int place) const {
    double hits = 0, all = 0;
    each(walk, place, [&](size_t p) { hits += mask[p], ++all; });
    return hits / all;
  }
  double off(const Walk& walk, int place, const Planes& from) const {
    double sum = 0, all = 0;
    each(walk, place, [&](size_t p) {
      for (size_t c = 0; c < 3; ++c, ++all)
        sum += std::abs(background[c * kPixels + p] - from[c * kPixels + p]);
    });
    return sum / all;
  }

 private:
  template <typename Work>
  static void each(const Walk& walk, int place, const Work& work) {
    for (int y = 0; y < Person::kHigh; ++y)
      for (int x = 0; x < Person::kWide; ++x)
        if (Person::has(y, x)) work(static_cast<size_t>((walk.top + y) * kWidth + place + x));
  }
};

struct Setting {
  Mode mode;
  int window;
};
std::string name_of(const Setting& setting) {
  return (setting.mode == Mode::live ? "Live" : "Batch") + std::to_string(setting.window);
}

class SceneLife : public testing::TestWithParam<Setting> {
 protected:
  // Frames of what the camera sees, in order; look(frame, out) for each that leaves.
  static void film(int frames, int64_t absorb_frames, const std::function<Planes(int frame)>& seen,
                   const std::function<void(int frame, const Out& out)>& look) {
    EngineOptions options = robust_of(GetParam().window);
    options.mode = GetParam().mode;
    Engine engine;
    ASSERT_TRUE(engine.configure(options, kWidth, kHeight).ok());
    Wishes wishes = first_wishes(options);
    wishes.absorb_frames = absorb_frames;
    int left = 0;
    const auto take = [&] {
      while (engine.next()) {
        PackedPicture mask(kWidth, kHeight), background(kWidth, kHeight);
        engine.next()->write(Output::mask, {}, mask.out());
        engine.next()->pop(Output::background, background.out());
        Out out;
        out.background = background.planes();
        out.mask.resize(kPixels);
        for (size_t p = 0; p < kPixels; ++p) out.mask[p] = mask.at(0, p) > 127;
        look(left++, out);
      }
    };
    for (int t = 0; t < frames; ++t) {
      PackedPicture picture(kWidth, kHeight);
      picture.fill(seen(t));
      ASSERT_TRUE(engine.push(picture.in(), &wishes).ok());
      take();
    }
    ASSERT_TRUE(engine.drain().ok());
    take();
    EXPECT_EQ(left, frames);
  }
};
const auto kSettings =
    testing::Values(Setting{Mode::batch, 25}, Setting{Mode::batch, 50}, Setting{Mode::batch, 100},
                    Setting{Mode::live, 25}, Setting{Mode::live, 50}, Setting{Mode::live, 100});
INSTANTIATE_TEST_SUITE_P(Settings, SceneLife, kSettings,
                         [](const auto& setting) { return name_of(setting.param); });

// Before the plain part of the wall, and before the other one.
constexpr std::array<int, 2> kPlaces = {16, 68};
// Of those who stand, and of those who pass behind them.
constexpr int kTop = 34, kBehind = -6;

// ---- Who comes, and who leaves ----

TEST_P(SceneLife, WhoComesAndStandsIsForegroundToTheEnd) {
  constexpr int kCome = 240, kFrames = 460;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    std::mt19937 random(seed);
    World world{wall(seed), {}};
    for (size_t i = 0; i < kPlaces.size(); ++i)
      world.walks.push_back(
          {Person(&random), kTop, comes(kPlaces[i], kCome + 30 * static_cast<int>(i))});
    world.walks.push_back({Person(&random), kBehind, passes(static_cast<int>(random() % 80))});
    // For ever, or for five minutes.
    film(
        kFrames, seed % 2 ? 0 : 7500, [&](int t) { return with_noise(world.truth(t), &random); },
        [&](int t, const Out& out) {
          for (size_t i = 0; i < kPlaces.size(); ++i) {
            const Walk& walk = world.walks[i];
            const double off = out.off(walk, kPlaces[i], world.wall);
            EXPECT_LT(off, 4) << "seed " << seed << ", place " << i << ", frame " << t;
            if (walk.left(t) != kPlaces[i]) continue;
            EXPECT_GT(out.white(walk, kPlaces[i]), 0.8)
                << "seed " << seed << ", place " << i << ", frame " << t;
          }
        });
  }
}

TEST_P(SceneLife, WhoStoodThereFromTheBeginningOnIsGoneOnceHeLeaves) {
  // A young scene takes longer in live: one of these people took 40 frames.
  const int slow = GetParam().mode == Mode::live ? 40 : 30;
  constexpr int kFrames = 400;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    std::mt19937 random(10 + seed);
    World world{wall(10 + seed), {}};
    // Early, while little is known, and late.
    std::array<int, 2> leave = {125, 260};
    if (seed % 2) std::swap(leave[0], leave[1]);
    std::array<int, 2> last{};  // frames in which he, or what is behind him, is wrong
    for (size_t i = 0; i < kPlaces.size(); ++i)
      world.walks.push_back({Person(&random), kTop, leaves(kPlaces[i], leave[i])});
    world.walks.push_back({Person(&random), kBehind, passes(static_cast<int>(random() % 80))});
    film(
        kFrames, 7500, [&](int t) { return with_noise(world.truth(t), &random); },
        [&](int t, const Out& out) {
          for (size_t i = 0; i < kPlaces.size(); ++i) {
            const Walk& walk = world.walks[i];
            if (t < leave[i] + Person::kWide / kStep) continue;
            if (out.white(walk, kPlaces[i]) >= 0.1 || out.off(walk, kPlaces[i], world.wall) >= 4)
              last[i] = t;
          }
        });
    for (size_t i = 0; i < kPlaces.size(); ++i)
      EXPECT_LT(last[i], leave[i] + Person::kWide / kStep + slow)
          << "seed " << seed << ", place " << i << ", left with frame " << leave[i];
  }
}

// ---- Moments without a picture ----

Planes flat(int level, int noise, std::mt19937* random) {
  Planes planes(3 * kPixels);
  for (uint8_t& sample : planes)
    sample = static_cast<uint8_t>(level + (noise > 0 ? static_cast<int>((*random)() % 9) - 4 : 0));
  return planes;
}
// All rows below a third repeat.
Planes smear(const Planes& of) {
  Planes planes = of;
  for (int c = 0; c < 3; ++c)
    for (int y = kHeight / 3; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) planes[at(c, y, x)] = of[at(c, kHeight / 3 - 1, x)];
  return planes;
}
// The mean of 9 x 9 pixels.
Planes blur(const Planes& of) {
  constexpr int kReach = 4;
  Planes planes(of.size());
  for (int c = 0; c < 3; ++c)
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        int sum = 0, count = 0;
        for (int yy = std::max(0, y - kReach); yy <= std::min(kHeight - 1, y + kReach); ++yy)
          for (int xx = std::max(0, x - kReach); xx <= std::min(kWidth - 1, x + kReach); ++xx)
            sum += of[at(c, yy, xx)], ++count;
        planes[at(c, y, x)] = static_cast<uint8_t>(sum / count);
      }
  return planes;
}
// A third of the blocks of 16 x 16 pixels show other places.
Planes lose_blocks(const Planes& of, std::mt19937* random) {
  Planes planes = of;
  for (int y = 0; y + 16 <= kHeight; y += 16)
    for (int x = 0; x + 16 <= kWidth; x += 16) {
      if ((*random)() % 3) continue;
      const auto from_y = static_cast<int>((*random)() % (kHeight - 16)),
                 from_x = static_cast<int>((*random)() % (kWidth - 16));
      for (int c = 0; c < 3; ++c)
        for (int yy = 0; yy < 16; ++yy)
          for (int xx = 0; xx < 16; ++xx)
            planes[at(c, y + yy, x + xx)] = of[at(c, from_y + yy, from_x + xx)];
    }
  return planes;
}

enum class Kind { grey, black, white, smear, blur, lost_blocks, frozen };
constexpr std::pair<Kind, const char*> kKinds[] = {
    {Kind::grey, "grey"},    {Kind::black, "black"}, {Kind::white, "white"},
    {Kind::smear, "smear"},  {Kind::blur, "blur"},   {Kind::lost_blocks, "lost blocks"},
    {Kind::frozen, "frozen"}};

Planes disturb(Kind kind, const Planes& seen, const Planes& before, std::mt19937* random) {
  switch (kind) {
    case Kind::grey:
      return flat(128, 4, random);
    case Kind::black:
      return flat(16, 0, random);
    case Kind::white:
      return flat(235, 0, random);
    case Kind::smear:
      return smear(seen);
    case Kind::blur:
      return blur(seen);
    case Kind::lost_blocks:
      return lose_blocks(seen, random);
    case Kind::frozen:
      return before;
  }
  return {};
}

// A moment from frame `from` on.
struct Moment {
  Kind kind;
  int from, length;
};

// The frames after it, of 45, whose masks are wrong, and those that miss who stands there.
struct Trace {
  int wrong = 0, lost = 0;
};

class SceneMoment : public SceneLife {
 protected:
  // plain: columns of the wall.
  Trace trace_of(const Moment& moment, unsigned seed, bool stands, int plain = kWidth / 2) {
    constexpr int kAfter = 45;
    const int until = moment.from + moment.length;
    std::mt19937 random(seed);
    World world{wall(seed, plain), {}};
    world.walks.push_back({Person(&random), kBehind, passes(static_cast<int>(seed))});
    const int place = kPlaces[seed / 2 % 2];
    if (stands) world.walks.push_back({Person(&random), kTop, comes(place, 135)});
    Planes before;
    Trace trace;
    film(
        until + kAfter, 0,
        [&](int t) {
          const Planes seen = with_noise(world.truth(t), &random);
          if (t < moment.from || before.empty()) before = seen;
          return t >= moment.from && t < until ? disturb(moment.kind, seen, before, &random) : seen;
        },
        [&](int t, const Out& out) {
          if (t < until) return;
          int errors = 0;
          for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x)
              errors += out.mask[at(0, y, x)] != world.somebody_at(t, y, x);
          trace.wrong += errors > static_cast<int>(kPixels / 100);
          trace.lost += stands && out.white(world.walks[1], place) < 0.5;
        });
    return trace;
  }
};

INSTANTIATE_TEST_SUITE_P(Settings, SceneMoment, kSettings,
                         [](const auto& setting) { return name_of(setting.param); });

// For half a second, and for a second, at any time of a window (live: from its first frame on);
// somebody came before and stands there all the time, or nobody does.
TEST_P(SceneMoment, LeavesNoTrace) {
  unsigned seed = 20;
  for (const int length : {12, 25})
    for (const auto& [kind, name] : kKinds) {
      ++seed;
      const bool stands = seed % 2 == 0;
      const bool live = GetParam().mode == Mode::live;
      const int from = live ? 300 : 205 + static_cast<int>(seed * 7 % 50);
      const Trace trace = trace_of({kind, from, length}, seed, stands);
      EXPECT_LE(trace.wrong, 5) << name << " of " << length << " from frame " << from << ", "
                                << trace.lost << " frames without "
                                << (stands ? "who stands there" : "anybody");
    }
}

// In the first window nobody knows what is usual, but most of its frames say that.
TEST_P(SceneMoment, InTheFirstWindowLeavesNoTrace) {
  if (GetParam().mode == Mode::live) GTEST_SKIP() << "no frame waits for those that say it";
  unsigned seed = 60;
  const int length = std::min(12, GetParam().window / 4);
  for (const int third : {1, 2})
    for (const auto& [kind, name] : kKinds) {
      ++seed;
      const int from = third * (GetParam().window - length) / 3;
      EXPECT_LE(trace_of({kind, from, length}, seed, false).wrong, 5)
          << name << " of " << length << " from frame " << from;
    }
  // At its ends, where it is more than an object. Grey and blur that a stream begins with leave a
  // short trace.
  for (const int from : {0, GetParam().window - length})
    for (const Kind kind : {Kind::grey, Kind::black, Kind::blur})
      EXPECT_LE(trace_of({kind, from, length}, ++seed, false, 0).wrong,
                from == 0 && kind != Kind::black ? length : 5)
          << static_cast<int>(kind) << " of " << length << " from frame " << from;
}

// ---- absorb-time ----

// Never before its end, and within two frames of it.
TEST_P(SceneLife, WhatStandsBecomesBackgroundWhenItsTimeIsOver) {
  constexpr int kCome = 130;
  for (const int absorb : {50, 100, 200}) {
    std::mt19937 random(30 + static_cast<unsigned>(absorb));
    World world{wall(31), {}};
    // Before both parts of the wall, at once.
    for (int place : kPlaces)
      world.walks.push_back(
          {Person(&random), kTop, [place](int t) { return t < kCome ? -100 : place; }});
    std::array<int, 2> last{};
    film(
        kCome + absorb + 60, absorb, [&](int t) { return with_noise(world.truth(t), &random); },
        [&](int t, const Out& out) {
          for (size_t i = 0; i < kPlaces.size(); ++i) {
            const double white = out.white(world.walks[i], kPlaces[i]);
            if (white > 0.2) last[i] = t;
            if (t < kCome || t >= kCome + absorb) continue;
            EXPECT_GT(white, 0.8) << "absorb " << absorb << ", place " << i << ", frame " << t;
          }
        });
    for (int t : last) EXPECT_LE(t, kCome + absorb + 1) << absorb;
  }
}

// ---- Another scene ----

TEST_P(SceneLife, ASceneThatWasLeftIsKnownAgainInItsSecondFrame) {
  constexpr int kLeft = 200, kBack = 275, kFrames = 360;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    std::mt19937 random(40 + seed);
    const World one{wall(40 + seed, 0), {{Person(&random), kBehind, passes(20)}}},
        other{wall(50 + seed, 0), {}};
    const auto there = [](int t) { return t >= kLeft && t < kBack; };
    int wrong = 0;
    double off = 0;
    film(
        kFrames, 0, [&](int t) { return with_noise((there(t) ? other : one).truth(t), &random); },
        [&](int t, const Out& out) {
          if (t < kBack + 1) return;
          int errors = 0;
          for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x)
              errors += out.mask[at(0, y, x)] != one.somebody_at(t, y, x);
          wrong += errors > static_cast<int>(kPixels / 100);
          off = std::max(off, mean_error(out.background, one.wall));
        });
    EXPECT_EQ(wrong, 0) << "seed " << seed;
    EXPECT_LT(off, 2.5) << "seed " << seed;
  }
}

}  // namespace
}  // namespace qdmd::test
