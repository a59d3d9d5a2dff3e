#include "core/passes/patch_density.h"

#include <algorithm>
#include <vector>

#include "core/passes/bands.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/patch_density.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Vectors of at most 32 cells or frames.
constexpr size_t kUnit = 32;
using Steps = hn::CappedTag<uint16_t, kUnit>;

constexpr size_t kR = kPatchRadius, kAlong = 2 * kR + 1;
static_assert(kAlong == 5, "the sums of a patch are written out");
// What a cell counts at most: a patch's sum has room in 16 bits.
constexpr auto kMost = static_cast<uint16_t>(kChannels * kMostDistance * kStepsPerLevel);
static_assert(kAlong * kAlong * kMost < 65536);

// A row of patches' sums, with empty cells at both ends.
constexpr size_t sums_stride(size_t cols) { return (cols + kUnit - 1) / kUnit * kUnit + 2 * kR; }

template <class V>
HWY_INLINE V cell_distance(V r, V g, V b, V other_r, V other_g, V other_b) {
  const auto distance = [](V x, V y) HWY_ATTR { return hn::Sub(hn::Max(x, y), hn::Min(x, y)); };
  const V sum = hn::SaturatedAdd(hn::SaturatedAdd(distance(r, other_r), distance(g, other_g)),
                                 distance(b, other_b));
  return hn::Min(sum, hn::Set(Steps(), kMost));
}

// A plain loop, which the compiler makes vectors of.
void to_steps(const float* HWY_RESTRICT levels, size_t count, uint16_t* HWY_RESTRICT steps) {
  for (size_t i = 0; i < count; ++i) steps[i] = steps_of(levels[i]);
}

HWY_INLINE void add_alike(const uint16_t* HWY_RESTRICT alike, size_t count,
                          float* HWY_RESTRICT density) {
  const hn::CappedTag<float, 16> d;
  const hn::Rebind<int32_t, decltype(d)> d32;
  const hn::Rebind<uint16_t, decltype(d)> d16;
  size_t i = 0;
  for (; i + hn::Lanes(d) <= count; i += hn::Lanes(d)) {
    const auto more = hn::ConvertTo(d, hn::PromoteTo(d32, hn::LoadU(d16, alike + i)));
    hn::StoreU(hn::Add(hn::LoadU(d, density + i), more), d, density + i);
  }
  for (; i < count; ++i) density[i] += static_cast<float>(alike[i]);
}

// Adds rows [first, end) of what frames s and t have in common, in steps, to one density and, if
// there is one, another. of_s, of_t: rows * cols steps of each channel. limit: the steps at which
// nothing is alike. Floats hold these sums exactly. sums: for each of end - first rows
// sums_stride(cols), 0 at first.
void add_pair(const uint16_t* of_s, const uint16_t* of_t, const uint16_t* limit, size_t rows,
              size_t cols, size_t first, size_t end, uint16_t* sums, float* density,
              float* another) {
  const Steps d;
  const size_t lanes = hn::Lanes(d), stride = sums_stride(cols), cells = rows * cols;
  // Down the columns first, with the last rows in registers: what is read right after it was
  // written beside would be waited for. Lanes beyond the row's end hold the next row's cells.
  for (size_t x = 0; x < cols; x += lanes) {
    auto d0 = hn::Zero(d), d1 = d0, d2 = d0, d3 = d0, d4 = d0;
    for (size_t row = first > kR ? first - kR : 0; row < end + kR; ++row) {
      d0 = d1, d1 = d2, d2 = d3, d3 = d4, d4 = hn::Zero(d);
      if (row < rows) {
        const uint16_t *a = of_s + row * cols + x, *b = of_t + row * cols + x;
        d4 = cell_distance(hn::LoadU(d, a), hn::LoadU(d, a + cells), hn::LoadU(d, a + 2 * cells),
                           hn::LoadU(d, b), hn::LoadU(d, b + cells), hn::LoadU(d, b + 2 * cells));
      }
      if (row < first + kR) continue;
      hn::StoreU(hn::Add(hn::Add(hn::Add(d0, d1), hn::Add(d2, d3)), d4), d,
                 sums + (row - kR - first) * stride + kR + x);
    }
  }
  for (size_t row = 0; row < end - first; ++row)
    for (size_t i = 0; i < kR; ++i) sums[row * stride + kR + cols + i] = 0;
  for (size_t row = first; row < end; ++row) {
    const uint16_t* of_row = sums + (row - first) * stride;
    HWY_ALIGN uint16_t alike[kUnit];
    for (size_t x = 0; x < cols; x += lanes) {
      const auto outer = hn::Add(hn::LoadU(d, of_row + x), hn::LoadU(d, of_row + x + 4));
      const auto inner = hn::Add(hn::LoadU(d, of_row + x + 1), hn::LoadU(d, of_row + x + 3));
      const auto patch = hn::Add(hn::Add(outer, inner), hn::LoadU(d, of_row + x + 2));
      const size_t cell = row * cols + x, count = std::min(lanes, cols - x);
      hn::Store(hn::SaturatedSub(hn::LoadU(d, limit + cell), patch), d, alike);
      add_alike(alike, count, density + cell);
      if (another) add_alike(alike, count, another + cell);
    }
  }
}

