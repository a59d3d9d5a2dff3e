// Separates a video and shows the result: a side-by-side video, the background, a contact sheet.
#include <gst/app/gstappsink.h>
#include <gst/gst.h>
#include <gst/video/video.h>

#include <unistd.h>
#include <csignal>
#include <cstdio>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

namespace {

struct Unref {
  void operator()(GstElement* object) const { gst_object_unref(object); }
  void operator()(GstBus* object) const { gst_object_unref(object); }
  void operator()(GstMessage* message) const { gst_message_unref(message); }
  void operator()(GstSample* sample) const { gst_sample_unref(sample); }
};
template <typename T>
using Ref = std::unique_ptr<T, Unref>;

struct Options {
  int frames = 0;  // 0: all
  int window_size = 100;
  bool test_source = false;
  std::string output_dir = ".";
  std::string video;
};

constexpr const char* kTitles[] = {"input", "background", "foreground", "mask"};
constexpr int kSheetRows = 5;

volatile std::sig_atomic_t interrupted = 0;

bool parse(int argc, char** argv, Options* options) {
  gint frames = 0, window_size = options->window_size;
  gboolean test_source = FALSE;
  gchar* output_dir = nullptr;
  gchar** rest = nullptr;
  const GOptionEntry entries[] = {
      {"frames", 'n', 0, G_OPTION_ARG_INT, &frames, "Stop after N frames (0: all)", "N"},
      {"window-size", 'w', 0, G_OPTION_ARG_INT, &window_size, "Frames decomposed together", "M"},
      {"output-dir", 'o', 0, G_OPTION_ARG_FILENAME, &output_dir, "Where the results go", "DIR"},
      {"test-source", 't', 0, G_OPTION_ARG_NONE, &test_source, "A moving ball in place of a video",
       nullptr},
      {G_OPTION_REMAINING, 0, 0, G_OPTION_ARG_FILENAME_ARRAY, &rest, nullptr, "VIDEO"},
      {}};
  GOptionContext* context = g_option_context_new("- separate a video and show the result");
  g_option_context_add_main_entries(context, entries, nullptr);
  g_option_context_add_group(context, gst_init_get_option_group());
  GError* error = nullptr;
  bool good = g_option_context_parse(context, &argc, &argv, &error);
  g_option_context_free(context);
  if (!good) {
    std::fprintf(stderr, "%s\n", error->message);
    g_clear_error(&error);
  }
  options->frames = frames;
  options->window_size = window_size;
  options->test_source = test_source;
  if (output_dir) options->output_dir = output_dir;
  if (rest && rest[0]) options->video = rest[0];
  if (good && options->video.empty() && !options->test_source) {
    std::fprintf(stderr, "Name a video, or --test-source.\n");
    good = false;
  }
  if (good && (frames < 0 || window_size < 2 || window_size > 2048)) {
    std::fprintf(stderr, "--frames must be 0 or more and --window-size 2 to 2048.\n");
    good = false;
  }
  g_strfreev(rest);
  g_free(output_dir);
  return good;
}

// Four branches of one decoded video meet again in a 2 x 2 grid. The input's branch must hold all
// that the windows hold back, so its queue has no limit. No sink waits for its first buffer
// (async=false): the encoder wants many frames before it gives one, while another sink would block.
std::string pipeline_text(const Options& options) {
  const std::string separate =
      "t. ! queue max-size-buffers=4 max-size-bytes=0 max-size-time=0 ! qdmdbackground "
      "window-size=" +
      std::to_string(options.window_size) + " output=";
  const std::string short_queue = " ! queue max-size-buffers=8 max-size-bytes=0 max-size-time=0 ";
  const auto label = [](const char* title, const char* x, const char* y) {
    return std::string(" ! textoverlay shaded-background=true font-desc=\"Sans 10\" text=") +
           title + " halignment=position valignment=position xpos=" + x + " ypos=" + y;
  };
  std::string text = options.test_source ? "videotestsrc pattern=ball num-buffers=300 ! "
                                           "video/x-raw,width=320,height=240,framerate=25/1 ! "
                                         : "filesrc name=file ! decodebin ! ";
  text += "videoconvert ! video/x-raw,format=RGBx ! identity name=limit eos-after=";
  text += std::to_string(options.frames > 0 ? options.frames + 1 : -1);
  text +=
      " ! tee name=t "
      "t. ! queue max-size-buffers=0 max-size-bytes=0 max-size-time=0 ! grid.sink_0 ";
  text +=
      separate + "background ! tee name=b b." + short_queue + "! grid.sink_1 b." + short_queue +
      "! appsink name=background sync=false async=false max-buffers=1 drop=true wait-on-eos=false ";
  text += separate + "foreground" + short_queue + "! grid.sink_2 ";
  text += separate + "mask" + short_queue + "! grid.sink_3 ";
  text += "compositor name=grid background=black ! video/x-raw,format=RGBx ! tee name=g g." +
          short_queue + "! appsink name=grids sync=false async=false max-buffers=8 g." +
          short_queue + "! videoconvert" + label(kTitles[0], "0.01", "0.01") +
          label(kTitles[1], "0.51", "0.01") + label(kTitles[2], "0.01", "0.51") +
          label(kTitles[3], "0.51", "0.51") +
          " ! video/x-raw,format=I420 ! x264enc speed-preset=veryfast ! mp4mux ! "
          "filesink name=video sync=false async=false";
  return text;
}

// Places the four pictures when their size is known.
GstPadProbeReturn place_pictures(GstPad*, GstPadProbeInfo* info, gpointer grid) {
  GstEvent* event = GST_PAD_PROBE_INFO_EVENT(info);
  if (GST_EVENT_TYPE(event) != GST_EVENT_CAPS) return GST_PAD_PROBE_OK;
  GstCaps* caps = nullptr;
  gst_event_parse_caps(event, &caps);
  GstVideoInfo video;
  if (!gst_video_info_from_caps(&video, caps)) return GST_PAD_PROBE_OK;
  for (int i = 0; i < 4; ++i) {
    const std::string name = "sink_" + std::to_string(i);
    GstPad* pad = gst_element_get_static_pad(GST_ELEMENT(grid), name.c_str());
    g_object_set(pad, "xpos", i % 2 * video.width, "ypos", i / 2 * video.height, nullptr);
    gst_object_unref(pad);
  }
  return GST_PAD_PROBE_OK;
}

// An RGBx sample as OpenCV's BGR picture.
cv::Mat picture_of(GstSample* sample) {
  GstVideoInfo info;
  GstVideoFrame frame;
  if (!gst_video_info_from_caps(&info, gst_sample_get_caps(sample)) ||
      !gst_video_frame_map(&frame, &info, gst_sample_get_buffer(sample), GST_MAP_READ))
    return {};
  const cv::Mat mapped(info.height, info.width, CV_8UC4, GST_VIDEO_FRAME_PLANE_DATA(&frame, 0),
                       static_cast<size_t>(GST_VIDEO_FRAME_PLANE_STRIDE(&frame, 0)));
  cv::Mat picture;
  cv::cvtColor(mapped, picture, cv::COLOR_RGBA2BGR);
  gst_video_frame_unmap(&frame);
  return picture;
}

// One row a moment, four columns: the grid's pictures side by side under their titles.
cv::Mat contact_sheet(const std::vector<cv::Mat>& grids) {
  constexpr int kWidth = 300, kGap = 6, kTitle = 28;
  const int height = std::max(1, kWidth * grids[0].rows / grids[0].cols);
  cv::Mat sheet(kTitle + static_cast<int>(grids.size()) * (height + kGap),
                4 * (kWidth + kGap) + kGap, CV_8UC3, cv::Scalar::all(255));
  for (int column = 0; column < 4; ++column) {
    const int x = kGap + column * (kWidth + kGap);
    cv::putText(sheet, kTitles[column], {x, 20}, cv::FONT_HERSHEY_SIMPLEX, 0.6, cv::Scalar::all(0),
                1, cv::LINE_AA);
    for (size_t row = 0; row < grids.size(); ++row) {
      const cv::Mat& grid = grids[row];
      const cv::Rect part(column % 2 * grid.cols / 2, column / 2 * grid.rows / 2, grid.cols / 2,
                          grid.rows / 2);
      const cv::Rect place(x, kTitle + static_cast<int>(row) * (height + kGap), kWidth, height);
      cv::resize(grid(part), sheet(place), place.size(), 0, 0, cv::INTER_AREA);
    }
  }
  return sheet;
}

class Progress {
 public:
  void show(guint64 frames, double share) {
    if (share < next_) return;
    next_ = share + (terminal_ ? 0.01 : 0.1);
    std::fprintf(stderr, "%sSeparated %llu frames (%.0f %%)%s", terminal_ ? "\r" : "",
                 static_cast<unsigned long long>(frames), 100 * share, terminal_ ? "" : "\n");
  }
  void end() const {
    if (terminal_) std::fputc('\n', stderr);
  }

