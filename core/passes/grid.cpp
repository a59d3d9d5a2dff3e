// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

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

// Makes these the sums of the rows of pixels that share the samples: `shared` rows each, of the
// first and the last one so many less.
void weigh_columns(const uint8_t* first, uint32_t less_first, const uint8_t* last,
                   uint32_t less_last, uint32_t shared, size_t count, uint32_t* HWY_RESTRICT sums) {
  for (size_t x = 0; x < count; ++x)
    sums[x] = shared * sums[x] - less_first * first[x] - less_last * last[x];
}

// Sums of neighbouring columns that begin at begin[i]: of kLeast columns, and one more where
// wide[i].
template <size_t kLeast>
void add_few(const uint32_t* HWY_RESTRICT sums, const uint32_t* HWY_RESTRICT begin,
             const uint8_t* HWY_RESTRICT wide, size_t count, uint64_t* HWY_RESTRICT cells) {
  for (size_t i = 0; i < count; ++i) {
    const uint32_t* const from = sums + (begin[i] - begin[0]);
    uint64_t sum = wide[i] ? from[kLeast] : 0;
    for (size_t x = 0; x < kLeast; ++x) sum += from[x];
    cells[i] = sum;
  }
}

// add_few() of `least` columns. Cells of small pictures have a few, for which a loop of its own
// would take longer than the sum.
void add_columns(const uint32_t* HWY_RESTRICT sums, const uint32_t* HWY_RESTRICT begin,
                 const uint8_t* HWY_RESTRICT wide, size_t least, size_t count,
                 uint64_t* HWY_RESTRICT cells) {
  switch (least) {
    case 0:
      return add_few<0>(sums, begin, wide, count, cells);
    case 1:
      return add_few<1>(sums, begin, wide, count, cells);
    case 2:
      return add_few<2>(sums, begin, wide, count, cells);
    case 3:
      return add_few<3>(sums, begin, wide, count, cells);
    case 4:
      return add_few<4>(sums, begin, wide, count, cells);
    case 5:
      return add_few<5>(sums, begin, wide, count, cells);
    case 6:
      return add_few<6>(sums, begin, wide, count, cells);
    case 7:
      return add_few<7>(sums, begin, wide, count, cells);
    default:
      break;
  }
  for (size_t i = 0; i < count; ++i) {
    const uint32_t* const from = sums + (begin[i] - begin[0]);
    const size_t columns = least + (wide[i] ? 1 : 0);
    uint64_t sum = 0;
    for (size_t x = 0; x < columns; ++x) sum += from[x];
    cells[i] = sum;
  }
}

// Means of cells from their sums, which are integers: exact to the division.
void divide_sums(const double* HWY_RESTRICT sums, const double* HWY_RESTRICT across, double rows,
                 size_t count, float* HWY_RESTRICT means) {
  for (size_t i = 0; i < count; ++i) means[i] = static_cast<float>(sums[i] / (rows * across[i]));
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(sum_columns);
HWY_EXPORT(weigh_columns);
HWY_EXPORT(add_columns);
HWY_EXPORT(divide_sums);

}  // namespace

Grid::Grid(int width_, int height_, int cells_along) : width(width_), height(height_) {
  const int side = std::max(
      {1, static_cast<int>(std::lround(std::min(width, height) / static_cast<double>(cells_along))),
       std::max(width, height) / kMostCellsAlong});
  rows = std::max(1, height / side);
  cols = std::max(1, width / side);
}

