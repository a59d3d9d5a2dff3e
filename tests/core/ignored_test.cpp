// SPDX-License-Identifier: LGPL-2.1-or-later
// Areas in which nothing is foreground, and from which nothing is learnt.
#include "core/base/ignored_areas.h"

#include "tests/core/engine_util.h"
#include "tests/core/mask_util.h"

namespace qdmd::test {
namespace {

bool covers(const Rectangle& area, int x, int y) {
  return x >= area.x && x < int64_t{area.x} + area.width && y >= area.y &&
         y < int64_t{area.y} + area.height;
}
bool covers(const IgnoredAreas& areas, int x, int y) {
  for (size_t i = 0; i < areas.size(); ++i)
    if (covers(areas[i], x, y)) return true;
  return false;
}

IgnoredAreas areas_of(std::initializer_list<Rectangle> rectangles) {
  IgnoredAreas areas;
  for (const Rectangle& rectangle : rectangles) EXPECT_TRUE(areas.add(rectangle));
  return areas;
}

TEST(IgnoredAreas, CoverAPictureOrDoNot) {
  constexpr int kWidth = 5, kHeight = 4;
  EXPECT_FALSE(IgnoredAreas().cover(kWidth, kHeight));
  std::mt19937 rng(341);
  int covered = 0;
  for (int round = 0; round < 2000; ++round) {
    IgnoredAreas areas;
    for (int i = 0; i < 4; ++i)
      areas.add({static_cast<int>(rng() % 6) - 2, static_cast<int>(rng() % 5) - 2,
                 1 + static_cast<int>(rng() % 8), 1 + static_cast<int>(rng() % 7)});
    bool all = true;
    for (int p = 0; p < kWidth * kHeight; ++p) all &= covers(areas, p % kWidth, p / kWidth);
    ASSERT_EQ(all, areas.cover(kWidth, kHeight)) << round;
    covered += all;
  }
  EXPECT_GT(covered, 100);
}

TEST(IgnoredAreas, ClearWhatTheyCover) {
  constexpr int kWidth = 23, kHeight = 11, kMost = std::numeric_limits<int>::max();
  std::mt19937 rng(340);
  for (int round = 0; round < 200; ++round) {
    IgnoredAreas areas;
    for (unsigned i = 0; i < rng() % 4; ++i)
      areas.add({static_cast<int>(rng() % 60) - 30, static_cast<int>(rng() % 40) - 20,
                 static_cast<int>(rng() % 30), static_cast<int>(rng() % 20)});
    if (round % 7 == 0) areas.add({20, -kMost, kMost, kMost});
    if (round % 7 == 1) areas.add({-kMost - 1, 3, kMost, kMost});
    std::vector<uint8_t> picture(kWidth * kHeight, 77), rows = picture;
    const size_t first = rng() % picture.size(), count = rng() % (picture.size() - first + 1);
    areas.clear_run(first, count, kWidth, picture.data() + first);
    const int top = static_cast<int>(rng() % kHeight), size = kHeight - top;
    areas.clear_rows(top, size, kWidth, rows.data());
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const auto p = static_cast<size_t>(y * kWidth + x);
        const bool inside = covers(areas, x, y);
        ASSERT_EQ(picture[p], inside && p >= first && p < first + count ? 0 : 77) << x << " " << y;
        ASSERT_EQ(rows[p], inside && y >= top ? 0 : 77) << x << " " << y;
      }
  }
}

TEST(IgnoredAreas, LeaveOutWhatHasNoPixelAndWhatIsTooMany) {
  IgnoredAreas areas;
  EXPECT_FALSE(areas.add({0, 0, 0, 5}));
  EXPECT_FALSE(areas.add({0, 0, 5, -1}));
  EXPECT_TRUE(areas.empty());
  for (size_t i = 0; i < IgnoredAreas::kMost; ++i) EXPECT_TRUE(areas.add({0, 0, 1, 1}));
  EXPECT_FALSE(areas.add({0, 0, 1, 1}));
  EXPECT_EQ(areas.size(), IgnoredAreas::kMost);
}

TEST(Ignored, IsBackground) {
  std::mt19937 rng(341);
  const Floor floor = grainy_floor(320, 240, rng);
  // Somebody stands half inside.
  Floor frame = with_noise(floor, 2, rng);
  frame.paint({100, 60, 60, 120}, {40, 60, 170});
  const auto areas = areas_of({{130, -10, 400, 120}, {-5, 230, 10, 50}, {1000, 1000, 5, 5}});
  const auto plain = Watcher(floor).mask_of(frame), masked = Watcher(floor).mask_of(frame, &areas);
  size_t taken = 0;
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x) {
      const size_t p = frame.index(x, y);
      if (covers(areas, x, y)) {
        taken += plain[p] == 255;
        ASSERT_EQ(masked[p], 0) << x << " " << y;
      } else if (!covers(areas, x + 3, y) && !covers(areas, x, y - 3)) {
        ASSERT_EQ(masked[p], plain[p]) << x << " " << y;
      }
    }
  EXPECT_GT(taken, 29u * 49u);
}

