// SPDX-License-Identifier: LGPL-2.1-or-later
// What a window leaves to the next: its background, and how sure it was.
#pragma once

#include "core/learn/robust/colour_map.h"
#include "core/learn/robust/median_picture.h"
#include "core/learn/robust/robust_context.h"
#include "core/model/learnt.h"
#include "core/passes/mask.h"

namespace qdmd {

// A person who stands still through a whole window is background there. Where the window before had
// seen what is behind, its picture takes part in the next start like one more frame of some weight.
class EarlierWindow {
 public:
  EarlierWindow() = default;
  explicit EarlierWindow(const Grid& grid) : cells_(grid, 1) {}

  bool known() const { return known_; }
  void forget() {
    known_ = false;
    weight_.clear();
  }

  // The background's cells, in its window's unit light.
  const GridFrames& cells() const { return cells_; }
  LitPicture picture(const Gain& gain) const;
  const std::vector<uint8_t>& spread() const { return spread_; }
  // For a start of `most` frames at most.
  Recollection recollection(float most) const;

  // Replaces what is known by a window's background and the frames that showed it; where these
  // include what was known (frame `count` of `stable`), it is confirmed. fresh: the share of the
  // window's frames that no window before had. spread: as median_picture() has it, blurred.
  // cells: the background's are picture `at` of them.
  void take(const Grid& grid, const ReferencePicture& background,
            const std::vector<uint8_t>& spread, const GridFrames& cells, int at,
            const StableFrames& stable, int count, float fresh, const std::vector<uint8_t>& held);

  // Its background in other colours.
  void recolour(const RobustContext& context, const ColourMap& map);

  // What is known, for a file and back; its grid may be another, and each cell then knows what the
  // one at its middle did. Where read() throws, all is as it was.
  void write(const Grid& grid, Learnt::EarlierWindow* out) const;
  void read(const RobustContext& context, const Learnt::EarlierWindow& from);

 private:
  bool known_ = false;  // set last: what follows is whole
  GridFrames cells_;
  std::vector<uint8_t> level_[kChannels], spread_;
  // By cells; looked_: how many frames could have shown it.
  std::vector<float> weight_, limit_, looked_;
};

}  // namespace qdmd
