// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/foreground/moving_texture.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>

#include "core/base/channels.h"

namespace qdmd {
namespace {

// Rows of a cell that are looked at.
constexpr int kSampledRows = 8;

Grid grid_of(int width, int height, const DecisionConstants& constants) {
  return Grid(width, height, std::max(1, static_cast<int>(constants.texture_cells)));
}

int row_step_of(const Grid& grid) { return std::max(1, grid.height / grid.rows / kSampledRows); }

size_t before_size(const Grid& grid) {
  return kChannels * (static_cast<size_t>(grid.height / row_step_of(grid)) + 1) *
         static_cast<size_t>(grid.width);
}

uint32_t squared(double value) {
  return static_cast<uint32_t>(std::lround(std::min(value * value, 65535.0)));
}

}  // namespace

MovingTexture::MovingTexture(int width, int height, const DecisionConstants& constants)
    : constants_(constants),
      grid_(grid_of(width, height, constants)),
      row_step_(row_step_of(grid_)),
      cols_(static_cast<size_t>(width)),
      cells_(grid_.cells()),
      before_(before_size(grid_)) {
  for (int col = 0; col < grid_.cols; ++col)
    std::fill(cols_.begin() + grid_.left(col), cols_.begin() + grid_.left(col + 1),
              static_cast<uint16_t>(col));
}

uint64_t MovingTexture::bytes(int width, int height, const DecisionConstants& constants) {
  const Grid grid = grid_of(width, height, constants);
  return grid.cells() * sizeof(Cell) + before_size(grid) +
         static_cast<uint64_t>(width) * sizeof(uint16_t);
}

void MovingTexture::forget() {
  frames_ = 0;
  std::fill(cells_.begin(), cells_.end(), Cell());
}

void MovingTexture::add(size_t cell, const Sample& sample, double threshold) {
  // In 1/65536 of the own distance.
  const auto nearer =
      static_cast<uint32_t>(std::lround(65536 * constants_.nearer * constants_.nearer));
  const uint32_t still = squared(threshold);
  int differ = 0, explained = 0, restless = 0;
  for (int p = 0; p < sample.count; ++p) {
    const int differs = sample.differing[p] & 1;
    differ += differs;
    explained += differs & (sample.nearest[p] < nearer * sample.own[p] >> 16);
    restless += differs & (sample.moved[p] > still);
  }
  const auto count = [](int* sum, int more) {
    std::atomic_ref<int>(*sum).fetch_add(more, std::memory_order_relaxed);
  };
  count(&cells_[cell].differ, differ);
  count(&cells_[cell].explained, explained);
  // Nothing is known of a frame before the first one.
  if (frames_ > 0) count(&cells_[cell].restless, restless);
}

float MovingTexture::sampled_pixels(int row, int col) const {
  // Rows y < n that are multiples of the step.
  const auto below = [&](int n) { return (n + row_step_ - 1) / row_step_; };
  const int rows = below(grid_.top(row + 1)) - below(grid_.top(row));
  return static_cast<float>(rows * (grid_.left(col + 1) - grid_.left(col)));
}

void MovingTexture::end_frame(const uint8_t* const x[3], bool last) {
  const auto newest = [&](double most, int64_t frames) {
    return 1 / static_cast<float>(std::min(most, static_cast<double>(frames)));
  };
  const float slow = newest(constants_.average_frames, frames_ + 2);
  const float quick = newest(constants_.recent_frames, frames_ + 1);
  const float forget = 1 / static_cast<float>(constants_.forget_frames);
  const bool first = static_cast<double>(frames_) < constants_.first_frames;
  for (int row = 0; row < grid_.rows; ++row)
    for (int col = 0; col < grid_.cols; ++col) {
      Cell& cell = cells_[static_cast<size_t>(row * grid_.cols + col)];
      const auto share = [pixels = sampled_pixels(row, col)](int count) {
        return static_cast<float>(count) / pixels;
      };
      cell.now = share(cell.differ);
      cell.differing += slow * (cell.now - cell.differing);
      cell.explained_share += slow * (share(cell.explained) - cell.explained_share);
      cell.restless_share += slow * (share(cell.restless) - cell.restless_share);
      cell.recent += quick * (cell.now - cell.recent);
      cell.least = first ? cell.recent
                         : std::min(cell.recent, cell.least + forget * (cell.recent - cell.least));
      cell.differ = cell.explained = cell.restless = 0;
    }
  const int most_moved = std::max(1, static_cast<int>(constants_.texture_samples));
  for (int row = 0; row < grid_.rows; ++row)
    for (int col = 0; col < grid_.cols; ++col) {
      Cell& cell = cells_[static_cast<size_t>(row * grid_.cols + col)];
      cell.moves = moves_now(row, col);
      cell.moved = std::min(cell.moved + cell.moves, most_moved);
    }
  ++frames_;
  if (!last) return;
  const auto width = static_cast<size_t>(grid_.width);
  for (int y = 0; y < grid_.height; y += row_step_)
    for (int c = 0; c < kChannels; ++c)
      std::memcpy(before_.data() + offset(c, y), x[c] + static_cast<size_t>(y) * width, width);
}

bool MovingTexture::moves_now(int row, int col) const {
  float differing = 0, explained = 0, restless = 0;
  int around = 0;
  for (int y = std::max(0, row - 1); y < std::min(grid_.rows, row + 2); ++y)
    for (int x = std::max(0, col - 1); x < std::min(grid_.cols, col + 2); ++x) {
      const Cell& cell = cells_[static_cast<size_t>(y * grid_.cols + x)];
      differing += cell.differing;
      explained += cell.explained_share;
      restless += cell.restless_share;
      ++around;
    }
  const auto above = [](float share, double least, float of) {
    return share > static_cast<float>(least) * of;
  };
  const Cell& cell = cells_[static_cast<size_t>(row * grid_.cols + col)];
  // The first frames have no average yet.
  const bool sudden = static_cast<double>(frames_) >= constants_.first_frames &&
                      !above(cell.differing, 1 / constants_.suddenly, cell.now);
  return above(differing, constants_.differing, static_cast<float>(around)) &&
         above(explained, constants_.explained, differing) &&
         above(restless, constants_.restless, differing) &&
         above(cell.least, constants_.always, cell.differing) && !sudden;
}

}  // namespace qdmd
