#include "core/passes/grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "core/passes/bands.h"

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

// The same of the rows of pixels that share these samples: `shared` rows each, of the first and the
// last one so many less.
void weigh_columns(const uint8_t* first, uint32_t less_first, const uint8_t* last,
                   uint32_t less_last, uint32_t shared, size_t count, uint32_t* HWY_RESTRICT sums) {
  for (size_t x = 0; x < count; ++x)
    sums[x] = shared * sums[x] - less_first * first[x] - less_last * last[x];
}

// Means of cells from sums up to their edges, which are integers: exact to the division.
void divide_differences(const double* HWY_RESTRICT before, const double* HWY_RESTRICT across,
                        double rows, size_t count, float* HWY_RESTRICT means) {
  for (size_t i = 0; i < count; ++i)
    means[i] = static_cast<float>((before[i + 1] - before[i]) / (rows * across[i]));
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(sum_columns);
HWY_EXPORT(weigh_columns);
HWY_EXPORT(divide_differences);

}  // namespace

Grid::Grid(int width_, int height_, int cells_along) : width(width_), height(height_) {
  const int side = std::max(
      {1, static_cast<int>(std::lround(std::min(width, height) / static_cast<double>(cells_along))),
       std::max(width, height) / kMostCellsAlong});
  rows = std::max(1, height / side);
  cols = std::max(1, width / side);
}

namespace {

// The samples of a plane, which `columns` x `rows` pixels share; it begins with row `top` of the
// picture.
struct Samples {
  const uint8_t* plane;
  int top = 0;
  int columns = 1, rows = 1;
};

constexpr auto kColumns = static_cast<int>(HWY_NAMESPACE::kColumns);

// The sums of columns first .. first + count - 1 of samples, over rows of pixels top .. bottom - 1.
void sum_rows(const Grid& grid, const Samples& samples, int top, int bottom, int first, int count,
              uint32_t* sums) {
  const auto stride = static_cast<size_t>((grid.width + samples.columns - 1) / samples.columns);
  const int shared = samples.rows, begin = top / shared, last = (bottom - 1) / shared;
  const auto row = [&](int y) { return samples.plane + static_cast<size_t>(y) * stride + first; };
  HWY_DYNAMIC_DISPATCH(sum_columns)
  (row(begin), stride, static_cast<size_t>(last + 1 - begin), static_cast<size_t>(count), sums);
  if (shared == 1) return;
  HWY_DYNAMIC_DISPATCH(weigh_columns)
  (row(begin), static_cast<uint32_t>(top - begin * shared), row(last),
   static_cast<uint32_t>((last + 1) * shared - bottom), static_cast<uint32_t>(shared),
   static_cast<size_t>(count), sums);
}

// Of rows of cells first .. end - 1.
void means_of_rows(const Grid& grid, int first_row, int end_row, const Samples& samples,
                   float* means) {
  // Down the columns first: that is a pass over neighbouring samples.
  alignas(64) uint32_t sums[kColumns + 1];
  // Of the samples before each; and of pixels left of a cell's left edge.
  uint64_t running[kColumns + 1];
  running[0] = 0;
  std::array<double, 2 * kMostCellsAlong + 1> before, across;
  // Samples left of a cell's edge, which may part the pixels of the next one.
  struct Edge {
    int samples, pixels;
  };
  std::array<Edge, 2 * kMostCellsAlong + 1> edges;
  const auto cols = static_cast<size_t>(grid.cols);
  const int shared = samples.columns;
  for (size_t col = 0; col <= cols; ++col) {
    const int x = grid.left(static_cast<int>(col));
    edges[col] = {x / shared, x % shared};
    if (col > 0) across[col - 1] = x - grid.left(static_cast<int>(col) - 1);
  }
  const int all = (grid.width + shared - 1) / shared;
  before[0] = 0;
  for (int row = first_row; row < end_row; ++row, means += cols) {
    const int top = grid.top(row) - samples.top, bottom = grid.top(row + 1) - samples.top;
    uint64_t sum = 0;  // of the samples so far
    size_t next = 1;
    for (int first = 0; first < all; first += kColumns) {
      const int count = std::min(kColumns, all - first);
      sum_rows(grid, samples, top, bottom, first, count, sums);
      for (int s = 0; s < count; ++s) running[s + 1] = running[s] + sums[s];
      // Of an edge that parts no pixels, this is not a part of the sum.
      sums[count] = 0;
      // The edges that lie in these columns.
      size_t last = cols;
      if (count < all)
        while (last >= next && edges[last].samples + (edges[last].pixels > 0) > first + count)
          --last;
      for (; next <= last; ++next) {
        const auto [end, part] = edges[next];
        const uint64_t pixels = static_cast<uint64_t>(shared) * (sum + running[end - first]) +
                                static_cast<uint64_t>(part) * sums[end - first];
        before[next] = static_cast<double>(static_cast<int64_t>(pixels));
      }
      sum += running[count];
    }
    HWY_DYNAMIC_DISPATCH(divide_differences)
    (before.data(), across.data(), bottom - top, cols, means);
  }
}

// The row of cells that begins with row `top` of the picture.
int row_at(const Grid& grid, int top) {
  return static_cast<int>((int64_t{top} * grid.rows + grid.height - 1) / grid.height);
}

}  // namespace

void cell_means(const Grid& grid, const uint8_t* plane, float* means) {
  means_of_rows(grid, 0, grid.rows, {plane}, means);
}

void find_own_cells(const Grid& grid, const Band& band, const KeptPicture& picture,
                    GridFrames* cells, int frame, Pool* pool) {
  const int own = row_at(grid, band.own_first()), rows = row_at(grid, band.own_end()) - own;
  const size_t pixels =
      static_cast<size_t>(grid.width) * static_cast<size_t>(grid.top(own + rows) - grid.top(own));
  for_rows(pool, rows, pixels, [&](int at, int count) {
    const int first = own + at;
    for (int c = 0; c < kChannels; ++c) {
      Samples samples = {picture.plane[c], band.first()};
      if (c > 0 && picture.shape.is_shared())
        samples.columns = picture.shape.columns, samples.rows = picture.shape.rows;
      means_of_rows(grid, first, first + count, samples,
                    cells->plane(frame, c) + ptrdiff_t{first} * grid.cols);
    }
  });
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