// A hole of the mask would be filled.
TEST(Ignored, IsBackgroundAmongForeground) {
  std::mt19937 rng(342);
  const Floor floor = grainy_floor(320, 240, rng);
  Floor frame = floor;
  frame.paint({50, 50, 200, 150}, {40, 60, 170});
  const auto areas = areas_of({{100, 100, 5, 4}, {200, 120, 1, 1}});
  Watcher watcher(floor);
  const auto mask = watcher.mask_of(frame, &areas);
  for (int y = 60; y < 190; ++y)
    for (int x = 60; x < 240; ++x)
      ASSERT_EQ(mask[frame.index(x, y)], covers(areas, x, y) ? 0 : 255) << x << " " << y;
}

TEST(Ignored, MayBeAllOfThePicture) {
  std::mt19937 rng(343);
  for (auto [width, height] : {std::pair{1, 1}, {1, 40}, {300, 2}, {130, 125}}) {
    const Floor floor = grainy_floor(width, height, rng);
    Floor frame = floor;
    frame.paint({0, 0, width, height}, {250, 0, 250});
    const auto areas = areas_of({{0, 0, width, height}});
    Watcher watcher(floor);
    for (int t = 0; t < 30; ++t)
      for (uint8_t sample : watcher.mask_of(frame, &areas)) ASSERT_EQ(sample, 0);
    for (uint8_t sample : watcher.mask_of(frame)) ASSERT_EQ(sample, 255);
  }
}

// Whatever went on there, masks are the same once it is ignored no longer. Leaves teach textures
// and, where those move, noise; a lamp that flickers teaches noise.
TEST(Ignored, TeachesNothing) {
  std::mt19937 rng(344);
  Pool pool(2);
  // Some cells of textures are partly inside.
  const Rectangle area = {40, 30, 167, 120};
  const auto areas = areas_of({area});
  const Floor floor = grainy_floor(320, 240, rng);
  const auto leaf = [&](Floor* frame, int x, int y) {
    const int from = std::clamp(x + static_cast<int>(rng() % 3) - 1, 0, 319);
    for (size_t c = 0; c < 3; ++c)
      frame->level[c][frame->index(x, y)] = floor.level[c][floor.index(from, y)];
  };
  for (bool noisy : {false, true}) {
    SCOPED_TRACE(noisy);
    Watcher busy(floor), quiet(floor), heedless(floor);
    if (noisy)
      for (Watcher* watcher : {&busy, &quiet, &heedless}) {
        watcher->threshold = 40;
        watcher->limits.assign(floor.pixels(), 30);
      }
    for (int t = 0; t < 120; ++t) {
      Floor still = with_noise(floor, 3, rng);
      for (int y = 0; y < 240; ++y)
        for (int x = 160; x < 320; ++x)
          if (!covers(area, x, y)) leaf(&still, x, y);
      Floor wild = still;
      for (int y = area.y; y < area.y + area.height; ++y)
        for (int x = area.x; x < area.x + area.width; ++x) {
          leaf(&wild, x, y);
          if (y < 60)
            for (auto& plane : wild.level) {
              uint8_t& sample = plane[wild.index(x, y)];
              sample = static_cast<uint8_t>(sample + 25 * (t % 2));
            }
        }
      const auto expected = quiet.mask_of(still, &areas);
      // Means of 3 x 3 pixels reach one pixel into the area.
      if (noisy)
        busy.mask_of(wild, &areas, &pool);
      else
        ASSERT_EQ(busy.mask_of(wild, &areas, &pool), expected) << t;
      heedless.mask_of(wild);
    }
    size_t taught = 0, wrong = 0;
    for (int t = 0; t < 20; ++t) {
      Floor frame = with_noise(floor, 6, rng);
      const Rectangle thing = {60 + t, 40, 140, 60};
      frame.paint(thing, {170, 100, 110});
      // Flat things are told by their look.
      for (int y = thing.y; y < thing.y + thing.height; ++y)
        for (int x = thing.x; x < thing.x + thing.width; ++x) {
          const auto grain = static_cast<int>(rng() % 81) - 40;
          for (auto& plane : frame.level) {
            uint8_t& sample = plane[frame.index(x, y)];
            sample = static_cast<uint8_t>(sample + grain);
          }
        }
      const auto expected = quiet.mask_of(frame), mask = busy.mask_of(frame),
                 other = heedless.mask_of(frame);
      for (int y = area.y + 5; y < area.y + area.height - 5; ++y)
        for (int x = area.x + 5; x < area.x + area.width - 5; ++x) {
          const size_t p = frame.index(x, y);
          wrong += mask[p] != expected[p];
          taught += other[p] != expected[p];
        }
      if (!noisy) {
        ASSERT_EQ(mask, expected) << t;
      }
    }
    EXPECT_EQ(wrong, 0u);
    EXPECT_GT(taught, 1000u) << "who does not ignore it learns";
  }
}

