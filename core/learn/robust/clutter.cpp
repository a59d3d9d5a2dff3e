// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/clutter.h"

#include <algorithm>
#include <cmath>

#include "core/learn/robust/contour.h"
#include "core/learn/robust/learning_steps.h"
#include "core/passes/patch_density.h"

namespace qdmd {
namespace {

using namespace steps::clutter;

// Sums over the cells within kPatchRadius, along a line of `count` that are `step` apart.
void add_along(const float* from, size_t step, int count, float* out) {
  for (int i = 0; i < count; ++i) {
    float sum = 0;
    for (int k = std::max(0, i - kPatchRadius); k <= std::min(count - 1, i + kPatchRadius); ++k)
      sum += from[static_cast<size_t>(k) * step];
    out[static_cast<size_t>(i) * step] = sum;
  }
}

}  // namespace

ClutterColours::ClutterColours(const Grid& grid, const GridPictures& frames, int count, Pool* pool)
    : grid_(grid), frames_(frames), count_(count), pool_(pool) {}

uint64_t ClutterColours::bytes(const Grid& grid, uint64_t looks, int threads) {
  return grid.cells() * sizeof(float) * (looks + 2 * static_cast<uint64_t>(threads) + kChannels);
}

int ClutterColours::colour_of(const float* const look[3], size_t cell) {
  int colour = 0;
  for (int c = 0; c < kChannels; ++c) {
    const float step = look[c][cell] * (kSteps / 256.0f);
    colour = kSteps * colour + static_cast<int>(std::clamp(step, 0.0f, kSteps - 1.0f));
  }
  return colour;
}

bool ClutterColours::hides_much(std::span<const float> density,
                                const std::vector<int>& from) const {
  // Some frames tell, in little time; of a few, all are looked at.
  const int every = std::clamp(count_ / 16, 1, 4);
  const size_t cells = grid_.cells();
  const GridPicture picture(frames_, from);
  const float* const background[3] = {picture.plane(0), picture.plane(1), picture.plane(2)};
  // Each frame shares its own look.
  const auto most = static_cast<float>(1 + kShared * count_);
  size_t unlike = 0, all = 0;
  for (int t = 0; t < count_; t += every, all += cells) {
    const float* const look[3] = {frames_.plane(t, 0), frames_.plane(t, 1), frames_.plane(t, 2)};
    const float* const shared = density.data() + static_cast<size_t>(t) * cells;
    for (size_t cell = 0; cell < cells; ++cell)
      unlike += shared[cell] < most && differs_at(look, background, cell) ? 1 : 0;
  }
  return static_cast<double>(unlike) > kClutter * static_cast<double>(all);
}

void ClutterColours::learn(const std::vector<int>& from) {
  const size_t cells = from.size();
  const GridPicture picture(frames_, from);
  const float* const background[3] = {picture.plane(0), picture.plane(1), picture.plane(2)};
  // How often they are seen, and once more: nobody knows colours that were never seen.
  std::array<uint32_t, kColours> of_background, of_clutter;
  of_background.fill(1);
  of_clutter.fill(1);
  for (size_t cell = 0; cell < cells; ++cell)
    of_background[static_cast<size_t>(colour_of(background, cell))] +=
        static_cast<uint32_t>(count_);
  uint64_t moves = 0;
  for (int t = 0; t < count_; ++t) {
    const float* const look[3] = {frames_.plane(t, 0), frames_.plane(t, 1), frames_.plane(t, 2)};
    for (size_t cell = 0; cell < cells; ++cell) {
      if (!differs_at(look, background, cell)) continue;
      ++of_clutter[static_cast<size_t>(colour_of(look, cell))];
      ++moves;
    }
  }
  const double all = static_cast<double>(cells) * count_;
  const double shares = std::log((static_cast<double>(moves) + kColours) / (all + kColours));
  for (size_t i = 0; i < kColours; ++i) {
    const double likelier =
        std::log(static_cast<double>(of_background[i]) / of_clutter[i]) + shares;
    likelier_[i] = static_cast<float>(std::clamp(likelier, -kMostSaid, kMostSaid));
  }
}

void ClutterColours::find_logarithms(int look, float* room, float* out) const {
  const float* const planes[3] = {frames_.plane(look, 0), frames_.plane(look, 1),
                                  frames_.plane(look, 2)};
  const auto rows = static_cast<size_t>(grid_.rows), cols = static_cast<size_t>(grid_.cols);
  for (size_t cell = 0; cell < grid_.cells(); ++cell)
    out[cell] = likelier_[static_cast<size_t>(colour_of(planes, cell))];
  for (size_t y = 0; y < rows; ++y) add_along(out + y * cols, 1, grid_.cols, room + y * cols);
  for (size_t x = 0; x < cols; ++x) add_along(room + x, cols, grid_.rows, out + x);
  for (size_t y = 0; y < rows; ++y)
    for (size_t x = 0; x < cols; ++x)
      out[y * cols + x] /= static_cast<float>(
          patch_cells(grid_, static_cast<int>(y), static_cast<int>(x), kPatchRadius));
}

std::span<const float> ClutterColours::weigh(std::span<const float> density) {
  const size_t cells = grid_.cells();
  weighed_.resize(density.size());
  rooms_.resize(2 * cells * pool_->threads());
  pool_->run(density.size() / cells, [&](size_t look, size_t worker) {
    float *const room = rooms_.data() + 2 * cells * worker, *const logarithms = room + cells;
    find_logarithms(static_cast<int>(look), room, logarithms);
    for (size_t cell = 0; cell < cells; ++cell)
      weighed_[look * cells + cell] = density[look * cells + cell] * std::exp(logarithms[cell]);
  });
  return weighed_;
}

}  // namespace qdmd
