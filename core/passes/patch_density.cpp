#include "core/passes/patch_density.h"

#include <algorithm>
#include <cmath>

#include "core/passes/bands.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/patch_density.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

// Plain loops, which the compiler makes vectors of for each instruction set.

// Rows [first, end) of the density. scratch: (end - first + 2 kPatchRadius + 1) rows of
// cols + 2 kPatchRadius.
void density_band(const Grid& grid, const GridFrames& frames, int count, int first, int end,
                  float* scratch, float* density) {
  constexpr int kR = kPatchRadius;
  const int cols = grid.cols, stride = cols + 2 * kR;
  const int top = std::max(0, first - kR), bottom = std::min(grid.rows, end + kR);
  // The column sums of one row of patches, with empty cells at both ends.
  float* sums = scratch + static_cast<ptrdiff_t>(bottom - top) * cols;
  std::fill_n(sums, stride, 0.0f);
  for (int s = 0; s < count; ++s)
    for (int t = s; t < count; ++t) {
      const ptrdiff_t start = static_cast<ptrdiff_t>(top) * cols;
      const float *ar = frames.plane(s, 0) + start, *ag = frames.plane(s, 1) + start,
                  *ab = frames.plane(s, 2) + start;
      const float *br = frames.plane(t, 0) + start, *bg = frames.plane(t, 1) + start,
                  *bb = frames.plane(t, 2) + start;
      const int inside = (bottom - top) * cols;
      for (int i = 0; i < inside; ++i) {
        const float sum =
            std::abs(ar[i] - br[i]) + std::abs(ag[i] - bg[i]) + std::abs(ab[i] - bb[i]);
        scratch[i] = std::min(sum, 3 * kMostDistance);
      }
      for (int row = first; row < end; ++row) {
        const int above = std::max(top, row - kR), below = std::min(bottom - 1, row + kR);
        float* column = sums + kR;
        const float* from = scratch + static_cast<ptrdiff_t>(above - top) * cols;
        for (int x = 0; x < cols; ++x) column[x] = from[x];
        for (int y = above + 1; y <= below; ++y) {
          from += cols;
          for (int x = 0; x < cols; ++x) column[x] += from[x];
        }
        const ptrdiff_t cell = static_cast<ptrdiff_t>(row) * cols;
        float* of_s = density + static_cast<ptrdiff_t>(s) * grid.rows * cols + cell;
        float* of_t = density + static_cast<ptrdiff_t>(t) * grid.rows * cols + cell;
        const auto patch_rows = static_cast<float>(below - above + 1);
        const float scale = 1 / (3 * kSimilar * patch_rows);
        const auto add = [&](int x, float patch_cols) {
          const float sum = sums[x] + sums[x + 1] + sums[x + 2] + sums[x + 3] + sums[x + 4];
          const float alike = std::max(0.0f, 1 - sum * scale / patch_cols);
          of_s[x] += alike;
          if (s != t) of_t[x] += alike;
        };
        const auto columns_at = [&](int x) {
          return static_cast<float>(std::min(cols - 1, x + kR) - std::max(0, x - kR) + 1);
        };
        const int left = std::min(kR, cols), right = std::max(left, cols - kR);
        for (int x = 0; x < left; ++x) add(x, columns_at(x));
        if (s != t) {
          const float whole = scale / (2 * kR + 1);
          for (int x = left; x < right; ++x) {
            const float sum = sums[x] + sums[x + 1] + sums[x + 2] + sums[x + 3] + sums[x + 4];
            const float alike = std::max(0.0f, 1 - sum * whole);
            of_s[x] += alike;
            of_t[x] += alike;
          }
        } else {
          for (int x = left; x < right; ++x) of_s[x] += 1;
        }
        for (int x = right; x < cols; ++x) add(x, columns_at(x));
      }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(density_band);

static_assert(kPatchRadius == 2, "the sum of a patch's columns is written out");

// Bands of rows whose halo costs little.
constexpr int kBandRows = 16;

int band_count(const Grid& grid) { return (grid.rows + kBandRows - 1) / kBandRows; }

}  // namespace

void patch_density(const Grid& grid, const GridFrames& frames, int count, Pool* pool,
                   float* density) {
  std::fill_n(density, grid.cells() * static_cast<size_t>(count), 0.0f);
  const size_t scratch_size = static_cast<size_t>(kBandRows + 2 * kPatchRadius + 1) *
                              static_cast<size_t>(grid.cols + 2 * kPatchRadius);
  std::vector<float> scratch(scratch_size * pool->threads());
  for_bands(*pool, grid.rows, band_count(grid), [&](int first, int rows, size_t worker) {
    HWY_DYNAMIC_DISPATCH(density_band)
    (grid, frames, count, first, first + rows, scratch.data() + worker * scratch_size, density);
  });
}

void patch_distance(const Grid& grid, const GridFrames& frames, int count, const int* reference,
                    Pool* pool, float* distance) {
  for_bands(*pool, grid.rows, band_count(grid), [&](int first, int rows, size_t) {
    for (int t = 0; t < count; ++t)
      for (int y = first; y < first + rows; ++y)
        for (int x = 0; x < grid.cols; ++x) {
          const int cell = y * grid.cols + x, other = reference[cell];
          const int above = std::max(0, y - kPatchRadius),
                    below = std::min(grid.rows - 1, y + kPatchRadius);
          const int left = std::max(0, x - kPatchRadius),
                    right = std::min(grid.cols - 1, x + kPatchRadius);
          float sum = 0;
          for (int yy = above; yy <= below; ++yy)
            for (int xx = left; xx <= right; ++xx) {
              const int i = yy * grid.cols + xx;
              float d = 0;
              for (int c = 0; c < kChannels; ++c)
                d += std::abs(frames.plane(t, c)[i] - frames.plane(other, c)[i]);
              sum += std::min(d, 3 * kMostDistance);
            }
          const auto cells = static_cast<float>(3 * (below - above + 1) * (right - left + 1));
          distance[static_cast<size_t>(t) * grid.cells() + static_cast<size_t>(cell)] = sum / cells;
        }
  });
}

}  // namespace qdmd
#endif
