// Shows a mapped GstVideoFrame to the core as an ImageView.
#pragma once

#include <gst/video/video.h>

#include <algorithm>
#include <utility>

#include "core/base/image_view.h"

namespace qdmd {

// Maps a buffer for as long as it lives. The map is released before the buffer is handed on.
class MappedVideoFrame {
 public:
  MappedVideoFrame(const GstVideoInfo* info, GstBuffer* buffer, GstMapFlags flags)
      : mapped_(gst_video_frame_map(&frame_, const_cast<GstVideoInfo*>(info), buffer, flags)) {}
  ~MappedVideoFrame() {
    if (mapped_) gst_video_frame_unmap(&frame_);
  }
  MappedVideoFrame(const MappedVideoFrame&) = delete;
  MappedVideoFrame& operator=(const MappedVideoFrame&) = delete;

  explicit operator bool() const { return mapped_; }

  const GstVideoFrame& frame() const { return frame_; }
  GstVideoFrame& frame() { return frame_; }

  // True where view() can show the frame: packed R, G, B of 3 or 4 bytes a pixel, planes of R, G, B
  // with one stride, and grey, whose samples are all three channels.
  bool has_view() const {
    const auto& info = frame_.info;
    if (GST_VIDEO_INFO_IS_GRAY(&info)) return true;
    return GST_VIDEO_INFO_IS_RGB(&info) &&
           GST_VIDEO_FRAME_COMP_STRIDE(&frame_, 1) == GST_VIDEO_FRAME_COMP_STRIDE(&frame_, 0) &&
           GST_VIDEO_FRAME_COMP_STRIDE(&frame_, 2) == GST_VIDEO_FRAME_COMP_STRIDE(&frame_, 0);
  }
  // The fourth byte of packed formats without alpha is no component of GStreamer's: it is where the
  // three others are not.
  template <typename Byte>
  BasicImageView<Byte> view() const {
    BasicImageView<Byte> view;
    int fourth = 0 + 1 + 2 + 3;
    for (int c = 0; c < 3; ++c) {
      const int component = std::min<int>(c, GST_VIDEO_FRAME_N_COMPONENTS(&frame_) - 1);
      view.channel[c] = static_cast<Byte*>(GST_VIDEO_FRAME_COMP_DATA(&frame_, component));
      fourth -= GST_VIDEO_FRAME_COMP_POFFSET(&frame_, component);
    }
    view.pixel_stride = GST_VIDEO_FRAME_COMP_PSTRIDE(&frame_, 0);
    view.row_stride = GST_VIDEO_FRAME_COMP_STRIDE(&frame_, 0);
    if (view.pixel_stride == 4) {
      view.alpha = static_cast<Byte*>(GST_VIDEO_FRAME_PLANE_DATA(&frame_, 0)) + fourth;
      view.alpha_is_padding = !GST_VIDEO_INFO_HAS_ALPHA(&frame_.info);
    }
    view.width = GST_VIDEO_FRAME_WIDTH(&frame_);
    view.height = GST_VIDEO_FRAME_HEIGHT(&frame_);
    return view;
  }

 private:
  GstVideoFrame frame_;
  bool mapped_;
};

}  // namespace qdmd
