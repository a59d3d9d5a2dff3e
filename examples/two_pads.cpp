// SPDX-License-Identifier: LGPL-2.1-or-later
// An application that reads two pictures of each frame: the background, and the mask beside it as
// grey levels. It prints how much of each frame is foreground, and how bright what is behind it is.
//
//   qdmd-two-pads [VIDEO]        a simulated scene where no video is named
//
//   g++ -std=c++20 two_pads.cpp $(pkg-config --cflags --libs gstreamer-app-1.0 gstreamer-video-1.0)
#include <gst/app/gstappsink.h>
#include <gst/gst.h>
#include <gst/video/video.h>

#include <cstdio>
#include <memory>
#include <string>

namespace {

struct Release {
  void operator()(GstElement* object) const { gst_object_unref(object); }
  void operator()(GstBus* object) const { gst_object_unref(object); }
  void operator()(GstMessage* message) const { gst_message_unref(message); }
  void operator()(GstSample* sample) const { gst_sample_unref(sample); }
  void operator()(GError* error) const { g_error_free(error); }
};
template <typename T>
using Ref = std::unique_ptr<T, Release>;

// A sample's picture while it is looked at.
class Picture {
 public:
  explicit Picture(GstSample* sample) {
    GstVideoInfo info;
    mapped_ = gst_video_info_from_caps(&info, gst_sample_get_caps(sample)) &&
              gst_video_frame_map(&frame_, &info, gst_sample_get_buffer(sample), GST_MAP_READ);
  }
  ~Picture() {
    if (mapped_) gst_video_frame_unmap(&frame_);
  }
  Picture(const Picture&) = delete;
  Picture& operator=(const Picture&) = delete;

  explicit operator bool() const { return mapped_; }
  int width() const { return GST_VIDEO_FRAME_WIDTH(&frame_); }
  int height() const { return GST_VIDEO_FRAME_HEIGHT(&frame_); }
  // Luma of YUV, or grey.
  const guint8* row(int y) const {
    return static_cast<const guint8*>(GST_VIDEO_FRAME_PLANE_DATA(&frame_, 0)) +
           y * GST_VIDEO_FRAME_PLANE_STRIDE(&frame_, 0);
  }

 private:
  GstVideoFrame frame_;
  bool mapped_ = false;
};

void look_at(GstSample* background_sample, GstSample* mask_sample) {
  const Picture background(background_sample), mask(mask_sample);
  if (!background || !mask) return;
  double white = 0, behind = 0;
  for (int y = 0; y < mask.height(); ++y)
    for (int x = 0; x < mask.width(); ++x)
      if (mask.row(y)[x] == 255) {
        white += 1;
        behind += background.row(y)[x];
      }
  const double time =
      static_cast<double>(GST_BUFFER_PTS(gst_sample_get_buffer(mask_sample))) / GST_SECOND;
  std::printf("%8.2f s: foreground %5.2f %%, luma behind it %3.0f\n", time,
              100 * white / mask.width() / mask.height(), white > 0 ? behind / white : 0.0);
}

int run(const char* video) {
  // Both pads have the same frames: pulled in turn, pictures are pairs. A queue behind each, since
  // one thread serves both.
  std::string text = video ? "filesrc name=file ! decodebin ! videoconvert"
                           : "qdmdscenesrc num-buffers=150 ! videoconvert";
  text +=
      " ! video/x-raw,format=I420 ! qdmdseparate name=s window-size=50 "
      "s.background ! queue ! appsink name=background sync=false max-buffers=4 "
      "s.mask ! queue ! video/x-raw,format=GRAY8 ! appsink name=mask sync=false max-buffers=4";
  GError* failed = nullptr;
  const Ref<GstElement> pipeline(gst_parse_launch(text.c_str(), &failed));
  if (const Ref<GError> error(failed); error) {
    std::fprintf(stderr, "%s\n", error->message);
    return 1;
  }
  const auto element = [&](const char* name) {
    return Ref<GstElement>(gst_bin_get_by_name(GST_BIN(pipeline.get()), name));
  };
  if (video) g_object_set(element("file").get(), "location", video, nullptr);
  const Ref<GstElement> background = element("background"), mask = element("mask");
  gst_element_set_state(pipeline.get(), GST_STATE_PLAYING);
  // Ends with the stream, or with the bus's error: then the sinks are stopped, and give nothing.
  const Ref<GstBus> bus(gst_element_get_bus(pipeline.get()));
  int result = 0;
  for (bool done = false; !done;) {
    const Ref<GstSample> one(
        gst_app_sink_try_pull_sample(GST_APP_SINK(background.get()), 100 * GST_MSECOND));
    if (one) {
      const Ref<GstSample> other(gst_app_sink_pull_sample(GST_APP_SINK(mask.get())));
      if (other) look_at(one.get(), other.get());
      done = !other;
    } else {
      done = gst_app_sink_is_eos(GST_APP_SINK(background.get()));
    }
    const Ref<GstMessage> message(gst_bus_pop_filtered(bus.get(), GST_MESSAGE_ERROR));
    if (!message) continue;
    GError* why = nullptr;
    gchar* details = nullptr;
    gst_message_parse_error(message.get(), &why, &details);
    std::fprintf(stderr, "%s\n%s\n", why->message, details ? details : "");
    g_error_free(why);
    g_free(details);
    done = true;
    result = 1;
  }
  gst_element_set_state(pipeline.get(), GST_STATE_NULL);
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  gst_init(&argc, &argv);
  return run(argc > 1 ? argv[1] : nullptr);
}
