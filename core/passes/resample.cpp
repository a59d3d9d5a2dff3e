// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/resample.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/passes/digits.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/resample.cpp"
#include "core/passes/simd.h"

#ifndef QDMD_RESAMPLE_CONSTANTS
#define QDMD_RESAMPLE_CONSTANTS
namespace qdmd {

// A tile of the output: the rows that it is made of are computed once for all of its own.
constexpr int kTileWidth = 256, kTileHeight = 32;
// Samples to both sides of a tile's row that may be read: taps, whole vectors, and turns.
constexpr int kSlack = 96;
// Samples that an output sample is made of, in each direction, and how many of them are before it.
constexpr int kTaps = 6, kBefore = 2;
// Rows that a tile is made of, at most: taps and turns.
constexpr int kTileRows = kTileHeight + 10 + 2 * 16;

}  // namespace qdmd
#endif

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Places are counted anew after so many samples, whatever vectors hold: sums of floats are rounded
// where they begin, and pictures are the same with all of them.
constexpr int kTogether = 16;
using Floats = hn::CappedTag<float, kTogether>;
using Vector = hn::Vec<Floats>;

// c0 + t (c1 + t (c2 + t c3)).
HWY_INLINE Vector cubic(Vector t, float c3, float c2, float c1, float c0) {
  const Floats d;
  auto sum = hn::Add(hn::Mul(hn::Set(d, c3), t), hn::Set(d, c2));
  sum = hn::Add(hn::Mul(sum, t), hn::Set(d, c1));
  return hn::Add(hn::Mul(sum, t), hn::Set(d, c0));
}

// The weight of a sample `way` pixels off.
HWY_INLINE Vector weight_of(Vector way) {
  const Floats d;
  const auto t = hn::Abs(way);
  const auto near = cubic(t, 4.0f / 3, -7.0f / 3, 0, 1);
  const auto far = cubic(t, -7.0f / 12, 3, -59.0f / 12, 2.5f);
  const auto farthest = cubic(t, 1.0f / 12, -2.0f / 3, 21.0f / 12, -1.5f);
  const auto beyond = hn::IfThenElse(hn::Lt(t, hn::Set(d, 2.0f)), far,
                                     hn::IfThenElseZero(hn::Lt(t, hn::Set(d, 3.0f)), farthest));
  return hn::IfThenElse(hn::Lt(t, hn::Set(d, 1.0f)), near, beyond);
}

template <typename T>
HWY_INLINE Vector load_samples(const T* from) {
  const Floats d;
  const hn::Rebind<int32_t, Floats> d32;
  const hn::Rebind<T, Floats> samples;
  return hn::ConvertTo(d, hn::PromoteTo(d32, hn::LoadU(samples, from)));
}

// to[i] is at place + i * step of a row whose samples begin at `row`: place is counted from there.
// Whole vectors; of kTogether neighbours none is two samples further apart than they.
template <typename T>
HWY_INLINE void along(const T* row, float place, float step, int count, float* to) {
  const Floats d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  if (step == 1) {
    const float whole = std::floor(place);
    Vector weight[kTaps];
    for (int k = 0; k < kTaps; ++k)
      weight[k] = weight_of(hn::Set(d, place - whole + kBefore - static_cast<float>(k)));
    const T* from = row + static_cast<int>(whole) - kBefore;
    for (int i = 0; i < count; i += lanes, from += lanes) {
      auto sum = hn::Mul(weight[0], load_samples(from));
      for (int k = 1; k < kTaps; ++k)
        sum = hn::Add(sum, hn::Mul(weight[k], load_samples(from + k)));
      hn::StoreU(sum, d, to + i);
    }
    return;
  }
  const float last = step * static_cast<float>(kTogether - 1);
  for (int first = 0; first < count; first += kTogether) {
    const float at = place + static_cast<float>(first) * step;
    // They are read from samples that are side by side: where places are further apart or nearer
    // than these, the way to them grows.
    const float whole = std::floor(std::min(at, at + last - static_cast<float>(kTogether - 1)));
    const T* const from = row + static_cast<int>(whole) - kBefore;
    const auto start = hn::Set(d, at - whole + kBefore), steps = hn::Set(d, step);
    for (int i = 0; i < std::min(kTogether, count - first); i += lanes) {
      const auto lane = hn::Iota(d, static_cast<float>(i));
      const auto way = hn::Sub(hn::Add(start, hn::Mul(lane, steps)), lane);
      auto sum = hn::Zero(d);
      for (int k = 0; k <= kTaps; ++k)
        sum = hn::Add(sum, hn::Mul(weight_of(hn::Sub(way, hn::Set(d, static_cast<float>(k)))),
                                   load_samples(from + i + k)));
      hn::StoreU(sum, d, to + first + i);
    }
  }
}

