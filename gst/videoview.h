// SPDX-License-Identifier: LGPL-2.1-or-later
// Shows a mapped GstVideoFrame to the core as an ImageView.
#pragma once

#include <gst/video/video.h>

#include <algorithm>
#include <utility>

#include "core/base/image_view.h"
#include "core/base/levels.h"

namespace qdmd {

// How the samples of a format lie in memory.
inline SampleBits bits_of(const GstVideoInfo& info) {
  return {int(GST_VIDEO_INFO_COMP_DEPTH(&info, 0)),
          int(GST_VIDEO_FORMAT_INFO_SHIFT(info.finfo, 0))};
}

// What black, white and neutral chroma are, in the highest 8 bits, full or limited range as the
// caps say. Where they do not say it, Y, U and V are of limited range.
inline Levels levels_of(const GstVideoInfo& info) {
  const bool yuv = GST_VIDEO_INFO_IS_YUV(&info);
  GstVideoColorRange range = info.colorimetry.range;
  if (range == GST_VIDEO_COLOR_RANGE_UNKNOWN)
    range = yuv ? GST_VIDEO_COLOR_RANGE_16_235 : GST_VIDEO_COLOR_RANGE_0_255;
  gint offset[GST_VIDEO_MAX_COMPONENTS], scale[GST_VIDEO_MAX_COMPONENTS];
  gst_video_color_range_offsets(range, info.finfo, offset, scale);
  Levels levels;
  for (int c = 0; c < 3; ++c) {
    const int from = GST_VIDEO_INFO_IS_GRAY(&info) ? 0 : c;
    const int low = bits_of(info).low();
    levels.black[c] = static_cast<uint8_t>(offset[from] >> low);
    levels.white[c] =
        static_cast<uint8_t>((offset[from] + (yuv && c > 0 ? 0 : scale[from])) >> low);
  }
  return levels;
}

// The first sample of a component. GStreamer 1.22 has V of P010 one byte behind U, which is in the
// middle of it.
inline guint8* component_data(const GstVideoFrame& frame, int component) {
  const int offset = GST_VIDEO_FRAME_COMP_POFFSET(&frame, component);
  const bool wide = GST_VIDEO_FRAME_COMP_DEPTH(&frame, component) > 8;
  return static_cast<guint8*>(GST_VIDEO_FRAME_COMP_DATA(&frame, component)) +
         (wide && offset % 2 == 1 ? offset : 0);
}

// What a buffer's metadata says of it is a frame of these caps; more pixels may lie around it.
inline bool suits(const GstVideoInfo& info, const GstVideoMeta* meta) {
  return !meta || (meta->format == GST_VIDEO_INFO_FORMAT(&info) &&
                   meta->n_planes == GST_VIDEO_INFO_N_PLANES(&info) &&
                   meta->width >= guint(info.width) && meta->height >= guint(info.height));
}

// All samples are inside of what was mapped. GStreamer does not look: offsets and strides of the
// metadata are whatever upstream has written there.
inline bool has_all_samples(const GstVideoFrame& frame) {
  for (guint c = 0; c < GST_VIDEO_FRAME_N_COMPONENTS(&frame); ++c) {
    const guint plane = GST_VIDEO_FRAME_COMP_PLANE(&frame, c);
    const GstMapInfo& map = frame.map[frame.meta ? plane : 0];
    const gint64 before = static_cast<const guint8*>(frame.data[plane]) - map.data;
    const gint64 last_row =
        gint64{GST_VIDEO_FRAME_COMP_HEIGHT(&frame, c) - 1} * GST_VIDEO_FRAME_COMP_STRIDE(&frame, c);
    const gint64 row =
        gint64{GST_VIDEO_FRAME_COMP_WIDTH(&frame, c)} * GST_VIDEO_FRAME_COMP_PSTRIDE(&frame, c);
    if (before + std::min<gint64>(last_row, 0) < 0 ||
        before + std::max<gint64>(last_row, 0) + row > gint64(map.size))
      return false;
  }
  return true;
}

// Maps a buffer for as long as it lives. The map is released before the buffer is handed on. False
// where the buffer does not hold a frame of these caps.
class MappedVideoFrame {
 public:
  MappedVideoFrame(const GstVideoInfo* info, GstBuffer* buffer, GstMapFlags flags)
      : mapped_(suits(*info, gst_buffer_get_video_meta(buffer)) &&
                gst_video_frame_map(&frame_, const_cast<GstVideoInfo*>(info), buffer, flags)) {
    if (!mapped_ || has_all_samples(frame_)) return;
    gst_video_frame_unmap(&frame_);
    mapped_ = false;
  }
  ~MappedVideoFrame() {
    if (mapped_) gst_video_frame_unmap(&frame_);
  }
  MappedVideoFrame(const MappedVideoFrame&) = delete;
  MappedVideoFrame& operator=(const MappedVideoFrame&) = delete;

  explicit operator bool() const { return mapped_; }

  const GstVideoFrame& frame() const { return frame_; }
  GstVideoFrame& frame() { return frame_; }

  // The samples where they are. Of grey all three channels are the same ones. The fourth byte of
  // packed formats without alpha is no component of GStreamer's: it is where the three others are
  // not.
  template <typename Byte>
  BasicImageView<Byte> view() const {
    BasicImageView<Byte> view;
    view.width = GST_VIDEO_FRAME_WIDTH(&frame_);
    view.height = GST_VIDEO_FRAME_HEIGHT(&frame_);
    view.bits = bits_of(frame_.info);
    const bool alpha = GST_VIDEO_INFO_HAS_ALPHA(&frame_.info);
    const int components = GST_VIDEO_FRAME_N_COMPONENTS(&frame_);
    bool even = true;
    Spacing first;
    for (int c = 0; c < 3 + alpha; ++c) {
      const int component = std::min(c, components - 1);
      Byte* const data = component_data(frame_, component);
      (c < 3 ? view.channel[c] : view.alpha) = data;
      const auto* format = frame_.info.finfo;
      view.own[c] = {GST_VIDEO_FRAME_COMP_PSTRIDE(&frame_, component),
                     GST_VIDEO_FRAME_COMP_STRIDE(&frame_, component),
                     1 << GST_VIDEO_FORMAT_INFO_W_SUB(format, component),
                     1 << GST_VIDEO_FORMAT_INFO_H_SUB(format, component)};
      if (c == 0) first = view.own[0];
      even = even && view.own[c] == first;
    }
    if (!even) return view;
    for (Spacing& own : view.own) own = {};
    view.pixel_stride = first.pixel_stride;
    view.row_stride = first.row_stride;
    if (first.pixel_stride == 4 && !alpha && !view.bits.is_deep()) {
      int fourth = 0 + 1 + 2 + 3;
      for (int c = 0; c < 3; ++c) fourth -= GST_VIDEO_FRAME_COMP_POFFSET(&frame_, c);
      view.alpha = static_cast<Byte*>(GST_VIDEO_FRAME_PLANE_DATA(&frame_, 0)) + fourth;
      view.alpha_is_padding = true;
    }
    return view;
  }

 private:
  GstVideoFrame frame_;
  bool mapped_;
};

}  // namespace qdmd