// The sums of the distances of one cell's patch, cells left to right of rows above to below, in all
// frames from the frame `other`. steps: of each cell and channel `frames`, whole vectors.
void add_patch(const uint16_t* steps, size_t cols, size_t frames, size_t above, size_t below,
               size_t left, size_t right, size_t other, uint16_t* sums) {
  const Steps d;
  for (size_t t = 0; t < frames; t += hn::Lanes(d)) {
    auto sum = hn::Zero(d);
    for (size_t y = above; y <= below; ++y)
      for (size_t x = left; x <= right; ++x) {
        const uint16_t* r = steps + (y * cols + x) * kChannels * frames;
        const uint16_t *g = r + frames, *b = g + frames;
        sum = hn::Add(
            sum, cell_distance(hn::LoadU(d, r + t), hn::LoadU(d, g + t), hn::LoadU(d, b + t),
                               hn::Set(d, r[other]), hn::Set(d, g[other]), hn::Set(d, b[other])));
      }
    hn::StoreU(sum, d, sums + t);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(to_steps);
HWY_EXPORT(add_pair);
HWY_EXPORT(add_patch);

// Whole vectors of every instruction set.
constexpr size_t kVector = 32;
// Rows of a band at most. What it has in common with its neighbours costs little.
constexpr int kBandRows = 12;
// Frames that are compared with all before while they are in the first cache.
constexpr int kBlock = 8;

size_t round_up(size_t count) { return (count + kVector - 1) / kVector * kVector; }

}  // namespace

PatchFrames::PatchFrames(const Grid& grid, const GridPictures& frames, int count, Pool* pool)
    : grid_(grid),
      bands_(std::min(grid.rows, std::max((grid.rows + kBandRows - 1) / kBandRows,
                                          static_cast<int>(pool->threads())))),
      // Threads touch what is theirs.
      steps_(std::make_unique_for_overwrite<uint16_t[]>(
          static_cast<size_t>(count) * kChannels * grid.cells() + kVector)),
      limit_(grid.cells() + kVector),
      sums_(sums_size() * pool->threads()) {
  pool->run(static_cast<size_t>(count), [&](size_t t) {
    // The channels lie one after another in both.
    HWY_DYNAMIC_DISPATCH(to_steps)
    (frames.plane(static_cast<int>(t), 0), kChannels * grid_.cells(),
     steps_.get() + t * kChannels * grid_.cells());
  });
  std::fill_n(steps_.get() + static_cast<size_t>(count) * kChannels * grid_.cells(), kVector,
              uint16_t{0});
  size_t cell = 0;
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col, ++cell)
      limit_[cell] =
          static_cast<uint16_t>(kChannels * kSimilar * kStepsPerLevel *
                                static_cast<float>(patch_cells(grid, row, col, kPatchRadius)));
}

uint64_t PatchFrames::bytes(const Grid& grid, uint64_t count) {
  return sizeof(uint16_t) * grid.cells() * (count * kChannels + 1);
}

size_t PatchFrames::sums_size() const {
  return kBandRows * (round_up(static_cast<size_t>(grid_.cols)) + 2 * kPatchRadius);
}