void along_row(const uint8_t* row, float place, float step, int count, float* to) {
  along(row, place, step, count, to);
}
void along_deep_row(const uint16_t* row, float place, float step, int count, float* to) {
  along(row, place, step, count, to);
}

template <typename T>
HWY_INLINE void store_samples(Vector sum, float most, T* to) {
  const Floats d;
  const hn::Rebind<int32_t, Floats> d32;
  const hn::Rebind<T, Floats> samples;
  const auto sample = hn::Min(hn::Max(sum, hn::Zero(d)), hn::Set(d, most));
  const auto whole = hn::ConvertTo(d32, hn::Add(sample, hn::Set(d, 0.5f)));
  hn::StoreU(hn::DemoteTo(samples, whole), samples, to);
}

// to[i] is at place + i * step of column i, whose samples are `stride` apart; place is counted from
// the first row. most: the largest sample. Whole vectors.
template <typename T>
HWY_INLINE void down(const float* columns, size_t stride, float place, float step, int count,
                     float most, T* to) {
  const Floats d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  if (step == 0) {
    const float whole = std::floor(place);
    Vector weight[kTaps];
    for (int k = 0; k < kTaps; ++k)
      weight[k] = weight_of(hn::Set(d, place - whole + kBefore - static_cast<float>(k)));
    const float* const first =
        columns + (static_cast<ptrdiff_t>(whole) - kBefore) * static_cast<ptrdiff_t>(stride);
    for (int i = 0; i < count; i += lanes) {
      const float* from = first + i;
      auto sum = hn::Mul(weight[0], hn::LoadU(d, from));
      for (int k = 1; k < kTaps; ++k)
        sum = hn::Add(sum, hn::Mul(weight[k], hn::LoadU(d, from += stride)));
      store_samples(sum, most, to + i);
    }
    return;
  }
  const float last = step * static_cast<float>(kTogether - 1);
  for (int first = 0; first < count; first += kTogether) {
    const float at = place + static_cast<float>(first) * step;
    const float whole = std::floor(std::min(at, at + last));
    const float* const top =
        columns + (static_cast<ptrdiff_t>(whole) - kBefore) * static_cast<ptrdiff_t>(stride) +
        first;
    const auto start = hn::Set(d, at - whole + kBefore), steps = hn::Set(d, step);
    for (int i = 0; i < std::min(kTogether, count - first); i += lanes) {
      const auto way = hn::Add(start, hn::Mul(hn::Iota(d, static_cast<float>(i)), steps));
      const float* from = top + i;
      auto sum = hn::Zero(d);
      for (int k = 0; k <= kTaps; ++k, from += stride)
        sum = hn::Add(sum, hn::Mul(weight_of(hn::Sub(way, hn::Set(d, static_cast<float>(k)))),
                                   hn::LoadU(d, from)));
      store_samples(sum, most, to + first + i);
    }
  }
}

