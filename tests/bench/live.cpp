// SPDX-License-Identifier: LGPL-2.1-or-later
// A camera in real time, the element, a screen that drops what comes late: frames dropped, time in
// the element and memory of this process. With --unpaced as fast as frames are taken, which is
// for memory: it depends on frames, not on seconds.
#include <gst/app/gstappsrc.h>
#include <gst/gst.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <mutex>
#include <string>
#include <vector>

#include "tests/bench/camera.h"
#include "tests/bench/clock.h"

namespace {

using namespace qdmd::bench;

struct Options {
  int width = 1920, height = 1080, rate = 25, window = 100, hop = 25, threads = 0;
  double seconds = 60;
  std::string mode = "live", method = "robust", output = "mask", extra, times;
  bool unpaced = false, brief = false;
};

double megabytes_of(const char* field) {
  std::ifstream file("/proc/self/status");
  for (std::string line; std::getline(file, line);)
    if (line.rfind(field, 0) == 0) return std::stod(line.substr(line.find(':') + 1)) * 1024 / 1e6;
  return 0;
}

// When frames enter and leave the element. Batches leave late: only live frames come out in turn.
struct Watch {
  std::mutex mutex;
  double entered = 0;
  GstClockTime base_time = GST_CLOCK_TIME_NONE;
  GstClock* clock = nullptr;
  std::vector<double> in_element, after_capture;  // milliseconds
  uint64_t frames_out = 0;
};

GstPadProbeReturn enter(GstPad*, GstPadProbeInfo*, gpointer data) {
  static_cast<Watch*>(data)->entered = seconds_on(CLOCK_MONOTONIC);
  return GST_PAD_PROBE_OK;
}

GstPadProbeReturn leave(GstPad*, GstPadProbeInfo* info, gpointer data) {
  auto* watch = static_cast<Watch*>(data);
  const std::lock_guard lock(watch->mutex);
  ++watch->frames_out;
  watch->in_element.push_back(1e3 * (seconds_on(CLOCK_MONOTONIC) - watch->entered));
  const GstClockTime captured = GST_BUFFER_PTS(GST_PAD_PROBE_INFO_BUFFER(info));
  if (watch->clock)
    watch->after_capture.push_back(
        1e-6 * double(GstClockTimeDiff(gst_clock_get_time(watch->clock) - watch->base_time) -
                      GstClockTimeDiff(captured)));
  return GST_PAD_PROBE_OK;
}

GstElement* named(GstElement* pipeline, const char* name) {
  return gst_bin_get_by_name(GST_BIN(pipeline), name);
}

// Pushes a frame when its time has come, as a camera does.
class Source {
 public:
  Source(const Options& options, GstElement* pipeline)
      : options_(options),
        camera_(options.width, options.height, 3),
        pipeline_(pipeline),
        source_(GST_APP_SRC(named(pipeline, "camera"))),
        pool_(gst_buffer_pool_new()) {
    GstStructure* config = gst_buffer_pool_get_config(pool_);
    gst_buffer_pool_config_set_params(config, nullptr, guint(camera_.frame_bytes()), 3, 0);
    gst_buffer_pool_set_config(pool_, config);
    gst_buffer_pool_set_active(pool_, TRUE);
  }
  ~Source() {
    gst_buffer_pool_set_active(pool_, FALSE);
    gst_object_unref(pool_);
    gst_object_unref(source_);
  }

  // False: the pipeline takes no more.
  bool push(int64_t index) {
    GstBuffer* buffer = nullptr;
    if (gst_buffer_pool_acquire_buffer(pool_, &buffer, nullptr) != GST_FLOW_OK) return false;
    GstMapInfo map;
    gst_buffer_map(buffer, &map, GST_MAP_WRITE);
    camera_.render(index, map.data);
    gst_buffer_unmap(buffer, &map);
    GST_BUFFER_PTS(buffer) = gst_util_uint64_scale(guint64(index), GST_SECOND, options_.rate);
    GST_BUFFER_DURATION(buffer) = GST_SECOND / guint64(options_.rate);
    if (!options_.unpaced) wait_until(GST_BUFFER_PTS(buffer));
    most_waiting_ = std::max(most_waiting_, gst_app_src_get_current_level_buffers(source_));
    return gst_app_src_push_buffer(source_, buffer) == GST_FLOW_OK;
  }
  void end() { gst_app_src_end_of_stream(source_); }
  // Frames that waited before the element when the next was ready.
  guint64 most_waiting() const { return most_waiting_; }

 private:
  void wait_until(GstClockTime running_time) {
    GstClock* clock = gst_pipeline_get_clock(GST_PIPELINE(pipeline_));
    const GstClockID id =
        gst_clock_new_single_shot_id(clock, gst_element_get_base_time(pipeline_) + running_time);
    gst_clock_id_wait(id, nullptr);
    gst_clock_id_unref(id);
    gst_object_unref(clock);
  }

