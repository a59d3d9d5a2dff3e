// SPDX-License-Identifier: LGPL-2.1-or-later
// The parts of robust Q-DMD that work on a coarse grid, but for the grid itself, against the slow
// and obvious way.
#include <numeric>

#include "core/learn/robust/stable_frames.h"
#include "core/passes/patch_density.h"
#include "tests/core/robust_util.h"
#include "tests/core/simd_targets.h"

namespace qdmd::test {
namespace {

struct Size {
  int rows, cols;
};
// Fewer cells than a patch, around a patch, and several bands of rows.
constexpr Size kGrids[] = {{1, 1}, {1, 7},  {2, 3},  {3, 2},   {4, 4},   {5, 5},
                           {6, 4}, {7, 11}, {16, 9}, {17, 16}, {20, 30}, {33, 6}};

// Pictures of which some are nearly alike, so that densities are neither 0 nor 1.
GridFrames related_frames(const Grid& grid, int count, std::mt19937& rng) {
  GridFrames frames = random_frames(grid, count, 0, 255, rng);
  std::normal_distribution<float> noise(0, 1);
  for (int t = 0; t < count; ++t) {
    if (t % 5 == 4) continue;
    const float sigma = static_cast<float>(t % 7);
    for (int c = 0; c < kChannels; ++c)
      for (size_t i = 0; i < grid.cells(); ++i)
        frames.plane(t, c)[i] = frames.plane(t % 2, c)[i] + sigma * noise(rng);
  }
  return frames;
}

// The sum of what the cells of the patches around (y, x) differ in, in steps of all channels.
struct PatchSum {
  int sum = 0, cells = 0;

