// SPDX-License-Identifier: LGPL-2.1-or-later
// The steps of a decision, and the constants that they go by. Users have no say in either:
// docs/notebook/masks.md has what each step is worth, and what other constants would give.
#pragma once

#include "core/foreground/edges.h"
#include "core/foreground/hard_shadows.h"
#include "core/passes/shading.h"

namespace qdmd {

// Shares are of one, distances quaternion norms in levels.
struct DecisionConstants {
  // ---- PixelNoise ----
  // Above so many mean distances a pixel is foreground. Of Gaussian noise, 3.5 are 5.6 sigma.
  double mean_distances = 3.5;
  // The newest of a pixel's distances counts at least one in so many; there is one for every eighth
  // frame.
  double noise_samples = 16;
  // What comes for a moment counts so many times, because it is new in about half of the frames in
  // which it is there; and at most so many of the pixel's limits.
  double weight_of_moments = 2, most_of_moments = 3;
  // Pixels at most so far from foreground, in pixels, say nothing of noise.
  double near_foreground = 4;

  // ---- Means in much noise ----
  // Means of 3 x 3 pixels are compared where noise alone asks for a threshold above this. Their
  // noise is a third: they must exceed a third of the threshold, and at least so much; the pixel
  // itself must exceed a share of the threshold.
  double noisy = 36, least_of_means = 18, least_alone = 0.5;

  // ---- MovingTexture ----
  // A pixel is explained where another one of the background is nearer than this share of its own
  // distance.
  double nearer = 0.3;
  // Cells along the short side: objects of interest are about as large.
  double texture_cells = 10;
  // A cell moves above these: share of pixels that differ, shares of these that are explained and
  // restless, least share of pixels that differ by their average share; and where the share of the
  // last frame is below so many average ones.
  double differing = 0.02, explained = 0.3, restless = 0.08, always = 0.5, suddenly = 2;
  // Frames of averages, of recent shares, and in which the least share comes up to the recent one:
  // something that came and stays is told from what was always there for about so long.
  double average_frames = 100, recent_frames = 10, forget_frames = 1000;
  // Frames in which nothing is known of a least share.
  double first_frames = 25;
  // Where a cell moves, a pixel must be further from what is around it than so many means of that.
  // Leaves are further from what is around now and then.
  double means_of_textures = 6;
  // The newest distance counts at least one in so many there.
  double texture_samples = 50;

  // ---- FlatThings ----
  // A block is flat below this share of its usual contrast. Flat blocks that differ by fewer levels
  // of brightness are one thing, from so many blocks on.
  double flat = 0.4, same_brightness = 8, least_flat = 24;

  // ---- Light ----
  LightRange light;
  // Levels: a background so bright in unit light is at least that: its samples were clipped.
  float at_end = 253;

  // ---- Overlays ----
  // Text changes at once so many times before it is known; half as many pixels near it, at most,
  // change in each of so many frames before and after. Of what is white in a block this share
  // changes at least, and at most this share of the picture's blocks do.
  double text_changes = 6, text_rests = 6, text_share = 0.3, most_text = 0.04;

  // ---- HardShadows ----
  HardShadowConstants hard;

  // ---- Edges ----
  EdgeConstants edges;

  // ---- Specks ----
  // Parts of the mask below these shares of the picture are specks, and holes.
  double least_foreground = 1 / 4000.0, least_hole = 1 / 500.0;
};

struct DecisionSteps {
  bool smooth = true;   // means of 3 x 3 pixels where there is much noise
  bool noise = true;    // PixelNoise
  bool texture = true;  // MovingTexture
  bool light = true;    // find_shaded
  bool vote = true;
  bool specks = true;  // Specks; only after a vote
  bool hard = true;    // HardShadows
  bool flat = true;    // FlatThings; only with textures
  bool edges = true;   // fit_edges
  bool overlays = true;
  DecisionConstants constants = {};
};

// The steps for frames that come at such a rate, in frames per second; 0: unknown. Where they are
// far apart, as in a time lapse, most things that pass are in one frame: a moment says less of
// noise, in proportion; and they come and go at once, as text does, where motion cannot be seen.
inline DecisionSteps at_rate(DecisionSteps steps, double frame_rate) {
  constexpr double kSlow = 5, kShowsMotion = 10;
  if (frame_rate > 0 && frame_rate < kSlow) steps.constants.weight_of_moments *= frame_rate / kSlow;
  if (frame_rate > 0 && frame_rate < kShowsMotion) steps.overlays = false;
  return steps;
}

}  // namespace qdmd
