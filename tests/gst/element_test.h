// SPDX-License-Identifier: LGPL-2.1-or-later
// Pushes frames through one qdmdbackground in a GstHarness.
#pragma once

#include <gst/check/gstharness.h>
#include <gst/video/video.h>
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace qdmd::test {

struct UnrefBuffer {
  void operator()(GstBuffer* buffer) const { gst_buffer_unref(buffer); }
};
using BufferPtr = std::unique_ptr<GstBuffer, UnrefBuffer>;

constexpr GstClockTime kFrame = GST_SECOND / 25;

// Fills the pixel at (x, y) of frame t: R, G, B.
using Painter = std::function<void(int t, int x, int y, uint8_t rgb[3])>;

// A textured still picture with a bright square that moves across it.
inline void paint_mover(int t, int x, int y, uint8_t rgb[3]) {
  rgb[0] = static_cast<uint8_t>(60 + (7 * x + 3 * y) % 80);
  rgb[1] = static_cast<uint8_t>(50 + (5 * x + 11 * y) % 90);
  rgb[2] = static_cast<uint8_t>(70 + (13 * x + y) % 70);
  const int left = (3 * t) % 32;
  if (x >= left && x < left + 4 && y >= 4 && y < 9) rgb[0] = 250, rgb[1] = 20, rgb[2] = 240;
}
inline void paint_still(int, int x, int y, uint8_t rgb[3]) { paint_mover(-1000, x, y, rgb); }

// A frame of any format: bytes of a still picture, and some that move through it.
inline BufferPtr make_bytes(const GstVideoInfo& info, int t) {
  const auto size = static_cast<int>(GST_VIDEO_INFO_SIZE(&info));
  std::vector<uint8_t> bytes;
  for (int i = 0; i < size; ++i) bytes.push_back(static_cast<uint8_t>(60 + 7 * i % 83));
  const int length = size / 12;
  for (int i = 0; i < length; ++i)
    bytes[static_cast<size_t>((size / 8 * t + i) % size)] = static_cast<uint8_t>(200 + i % 40);
  return BufferPtr(gst_buffer_new_memdup(bytes.data(), bytes.size()));
}

class Stream {
 public:
  // launch: element with its properties; format, size and rate of what is pushed.
  Stream(const std::string& launch, GstVideoFormat format, int width, int height, int fps_n = 25,
         int fps_d = 1)
      : harness_(gst_harness_new_parse(launch.c_str())) {
    set_caps(format, width, height, fps_n, fps_d);
  }
  ~Stream() { gst_harness_teardown(harness_); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  GstHarness* harness() { return harness_; }
  const GstVideoInfo& info() const { return info_; }

  void set_caps(GstVideoFormat format, int width, int height, int fps_n = 25, int fps_d = 1) {
    gst_video_info_set_format(&info_, format, static_cast<guint>(width),
                              static_cast<guint>(height));
    info_.fps_n = fps_n;
    info_.fps_d = fps_d;
    gst_harness_set_src_caps(harness_, gst_video_info_to_caps(&info_));
  }

  BufferPtr make_frame(int t, const Painter& paint) const {
    BufferPtr buffer(gst_buffer_new_allocate(nullptr, info_.size, nullptr));
    stamp(buffer.get(), t);
    fill(buffer.get(), t, paint);
    return buffer;
  }
  void stamp(GstBuffer* buffer, int t) const {
    GST_BUFFER_PTS(buffer) = static_cast<GstClockTime>(t) * kFrame;
    GST_BUFFER_DURATION(buffer) = kFrame;
    GST_BUFFER_OFFSET(buffer) = static_cast<guint64>(t);
  }
  void fill(GstBuffer* buffer, int t, const Painter& paint) const {
    GstVideoFrame frame;
    ASSERT_TRUE(
        gst_video_frame_map(&frame, const_cast<GstVideoInfo*>(&info_), buffer, GST_MAP_WRITE));
    for (int y = 0; y < info_.height; ++y)
      for (int x = 0; x < info_.width; ++x) {
        uint8_t rgb[3];
        paint(t, x, y, rgb);
        for (int c = 0; c < 3; ++c) *sample(frame, c, x, y) = rgb[c];
        if (GST_VIDEO_INFO_HAS_ALPHA(&info_)) *sample(frame, 3, x, y) = alpha_at(x);
      }
    gst_video_frame_unmap(&frame);
  }
  static uint8_t alpha_at(int x) { return static_cast<uint8_t>(255 - x % 200); }

  GstFlowReturn push(int t, const Painter& paint = paint_mover) {
    return gst_harness_push(harness_, make_frame(t, paint).release());
  }
  void push_many(int first, int count, const Painter& paint = paint_mover) {
    for (int t = first; t < first + count; ++t) ASSERT_EQ(GST_FLOW_OK, push(t, paint));
  }
  bool eos() { return gst_harness_push_event(harness_, gst_event_new_eos()); }
  std::vector<BufferPtr> take_all() {
    std::vector<BufferPtr> out;
    while (GstBuffer* buffer = gst_harness_try_pull(harness_)) out.emplace_back(buffer);
    return out;
  }

  // What came out and was not taken, and all that waits.
  // Nothing may be pushed after it.
  std::vector<BufferPtr> take_to_end() {
    EXPECT_TRUE(eos());
    return take_all();
  }

  // Calls see(x, y, rgb, alpha) for every pixel of an output buffer.
  void each_pixel(GstBuffer* buffer,
                  const std::function<void(int, int, const uint8_t*, int)>& see) const {
    GstVideoFrame frame;
    ASSERT_TRUE(
        gst_video_frame_map(&frame, const_cast<GstVideoInfo*>(&info_), buffer, GST_MAP_READ));
    for (int y = 0; y < info_.height; ++y)
      for (int x = 0; x < info_.width; ++x) {
        const uint8_t rgb[3] = {*sample(frame, 0, x, y), *sample(frame, 1, x, y),
                                *sample(frame, 2, x, y)};
        see(x, y, rgb, GST_VIDEO_INFO_HAS_ALPHA(&info_) ? *sample(frame, 3, x, y) : -1);
      }
    gst_video_frame_unmap(&frame);
  }

 private:
  static uint8_t* sample(const GstVideoFrame& frame, int c, int x, int y) {
    return static_cast<uint8_t*>(GST_VIDEO_FRAME_COMP_DATA(&frame, c)) +
           y * GST_VIDEO_FRAME_COMP_STRIDE(&frame, c) + x * GST_VIDEO_FRAME_COMP_PSTRIDE(&frame, c);
  }
  GstHarness* harness_;
  GstVideoInfo info_;
};

// What the next such message says; "" where there is none.
inline std::string next_text(GstBus* bus, GstMessageType type) {
  GstMessage* message = gst_bus_pop_filtered(bus, type);
  if (!message) return "";
  GError* error = nullptr;
  if (type == GST_MESSAGE_ERROR)
    gst_message_parse_error(message, &error, nullptr);
  else
    gst_message_parse_warning(message, &error, nullptr);
  const std::string text = error->message;
  g_error_free(error);
  gst_message_unref(message);
  return text;
}

}  // namespace qdmd::test