  PatchSum(const Grid& grid, const GridFrames& frames, int s, int t, int y, int x,
           int radius = kPatchRadius) {
    for (int yy = y - radius; yy <= y + radius; ++yy)
      for (int xx = x - radius; xx <= x + radius; ++xx) {
        if (yy < 0 || yy >= grid.rows || xx < 0 || xx >= grid.cols) continue;
        const auto i = static_cast<size_t>(yy * grid.cols + xx);
        int d = 0;
        for (int c = 0; c < kChannels; ++c)
          d += std::abs(steps_of(frames.plane(s, c)[i]) - steps_of(frames.plane(t, c)[i]));
        sum += std::min(d, static_cast<int>(3 * kMostDistance * kStepsPerLevel));
        ++cells;
      }
  }
  int similar() const { return static_cast<int>(3 * kSimilar * kStepsPerLevel) * cells; }
};

// ---- Patches ----

TEST(FrameLists, ChosenFramesAreOfThoseThatShowIt) {
  FrameLists lists(2, 8);
  lists.take(1, [](size_t t) { return t % 2 == 1 || t == 6; });
  EXPECT_EQ(lists.count(1), 5u);
  EXPECT_EQ(lists.count_before(1, 6), 3u);
  lists.choose(1, [](size_t t) { return t == 3 || t == 7; });
  const std::vector<uint16_t> chosen = {3, 7};
  EXPECT_TRUE(std::ranges::equal(lists[1], chosen));
  EXPECT_EQ(lists.count(1), 5u);
  EXPECT_EQ(lists.count_before(1, 7), 4u);
  EXPECT_TRUE(lists[0].empty());
  EXPECT_EQ(lists.count(0), 0u);
}

TEST(Patches, LevelsHaveSixteenSteps) {
  for (int step = 0; step < 65536; ++step) {
    const float level = static_cast<float>(step) / kStepsPerLevel;
    ASSERT_EQ(steps_of(level), step);
    ASSERT_EQ(steps_of(level + 0.03f), step);
  }
  EXPECT_EQ(steps_of(255 / 0.01f), 65535);
}

TEST(Patches, DensityIsThatOfTheDoubleLoop) {
  std::mt19937 rng(6);
  Pool pool(1);
  for (const auto& [rows, cols] : kGrids) {
    SCOPED_TRACE(testing::Message() << rows << " x " << cols);
    const Grid grid = grid_of(rows, cols);
    for (int count : {1, 2, 3, 13, 17}) {
      const GridFrames frames = related_frames(grid, count, rng);
      std::vector<float> expected(grid.cells() * static_cast<size_t>(count));
      for (int t = 0; t < count; ++t)
        for (int y = 0; y < rows; ++y)
          for (int x = 0; x < cols; ++x) {
            int64_t alike = 0;
            for (int s = 0; s < count; ++s) {
              const PatchSum patch(grid, frames, s, t, y, x);
              alike += std::max(0, patch.similar() - patch.sum);
            }
            expected[static_cast<size_t>((t * rows + y) * cols + x)] =
                static_cast<float>(alike) /
                static_cast<float>(PatchSum(grid, frames, t, t, y, x).similar());
          }
      on_every_target([&, rows = rows, cols = cols] {
        BeforeTheEdge<float> density(expected.size());
        std::fill(density.begin(), density.end(), -1.0f);
        PatchFrames(grid, frames, count, &pool).density(count, &pool, density.data());
        // Sums of integers: exact.
        ASSERT_TRUE(std::equal(density.begin(), density.end(), expected.begin()));
        // Two frames by themselves.
        std::vector<float> alike(grid.cells());
        PatchFrames patches(grid, frames, count, &pool);
        for (int part = 0; part < patches.parts(); ++part)
          patches.alike(0, count - 1, part, 0, alike.data());
        for (int y = 0; y < rows; ++y)
          for (int x = 0; x < cols; ++x) {
            const PatchSum patch(grid, frames, 0, count - 1, y, x);
            ASSERT_EQ(alike[static_cast<size_t>(y * cols + x)],
                      static_cast<float>(std::max(0, patch.similar() - patch.sum)) /
                          static_cast<float>(patch.similar()));
          }
      });
    }
  }
}

// Levels beyond all that a camera has: a frame divided by a small gain.
TEST(Patches, SumsHaveRoomForAnyLevels) {
  Pool pool(1);
  const Grid grid = grid_of(9, 40);
  GridFrames frames(grid, 2);
  std::fill_n(frames.plane(1, 0), kChannels * grid.cells(), 25500.0f);
  const std::vector<int> reference(grid.cells(), 0);
  on_every_target([&] {
    std::vector<float> density(2 * grid.cells());
    std::vector<uint16_t> distance(2 * grid.cells());
    PatchFrames(grid, frames, 2, &pool).density(2, &pool, density.data());
    for (float d : density) ASSERT_EQ(d, 1);
    patch_distance(grid, frames, 2, reference.data(), &pool, distance.data());
    for (size_t cell = 0; cell < grid.cells(); ++cell) {
      ASSERT_EQ(distance[2 * cell], 0);
      ASSERT_EQ(distance[2 * cell + 1],
                kMostDistance * kChannels * kStepsPerLevel *
                    static_cast<float>(patch_cells(grid, static_cast<int>(cell) / grid.cols,
                                                   static_cast<int>(cell) % grid.cols)));
    }
  });
}

// Each adds the most that two frames can have in common.
TEST(Patches, SumsHaveRoomForFramesThatAreTheSame) {
  Pool pool(2);
  for (int count : {7, 8, 9, 40}) {
    const Grid grid = grid_of(30, 41);
    const GridFrames frames(grid, count);
    on_every_target([&] {
      std::vector<float> density(static_cast<size_t>(count) * grid.cells());
      PatchFrames(grid, frames, count, &pool).density(count, &pool, density.data());
      for (float d : density) ASSERT_EQ(d, static_cast<float>(count));
    });
  }
}

TEST(Patches, DistanceIsThatOfTheDoubleLoop) {
  std::mt19937 rng(7);
  Pool pool(2);
  // Distances of all frames, and of all but one, from any of them; more than a vector has.
  for (const auto& [count, known] : {std::pair{9, 9}, {33, 34}})
    for (const auto& [rows, cols] : kGrids) {
      SCOPED_TRACE(testing::Message() << rows << " x " << cols);
      const Grid grid = grid_of(rows, cols);
      const GridFrames frames = related_frames(grid, known, rng);
      std::vector<int> reference(grid.cells());
      for (int& t : reference) t = static_cast<int>(rng() % static_cast<unsigned>(known));
      on_every_target([&, rows = rows, cols = cols, count = count] {
        BeforeTheEdge<uint16_t> distance(grid.cells() * static_cast<size_t>(count));
        patch_distance(grid, frames, count, reference.data(), &pool, distance.data());
        for (int cell = 0; cell < rows * cols; ++cell)
          for (int t = 0; t < count; ++t) {
            const int other = reference[static_cast<size_t>(cell)];
            const PatchSum patch(grid, frames, t, other, cell / cols, cell % cols, kNearRadius);
            ASSERT_EQ(distance[static_cast<size_t>(cell * count + t)], patch.sum);
            ASSERT_EQ(patch_cells(grid, cell / cols, cell % cols), patch.cells);
          }
      });
    }
}

TEST(Patches, AnyNumberOfThreadsGivesTheSameBits) {
  std::mt19937 rng(8);
  constexpr int kCount = 21;
  const Grid grid = grid_of(67, 40);
  const GridFrames frames = related_frames(grid, kCount, rng);
  std::vector<int> reference(grid.cells());
  for (int& t : reference) t = static_cast<int>(rng() % kCount);
  const size_t size = grid.cells() * kCount;
  on_every_target([&] {
    std::vector<float> density(size), first_density;
    std::vector<uint16_t> distance(size), first_distance;
    for (int threads : {1, 2, 3, 8}) {
      Pool pool(threads);
      PatchFrames(grid, frames, kCount, &pool).density(kCount, &pool, density.data());
      patch_distance(grid, frames, kCount, reference.data(), &pool, distance.data());
      if (threads == 1) first_density = density, first_distance = distance;
      ASSERT_EQ(density, first_density) << threads;
      ASSERT_EQ(distance, first_distance) << threads;
    }
  });
}

// ---- Stable frames ----

// A scene of cells into which boxes can be put.
struct CellScene {
  Grid grid = grid_of(24, 32);
  int count;
  GridFrames frames;

