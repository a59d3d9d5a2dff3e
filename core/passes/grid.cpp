#include "core/passes/grid.h"

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
  constexpr int kColumns = 512;
  uint32_t sums[kColumns];
  for (int row = 0; row < grid.rows; ++row) {
    const int top = grid.top(row), bottom = grid.top(row + 1);
    int col = 0;
    uint64_t cell = 0;
    for (int first = 0; first < grid.width; first += kColumns) {
      const int count = std::min(kColumns, grid.width - first);
      std::fill_n(sums, count, 0u);
      for (int y = top; y < bottom; ++y) {
        const uint8_t* samples = plane + static_cast<ptrdiff_t>(y) * grid.width + first;
        for (int x = 0; x < count; ++x) sums[x] += samples[x];
      }
      // A cell may end in these columns or go on in the next.
      for (int x = 0; x < count;) {
        const int end = std::min(count, grid.left(col + 1) - first);
        for (; x < end; ++x) cell += sums[x];
        if (first + x < grid.left(col + 1)) break;
        const int pixels = (bottom - top) * (grid.left(col + 1) - grid.left(col));
        *means++ = static_cast<float>(static_cast<double>(cell) / pixels);
        cell = 0;
        ++col;
      }
    }
  }
}

}  // namespace qdmd
