// SPDX-License-Identifier: LGPL-2.1-or-later
// An application around the element: it feeds frames or plays a file, reads the element's messages,
// changes what is sent on while it plays, and keeps the background as a picture.
//
//   g++ -std=c++20 embed.cpp $(pkg-config --cflags --libs gstreamer-app-1.0 gstreamer-video-1.0)
#include <gst/app/gstappsrc.h>
#include <gst/gst.h>
#include <gst/video/video.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <iterator>
#include <memory>
#include <string>
#include <utility>

namespace {

struct Release {
  void operator()(GstElement* object) const { gst_object_unref(object); }
  void operator()(GstBus* object) const { gst_object_unref(object); }
  void operator()(GstMessage* message) const { gst_message_unref(message); }
  void operator()(GstSample* sample) const { gst_sample_unref(sample); }
  void operator()(GstCaps* caps) const { gst_caps_unref(caps); }
  void operator()(GError* error) const { g_error_free(error); }
  void operator()(GOptionContext* context) const { g_option_context_free(context); }
  void operator()(gchar* text) const { g_free(text); }
};
template <typename T>
using Ref = std::unique_ptr<T, Release>;

struct Options {
  int frames = 150, window_size = 50;
  bool show = false;
  std::string video, save, plate = "background.png";
};

constexpr int kWidth = 320, kHeight = 240, kRate = 25;
constexpr const char* kOutputs[] = {"background", "foreground", "mask", "cutout"};

std::atomic<bool> interrupted = false;

bool parse(int argc, char** argv, Options* options) {
  gboolean show = FALSE;
  gchar *save = nullptr, *plate = nullptr;
  gchar** rest = nullptr;
  const GOptionEntry entries[] = {
      {"frames", 'n', 0, G_OPTION_ARG_INT, &options->frames, "Simulated frames (150)", "N"},
      {"window-size", 'w', 0, G_OPTION_ARG_INT, &options->window_size,
       "Frames decomposed together (50)", "M"},
      {"plate", 'p', 0, G_OPTION_ARG_FILENAME, &plate, "Where the background goes (background.png)",
       "PNG"},
      {"save", 's', 0, G_OPTION_ARG_FILENAME, &save, "Record what is sent on", "AVI"},
      {"show", 0, 0, G_OPTION_ARG_NONE, &show, "Show what is sent on", nullptr},
      {G_OPTION_REMAINING, 0, 0, G_OPTION_ARG_FILENAME_ARRAY, &rest, nullptr, "[VIDEO]"},
      {}};
  const Ref<GOptionContext> context(
      g_option_context_new("- separate a video, or a moving shape where none is named"));
  g_option_context_add_main_entries(context.get(), entries, nullptr);
  g_option_context_add_group(context.get(), gst_init_get_option_group());
  GError* error = nullptr;
  bool good = g_option_context_parse(context.get(), &argc, &argv, &error);
  if (error) std::fprintf(stderr, "%s\n", Ref<GError>(error)->message);
  if (good && (options->frames < 1 || options->window_size < 2 || options->window_size > 2048)) {
    std::fprintf(stderr, "--frames must be 1 or more and --window-size 2 to 2048.\n");
    good = false;
  }
  options->show = show;
  if (const Ref<gchar> text(save); text) options->save = text.get();
  if (const Ref<gchar> text(plate); text) options->plate = text.get();
  if (rest && rest[0]) options->video = rest[0];
  g_strfreev(rest);
  return good;
}

// Makes the frames of a bright square that crosses a wall of soft stripes.
class Feeder {
 public:
  Feeder(GstAppSrc* source, int frames) : frames_(frames) {
    gst_video_info_set_format(&info_, GST_VIDEO_FORMAT_RGBx, kWidth, kHeight);
    info_.fps_n = kRate;
    info_.fps_d = 1;
    const Ref<GstCaps> caps(gst_video_info_to_caps(&info_));
    gst_app_src_set_caps(source, caps.get());
    GstAppSrcCallbacks callbacks = {};
    callbacks.need_data = [](GstAppSrc* wanting, guint, gpointer self) {
      static_cast<Feeder*>(self)->feed(wanting);
    };
    gst_app_src_set_callbacks(source, &callbacks, this, nullptr);
  }

 private:
  // Runs in the source's thread whenever its queue has room.
  void feed(GstAppSrc* source) {
    if (sent_ == frames_ || interrupted) {
      gst_app_src_end_of_stream(source);
      return;
    }
    GstBuffer* buffer = gst_buffer_new_allocate(nullptr, info_.size, nullptr);
    GstMapInfo map;
    if (!buffer || !gst_buffer_map(buffer, &map, GST_MAP_WRITE)) g_error("no memory for a frame");
    const int left = (7 * sent_) % (kWidth + 60) - 60;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const bool square = x >= left && x < left + 60 && y >= 90 && y < 150;
        guint8* pixel = map.data + y * info_.stride[0] + 4 * x;
        pixel[0] = static_cast<guint8>(square ? 240 : 60 + x % 64);
        pixel[1] = static_cast<guint8>(square ? 200 : 90 + y / 3);
        pixel[2] = static_cast<guint8>(square ? 40 : 120);
        pixel[3] = 255;
      }
    gst_buffer_unmap(buffer, &map);
    GST_BUFFER_PTS(buffer) = gst_util_uint64_scale(sent_, GST_SECOND, kRate);
    GST_BUFFER_DURATION(buffer) = GST_SECOND / kRate;
    ++sent_;
    gst_app_src_push_buffer(source, buffer);
  }

  GstVideoInfo info_;
  const int frames_;
  int sent_ = 0;
};

