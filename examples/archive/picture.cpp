#include "examples/archive/picture.h"

#include <algorithm>
#include <memory>
#include <new>

namespace qdmd::archive {
namespace {

struct Unref {
  void operator()(GstBuffer* buffer) const { gst_buffer_unref(buffer); }
};

}  // namespace

Picture::Picture(const GstVideoInfo& like, int width, int height) {
  gst_video_info_set_format(&info_, GST_VIDEO_INFO_FORMAT(&like), static_cast<guint>(width),
                            static_cast<guint>(height));
  info_.colorimetry = like.colorimetry;
  // What is between rows is zero, and stays so.
  bytes_.resize(GST_VIDEO_INFO_SIZE(&info_));
  // The map keeps it.
  const std::unique_ptr<GstBuffer, Unref> buffer(
      gst_buffer_new_wrapped_full(static_cast<GstMemoryFlags>(0), bytes_.data(), bytes_.size(), 0,
                                  bytes_.size(), nullptr, nullptr));
  mapped_.emplace(&info_, buffer.get(), GST_MAP_WRITE);
  if (!*mapped_) throw std::bad_alloc();
}

size_t Picture::bytes_before(int plane, int end) const {
  // Components of a plane share rows alike.
  gint components[GST_VIDEO_MAX_COMPONENTS];
  gst_video_format_info_component(info_.finfo, static_cast<guint>(plane), components);
  const int rows = GST_VIDEO_FORMAT_INFO_SCALE_HEIGHT(info_.finfo, components[0], end);
  return static_cast<size_t>(rows) *
         static_cast<size_t>(GST_VIDEO_INFO_PLANE_STRIDE(&info_, plane));
}

std::span<uint8_t> Picture::rows(int plane, int first, int end) {
  const size_t begin = bytes_before(plane, first);
  return std::span(bytes_).subspan(GST_VIDEO_INFO_PLANE_OFFSET(&info_, plane) + begin,
                                   bytes_before(plane, end) - begin);
}

void Picture::copy(const uint8_t* mask) {
  const auto width = static_cast<size_t>(GST_VIDEO_INFO_WIDTH(&info_));
  for (int y = 0; y < GST_VIDEO_INFO_HEIGHT(&info_); ++y)
    std::copy_n(mask + static_cast<size_t>(y) * width, width, rows(0, y, y + 1).data());
}

GstVideoInfo mask_info(const GstVideoInfo& picture) {
  GstVideoInfo info;
  gst_video_info_set_format(&info, GST_VIDEO_FORMAT_GRAY8,
                            static_cast<guint>(GST_VIDEO_INFO_WIDTH(&picture)),
                            static_cast<guint>(GST_VIDEO_INFO_HEIGHT(&picture)));
  info.par_n = picture.par_n;
  info.par_d = picture.par_d;
  return info;
}

}  // namespace qdmd::archive