  // A smooth background with a little noise.
  explicit CellScene(int count_, float sigma = 0.5f, uint32_t seed = 21)
      : count(count_), frames(grid, count_) {
    std::mt19937 rng(seed);
    std::normal_distribution<float> noise(0, sigma);
    for (int t = 0; t < count; ++t)
      for (int c = 0; c < kChannels; ++c)
        for (int y = 0; y < grid.rows; ++y)
          for (int x = 0; x < grid.cols; ++x)
            frames.plane(t, c)[y * grid.cols + x] = background(c, y, x) + noise(rng);
  }
  static float background(int c, int y, int x) {
    return 80 + 20 * static_cast<float>(c) + static_cast<float>(y) + 0.5f * static_cast<float>(x);
  }
  void box(int t, int top, int left, int size, float level) {
    for (int c = 0; c < kChannels; ++c)
      for (int y = std::max(0, top); y < std::min(grid.rows, top + size); ++y)
        for (int x = std::max(0, left); x < std::min(grid.cols, left + size); ++x)
          frames.plane(t, c)[y * grid.cols + x] = level + 9 * static_cast<float>(c);
  }
  StableFrames stable() const {
    Pool pool(2);
    return find_stable_frames(grid, frames, count, nullptr, &pool);
  }
  // Every frame chosen for a cell shows its background there, and some frame is chosen.
  void expect_background(const StableFrames& stable, int margin = 0) const {
    for (int y = margin; y < grid.rows - margin; ++y)
      for (int x = margin; x < grid.cols - margin; ++x) {
        const auto chosen = stable.of_cell[static_cast<size_t>(y * grid.cols + x)];
        ASSERT_FALSE(chosen.empty());
        ASSERT_TRUE(std::is_sorted(chosen.begin(), chosen.end()));
        for (int t : chosen)
          ASSERT_NEAR(frames.plane(t, 0)[y * grid.cols + x], background(0, y, x), 5)
              << "cell " << y << " " << x << " frame " << t;
      }
  }
};

// One for each cell.
std::vector<std::span<const uint16_t>> lists_of(const StableFrames& stable) {
  std::vector<std::span<const uint16_t>> lists;
  for (size_t cell = 0; cell < stable.of_cell.size(); ++cell) lists.push_back(stable.of_cell[cell]);
  return lists;
}

TEST(StableFramesOf, NothingMoves) {
  const CellScene scene(40);
  const StableFrames stable = scene.stable();
  scene.expect_background(stable);
  for (const auto chosen : lists_of(stable)) EXPECT_EQ(chosen.size(), 40u);
}

TEST(StableFramesOf, AMovingBoxIsLeftOut) {
  CellScene scene(60);
  for (int t = 0; t < 60; ++t) scene.box(t, 2 + t % 16, t * 3 % 28, 7, 200);
  const StableFrames stable = scene.stable();
  scene.expect_background(stable);
  for (const auto chosen : lists_of(stable)) EXPECT_GT(chosen.size(), 20u);
}

// The background is seen in less than a third of the frames, everything else is seen once.
TEST(StableFramesOf, TheLookThatFramesShareIsTheBackground) {
  CellScene scene(50);
  std::mt19937 rng(23);
  std::uniform_real_distribution<float> level(0, 255);
  for (int t = 0; t < 50; ++t)
    if (t % 10 >= 3)
      for (int y = 0; y < 24; y += 4)
        for (int x = 0; x < 32; x += 4) scene.box(t, y, x, 4, level(rng));
  scene.expect_background(scene.stable());
}

// It stands still for most of the window; its contour gives it away.
TEST(StableFramesOf, WhatStandsStillShowsByItsContour) {
  for (double share : {0.55, 0.7, 0.85}) {
    for (bool at_the_end : {false, true}) {
      CellScene scene(100);
      const int standing = static_cast<int>(100 * share);
      for (int t = 0; t < 100; ++t) {
        const bool there = at_the_end ? t >= 100 - standing : t < standing;
        if (there) scene.box(t, 8, 12, 8, 190);
      }
      SCOPED_TRACE(testing::Message() << share << (at_the_end ? " at the end" : " at the start"));
      scene.expect_background(scene.stable());
    }
  }
}

// Of somebody who stands for most of the window, the legs have nearly the ground's colour. They go
// with the rest.
TEST(StableFramesOf, FaintPartsGoWithTheirRegion) {
  CellScene scene(80);
  for (int t = 35; t < 80; ++t) {
    scene.box(t, 8, 12, 8, 190);
    for (int c = 0; c < kChannels; ++c)
      for (int y = 16; y < 18; ++y)
        for (int x = 12; x < 20; ++x) scene.frames.plane(t, c)[y * scene.grid.cols + x] += 8;
  }
  const StableFrames stable = scene.stable();
  scene.expect_background(stable);
  const auto lists = lists_of(stable);
  const std::vector<int>& rejected = stable.rejected.cells();
  for (int y = 8; y < 18; ++y)
    for (int x = 12; x < 20; ++x) {
      const int cell = y * scene.grid.cols + x;
      EXPECT_LT(lists[static_cast<size_t>(cell)].back(), 35) << y << " " << x;
      const auto at = std::lower_bound(rejected.begin(), rejected.end(), cell);
      const bool is_rejected = at != rejected.end() && *at == cell;
      // What differs less may be another light of the same.
      EXPECT_EQ(is_rejected, y < 16) << y << " " << x;
      for (size_t t = 0; is_rejected && t < 80; ++t)
        EXPECT_EQ(stable.rejected.shows(static_cast<size_t>(at - rejected.begin()), t), t >= 35)
            << y << " " << x << " " << t;
    }
}

// A part of the background with a contour of its own stays, whatever passes before it.
TEST(StableFramesOf, TheBackgroundMayHaveContours) {
  CellScene scene(80);
  for (int t = 0; t < 80; ++t) {
    scene.box(t, 6, 6, 9, 30);
    scene.box(t, 10 + t % 5, (5 * t) % 30, 6, 220);
  }
  const StableFrames stable = scene.stable();
  for (int y = 8; y < 13; ++y)
    for (int x = 8; x < 13; ++x)
      for (int t : stable.of_cell[static_cast<size_t>(y * 32 + x)])
        EXPECT_NEAR(scene.frames.plane(t, 0)[y * 32 + x], 30, 1) << y << " " << x;
}

TEST(StableFramesOf, AnyWindowAndGridHasSome) {
  std::mt19937 rng(25);
  Pool pool(3);
  for (const auto& [rows, cols] : kGrids)
    for (int count : {1, 2, 3, 17}) {
      const Grid grid = grid_of(rows, cols);
      for (bool same : {false, true}) {
        const GridFrames frames =
            same ? GridFrames(grid, count) : random_frames(grid, count, 0, 255, rng);
        const StableFrames stable = find_stable_frames(grid, frames, count, nullptr, &pool);
        ASSERT_EQ(stable.of_cell.size(), grid.cells());
        for (const auto chosen : lists_of(stable)) {
          ASSERT_FALSE(chosen.empty());
          ASSERT_GE(chosen.front(), 0);
          ASSERT_LT(chosen.back(), count);
          ASSERT_TRUE(std::is_sorted(chosen.begin(), chosen.end()));
          if (same) {
            ASSERT_EQ(chosen.size(), static_cast<size_t>(count));
          }
        }
      }
    }
}

// A part of what came was absorbed. Contours say that what is behind all of it is the background,
// but the frames that show that say nothing in that part any more.
TEST(StableFramesOf, LooksThatSayNothingAreNeverChosen) {
  CellScene scene(80);
  for (int t = 50; t < 80; ++t) scene.box(t, 8, 10, 8, 190);
  Pool pool(2);
  FirstLooks looks(scene.grid.cells());
  looks.absorbed = true;
  for (int y = 8; y < 16; ++y)
    for (int x = 10; x < 14; ++x) looks.from[static_cast<size_t>(y * scene.grid.cols + x)] = 55;
  const StableFrames stable =
      find_stable_frames(scene.grid, scene.frames, scene.count, nullptr, &pool, looks);
  const auto lists = lists_of(stable);
  for (size_t cell = 0; cell < lists.size(); ++cell) {
    ASSERT_FALSE(lists[cell].empty()) << cell;
    ASSERT_GE(lists[cell].front(), looks.from[cell]) << cell;
  }
}

// However strange what was known before is: a cell without frames would have no background.
TEST(StableFramesOfTheWorst, HaveAFrameForEachCell) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> level(0, 255), chance(0, 1);
  Pool pool(2);
  for (int trial = 0; trial < 20; ++trial) {
    const Grid grid = grid_of(6, 9);
    const size_t cells = grid.cells();
    GridFrames frames(grid, 21);
    // Half of the cells show the same in all frames, others never.
    for (size_t cell = 0; cell < cells; ++cell) {
      const bool same = chance(random) < 0.5f;
      for (int c = 0; c < 3; ++c) {
        const float shown = level(random);
        for (int t = 0; t < 21; ++t) frames.plane(t, c)[cell] = same ? shown : level(random);
      }
    }
    Recollection earlier = {std::vector<float>(cells, 50), std::vector<float>(cells, 0), {}};
    FirstLooks looks(cells);
    for (size_t cell = 0; cell < cells; ++cell) {
      looks.from[cell] = static_cast<uint16_t>(25 * chance(random));
      looks.earlier_counts[cell] = chance(random) < 0.5f;
    }
    const StableFrames stable =
        find_stable_frames(grid, frames, 20, &earlier, &pool, trial % 2 ? looks : FirstLooks());
    for (size_t cell = 0; cell < cells; ++cell)
      ASSERT_FALSE(stable.of_cell[cell].empty()) << "trial " << trial << ", cell " << cell;
  }
}

// ---- What earlier windows showed ----

// The last picture of `scene` is what an earlier window left, seen in `weight` frames.
StableFrames with_recollection(const CellScene& scene, float weight) {
  Pool pool(2);
  const Recollection earlier = {std::vector<float>(scene.grid.cells(), weight),
                                std::vector<float>(scene.grid.cells(), kSimilar / 2),
                                {}};
  return find_stable_frames(scene.grid, scene.frames, scene.count - 1, &earlier, &pool);
}

// Whatever solves before left in it, of fewer frames or more.
TEST(StableFramesRooms, ServeOneSolveAfterAnother) {
  CellScene scene(41);
  for (int t = 0; t < 40; ++t) scene.box(t, 8, 12, 8, 190);
  const Recollection earlier = {std::vector<float>(scene.grid.cells(), 20.0f),
                                std::vector<float>(scene.grid.cells(), kSimilar / 2),
                                {}};
  Pool pool(2);
  StableFramesRoom room(scene.grid, 30);
  room.density.assign(30 * scene.grid.cells(), 1e9f);
  room.steps.assign(room.steps.capacity(), 0xffff);
  for (const int count : {30, 7, 40, 1, 29, 40})
    for (const Recollection* known : {static_cast<const Recollection*>(nullptr), &earlier}) {
      const StableFrames anew = find_stable_frames(scene.grid, scene.frames, count, known, &pool);
      const StableFrames again =
          find_stable_frames(scene.grid, scene.frames, count, known, &pool, {}, &room);
      EXPECT_EQ(again.limit, anew.limit) << count;
      for (size_t cell = 0; cell < scene.grid.cells(); ++cell)
        ASSERT_TRUE(std::ranges::equal(again.of_cell[cell], anew.of_cell[cell])) << count;
    }
}

// It stands still in all frames of the window.
TEST(Recollections, ShowWhatIsBehindWhoeverStandsStill) {
  CellScene scene(41);
  for (int t = 0; t < 40; ++t) scene.box(t, 8, 12, 8, 190);
  scene.expect_background(with_recollection(scene, 20));
  // Without one nobody knows.
  const StableFrames alone =
      find_stable_frames(scene.grid, scene.frames, 40, nullptr, std::make_unique<Pool>(1).get());
  const auto inside = static_cast<size_t>(12 * scene.grid.cols + 16);
  EXPECT_NEAR(scene.frames.plane(alone.of_cell[inside][0], 0)[inside], 190, 1);
}

// Something that an earlier window had for background goes: what is behind has no contour.
TEST(Recollections, GiveWayToWhatWasBehind) {
  CellScene scene(41);
  scene.box(40, 8, 12, 8, 190);
  for (int t = 0; t < 4; ++t) scene.box(t, 8, 12, 8, 190);
  scene.expect_background(with_recollection(scene, 20));
}

TEST(Recollections, ChangeNothingWhereNothingMoved) {
  CellScene scene(41);
  const StableFrames stable = with_recollection(scene, 20);
  for (const auto chosen : lists_of(stable)) EXPECT_EQ(chosen.size(), 41u);
}

// Another scene: not a cell of what an earlier window left is seen, in none it has a say.
TEST(Recollections, OfAnotherSceneAreLeftOut) {
  CellScene scene(41);
  std::mt19937 rng(27);
  const GridFrames other = random_frames(scene.grid, 1, 0, 255, rng);
  for (int c = 0; c < kChannels; ++c)
    std::copy_n(other.plane(0, c), scene.grid.cells(), scene.frames.plane(40, c));
  for (float weight : {1.0f, 40.0f, 1000.0f}) {
    const StableFrames stable = with_recollection(scene, weight);
    scene.expect_background(stable);
    for (const auto chosen : lists_of(stable)) ASSERT_LT(chosen.back(), 40);
  }
}

// A weight is that of so many frames with this look.
TEST(Recollections, WeighLikeFrames) {
  std::mt19937 rng(28);
  for (const auto& [rows, cols] : kGrids) {
    const Grid grid = grid_of(rows, cols);
    // Ten frames of one look, then the recollection's look in some of them.
    for (int seen : {0, 3}) {
      GridFrames frames(grid, 11);
      for (int t = 0; t < 11; ++t)
        for (int c = 0; c < kChannels; ++c)
          std::fill_n(frames.plane(t, c), grid.cells(), t >= 10 - seen ? 90.0f : 150.0f);
      Pool pool(1);
      for (float weight : {1.0f, 6.0f, 20.0f}) {
        const Recollection earlier = {
            std::vector<float>(grid.cells(), weight), std::vector<float>(grid.cells(), 2.0f), {}};
        const StableFrames stable = find_stable_frames(grid, frames, 10, &earlier, &pool);
        // Not seen at all, it is another scene.
        const bool wins =
            seen > 0 && weight + static_cast<float>(seen) > 10.0f - static_cast<float>(seen);
        for (const auto chosen : lists_of(stable)) {
          ASSERT_EQ(chosen.back() == 10, wins) << seen << " seen, weight " << weight;
          ASSERT_EQ(chosen.front(), wins ? 10 - seen : 0);
        }
      }
    }
  }
}

}  // namespace
}  // namespace qdmd::test
