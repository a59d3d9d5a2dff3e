// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/compare_contours.h"

#include <algorithm>
#include <cmath>

#include "core/learn/robust/contour.h"
#include "core/learn/robust/learning_steps.h"
#include "core/learn/robust/near_cells.h"

namespace qdmd {
namespace {

using namespace steps::start;

// The planes of a picture.
struct Look {
  const float* of[kChannels];

  Look(const GridPictures& pictures, int at)
      : of{pictures.plane(at, 0), pictures.plane(at, 1), pictures.plane(at, 2)} {}
  explicit Look(const GridPicture& picture)
      : of{picture.plane(0), picture.plane(1), picture.plane(2)} {}
};

// Levels, sum of the channels.
float apart(const Look& a, const Look& b, size_t cell) {
  return std::abs(a.of[0][cell] - b.of[0][cell]) + std::abs(a.of[1][cell] - b.of[1][cell]) +
         std::abs(a.of[2][cell] - b.of[2][cell]);
}

class Comparison {
 public:
  Comparison(const Grid& grid, const ShownLooks& looks, std::vector<int>* from)
      : grid_(grid),
        looks_(looks),
        from_(*from),
        all_(static_cast<int>(looks.density.size() / grid.cells())),
        picture_(looks.frames, *from),
        background_(picture_),
        earlier_(looks.frames, all_ - 1),
        regions_(grid),
        keeps_(grid.cells()),
        differs_(grid.cells()) {
    for (size_t cell = 0; cell < grid.cells(); ++cell) note_kept(cell);
  }

  // False where nothing changed.
  bool sweep() {
    bool changed = false;
    const int proposals = std::min(looks_.count, kProposals);
    for (int i = 0; i < proposals; ++i)
      changed |= propose(static_cast<int>(int64_t{i} * looks_.count / proposals));
    if (all_ > looks_.count) changed |= propose(looks_.count);
    return changed;
  }

 private:
  // A cell that has what is known keeps it. The last look is the earlier background, if any cell is
  // known.
  void note_kept(size_t cell) {
    if (looks_.known[cell]) keeps_[cell] = !differs_at(background_.of, earlier_.of, cell);
  }

  // Where a frame differs from the background, but for cells that keep what they have. Without
  // branches: the compiler makes vectors of it.
  void find_differing(const Look& frame) {
    const float *a_0 = frame.of[0], *a_1 = frame.of[1], *a_2 = frame.of[2];
    const float *b_0 = background_.of[0], *b_1 = background_.of[1], *b_2 = background_.of[2];
    const uint8_t* const keeps = keeps_.data();
    uint8_t* __restrict const differs = differs_.data();
    const float most = kChannels * kLooksDiffer;
    for (size_t cell = 0; cell < grid_.cells(); ++cell) {
      const float sum = std::abs(a_0[cell] - b_0[cell]) + std::abs(a_1[cell] - b_1[cell]) +
                        std::abs(a_2[cell] - b_2[cell]);
      differs[cell] = static_cast<uint8_t>(static_cast<int>(sum > most) & (keeps[cell] ^ 1));
    }
  }

  // In how many frames a region shows that look, a mean over its cells.
  double support(const std::vector<int>& region, int look) const {
    double sum = 0;
    const float* const density = looks_.density.data() + static_cast<size_t>(look) * grid_.cells();
    for (int cell : region) sum += density[cell];
    return sum / static_cast<double>(region.size());
  }

  // Adds the cells around a region in which a frame differs less from the background.
  void add_rim(const Look& frame, std::vector<int>* region) {
    std::fill(differs_.begin(), differs_.end(), uint8_t{0});
    for (int cell : *region) differs_[static_cast<size_t>(cell)] = 1;
    size_t first = 0;
    for (int step = 0; step < steps::proofs::kRim; ++step) {
      const size_t end = region->size();
      for (size_t i = first; i < end; ++i)
        each_near(grid_, (*region)[i], 1, [&](int near) {
          const auto at = static_cast<size_t>(near);
          if (differs_[at] || apart(frame, background_, at) < steps::looks::kSame) return;
          // What it has is like what is known.
          if (keeps_[at] && apart(frame, earlier_, at) >= apart(background_, earlier_, at)) return;
          differs_[at] = 1;
          region->push_back(near);
        });
      first = end;
    }
  }

  bool propose(int look) {
    const Look frame(looks_.frames, look);
    find_differing(frame);
    bool changed = false;
    int number = -1;
    const double least = std::max(kLeastAlike, kLeastSupport * static_cast<double>(looks_.count));
    for (const std::vector<int>& region : regions_.find(differs_)) {
      ++number;
      if (region.size() < kLeastRegion || support(region, look) < least) continue;
      if (!Contour(grid_, regions_, number, region).is_weaker(frame.of, background_.of)) continue;
      taken_ = region;
      add_rim(frame, &taken_);
      for (int at : taken_) {
        const auto cell = static_cast<size_t>(at);
        if (!looks_.counts(cell, look)) continue;
        from_[cell] = look;
        picture_.take(looks_.frames, look, cell);
        note_kept(cell);
      }
      changed = true;
    }
    return changed;
  }

  const Grid& grid_;
  const ShownLooks& looks_;
  std::vector<int>& from_;
  const int all_;
  GridPicture picture_;
  const Look background_, earlier_;
  CellRegions regions_;
  std::vector<uint8_t> keeps_, differs_;
  std::vector<int> taken_;
};

}  // namespace

void compare_contours(const Grid& grid, const ShownLooks& looks, std::vector<int>* from) {
  if (std::min(grid.rows, grid.cols) < 4 || looks.count < 3) return;
  Comparison comparison(grid, looks, from);
  if (comparison.sweep()) comparison.sweep();
}

}  // namespace qdmd
