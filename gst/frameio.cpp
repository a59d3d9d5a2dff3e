#include "gst/frameio.h"

#include <algorithm>

namespace qdmd {
namespace {

constexpr uint8_t kBlack = 16, kWhite = 235, kNeutral = 128;

// Pixels that share a sample of component `c`, along x and y.
int columns_of(const GstVideoFrame& frame, int c) {
  return 1 << GST_VIDEO_FORMAT_INFO_W_SUB(frame.info.finfo, c);
}
int rows_of(const GstVideoFrame& frame, int c) {
  return 1 << GST_VIDEO_FORMAT_INFO_H_SUB(frame.info.finfo, c);
}

}  // namespace

guint64 FrameIo::bytes(const GstVideoInfo& info) {
  // Planes of R, G and B can be read in place where their strides are equal, as they mostly are.
  if (!GST_VIDEO_INFO_IS_YUV(&info)) return 0;
  return 3 * guint64(GST_VIDEO_INFO_WIDTH(&info)) * guint64(GST_VIDEO_INFO_HEIGHT(&info));
}

MutableImageView FrameIo::planes(const GstVideoFrame& frame) {
  MutableImageView view;
  view.width = GST_VIDEO_FRAME_WIDTH(&frame);
  view.height = GST_VIDEO_FRAME_HEIGHT(&frame);
  view.pixel_stride = 1;
  view.row_stride = view.width;
  const size_t pixels = static_cast<size_t>(view.width) * static_cast<size_t>(view.height);
  samples_.resize(3 * pixels);
  for (size_t c = 0; c < 3; ++c) view.channel[c] = samples_.data() + c * pixels;
  return view;
}

ImageView FrameIo::read(const MappedVideoFrame& mapped) {
  if (mapped.has_view()) return mapped.view<const uint8_t>();
  const GstVideoFrame& frame = mapped.frame();
  const MutableImageView own = planes(frame);
  ImageView view;
  view.width = own.width;
  view.height = own.height;
  view.pixel_stride = own.pixel_stride;
  view.row_stride = own.row_stride;
  for (int c = 0; c < 3; ++c) {
    view.channel[c] = own.channel[c];
    const auto* from = static_cast<const uint8_t*>(GST_VIDEO_FRAME_COMP_DATA(&frame, c));
    const ptrdiff_t stride = GST_VIDEO_FRAME_COMP_STRIDE(&frame, c);
    const int step = GST_VIDEO_FRAME_COMP_PSTRIDE(&frame, c);
    const int columns = columns_of(frame, c), rows = rows_of(frame, c);
    for (int y = 0; y < view.height; ++y) {
      const uint8_t* row = from + y / rows * stride;
      uint8_t* to = own.channel[c] + y * own.row_stride;
      for (int x = 0; x < view.width; ++x) to[x] = row[x / columns * step];
    }
  }
  return view;
}

void FrameIo::put(GstVideoFrame* frame, Output output) const {
  const int width = GST_VIDEO_FRAME_WIDTH(frame), height = GST_VIDEO_FRAME_HEIGHT(frame);
  const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  const uint8_t* const plane[3] = {samples_.data(), samples_.data() + pixels,
                                   samples_.data() + 2 * pixels};
  const bool video = GST_VIDEO_INFO_IS_YUV(&frame->info);
  // What a pixel is in component c.
  const auto shown = [&](int c, size_t p) -> int {
    const int sample = plane[c][p];
    if (!video) return sample;
    switch (output) {
      case Output::background:
        return sample;
      case Output::foreground:
        return c == 0 ? std::min(kBlack + sample, int{kWhite}) : kNeutral;
      case Output::mask:
        return c > 0 ? kNeutral : kBlack + ((kWhite - kBlack) * sample + 127) / 255;
      case Output::cutout:
        break;
    }
    // Outside of the mask the core writes zeros, which no luma of video is.
    const bool outside = plane[0][p] == 0 && plane[1][p] == 0 && plane[2][p] == 0;
    return !outside ? sample : c == 0 ? kBlack : kNeutral;
  };
  for (int c = 0; c < 3; ++c) {
    auto* to = static_cast<uint8_t*>(GST_VIDEO_FRAME_COMP_DATA(frame, c));
    const ptrdiff_t stride = GST_VIDEO_FRAME_COMP_STRIDE(frame, c);
    const int step = GST_VIDEO_FRAME_COMP_PSTRIDE(frame, c);
    const int columns = columns_of(*frame, c), rows = rows_of(*frame, c);
    for (int top = 0; top < height; top += rows)
      for (int left = 0; left < width; left += columns) {
        const int right = std::min(width, left + columns), bottom = std::min(height, top + rows);
        int sum = 0;
        for (int y = top; y < bottom; ++y)
          for (int x = left; x < right; ++x)
            sum += shown(
                c, static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x));
        const int count = (right - left) * (bottom - top);
        to[top / rows * stride + left / columns * step] =
            static_cast<uint8_t>((sum + count / 2) / count);
      }
  }
}

}  // namespace qdmd
