// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/earlier_window.h"

#include <algorithm>

#include "core/learn/robust/places.h"

namespace qdmd {

LitPicture EarlierWindow::picture(const Gain& gain) const {
  return {{level_[0].data(), level_[1].data(), level_[2].data()}, gain};
}

Recollection EarlierWindow::recollection(float most) const {
  Recollection result = {weight_, limit_, weight_};
  for (size_t cell = 0; cell < weight_.size(); ++cell)
    result.share[cell] = looked_[cell] > 0 ? weight_[cell] / looked_[cell] : 0;
  for (float& weight : result.weight) weight = std::min(weight, most);
  return result;
}

void EarlierWindow::take(const Grid& grid, const ReferencePicture& background,
                         const std::vector<uint8_t>& spread, const GridFrames& cells, int at,
                         const StableFrames& stable, int count, float fresh,
                         const std::vector<uint8_t>& held) {
  known_ = false;
  weight_.resize(grid.cells());
  looked_.resize(grid.cells());
  for (size_t cell = 0; cell < grid.cells(); ++cell) {
    const size_t of_window = stable.of_cell.count_before(cell, count);
    const bool confirmed = of_window < stable.of_cell.count(cell);
    const auto shown = static_cast<float>(of_window);
    weight_[cell] = (confirmed ? weight_[cell] : 0) + fresh * shown;
    // What hides it for a while says nothing of how often it is seen.
    const bool hidden = !held.empty() && held[cell];
    looked_[cell] =
        (confirmed ? looked_[cell] : 0) + fresh * (hidden ? shown : static_cast<float>(count));
  }
  limit_ = stable.limit;
  spread_ = spread;
  for (size_t c = 0; c < kChannels; ++c) {
    level_[c] = background.level[c];
    const int channel = static_cast<int>(c);
    std::copy_n(cells.plane(at, channel), cells.cells(), cells_.plane(0, channel));
  }
  known_ = true;
}

void EarlierWindow::recolour(const RobustContext& context, const ColourMap& map) {
  uint8_t* const level[kChannels] = {level_[0].data(), level_[1].data(), level_[2].data()};
  qdmd::recolour(map, context.range(), level_[0].size(), level);
  context.find_cells(level, &cells_, 0);
}

void EarlierWindow::write(const Grid& grid, Learnt::EarlierWindow* out) const {
  for (size_t c = 0; c < kChannels; ++c) out->level[c] = level_[c];
  out->spread = spread_;
  out->rows = grid.rows;
  out->cols = grid.cols;
  out->weight = weight_;
  out->limit = limit_;
  out->looked = looked_;
}

void EarlierWindow::read(const RobustContext& context, const Learnt::EarlierWindow& from) {
  const Grid& grid = context.grid;
  // Memory first, and the old content stays until all of it is there.
  for (size_t c = 0; c < kChannels; ++c) level_[c].reserve(from.level[c].size());
  spread_.reserve(from.spread.size());
  weight_.reserve(grid.cells());
  limit_.reserve(grid.cells());
  looked_.reserve(grid.cells());
  for (size_t c = 0; c < kChannels; ++c) level_[c] = from.level[c];
  const uint8_t* const level[kChannels] = {level_[0].data(), level_[1].data(), level_[2].data()};
  context.find_cells(level, &cells_, 0);
  spread_ = from.spread;
  weight_.resize(grid.cells());
  limit_.resize(grid.cells());
  looked_.resize(grid.cells());
  each_with_its(grid, from.rows, from.cols, [&](size_t cell, size_t its) {
    weight_[cell] = from.weight[its];
    limit_[cell] = from.limit[its];
    looked_[cell] = from.looked[its];
  });
  known_ = true;
}

}  // namespace qdmd
