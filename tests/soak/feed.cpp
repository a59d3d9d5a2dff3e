// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/soak/feed.h"

#include <cstdio>
#include <cstdlib>

namespace qdmd::soak {
namespace {

// Pixels whose alpha are the bytes of a frame's number.
constexpr int kDigits = 4;
constexpr uint64_t kSceneFrames = 1000;

int alpha_at(const GstVideoInfo& info) {
  return static_cast<int>(GST_VIDEO_INFO_COMP_OFFSET(&info, 3));
}

}  // namespace

void fail(const std::string& what) {
  std::fprintf(stderr, "soak: %s\n", what.c_str());
  std::exit(1);
}

Feed::Feed(const std::string& launch) : element_(gst_parse_launch(launch.c_str(), nullptr)) {
  if (!element_) fail("there is no " + launch);
  gst_object_ref_sink(element_);
  source_ = GST_PAD(gst_object_ref_sink(gst_pad_new("up", GST_PAD_SRC)));
  // Without a template it would take the caps that it has, and no others.
  GstCaps* any = gst_caps_new_any();
  GstPadTemplate* takes_any = gst_pad_template_new("down", GST_PAD_SINK, GST_PAD_ALWAYS, any);
  gst_caps_unref(any);
  sink_ = GST_PAD(gst_object_ref_sink(gst_pad_new_from_template(takes_any, "down")));
  gst_object_unref(takes_any);
  gst_pad_set_element_private(sink_, this);
  gst_pad_set_chain_function(sink_, take);
  gst_pad_set_event_function(sink_, hear);
  gst_pad_set_active(source_, TRUE);
  gst_pad_set_active(sink_, TRUE);
  from_ = gst_element_get_static_pad(element_, "src");
  requested_ = !from_;
  if (requested_) from_ = gst_element_request_pad_simple(element_, "background");
  GstPad* to = gst_element_get_static_pad(element_, "sink");
  if (gst_pad_link(source_, to) != GST_PAD_LINK_OK || gst_pad_link(from_, sink_) != GST_PAD_LINK_OK)
    fail("pads of " + launch + " do not link");
  gst_object_unref(to);
}

Feed::~Feed() {
  gst_element_set_state(element_, GST_STATE_NULL);
  gst_pad_set_active(source_, FALSE);
  gst_pad_set_active(sink_, FALSE);
  gst_pad_unlink(from_, sink_);
  if (requested_) gst_element_release_request_pad(element_, from_);
  gst_object_unref(from_);
  gst_object_unref(sink_);
  GstPad* to = gst_pad_get_peer(source_);
  gst_pad_unlink(source_, to);
  gst_object_unref(to);
  gst_object_unref(source_);
  if (GST_OBJECT_REFCOUNT_VALUE(element_) != 1) fail("somebody still holds the element");
  gst_object_unref(element_);
}

void Feed::begin(int width, int height, bool alpha_first) {
  gst_video_info_set_format(&info_, alpha_first ? GST_VIDEO_FORMAT_ARGB : GST_VIDEO_FORMAT_RGBA,
                            guint(width), guint(height));
  info_.fps_n = 25;
  info_.fps_d = 1;
  gst_pad_push_event(source_, gst_event_new_stream_start("soak"));
  GstCaps* caps = gst_video_info_to_caps(&info_);
  if (!gst_pad_push_event(source_, gst_event_new_caps(caps))) fail("caps were refused");
  gst_caps_unref(caps);
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  gst_pad_push_event(source_, gst_event_new_segment(&segment));
}

void Feed::push() {
  GstBuffer* buffer = gst_buffer_new_allocate(nullptr, info_.size, nullptr);
  GstMapInfo map;
  gst_buffer_map(buffer, &map, GST_MAP_WRITE);
  const uint64_t scene = in / kSceneFrames;
  const int alpha = alpha_at(info_), left = static_cast<int>(3 * in % 251);
  auto noise = static_cast<uint32_t>(in) * 2654435761u + 1;
  for (int y = 0; y < info_.height; ++y) {
    guint8* row = map.data + y * info_.stride[0];
    for (int x = 0; x < info_.width; ++x) {
      noise = noise * 1664525u + 1013904223u;
      const bool object = x >= left && x < left + 24 && y > 4 && y < info_.height / 2;
      for (int c = 0; c < 4; ++c)
        row[4 * x + c] = static_cast<guint8>(
            object ? 210 + (noise >> 30)
                   : 40 + static_cast<uint64_t>((5 + 2 * c) * x + 7 * y) * (1 + scene % 5) % 150 +
                         (noise >> 30));
      row[4 * x + alpha] = 255;
    }
  }
  for (int i = 0; i < kDigits; ++i) map.data[4 * i + alpha] = static_cast<guint8>(in >> (8 * i));
  gst_buffer_unmap(buffer, &map);
  GST_BUFFER_PTS(buffer) = in * (GST_SECOND / 25);
  GST_BUFFER_DURATION(buffer) = GST_SECOND / 25;
  sum_in += in++;
  const GstFlowReturn flow = gst_pad_push(source_, buffer);
  if (flow != GST_FLOW_OK) fail(std::string("a frame was refused: ") + gst_flow_get_name(flow));
}

void Feed::eos() { gst_pad_push_event(source_, gst_event_new_eos()); }

void Feed::set_state(GstState state) {
  if (gst_element_set_state(element_, state) == GST_STATE_CHANGE_FAILURE)
    fail("the state does not change");
}

void Feed::check() const {
  if (in != out || sum_in != sum_out)
    fail("frames in and out: " + std::to_string(in) + " and " + std::to_string(out) +
         ", sums of their numbers " + std::to_string(sum_in) + " and " + std::to_string(sum_out));
}

GstFlowReturn Feed::take(GstPad* pad, GstObject*, GstBuffer* buffer) {
  auto* self = static_cast<Feed*>(gst_pad_get_element_private(pad));
  GstVideoFrame frame;
  if (!gst_video_frame_map(&frame, &self->info_out_, buffer, GST_MAP_READ))
    fail("a buffer is no frame");
  const auto* row = static_cast<const guint8*>(GST_VIDEO_FRAME_PLANE_DATA(&frame, 0));
  uint64_t number = 0;
  for (int i = 0; i < kDigits; ++i)
    number |= uint64_t{row[4 * i + alpha_at(self->info_out_)]} << (8 * i);
  gst_video_frame_unmap(&frame);
  if (number != self->out)
    fail("frame " + std::to_string(self->out) + " was due, and " + std::to_string(number) +
         " came");
  if (GST_BUFFER_PTS(buffer) != number * (GST_SECOND / 25)) fail("a frame has another one's time");
  ++self->out;
  self->sum_out += number;
  gst_buffer_unref(buffer);
  return GST_FLOW_OK;
}

gboolean Feed::hear(GstPad* pad, GstObject*, GstEvent* event) {
  auto* self = static_cast<Feed*>(gst_pad_get_element_private(pad));
  if (GST_EVENT_TYPE(event) == GST_EVENT_CAPS) {
    GstCaps* caps = nullptr;
    gst_event_parse_caps(event, &caps);
    gst_video_info_from_caps(&self->info_out_, caps);
  }
  gst_event_unref(event);
  return TRUE;
}

}  // namespace qdmd::soak
