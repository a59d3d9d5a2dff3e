// SPDX-License-Identifier: LGPL-2.1-or-later
// Hard shadows: regions of a mask that are the background in much less light.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/foreground/compared_planes.h"
#include "core/foreground/row_lists.h"
#include "core/parallel/pool.h"
#include "core/passes/rgb_colours.h"

namespace qdmd {

// Logs are natural ones, of R, G and B; a slope is that of log x on log L, 1 in a shadow.
struct HardShadowConstants {
  // Blocks are dark whose ratio of light, x / L, has a log below -dark. Dark blocks next to each
  // other whose logs differ by less than `step` are one region.
  // Near black, levels of noise are added to that.
  double dark = 0.12, step = 0.15, noise = 2;
  // Regions are looked at from so many blocks on, and are no shadow where their logs have a larger
  // standard deviation.
  double least_blocks = 6, most_spread = 0.35;
  // Channels of L from this level on are bounds: they were clipped. Of a region a channel is, where
  // more than a share of the blocks is.
  double clipped = 246, clipped_share = 0.3;
  // The sky's light is bluer than the sun's, hardly ever redder: the log of a channel's ratio is at
  // most so far below and above that of a redder one; and where only one of the two is a bound.
  double redder = 0.12, bluer = 0.35, redder_bound = 0.45, bluer_bound = 0.65;
  // Differences of logs between blocks count this much at most: beyond, they are edges.
  double edge = 0.5;
  // The slope of all regions in that ratio of light, and of the region itself with what is known of
  // that ratio, must exceed these.
  double slope_of_ratio = 0.5, slope_of_region = 0.4;
  // What is known of a ratio counts in a region as if its slope had a variance of one in so many,
  // besides a fixed amount. It is worth nothing until it exceeds `least_known`. A pair of blocks
  // has as much noise in L.
  double trust = 100, least_trust = 0.05, least_known = 0.5, noise_of_pair = 0.0005;
  // Regions of so many times the least size may say that there are shadows; smaller ones only with
  // a slope up to the second.
  double teaching = 4, follows = 0.3;
  // Width of the ratios that are told apart, in logs, and frames until half of what is known of
  // them is forgotten.
  double width = 0.12, half_life = 350;
  // Nothing is looked at where textures move in more than this share of the picture.
  double most_moving = 0.1;
};

// Looks at a mask's pixels in blocks. A region of blocks in which light has one ratio may be a
// shadow, or a thing of one colour. What tells them apart is the background's texture, which goes
// on in a shadow: the slope of log x on log L between near blocks is 1 there, and about 0 in
// things, whatever noise and blur do. One region has too little texture for that. The scene has one
// sun: what all regions of the same ratio of light say together, in many frames, says enough.
class HardShadows {
 public:
  // Takes all memory. Blocks have 2 * step pixels on a side.
  HardShadows(int width, int height, int step, const HardShadowConstants& constants = {});
  static uint64_t bytes(int width, int height, int step);

  // What is known of ratios of light.
  struct Known {
    std::vector<float> both, level;  // sums of dx dl and of dl dl, by ratio
  };
  Known& known() { return known_; }
  void forget();

  // Takes shadows out of `mask` (255 or 0, in row order): sets what is taken in `marks`, or null.
  // rgb and black: of the planes' samples, as for find_shaded(). pool: may be null. True where
  // something was taken.
  bool take_out(const ComparedPlanes& planes, const RgbColours& rgb, const uint8_t black[3],
                Pool* pool, uint8_t* mask, uint8_t* marks);

 private:
  struct Block {
    std::array<int16_t, 3> x, l;  // logs
    int16_t step;                 // to the next block of its region, below
  };
  struct Region {
    int64_t blocks, squares, both, light, level, pairs;
    std::array<int64_t, 3> ratio, clipped;
    bool judged, shadow;  // judged: large, and of a ratio that a shadow may have
  };

  size_t index(int col, int row) const {
    return static_cast<size_t>(row) * static_cast<size_t>(cols_) + static_cast<size_t>(col);
  }
  bool read_blocks(const ComparedPlanes& planes, const RgbColours& rgb, const uint8_t black[3],
                   Pool* pool, const uint8_t* mask);
  void read_row(const ComparedPlanes& planes, const RgbColours& rgb, const uint8_t black[3],
                const uint8_t* mask, int row);
  std::array<int, 3> quarters_of(const std::array<int, 3>& sum, int count, const RgbColours& rgb,
                                 const uint8_t black[3]) const;
  void read_block(const ComparedPlanes& planes, const RgbColours& rgb, const uint8_t black[3],
                  const uint8_t* mask, int col, int row);
  void join(size_t a, size_t b);
  void find_regions();
  void add_pairs(size_t block);
  bool is_large(const Region& region) const;
  bool is_lit(const Region& region) const;
  bool find_judged();
  size_t ratio_of(const Region& region) const;
  void decide();
  bool clear_shadow(size_t block, uint8_t* mask, uint8_t* marks) const;
  bool is_thing(size_t block) const;
  bool is_shadow(size_t block) const;
  bool next_to_thing(int col, int row) const;
  bool clear(int col, int row, uint8_t* mask, uint8_t* marks) const;

  HardShadowConstants constants_;
  int width_, height_, side_, cols_, rows_;
  std::vector<int16_t> logs_, steps_;  // of quarters of a level
  int dark_, hardly_dark_, edge_;      // logs of ratios
  int clipped_;                        // quarters of a level
  std::vector<uint8_t> flags_;         // by block
  std::vector<uint32_t> white_;        // blocks in the mask, in order: few of all
  RowLists<uint32_t> in_rows_;         // the same
  std::vector<Block> blocks_;
  std::vector<uint32_t> part_;   // another block of its region (parts.h)
  std::vector<uint16_t> named_;  // the region
  std::vector<Region> regions_;
  Known known_;
};

}  // namespace qdmd
