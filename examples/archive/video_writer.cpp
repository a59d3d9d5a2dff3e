#include "examples/archive/video_writer.h"

#include <gst/app/gstappsink.h>
#include <gst/app/gstappsrc.h>

#include <cmath>

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

// What loses nothing of such frames and adds nothing to them, of all that the encoder takes. What
// others like best, they know.
std::string taken_by(const std::string& encoder, const GstVideoInfo& info) {
  const bool is_rgb = GST_VIDEO_INFO_IS_RGB(&info), is_grey = GST_VIDEO_INFO_IS_GRAY(&info);
  std::string format = gst_video_format_to_string(GST_VIDEO_INFO_FORMAT(&info));
  if (encoder == kLossless && is_rgb) format = "BGRx";
  if (encoder == kPicture && !is_grey) format = "RGB";
  return encoder == kLossless || encoder == kPicture ? "video/x-raw,format=" + format + " ! " : "";
}

}  // namespace

// Slices would be threads' work: a process has one core.
const char* const kLossless = "avenc_ffv1 ! matroskamux";
// One process encodes, beside the frames that it reads: files are 4 % larger than with the
// encoder's own level, in two thirds of its time.
const char* const kPicture = "pngenc snapshot=true compression-level=2";

VideoWriter::VideoWriter(const std::string& path, const GstVideoInfo& info, double rate,
                         const std::string& encoder)
    : path_(path), length_(static_cast<GstClockTime>(std::llround(GST_SECOND / rate))) {
  pipeline_ = make_pipeline(std::string(kSource) + "videoconvert ! " + taken_by(encoder, info) +
                            encoder + " ! filesink name=sink async=false");
  source_ = element_of(pipeline_, "source");
  g_object_set(element_of(pipeline_, "sink").get(), "location", path.c_str(), nullptr);
  GstVideoInfo shown = info;
  gst_util_double_to_fraction(rate, &GST_VIDEO_INFO_FPS_N(&shown), &GST_VIDEO_INFO_FPS_D(&shown));
  const CapsPtr caps(gst_video_info_to_caps(&shown));
  gst_app_src_set_caps(GST_APP_SRC(source_.get()), caps.get());
  play(pipeline_, path + " cannot be written");
}

void VideoWriter::write(std::span<const uint8_t> frame, GstClockTime time) {
  GstBuffer* const buffer = gst_buffer_new_allocate(nullptr, frame.size(), nullptr);
  if (!buffer || gst_buffer_fill(buffer, 0, frame.data(), frame.size()) != frame.size())
    throw std::runtime_error(path_ + ": there is no memory for a frame");
  GST_BUFFER_PTS(buffer) = time;
  GST_BUFFER_DURATION(buffer) = length_;
  push(pipeline_, source_, buffer, path_ + " cannot be written");
}

void VideoWriter::end() {
  gst_app_src_end_of_stream(GST_APP_SRC(source_.get()));
  finish(pipeline_, path_ + " cannot be written");
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
