// SPDX-License-Identifier: LGPL-2.1-or-later
// Flat things before a background that has a texture, such as a boat on water: told by their own
// look.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/colours.h"
#include "core/base/ignored_areas.h"
#include "core/foreground/compared_planes.h"
#include "core/foreground/decision_steps.h"
#include "core/foreground/mask_runs.h"
#include "core/foreground/row_lists.h"
#include "core/parallel/pool.h"
#include "core/passes/bands.h"

namespace qdmd {

// Water and leaves are far from their background now and then, so a pixel's limit is high there.
// But they always have a texture. A block of pixels that all differ from the background, with far
// less contrast than the place has as a rule, shows something else. One block may be the back of a
// wave: blocks next to each other that are about equally bright are a thing if they are enough.
// Less light takes contrast, too, and counts as much less; and so do samples at the end of their
// range, which say nothing.
class FlatThings {
 public:
  // And a mask of what differs, whose rows are as far apart as L's.
  struct Planes : ComparedPlanes {
    const uint8_t* differing;
  };

  // Takes all memory. Blocks have 4 x 4 samples, `step` pixels apart.
  FlatThings(int width, int height, int step, Colours colours,
             const DecisionConstants& constants = {});
  static uint64_t bytes(int width, int height, int step);

  void forget();
  // Sets things to 255 in `foreground`, whose rows are as far apart as L's. Learns from each frame.
  // pool: may be null.
  void keep(const Planes& planes, Pool* pool, uint8_t* foreground);
  // Visits where that may have been, each pixel once, on several threads at once: visit(y, left,
  // count), columns of a row of pixels.
  template <typename Visit>
  void visit_runs(Pool* pool, const Visit& visit) const;

 private:
  struct Look {
    int contrast, bright;  // sums
  };
  struct Flat {
    uint32_t block;
    int bright;
  };

  int bright(const uint8_t* const planes[3], size_t at) const;
  // The first sample of a block, and whether all of them differ.
  size_t first(int col, int row, size_t stride) const;
  bool differs(const Planes& planes, int col, int row) const;
  Look look_at(const uint8_t* const planes[3], size_t first, size_t stride) const;
  bool is_flat(const Look& look, const Look& level, size_t block) const;
  bool is_thing(size_t flat) const;
  void learn(size_t block, int contrast);
  void find_flat(const Planes& planes, Pool* pool);
  void find_flat_in(const Planes& planes, int row);
  void find_things();
  Rectangle around(const Flat& flat) const;
  void paint(const Planes& planes, const Flat& flat, uint8_t* foreground) const;
  void mark_near(const Flat& flat);

  DecisionConstants constants_;
  int width_, height_, step_, side_, cols_, rows_;
  bool yuv_;
  int same_;  // sums of blocks that are equally bright differ by less
  int64_t frames_ = 0;
  // Of a block as a rule, and looks that said so, noise_samples at most.
  std::vector<float> contrast_;
  std::vector<uint8_t> looks_;
  std::vector<uint32_t> part_, size_;  // another flat one of its part (parts.h), and all of these
  std::vector<uint32_t> flat_at_;      // by block: 1 + which of flat_, or 0
  std::vector<Flat> flat_;
  RowLists<Flat> in_rows_;
  bool any_ = false;  // things in this frame
  // 255: blocks next to those of things, with the ends of rows and columns that are no whole block.
  std::vector<uint8_t> near_;
};

template <typename Visit>
void FlatThings::visit_runs(Pool* pool, const Visit& visit) const {
  if (!any_) return;
  const int cols = cols_ + 1, rows = rows_ + 1;
  for_rows(pool, rows, static_cast<size_t>(width_) * static_cast<size_t>(height_),
           [&](int first, int size) {
             for (int row = first; row < first + size; ++row) {
               const uint8_t* const near =
                   near_.data() + static_cast<size_t>(row) * static_cast<size_t>(cols);
               const int bottom = std::min((row + 1) * side_, height_);
               for (int col = next_of(near, 0, cols, 255); col < cols;) {
                 const int end = next_of(near, col, cols, 0);
                 const int left = col * side_, right = std::min(end * side_, width_);
                 for (int y = row * side_; y < bottom; ++y) visit(y, left, right - left);
                 col = next_of(near, end, cols, 255);
               }
             }
           });
}

}  // namespace qdmd
