// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gst/sceneyuv.h"

#include <algorithm>
#include <cmath>

#include "gst/videoview.h"

namespace qdmd {
namespace {

constexpr int64_t kOne = 65536;

// Puts a sample of the component's depth where it is stored.
void put(uint8_t* to, int sample, const GstVideoFormatInfo* format, int component) {
  if (GST_VIDEO_FORMAT_INFO_DEPTH(format, component) == 8) {
    *to = static_cast<uint8_t>(sample);
    return;
  }
  const auto stored =
      static_cast<guint16>(sample << GST_VIDEO_FORMAT_INFO_SHIFT(format, component));
  // GStreamer's macros for it warn on Arm.
  const size_t low = GST_VIDEO_FORMAT_INFO_IS_LE(format) ? 0 : 1;
  to[low] = static_cast<uint8_t>(stored & 0xff);
  to[1 - low] = static_cast<uint8_t>(stored >> 8);
}

}  // namespace

SceneYuv::SceneYuv(const GstVideoInfo& info) {
  double kr = 0, kb = 0;
  if (!gst_video_color_matrix_get_Kr_Kb(info.colorimetry.matrix, &kr, &kb))
    gst_video_color_matrix_get_Kr_Kb(GST_VIDEO_COLOR_MATRIX_BT601, &kr, &kb);
  gint offset[GST_VIDEO_MAX_COMPONENTS], scale[GST_VIDEO_MAX_COMPONENTS];
  gst_video_color_range_offsets(info.colorimetry.range, info.finfo, offset, scale);
  const auto fixed = [](double weight) {
    return static_cast<int64_t>(std::llround(weight * static_cast<double>(kOne)));
  };
  Weights& y = weights_[0];
  y.offset = offset[0] * kOne + kOne / 2;
  y.r = fixed(kr * scale[0] / 255), y.b = fixed(kb * scale[0] / 255);
  // White is white, and greys have no colour, whatever is rounded.
  y.g = fixed(scale[0] / 255.0) - y.r - y.b;
  if (GST_VIDEO_INFO_IS_GRAY(&info)) return;
  Weights &u = weights_[1], &v = weights_[2];
  const double blue = scale[1] / 255.0 / (2 * (1 - kb)), red = scale[2] / 255.0 / (2 * (1 - kr));
  u = {offset[1] * kOne + kOne / 2, fixed(-kr * blue), 0, fixed((1 - kb) * blue)};
  v = {offset[2] * kOne + kOne / 2, fixed((1 - kr) * red), 0, fixed(-kb * red)};
  u.g = -u.r - u.b;
  v.g = -v.r - v.b;
}

void SceneYuv::write(GstVideoFrame* frame, const std::function<const uint8_t*(int y)>& row) {
  const GstVideoFormatInfo* format = frame->info.finfo;
  const int width = GST_VIDEO_FRAME_WIDTH(frame), height = GST_VIDEO_FRAME_HEIGHT(frame);
  const int components = std::min<int>(3, GST_VIDEO_FRAME_N_COMPONENTS(frame));
  for (int c = 0; c < components; ++c) {
    const Weights& weights = weights_[c];
    const int columns = 1 << GST_VIDEO_FORMAT_INFO_W_SUB(format, c);
    const int rows = 1 << GST_VIDEO_FORMAT_INFO_H_SUB(format, c);
    const int most = (1 << GST_VIDEO_FORMAT_INFO_DEPTH(format, c)) - 1;
    for (int top = 0; top < height; top += rows) {
      const int bottom = std::min(top + rows, height);
      sums_.assign(size_t{3} * static_cast<size_t>(width), 0);
      for (int y = top; y < bottom; ++y) {
        const uint8_t* from = row(y);
        for (size_t i = 0; i < sums_.size(); ++i) sums_[i] += from[i];
      }
      uint8_t* to = component_data(*frame, c) + top / rows * GST_VIDEO_FRAME_COMP_STRIDE(frame, c);
      for (int left = 0; left < width; left += columns) {
        const int right = std::min(left + columns, width);
        int64_t r = 0, g = 0, b = 0;
        for (int x = left; x < right; ++x) {
          const int* sum = sums_.data() + 3 * x;
          r += sum[0], g += sum[1], b += sum[2];
        }
        const int64_t count = (right - left) * (bottom - top);
        const int64_t sample =
            (weights.offset * count + weights.r * r + weights.g * g + weights.b * b) /
            (kOne * count);
        put(to, static_cast<int>(std::clamp<int64_t>(sample, 0, most)), format, c);
        to += GST_VIDEO_FRAME_COMP_PSTRIDE(frame, c);
      }
    }
  }
}

}  // namespace qdmd
