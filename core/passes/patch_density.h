// SPDX-License-Identifier: LGPL-2.1-or-later
// How alike the patches around a cell are in different frames.
#pragma once

#include <vector>

#include "core/base/large_vector.h"
#include "core/base/step.h"
#include "core/parallel/pool.h"
#include "core/passes/grid.h"

namespace qdmd {

// Cells. Looks are compared by patches of 5 x 5, so that what is alike by chance does not count;
// and by 3 x 3 where the look is known, and what is beside it may be hidden.
constexpr int kPatchRadius = 2, kNearRadius = 1;
// Levels a channel: the distance at which patches are no longer alike.
QDMD_STEP float kSimilar = step("patches.similar", 5.0f);
constexpr float kMostDistance = 40;  // levels a channel: a cell counts at most this

// Cells are compared in integers, of 16 steps a level and up to 4095 levels: what they add up to
// does not depend on the order, so that sums may slide and machines do not differ.
constexpr int kStepsPerLevel = 16;
[[gnu::always_inline]] inline uint16_t steps_of(float level) {
  const float steps = level * kStepsPerLevel + 0.5f;
  return static_cast<uint16_t>(static_cast<int>(steps < 65535.0f ? steps : 65535.0f));
}
// The cells of the patch around a cell that patch_distance() compares; at the border they are
// fewer.
inline int patch_cells(const Grid& grid, int row, int col, int radius = kNearRadius) {
  const auto along = [radius](int at, int length) {
    return (at + radius < length ? at + radius : length - 1) - (at > radius ? at - radius : 0) + 1;
  };
  return along(row, grid.rows) * along(col, grid.cols);
}

// The cells of `count` frames, to be compared with each other. With d(s, t) the mean absolute
// difference of the patches around a cell in frames s and t, they are alike by
// max(0, 1 - d(s, t) / kSimilar).
class PatchFrames {
 public:
  // room: where their steps are, as many as steps_of() says: good until somebody else uses it;
  // null: in memory of its own.
  PatchFrames(const Grid& grid, const GridPictures& frames, int count, Pool* pool,
              LargeVector<uint16_t>* room = nullptr);
  PatchFrames(PatchFrames&&) = default;  // not copied: first_ points into a room
  // Without a room.
  static uint64_t bytes(const Grid& grid, uint64_t count, int threads);
  static uint64_t steps_of(const Grid& grid, uint64_t count);

  // density[t * cells + cell] = the sum over frames s < count of how alike s and t are.
  void density(int count, Pool* pool, float* density);
  // Parts of the grid, enough for all threads, and where they begin; part parts() begins at the
  // end.
  int parts() const { return bands_; }
  size_t first_cell(int part) const {
    return static_cast<size_t>(int64_t{part} * grid_.rows / bands_) *
           static_cast<size_t>(grid_.cols);
  }
  // alike[cell]: how alike s and t are, at the cells of a part. Threads have numbers of their own.
  void alike(int s, int t, int part, size_t worker, float* alike);

 private:
  const uint16_t* steps(int frame) const {
    return first_ + static_cast<size_t>(frame) * kChannels * plane();
  }
  size_t plane() const;
  size_t scratch_size() const;
  void add_common(int s, int t, size_t first, size_t end, uint16_t* sums, uint16_t* alike,
                  uint16_t* another) const;

  Grid grid_;
  int bands_;
  // Rows are whole vectors, and begin at one. limit_: of each cell, the patch's steps at which
  // nothing is alike.
  LargeVector<uint16_t> own_room_;
  uint16_t* first_ = nullptr;
  std::vector<uint16_t> limit_;
  std::vector<uint16_t> scratch_;  // for each thread
};

// distance[cell * count + t]: the steps that the patches around the cell in frame t and in frame
// reference[cell] differ by, all channels together: d times kChannels * kStepsPerLevel *
// patch_cells(), of patches of 3 x 3. room: as that of PatchFrames, where patch_distance_steps()
// are kept meanwhile.
void patch_distance(const Grid& grid, const GridPictures& frames, int count, const int* reference,
                    Pool* pool, uint16_t* distance, LargeVector<uint16_t>* room = nullptr);
uint64_t patch_distance_steps(const Grid& grid, uint64_t count);
// The memory that it takes, with the result, without a room.
uint64_t patch_distance_bytes(const Grid& grid, uint64_t count);

}  // namespace qdmd
