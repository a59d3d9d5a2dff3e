// SPDX-License-Identifier: LGPL-2.1-or-later
// Flat things before a background that has a texture, such as a boat on water: told by their own
// look.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/colours.h"
#include "core/base/ignored_areas.h"
#include "core/foreground/compared_planes.h"
#include "core/foreground/decision_steps.h"
#include "core/foreground/row_lists.h"
#include "core/parallel/pool.h"

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
  // Visits the areas where that may have been. They overlap.
  template <typename Visit>
  void visit_areas(const Visit& visit) const {
    for (size_t flat = 0; flat < flat_.size(); ++flat)
      if (is_thing(flat)) visit(around(flat_[flat]));
  }

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
};

}  // namespace qdmd
