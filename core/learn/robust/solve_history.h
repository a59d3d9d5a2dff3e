// SPDX-License-Identifier: LGPL-2.1-or-later
// What a solve is told of each place: which frames show its background, and which do not.
#pragma once

#include <vector>

#include "core/learn/robust/disturbances.h"
#include "core/learn/robust/robust_context.h"
#include "core/learn/robust/scene_memory.h"

namespace qdmd {

// Sets the bits of a cell's pixels. bits: of all pixels, in rows.
void set_cell(const Grid& grid, int cell, uint8_t* bits);

// A copy of what is known when a solve begins: frames that come beside it change nothing of it.
class SolveHistory {
 public:
  explicit SolveHistory(const RobustContext& context) : context_(context) {}
  // Takes all memory.
  void begin();
  static uint64_t bytes(uint64_t cells) {
    return 2 * HistoryStarts::bytes(cells) + Proofs::bytes(cells) + cells;
  }
  void forget();
  void take(HistoryStarts* absorbed, SceneMemory* memory, const Disturbances& disturbances);

  // Too little is known of the scene: windows decide alone.
  bool young() const { return proofs_.young; }
  // Which looks with these numbers count. earlier_known: there is a background of earlier windows,
  // which cells may keep.
  FirstLooks first_looks(const std::vector<int64_t>& numbers, bool earlier_known);
  // By cells, after first_looks(): those that keep the earlier background, if enough frames have
  // shown it.
  const std::vector<uint8_t>& held() const { return held_; }
  // Frames that say nothing of the background.
  const Disturbances& disturbances() const { return disturbances_; }
  // Sets the bits of pixels that are known not to show their background in that frame, however
  // little they differ. bits: of the rows that are kept.
  void take_out(int64_t number, uint8_t* bits) const;

 private:
  // Frames by number in which a cell does not show its background.
  struct KnownForeground {
    int cell;
    int64_t first, last;
  };

  const RobustContext& context_;
  HistoryStarts absorbed_, uncovered_;
  Proofs proofs_;
  Disturbances disturbances_;
  std::vector<uint8_t> held_;
  std::vector<KnownForeground> known_foreground_;
};

}  // namespace qdmd
