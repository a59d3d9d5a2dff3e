// SPDX-License-Identifier: LGPL-2.1-or-later
// Frames of every format as numbers: made, expanded, reduced, and sent through the element.
#pragma once

#include "tests/gst/element_test.h"

namespace qdmd::test {

inline constexpr int kFrames = 10;

// A component's samples at the size that the format gives it.
struct Component {
  int width = 0, height = 0;
  std::vector<uint16_t> samples;

  uint16_t at(int x, int y) const { return samples[static_cast<size_t>(y * width + x)]; }
};
using Frame = std::vector<Component>;

inline GstVideoInfo info_of(GstVideoFormat format, int width, int height,
                            GstVideoColorRange range = GST_VIDEO_COLOR_RANGE_16_235) {
  GstVideoInfo info;
  gst_video_info_set_format(&info, format, static_cast<guint>(width), static_cast<guint>(height));
  info.fps_n = 25, info.fps_d = 1;
  info.colorimetry.range = range;
  return info;
}

// GStreamer 1.22 says that V of P010 is in the middle of U.
inline int half_word(const GstVideoInfo& info, guint c) {
  const bool deep = GST_VIDEO_INFO_COMP_DEPTH(&info, c) > 8;
  return deep ? GST_VIDEO_INFO_COMP_POFFSET(&info, c) % 2 : 0;
}

// The number in memory at `at`, and that number written there, of component c.
inline uint16_t read_sample(const GstVideoInfo& info, guint c, const uint8_t* at) {
  if (GST_VIDEO_INFO_COMP_DEPTH(&info, c) == 8) return *at;
  const int word = at[0] | at[1] << 8;
  return static_cast<uint16_t>(word >> GST_VIDEO_FORMAT_INFO_SHIFT(info.finfo, c));
}
inline void write_sample(const GstVideoInfo& info, guint c, uint16_t sample, uint8_t* at) {
  const int word = sample << GST_VIDEO_FORMAT_INFO_SHIFT(info.finfo, c);
  at[0] = static_cast<uint8_t>(word & 255);
  if (GST_VIDEO_INFO_COMP_DEPTH(&info, c) > 8) at[1] = static_cast<uint8_t>(word >> 8);
}

// Calls see(component, x, y, where it is) for every sample.
template <typename See>
void each_sample(const GstVideoInfo& info, GstBuffer* buffer, GstMapFlags flags, See see) {
  GstVideoFrame frame;
  ASSERT_TRUE(gst_video_frame_map(&frame, const_cast<GstVideoInfo*>(&info), buffer, flags));
  for (guint c = 0; c < GST_VIDEO_FRAME_N_COMPONENTS(&frame); ++c)
    for (int y = 0; y < GST_VIDEO_FRAME_COMP_HEIGHT(&frame, c); ++y)
      for (int x = 0; x < GST_VIDEO_FRAME_COMP_WIDTH(&frame, c); ++x)
        see(c, x, y,
            static_cast<uint8_t*>(GST_VIDEO_FRAME_COMP_DATA(&frame, c)) + half_word(info, c) +
                y * GST_VIDEO_FRAME_COMP_STRIDE(&frame, c) +
                x * GST_VIDEO_FRAME_COMP_PSTRIDE(&frame, c));
  gst_video_frame_unmap(&frame);
}

// A textured ground, a square that moves across it, and noise.
inline Frame make_frame(const GstVideoInfo& info, int t) {
  Frame frame;
  for (guint c = 0; c < GST_VIDEO_INFO_N_COMPONENTS(&info); ++c) {
    Component of{GST_VIDEO_INFO_COMP_WIDTH(&info, c), GST_VIDEO_INFO_COMP_HEIGHT(&info, c), {}};
    const int columns = 1 << GST_VIDEO_FORMAT_INFO_W_SUB(info.finfo, c);
    const int rows = 1 << GST_VIDEO_FORMAT_INFO_H_SUB(info.finfo, c);
    const int low = GST_VIDEO_INFO_COMP_DEPTH(&info, c) - 8;
    for (int y = 0; y < of.height; ++y)
      for (int x = 0; x < of.width; ++x) {
        const int left = 5 * t % 40, px = x * columns, py = y * rows;
        const bool inside = px >= left && px < left + 9 && py >= 2 && py < 12;
        int sample = 60 + static_cast<int>(30 * c) + (7 * x + 3 * y) % 50;
        if (inside) sample = 230 - static_cast<int>(50 * c);
        if (c == 3) sample = 255 - (x + y) % 90;
        const int level = sample + (x * 31 + y * 17 + t * 13) % 3;
        // What 8 bits cannot tell.
        const int below = (x * 5 + y * 11 + t * 7) % (1 << low);
        of.samples.push_back(static_cast<uint16_t>(level << low | below));
      }
    frame.push_back(std::move(of));
  }
  return frame;
}

// Each sample for all pixels that share it.
inline Frame expand(const GstVideoInfo& info, const Frame& frame) {
  Frame all;
  for (guint c = 0; c < frame.size(); ++c) {
    Component of{GST_VIDEO_INFO_WIDTH(&info), GST_VIDEO_INFO_HEIGHT(&info), {}};
    for (int y = 0; y < of.height; ++y)
      for (int x = 0; x < of.width; ++x)
        of.samples.push_back(frame[c].at(x >> GST_VIDEO_FORMAT_INFO_W_SUB(info.finfo, c),
                                         y >> GST_VIDEO_FORMAT_INFO_H_SUB(info.finfo, c)));
    all.push_back(std::move(of));
  }
  return all;
}

// The mean of the pixels that share a sample, rounded.
inline Frame reduce(const GstVideoInfo& info, const Frame& frame) {
  Frame all;
  for (guint c = 0; c < frame.size(); ++c) {
    const int columns = 1 << GST_VIDEO_FORMAT_INFO_W_SUB(info.finfo, c);
    const int rows = 1 << GST_VIDEO_FORMAT_INFO_H_SUB(info.finfo, c);
    Component of{GST_VIDEO_INFO_COMP_WIDTH(&info, c), GST_VIDEO_INFO_COMP_HEIGHT(&info, c), {}};
    for (int top = 0; top < frame[c].height; top += rows)
      for (int left = 0; left < frame[c].width; left += columns) {
        int sum = 0, count = 0;
        for (int y = top; y < std::min(top + rows, frame[c].height); ++y)
          for (int x = left; x < std::min(left + columns, frame[c].width); ++x, ++count)
            sum += frame[c].at(x, y);
        of.samples.push_back(static_cast<uint16_t>((sum + count / 2) / count));
      }
    all.push_back(std::move(of));
  }
  return all;
}

// Strides with room behind rows, planes with room between them, and an offset.
inline BufferPtr padded_buffer(const GstVideoInfo& info) {
  gsize offset[GST_VIDEO_MAX_PLANES] = {}, size = 48;
  gint stride[GST_VIDEO_MAX_PLANES] = {};
  for (guint plane = 0; plane < GST_VIDEO_INFO_N_PLANES(&info); ++plane) {
    gint component[GST_VIDEO_MAX_COMPONENTS];
    gst_video_format_info_component(info.finfo, plane, component);
    offset[plane] = size;
    stride[plane] = GST_VIDEO_INFO_PLANE_STRIDE(&info, plane) + 24 + 16 * static_cast<gint>(plane);
    size += static_cast<gsize>(stride[plane]) *
                static_cast<gsize>(GST_VIDEO_INFO_COMP_HEIGHT(&info, component[0])) +
            33;
  }
  BufferPtr buffer(gst_buffer_new_allocate(nullptr, size, nullptr));
  gst_buffer_memset(buffer.get(), 0, 0xa5, size);
  gst_buffer_add_video_meta_full(buffer.get(), GST_VIDEO_FRAME_FLAG_NONE,
                                 GST_VIDEO_INFO_FORMAT(&info),
                                 static_cast<guint>(GST_VIDEO_INFO_WIDTH(&info)),
                                 static_cast<guint>(GST_VIDEO_INFO_HEIGHT(&info)),
                                 GST_VIDEO_INFO_N_PLANES(&info), offset, stride);
  return buffer;
}

inline std::vector<Frame> run(const std::string& properties, const GstVideoInfo& info,
                              const std::vector<Frame>& frames, bool padded = false) {
  GstHarness* harness = gst_harness_new_parse(("qdmdbackground " + properties).c_str());
  gst_harness_set_src_caps(harness, gst_video_info_to_caps(&info));
  for (size_t t = 0; t < frames.size(); ++t) {
    BufferPtr buffer = padded ? padded_buffer(info)
                              : BufferPtr(gst_buffer_new_allocate(nullptr, info.size, nullptr));
    if (!padded) gst_buffer_memset(buffer.get(), 0, 0x5a, info.size);
    GST_BUFFER_PTS(buffer.get()) = t * kFrame;
    GST_BUFFER_DURATION(buffer.get()) = kFrame;
    each_sample(info, buffer.get(), GST_MAP_WRITE, [&](guint c, int x, int y, uint8_t* sample) {
      write_sample(info, c, frames[t][c].at(x, y), sample);
    });
    EXPECT_EQ(GST_FLOW_OK, gst_harness_push(harness, buffer.release()));
  }
  EXPECT_TRUE(gst_harness_push_event(harness, gst_event_new_eos()));
  std::vector<Frame> out;
  while (GstBuffer* pulled = gst_harness_try_pull(harness)) {
    const BufferPtr buffer(pulled);
    Frame frame;
    for (guint c = 0; c < GST_VIDEO_INFO_N_COMPONENTS(&info); ++c)
      frame.push_back(
          {GST_VIDEO_INFO_COMP_WIDTH(&info, c), GST_VIDEO_INFO_COMP_HEIGHT(&info, c), {}});
    each_sample(info, buffer.get(), GST_MAP_READ, [&](guint c, int, int, const uint8_t* sample) {
      frame[c].samples.push_back(read_sample(info, c, sample));
    });
    out.push_back(std::move(frame));
  }
  gst_harness_teardown(harness);
  return out;
}

inline void expect_equal(const std::vector<Frame>& expected, const std::vector<Frame>& seen) {
  ASSERT_EQ(expected.size(), seen.size());
  for (size_t t = 0; t < seen.size(); ++t)
    for (size_t c = 0; c < seen[t].size(); ++c)
      ASSERT_EQ(expected[t][c].samples, seen[t][c].samples) << "frame " << t << " component " << c;
}

}  // namespace qdmd::test