void along_columns(const float* columns, size_t stride, float place, float step, int count,
                   uint8_t* to) {
  down(columns, stride, place, step, count, 255, to);
}
void along_deep_columns(const float* columns, size_t stride, float place, float step, int count,
                        float most, uint16_t* to) {
  down(columns, stride, place, step, count, most, to);
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(along_row);
HWY_EXPORT(along_deep_row);
HWY_EXPORT(along_columns);
HWY_EXPORT(along_deep_columns);

// The numbers 0 .. count - 1 of a row for which low <= start + i * step <= high are one run.
struct Run {
  int begin, end;
};
Run run_within(float start, float step, float low, float high, int count) {
  // The ends are looked for: sums of floats are what they are.
  const auto inside = [&](int i) {
    const float at = start + static_cast<float>(i) * step;
    return at >= low && at <= high;
  };
  if (step == 0) return inside(0) ? Run{0, count} : Run{0, 0};
  const float first = (step > 0 ? low - start : high - start) / step;
  const float last = (step > 0 ? high - start : low - start) / step;
  const auto most = static_cast<float>(count);
  int begin = static_cast<int>(std::clamp(std::ceil(first) - 1, 0.0f, most));
  int end = static_cast<int>(std::clamp(std::floor(last) + 2, 0.0f, most));
  while (begin < end && !inside(begin)) ++begin;
  while (end > begin && !inside(end - 1)) --end;
  return {begin, end};
}

}  // namespace

// What differs between samples of 8 bits and deeper ones: T, and where they lie.
template <typename T>
class Tiles {
 public:
  Tiles(const Resampling& task, ResampleRoom* room);
  // All tiles of so many rows.
  void make(int first_row, int row_count);

 private:
  // Row v of the picture from column `from` on into padded_, outside of it as it ends.
  void read_row(int v, int from);
  void along_row(float place, float step, int count, float* to) const;
  void along_columns(const float* columns, float place, float step, int count);
  void write(size_t at, size_t count);

  static constexpr size_t kStride = kTileWidth + 16;
  static constexpr int kLength = kTileWidth + 2 * kSlack;
  const Resampling& task_;
  float* columns_;
  T* padded_;
  alignas(64) T made_[kStride];
};

template <typename T>
Tiles<T>::Tiles(const Resampling& task, ResampleRoom* room)
    : task_(task), columns_(room->columns_.data()) {
  if constexpr (sizeof(T) == 1)
    padded_ = room->row_.data();
  else
    padded_ = room->deep_row_.data();
}

template <typename T>
void Tiles<T>::along_row(float place, float step, int count, float* to) const {
  if constexpr (sizeof(T) == 1)
    HWY_DYNAMIC_DISPATCH(along_row)(padded_, place, step, count, to);
  else
    HWY_DYNAMIC_DISPATCH(along_deep_row)(padded_, place, step, count, to);
}

template <typename T>
void Tiles<T>::along_columns(const float* columns, float place, float step, int count) {
  if constexpr (sizeof(T) == 1) {
    HWY_DYNAMIC_DISPATCH(along_columns)(columns, kStride, place, step, count, made_);
  } else {
    const auto most = static_cast<float>((1 << task_.depth) - 1);
    HWY_DYNAMIC_DISPATCH(along_deep_columns)(columns, kStride, place, step, count, most, made_);
  }
}

template <typename T>
void Tiles<T>::write(size_t at, size_t count) {
  if constexpr (sizeof(T) == 1)
    std::memcpy(task_.to.high + at, made_, count);
  else
    split_digits(made_, task_.depth, count, task_.to + at);
}

template <typename T>
void Tiles<T>::read_row(int v, int from) {
  const ptrdiff_t start =
      static_cast<ptrdiff_t>(std::clamp(v, 0, task_.from_height - 1)) * task_.from_width;
  const int inside = std::clamp(-from, 0, kLength),
            behind = std::clamp(task_.from_width - from, inside, kLength);
  const auto read = [&](ptrdiff_t column, int count, T* to) {
    const Samples samples = task_.from + static_cast<size_t>(start + column);
    if constexpr (sizeof(T) == 1)
      std::memcpy(to, samples.high, static_cast<size_t>(count));
    else
      join_digits(samples, task_.depth, static_cast<size_t>(count), to);
  };
  T ends[2];
  read(0, 1, &ends[0]);
  read(task_.from_width - 1, 1, &ends[1]);
  std::fill_n(padded_, inside, ends[0]);
  if (behind > inside) read(from + inside, behind - inside, padded_ + inside);
  std::fill_n(padded_ + behind, kLength - behind, ends[1]);
}