// A screen that flickers in a third of the picture.
struct Screen {
  Rectangle area = {0, 0, 64, 60};
  std::mt19937 rng{345};
  Floor floor = grainy_floor(160, 60, rng);
  std::vector<Floor> frames;

  explicit Screen(int count) {
    for (int t = 0; t < count; ++t) {
      frames.push_back(with_noise(floor, 2, rng));
      if (t % 3 == 0) frames.back().paint(area, {250, 250, t % 2 ? 250 : 60});
    }
  }
};

TEST(Ignored, SaysNothingInStatistics) {
  Screen screen(40);
  for (Mode mode : {Mode::batch, Mode::live}) {
    for (bool ignored : {false, true}) {
      EngineOptions options;
      options.mode = mode;
      options.window_size = 40;
      Engine engine;
      ASSERT_TRUE(engine.configure(options, 160, 60).ok());
      Wishes wishes = first_wishes(options);
      if (ignored) wishes.ignored = areas_of({screen.area});
      PackedPicture picture(160, 60, 3);
      for (const Floor& frame : screen.frames) {
        picture.fill(frame.planes());
        ASSERT_TRUE(engine.push(picture.in(), &wishes).ok());
        while (engine.next()) engine.next()->pop(Output::mask, picture.out());
      }
      ASSERT_TRUE(engine.drain().ok());
      while (engine.next()) engine.next()->pop(Output::mask, picture.out());
      const ForegroundStatistics seen = engine.report().solve.foreground;
      EXPECT_GT(seen.noise, 1);
      EXPECT_LT(seen.noise, 4);
      if (ignored)
        EXPECT_LT(seen.ratio, 0.001);
      else
        EXPECT_GT(seen.ratio, 0.05);
    }
  }
}

TEST(Ignored, MayBeAllOfWhatStatisticsLookAt) {
  Screen screen(12);
  EngineOptions options;
  options.window_size = 12;
  Engine engine;
  ASSERT_TRUE(engine.configure(options, 160, 60).ok());
  Wishes wishes = first_wishes(options);
  wishes.ignored = areas_of({{0, 0, 160, 60}});
  PackedPicture picture(160, 60, 3);
  for (const Floor& frame : screen.frames) {
    picture.fill(frame.planes());
    ASSERT_TRUE(engine.push(picture.in(), &wishes).ok());
  }
  ASSERT_TRUE(engine.next());
  const ForegroundStatistics seen = engine.report().solve.foreground;
  EXPECT_EQ(seen.ratio, 0);
  EXPECT_EQ(seen.noise, 0);
  EXPECT_EQ(seen.threshold, 18);
}

// From frame to frame: each has the areas that are set when it leaves.
TEST(Ignored, ChangesFromFrameToFrame) {
  std::mt19937 rng(346);
  const Floor floor = grainy_floor(160, 120, rng);
  EngineOptions options;
  options.window_size = 20;
  Engine engine;
  ASSERT_TRUE(engine.configure(options, 160, 120).ok());
  PackedPicture picture(160, 120, 3);
  int left = 0;
  const auto pop = [&] {
    for (; engine.next(); ++left) {
      const bool ignored = left % 2 == 1;
      Wishes wishes = first_wishes(options);
      if (ignored) wishes.ignored = areas_of({{0, 0, 160, 120}});
      std::vector<uint8_t> mask(floor.pixels()), residual(floor.pixels());
      engine.next(&wishes)->foreground(mask.data(), residual.data());
      engine.next()->pop(Output::mask, picture.out());
      const auto planes = picture.planes();
      ASSERT_TRUE(std::equal(mask.begin(), mask.end(), planes.begin()));
      const auto white = std::count(mask.begin(), mask.end(), uint8_t{255});
      if (ignored)
        EXPECT_EQ(white, 0) << left;
      else
        EXPECT_NEAR(double(white), 20 * 60, 40) << left;
    }
  };
  for (int t = 0; t < 40; ++t) {
    Floor frame = with_noise(floor, 2, rng);
    frame.paint({7 * t % 140, 30, 20, 60}, {40, 60, 170});
    picture.fill(frame.planes());
    ASSERT_TRUE(engine.push(picture.in()).ok());
    pop();
  }
  ASSERT_TRUE(engine.drain().ok());
  pop();
  EXPECT_EQ(left, 40);
}

}  // namespace
}  // namespace qdmd::test
