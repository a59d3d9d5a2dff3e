#include "core/foreground/moving_texture.h"

#include <algorithm>

namespace qdmd {
namespace {

// Cells along the short side: objects of interest are about as large.
constexpr int kTextureCells = 10;
// Rows of a cell that are looked at.
constexpr int kSampledRows = 8;
// What a frame counts in averages, once there are enough.
constexpr float kSlow = 0.01f, kQuick = 0.1f;
// The least share rises towards the recent one by this a frame: something that came and stays is
// told from what was always there for about 1000 frames.
constexpr float kForget = 0.001f;
// Frames in which nothing is known of a least share.
constexpr int kFirstFrames = 25;
// A cell moves above these: share of pixels that differ, share of these that are explained, least
// share of pixels that differ by their average share. docs/masks.md has others.
constexpr float kDiffering = 0.02f, kExplained = 0.3f, kAlways = 0.5f;

}  // namespace

MovingTexture::MovingTexture(int width, int height)
    : grid_(width, height, kTextureCells),
      row_step_(std::max(1, height / grid_.rows / kSampledRows)),
      cells_(grid_.cells()) {}

uint64_t MovingTexture::bytes(int width, int height) {
  return Grid(width, height, kTextureCells).cells() * sizeof(Cell);
}

void MovingTexture::forget() {
  frames_ = 0;
  std::fill(cells_.begin(), cells_.end(), Cell());
}

float MovingTexture::sampled_pixels(int row, int col) const {
  // Rows y < n that are multiples of the step.
  const auto below = [&](int n) { return (n + row_step_ - 1) / row_step_; };
  const int rows = below(grid_.top(row + 1)) - below(grid_.top(row));
  return static_cast<float>(rows * (grid_.left(col + 1) - grid_.left(col)));
}

void MovingTexture::end_frame() {
  const float slow = std::max(kSlow, 1.0f / static_cast<float>(frames_ + 2));
  const float quick = std::max(kQuick, 1.0f / static_cast<float>(frames_ + 1));
  for (int row = 0; row < grid_.rows; ++row)
    for (int col = 0; col < grid_.cols; ++col) {
      Cell& cell = cells_[static_cast<size_t>(row * grid_.cols + col)];
      const float pixels = sampled_pixels(row, col);
      const float differ = static_cast<float>(cell.differ) / pixels;
      cell.differing += slow * (differ - cell.differing);
      cell.explained_share +=
          slow * (static_cast<float>(cell.explained) / pixels - cell.explained_share);
      cell.recent += quick * (differ - cell.recent);
      cell.least = frames_ < kFirstFrames
                       ? cell.recent
                       : std::min(cell.recent, cell.least + kForget * (cell.recent - cell.least));
      cell.differ = cell.explained = 0;
    }
  for (int row = 0; row < grid_.rows; ++row)
    for (int col = 0; col < grid_.cols; ++col) {
      float differing = 0, explained = 0;
      int around = 0;
      for (int y = std::max(0, row - 1); y < std::min(grid_.rows, row + 2); ++y)
        for (int x = std::max(0, col - 1); x < std::min(grid_.cols, col + 2); ++x) {
          const Cell& cell = cells_[static_cast<size_t>(y * grid_.cols + x)];
          differing += cell.differing;
          explained += cell.explained_share;
          ++around;
        }
      Cell& cell = cells_[static_cast<size_t>(row * grid_.cols + col)];
      cell.moves = differing > kDiffering * static_cast<float>(around) &&
                   explained > kExplained * differing && cell.least > kAlways * cell.differing;
      cell.moved = std::min(cell.moved + cell.moves, kMostMoved);
    }
  ++frames_;
}

}  // namespace qdmd
