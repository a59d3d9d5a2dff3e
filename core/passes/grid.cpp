#include "core/passes/grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <span>

#include "core/passes/read_samples.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/grid.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

// Columns that are summed together, at most: as long runs as memory likes.
constexpr size_t kColumns = 2048;

// The sums of `count` <= kColumns columns of `rows` rows, `stride` apart. Plain loops, which the
// compiler makes vectors of.
void sum_columns(const uint8_t* samples, size_t stride, size_t rows, size_t count,
                 uint32_t* HWY_RESTRICT sums) {
  // So many samples fit 16 bits.
  constexpr size_t kRows = 257;
  HWY_ALIGN uint16_t narrow[kColumns];
  for (size_t x = 0; x < count; ++x) sums[x] = 0;
  for (size_t top = 0; top < rows; top += kRows) {
    for (size_t x = 0; x < count; ++x) narrow[x] = 0;
    for (size_t y = top; y < std::min(rows, top + kRows); ++y) {
      const uint8_t* HWY_RESTRICT from = samples + y * stride;
      for (size_t x = 0; x < count; ++x) narrow[x] = static_cast<uint16_t>(narrow[x] + from[x]);
    }
    for (size_t x = 0; x < count; ++x) sums[x] += narrow[x];
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(sum_columns);

}  // namespace

Grid::Grid(int width_, int height_, int cells_along) : width(width_), height(height_) {
  const int side = std::max(
      {1, static_cast<int>(std::lround(std::min(width, height) / static_cast<double>(cells_along))),
       std::max(width, height) / kMostCellsAlong});
  rows = std::max(1, height / side);
  cols = std::max(1, width / side);
}

namespace {

// Of rows of cells first .. end - 1; the plane begins with row `plane_top` of the picture.
void means_of_rows(const Grid& grid, int first_row, int end_row, const uint8_t* plane,
                   int plane_top, float* means) {
  // Down the columns first: that is a pass over neighbouring samples.
  constexpr int kColumns = 2048;
  alignas(64) uint32_t sums[kColumns];
  std::array<int, 2 * kMostCellsAlong + 1> left;
  for (int col = 0; col <= grid.cols; ++col) left[static_cast<size_t>(col)] = grid.left(col);
  for (int row = first_row; row < end_row; ++row) {
    const int top = grid.top(row), height = grid.top(row + 1) - top;
    const int* next = left.data() + 1;  // where the cell ends
    uint64_t cell = 0;
    for (int first = 0; first < grid.width; first += kColumns) {
      const int count = std::min(kColumns, grid.width - first);
      HWY_DYNAMIC_DISPATCH(sum_columns)
      (plane + static_cast<ptrdiff_t>(top - plane_top) * grid.width + first,
       static_cast<size_t>(grid.width), static_cast<size_t>(height), static_cast<size_t>(count),
       sums);
      // A cell may end in these columns or go on in the next.
      for (int x = 0; x < count;) {
        const int end = std::min(count, *next - first);
        for (; x < end; ++x) cell += sums[x];
        if (first + x < *next) break;
        *means++ = static_cast<float>(static_cast<double>(cell) / (height * (next[0] - next[-1])));
        cell = 0;
        ++next;
      }
    }
  }
}

int tallest_row(const Grid& grid) { return grid.height / grid.rows + 1; }

// The row of cells that begins with row `top` of the picture.
int row_at(const Grid& grid, int top) {
  return static_cast<int>((int64_t{top} * grid.rows + grid.height - 1) / grid.height);
}

}  // namespace

void cell_means(const Grid& grid, const uint8_t* plane, float* means) {
  means_of_rows(grid, 0, grid.rows, plane, 0, means);
}

// Of channels 1 and 2, a row of cells at a time.
void find_shared_cells(const Grid& grid, const KeptPicture& picture, GridFrames* cells, int frame,
                       uint8_t* room) {
  const auto width = static_cast<size_t>(grid.width);
  const size_t most = width * static_cast<size_t>(tallest_row(grid));
  RowReader reader(picture, grid.width, room);
  uint8_t* const block = room + 2 * width;
  for (int row = 0; row < grid.rows; ++row) {
    const int top = grid.top(row), bottom = grid.top(row + 1);
    for (int y = top; y < bottom; ++y) {
      const uint8_t* rows[kChannels];
      reader.read(y, rows);
      for (size_t c = 1; c < kChannels; ++c)
        std::memcpy(block + (c - 1) * most + static_cast<size_t>(y - top) * width, rows[c], width);
    }
    for (int c = 1; c < kChannels; ++c)
      means_of_rows(grid, row, row + 1, block + static_cast<size_t>(c - 1) * most, top,
                    cells->plane(frame, c) + ptrdiff_t{row} * grid.cols);
  }
}

size_t cells_room(const Grid& grid) {
  return 2 * static_cast<size_t>(grid.width) * (1 + static_cast<size_t>(tallest_row(grid)));
}

void find_own_cells(const Grid& grid, const Band& band, const KeptPicture& picture,
                    GridFrames* cells, int frame, uint8_t* room) {
  const int first = row_at(grid, band.own_first()), end = row_at(grid, band.own_end());
  const bool shared = picture.shape.is_shared();
  for (int c = 0; c < (shared ? 1 : kChannels); ++c)
    means_of_rows(grid, first, end, picture.plane[c], band.first(),
                  cells->plane(frame, c) + ptrdiff_t{first} * grid.cols);
  if (shared) find_shared_cells(grid, picture, cells, frame, room);
}

void share_cells(const Grid& grid, const Band& band, GridFrames* cells, int frame) {
  if (band.is_whole()) return;
  std::vector<size_t> ends;
  for (int rank = 0; rank < band.members(); ++rank)
    ends.push_back(sizeof(float) * static_cast<size_t>(row_at(grid, band.end_of(rank))) *
                   static_cast<size_t>(grid.cols));
  for (int c = 0; c < kChannels; ++c)
    band.team()->share(
        Talk::cells, std::as_writable_bytes(std::span(cells->plane(frame, c), grid.cells())), ends);
}

}  // namespace qdmd
#endif
