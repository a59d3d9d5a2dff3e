// SPDX-License-Identifier: LGPL-2.1-or-later
// A mask whose edge follows the picture's, and is steady from frame to frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/ignored_areas.h"
#include "core/foreground/decision.h"
#include "core/parallel/pool.h"
#include "core/passes/soft_edge.h"

namespace qdmd {

// What a frame's edge is made of.
struct SoftEdge {
  int softness = 1;       // pixels to either side over which it fades, 1 .. kMostSoftness
  double threshold = 18;  // quaternion norm in levels above which a pixel differs
};

// The guide of the filter (soften_tile) is |x - L|, which has no edges of the background. Where it
// hardly changed from the frame before, the edge hardly does (settle), unless the mask moved. Tiles
// in which nothing is near an edge are the mask.
class SoftMask {
 public:
  // Takes all memory. For frames of width x height pixels.
  SoftMask(int width, int height);
  static uint64_t bytes(int width, int height);

  // The next frame does not come after the one before.
  void forget();
  // Makes that of the frame that was decided last, whose planes are x. What is ignored stays
  // background. pool: or null. Results do not depend on it.
  void make(const Decision& decision, const uint8_t* const x[3], const SoftEdge& edge,
            const IgnoredAreas& ignored, Pool* pool);
  // 0: background, 255: foreground; width * height samples in row order.
  const uint8_t* alpha() const { return alpha_.data(); }

 private:
  struct Tile;
  struct Frame;
  void make_tile(const Frame& frame, int row, int col);
  void copy_halo(const Frame& frame, int left, int top, Tile* tile) const;

  int width_, height_, rows_, cols_;  // pixels; tiles
  int softness_ = 0;                  // of the frame before; 0: none
  // What the frame before had, until a tile is made anew. Guides and the hard mask
  // are known of tiles that had an edge.
  std::vector<uint8_t> alpha_, guide_, white_, had_edge_;
};

}  // namespace qdmd
