// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/frames/frame_reducer.h"

#include <algorithm>
#include <cstring>

#include "core/base/channels.h"
#include "core/passes/bands.h"
#include "core/passes/chroma.h"
#include "core/passes/digits.h"
#include "core/passes/planes.h"
#include "core/planes/samples.h"

namespace qdmd {
namespace {

// Channels and alpha.
constexpr size_t kPlanes = kChannels + 1;
constexpr int kMostScale = 4;
// Samples of a row that are worked on together, at most: they stay in the nearest cache.
constexpr int kRun = 1024;

// Samples of a channel, or of alpha, and how they lie.
struct Plane {
  const uint8_t* from;
  Spacing at;
  SampleBits bits;
  int width, height;  // samples
};

// `count` samples of a row from column `left` on: where they are, or in `room`.
const uint8_t* read(const Plane& plane, int y, int left, size_t count, uint8_t* room) {
  const uint8_t* const from = plane.from + y * plane.at.row_stride + left * plane.at.pixel_stride;
  if (plane.at.pixel_stride == 1) return from;
  spread_samples(from, plane.at.pixel_stride, 1, count, room);
  return room;
}
const uint16_t* read(const Plane& plane, int y, int left, size_t count, uint16_t* room) {
  const uint8_t* from = plane.from + y * plane.at.row_stride + left * plane.at.pixel_stride;
  const auto most = static_cast<unsigned>(plane.bits.most());
  for (size_t p = 0; p < count; ++p, from += plane.at.pixel_stride) {
    uint16_t word = 0;
    std::memcpy(&word, from, sizeof word);
    room[p] = static_cast<uint16_t>(static_cast<unsigned>(word) >> plane.bits.shift & most);
  }
  return room;
}

// Of `rows` rows, scale at most.
template <typename T>
void reduce_run(const T* const* rows, int count_of_rows, size_t count, int scale, T* out) {
  const auto row = [&](int r) { return r < count_of_rows ? rows[r] : nullptr; };
  if (scale == 2) return mean_of_pairs(row(0), row(1), count, out);
  T halves[2][kRun / 2];
  mean_of_pairs(row(0), row(1), count, halves[0]);
  if (row(2)) mean_of_pairs(row(2), row(3), count, halves[1]);
  mean_of_pairs(halves[0], row(2) ? halves[1] : nullptr, (count + 1) / 2, out);
}

// Rows first .. end - 1 of the smaller plane.
template <typename T>
void reduce_rows(const Plane& plane, int scale, int first, int end, uint8_t* to) {
  alignas(64) T room[kMostScale][kRun];
  const int small_width = (plane.width + scale - 1) / scale;
  for (int y = first; y < end; ++y) {
    T* const out = reinterpret_cast<T*>(to) + static_cast<ptrdiff_t>(y) * small_width;
    const int top = y * scale, count_of_rows = std::min(scale, plane.height - top);
    for (int left = 0; left < plane.width; left += kRun) {
      const auto count = static_cast<size_t>(std::min(kRun, plane.width - left));
      const T* rows[kMostScale];
      for (int r = 0; r < count_of_rows; ++r) rows[r] = read(plane, top + r, left, count, room[r]);
      reduce_run(rows, count_of_rows, count, scale, out + left / scale);
    }
  }
}

// The same of three channels of bytes whose samples lie side by side, in one walk over them.
void reduce_pixels(const ImageView& frame, int scale, int first, int end, uint8_t* const to[3]) {
  alignas(64) uint8_t room[kChannels][kMostScale * kRun];
  uint8_t* const planes[] = {room[0], room[1], room[2]};
  const int small_width = (frame.width + scale - 1) / scale;
  for (int y = first; y < end; ++y) {
    const int top = y * scale;
    for (int left = 0; left < frame.width; left += kRun) {
      ImageView part = frame;
      part.width = std::min(kRun, frame.width - left);
      part.height = std::min(scale, frame.height - top);
      const auto shift = [&](const uint8_t* from) {
        return from + top * frame.row_stride + left * frame.pixel_stride;
      };
      for (int c = 0; c < kChannels; ++c) part.channel[c] = shift(frame.channel[c]);
      if (frame.alpha) part.alpha = shift(frame.alpha);
      split_channels(part, 0, part.height, 0, planes);
      const auto count = static_cast<size_t>(part.width);
      for (int c = 0; c < kChannels; ++c) {
        const uint8_t* rows[kMostScale];
        for (int r = 0; r < part.height; ++r) rows[r] = planes[c] + static_cast<size_t>(r) * count;
        reduce_run(rows, part.height, count, scale,
                   to[c] + static_cast<ptrdiff_t>(y) * small_width + left / scale);
      }
    }
  }
}

}  // namespace

size_t FrameReducer::plane_bytes(const Reduction& size, int depth) {
  return static_cast<size_t>(sample_bytes(depth)) * size.small_pixels();
}

uint64_t FrameReducer::bytes(const Reduction& size, int depth) {
  return kPlanes * uint64_t{plane_bytes(size, depth)};
}

FrameReducer::FrameReducer(const Reduction& size, int depth)
    : size_(size),
      depth_(depth),
      planes_(std::make_unique_for_overwrite<uint8_t[]>(bytes(size, depth))) {}

ImageView FrameReducer::reduce(const ImageView& frame, Pool* pool) {
  ImageView small;
  small.width = size_.small_width();
  small.height = size_.small_height();
  small.bits = {depth_, 0};
  const int bytes = sample_bytes(depth_);
  Plane planes[kPlanes];
  int together = 1;
  for (size_t c = 0; c < kPlanes; ++c) {
    const bool is_alpha = c == kChannels;
    const Spacing at = frame.spacing(static_cast<int>(c));
    planes[c] = {is_alpha ? frame.alpha : frame.channel[c], at, frame.bits,
                 (frame.width + at.columns - 1) / at.columns,
                 (frame.height + at.rows - 1) / at.rows};
    // Grey has one plane, and padding says nothing.
    if (c > 0 && (planes[c].from == planes[0].from || (is_alpha && frame.alpha_is_padding)))
      planes[c].from = nullptr;
    const int width = (small.width + at.columns - 1) / at.columns;
    small.own[c] = {bytes, ptrdiff_t{bytes} * width, at.columns, at.rows};
    if (is_alpha)
      small.alpha = planes[c].from ? plane(c) : nullptr;
    else
      small.channel[c] = plane(planes[c].from ? c : 0);
    together = std::max(together, at.rows);
  }
  const bool packed = !frame.bits.is_deep() && frame.is_even() && frame.pixel_stride > 1;
  const int steps = (small.height + together - 1) / together;
  for_rows(pool, steps, size_.pixels(), [&](int first, int count) {
    const int top = first * together, end = std::min((first + count) * together, small.height);
    uint8_t* const to[] = {plane(0), plane(1), plane(2)};
    if (packed) reduce_pixels(frame, size_.scale, top, end, to);
    for (size_t c = packed ? kChannels : 0; c < kPlanes; ++c) {
      if (!planes[c].from) continue;
      const int rows = planes[c].at.rows, from = top / rows, until = (end + rows - 1) / rows;
      if (frame.bits.is_deep())
        reduce_rows<uint16_t>(planes[c], size_.scale, from, until, plane(c));
      else
        reduce_rows<uint8_t>(planes[c], size_.scale, from, until, plane(c));
    }
  });
  return small;
}

}  // namespace qdmd
