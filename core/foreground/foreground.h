// SPDX-License-Identifier: LGPL-2.1-or-later
// Foreground statistics of a solved window.
#pragma once

#include "core/base/colours.h"
#include "core/base/ignored_areas.h"
#include "core/model/background_model.h"
#include "core/parallel/pool.h"

namespace qdmd {

struct ForegroundStatistics {
  double noise = 0;      // standard deviation of one channel, grey levels
  double threshold = 0;  // quaternion norm in grey levels above which a pixel is foreground
  double ratio = 0;      // share of the sampled pixels above it and their own limits, 0 .. 1
};

// The threshold that suits a noise level: max(4 sqrt(3) sigma, 18) grey levels of quaternion norm.
double automatic_threshold(double noise, Colours colours = Colours::rgb);

// Looks at a sample of the window's residuals |x_t - L(t)| (quaternion norm). The noise comes from
// their lower quartile, which a foreground of up to three quarters of the pixels cannot move much:
// for Gaussian noise it is 1.1012 sigma (chi distribution, 3 degrees of freedom). The threshold is
// `fixed_threshold`, or, where that is 0, the automatic one and the model's limits.
// Leaves the model's time at the last sampled snapshot. Pixels of snapshots, `width` wide, that are
// ignored say nothing.
ForegroundStatistics foreground_statistics(const SnapshotRange& snapshots, BackgroundModel& model,
                                           double fixed_threshold, Pool& pool,
                                           const IgnoredAreas& ignored = {}, int width = 1,
                                           Colours colours = Colours::rgb);

}  // namespace qdmd
