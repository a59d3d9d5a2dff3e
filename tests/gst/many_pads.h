// SPDX-License-Identifier: LGPL-2.1-or-later
// Feeds one element by hand, and listens to any of its source pads.
#pragma once

#include <gst/gst.h>
#include <gst/video/video.h>

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "tests/gst/element_test.h"

namespace qdmd::test {

// A buffer as it arrived.
struct Arrival {
  std::vector<uint8_t> bytes;  // samples of one component after the other, without padding
  GstClockTime timestamp, duration;
  guint64 offset;
  guint flags, regions;
  std::string caps;

  bool operator==(const Arrival&) const = default;
};

inline std::vector<uint8_t> samples_of(GstBuffer* buffer, const GstCaps* caps) {
  std::vector<uint8_t> samples;
  GstVideoInfo info;
  GstVideoFrame frame;
  EXPECT_TRUE(gst_video_info_from_caps(&info, caps));
  EXPECT_TRUE(gst_video_frame_map(&frame, &info, buffer, GST_MAP_READ));
  for (guint c = 0; c < GST_VIDEO_FRAME_N_COMPONENTS(&frame); ++c)
    for (int y = 0; y < GST_VIDEO_FRAME_COMP_HEIGHT(&frame, c); ++y)
      for (int x = 0; x < GST_VIDEO_FRAME_COMP_WIDTH(&frame, c); ++x)
        for (int byte = 0; byte < (GST_VIDEO_FRAME_COMP_DEPTH(&frame, c) > 8 ? 2 : 1); ++byte)
          samples.push_back(static_cast<const uint8_t*>(GST_VIDEO_FRAME_COMP_DATA(
              &frame, c))[y * GST_VIDEO_FRAME_COMP_STRIDE(&frame, c) +
                          x * GST_VIDEO_FRAME_COMP_PSTRIDE(&frame, c) + byte]);
  gst_video_frame_unmap(&frame);
  return samples;
}

// The sink behind a source pad. It answers with the flow that is set, and keeps what came.
class Listener {
 public:
  Listener(GstPad* source, const char* caps_text) : source_(source) {
    GstCaps* caps = gst_caps_from_string(caps_text ? caps_text : "video/x-raw");
    GstPadTemplate* its = gst_pad_template_new("sink", GST_PAD_SINK, GST_PAD_ALWAYS, caps);
    gst_caps_unref(caps);
    pad_ = GST_PAD(gst_object_ref_sink(gst_pad_new_from_template(its, "sink")));
    gst_object_unref(its);
    gst_pad_set_element_private(pad_, this);
    gst_pad_set_chain_function(pad_, chain);
    gst_pad_set_event_function(pad_, event);
    gst_pad_set_active(pad_, TRUE);
    EXPECT_EQ(GST_PAD_LINK_OK, gst_pad_link(source_, pad_));
  }
  ~Listener() {
    gst_pad_unlink(source_, pad_);
    gst_pad_set_active(pad_, FALSE);
    gst_object_unref(pad_);
    gst_object_unref(source_);
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  GstPad* source() const { return source_; }
  GstPad* pad() const { return pad_; }
  void answer(GstFlowReturn flow) { flow_ = flow; }
  // Since the last call.
  std::vector<Arrival> take() {
    const std::lock_guard lock(lock_);
    return std::exchange(arrivals_, {});
  }
  std::vector<GstEventType> take_events() {
    const std::lock_guard lock(lock_);
    return std::exchange(events_, {});
  }
  // The id of the pad's stream.
  std::string stream_id() const {
    gchar* id = gst_pad_get_stream_id(pad_);
    std::string text = id ? id : "";
    g_free(id);
    return text;
  }

 private:
  static GstFlowReturn chain(GstPad* pad, GstObject*, GstBuffer* buffer) {
    auto* self = static_cast<Listener*>(gst_pad_get_element_private(pad));
    const BufferPtr owned(buffer);
    Arrival arrival = {{},
                       GST_BUFFER_PTS(buffer),
                       GST_BUFFER_DURATION(buffer),
                       GST_BUFFER_OFFSET(buffer),
                       GST_BUFFER_FLAGS(buffer) & ~guint(GST_BUFFER_FLAG_TAG_MEMORY),
                       gst_buffer_get_n_meta(buffer, GST_VIDEO_REGION_OF_INTEREST_META_API_TYPE),
                       {}};
    GstCaps* caps = gst_pad_get_current_caps(pad);
    EXPECT_TRUE(caps) << "a buffer before its caps";
    EXPECT_EQ(GST_FORMAT_TIME, self->segment_format_) << "a buffer before its segment";
    if (caps) {
      gchar* text = gst_caps_to_string(caps);
      arrival.caps = text;
      arrival.bytes = samples_of(buffer, caps);
      g_free(text);
      gst_caps_unref(caps);
    }
    const std::lock_guard lock(self->lock_);
    self->arrivals_.push_back(std::move(arrival));
    return self->flow_;
  }
  static gboolean event(GstPad* pad, GstObject*, GstEvent* event) {
    auto* self = static_cast<Listener*>(gst_pad_get_element_private(pad));
    if (GST_EVENT_TYPE(event) == GST_EVENT_SEGMENT) {
      const GstSegment* segment = nullptr;
      gst_event_parse_segment(event, &segment);
      self->segment_format_ = segment->format;
    }
    if (GST_EVENT_TYPE(event) == GST_EVENT_FLUSH_STOP) self->segment_format_ = GST_FORMAT_UNDEFINED;
    {
      const std::lock_guard lock(self->lock_);
      self->events_.push_back(GST_EVENT_TYPE(event));
    }
    gst_event_unref(event);
    return TRUE;
  }

  GstPad* source_;
  GstPad* pad_;
  GstFormat segment_format_ = GST_FORMAT_UNDEFINED;
  std::atomic<GstFlowReturn> flow_ = GST_FLOW_OK;
  std::mutex lock_;
  std::vector<Arrival> arrivals_;
  std::vector<GstEventType> events_;
};

class Rig {
 public:
  // An element with its properties, in PLAYING.
  explicit Rig(const std::string& launch, bool play = true) {
    element_ = gst_parse_launch(launch.c_str(), nullptr);
    gst_object_ref_sink(element_);
    gst_element_set_bus(element_, bus_);
    feed_ = GST_PAD(gst_object_ref_sink(gst_pad_new("feed", GST_PAD_SRC)));
    gst_pad_set_active(feed_, TRUE);
    GstPad* sink = gst_element_get_static_pad(element_, "sink");
    EXPECT_EQ(GST_PAD_LINK_OK, gst_pad_link(feed_, sink));
    gst_object_unref(sink);
    if (play) set_state(GST_STATE_PLAYING);
  }
  ~Rig() {
    set_state(GST_STATE_NULL);
    // Pads that were requested go with the element.
    listeners_.clear();
    gst_pad_set_active(feed_, FALSE);
    gst_object_unref(feed_);
    gst_element_set_bus(element_, nullptr);
    gst_object_unref(bus_);
    gst_object_unref(element_);
  }
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  GstElement* element() const { return element_; }
  GstBus* bus() const { return bus_; }
  GstPad* feed() const { return feed_; }
  void set_state(GstState state) {
    EXPECT_NE(GST_STATE_CHANGE_FAILURE, gst_element_set_state(element_, state));
  }