template <typename T>
void Tiles<T>::make(int first_row, int row_count) {
  const Places& at = task_.places;
  const auto right = static_cast<float>(task_.from_width - 1),
             low = static_cast<float>(task_.from_height - 1);
  // Along a row of the picture, output columns are so many of its samples apart.
  const float step = at.xx - at.xy * at.yx / at.yy;
  // Tiles are the same for any bands: sums of floats are rounded where they begin.
  for (int top = first_row / kTileHeight * kTileHeight; top < first_row + row_count;
       top += kTileHeight) {
    const int rows = std::min(kTileHeight, task_.height - top);
    for (int left = 0; left < task_.width; left += kTileWidth) {
      const int cols = std::min(kTileWidth, task_.width - left);
      const auto y_of = [&](int x, int y) {
        return at.y0 + at.yx * static_cast<float>(x) + at.yy * static_cast<float>(y);
      };
      const float corners[4] = {y_of(left, top), y_of(left + cols - 1, top),
                                y_of(left, top + rows - 1), y_of(left + cols - 1, top + rows - 1)};
      const float highest = *std::min_element(corners, corners + 4);
      const float lowest = *std::max_element(corners, corners + 4);
      if (lowest < 0 || highest > low) continue;
      // Rows of the picture that the tile is made of, some of them outside of it.
      const int first = static_cast<int>(std::floor(std::max(highest, -1.0f))) - kBefore - 1;
      const int end = static_cast<int>(std::floor(std::min(lowest, low + 1))) + kTaps - kBefore + 3;
      for (int v = first; v < std::min(end, first + kTileRows); ++v) {
        const auto row = static_cast<float>(v);
        // Where the tile's first column is in that row.
        const float y = (row - at.y0 - at.yx * static_cast<float>(left)) / at.yy;
        const float x = at.x0 + at.xx * static_cast<float>(left) + at.xy * y;
        const int from = static_cast<int>(std::floor(x)) - kSlack / 2;
        read_row(v, from);
        along_row(x - static_cast<float>(from), step, cols,
                  columns_ + static_cast<size_t>(v - first) * kStride);
      }
      const int stop_row = std::min(top + rows, first_row + row_count);
      for (int y = std::max(top, first_row); y < stop_row; ++y) {
        const float x_start =
            at.x0 + at.xx * static_cast<float>(left) + at.xy * static_cast<float>(y);
        const float y_start = y_of(left, y);
        const Run across = run_within(x_start, at.xx, 0, right, cols);
        const Run down = run_within(y_start, at.yx, 0, low, cols);
        const int begin = std::max(across.begin, down.begin), stop = std::min(across.end, down.end);
        if (begin >= stop) continue;
        along_columns(columns_ + begin,
                      y_start + at.yx * static_cast<float>(begin) - static_cast<float>(first),
                      at.yx, stop - begin);
        write(static_cast<size_t>(static_cast<ptrdiff_t>(y) * task_.width + left + begin),
              static_cast<size_t>(stop - begin));
      }
    }
  }
}

ResampleRoom::ResampleRoom()
    : columns_(static_cast<size_t>(kTileRows) * (kTileWidth + 16)),
      row_(kTileWidth + 2 * kSlack),
      deep_row_(row_.size()) {}

void resample(const Resampling& task, int first_row, int row_count, ResampleRoom* room) {
  if (task.depth > 8)
    Tiles<uint16_t>(task, room).make(first_row, row_count);
  else
    Tiles<uint8_t>(task, room).make(first_row, row_count);
}

}  // namespace qdmd
#endif
