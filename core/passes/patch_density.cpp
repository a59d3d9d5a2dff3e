// SPDX-License-Identifier: LGPL-2.1-or-later
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

// Vectors of at most 16 cells or frames: grids have few whole vectors of more in a row.
constexpr size_t kUnit = 16;
using Steps = hn::CappedTag<uint16_t, kUnit>;

constexpr size_t kR = kPatchRadius, kAlong = 2 * kR + 1;
static_assert(kAlong == 5, "the sums of a patch are written out");
// What a cell counts at most: a patch's sum has room in 16 bits.
constexpr auto kMost = static_cast<uint16_t>(kChannels * kMostDistance * kStepsPerLevel);
static_assert(kAlong * kAlong * kMost < 65536);

// A row of patches' sums, with empty cells at both ends.
constexpr size_t sums_stride(size_t stride) { return stride + 2 * kR; }

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

// Adds a row of what is alike to a row of densities, and begins anew.
void move_alike(uint16_t* HWY_RESTRICT alike, size_t count, float* HWY_RESTRICT density) {
  for (size_t i = 0; i < count; ++i) {
    density[i] += static_cast<float>(alike[i]);
    alike[i] = 0;
  }
}

// Adds rows [first, end) of what frames s and t have in common, in steps, to `alike` and, if there
// is one, to `another`. All rows are `stride` apart, whole vectors, of which the cells behind
// `cols` are 0. of_s, of_t: the steps of each channel. limit: the steps at which nothing is alike.
// sums: for each of end - first rows sums_stride(stride), 0 at first.
void add_pair(const uint16_t* of_s, const uint16_t* of_t, const uint16_t* limit, size_t rows,
              size_t cols, size_t stride, size_t first, size_t end, uint16_t* sums, uint16_t* alike,
              uint16_t* another) {
  const Steps d;
  const size_t lanes = hn::Lanes(d), sums_step = sums_stride(stride), plane = rows * stride;
  // Down the columns first, with the last rows in registers: what is read right after it was
  // written beside would be waited for.
  for (size_t x = 0; x < cols; x += lanes) {
    auto d0 = hn::Zero(d), d1 = d0, d2 = d0, d3 = d0, d4 = d0, sum = d0;
    for (size_t row = first > kR ? first - kR : 0; row < end + kR; ++row) {
      sum = hn::Sub(sum, d0);
      d0 = d1, d1 = d2, d2 = d3, d3 = d4, d4 = hn::Zero(d);
      if (row < rows) {
        const uint16_t *a = of_s + row * stride + x, *b = of_t + row * stride + x;
        d4 = cell_distance(hn::LoadU(d, a), hn::LoadU(d, a + plane), hn::LoadU(d, a + 2 * plane),
                           hn::LoadU(d, b), hn::LoadU(d, b + plane), hn::LoadU(d, b + 2 * plane));
      }
      sum = hn::Add(sum, d4);
      if (row >= first + kR) hn::StoreU(sum, d, sums + (row - kR - first) * sums_step + kR + x);
    }
  }
  for (size_t row = 0; row < end - first; ++row) {
    const uint16_t* of_row = sums + row * sums_step;
    for (size_t x = 0; x < cols; x += lanes) {
      const auto outer = hn::Add(hn::LoadU(d, of_row + x), hn::LoadU(d, of_row + x + 4));
      const auto inner = hn::Add(hn::LoadU(d, of_row + x + 1), hn::LoadU(d, of_row + x + 3));
      const auto patch = hn::Add(hn::Add(outer, inner), hn::LoadU(d, of_row + x + 2));
      const auto more = hn::SaturatedSub(hn::LoadU(d, limit + (first + row) * stride + x), patch);
      const size_t at = row * stride + x;
      hn::StoreU(hn::Add(hn::LoadU(d, alike + at), more), d, alike + at);
      if (another) hn::StoreU(hn::Add(hn::LoadU(d, another + at), more), d, another + at);
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
HWY_EXPORT(move_alike);
HWY_EXPORT(add_pair);
HWY_EXPORT(add_patch);

// Whole vectors of every instruction set, and their bytes.
constexpr size_t kVector = 16, kAligned = kVector * sizeof(uint16_t);
// Rows of a band at most: so that the usual grid, of 46 to 48 rows, makes four. What a band has in
// common with its neighbours costs little.
constexpr int kBandRows = 15;
// Frames that are compared with all before while they are in the first caches, and as many of
// those before: what so many have in common has room in 16 bits.
constexpr int kBlock = kAdjustable ? 4 : 8;
constexpr int kPatchCells = (2 * kPatchRadius + 1) * (2 * kPatchRadius + 1);
static_assert(kAdjustable || kBlock * kChannels * kSimilar * kStepsPerLevel * kPatchCells < 65536);

size_t round_up(size_t count) { return (count + kVector - 1) / kVector * kVector; }

// As many for each thread, if there are enough rows.
int bands_of(int rows, int threads) {
  const int fewest = (rows + kBandRows - 1) / kBandRows;
  return std::min(rows, (fewest + threads - 1) / threads * threads);
}

// Samples for a band whose rows are `stride` apart: what two frames have in common; and all that a
// thread needs, which is that of each frame of a block, and of another one, and sums.
size_t alike_of(size_t stride) { return kBandRows * stride; }
size_t scratch_of(size_t stride) {
  return (kBlock + 1) * alike_of(stride) + kBandRows * (stride + 2 * kPatchRadius);
}

}  // namespace

PatchFrames::PatchFrames(const Grid& grid, const GridPictures& frames, int count, Pool* pool,
                         LargeVector<uint16_t>* room)
    : grid_(grid),
      bands_(bands_of(grid.rows, static_cast<int>(pool->threads()))),
      limit_(plane()),
      scratch_(scratch_size() * pool->threads()) {
  const auto cols = static_cast<size_t>(grid_.cols), stride = round_up(cols);
  if (!room) room = &own_room_;
  // Threads touch what is theirs.
  make_room(room, steps_of(grid, static_cast<uint64_t>(count)));
  first_ = room->data();
  static_assert(kAligned <= kLargeAlignment);
  pool->run(static_cast<size_t>(count), [&](size_t t) {
    // The channels lie one after another in both.
    const float* from = frames.plane(static_cast<int>(t), 0);
    uint16_t* to = first_ + t * kChannels * plane();
    for (int row = 0; row < kChannels * grid_.rows; ++row, from += cols, to += stride) {
      HWY_DYNAMIC_DISPATCH(to_steps)(from, cols, to);
      std::fill(to + cols, to + stride, uint16_t{0});
    }
  });
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col)
      limit_[static_cast<size_t>(row) * stride + static_cast<size_t>(col)] =
          static_cast<uint16_t>(kChannels * kSimilar * kStepsPerLevel *
                                static_cast<float>(patch_cells(grid, row, col, kPatchRadius)));
}

uint64_t PatchFrames::bytes(const Grid& grid, uint64_t count, int threads) {
  const uint64_t stride = round_up(static_cast<size_t>(grid.cols)),
                 plane = static_cast<uint64_t>(grid.rows) * stride;
  return sizeof(uint16_t) *
         (steps_of(grid, count) + plane + static_cast<uint64_t>(threads) * scratch_of(stride));
}

uint64_t PatchFrames::steps_of(const Grid& grid, uint64_t count) {
  return count * kChannels * static_cast<uint64_t>(grid.rows) *
         round_up(static_cast<size_t>(grid.cols));
}

size_t PatchFrames::plane() const {
  return static_cast<size_t>(grid_.rows) * round_up(static_cast<size_t>(grid_.cols));
}

size_t PatchFrames::scratch_size() const {
  return scratch_of(round_up(static_cast<size_t>(grid_.cols)));
}

void PatchFrames::density(int count, Pool* pool, float* density) {
  const auto cols = static_cast<size_t>(grid_.cols), stride = round_up(cols);
  const size_t cells = grid_.cells(), size = alike_of(stride);
  for_bands(*pool, grid_.rows, bands_, [&](int first_row, int row_count, size_t worker) {
    const auto first = static_cast<size_t>(first_row), rows = static_cast<size_t>(row_count);
    uint16_t* const of_other = scratch_.data() + worker * scratch_size();
    uint16_t* const of_block = of_other + size;
    uint16_t* const sums = of_block + kBlock * size;
    const auto of = [&](int t) { return density + static_cast<size_t>(t) * cells + first * cols; };
    const auto in_block = [&](int t) { return of_block + static_cast<size_t>(t % kBlock) * size; };
    const auto move = [&](uint16_t* alike, int t) {
      for (size_t row = 0; row < rows; ++row) HWY_DYNAMIC_DISPATCH(move_alike)
      (alike + row * stride, cols, of(t) + row * cols);
    };
    for (int t = 0; t < count; ++t) std::fill_n(of(t), rows * cols, 0.0f);
    std::fill(of_other, sums, uint16_t{0});
    for (int block = 0; block < count; block += kBlock) {
      const int last = std::min(count, block + kBlock);
      for (int s = 0; s < last; ++s) {
        for (int t = std::max(s, block); t < last; ++t)
          add_common(s, t, first, first + rows, sums, of_other, s == t ? nullptr : in_block(t));
        move(of_other, s);
        if ((s + 1) % kBlock != 0 && s + 1 < last) continue;
        for (int t = block; t < last; ++t) move(in_block(t), t);
      }
    }
    for (int t = 0; t < count; ++t)
      for (size_t row = 0; row < rows; ++row)
        for (size_t col = 0; col < cols; ++col)
          of(t)[row * cols + col] /= static_cast<float>(limit_[(first + row) * stride + col]);
  });
}

void PatchFrames::alike(int s, int t, int part, size_t worker, float* alike) {
  const auto cols = static_cast<size_t>(grid_.cols), stride = round_up(cols);
  const size_t first = first_cell(part) / cols, end = first_cell(part + 1) / cols;
  uint16_t* const common = scratch_.data() + worker * scratch_size();
  std::fill_n(common, alike_of(stride), uint16_t{0});
  add_common(s, t, first, end, common + (kBlock + 1) * alike_of(stride), common, nullptr);
  for (size_t row = first; row < end; ++row)
    for (size_t col = 0; col < cols; ++col)
      alike[row * cols + col] = static_cast<float>(common[(row - first) * stride + col]) /
                                static_cast<float>(limit_[row * stride + col]);
}

void PatchFrames::add_common(int s, int t, size_t first, size_t end, uint16_t* sums,
                             uint16_t* alike, uint16_t* another) const {
  const auto cols = static_cast<size_t>(grid_.cols);
  HWY_DYNAMIC_DISPATCH(add_pair)
  (steps(s), steps(t), limit_.data(), static_cast<size_t>(grid_.rows), cols, round_up(cols), first,
   end, sums, alike, another);
}

uint64_t patch_distance_steps(const Grid& grid, uint64_t count) {
  return grid.cells() * kChannels * round_up(count);
}

uint64_t patch_distance_bytes(const Grid& grid, uint64_t count) {
  return sizeof(uint16_t) * (patch_distance_steps(grid, count) + grid.cells() * count);
}

void patch_distance(const Grid& grid, const GridPictures& frames, int count, const int* reference,
                    Pool* pool, uint16_t* distance, LargeVector<uint16_t>* room) {
  const auto rows = static_cast<size_t>(grid.rows), cols = static_cast<size_t>(grid.cols);
  const int known = std::max(count, *std::max_element(reference, reference + grid.cells()) + 1);
  const auto all = static_cast<size_t>(count), stride = round_up(static_cast<size_t>(known));
  // The levels of all frames side by side, for each cell and channel.
  LargeVector<uint16_t> own_room;
  if (!room) room = &own_room;
  make_room(room, patch_distance_steps(grid, static_cast<uint64_t>(known)));
  uint16_t* const steps = room->data();
  std::vector<uint16_t> sums(stride * pool->threads());
  // Some cells of all frames at a time: their frames are too far apart for the caches to keep the
  // others.
  constexpr size_t kTogether = 16;
  pool->run((grid.cells() + kTogether - 1) / kTogether, [&](size_t part) {
    const size_t first = part * kTogether, size = std::min(kTogether, grid.cells() - first);
    for (size_t c = 0; c < kChannels; ++c)
      for (int t = 0; t < static_cast<int>(stride); ++t) {
        // Frames that only fill vectors are black.
        uint16_t of_frame[kTogether] = {};
        if (t < known) HWY_DYNAMIC_DISPATCH(to_steps)
        (frames.plane(t, static_cast<int>(c)) + first, size, of_frame);
        uint16_t* to = steps + (first * kChannels + c) * stride + static_cast<size_t>(t);
        for (size_t i = 0; i < size; ++i) to[i * kChannels * stride] = of_frame[i];
      }
  });
  pool->run(rows, [&](size_t row, size_t worker) {
    uint16_t* sum = sums.data() + worker * stride;
    constexpr size_t kReach = kNearRadius;
    for (size_t col = 0; col < cols; ++col) {
      const size_t cell = row * cols + col;
      HWY_DYNAMIC_DISPATCH(add_patch)
      (steps, cols, stride, row - std::min(row, kReach), std::min(rows - 1, row + kReach),
       col - std::min(col, kReach), std::min(cols - 1, col + kReach),
       static_cast<size_t>(reference[cell]), sum);
      std::copy_n(sum, all, distance + cell * all);
    }
  });
}

}  // namespace qdmd
#endif
