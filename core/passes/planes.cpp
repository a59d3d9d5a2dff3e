// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/planes.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <utility>

#include "core/passes/chroma.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/planes.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Pixels of kStride bytes; byte i of each goes to to[i] (i < 3), or is compared with `alpha` where
// to[i] is null. Returns how many pixels were done, and clears *constant where alpha differs.
template <size_t kStride>
HWY_INLINE size_t split(const uint8_t* from, size_t count, uint8_t* const* to, uint8_t alpha,
                        bool* constant) {
  const hn::ScalableTag<uint8_t> d;
  const size_t lanes = hn::Lanes(d);
  size_t p = 0;
  if constexpr (kStride == 3) {
    for (; p + lanes <= count; p += lanes) {
      hn::Vec<decltype(d)> v0, v1, v2;
      hn::LoadInterleaved3(d, from + 3 * p, v0, v1, v2);
      hn::StoreU(v0, d, to[0] + p);
      hn::StoreU(v1, d, to[1] + p);
      hn::StoreU(v2, d, to[2] + p);
    }
  } else {
    const auto expected = hn::Set(d, alpha);
    auto differences = hn::Zero(d);
    // The alpha byte is the first or the last one.
    const bool alpha_first = to[0] == nullptr;
    uint8_t* const* channels = alpha_first ? to + 1 : to;
    for (; p + lanes <= count; p += lanes) {
      hn::Vec<decltype(d)> v0, v1, v2, v3;
      hn::LoadInterleaved4(d, from + 4 * p, v0, v1, v2, v3);
      hn::StoreU(alpha_first ? v1 : v0, d, channels[0] + p);
      hn::StoreU(alpha_first ? v2 : v1, d, channels[1] + p);
      hn::StoreU(alpha_first ? v3 : v2, d, channels[2] + p);
      differences = hn::Or(differences, hn::Xor(alpha_first ? v0 : v3, expected));
    }
    if (!hn::AllTrue(d, hn::Eq(differences, hn::Zero(d)))) *constant = false;
  }
  return p;
}

size_t split3(const uint8_t* from, size_t count, uint8_t* const* to, uint8_t alpha,
              bool* constant) {
  return split<3>(from, count, to, alpha, constant);
}
size_t split4(const uint8_t* from, size_t count, uint8_t* const* to, uint8_t alpha,
              bool* constant) {
  return split<4>(from, count, to, alpha, constant);
}

