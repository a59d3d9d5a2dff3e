// SPDX-License-Identifier: LGPL-2.1-or-later
// Separates a video and shows the result: a side-by-side video, the background, a contact sheet.
#include <gst/app/gstappsink.h>
#include <gst/gst.h>
#include <gst/video/video.h>

#include <unistd.h>
#include <algorithm>
#include <atomic>
#include <cerrno>
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
  void operator()(GstPad* object) const { gst_object_unref(object); }
  void operator()(GstMessage* message) const { gst_message_unref(message); }
  void operator()(GstSample* sample) const { gst_sample_unref(sample); }
};
template <typename T>
using Ref = std::unique_ptr<T, Unref>;

struct Options {
  int frames = 0;  // 0: all
  int window_size = 100;
  std::string scene;  // of qdmdscenesrc, in place of a video
  std::string output_dir = ".";
  std::string video;
};

constexpr const char* kTitles[] = {"input", "background", "foreground, 4 times as bright", "mask"};
constexpr int kSheetRows = 5;

std::atomic<bool> interrupted = false;
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler sets it");

bool parse(int argc, char** argv, Options* options) {
  gint frames = 0, window_size = options->window_size;
  gchar *output_dir = nullptr, *scene = nullptr;
  gchar** rest = nullptr;
  const GOptionEntry entries[] = {
      {"frames", 'n', 0, G_OPTION_ARG_INT, &frames, "Stop after N frames (0: all)", "N"},
      {"window-size", 'w', 0, G_OPTION_ARG_INT, &window_size, "Frames decomposed together", "M"},
      {"output-dir", 'o', 0, G_OPTION_ARG_FILENAME, &output_dir, "Where the results go", "DIR"},
      {"scene", 's', 0, G_OPTION_ARG_STRING, &scene, "A simulated scene in place of a video",
       "PRESET or EFFECTS"},
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
  if (scene) options->scene = scene;
  if (output_dir) options->output_dir = output_dir;
  if (rest && rest[0]) options->video = rest[0];
  if (good && options->video.empty() && options->scene.empty()) {
    std::fprintf(stderr, "Name a video, or a --scene.\n");
    good = false;
  }
  if (good && (frames < 0 || window_size < 2 || window_size > 2048)) {
    std::fprintf(stderr, "--frames must be 0 or more and --window-size 2 to 2048.\n");
    good = false;
  }
  g_strfreev(rest);
  g_free(output_dir);
  g_free(scene);
  return good;
}

// The decoded video and three pictures of one separator meet again in a 2 x 2 grid. The input's
// branch must hold all that the window holds back, so its queue has no limit. No sink waits for its
// first buffer (async=false): the encoder wants many frames before it gives one, while another sink
// would block.
std::string pipeline_text(const Options& options) {
  const std::string short_queue = " ! queue max-size-buffers=8 max-size-bytes=0 max-size-time=0 ";
  std::string labels;
  for (int i = 0; i < 4; ++i)
    labels += std::string(" ! textoverlay shaded-background=true font-desc=\"Sans 10\" text=\"") +
              kTitles[i] + "\" name=label-" + std::to_string(i) +
              " halignment=left valignment=top xpad=0 ypad=0";
  std::string text = options.scene.empty() ? "filesrc name=file ! decodebin ! "
                                           : "qdmdscenesrc name=scene num-buffers=300 ! "
                                             "video/x-raw,width=320,height=240,framerate=25/1 ! ";
  // Square pixels: the compositor would widen others, and the pictures would overlap.
  text +=
      "videoconvert ! videoscale ! video/x-raw,format=RGBx,pixel-aspect-ratio=1/1 ! tee name=t "
      "t. ! queue max-size-buffers=0 max-size-bytes=0 max-size-time=0 ! grid.sink_0 ";
  text +=
      "t. ! queue max-size-buffers=4 max-size-bytes=0 max-size-time=0 ! qdmdseparate name=s "
      "window-size=" +
      std::to_string(options.window_size) + " s.background ! tee name=b b." + short_queue +
      "! grid.sink_1 b." + short_queue +
      "! appsink name=background sync=false async=false max-buffers=1 drop=true wait-on-eos=false ";
  // People in clothes of the street's grey differ from it by few levels: 2 x 2 times as bright they
  // are seen.
  const std::string twice = "! videobalance contrast=2 saturation=2 ";
  text += "s.foreground" + short_queue + twice + twice + "! grid.sink_2 ";
  text += "s.mask" + short_queue + "! grid.sink_3 ";
  text += "compositor name=grid background=black ! video/x-raw,format=RGBx ! tee name=g g." +
          short_queue + "! appsink name=grids sync=false async=false max-buffers=8 g." +
          short_queue + "! videoconvert" + labels +
          " ! video/x-raw,format=I420 ! x264enc speed-preset=veryfast ! mp4mux ! "
          "filesink name=video sync=false async=false";
  return text;
}

// What the streaming thread needs where the video enters the tee.
struct Entry {
  GstBin* pipeline;
  GstElement* grid;
  guint64 limit;  // frames; 0: all
  guint64 frames = 0;
};

// Places the four pictures and their labels.
void place_pictures(const Entry& entry, const GstVideoInfo& video) {
  for (int i = 0; i < 4; ++i) {
    const int x = i % 2 * video.width, y = i / 2 * video.height;
    const Ref<GstPad> pad(
        gst_element_get_static_pad(entry.grid, ("sink_" + std::to_string(i)).c_str()));
    g_object_set(pad.get(), "xpos", x, "ypos", y, nullptr);
    const Ref<GstElement> label(
        gst_bin_get_by_name(entry.pipeline, ("label-" + std::to_string(i)).c_str()));
    g_object_set(label.get(), "deltax", x, "deltay", y, nullptr);
  }
}

// Sees the size when it is known, and ends the video at the limit or when the user wants it to
// stop. Every frame from there on is refused: identity's eos-after refuses one, and a decoder that
// drains gets a later frame past it.
GstPadProbeReturn at_entry(GstPad*, GstPadProbeInfo* info, gpointer data) {
  Entry& entry = *static_cast<Entry*>(data);
  if (GST_PAD_PROBE_INFO_TYPE(info) & GST_PAD_PROBE_TYPE_BUFFER) {
    if (!interrupted && (entry.limit == 0 || entry.frames < entry.limit)) {
      ++entry.frames;
      return GST_PAD_PROBE_OK;
    }
    gst_buffer_unref(GST_PAD_PROBE_INFO_BUFFER(info));
    GST_PAD_PROBE_INFO_FLOW_RETURN(info) = GST_FLOW_EOS;
    return GST_PAD_PROBE_HANDLED;
  }
  GstEvent* event = GST_PAD_PROBE_INFO_EVENT(info);
  if (GST_EVENT_TYPE(event) != GST_EVENT_CAPS) return GST_PAD_PROBE_OK;
  GstCaps* caps = nullptr;
  gst_event_parse_caps(event, &caps);
  GstVideoInfo video;
  if (gst_video_info_from_caps(&video, caps)) place_pictures(entry, video);
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

// Small grids, evenly spaced over a video whose length need not be known: when there are many,
// every other one goes and the spacing doubles.
class Moments {
 public:
  static constexpr int kWidth = 300;  // of each picture

  void add(GstSample* sample) {
    if (seen_++ % step_ != 0) return;
    const cv::Mat grid = picture_of(sample);
    if (grid.empty()) return;
    if (kept_.empty())
      size_ = {2 * kWidth, 2 * std::clamp(kWidth * grid.rows / grid.cols, 1, 4 * kWidth)};
    cv::Mat small;
    cv::resize(grid, small, size_, 0, 0, cv::INTER_AREA);
    kept_.push_back(small);
    if (kept_.size() < kMost) return;
    for (size_t i = 0; i < kMost / 2; ++i) kept_[i] = kept_[2 * i];
    kept_.resize(kMost / 2);
    step_ *= 2;
  }

  // The middles of equal parts of the video.
  std::vector<cv::Mat> pick(size_t count) const {
    count = std::min(count, kept_.size());
    std::vector<cv::Mat> picked;
    for (size_t i = 0; i < count; ++i)
      picked.push_back(kept_[(2 * i + 1) * kept_.size() / (2 * count)]);
    return picked;
  }

 private:
  static constexpr size_t kMost = 64;
  std::vector<cv::Mat> kept_;
  cv::Size size_;
  guint64 seen_ = 0, step_ = 1;
};

// One row a moment, four columns: the grid's pictures side by side under their titles.
cv::Mat contact_sheet(const std::vector<cv::Mat>& grids) {
  constexpr int kWidth = Moments::kWidth, kGap = 6, kTitle = 28;
  const int height = grids[0].rows / 2;
  cv::Mat sheet(kTitle + static_cast<int>(grids.size()) * (height + kGap),
                4 * (kWidth + kGap) + kGap, CV_8UC3, cv::Scalar::all(255));
  for (int column = 0; column < 4; ++column) {
    const int x = kGap + column * (kWidth + kGap);
    cv::putText(sheet, kTitles[column], {x, 20}, cv::FONT_HERSHEY_SIMPLEX, 0.6, cv::Scalar::all(0),
                1, cv::LINE_AA);
    const cv::Rect part(column % 2 * kWidth, column / 2 * height, kWidth, height);
    for (size_t row = 0; row < grids.size(); ++row)
      grids[row](part).copyTo(
          sheet(cv::Rect(x, kTitle + static_cast<int>(row) * (height + kGap), kWidth, height)));
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
  if (g_mkdir_with_parents(options.output_dir.c_str(), 0777) != 0) {
    std::fprintf(stderr, "%s: %s\n", options.output_dir.c_str(), g_strerror(errno));
    return 1;
  }
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
  if (options.scene.empty())
    g_object_set(element("file").get(), "location", options.video.c_str(), nullptr);
  else
    g_object_set(element("scene").get(), "scene", options.scene.c_str(), nullptr);
  g_object_set(element("video").get(), "location", path("separated.mp4").c_str(), nullptr);
  const Ref<GstElement> grid = element("grid"), grids = element("grids"), tee = element("t"),
                        background = element("background");
  const Ref<GstPad> tee_pad(gst_element_get_static_pad(tee.get(), "sink"));
  Entry entry{GST_BIN(pipeline.get()), grid.get(), static_cast<guint64>(options.frames)};
  gst_pad_add_probe(
      tee_pad.get(),
      GstPadProbeType(GST_PAD_PROBE_TYPE_BUFFER | GST_PAD_PROBE_TYPE_EVENT_DOWNSTREAM), at_entry,
      &entry, nullptr);

  const gint64 start = g_get_monotonic_time();
  gst_element_set_state(pipeline.get(), GST_STATE_PLAYING);
  Progress progress;
  Moments moments;
  guint64 frames = 0;
  Outcome outcome = Outcome::running;
  gint64 length = 0;
  while (outcome != Outcome::failed) {
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
    moments.add(sample.get());
    progress.show(frames, share);
  }
  progress.end();
  const double seconds = static_cast<double>(g_get_monotonic_time() - start) / G_USEC_PER_SEC;
  // The video file is whole when every sink has seen the end.
  if (outcome == Outcome::running) outcome = poll(pipeline.get(), 60 * GST_SECOND);
  GstSample* newest = nullptr;
  g_object_get(background.get(), "last-sample", &newest, nullptr);
  const Ref<GstSample> background_sample(newest);
  // An element's own words can miss the point: sound alone is an "internal data stream error".
  const bool no_video = !gst_pad_has_current_caps(tee_pad.get());
  gst_element_set_state(pipeline.get(), GST_STATE_NULL);
  if (outcome != Outcome::finished) {
    if (no_video && !options.video.empty())
      std::fprintf(stderr, "No video could be decoded from %s.\n", options.video.c_str());
    if (outcome == Outcome::running) std::fprintf(stderr, "The video could not be finished.\n");
    return 1;
  }
  if (frames == 0 || !background_sample) {
    if (interrupted) return 130;
    std::fprintf(stderr, "%s has no frames.\n", options.video.c_str());
    return 1;
  }

  const cv::Mat picture = picture_of(background_sample.get());
  const std::vector<cv::Mat> rows = moments.pick(kSheetRows);
  if (rows.empty() || !cv::imwrite(path("background.png"), picture) ||
      !cv::imwrite(path("contact-sheet.png"), contact_sheet(rows))) {
    std::fprintf(stderr, "Cannot write to %s.\n", options.output_dir.c_str());
    return 1;
  }
  std::printf(
      "Separated %llu frames of %dx%d in %.1f s: %.1f frames/s for background, foreground and mask "
      "together, the H.264 video included.\n",
      static_cast<unsigned long long>(entry.frames), picture.cols, picture.rows, seconds,
      static_cast<double>(entry.frames) / seconds);
  for (const char* name : {"background.png", "separated.mp4", "contact-sheet.png"})
    std::printf("  %s\n", path(name).c_str());
  return interrupted ? 130 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  if (!parse(argc, argv, &options)) return 2;
  // The first Ctrl-C ends the video early and keeps what is done, the second one ends the program.
  std::signal(SIGINT, [](int) {
    interrupted = true;
    std::signal(SIGINT, SIG_DFL);
  });
  try {
    return run(options);
  } catch (const std::exception& exception) {
    std::fprintf(stderr, "%s\n", exception.what());
    return 1;
  }
}
