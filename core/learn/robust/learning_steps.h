// SPDX-License-Identifier: LGPL-2.1-or-later
// The constants that robust Q-DMD learns by, step by step. Users have no say in them:
// docs/notebook/robust.md has what other values would give.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/step.h"
#include "core/passes/grid.h"

namespace qdmd {

// Cells are those of the Grid. Levels are of 8 bits; shares are of one. A step that is `constexpr`
// is the size of an array: no build can change it. Passes over pixels, which cannot include this
// file, have a few constants of their own: how alike patches are (core/passes/patch_density.h),
// which samples say what a frame's light is (core/passes/mask.h), and how many frames a median
// looks at (core/passes/median_block.h, median_rows.h).
namespace steps {

// ---- The light of frames ----
namespace light {
// Levels: cells that differ by less agree, a channel's mean.
QDMD_STEP float kAgree = step("light.agree", 4.0f);
// Levels: cells too dark or too bright have no ratio, and pixels so bright may be clipped.
QDMD_STEP float kDark = step("light.dark", 8.0f), kBright = step("light.bright", 250.0f);
// Levels: the mean of a cell whose samples are mostly at the end of their range, and say no more
// than "at least"; brighter cells than the second may have such samples. Where so large a share of
// a frame's cells is at the end, gains are those of the darker ones.
QDMD_STEP float kAtEnd = step("light.at_end", 245.0f), kNearEnd = step("light.near_end", 200.0f);
QDMD_STEP float kEnds = step("light.ends", 0.01f);
// Levels: darker channels of cells are measured then.
QDMD_STEP float kMeasured = step("light.measured", 240.0f);
// A window whose light changes by this factor while samples are at the end of their range is looked
// at in the light of its darker frames: where this share of them is darker, and no darker than this
// share of the usual light.
QDMD_STEP float kSwings = step("light.swings", 1.2f), kDarker = step("light.darker", 0.1f);
// The same factor where more than this share of the cells is at the end.
QDMD_STEP float kSwingsOfMany = step("light.swings_of_many", 1.1f);
QDMD_STEP float kManyEnds = step("light.many_ends", 0.1f);
QDMD_STEP float kDarkest = step("light.darkest", 0.5f);
// Levels: a channel that is further from the background says that something else is there.
QDMD_STEP float kOther = step("light.other", 20.0f);
// Levels: a darker frame that is so near to the darkest ones' median, a channel's mean, shows the
// same.
QDMD_STEP float kNearMedian = step("light.near_median", 8.0f);
// Levels: a frame without any picture has no cell above it.
QDMD_STEP float kBlack = step("light.black", 2.0f);
// Frames that say what is behind such samples: the darkest one in so many, but so many at least.
QDMD_STEP size_t kDarkOf = step("light.dark_of", size_t{6});
QDMD_STEP size_t kLeastDark = step("light.least_dark", size_t{5});
// A gain must make this many times as many cells agree, and this share of all cells besides.
QDMD_STEP float kGrowth = step("light.growth", 1.3f), kShare = step("light.share", 0.1f);
// Frames are divided by gains: the least one.
QDMD_STEP float kLeastGain = step("light.least_gain", 0.01f);
// Relative change of light that needs no following: less is a part of the noise.
QDMD_STEP float kStill = step("light.still", 0.03f);
// What a change of its colours counts in that.
QDMD_STEP float kOfColour = step("light.of_colour", 0.5f);
// Light that is followed from frame to frame must make this share of the cells agree, and this
// share more (or less: then it is looked for anew); where so large a share agrees, nothing is
// followed.
QDMD_STEP float kLeastFollowed = step("light.least_followed", 0.25f);
QDMD_STEP float kFollowed = step("light.followed", 0.05f);
QDMD_STEP float kAllAgree = step("light.all_agree", 0.9f);
// Logarithms of ratios of light: the width of the bins in which the most frequent one is found, and
// how near to it the ratios are whose median is the gain.
QDMD_STEP float kBin = step("light.bin", 0.02f), kNear = step("light.near", 0.05f);
// Cells: fewer that have a ratio say nothing, nor do fewer of a part of the levels.
QDMD_STEP size_t kLeastRatios = step("light.least_ratios", size_t{16});
// Parts of the levels in which a curve is known. Half of a part's cells must be within kNearMedian
// of their median, and a curve must make kFollowed more of all cells agree.
constexpr size_t kKnots = 8;
}  // namespace light

// ---- Other colours: a camera that switches to infra-red ----
namespace colour {
// A picture has no colour where the mean distance of its channels is less than this share of its
// level, and some where it is more than the second.
QDMD_STEP double kNone = step("colour.none", 0.025), kSome = step("colour.some", 0.07);
// A linear map explains the change where this share of the cells is within so many levels of it, a
// channel's mean. It is fitted so often, to those of the time before.
QDMD_STEP double kFits = step("colour.fits", 0.7);
QDMD_STEP float kExplained = step("colour.explained", 10.0f);
QDMD_STEP int kRounds = step("colour.rounds", 4);
// Frames in a row that are in other colours.
QDMD_STEP int kFrames = step("colour.frames", 1);
}  // namespace colour

// ---- The exposure of a camera that starts ----
namespace exposure {
// It has settled once the mean of frames stays within this share for so many of them, and is no
// darker than so many levels; or after so many frames.
constexpr int kFrames = 10;
QDMD_STEP double kRests = step("exposure.rests", 0.03);
QDMD_STEP double kDark = step("exposure.dark", 12.0);
QDMD_STEP int kLongest = step("exposure.longest", 375);
}  // namespace exposure

// ---- Contours: two looks of a region are told apart by the edges around it ----
namespace contours {
// Cells: smaller regions say nothing.
QDMD_STEP size_t kLeastRegion = step("contours.least_region", size_t{6});
// Levels: two looks of a cell, or of a pixel, differ by more than so many, a channel's mean.
QDMD_STEP float kLooksDiffer = step("contours.looks_differ", 10.0f);
// Levels: an edge counts at most so much, a channel's mean.
QDMD_STEP float kMostEdge = step("contours.most_edge", 40.0f);
// Contours of cells. They need so many pairs of cells; the stronger one is so many times as strong,
// and so many levels more.
QDMD_STEP size_t kLeastPairs = step("contours.least_pairs", size_t{8});
QDMD_STEP float kMargin = step("contours.margin", 1.2f);
QDMD_STEP float kMoreLevels = step("contours.more_levels", 1.0f);
// Contours in full resolution. Pixels of a pair are so far apart: an edge is not sharper in a
// camera's pictures.
QDMD_STEP size_t kApart = step("contours.apart", size_t{2});
}  // namespace contours

// ---- The start: which frames of a window show the background ----
namespace start {
// Looks that fewer than this share of the frames show (in units of alike frames), or fewer than so
// many, propose no region.
QDMD_STEP float kLeastSupport = step("start.least_support", 0.04f);
QDMD_STEP double kLeastAlike = step("start.least_alike", 2.0);
// The share of cells that must show what an earlier window did: people seldom hide more.
QDMD_STEP float kLeastSeen = step("start.least_seen", 0.15f);
// Frames that propose regions.
QDMD_STEP int kProposals = step("start.proposals", 64);
// A frame shows the background where its patch is as near to the background's as kNear times the
// distance of the nearest share kNearest of the frames, or nearer than kAlways times the distance
// at which patches are alike.
QDMD_STEP float kNear = step("start.near", 3.5f);
QDMD_STEP double kNearest = step("start.nearest", 0.05);
QDMD_STEP float kAlways = step("start.always", 0.5f);
// Contours say nothing where so large a share of the frames before showed the earlier background;
// and what came does not take its place where so many did.
QDMD_STEP float kKnown = step("start.known", 0.5f), kHeld = step("start.held", 0.3f);
}  // namespace start

// ---- Clutter: what moves in front of most of the picture ----
namespace clutter {
// It hides more than this share of the background, as far as that is known.
QDMD_STEP double kClutter = step("clutter.clutter", 0.3);
// What so large a share of the frames shows rests.
QDMD_STEP double kShared = step("clutter.shared", 0.1);
// No colour says more than this, as a logarithm: those that are seldom seen would.
QDMD_STEP double kMostSaid = step("clutter.most_said", 3.0);
// How often colours are learnt from a better background.
QDMD_STEP int kRounds = step("clutter.rounds", 3);
// Of a channel: colours are told apart by so many steps.
constexpr int kSteps = 8;
}  // namespace clutter

// ---- Standing looks: what cells show between two solves ----
namespace looks {
// Frames in a row that make a look.
QDMD_STEP int kSteady = step("looks.steady", 10);
// Levels: a cell shows the same as long as it is nearer, sum of the channels. Noise of cells' means
// is far below.
QDMD_STEP float kSame = step("looks.same", 12.0f);
// What a frame counts in a look, at least.
QDMD_STEP float kShare = step("looks.share", 0.1f);
// Frames that hide a cell: one of several may be the noise of cells of few pixels.
QDMD_STEP std::ptrdiff_t kHiding = step("looks.hiding", std::ptrdiff_t{2});
// A look is news for so many frames, if so many cells have news.
QDMD_STEP int kNewsFrames = step("looks.news_frames", 25);
QDMD_STEP size_t kLeastNews = step("looks.least_news", size_t{18});
}  // namespace looks

// ---- Proofs: what stands there came, or was uncovered ----
namespace proofs {
// Frames before and after a change in which things arrive or go away.
QDMD_STEP int64_t kMoves = step("proofs.moves", int64_t{20});
// Frames: something else may hide a piece of what left for so long.
QDMD_STEP int64_t kPieces = step("proofs.pieces", int64_t{250});
// Cells around a region in which that is seen, without those next to it.
QDMD_STEP int kAround = step("proofs.around", 6);
// Cells next to a region; what leaves is no longer there once something passes before less than
// this share of them. Frames that wait can wait for that for longer; in mode=live each is shown.
QDMD_STEP int kNear = step("proofs.near", 2);
QDMD_STEP double kSettled = step("proofs.settled", 0.05);
QDMD_STEP double kSettledOfLive = step("proofs.settled_of_live", 0.2);
// Contours are compared as (a - b) / (a + b): the background's must be so much stronger, where
// motion says nothing and the region has settled; and where it does not settle. Motion counts half
// as much.
QDMD_STEP double kStronger = step("proofs.stronger", 0.05);
QDMD_STEP double kMuchStronger = step("proofs.much_stronger", 0.3);
QDMD_STEP double kOfMotion = step("proofs.of_motion", 0.5);
// Nothing need settle around a region of so many cells, if contours, and both proofs together, are
// so clear.
QDMD_STEP size_t kClearRegion = step("proofs.clear_region", size_t{12});
QDMD_STEP double kClear = step("proofs.clear", 0.5);
QDMD_STEP double kClearBoth = step("proofs.clear_both", 0.75);
// Levels: things of less contrast leave no contour that says anything; nor do fewer pairs of
// pixels.
QDMD_STEP float kLeastContour = step("proofs.least_contour", 12.0f);
QDMD_STEP size_t kLeastPairs = step("proofs.least_pairs", size_t{8});
// Cells around what left that show less of it.
QDMD_STEP int kRim = step("proofs.rim", 2);
// Looks that came within so many frames of each other came at once; in half of so many by so many
// tiles, no object brought them, unless so much motion went on.
QDMD_STEP int64_t kAtOnce = step("proofs.at_once", int64_t{2});
constexpr int kTilesAlong = 4;
QDMD_STEP double kWentOn = step("proofs.went_on", 0.85);
// A share of the picture that no object covers at once; and the frames that it must last for.
QDMD_STEP double kMostOfPicture = step("proofs.most_of_picture", 1.0 / 3);
QDMD_STEP int64_t kLasts = step("proofs.lasts", int64_t{75});
// Where so much of it differs, what is no darker than this share of the background, of the same
// colour within so many levels, sum of the channels, is in a shadow: a cloud's.
QDMD_STEP float kDarkestShade = step("proofs.darkest_shade", 0.5f);
QDMD_STEP float kShadeRest = step("proofs.shade_rest", 12.0f);
// Frames: a scene is young for so long (mode=live); and a place until so many have shown its
// background, or kLasts of most.
QDMD_STEP int64_t kYoungFrames = step("proofs.young_frames", int64_t{200});
}  // namespace proofs

// ---- Disturbances: what changes a large part of the picture at once ----
namespace disturbance {
// Shares of the picture's cells that do not show the background, beyond the most that frames have
// shown lately: so many more, and so many more than in the frame before, begin a disturbance, and
// fewer end it.
QDMD_STEP double kLeast = step("disturbance.least", 0.1);
QDMD_STEP double kAtOnce = step("disturbance.at_once", 0.1);
QDMD_STEP double kOver = step("disturbance.over", 0.06);
// What a frame counts in that where it shows less.
QDMD_STEP double kFalls = step("disturbance.falls", 0.01);
// Frames of a scene before which nobody knows what is usual.
QDMD_STEP int kKnown = step("disturbance.known", 75);
}  // namespace disturbance

// ---- Another scene ----
namespace scene {
// A tile is strange where its edges correlate less with the background's than this, or where only
// one of both has any. A frame is strange where so large a share of the tiles with edges are, if
// the background has edges in half of them, or one of both in nearly all. Any two of eight recorded
// clips have 0.81 at least; of one scene, frames that look alike have 0.56 at most for kFrames
// frames, behind leaves over most of the picture (docs/notebook/robust.md).
QDMD_STEP double kStrangeTile = step("scene.strange_tile", 0.25);
QDMD_STEP double kStrangeShare = step("scene.strange_share", 0.75);
// Frames that correlate more than this look alike.
QDMD_STEP double kAlike = step("scene.alike", 0.6);
// Edges of fewer levels, root of the mean square, are none: noise of blocks is far below.
QDMD_STEP double kFlat = step("scene.flat", 2.0);
// Tiles along each side of the picture.
constexpr size_t kTilesAlong = 4;
// So many frames that look like each other, and not like the background, are another scene.
constexpr int kFrames = 8;
// Frames in a row that show the scene before are its return.
QDMD_STEP int kReturn = step("scene.return", 2);
// Frames: what was shown for fewer when a window ends (batch) may be a disturbance.
QDMD_STEP int kLasts = step("scene.lasts", 30);
}  // namespace scene

// ---- The memory of frames ----
namespace memory {
// One of so many frames that a solve looks at may be remembered, for so many windows.
QDMD_STEP int kStep = step("memory.step", 4), kWindows = step("memory.windows", 64);
}  // namespace memory

// ---- The pace: which frames a solve looks at, and which solves are left out ----
namespace pace {
// A window of so many frames and more is for the best background that there is: all count.
QDMD_STEP int kLongWindow = step("pace.long_window", 120);
// Snapshots that a solve looks at, at least, if every second (third) frame is enough.
QDMD_STEP int kLeast = step("pace.least", 50), kMostStride = step("pace.most_stride", 2);
QDMD_STEP int kLeastOfLive = step("pace.least_of_live", 33);
QDMD_STEP int kMostStrideOfLive = step("pace.most_stride_of_live", 3);
// A solve changed little if cells moved by less than a level in each channel on average (the sum
// of the channels is given), and no more than a tenth of them by two. Noise and clouds stay below
// that; a background of which parts are still hidden does not.
QDMD_STEP float kCalmMean = step("pace.calm_mean", 3.0f), kCalmCell = step("pace.calm_cell", 6.0f);
QDMD_STEP float kMostMoved = step("pace.most_moved", 0.1f);
// Hops that are left out between two solves, at most.
QDMD_STEP int kMostCalm = step("pace.most_calm", 3);
// Sampled pixels along the short side that are chosen: more move no background
// (docs/notebook/robust.md). The coarsest step leaves half of them.
QDMD_STEP double kSamplesAlong = step("pace.samples_along", 60.0);
QDMD_STEP size_t kFewestSamples = step("pace.fewest_samples", size_t{28});
}  // namespace pace

// ---- Mending ----
namespace mending {
// Frames whose median takes a mended cell's place, at most: every second one of them.
constexpr int kFrames = 9;
}  // namespace mending

}  // namespace steps

// ---- Spreads, thresholds and weights: what docs/notebook/robust.md measures other values of ----
struct RobustParameters {
  int cells_along =
      step("parameters.cells_along", kCellsAlong);  // of the grid, along the short side
  // Frames that the start compares, at most: more cost time and say little new.
  int start_frames = step("parameters.start_frames", 160);
  // Levels. A solve takes out what is above least_threshold, and above so many spreads of the
  // frames that show the pixel's background. What differs by less is mostly a shadow or a change of
  // light, and the mean of such samples is nearer to the background than what few frames show.
  int least_threshold = step("parameters.least_threshold", 26);
  int spreads = step("parameters.spreads", 4);
  // Levels: the least threshold of masks that users see: there, what differs a little may be
  // somebody.
  int least_limit = step("parameters.least_limit", 12);
  // Samples within half a spread of the background, at least so many levels, count in full.
  int least_reach = step("parameters.least_reach", 2);
  // What an earlier window's background counts at most, in start frames of this one; 0: windows
  // know nothing of each other.
  float earlier_share = step("parameters.earlier_share", 0.5f);
  // Frames that are kept once they have left the window, as a share of those of it that a solve
  // looks at (mode=live: of all, some of which the next window still has), but not more than half
  // of the start frames.
  float remembered_share = step("parameters.remembered_share", 0.5f);
};

}  // namespace qdmd