  // Requests the pad, or takes the one that is always there, and links it.
  Listener& listen(const std::string& name, const char* caps = nullptr) {
    GstPad* pad = gst_element_get_static_pad(element_, name.c_str());
    if (!pad) pad = gst_element_request_pad_simple(element_, name.c_str());
    EXPECT_TRUE(pad) << name;
    // The one before lets go of the pad.
    listeners_.erase(name);
    return *(listeners_[name] = std::make_unique<Listener>(pad, caps));
  }
  Listener& at(const std::string& name) { return *listeners_.at(name); }
  bool has(const std::string& name) const { return listeners_.count(name) > 0; }
  void release(const std::string& name) {
    GstPad* pad = GST_PAD(gst_object_ref(at(name).source()));
    gst_element_release_request_pad(element_, pad);
    listeners_.erase(name);
    gst_object_unref(pad);
  }

  void start(GstVideoFormat format, int width, int height) {
    send(gst_event_new_stream_start("rig"));
    set_caps(format, width, height);
    segment();
  }
  void set_caps(GstVideoFormat format, int width, int height, int rate = 25) {
    gst_video_info_set_format(&info_, format, static_cast<guint>(width),
                              static_cast<guint>(height));
    info_.fps_n = rate;
    info_.fps_d = 1;
    GstCaps* caps = gst_video_info_to_caps(&info_);
    // Refused or not: the pad keeps them.
    send(gst_event_new_caps(caps));
    gst_caps_unref(caps);
  }
  void segment() {
    GstSegment segment;
    gst_segment_init(&segment, GST_FORMAT_TIME);
    send(gst_event_new_segment(&segment));
  }
  bool send(GstEvent* event) { return gst_pad_push_event(feed_, event); }
  void flush() {
    send(gst_event_new_flush_start());
    send(gst_event_new_flush_stop(TRUE));
    segment();
  }
  GstFlowReturn push(int t, guint flags = 0) {
    GstBuffer* buffer = make_bytes(info_, t).release();
    GST_BUFFER_PTS(buffer) = static_cast<GstClockTime>(t) * kFrame;
    GST_BUFFER_DURATION(buffer) = kFrame;
    GST_BUFFER_OFFSET(buffer) = static_cast<guint64>(t);
    GST_BUFFER_FLAG_SET(buffer, flags);
    return gst_pad_push(feed_, buffer);
  }
  const GstVideoInfo& info() const { return info_; }

 private:
  GstElement* element_;
  GstBus* bus_ = gst_bus_new();
  GstPad* feed_;
  GstVideoInfo info_;
  std::map<std::string, std::unique_ptr<Listener>> listeners_;
};

}  // namespace qdmd::test
