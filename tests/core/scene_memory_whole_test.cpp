// SPDX-License-Identifier: LGPL-2.1-or-later
// What is proved of the whole picture, what solves are told, and what is forgotten.
#include "tests/core/memory_stage.h"

namespace qdmd::test {
namespace {

// ---- Most of the picture ----

TEST(SceneMemory, MostOfThePictureIsNoObjectOnceItLasts) {
  for (const RegionContours& contour : {clear(), weaker()}) {
    Stage stage;
    stage.say(contour);
    stage.frames(50);
    const Rect half = {0, 0, kRows, kCols / 2};
    const int inside = stage.cell(12, 5);
    stage.show(half, 180);
    const int64_t since = stage.number + 1;
    for (int i = 0; i < kLasts; ++i) {
      ASSERT_TRUE(stage.frames(1).empty());
      ASSERT_FALSE(stage.memory.uncovered().any()) << i;
      // Nothing is learnt of it meanwhile.
      if (i < kSteady) continue;
      const Proofs proofs = stage.proofs();
      ASSERT_EQ(proofs.came[static_cast<size_t>(inside)], 1) << i;
      ASSERT_EQ(proofs.since[static_cast<size_t>(inside)], Proofs::kUnsure) << i;
    }
    EXPECT_EQ(stage.asked, 0);
    stage.frames(1);
    EXPECT_EQ(stage.memory.uncovered().since(inside), since);
    EXPECT_FALSE(stage.memory.uncovered().has(stage.cell(12, 25)));
    EXPECT_FALSE(stage.proofs().any);
  }
}

// Half a second of something else leaves no trace.
TEST(SceneMemory, DisturbancesOfMostOfThePictureAreForgotten) {
  for (int frames : {5, 12, 25, 60}) {
    Stage stage;
    stage.say(clear());
    stage.frames(50);
    stage.show({0, 0, kRows, kCols}, 128);
    stage.frames(frames);
    stage.show({0, 0, kRows, kCols}, kFloor);
    for (int i = 0; i < 100; ++i) ASSERT_TRUE(stage.frames(1).empty()) << frames;
    EXPECT_FALSE(stage.memory.uncovered().any());
    EXPECT_FALSE(stage.proofs().any) << frames;
  }
}

// Something came before, and stands there after the disturbance: it came.
TEST(SceneMemory, WhatCameGoesOnAfterADisturbance) {
  Stage stage;
  stage.bag_comes();
  const int64_t since = stage.number + 1;
  stage.frames(kCame + kSteady);
  const std::vector<float> with_bag = stage.shown;
  stage.say(clear());
  stage.show({0, 0, kRows, kCols}, 128);
  stage.frames(25);
  stage.shown = with_bag;
  EXPECT_GT(stage.frames_until_found(100), 100);
  EXPECT_EQ(stage.proofs().since[static_cast<size_t>(stage.cell(10, 12))], since);
}

// A lens out of focus: contours are weak all over, at once, and nothing goes anywhere.
Rect tile_part(int row, int col) { return {row * kRows / 4 + 1, col * kCols / 4 + 2, 3, 4}; }

TEST(SceneMemory, WhatChangesAllOverAtOnceWaits) {
  for (int tiles : {7, 8, 16}) {
    Stage stage;
    stage.say(much_stronger());
    stage.frames(50);
    for (int i = 0; i < tiles; ++i) stage.show(tile_part(i / 4, i % 4), 140);
    EXPECT_EQ(stage.frames_until_found(kCame - 1), tiles < 8 ? kSteady : kCame) << tiles;
    // It passes.
    stage.show({0, 0, kRows, kCols}, kFloor);
    stage.know_what_is_seen();
    EXPECT_GT(stage.frames_until_found(100), 100) << tiles;
  }
}

// So much goes on between them that something brought them.
TEST(SceneMemory, WhatChangesAllOverWhileMuchGoesOnDoesNot) {
  Stage stage;
  stage.say(clear());
  stage.frames(50);
  for (int i = 0; i < 16; ++i) stage.show(tile_part(i / 4, i % 4), 140);
  stage.passes([](int row, int col) {
    for (int i = 0; i < 16; ++i)
      if (tile_part(i / 4, i % 4).wider(1).has(row, col)) return false;
    return true;
  });
  EXPECT_EQ(stage.frames_until_found(kCame), kSteady);
}

// Where they do not come at once they are many objects.
TEST(SceneMemory, WhatChangesAllOverAtDifferentTimesDoesNot) {
  constexpr int kApart = 6;
  Stage stage;
  stage.say(much_stronger());
  stage.frames(50);
  for (int t = 0; t < 16 * kApart + kSteady; ++t) {
    if (t % kApart == 0 && t < 16 * kApart)
      stage.show(tile_part(t / kApart / 4, t / kApart % 4), 140);
    const std::vector<int> found = stage.frames(1);
    const int known = t - kSteady + 1;
    if (known < 0 || known % kApart != 0 || known / kApart >= 16) continue;
    const int newest = known / kApart;
    EXPECT_TRUE(has_all(found, tile_part(newest / 4, newest % 4))) << newest;
  }
}

// ---- Young scenes ----

TEST(SceneMemory, YoungScenesAreJudgedByTheContoursOfCells) {
  constexpr int kYoung = 200;
  for (bool leaves : {false, true}) {
    Stage stage(true);
    // Full resolution would say the contrary.
    stage.say(leaves ? weaker() : clear());
    if (leaves)
      stage.bag_leaves();
    else
      stage.bag_comes();
    EXPECT_TRUE(stage.memory.young());
    const std::vector<int> left = stage.frames(kSteady);
    EXPECT_EQ(!left.empty(), leaves);
    EXPECT_EQ(has_all(left, kPlace), leaves);
    EXPECT_EQ(stage.asked, 0);
    const Proofs proofs = stage.proofs();
    EXPECT_TRUE(proofs.young);
    EXPECT_FALSE(proofs.any);
  }
  // Full resolution decides from then on.
  Stage stage(true);
  stage.say(weaker());
  stage.frames(kYoung - 1);
  EXPECT_TRUE(stage.memory.young());
  stage.frames(1);
  EXPECT_FALSE(stage.memory.young());
  stage.bag_leaves();
  EXPECT_GT(stage.frames_until_found(100), 100);
  EXPECT_GT(stage.asked, 0);
}

// ---- What solves are told ----

TEST(SceneMemory, SolvesAreToldWhatCameAndSinceWhen) {
  Stage stage;
  stage.bag_comes();
  const int64_t since = stage.number + 1;
  // Nothing stands there yet.
  stage.frames(kSteady - 1);
  EXPECT_FALSE(stage.proofs().any);
  for (int frames = kSteady; frames < 2 * kCame; ++frames) {
    stage.frames(1);
    const Proofs proofs = stage.proofs();
    ASSERT_TRUE(proofs.any);
    ASSERT_FALSE(proofs.young);
    // From the change on, kCame frames later.
    const int64_t expected = frames > kCame ? since : Proofs::kUnsure;
    for (int row = 0; row < kRows; ++row)
      for (int col = 0; col < kCols; ++col) {
        const auto cell = static_cast<size_t>(stage.cell(row, col));
        // It reaches two cells further.
        ASSERT_EQ(proofs.came[cell] != 0, kPlace.wider(2).has(row, col)) << row << ' ' << col;
        if (!proofs.came[cell]) continue;
        ASSERT_EQ(proofs.since[cell], expected) << frames;
      }
  }
  // It goes, and the next solve knows nothing of it; `solve` had it before.
  Proofs solve = stage.proofs();
  stage.show(kPlace, kFloor);
  stage.frames(kSteady + 1);
  stage.memory.hand_over(&solve);
  EXPECT_FALSE(solve.any);
  EXPECT_EQ(std::count(solve.came.begin(), solve.came.end(), 1), 0);
}

// Beside what came, what was uncovered is not taken for its rim.
TEST(SceneMemory, TheRimOfWhatCameIsNotWhatWasUncovered) {
  const Rect came = {8, 20, 8, 4};
  Stage stage;
  stage.frames(50);
  stage.show(came, kBag);
  stage.frames(kCame + kSteady);
  stage.say(clear());
  // It leaves one cell beside what stands there.
  const Rect left = {8, 11, 8, 8};
  stage.bag_leaves(left);
  EXPECT_TRUE(has_all(stage.frames(kSteady), left));
  const Proofs proofs = stage.proofs();
  for (int row = left.top; row < left.top + left.rows; ++row)
    for (int col = left.left; col < left.left + left.cols; ++col)
      ASSERT_FALSE(proofs.came[static_cast<size_t>(stage.cell(row, col))]) << row << ' ' << col;
  EXPECT_TRUE(proofs.came[static_cast<size_t>(stage.cell(10, 25))]);
}

// ---- What left ----

// Somebody passes where it was, and a solve that knows nothing of it has brought the bag back.
TEST(SceneMemory, WhatLeftStaysLeftWhenSomebodyPasses) {
  for (bool changing : {false, true}) {
    Stage stage;
    stage.say(clear());
    stage.bag_leaves();
    const int64_t since = stage.number + 1;
    EXPECT_TRUE(has_all(stage.frames(kSteady + 10), kPlace));
    stage.say(weaker());
    if (changing)
      stage.passes([](int row, int col) { return kPlace.has(row, col); });
    else
      stage.show(kPlace, 200);
    stage.frames(kSteady - 2);
    stage.nothing_passes();
    stage.show(kPlace, kFloor);
    const std::vector<int> left = stage.frames(1);
    EXPECT_TRUE(has_all(left, kPlace)) << changing;
    const int inside = stage.cell(10, 12);
    EXPECT_EQ(stage.memory.uncovered().since(inside), since);
    EXPECT_FALSE(stage.proofs().any);
  }
}

TEST(SceneMemory, WhatPassesForLongerHidesItForAWhile) {
  Stage stage;
  stage.say(clear());
  stage.bag_leaves();
  const int64_t since = stage.number + 1;
  stage.frames(100);
  stage.know_what_is_seen();
  stage.say(weaker());
  stage.show(kPlace, 200);
  stage.frames(30);
  stage.show(kPlace, kFloor);
  stage.frames(kSteady + 1);
  EXPECT_EQ(stage.memory.looks().since(stage.cell(10, 12)), since);
  EXPECT_EQ(stage.memory.uncovered().since(stage.cell(10, 12)), since);
  EXPECT_FALSE(stage.proofs().any);
}

// ---- News, forgetting, and pictures of few cells ----

TEST(SceneMemory, NewsAreWhatHasComeLately) {
  Stage stage;
  stage.bag_comes();
  stage.frames(kSteady - 1);
  EXPECT_FALSE(stage.memory.any_news());
  for (int i = kSteady; i < StandingLooks::kNewsFrames + 30; ++i) {
    stage.frames(1);
    // The first frame of it is no frame ago.
    EXPECT_EQ(stage.memory.any_news(), i <= StandingLooks::kNewsFrames) << i;
  }
  // It goes.
  Stage moment;
  moment.bag_comes();
  moment.frames(kSteady);
  EXPECT_TRUE(moment.memory.any_news());
  moment.show(kPlace, kFloor);
  moment.frames(1);
  EXPECT_FALSE(moment.memory.any_news());
  // A few cells are none.
  Stage few;
  few.bag_comes({8, 10, 4, 4});
  few.frames(kSteady);
  EXPECT_FALSE(few.memory.any_news());
}

TEST(SceneMemory, ForgetsWhatItKnewAtOnce) {
  for (int frames : {kSteady, kCame + kSteady}) {
    Stage stage;
    stage.bag_comes();
    stage.frames(frames);
    EXPECT_TRUE(stage.proofs().any);
    stage.memory.forget();
    EXPECT_FALSE(stage.proofs().any) << frames;
    EXPECT_FALSE(stage.memory.looks().shows_look(stage.cell(10, 12)));
  }
}

TEST(SceneMemory, ForgetsAll) {
  constexpr int kYoung = 200;
  const Rect elsewhere = {2, 22, 8, 8};
  Stage stage(true);
  stage.frames(kYoung);
  stage.say(clear());
  stage.bag_leaves();
  stage.frames(kSteady);
  stage.say(weaker());
  stage.bag_comes(elsewhere);
  stage.frames(kCame + 1);
  EXPECT_TRUE(stage.memory.uncovered().any());
  EXPECT_TRUE(stage.proofs().any);
  stage.memory.forget();
  EXPECT_TRUE(stage.memory.young());
  EXPECT_FALSE(stage.memory.any_news());
  EXPECT_FALSE(stage.memory.uncovered().any());
  EXPECT_FALSE(stage.memory.uncovered().has(stage.cell(10, 12)));
  EXPECT_FALSE(stage.proofs().any);
  // Both are judged anew, in another order.
  stage.know(elsewhere, 180);
  stage.know_what_is_seen();
  stage.frames(kYoung);
  EXPECT_FALSE(stage.memory.young());
  EXPECT_FALSE(stage.proofs().any);
  stage.say(clear());
  stage.show(elsewhere, kFloor);
  EXPECT_EQ(stage.frames_until_found(100), kSteady);
}

TEST(SceneMemory, PicturesOfFewCellsSayNothing) {
  for (const auto& [rows, cols] : {std::pair{1, 1}, {3, 40}, {40, 3}}) {
    const Grid grid = grid_of(rows, cols);
    SceneMemory memory(grid, false);
    std::vector<float> floor(kChannels * grid.cells(), kFloor), bag(kChannels * grid.cells(), kBag);
    const auto of = [&](const std::vector<float>& planes) {
      return std::array<const float*, 3>{planes.data(), planes.data() + grid.cells(),
                                         planes.data() + 2 * grid.cells()};
    };
    for (int t = 0; t < 200; ++t) {
      memory.follow(of(t < 50 ? floor : bag).data(), kSameLight, t);
      EXPECT_TRUE(memory.judge(of(floor).data(), [](const auto&) { return clear(); }).empty());
    }
    Proofs solve(grid.cells());
    memory.hand_over(&solve);
    EXPECT_FALSE(solve.any);
  }
}

// Frames in other light are the same scene.
TEST(SceneMemory, FramesAreInTheLightThatTheyAreGiven) {
  const Grid grid = grid_of(kRows, kCols);
  SceneMemory memory(grid, false);
  const std::vector<float> floor(kChannels * grid.cells(), kFloor);
  const float* const known[3] = {floor.data(), floor.data(), floor.data()};
  for (int t = 0; t < 100; ++t) {
    const float light = t < 50 ? 1.0f : 0.5f;
    const std::vector<float> seen(grid.cells(), light * kFloor);
    const float* const frame[3] = {seen.data(), seen.data(), seen.data()};
    memory.follow(frame, {light, light, light}, t);
    memory.judge(known, [](const auto&) { return clear(); });
    Proofs solve(grid.cells());
    memory.hand_over(&solve);
    ASSERT_FALSE(solve.any) << t;
  }
}

}  // namespace
}  // namespace qdmd::test
