// SPDX-License-Identifier: LGPL-2.1-or-later
// The edges of two pictures along the border of a region in which they differ.
#pragma once

#include <vector>

#include "core/model/background_model.h"
#include "core/passes/grid.h"
#include "core/passes/rgb_colours.h"
#include "core/planes/snapshot_range.h"

namespace qdmd {

// How strong edges are along the border, in levels, a channel's mean: what stands before something
// else ends in an edge that the other does not have.
struct RegionContours {
  float look = 0, background = 0;
  size_t pairs = 0;  // of pixels on both sides of the border
  size_t open = 0;   // pairs where the pictures differ beyond the region, too: its end is not known
};

// A frame and the background, each with the light that its levels are divided by.
struct ContourPictures {
  SnapshotRange frames;
  int at = 0;  // which of them
  SampleLight light = kSameLight;
  const BackgroundModel* model = nullptr;  // set to a time whose light is `model_light`
  SampleLight model_light = kSameLight;
  RgbColours colours = {};  // edges are those of R, G and B
};

// The border is found in full resolution: around those pixels of the region's cells, and of the
// cells next to them, where the frame and the background differ. May throw std::bad_alloc.
RegionContours contours_of(const Grid& grid, const std::vector<int>& region,
                           const ContourPictures& pictures);

}  // namespace qdmd