std::string pipeline_text(const Options& options) {
  std::string text = options.video.empty() ? "appsrc name=frames format=time max-buffers=4"
                                           : "filesrc name=file ! decodebin";
  text += " ! videoconvert ! qdmdbackground name=separator post-messages=true ! ";
  // Without a screen or a file nobody waits for the clock.
  if (options.show) return text + "videoconvert ! autovideosink";
  if (options.save.empty()) return text + "fakesink sync=false";
  return text + "videoconvert ! jpegenc ! avimux ! filesink name=save sync=false";
}

// Prints what a solve found; the frames that are still to come show the next output.
void at_solve(const GstStructure* fields, GstElement* separator, int solve) {
  guint64 time = 0;
  guint frames = 0;
  gdouble omega = 0, ratio = 0, seconds = 0;
  gst_structure_get(fields, "stream-time", G_TYPE_UINT64, &time, "window-frames", G_TYPE_UINT,
                    &frames, "omega", G_TYPE_DOUBLE, &omega, "foreground-ratio", G_TYPE_DOUBLE,
                    &ratio, "solve-time", G_TYPE_DOUBLE, &seconds, nullptr);
  const char* output = kOutputs[static_cast<size_t>(solve) % std::size(kOutputs)];
  std::printf("%8.2f s: solve %d, %u frames, omega %.4f, foreground %.1f %%, took %.0f ms -> %s\n",
              static_cast<double>(time) / GST_SECOND, solve, frames, omega, 100 * ratio,
              1000 * seconds, output);
  gst_util_set_object_arg(G_OBJECT(separator), "output", output);
}

// Writes the newest background as PNG; false, with a line that says why, if that did not work.
bool save_plate(GstElement* separator, const std::string& path) {
  GstSample* newest = nullptr;
  g_object_get(separator, "background", &newest, nullptr);
  const Ref<GstSample> background(newest);
  if (!background) {
    std::fprintf(stderr, "There were too few frames for a background.\n");
    return false;
  }
  const Ref<GstCaps> caps(gst_caps_new_empty_simple("image/png"));
  GError* failed = nullptr;
  const Ref<GstSample> picture(
      gst_video_convert_sample(background.get(), caps.get(), 10 * GST_SECOND, &failed));
  GstMapInfo map;
  if (picture && gst_buffer_map(gst_sample_get_buffer(picture.get()), &map, GST_MAP_READ)) {
    g_file_set_contents(path.c_str(), reinterpret_cast<const gchar*>(map.data),
                        static_cast<gssize>(map.size), &failed);
    gst_buffer_unmap(gst_sample_get_buffer(picture.get()), &map);
  }
  const Ref<GError> error(failed);
  if (error) std::fprintf(stderr, "%s\n", error->message);
  return picture && !error;
}

int run(const Options& options) {
  GError* failed = nullptr;
  const Ref<GstElement> pipeline(gst_parse_launch(pipeline_text(options).c_str(), &failed));
  if (const Ref<GError> error(failed); error) {
    std::fprintf(stderr, "%s\n", error->message);
    return 1;
  }
  const auto element = [&](const char* name) {
    return Ref<GstElement>(gst_bin_get_by_name(GST_BIN(pipeline.get()), name));
  };
  const Ref<GstElement> separator = element("separator"), frames = element("frames"),
                        file = element("file"), save = element("save");
  g_object_set(separator.get(), "window-size", guint(options.window_size), nullptr);
  if (file) g_object_set(file.get(), "location", options.video.c_str(), nullptr);
  if (save) g_object_set(save.get(), "location", options.save.c_str(), nullptr);
  std::unique_ptr<Feeder> feeder;
  if (frames) feeder = std::make_unique<Feeder>(GST_APP_SRC(frames.get()), options.frames);

  const Ref<GstBus> bus(gst_element_get_bus(pipeline.get()));
  gst_element_set_state(pipeline.get(), GST_STATE_PLAYING);
  int solves = 0;
  bool done = false, good = true, asked = false;
  while (!done) {
    if (interrupted && !std::exchange(asked, true))
      gst_element_send_event(pipeline.get(), gst_event_new_eos());
    const Ref<GstMessage> message(gst_bus_timed_pop_filtered(
        bus.get(), 200 * GST_MSECOND,
        GstMessageType(GST_MESSAGE_EOS | GST_MESSAGE_ERROR | GST_MESSAGE_ELEMENT)));
    if (!message) continue;
    if (GST_MESSAGE_TYPE(message.get()) == GST_MESSAGE_ERROR) {
      gst_message_parse_error(message.get(), &failed, nullptr);
      const char* where = GST_OBJECT_NAME(message->src);
      if (file && message->src == GST_OBJECT(file.get())) where = options.video.c_str();
      std::fprintf(stderr, "%s: %s\n", where, Ref<GError>(failed)->message);
      done = true;
      good = false;
    } else if (GST_MESSAGE_TYPE(message.get()) == GST_MESSAGE_EOS) {
      done = true;
    } else if (gst_message_has_name(message.get(), "qdmdbackground")) {
      at_solve(gst_message_get_structure(message.get()), separator.get(), ++solves);
    }
  }
  good = good && save_plate(separator.get(), options.plate);
  gst_element_set_state(pipeline.get(), GST_STATE_NULL);
  if (!good) return 1;
  std::printf("%d solves; the background is in %s\n", solves, options.plate.c_str());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  if (!parse(argc, argv, &options)) return 2;
  std::signal(SIGINT, [](int) {
    interrupted = true;
    std::signal(SIGINT, SIG_DFL);
  });
  return run(options);
}
