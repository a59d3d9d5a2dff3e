// SPDX-License-Identifier: LGPL-2.1-or-later
#include "examples/archive/video_writer.h"

#include <gst/app/gstappsink.h>
#include <gst/app/gstappsrc.h>

namespace qdmd::archive {
namespace {

constexpr const char* kSource = "appsrc name=source format=time max-bytes=0 max-buffers=0 ! ";
// Frames that wait to be encoded before the writer does.
constexpr guint64 kMostWaiting = 4;

void finish(const PipelinePtr& pipeline, const std::string& what) {
  while (!has_ended(pipeline, GST_SECOND, what)) {
  }
  gst_element_set_state(pipeline.get(), GST_STATE_NULL);
}

void play(const PipelinePtr& pipeline, const std::string& what) {
  if (gst_element_set_state(pipeline.get(), GST_STATE_PLAYING) != GST_STATE_CHANGE_FAILURE) return;
  has_ended(pipeline, GST_SECOND, what);
  throw std::runtime_error(what);
}

void push(const PipelinePtr& pipeline, const ElementPtr& source, GstBuffer* buffer,
          const std::string& what) {
  // An appsrc that waits by itself does not see that the pipeline has failed.
  while (gst_app_src_get_current_level_buffers(GST_APP_SRC(source.get())) >= kMostWaiting)
    has_ended(pipeline, 2 * GST_MSECOND, what);
  if (gst_app_src_push_buffer(GST_APP_SRC(source.get()), buffer) == GST_FLOW_OK) return;
  has_ended(pipeline, GST_SECOND, what);
  throw std::runtime_error(what);
}

bool encodes(const char* encoder, GstVideoFormat format) {
  const ElementPtr element(gst_element_factory_make(encoder, nullptr));
  if (!element) return false;
  GstPad* const pad = gst_element_get_static_pad(element.get(), "sink");
  const CapsPtr all(gst_pad_get_pad_template_caps(pad));
  gst_object_unref(pad);
  const CapsPtr one(gst_caps_new_simple("video/x-raw", "format", G_TYPE_STRING,
                                        gst_video_format_to_string(format), nullptr));
  return gst_caps_can_intersect(all.get(), one.get()) != FALSE;
}

// In what frames are encoded so that as little as can be is lost: nothing, but of more than 12
// bits.
GstVideoFormat lossless_format(const GstVideoInfo& info) {
  const GstVideoFormat format = GST_VIDEO_INFO_FORMAT(&info);
  const bool alpha = GST_VIDEO_INFO_HAS_ALPHA(&info);
  const int depth = GST_VIDEO_INFO_COMP_DEPTH(&info, 0);
  if (GST_VIDEO_INFO_IS_RGB(&info)) {
    if (depth > 8) return alpha ? GST_VIDEO_FORMAT_GBRA_12LE : GST_VIDEO_FORMAT_GBR_12LE;
    return alpha ? GST_VIDEO_FORMAT_BGRA : GST_VIDEO_FORMAT_BGRx;
  }
  if (encodes("avenc_ffv1", format)) return format;
  const bool columns = GST_VIDEO_FORMAT_INFO_W_SUB(info.finfo, 1) == 1,
             rows = GST_VIDEO_FORMAT_INFO_H_SUB(info.finfo, 1) == 1;
  if (depth > 10)
    return rows      ? GST_VIDEO_FORMAT_I420_12LE
           : columns ? GST_VIDEO_FORMAT_I422_12LE
                     : GST_VIDEO_FORMAT_Y444_12LE;
  if (depth > 8)
    return rows      ? GST_VIDEO_FORMAT_I420_10LE
           : columns ? GST_VIDEO_FORMAT_I422_10LE
                     : GST_VIDEO_FORMAT_Y444_10LE;
  return rows ? GST_VIDEO_FORMAT_I420 : columns ? GST_VIDEO_FORMAT_Y42B : GST_VIDEO_FORMAT_Y444;
}

}  // namespace

// Slices would be threads' work: a process has one core.
const char* const kLossless = "avenc_ffv1 ! matroskamux";

std::string encoding(const std::string& encoder, const GstVideoInfo& info) {
  std::string elements = "videoconvert ! ";
  // What others like best, they know.
  if (encoder == kLossless)
    elements += std::string("video/x-raw,format=") +
                gst_video_format_to_string(lossless_format(info)) + " ! ";
  return elements + encoder;
}

void write_png(const std::string& path, const GstVideoInfo& info, GstBuffer* picture) {
  const std::string what = path + " cannot be written";
  // Files are 4 % larger than with the encoder's own level, in two thirds of its time.
  const PipelinePtr pipeline =
      make_pipeline(std::string(kSource) + "videoconvert ! video/x-raw,format=" +
                    (GST_VIDEO_INFO_IS_GRAY(&info) ? "GRAY8" : "RGB") +
                    " ! pngenc snapshot=true compression-level=2 ! filesink name=sink async=false");
  const ElementPtr source = element_of(pipeline, "source");
  g_object_set(element_of(pipeline, "sink").get(), "location", path.c_str(), nullptr);
  const CapsPtr caps(gst_video_info_to_caps(&info));
  gst_app_src_set_caps(GST_APP_SRC(source.get()), caps.get());
  play(pipeline, what);
  gst_app_src_push_buffer(GST_APP_SRC(source.get()), gst_buffer_ref(picture));
  gst_app_src_end_of_stream(GST_APP_SRC(source.get()));
  finish(pipeline, what);
}

void join_videos(const std::vector<std::string>& parts, const std::string& path) {
  const std::string what = path + " cannot be written";
  const PipelinePtr joined =
      make_pipeline(std::string(kSource) + "matroskamux ! filesink name=sink async=false");
  const ElementPtr source = element_of(joined, "source");
  g_object_set(element_of(joined, "sink").get(), "location", path.c_str(), nullptr);
  bool playing = false;
  for (const std::string& part : parts) {
    const std::string broken = part + " cannot be read";
    const PipelinePtr reader = make_pipeline(
        "filesrc name=file ! matroskademux ! appsink name=sink sync=false "
        "max-buffers=4");
    g_object_set(element_of(reader, "file").get(), "location", part.c_str(), nullptr);
    play(reader, broken);
    const ElementPtr sink = element_of(reader, "sink");
    for (;;) {
      const SamplePtr sample(
          gst_app_sink_try_pull_sample(GST_APP_SINK(sink.get()), 100 * GST_MSECOND));
      if (!sample) {
        has_ended(reader, 0, broken);
        if (gst_app_sink_is_eos(GST_APP_SINK(sink.get()))) break;
        continue;
      }
      if (!playing) {
        const CapsPtr caps(gst_caps_copy(gst_sample_get_caps(sample.get())));
        // The demuxer leaves out what the muxer asks for.
        if (gst_structure_has_name(gst_caps_get_structure(caps.get(), 0), "video/x-ffv"))
          gst_caps_set_simple(caps.get(), "ffversion", G_TYPE_INT, 1, nullptr);
        gst_app_src_set_caps(GST_APP_SRC(source.get()), caps.get());
        play(joined, what);
        playing = true;
      }
      push(joined, source, gst_buffer_ref(gst_sample_get_buffer(sample.get())), what);
    }
  }
  gst_app_src_end_of_stream(GST_APP_SRC(source.get()));
  finish(joined, what);
}

}  // namespace qdmd::archive
