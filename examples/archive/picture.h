// Pictures that several processes put together.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "gst/videoview.h"

namespace qdmd::archive {

// A picture in memory that lies as in GStreamer's buffers. Rows are those of pixels; where pixels
// share a sample, they begin and end with samples, or with the picture.
class Picture {
 public:
  // A picture in the format and colours of `like`.
  Picture(const GstVideoInfo& like, int width, int height);
  Picture(const Picture&) = delete;
  Picture& operator=(const Picture&) = delete;

  // The samples, to be written.
  MutableImageView view() { return mapped_->view<uint8_t>(); }
  int planes() const { return static_cast<int>(GST_VIDEO_INFO_N_PLANES(&info_)); }
  // Rows of one plane, with the bytes between them.
  std::span<uint8_t> rows(int plane, int first, int end);
  // Bytes of a plane that lie before row `end`.
  size_t bytes_before(int plane, int end) const;
  // All planes.
  std::span<const uint8_t> all() const { return bytes_; }
  // Copies a mask: its bytes, without gaps between rows.
  void copy(const uint8_t* mask);

 private:
  GstVideoInfo info_;
  std::vector<uint8_t> bytes_;
  std::optional<MappedVideoFrame> mapped_;
};

// What masks of such pictures are: a byte a pixel.
GstVideoInfo mask_info(const GstVideoInfo& picture);

}  // namespace qdmd::archive
