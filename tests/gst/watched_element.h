// SPDX-License-Identifier: LGPL-2.1-or-later
// The qdmdbackground of a Stream: its properties, and what it posts.
#pragma once

#include <string>
#include <vector>

#include "tests/gst/element_test.h"

namespace qdmd::test {

// One of the action signals that take a file.
inline bool call(GstElement* element, const char* signal, const char* file) {
  gboolean done = FALSE;
  g_signal_emit_by_name(element, signal, file, &done);
  return done;
}

// With a bus of its own. Ends before the stream.
class Element {
 public:
  explicit Element(Stream& stream)
      : element_(gst_harness_find_element(stream.harness(), "qdmdbackground")),
        bus_(gst_bus_new()) {
    gst_element_set_bus(element_, bus_);
  }
  ~Element() {
    gst_element_set_bus(element_, nullptr);
    gst_object_unref(bus_);
    gst_object_unref(element_);
  }
  Element(const Element&) = delete;
  Element& operator=(const Element&) = delete;

  GstElement* get() const { return element_; }
  template <typename... Values>
  void set(const char* name, Values... values) {
    g_object_set(element_, name, values..., nullptr);
  }
  bool save(const std::string& file) { return call(element_, "save", file.c_str()); }
  bool load(const std::string& file) { return call(element_, "load", file.c_str()); }
  // The caller's, since the last call of this or of those that follow; other messages are dropped.
  // Those that the element is ready are counted, and not among them.
  std::vector<GstMessage*> messages(GstMessageType type = GST_MESSAGE_ELEMENT) {
    std::vector<GstMessage*> all;
    while (GstMessage* message = gst_bus_pop_filtered(bus_, type)) {
      const GstStructure* s = gst_message_get_structure(message);
      if (type != GST_MESSAGE_ELEMENT || !gst_structure_has_name(s, "qdmdbackground-ready")) {
        all.push_back(message);
        continue;
      }
      GstClockTime time = GST_CLOCK_TIME_NONE;
      gst_structure_get_uint64(s, "timestamp", &time);
      ready_.push_back(time);
      gst_message_unref(message);
    }
    return all;
  }
  // When messages() saw that the element was ready.
  const std::vector<GstClockTime>& ready() const { return ready_; }
  int latency_messages() {
    const auto all = messages(GST_MESSAGE_LATENCY);
    for (GstMessage* message : all) gst_message_unref(message);
    return static_cast<int>(all.size());
  }
  // The warnings' texts; empty where there was none.
  std::string warning() {
    std::string text;
    for (GstMessage* message : messages(GST_MESSAGE_WARNING)) {
      GError* error = nullptr;
      gst_message_parse_warning(message, &error, nullptr);
      text += error->message;
      g_error_free(error);
      gst_message_unref(message);
    }
    return text;
  }
  guint64 solves() const {
    GstStructure* stats = nullptr;
    g_object_get(element_, "stats", &stats, nullptr);
    guint64 solves = 0;
    gst_structure_get_uint64(stats, "solves", &solves);
    gst_structure_free(stats);
    return solves;
  }
  // The caller's; null where there is none.
  GstSample* background() const {
    GstSample* sample = nullptr;
    g_object_get(element_, "background", &sample, nullptr);
    return sample;
  }
  // The bytes of the background's picture; empty where there is none.
  std::vector<uint8_t> background_bytes() const {
    GstSample* sample = background();
    if (!sample) return {};
    GstMapInfo map;
    EXPECT_TRUE(gst_buffer_map(gst_sample_get_buffer(sample), &map, GST_MAP_READ));
    const std::vector<uint8_t> bytes(map.data, map.data + map.size);
    gst_buffer_unmap(gst_sample_get_buffer(sample), &map);
    gst_sample_unref(sample);
    return bytes;
  }

 private:
  GstElement* element_;
  GstBus* bus_;
  std::vector<GstClockTime> ready_;
};

}  // namespace qdmd::test