  const Options& options_;
  Camera camera_;
  GstElement* pipeline_;
  GstAppSrc* source_;
  GstBufferPool* pool_;
  guint64 most_waiting_ = 0;
};

std::string description_of(const Options& options) {
  const std::string format = "video/x-raw,format=RGB,width=" + std::to_string(options.width) +
                             ",height=" + std::to_string(options.height) +
                             ",framerate=" + std::to_string(options.rate) + "/1";
  // Cameras report one frame of latency, as v4l2src and videotestsrc do.
  const std::string latency = std::to_string(GST_SECOND / guint64(options.rate));
  std::string text = "appsrc name=camera format=time caps=\"" + format + "\" ";
  text += options.unpaced ? "block=true max-bytes=0 max-buffers=2 "
                          : "is-live=true max-bytes=0 max-buffers=0 min-latency=" + latency + " ";
  text += "! qdmdbackground name=separator mode=" + options.mode + " method=" + options.method +
          " output=" + options.output + " window-size=" + std::to_string(options.window) +
          " n-threads=" + std::to_string(options.threads);
  if (options.mode == "live") text += " hop-size=" + std::to_string(options.hop);
  text += " " + options.extra +
          " ! fakevideosink name=screen sync=" + (options.unpaced ? "false" : "true");
  return text;
}

guint64 counter(const GstStructure* stats, const char* name) {
  guint64 value = 0;
  gst_structure_get_uint64(stats, name, &value);
  return value;
}

// An error on the bus; empty: the stream has ended, or goes on where `wait` is 0.
std::string error_of(GstElement* pipeline, GstClockTime wait) {
  GstBus* bus = gst_element_get_bus(pipeline);
  GstMessage* message = gst_bus_timed_pop_filtered(
      bus, wait, GstMessageType(GST_MESSAGE_ERROR | (wait ? GST_MESSAGE_EOS : 0)));
  gst_object_unref(bus);
  if (!message) return wait ? "the stream did not end" : "";
  std::string text;
  if (GST_MESSAGE_TYPE(message) == GST_MESSAGE_ERROR) {
    GError* error = nullptr;
    gst_message_parse_error(message, &error, nullptr);
    text = error->message;
    g_error_free(error);
  }
  gst_message_unref(message);
  return text;
}

int run(const Options& options) {
  GError* error = nullptr;
  GstElement* pipeline = gst_parse_launch(description_of(options).c_str(), &error);
  if (error) {
    std::fprintf(stderr, "%s\n", error->message);
    return 1;
  }
  Watch watch;
  GstElement* separator = named(pipeline, "separator");
  for (const auto& [name, probe] : {std::pair{"sink", &enter}, std::pair{"src", &leave}}) {
    GstPad* pad = gst_element_get_static_pad(separator, name);
    gst_pad_add_probe(pad, GST_PAD_PROBE_TYPE_BUFFER, probe, &watch, nullptr);
    gst_object_unref(pad);
  }
  const auto frames = static_cast<int64_t>(options.seconds * options.rate);
  watch.in_element.reserve(size_t(frames));
  watch.after_capture.reserve(size_t(frames));
  std::vector<double> resident;
  double cpu = 0;
  guint64 most_waiting = 0;
  int64_t pushed = 0;
  std::string failure;
  {
    Source source(options, pipeline);
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
    if (!options.unpaced) {
      // A live pipeline plays at once and has its clock then; its screen waits for the first frame.
      watch.base_time = gst_element_get_base_time(pipeline);
      watch.clock = gst_pipeline_get_clock(GST_PIPELINE(pipeline));
    }
    cpu = cpu_seconds();
    while (pushed < frames && failure.empty() && source.push(pushed)) {
      ++pushed;
      failure = error_of(pipeline, 0);
      if (pushed % options.rate != 0) continue;
      resident.push_back(megabytes_of("VmRSS"));
      if (isatty(STDERR_FILENO))
        std::fprintf(stderr, "\r%lld of %lld frames", (long long)pushed, (long long)frames);
    }
    source.end();
    if (failure.empty()) failure = error_of(pipeline, 120 * GST_SECOND);
    cpu = cpu_seconds() - cpu;
    most_waiting = source.most_waiting();
  }
  if (isatty(STDERR_FILENO)) std::fprintf(stderr, "\r%*s\r", 40, "");
  GstElement* screen = named(pipeline, "screen");
  GstStructure* stats = nullptr;
  g_object_get(screen, "stats", &stats, nullptr);

  const double window_megabytes = 3.0 * options.width * options.height * options.window / 1e6;
  const double limit = 1.3 * window_megabytes + 150;
  const auto frame_line = [](const char* what, const std::vector<double>& values) {
    std::printf("%s_ms p50 %.2f p99 %.2f max %.2f\n", what, quantile(values, 0.5),
                quantile(values, 0.99), quantile(values, 1));
  };
  std::printf("stream %dx%d %d f/s %s, mode=%s window-size=%d, %s\n", options.width, options.height,
              options.rate, options.output.c_str(), options.mode.c_str(), options.window,
              options.unpaced ? "unpaced" : "real time");
  std::printf("frames in %lld out %llu rendered %llu dropped %llu\n", (long long)pushed,
              (unsigned long long)watch.frames_out, (unsigned long long)counter(stats, "rendered"),
              (unsigned long long)counter(stats, "dropped"));
  if (!options.unpaced)
    std::printf("waiting_before_element most %llu\n", (unsigned long long)most_waiting);
  if (options.mode == "live") frame_line("in_element", watch.in_element);
  if (!options.times.empty()) {
    std::ofstream file(options.times);
    for (const double time : watch.in_element) file << time << '\n';
  }
  // Capture to the screen's door. A screen that follows a source without latency would drop what is
  // above its processing-deadline and max-lateness.
  if (!watch.after_capture.empty() && options.mode == "live") {
    frame_line("after_capture", watch.after_capture);
    // Without the start, which takes most of the memory.
    const auto start = static_cast<size_t>(2 * options.rate);
    if (watch.after_capture.size() > start)
      frame_line("after_two_seconds",
                 {watch.after_capture.begin() + ptrdiff_t(start), watch.after_capture.end()});
  }
  std::printf("cpu_ms_per_frame %.2f\n", 1e3 * cpu / double(std::max<int64_t>(1, pushed)));
  if (resident.size() >= 4) {
    // The window has filled up by then.
    const size_t full =
        std::min(resident.size() / 2, size_t(2 * options.window / options.rate + 1));
    const std::vector<double> later(resident.begin() + ptrdiff_t(full), resident.end());
    std::printf("resident_mb first_full %.1f last %.1f least %.1f most %.1f\n", later.front(),
                later.back(), quantile(later, 0), quantile(later, 1));
  }
  std::printf("peak_mb %.1f limit %.1f window %.1f\n", megabytes_of("VmHWM"), limit,
              window_megabytes);

  gst_structure_free(stats);
  gst_element_set_state(pipeline, GST_STATE_NULL);
  if (watch.clock) gst_object_unref(watch.clock);
  gst_object_unref(screen);
  gst_object_unref(separator);
  gst_object_unref(pipeline);
  if (!failure.empty()) {
    std::fprintf(stderr, "%s\n", failure.c_str());
    return 1;
  }
  if (watch.frames_out == static_cast<uint64_t>(pushed) && pushed == frames) return 0;
  std::fprintf(stderr, "%lld frames of %lld came out\n", (long long)watch.frames_out,
               (long long)frames);
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("qdmdbackground between a camera in real time and a screen that drops late frames");
  app.add_option("--seconds", options.seconds, "length of the stream")->capture_default_str();
  app.add_option("--width", options.width, "pixels")->capture_default_str();
  app.add_option("--height", options.height, "pixels")->capture_default_str();
  app.add_option("--rate", options.rate, "frames a second")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--mode", options.mode, "mode")
      ->check(CLI::IsMember({"live", "batch"}))
      ->capture_default_str();
  app.add_option("--output", options.output, "output")->capture_default_str();
  app.add_option("--window-size", options.window, "window-size")->capture_default_str();
  app.add_option("--hop-size", options.hop, "hop-size, in live mode")->capture_default_str();
  app.add_option("--n-threads", options.threads, "n-threads")->capture_default_str();
  app.add_option("--method", options.method, "method")
      ->check(CLI::IsMember({"robust", "qdmd", "dmd"}))
      ->capture_default_str();
  app.add_option("--properties", options.extra, "more properties, as in gst-launch-1.0");
  app.add_option("--times", options.times, "a file for the milliseconds of each frame");
  app.add_flag("--unpaced", options.unpaced, "frames as fast as they are taken");
  app.add_flag("--short", options.brief, "3 seconds of 320x240");
  CLI11_PARSE(app, argc, argv);
  if (options.brief) {
    options.seconds = 3;
    options.width = 320, options.height = 240;
    options.window = 20, options.hop = 5;
  }
  gst_init(nullptr, nullptr);
  GError* error = nullptr;
  if (!gst_plugin_load_file(QDMD_PLUGIN, &error)) {
    std::fprintf(stderr, "%s: %s\n", QDMD_PLUGIN, error->message);
    return 1;
  }
  return run(options);
}
