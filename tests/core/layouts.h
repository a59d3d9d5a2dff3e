// SPDX-License-Identifier: LGPL-2.1-or-later
// The layouts of video in memory, sample by sample: what views of it have to mean.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "core/base/image_view.h"
#include "tests/core/simd_targets.h"

namespace qdmd::test {

// Where the samples of a channel are.
struct ChannelAt {
  int plane, offset, pixel_stride;
  int columns = 1, rows = 1;  // of pixels that share a sample
};

struct VideoLayout {
  const char* name;
  std::array<ChannelAt, 4> at;  // pixel_stride 0: there is no such channel
};

// Channels are Y, U, V, alpha, or R, G, B.
inline const VideoLayout kVideoLayouts[] = {
    {"I420", {{{0, 0, 1}, {1, 0, 1, 2, 2}, {2, 0, 1, 2, 2}, {}}}},
    {"YV12", {{{0, 0, 1}, {2, 0, 1, 2, 2}, {1, 0, 1, 2, 2}, {}}}},
    {"NV12", {{{0, 0, 1}, {1, 0, 2, 2, 2}, {1, 1, 2, 2, 2}, {}}}},
    {"NV21", {{{0, 0, 1}, {1, 1, 2, 2, 2}, {1, 0, 2, 2, 2}, {}}}},
    {"Y42B", {{{0, 0, 1}, {1, 0, 1, 2, 1}, {2, 0, 1, 2, 1}, {}}}},
    {"NV16", {{{0, 0, 1}, {1, 0, 2, 2, 1}, {1, 1, 2, 2, 1}, {}}}},
    {"YUY2", {{{0, 0, 2}, {0, 1, 4, 2, 1}, {0, 3, 4, 2, 1}, {}}}},
    {"YVYU", {{{0, 0, 2}, {0, 3, 4, 2, 1}, {0, 1, 4, 2, 1}, {}}}},
    {"UYVY", {{{0, 1, 2}, {0, 0, 4, 2, 1}, {0, 2, 4, 2, 1}, {}}}},
    {"Y444", {{{0, 0, 1}, {1, 0, 1}, {2, 0, 1}, {}}}},
    {"NV24", {{{0, 0, 1}, {1, 0, 2}, {1, 1, 2}, {}}}},
    {"Y440", {{{0, 0, 1}, {1, 0, 1, 1, 2}, {2, 0, 1, 1, 2}, {}}}},
    {"AYUV", {{{0, 1, 4}, {0, 2, 4}, {0, 3, 4}, {0, 0, 4}}}},
    {"A420", {{{0, 0, 1}, {1, 0, 1, 2, 2}, {2, 0, 1, 2, 2}, {3, 0, 1}}}},
    {"GBR", {{{2, 0, 1}, {0, 0, 1}, {1, 0, 1}, {}}}},
    {"GBRA", {{{2, 0, 1}, {0, 0, 1}, {1, 0, 1}, {3, 0, 1}}}},
    {"RGBA", {{{0, 0, 4}, {0, 1, 4}, {0, 2, 4}, {0, 3, 4}}}},
    {"BGR", {{{0, 2, 3}, {0, 1, 3}, {0, 0, 3}, {}}}},
    {"GRAY", {{{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {}}}},
    // Samples that no kernel is made for.
    {"sparse", {{{0, 0, 3}, {1, 0, 5, 2, 2}, {1, 3, 5, 2, 2}, {2, 0, 3}}}}};

// The layout with samples that are words, of more than 8 bits.
inline VideoLayout of_words(VideoLayout layout) {
  for (ChannelAt& at : layout.at) at.offset *= 2, at.pixel_stride *= 2;
  return layout;
}

// A picture in such a layout. Each plane ends with its last sample before an inaccessible page, and
// the rows of plane k are gap + 2 k bytes longer than they have to be.
class VideoPicture {
 public:
  static constexpr uint8_t kCanary = 0x5A;

  VideoPicture(const VideoLayout& layout, int width, int height, int gap, SampleBits bits = {})
      : layout_(layout), width_(width), height_(height), bits_(bits) {
    const int size = bits.is_deep() ? 2 : 1;
    std::array<int, 4> used{}, rows{};
    for (const ChannelAt& at : layout.at) {
      if (at.pixel_stride == 0) continue;
      const auto plane = static_cast<size_t>(at.plane);
      used[plane] =
          std::max(used[plane], at.offset + (width - 1) / at.columns * at.pixel_stride + size);
      rows[plane] = (height - 1) / at.rows + 1;
    }
    for (size_t plane = 0; plane < 4; ++plane) {
      if (used[plane] == 0) continue;
      row_stride_[plane] = used[plane] + gap + 2 * static_cast<int>(plane);
      planes_[plane] = std::make_unique<BeforeTheEdge<uint8_t>>(
          static_cast<size_t>(row_stride_[plane] * (rows[plane] - 1) + used[plane]));
      std::fill(planes_[plane]->begin(), planes_[plane]->end(), kCanary);
    }
  }

  bool has(int c) const { return layout_.at[static_cast<size_t>(c)].pixel_stride != 0; }
  SampleBits bits() const { return bits_; }
  const ChannelAt& layout_of(int c) const { return layout_.at[static_cast<size_t>(c)]; }
  // A sample of channel c, or of alpha (3); the first byte of a word.
  uint8_t& sample(int c, int x, int y) {
    const ChannelAt& at = layout_of(c);
    const auto plane = static_cast<size_t>(at.plane);
    return (*planes_[plane])[static_cast<size_t>(at.offset + y / at.rows * row_stride_[plane] +
                                                 x / at.columns * at.pixel_stride)];
  }
  // Sets a sample of more than 8 bits.
  void put_word(int c, int x, int y, int value) {
    uint8_t* const at = &sample(c, x, y);
    at[0] = static_cast<uint8_t>(value << bits_.shift & 255);
    at[1] = static_cast<uint8_t>(value << bits_.shift >> 8);
  }
  void fill_randomly(std::mt19937& rng) {
    for (auto& plane : planes_)
      if (plane)
        for (uint8_t& byte : *plane) byte = static_cast<uint8_t>(rng() >> 9);
  }
  // All bytes, those between samples included.
  std::vector<uint8_t> bytes() const {
    std::vector<uint8_t> all;
    for (const auto& plane : planes_)
      if (plane) all.insert(all.end(), plane->data(), plane->data() + plane->size());
    return all;
  }

  // Even where it can be.
  template <typename Byte>
  BasicImageView<Byte> view() {
    BasicImageView<Byte> view;
    view.width = width_, view.height = height_;
    view.bits = bits_;
    bool even = true;
    for (int c = 0; c < 4; ++c) {
      if (!has(c)) continue;
      const ChannelAt& at = layout_of(c);
      (c < 3 ? view.channel[c] : view.alpha) = &sample(c, 0, 0);
      view.own[c] = {at.pixel_stride, row_stride_[static_cast<size_t>(at.plane)], at.columns,
                     at.rows};
      even = even && view.own[c] == view.own[0];
    }
    if (!even) return view;
    view.pixel_stride = view.own[0].pixel_stride, view.row_stride = view.own[0].row_stride;
    for (Spacing& own : view.own) own = {};
    return view;
  }

 private:
  VideoLayout layout_;
  int width_, height_;
  SampleBits bits_;
  std::array<ptrdiff_t, 4> row_stride_{};
  std::array<std::unique_ptr<BeforeTheEdge<uint8_t>>, 4> planes_;
};

// Around vectors of every size, and odd.
inline constexpr std::pair<int, int> kVideoSizes[] = {{1, 1},   {2, 1},   {1, 2},   {3, 3},
                                                      {16, 5},  {33, 4},  {64, 2},  {67, 3},
                                                      {129, 2}, {262, 3}, {1027, 2}};

}  // namespace qdmd::test