 private:
  const bool terminal_ = isatty(STDERR_FILENO) != 0;
  double next_ = 0.01;
};

enum class Outcome { running, finished, failed };

// What the bus says within `wait`; prints an error.
Outcome poll(GstElement* pipeline, GstClockTime wait) {
  const Ref<GstBus> bus(gst_element_get_bus(pipeline));
  const Ref<GstMessage> message(gst_bus_timed_pop_filtered(
      bus.get(), wait, GstMessageType(GST_MESSAGE_EOS | GST_MESSAGE_ERROR)));
  if (!message) return Outcome::running;
  if (GST_MESSAGE_TYPE(message.get()) == GST_MESSAGE_EOS) return Outcome::finished;
  GError* error = nullptr;
  gst_message_parse_error(message.get(), &error, nullptr);
  std::fprintf(stderr, "%s: %s\n", GST_OBJECT_NAME(GST_MESSAGE_SRC(message.get())), error->message);
  g_error_free(error);
  return Outcome::failed;
}

int run(const Options& options) {
  GError* error = nullptr;
  const Ref<GstElement> pipeline(gst_parse_launch(pipeline_text(options).c_str(), &error));
  if (error) {
    std::fprintf(stderr, "%s\n", error->message);
    g_error_free(error);
    return 1;
  }
  const auto element = [&](const char* name) {
    return Ref<GstElement>(gst_bin_get_by_name(GST_BIN(pipeline.get()), name));
  };
  const auto path = [&](const char* name) { return options.output_dir + "/" + name; };
  if (!options.test_source)
    g_object_set(element("file").get(), "location", options.video.c_str(), nullptr);
  g_object_set(element("video").get(), "location", path("separated.mp4").c_str(), nullptr);
  const Ref<GstElement> grid = element("grid"), grids = element("grids"), tee = element("t"),
                        background = element("background");
  GstPad* tee_pad = gst_element_get_static_pad(tee.get(), "sink");
  gst_pad_add_probe(tee_pad, GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM, place_pictures, grid.get(),
                    nullptr);
  gst_object_unref(tee_pad);

  const gint64 start = g_get_monotonic_time();
  gst_element_set_state(pipeline.get(), GST_STATE_PLAYING);
  Progress progress;
  std::vector<cv::Mat> moments;
  cv::Mat last_grid;
  guint64 frames = 0;
  Outcome outcome = Outcome::running;
  gint64 length = 0;
  while (!interrupted && outcome != Outcome::failed) {
    if (outcome == Outcome::running) outcome = poll(pipeline.get(), 0);
    const Ref<GstSample> sample(
        gst_app_sink_try_pull_sample(GST_APP_SINK(grids.get()), 200 * GST_MSECOND));
    if (!sample) {
      if (gst_app_sink_is_eos(GST_APP_SINK(grids.get()))) break;
      continue;
    }
    ++frames;
    if (length <= 0) gst_element_query_duration(tee.get(), GST_FORMAT_TIME, &length);
    const GstBuffer* buffer = gst_sample_get_buffer(sample.get());
    double total =
        length > 0 && GST_BUFFER_DURATION_IS_VALID(buffer)
            ? static_cast<double>(length) / static_cast<double>(GST_BUFFER_DURATION(buffer))
            : 300;
    if (options.frames > 0) total = std::min(total, static_cast<double>(options.frames));
    const double share = std::min(1.0, static_cast<double>(frames) / total);
    // The middle of each fifth of the video.
    if (share * kSheetRows >= static_cast<double>(moments.size()) + 0.5 &&
        moments.size() < kSheetRows)
      moments.push_back(picture_of(sample.get()));
    progress.show(frames, share);
  }
  progress.end();
  const double seconds = static_cast<double>(g_get_monotonic_time() - start) / G_USEC_PER_SEC;
  // The video file is whole when every sink has seen the end.
  if (outcome == Outcome::running && !interrupted) outcome = poll(pipeline.get(), 60 * GST_SECOND);
  GstSample* newest = nullptr;
  g_object_get(background.get(), "last-sample", &newest, nullptr);
  const Ref<GstSample> background_sample(newest);
  gst_element_set_state(pipeline.get(), GST_STATE_NULL);
  if (interrupted) return 130;
  if (outcome != Outcome::finished) {
    if (outcome == Outcome::running) std::fprintf(stderr, "The video could not be finished.\n");
    return 1;
  }
  if (frames == 0 || !background_sample) {
    std::fprintf(stderr, "%s has no frames.\n", options.video.c_str());
    return 1;
  }

  const cv::Mat picture = picture_of(background_sample.get());
  if (moments.empty() || !cv::imwrite(path("background.png"), picture) ||
      !cv::imwrite(path("contact-sheet.png"), contact_sheet(moments))) {
    std::fprintf(stderr, "Cannot write to %s.\n", options.output_dir.c_str());
    return 1;
  }
  std::printf(
      "Separated %llu frames of %dx%d in %.1f s: %.1f frames/s for background, foreground and mask "
      "together, the H.264 video included.\n",
      static_cast<unsigned long long>(frames), picture.cols, picture.rows, seconds,
      static_cast<double>(frames) / seconds);
  for (const char* name : {"background.png", "separated.mp4", "contact-sheet.png"})
    std::printf("  %s\n", path(name).c_str());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  if (!parse(argc, argv, &options)) return 2;
  std::signal(SIGINT, [](int) { interrupted = 1; });
  try {
    return run(options);
  } catch (const std::exception& exception) {
    std::fprintf(stderr, "%s\n", exception.what());
    return 1;
  }
}
