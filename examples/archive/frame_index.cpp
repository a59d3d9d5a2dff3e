// SPDX-License-Identifier: LGPL-2.1-or-later
#include "examples/archive/frame_index.h"

#include <algorithm>
#include <atomic>

#include "examples/archive/gst_pointers.h"

namespace qdmd::archive {
namespace {

// What a demuxer's threads find of the first video stream.
struct Packets {
  GstElement* pipeline = nullptr;
  std::atomic<bool> linked{false}, exact_container{false};
  bool exact = true;
  std::vector<GstClockTime> times;
  GstSegment segment;

  static GstPadProbeReturn on_data(GstPad*, GstPadProbeInfo* info, gpointer data) {
    auto* const packets = static_cast<Packets*>(data);
    if (GST_PAD_PROBE_INFO_TYPE(info) & GST_PAD_PROBE_TYPE_BUFFER) {
      const GstBuffer* const buffer = GST_PAD_PROBE_INFO_BUFFER(info);
      GstClockTime time = GST_BUFFER_PTS(buffer);
      packets->exact &= GST_CLOCK_TIME_IS_VALID(time) != FALSE;
      if (!GST_CLOCK_TIME_IS_VALID(time)) time = GST_BUFFER_DTS(buffer);
      const GstClockTime shown =
          GST_CLOCK_TIME_IS_VALID(time)
              ? gst_segment_to_stream_time(&packets->segment, GST_FORMAT_TIME, time)
              : packets->times.size();
      // What lies outside of a file's own cut is never shown.
      if (GST_CLOCK_TIME_IS_VALID(shown)) packets->times.push_back(shown);
    } else if (GST_EVENT_TYPE(GST_PAD_PROBE_INFO_EVENT(info)) == GST_EVENT_SEGMENT) {
      gst_event_copy_segment(GST_PAD_PROBE_INFO_EVENT(info), &packets->segment);
    }
    return GST_PAD_PROBE_OK;
  }

  static void on_pad(GstElement*, GstPad* pad, gpointer data) {
    auto* const packets = static_cast<Packets*>(data);
    GstElement* const sink = gst_element_factory_make("fakesink", nullptr);
    g_object_set(sink, "async", FALSE, nullptr);
    gst_bin_add(GST_BIN(packets->pipeline), sink);
    GstPad* const end = gst_element_get_static_pad(sink, "sink");
    const CapsPtr caps(gst_pad_query_caps(pad, nullptr));
    const gchar* const kind = gst_structure_get_name(gst_caps_get_structure(caps.get(), 0));
    const bool is_video = g_str_has_prefix(kind, "video/") || g_str_has_prefix(kind, "image/");
    if (is_video && !packets->linked.exchange(true))
      gst_pad_add_probe(
          end, GstPadProbeType(GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM),
          on_data, packets, nullptr);
    gst_pad_link(pad, end);
    gst_object_unref(end);
    gst_element_sync_state_with_parent(sink);
  }

  // Those whose packets have the times at which frames are shown, whatever part is read.
  static void on_element(GstBin*, GstBin*, GstElement* element, gpointer data) {
    const GstElementFactory* const factory = gst_element_get_factory(element);
    const gchar* const name = factory ? GST_OBJECT_NAME(factory) : "";
    if (g_str_equal(name, "matroskademux") || g_str_equal(name, "qtdemux"))
      static_cast<Packets*>(data)->exact_container = true;
  }
};

bool is_seekable(const PipelinePtr& pipeline) {
  GstQuery* const query = gst_query_new_seeking(GST_FORMAT_TIME);
  gboolean seekable = FALSE;
  if (gst_element_query(pipeline.get(), query))
    gst_query_parse_seeking(query, nullptr, &seekable, nullptr, nullptr);
  gst_query_unref(query);
  return seekable != FALSE;
}

std::string early_end_of(const std::string& file, const PipelinePtr& pipeline, GstClockTime seen) {
  // Containers round, and count sound.
  constexpr GstClockTime kLeast = GST_SECOND;
  gint64 duration = 0;
  if (!gst_element_query_duration(pipeline.get(), GST_FORMAT_TIME, &duration) || duration <= 0)
    return "";
  const auto length = static_cast<GstClockTime>(duration);
  if (seen + std::max(kLeast, length / 50) >= length) return "";
  return file + " ends after " + std::to_string(seen / GST_SECOND) + " s of " +
         std::to_string(length / GST_SECOND) + " s: is it cut off?";
}

}  // namespace

FrameIndex index_of(const std::string& file, GstClockTime length) try {
  Packets packets;
  gst_segment_init(&packets.segment, GST_FORMAT_TIME);
  const PipelinePtr pipeline = make_pipeline("filesrc name=source ! parsebin name=parse");
  packets.pipeline = pipeline.get();
  g_object_set(element_of(pipeline, "source").get(), "location", file.c_str(), nullptr);
  const ElementPtr parse = element_of(pipeline, "parse");
  g_signal_connect(parse.get(), "pad-added", G_CALLBACK(Packets::on_pad), &packets);
  g_signal_connect(parse.get(), "deep-element-added", G_CALLBACK(Packets::on_element), &packets);
  gst_element_set_state(pipeline.get(), GST_STATE_PLAYING);
  while (!has_ended(pipeline, GST_SECOND, file)) {
  }
  FrameIndex index;
  index.times = std::move(packets.times);
  if (index.times.empty()) return index;
  std::sort(index.times.begin(), index.times.end());
  const bool twice =
      std::adjacent_find(index.times.begin(), index.times.end()) != index.times.end();
  index.exact = packets.exact && packets.exact_container && !twice && is_seekable(pipeline);
  index.early_end = early_end_of(file, pipeline, index.times.back() + length);
  return index;
} catch (const std::runtime_error&) {
  return {};
}

}  // namespace qdmd::archive
