// SPDX-License-Identifier: LGPL-2.1-or-later
// What is proved of regions, row by row of the table in scene_memory.h.
#include "tests/core/memory_stage.h"

namespace qdmd::test {
namespace {

// ---- The background's contour is stronger, and all around has settled ----

TEST(SceneMemory, WhatHasTheStrongerContourHasLeft) {
  for (const RegionContours& contour : {hardly_stronger(), much_stronger(), clear()}) {
    Stage stage;
    stage.say(contour);
    stage.bag_leaves();
    const int64_t since = stage.number + 1;
    EXPECT_TRUE(stage.frames(kSteady - 1).empty());
    const std::vector<int> left = stage.frames(1);
    EXPECT_TRUE(has_all(left, kPlace));
    // Cells next to it may have a part of it.
    EXPECT_TRUE(has_all(left, kPlace.wider(1)));
    EXPECT_TRUE(only(left, kPlace.wider(1)));
    const int inside = stage.cell(kPlace.top + 3, kPlace.left + 3);
    EXPECT_EQ(stage.memory.uncovered().since(inside), since);
    EXPECT_FALSE(stage.memory.uncovered().has(0));
    // The next background has the floor.
    stage.know_what_is_seen();
    EXPECT_TRUE(stage.frames(100).empty());
    EXPECT_FALSE(stage.proofs().any);
  }
}

// Around it cells have a part of it that is too little to differ by itself.
TEST(SceneMemory, WhatLeftReachesIntoTwoCellsAround) {
  Stage stage;
  stage.say(clear());
  stage.know(kPlace.wider(4), kFloor - 6);
  stage.bag_leaves();
  const int64_t since = stage.number + 1;
  const std::vector<int> left = stage.frames(kSteady);
  EXPECT_TRUE(has_all(left, kPlace.wider(2)));
  EXPECT_TRUE(only(left, kPlace.wider(2)));
  EXPECT_EQ(stage.memory.uncovered().since(stage.cell(kPlace.top, kPlace.left)), since);
  EXPECT_TRUE(stage.memory.uncovered().has(stage.cell(kPlace.top - 2, kPlace.left)));
  // Not where somebody passes.
  Stage busy;
  busy.say(clear());
  busy.bag_leaves();
  busy.passes([](int row, int col) { return kPlace.wider(1).has(row, col) && col < kPlace.left; });
  const std::vector<int> beside_him = busy.frames(kSteady);
  EXPECT_TRUE(has_all(beside_him, kPlace));
  for (int cell : beside_him) EXPECT_GE(cell % kCols, kPlace.left);
}

TEST(SceneMemory, WhatHasTheWeakerContourCame) {
  for (const RegionContours& contour :
       {weaker(), contours(30, 29), contours(30, 30), contours(0, 0)}) {
    Stage stage;
    stage.say(contour);
    stage.bag_comes();
    EXPECT_GT(stage.frames_until_found(200), 200);
    EXPECT_FALSE(stage.memory.uncovered().any());
  }
}

// Few pairs, contours of low contrast and regions without an end say nothing, however clear.
TEST(SceneMemory, WhatSaysNothingLeavesTheOlderLook) {
  for (const RegionContours& contour :
       {contours(60, 4, 7), contours(11, 0), contours(60, 4, 50, 51)}) {
    Stage stage;
    stage.say(contour);
    stage.bag_comes();
    EXPECT_GT(stage.frames_until_found(200), 200);
  }
  for (const RegionContours& contour :
       {contours(60, 4, 8), contours(12, 0), contours(60, 4, 50, 50)}) {
    Stage stage;
    stage.say(contour);
    stage.bag_leaves();
    EXPECT_EQ(stage.frames_until_found(200), kSteady);
  }
}

// Things passed around it before it changed, and none after: they came there.
TEST(SceneMemory, MotionSaysTheContrary) {
  for (bool moved : {false, true}) {
    Stage stage;
    stage.say(hardly_stronger());
    stage.frames(50);
    if (moved) stage.passes(around(kPlace));
    stage.frames(30);
    stage.nothing_passes();
    stage.show(kPlace, kBag);
    EXPECT_EQ(stage.frames_until_found(200), moved ? 201 : kSteady);
    EXPECT_EQ(stage.proofs().any, moved);
  }
  // A contour that is much stronger outweighs it.
  Stage stage;
  stage.say(clear());
  stage.frames(50);
  stage.passes(around(kPlace));
  stage.frames(30);
  stage.nothing_passes();
  stage.show(kPlace, kBag);
  EXPECT_EQ(stage.frames_until_found(200), kSteady);
}

// Of a place whose background few frames have shown, nothing is known that could stay: the solve
// counts what frames show. The first frames make the look.
TEST(SceneMemory, PlacesAreYoungUntilEnoughFramesHaveShownThem) {
  const int enough = static_cast<int>(steps::proofs::kLasts) + kSteady - 1;
  for (const int shown : {enough / 2, enough - 1, enough}) {
    Stage stage;
    stage.memory.forget();
    stage.frames(shown);
    stage.show(kPlace, kBag);
    stage.frames(100);
    EXPECT_EQ(stage.proofs().any, shown == enough) << shown;
  }
}

// Where other looks were there for as long, more frames must have shown it: bags hide the floor for
// half of the time.
TEST(SceneMemory, PlacesThatShowManyLooksAreYoungForLonger) {
  constexpr int kTurn = 40;  // frames
  const auto known = static_cast<int>(steps::proofs::kYoungFrames);
  for (const int turns : {known / kTurn - 1, 2 * known / kTurn}) {
    Stage stage;
    stage.memory.forget();
    for (int turn = 0; turn < turns; ++turn) {
      stage.show(kPlace, kFloor);
      stage.frames(kTurn);
      stage.show(kPlace, turn % 2 ? kBag : kBag + 120);
      stage.frames(kTurn);
    }
    EXPECT_EQ(stage.proofs().any, turns * (kTurn - kSteady) >= known) << turns;
  }
}

// It was hidden for a while: what counts is what passed around it before.
TEST(SceneMemory, MotionIsThatBeforeThePlaceWasHidden) {
  for (bool moved : {false, true}) {
    Stage stage;
    stage.say(hardly_stronger());
    stage.frames(50);
    if (moved) stage.passes(around(kPlace));
    stage.frames(30);
    stage.passes([](int row, int col) { return kPlace.has(row, col); });
    stage.frames(40);
    stage.nothing_passes();
    stage.show(kPlace, kBag);
    EXPECT_EQ(stage.frames_until_found(200), moved ? 201 : kSteady);
  }
}

// Motion alone proves nothing.
TEST(SceneMemory, WhatGoesOnIsNoProofAgainstTheContour) {
  Stage stage;
  stage.say(weaker());
  stage.bag_comes();
  stage.passes(around(kPlace));
  stage.frames(20);
  stage.nothing_passes();
  EXPECT_GT(stage.frames_until_found(200), 200);
}

// A tenth of the cells around it does not settle. Frames that wait can wait for that.
TEST(SceneMemory, FramesThatWaitLetMoreSettle) {
  for (bool live : {false, true}) {
    Stage stage(live);
    stage.memory.grow_up();
    stage.say(stronger());
    stage.bag_leaves();
    stage.passes([](int row, int col) {
      return row == kPlace.top - 2 && col >= kPlace.left && col < kPlace.left + kPlace.cols;
    });
    const int found = stage.frames_until_found(30);
    EXPECT_EQ(found, live ? kSteady : 31);
    stage.nothing_passes();
    if (!live) {
      EXPECT_LT(stage.frames_until_found(20), 20);
    }
  }
}

// ---- Nothing settles ----

TEST(SceneMemory, WhileThingsPassBesideItNothingIsSaid) {
  Stage stage;
  stage.say(hardly_stronger());
  stage.bag_leaves();
  stage.passes(beside(kPlace));
  EXPECT_TRUE(stage.frames(30).empty());
  // Once all is quiet the contour decides.
  stage.nothing_passes();
  EXPECT_FALSE(stage.frames(1).empty());
}

TEST(SceneMemory, AContourThatIsMuchStrongerWaitsForLessLong) {
  Stage stage;
  stage.say(much_stronger());
  stage.bag_leaves();
  stage.passes(beside(kPlace));
  EXPECT_EQ(stage.frames_until_found(200), 41);
}

TEST(SceneMemory, OneThatIsStrongerDoesNotDecideWhereNothingSettles) {
  Stage stage;
  stage.say(stronger());
  stage.bag_leaves();
  stage.passes(beside(kPlace));
  EXPECT_GT(stage.frames_until_found(200), 200);
  // It was said by then that it came.
  stage.nothing_passes();
  EXPECT_GT(stage.frames_until_found(50), 50);
}

TEST(SceneMemory, ClearProofsWaitForNothing) {
  const Rect small = {8, 10, 3, 3};
  for (const auto& [place, waits] : {std::pair{kPlace, false}, {small, true}}) {
    Stage stage;
    stage.say(clear());
    stage.bag_leaves(place);
    stage.passes(beside(place));
    EXPECT_EQ(stage.frames_until_found(200), waits ? 41 : kSteady);
  }
}

// ---- Anything else: the older look stays ----

TEST(SceneMemory, WhatCameStaysWhereContoursChangeLater) {
  Stage stage;
  stage.bag_comes();
  stage.frames(kCame + 1);
  stage.say(clear());
  stage.asked = 0;
  EXPECT_GT(stage.frames_until_found(300), 300);
  EXPECT_EQ(stage.asked, 0);
  // Somebody passes, and the floor is seen for a moment.
  stage.passes([](int row, int col) { return kPlace.has(row, col); });
  stage.frames(8);
  stage.nothing_passes();
  stage.show(kPlace, kFloor);
  stage.frames(5);
  stage.show(kPlace, kBag);
  EXPECT_GT(stage.frames_until_found(200), 200);
  EXPECT_EQ(stage.asked, 0);
}

// Until it is said that something came, contours may still say something else.
TEST(SceneMemory, BeforeThatItIsNotDecided) {
  Stage stage;
  stage.bag_comes();
  EXPECT_TRUE(stage.frames(kCame - 1).empty());
  stage.say(much_stronger());
  EXPECT_TRUE(has_all(stage.frames(1), kPlace));
}

// A camera that switches to infra-red shows the same things in other colours.
TEST(SceneMemory, WhatStandsWhereColoursGoStandsInTheNewOnes) {
  constexpr Rect kWhole = {0, 0, kRows, kCols}, kOther = {2, 22, 6, 6};
  const auto in_other_colours = [&](bool stands) {
    Stage stage;
    stage.bag_comes();
    // Nobody has judged it yet.
    stage.frames(kSteady);
    std::vector<uint8_t> standing(stage.grid.cells());
    stage.memory.find_standing(&standing);
    for (int cell = 0; cell < kRows * kCols; ++cell)
      EXPECT_EQ(standing[static_cast<size_t>(cell)] != 0, kPlace.has(cell / kCols, cell % kCols));
    if (!stands) standing.assign(standing.size(), 0);
    stage.memory.begin_colours(standing);
    stage.know(kWhole, kFloor + 50);
    stage.show(kWhole, kFloor + 50);
    stage.show(kPlace, kBag + 50);
    stage.say(clear());
    return stage;
  };
  EXPECT_LE(in_other_colours(false).frames_until_found(100), kSteady);
  Stage stage = in_other_colours(true);
  const int64_t first = stage.number + 1;
  EXPECT_GT(stage.frames_until_found(100), 100);
  const size_t inside = static_cast<size_t>(stage.cell(kPlace.top + 3, kPlace.left + 3));
  EXPECT_TRUE(stage.proofs().came[inside]);
  EXPECT_EQ(stage.proofs().since[inside], first);
  // What changes later is judged as ever, there and elsewhere.
  stage.show(kOther, kBag);
  EXPECT_LE(stage.frames_until_found(100), kSteady);
  stage.know_what_is_seen();
  stage.know(kPlace, kFloor + 50);
  stage.show(kPlace, 220);
  EXPECT_LE(stage.frames_until_found(100), kSteady);
  // Who goes together with the colours is gone.
  Stage gone = in_other_colours(true);
  gone.show(kWhole, kFloor + 50);
  gone.frames(3 * kSteady);
  EXPECT_FALSE(gone.proofs().any);
}

// What comes next to the same place is judged by itself.
TEST(SceneMemory, AnotherLookIsJudgedAnew) {
  Stage stage;
  stage.bag_comes();
  stage.frames(kCame + 1);
  stage.say(clear());
  stage.show(kPlace, 180);
  EXPECT_EQ(stage.frames_until_found(100), kSteady);
}

// ---- Pieces ----

constexpr Rect kPiece = {kPlace.top, kPlace.left, 2, 2}, kRest = {8, 12, 8, 6};

// Something else hid two by two cells of what left for `frames` frames.
TEST(SceneMemory, SmallPiecesBesideWhatLeftHaveLeft) {
  for (int frames : {15, 30, 250, 251}) {
    Stage stage;
    // Something else stands elsewhere.
    stage.know(kPlace, kBag);
    stage.show(kPlace, kBag);
    stage.bag_comes({18, 24, 4, 6});
    stage.frames(kCame + kSteady);
    stage.say(clear());
    stage.bag_leaves();
    stage.passes(
        [](int row, int col) { return kPiece.wider(2).has(row, col) && col < kRest.left; });
    EXPECT_TRUE(has_all(stage.frames(kSteady), kRest));
    stage.know(kRest.wider(3), kFloor);
    stage.know(kPiece, kBag);
    stage.frames(frames - kSteady);
    stage.nothing_passes();
    const std::vector<int> left = stage.frames(kSteady);
    EXPECT_EQ(has_all(left, kPiece), frames <= 250) << frames;
    EXPECT_EQ(left.empty(), frames > 250) << frames;
  }
}

TEST(SceneMemory, SmallPiecesElsewhereHaveNot) {
  Stage stage;
  stage.say(clear());
  stage.bag_leaves();
  EXPECT_FALSE(stage.frames(kSteady).empty());
  stage.know_what_is_seen();
  stage.show({2, 2, 2, 2}, kBag);
  EXPECT_GT(stage.frames_until_found(100), 100);
  // Beside it, but what was there before did not leave with it.
  stage.show({kPlace.top, kPlace.left - 2, 2, 2}, kBag);
  EXPECT_GT(stage.frames_until_found(100), 100);
}

// What comes beside what stands there is mostly a part of it.
TEST(SceneMemory, PiecesBesideWhatCameNeedMore) {
  const Rect beside = {kPlace.top, kPlace.left + kPlace.cols, 8, 4};
  for (bool stands : {false, true})
    for (bool much : {false, true}) {
      Stage stage;
      stage.frames(50);
      if (stands) stage.show(kPlace, kBag);
      stage.frames(kCame + kSteady);
      stage.say(much ? much_stronger() : stronger());
      stage.show(beside, 70);
      EXPECT_EQ(stage.frames_until_found(200), stands && !much ? 201 : kSteady)
          << stands << ' ' << much;
      if (!stands) continue;
      // What stands there came all the same.
      EXPECT_EQ(
          stage.proofs().came[static_cast<size_t>(stage.cell(kPlace.top + 4, kPlace.left + 2))], 1);
    }
}

// Left of it something left, right of it something came.
TEST(SceneMemory, SmallPiecesBetweenWhatLeftAndWhatCameAreNotJudged) {
  const Rect right = {8, 20, 8, 4}, piece = {11, 18, 2, 2};
  for (bool stands : {false, true}) {
    Stage stage;
    stage.frames(50);
    if (stands) stage.show(right, kBag);
    stage.frames(kCame + kSteady);
    stage.say(clear());
    stage.bag_leaves();
    stage.frames(5);
    stage.show(piece, kFloor + 50);
    stage.frames(5);
    stage.know(kPlace, kFloor);
    EXPECT_EQ(stage.frames_until_found(50), stands ? 51 : 5);
  }
}

// It came, and what leaves close to it takes no part of it along.
TEST(SceneMemory, WhatLeavesBesideWhatCameTakesNothingOfIt) {
  for (int gap : {0, 1, 2}) {
    Stage stage;
    const Rect came = {8, kPlace.left + kPlace.cols + gap, 8, 6};
    stage.frames(50);
    stage.show(came, 180);
    const int64_t since = stage.number + 1;
    stage.frames(kCame + kSteady);
    stage.say(clear());
    stage.bag_leaves();
    const std::vector<int> left = stage.frames(kSteady);
    EXPECT_TRUE(has_all(left, kPlace));
    const auto taken = std::count_if(
        left.begin(), left.end(), [&](int cell) { return came.has(cell / kCols, cell % kCols); });
    EXPECT_EQ(taken, 0) << "gap " << gap;
    const Proofs proofs = stage.proofs();
    int kept = 0;
    for (int row = came.top; row < came.top + came.rows; ++row)
      for (int col = came.left; col < came.left + came.cols; ++col) {
        const auto cell = static_cast<size_t>(stage.cell(row, col));
        kept += proofs.came[cell] && proofs.since[cell] == since;
      }
    EXPECT_EQ(kept, came.rows * came.cols) << "gap " << gap;
  }
}

}  // namespace
}  // namespace qdmd::test