// Byte i of each pixel from from[i]. Returns how many pixels were done.
size_t join3(const uint8_t* const* from, size_t count, uint8_t* to) {
  const hn::ScalableTag<uint8_t> d;
  const size_t lanes = hn::Lanes(d);
  size_t p = 0;
  for (; p + lanes <= count; p += lanes)
    hn::StoreInterleaved3(hn::LoadU(d, from[0] + p), hn::LoadU(d, from[1] + p),
                          hn::LoadU(d, from[2] + p), d, to + 3 * p);
  return p;
}
size_t join4(const uint8_t* const* from, size_t count, uint8_t* to) {
  const hn::ScalableTag<uint8_t> d;
  const size_t lanes = hn::Lanes(d);
  size_t p = 0;
  for (; p + lanes <= count; p += lanes)
    hn::StoreInterleaved4(hn::LoadU(d, from[0] + p), hn::LoadU(d, from[1] + p),
                          hn::LoadU(d, from[2] + p), hn::LoadU(d, from[3] + p), d, to + 4 * p);
  return p;
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {
namespace {

HWY_EXPORT(split3);
HWY_EXPORT(split4);
HWY_EXPORT(join3);
HWY_EXPORT(join4);

// Which byte of a packed pixel holds what.
struct Packing {
  ptrdiff_t first = 0;           // from the R sample to the pixel's first byte
  std::array<int, 4> channel{};  // of each byte: 0 R, 1 G, 2 B, 3 alpha or padding

  // False where the view is not of packed pixels in which alpha is the first or last byte.
  template <typename Byte>
  bool describe(const BasicImageView<Byte>& view) {
    if (!view.is_even()) return false;
    const ptrdiff_t stride = view.pixel_stride;
    if (stride != 3 && stride != 4) return false;
    if ((stride == 4) != (view.alpha != nullptr)) return false;
    const Byte* samples[4] = {view.channel[0], view.channel[1], view.channel[2], view.alpha};
    const Byte* pixel = *std::min_element(samples, samples + stride, std::less<>());
    channel.fill(-1);
    for (int c = 0; c < stride; ++c) {
      const ptrdiff_t byte = samples[c] - pixel;
      if (byte >= stride) return false;
      channel[static_cast<size_t>(byte)] = c;
    }
    first = pixel - view.channel[0];
    return std::all_of(channel.begin(), channel.begin() + stride, [](int c) { return c >= 0; }) &&
           (stride == 3 || channel[0] == 3 || channel[3] == 3);
  }
};

// split_channels() of a frame whose channels have distances of their own.
bool split_uneven(const ImageView& frame, int first_row, int row_count, uint8_t alpha,
                  uint8_t* const planes[3]) {
  const auto width = static_cast<size_t>(frame.width);
  for (int c = 0; c < 3; ++c) {
    const Spacing at = frame.spacing(c);
    for (int y = first_row; y < first_row + row_count; ++y) {
      uint8_t* const to = planes[c] + static_cast<size_t>(y) * width;
      if (y > first_row && y % at.rows != 0)
        std::memcpy(to, to - width, width);
      else
        spread_samples(frame.channel[c] + y / at.rows * at.row_stride, at.pixel_stride, at.columns,
                       width, to);
    }
  }
  return is_constant_alpha(frame, first_row, row_count, alpha);
}

}  // namespace

bool is_constant_alpha(const ImageView& frame, int first_row, int row_count, uint8_t alpha) {
  if (!frame.alpha || frame.alpha_is_padding) return true;
  const Spacing at = frame.spacing(3);
  bool constant = true;
  for (int y = first_row; y < first_row + row_count && constant; ++y) {
    const uint8_t* row = frame.alpha + y * at.row_stride;
    if (at.pixel_stride == 1)
      constant = are_all(row, alpha, static_cast<size_t>(frame.width));
    else
      for (int x = 0; x < frame.width; ++x) constant &= row[x * at.pixel_stride] == alpha;
  }
  return constant;
}

bool split_channels(const ImageView& frame, int first_row, int row_count, uint8_t alpha,
                    uint8_t* const planes[3]) {
  if (!frame.is_even()) return split_uneven(frame, first_row, row_count, alpha, planes);
  const ptrdiff_t stride = frame.pixel_stride;
  const bool has_alpha = frame.alpha && !frame.alpha_is_padding;
  size_t rows = static_cast<size_t>(row_count), width = static_cast<size_t>(frame.width);
  const size_t first_pixel = static_cast<size_t>(first_row) * width;
  // Rows without gaps are one long row.
  if (frame.row_stride == stride * frame.width) width *= std::exchange(rows, 1);
  Packing packing;
  const bool packed = packing.describe(frame);
  const auto kernel = stride == 3 ? &HWY_DYNAMIC_DISPATCH(split3) : &HWY_DYNAMIC_DISPATCH(split4);
  bool constant = true;
  for (size_t row = 0; row < rows; ++row) {
    const ptrdiff_t start = (first_row + static_cast<ptrdiff_t>(row)) * frame.row_stride;
    const size_t pixel = first_pixel + row * width;
    size_t done = 0;
    if (packed) {
      uint8_t* to[4] = {nullptr, nullptr, nullptr, nullptr};
      for (size_t byte = 0; byte < static_cast<size_t>(stride); ++byte)
        if (packing.channel[byte] < 3) to[byte] = planes[packing.channel[byte]] + pixel;
      bool same = true;
      done = kernel(frame.channel[0] + packing.first + start, width, to, alpha, &same);
      if (has_alpha) constant &= same;
    }
    for (int c = 0; c < 3; ++c) {
      const uint8_t* from = frame.channel[c] + start;
      uint8_t* to = planes[c] + pixel;
      if (stride == 1)
        std::memcpy(to, from, width);
      else
        for (size_t p = done; p < width; ++p) to[p] = from[static_cast<ptrdiff_t>(p) * stride];
    }
    if (!has_alpha) continue;
    for (size_t p = done; p < width; ++p)
      constant &= frame.alpha[start + static_cast<ptrdiff_t>(p) * stride] == alpha;
  }
  return constant;
}

void join_channels(const uint8_t* const channels[3], const uint8_t* alpha, size_t count,
                   const MutableImageView& out, int row, int left) {
  const ptrdiff_t stride = out.pixel_stride;
  const ptrdiff_t start = row * out.row_stride + left * stride;
  const uint8_t* const samples[4] = {channels[0], channels[1], channels[2], alpha};
  size_t done = 0;
  Packing packing;
  if (packing.describe(out)) {
    const uint8_t* from[4] = {};
    for (size_t byte = 0; byte < static_cast<size_t>(stride); ++byte)
      from[byte] = samples[packing.channel[byte]];
    const auto kernel = stride == 3 ? &HWY_DYNAMIC_DISPATCH(join3) : &HWY_DYNAMIC_DISPATCH(join4);
    done = kernel(from, count, out.channel[0] + packing.first + start);
  }
  for (int c = 0; c < 4; ++c) {
    uint8_t* to = (c < 3 ? out.channel[c] : out.alpha);
    if (!to) continue;
    to += start;
    if (stride == 1)
      std::memcpy(to, samples[c], count);
    else
      for (size_t p = done; p < count; ++p) to[static_cast<ptrdiff_t>(p) * stride] = samples[c][p];
  }
}

}  // namespace qdmd
#endif