void PatchFrames::density(int count, Pool* pool, float* density) {
  const size_t cells = grid_.cells(), cols = static_cast<size_t>(grid_.cols);
  const auto of = [&](int t) { return density + static_cast<size_t>(t) * cells; };
  for_bands(*pool, grid_.rows, bands_, [&](int first_row, int row_count, size_t worker) {
    const auto first = static_cast<size_t>(first_row), end = first + static_cast<size_t>(row_count);
    uint16_t* sums = sums_.data() + worker * sums_size();
    for (int t = 0; t < count; ++t) std::fill_n(of(t) + first * cols, (end - first) * cols, 0.0f);
    for (int block = 0; block < count; block += kBlock) {
      const int last = std::min(count, block + kBlock);
      for (int s = 0; s < last; ++s)
        for (int t = std::max(s, block); t < last; ++t) HWY_DYNAMIC_DISPATCH(add_pair)
      (steps(s), steps(t), limit_.data(), static_cast<size_t>(grid_.rows), cols, first, end, sums,
       of(s), s == t ? nullptr : of(t));
    }
    for (int t = 0; t < count; ++t)
      for (size_t cell = first * cols; cell < end * cols; ++cell)
        of(t)[cell] /= static_cast<float>(limit_[cell]);
  });
}

void PatchFrames::alike(int s, int t, int part, size_t worker, float* alike) {
  const size_t first = first_cell(part), end = first_cell(part + 1);
  const auto cols = static_cast<size_t>(grid_.cols);
  std::fill(alike + first, alike + end, 0.0f);
  HWY_DYNAMIC_DISPATCH(add_pair)
  (steps(s), steps(t), limit_.data(), static_cast<size_t>(grid_.rows), cols, first / cols,
   end / cols, sums_.data() + worker * sums_size(), alike, nullptr);
  for (size_t cell = first; cell < end; ++cell) alike[cell] /= static_cast<float>(limit_[cell]);
}

uint64_t patch_distance_bytes(const Grid& grid, uint64_t count) {
  return sizeof(uint16_t) * grid.cells() * (kChannels * round_up(count) + count);
}

void patch_distance(const Grid& grid, const GridPictures& frames, int count, const int* reference,
                    Pool* pool, uint16_t* distance) {
  const auto rows = static_cast<size_t>(grid.rows), cols = static_cast<size_t>(grid.cols);
  const int known = std::max(count, *std::max_element(reference, reference + grid.cells()) + 1);
  const auto all = static_cast<size_t>(count), stride = round_up(static_cast<size_t>(known));
  // Of each cell and channel all frames side by side.
  const auto steps = std::make_unique_for_overwrite<uint16_t[]>(grid.cells() * kChannels * stride);
  std::vector<uint16_t> sums(stride * pool->threads());
  // Some cells of all frames at a time: their frames are too far apart for the caches to keep the
  // others.
  constexpr size_t kTogether = 16;
  pool->run((grid.cells() + kTogether - 1) / kTogether, [&](size_t part) {
    const size_t first = part * kTogether, size = std::min(kTogether, grid.cells() - first);
    for (size_t c = 0; c < kChannels; ++c)
      for (int t = 0; t < static_cast<int>(stride); ++t) {
        // Those that only fill vectors are black.
        uint16_t of_frame[kTogether] = {};
        if (t < known) HWY_DYNAMIC_DISPATCH(to_steps)
        (frames.plane(t, static_cast<int>(c)) + first, size, of_frame);
        uint16_t* to = steps.get() + (first * kChannels + c) * stride + static_cast<size_t>(t);
        for (size_t i = 0; i < size; ++i) to[i * kChannels * stride] = of_frame[i];
      }
  });
  pool->run(rows, [&](size_t row, size_t worker) {
    uint16_t* sum = sums.data() + worker * stride;
    constexpr size_t kReach = kNearRadius;
    for (size_t col = 0; col < cols; ++col) {
      const size_t cell = row * cols + col;
      HWY_DYNAMIC_DISPATCH(add_patch)
      (steps.get(), cols, stride, row - std::min(row, kReach), std::min(rows - 1, row + kReach),
       col - std::min(col, kReach), std::min(cols - 1, col + kReach),
       static_cast<size_t>(reference[cell]), sum);
      std::copy_n(sum, all, distance + cell * all);
    }
  });
}

}  // namespace qdmd
#endif