namespace {

// The samples of a plane, which `columns` x `rows` pixels share.
struct PlaneSamples {
  const uint8_t* plane;
  int columns = 1, rows = 1;
};

constexpr auto kColumns = static_cast<int>(HWY_NAMESPACE::kColumns);

// The sums of columns first .. first + count - 1 of samples, over rows of pixels top .. bottom - 1.
void sum_rows(const Grid& grid, const PlaneSamples& samples, int top, int bottom, int first,
              int count, uint32_t* sums) {
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

// The columns of a grid in samples that `shared` pixels of a row share: the edge of a cell may part
// such pixels.
class Columns {
 public:
  Columns(const Grid& grid, int shared)
      : cols_(static_cast<size_t>(grid.cols)),
        all_((grid.width + shared - 1) / shared),
        least_(grid.width / grid.cols / shared) {
    for (size_t col = 0; col <= cols_; ++col) {
      const int x = grid.left(static_cast<int>(col));
      begin_[col] = static_cast<uint32_t>(x / shared);
      parted_[col] = static_cast<uint32_t>(x % shared);
      if (col == 0) continue;
      across_[col - 1] = x - grid.left(static_cast<int>(col) - 1);
      wide_[col - 1] = begin_[col] - begin_[col - 1] > static_cast<uint32_t>(least_);
    }
  }

  size_t cols() const { return cols_; }
  // PlaneSamples of a row.
  int all() const { return all_; }
  // Samples that are left of a cell, and pixels left of it that share its first sample.
  int begin(size_t col) const { return static_cast<int>(begin_[col]); }
  uint32_t parted(size_t col) const { return parted_[col]; }
  // Where the samples end that cells before `col` have a part of.
  int end(size_t col) const { return begin(col) + (parted_[col] > 0 ? 1 : 0); }
  const double* across() const { return across_.data(); }  // pixels

  // Sums of cells first .. first + count - 1, whose samples' columns have these sums.
  void add_up(const uint32_t* sums, size_t first, size_t count, uint64_t* cells) const {
    HWY_DYNAMIC_DISPATCH(add_columns)
    (sums, begin_.data() + first, wide_.data() + first, static_cast<size_t>(least_), count, cells);
  }

 private:
  static constexpr size_t kMost = 2 * kMostCellsAlong;
  size_t cols_;
  int all_, least_;  // cells have so many samples, or one more
  std::array<uint32_t, kMost + 1> begin_, parted_;
  std::array<double, kMost> across_;
  std::array<uint8_t, kMost> wide_;
};

// The means of rows of cells first .. end - 1.
void means_of_rows(const Grid& grid, const Columns& columns, int first_row, int end_row,
                   const PlaneSamples& samples, float* means) {
  // Down the columns first: that is a pass over neighbouring samples.
  alignas(64) uint32_t sums[kColumns + 1];
  std::array<uint64_t, 2 * kMostCellsAlong> cells;
  std::array<double, 2 * kMostCellsAlong> exact;
  const size_t cols = columns.cols();
  const auto shared = static_cast<uint64_t>(samples.columns);
  for (int row = first_row; row < end_row; ++row, means += cols) {
    const int top = grid.top(row), bottom = grid.top(row + 1);
    for (size_t first = 0, end; first < cols; first = end) {
      const int left = columns.begin(first);
      end = columns.all() <= kColumns ? cols : first;
      while (end < cols && columns.end(end + 1) - left <= kColumns) ++end;
      if (end == first) {
        // A cell that is wider than that, piece by piece.
        const auto sum_of = [&](int begin, int count) {
          sum_rows(grid, samples, top, bottom, begin, count, sums);
          return std::accumulate(sums, sums + count, uint64_t{0});
        };
        cells[first] = 0;
        for (int x = left; x < columns.begin(first + 1); x += kColumns)
          cells[first] += sum_of(x, std::min(kColumns, columns.begin(first + 1) - x));
        const auto parted = [&](size_t col) {
          return columns.parted(col) > 0 ? columns.parted(col) * sum_of(columns.begin(col), 1) : 0;
        };
        exact[first] =
            static_cast<double>(shared * cells[first] + parted(first + 1) - parted(first));
        ++end;
        continue;
      }
      const int count = columns.end(end) - left;
      sum_rows(grid, samples, top, bottom, left, count, sums);
      sums[count] = 0;
      columns.add_up(sums, first, end - first, cells.data() + first);
      for (size_t col = first; col < end; ++col) {
        const uint64_t pixels =
            shared * cells[col] +
            uint64_t{columns.parted(col + 1)} * sums[columns.begin(col + 1) - left] -
            uint64_t{columns.parted(col)} * sums[columns.begin(col) - left];
        exact[col] = static_cast<double>(static_cast<int64_t>(pixels));
      }
    }
    HWY_DYNAMIC_DISPATCH(divide_sums)
    (exact.data(), columns.across(), bottom - top, cols, means);
  }
}

}  // namespace

void cell_means(const Grid& grid, const uint8_t* plane, float* means) {
  means_of_rows(grid, Columns(grid, 1), 0, grid.rows, {plane}, means);
}

void find_cells(const Grid& grid, const KeptPicture& picture, GridFrames* cells, int frame,
                Pool* pool) {
  const size_t pixels = static_cast<size_t>(grid.width) * static_cast<size_t>(grid.height);
  const bool shares = picture.shape.is_shared();
  const Columns own_samples(grid, 1), shared_ones(grid, shares ? picture.shape.columns : 1);
  for_rows(pool, grid.rows, pixels, [&](int first, int count) {
    for (int c = 0; c < kChannels; ++c) {
      PlaneSamples samples = {picture.plane(c)};
      const bool shared = c > 0 && shares;
      if (shared) samples.columns = picture.shape.columns, samples.rows = picture.shape.rows;
      means_of_rows(grid, shared ? shared_ones : own_samples, first, first + count, samples,
                    cells->plane(frame, c) + ptrdiff_t{first} * grid.cols);
    }
  });
}

}  // namespace qdmd
#endif
