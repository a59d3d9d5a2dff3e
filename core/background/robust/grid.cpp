#include "core/background/robust/grid.h"

#include <algorithm>
#include <cmath>

namespace qdmd {

Grid::Grid(int width_, int height_, int cells_along) : width(width_), height(height_) {
  const int side = std::max(
      {1, static_cast<int>(std::lround(std::min(width, height) / static_cast<double>(cells_along))),
       std::max(width, height) / kMostCellsAlong});
  rows = std::max(1, height / side);
  cols = std::max(1, width / side);
}

void cell_means(const Grid& grid, const uint8_t* plane, float* means) {
  // Down the columns first: that is a pass over neighbouring samples.
  std::vector<uint32_t> sums(static_cast<size_t>(grid.width));
  for (int row = 0; row < grid.rows; ++row) {
    const int top = grid.top(row), bottom = grid.top(row + 1);
    std::fill(sums.begin(), sums.end(), 0u);
    for (int y = top; y < bottom; ++y) {
      const uint8_t* samples = plane + static_cast<ptrdiff_t>(y) * grid.width;
      for (size_t x = 0; x < sums.size(); ++x) sums[x] += samples[x];
    }
    for (int col = 0; col < grid.cols; ++col) {
      const int left = grid.left(col), right = grid.left(col + 1);
      uint64_t sum = 0;
      for (int x = left; x < right; ++x) sum += sums[static_cast<size_t>(x)];
      *means++ = static_cast<float>(static_cast<double>(sum) / ((bottom - top) * (right - left)));
    }
  }
}

}  // namespace qdmd
