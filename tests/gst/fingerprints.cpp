// SPDX-License-Identifier: LGPL-2.1-or-later
// Prints a hash of what qdmdbackground gives under many settings, a line each: run it with the
// plugins of two builds, and `diff` tells which pictures a change has moved by a bit.
//
//   GST_PLUGIN_PATH=build/gst QDMD_DATA=../shared/data build/tests/gst/fingerprints > after.txt
//
// Simulated streams, and, where QDMD_DATA names the folder of real sequences, these. Hashes hold
// for one kind of processor: some sums are of floating point.
#include <gst/check/gstharness.h>
#include <gst/controller/controller.h>
#include <gst/video/video.h>

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <string>
#include <vector>

namespace {

// FNV-1a.
class Hash {
 public:
  void add(const uint8_t* bytes, size_t count) {
    for (size_t i = 0; i < count; ++i) value_ = (value_ ^ bytes[i]) * 0x100000001b3u;
  }
  template <typename T>
  void add_value(T value) {
    add(reinterpret_cast<const uint8_t*>(&value), sizeof(value));
  }
  uint64_t value() const { return value_; }

 private:
  uint64_t value_ = 0xcbf29ce484222325u;
};

// R, G, B and alpha of each pixel, in row order.
struct RgbaClip {
  std::string name;
  int width, height;
  std::vector<std::vector<uint8_t>> frames;
};

// A textured scene under noise, with boxes that move, one that stops, and light that changes.
RgbaClip simulated(const std::string& name, int width, int height, int count, bool light) {
  RgbaClip clip{name, width, height, {}};
  std::mt19937 rng(7);
  std::vector<uint8_t> scene(static_cast<size_t>(3 * width * height));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c)
        scene[static_cast<size_t>(3 * (y * width + x) + c)] = static_cast<uint8_t>(
            50 + (7 * x / 5 + 3 * y * (c + 1) / 4) % 90 + static_cast<int>(rng() % 12));
  for (int t = 0; t < count; ++t) {
    std::vector<uint8_t> frame(static_cast<size_t>(4 * width * height));
    const double gain = light && t > count / 2 ? 1.4 : light && t > count / 4 ? 0.75 : 1.0;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const int left = 5 * t % (width + 40) - 40, stops = std::min(3 * t, width / 2);
        const bool mover = x >= left && x < left + width / 8 && y > height / 3 && y < height / 2;
        const bool stopper =
            t > 10 && x >= stops && x < stops + width / 10 && y > height / 2 && y < height - 4;
        for (int c = 0; c < 3; ++c) {
          int level = scene[static_cast<size_t>(3 * (y * width + x) + c)];
          if (mover) level = 230 - 60 * c;
          if (stopper) level = 20 + 40 * c;
          level = static_cast<int>(level * gain) + static_cast<int>(rng() % 7) - 3;
          frame[static_cast<size_t>(4 * (y * width + x) + c)] =
              static_cast<uint8_t>(std::clamp(level, 0, 255));
        }
        frame[static_cast<size_t>(4 * (y * width + x) + 3)] = static_cast<uint8_t>(200 + x % 50);
      }
    clip.frames.push_back(std::move(frame));
  }
  return clip;
}

RgbaClip read_clip(const std::filesystem::path& folder, size_t most) {
  RgbaClip clip{folder.parent_path().filename().string(), 0, 0, {}};
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry);
  std::sort(files.begin(), files.end());
  if (files.size() > most) files.resize(most);
  for (const auto& file : files) {
    const cv::Mat picture = cv::imread(file.string());
    if (picture.empty()) continue;
    clip.width = picture.cols;
    clip.height = picture.rows;
    std::vector<uint8_t> frame;
    for (int y = 0; y < picture.rows; ++y)
      for (int x = 0; x < picture.cols; ++x) {
        const cv::Vec3b bgr = picture.at<cv::Vec3b>(y, x);
        frame.insert(frame.end(), {bgr[2], bgr[1], bgr[0], 255});
      }
    clip.frames.push_back(std::move(frame));
  }
  return clip;
}

enum class Script { plain, freeze, breaks };

class Run {
 public:
  Run(const RgbaClip& clip, GstVideoFormat format, const std::string& properties, int output_period)
      : clip_(clip),
        period_(output_period),
        harness_(gst_harness_new_parse(("qdmdbackground " + properties).c_str())),
        element_(gst_harness_find_element(harness_, "qdmdbackground")) {
    set_caps(format, clip.width, clip.height);
  }
  ~Run() {
    gst_object_unref(element_);
    gst_harness_teardown(harness_);
  }

  void stream(Script script) {
    const int count = static_cast<int>(clip_.frames.size());
    if (period_ > 0) control_output(count);
    for (int t = 0; t < count; ++t) {
      const int at = 100 * t / count, before = t == 0 ? -1 : 100 * (t - 1) / count;
      const auto reaches = [&](int mark) { return at >= mark && before < mark; };
      if (script == Script::freeze) {
        if (reaches(30)) set("freeze", "true");
        if (reaches(55)) set("freeze", "false");
        if (reaches(70)) set("freeze", "true");
        if (reaches(73)) set("freeze", "false");
      }
      if (script == Script::breaks && reaches(75)) {
        gst_harness_push_event(harness_, gst_event_new_flush_start());
        gst_harness_push_event(harness_, gst_event_new_flush_stop(FALSE));
        GstSegment segment;
        gst_segment_init(&segment, GST_FORMAT_TIME);
        gst_harness_push_event(harness_, gst_event_new_segment(&segment));
      }
      GstBuffer* buffer = make(t);
      if (script == Script::breaks && (reaches(20) || reaches(47)))
        GST_BUFFER_FLAG_SET(buffer, GST_BUFFER_FLAG_DISCONT);
      if (gst_harness_push(harness_, buffer) != GST_FLOW_OK) std::printf("FLOW ");
      take();
    }
    gst_harness_push_event(harness_, gst_event_new_eos());
    take();
  }

  void print(const std::string& name) {
    GstStructure* stats = nullptr;
    g_object_get(element_, "stats", &stats, nullptr);
    Hash facts;
    for (const char* field :
         {"omega", "residual", "condition", "noise", "foreground-threshold", "foreground-ratio"}) {
      double value = 0;
      gst_structure_get_double(stats, field, &value);
      facts.add_value(value);
    }
    guint64 solves = 0;
    gst_structure_get_uint64(stats, "solves", &solves);
    gst_structure_free(stats);
    std::printf("%016" PRIx64 " %016" PRIx64 " %4d frames %3d solves  %s\n", pictures_.value(),
                facts.value(), taken_, static_cast<int>(solves), name.c_str());
    std::fflush(stdout);
  }

 private:
  // Each frame has the output of its own time, whenever it leaves.
  void control_output(int count) {
    constexpr int kOutputs[] = {0, 2, 1, 3};  // background, mask, foreground, cutout
    GstControlSource* source = gst_interpolation_control_source_new();
    g_object_set(source, "mode", GST_INTERPOLATION_MODE_NONE, nullptr);
    for (int t = 0; t < count; ++t)
      gst_timed_value_control_source_set(GST_TIMED_VALUE_CONTROL_SOURCE(source),
                                         static_cast<GstClockTime>(t) * GST_SECOND / 25,
                                         kOutputs[t / period_ % 4]);
    gst_object_add_control_binding(
        GST_OBJECT(element_),
        gst_direct_control_binding_new_absolute(GST_OBJECT(element_), "output", source));
    gst_object_unref(source);
  }
  void set(const char* property, const char* value) {
    gst_util_set_object_arg(G_OBJECT(element_), property, value);
  }
  void set_caps(GstVideoFormat format, int width, int height) {
    gst_video_info_set_format(&info_, format, static_cast<guint>(width),
                              static_cast<guint>(height));
    info_.fps_n = 25;
    info_.fps_d = 1;
    gst_harness_set_src_caps(harness_, gst_video_info_to_caps(&info_));
  }
  GstBuffer* make(int t) {
    GstBuffer* buffer = gst_buffer_new_allocate(nullptr, info_.size, nullptr);
    gst_buffer_memset(buffer, 0, 0, info_.size);
    GST_BUFFER_PTS(buffer) = static_cast<GstClockTime>(t) * GST_SECOND / 25;
    GST_BUFFER_DURATION(buffer) = GST_SECOND / 25;
    GstVideoFrame frame;
    gst_video_frame_map(&frame, &info_, buffer, GST_MAP_WRITE);
    const auto* from = clip_.frames[static_cast<size_t>(t)].data();
    const auto components = static_cast<int>(GST_VIDEO_FRAME_N_COMPONENTS(&frame));
    for (int c = 0; c < components; ++c) {
      auto* to = static_cast<uint8_t*>(GST_VIDEO_FRAME_COMP_DATA(&frame, c));
      const int step = GST_VIDEO_FRAME_COMP_PSTRIDE(&frame, c);
      const int columns = 1 << GST_VIDEO_FORMAT_INFO_W_SUB(info_.finfo, c);
      const int rows = 1 << GST_VIDEO_FORMAT_INFO_H_SUB(info_.finfo, c);
      for (int y = 0; y < GST_VIDEO_FRAME_COMP_HEIGHT(&frame, c); ++y)
        for (int x = 0; x < GST_VIDEO_FRAME_COMP_WIDTH(&frame, c); ++x)
          to[y * GST_VIDEO_FRAME_COMP_STRIDE(&frame, c) + x * step] =
              from[4 * (y * rows * clip_.width + x * columns) + c];
    }
    gst_video_frame_unmap(&frame);
    return buffer;
  }
  void take() {
    while (GstBuffer* buffer = gst_harness_try_pull(harness_)) {
      GstVideoFrame frame;
      gst_video_frame_map(&frame, &info_, buffer, GST_MAP_READ);
      for (guint c = 0; c < GST_VIDEO_FRAME_N_COMPONENTS(&frame); ++c) {
        const auto* from = static_cast<const uint8_t*>(GST_VIDEO_FRAME_COMP_DATA(&frame, c));
        for (int y = 0; y < GST_VIDEO_FRAME_COMP_HEIGHT(&frame, c); ++y)
          for (int x = 0; x < GST_VIDEO_FRAME_COMP_WIDTH(&frame, c); ++x)
            pictures_.add(from + y * GST_VIDEO_FRAME_COMP_STRIDE(&frame, c) +
                              x * GST_VIDEO_FRAME_COMP_PSTRIDE(&frame, c),
                          1);
      }
      pictures_.add_value(GST_BUFFER_PTS(buffer));
      gst_video_frame_unmap(&frame);
      gst_buffer_unref(buffer);
      ++taken_;
    }
  }

  const RgbaClip& clip_;
  int period_, taken_ = 0;
  GstHarness* harness_;
  GstElement* element_;
  GstVideoInfo info_ = {};
  Hash pictures_;
};

// output_period: frames after which the next output is asked for; 0: as the properties say.
void print(const RgbaClip& clip, const std::string& properties, int output_period = 0,
           Script script = Script::plain, GstVideoFormat format = GST_VIDEO_FORMAT_RGB) {
  static constexpr const char* kScripts[] = {"", " freeze on and off", " breaks and a flush"};
  Run run(clip, format, properties, output_period);
  run.stream(script);
  run.print(clip.name + ", " + gst_video_format_to_string(format) +
            kScripts[static_cast<int>(script)] + ": " +
            (properties.empty() ? "defaults" : properties));
}

void print_simulated() {
  const RgbaClip small = simulated("small", 61, 47, 90, false);
  const RgbaClip medium = simulated("medium", 160, 120, 130, false);
  const RgbaClip lit = simulated("lit", 160, 120, 130, true);
  const RgbaClip large = simulated("large", 640, 360, 90, true);
  const RgbaClip thin = simulated("thin", 300, 1, 60, false);
  const std::string live = " mode=live";
  for (const RgbaClip* clip : {&medium, &lit})
    for (const char* mode : {"", " mode=live"}) {
      print(*clip, std::string("output=mask") + mode);
      print(*clip, std::string("") + mode);
    }
  for (const char* mode : {"mode=batch", "mode=live", "mode=live hop-size=3"})
    for (const char* window : {" window-size=2", " window-size=17", " window-size=40"})
      for (const char* method : {"robust", "qdmd", "dmd"})
        for (int threads : {1, 2, 5}) {
          const std::string properties = std::string(mode) + window + " method=" + method +
                                         " n-threads=" + std::to_string(threads);
          for (const RgbaClip* clip : {&lit, &small}) print(*clip, properties, 7);
        }
  for (const char* mode : {"mode=batch", "mode=live"})
    for (const char* method : {"robust", "qdmd", "dmd"})
      for (const char* more :
           {"rank=1", "rank=3", "rank=200", "omega-threshold=0.05", "omega-threshold=0.4 rank=12",
            "omega-threshold=10", "amplitude=first-frame", "sample-step=1", "sample-step=3",
            "sample-step=64", "iterations=3", "foreground-threshold=35",
            "iterations=2 sample-step=5 rank=2", "solver=gram-extended", "solver=qr"}) {
        const std::string properties =
            std::string(mode) + " window-size=20 method=" + method + " " + more;
        print(lit, properties, 5);
      }
  for (const char* mode : {"mode=batch", "mode=live hop-size=6"})
    for (const char* method : {"robust", "qdmd", "dmd"}) {
      for (const char* solver : {"gram", "gram-extended", "qr", "adjoint"})
        print(small, std::string(mode) + " window-size=12 method=" + method + " solver=" + solver,
              4);
      for (const Script script : {Script::freeze, Script::breaks})
        for (const char* more : {"", " omega-threshold=10", " n-threads=3", " sample-step=2"}) {
          print(lit, std::string(mode) + " window-size=15 method=" + method + more, 4, script);
          print(large, std::string(mode) + " window-size=30 method=" + method + more, 4, script);
        }
      for (GstVideoFormat format :
           {GST_VIDEO_FORMAT_RGBA, GST_VIDEO_FORMAT_BGRx, GST_VIDEO_FORMAT_ARGB,
            GST_VIDEO_FORMAT_GRAY8, GST_VIDEO_FORMAT_I420, GST_VIDEO_FORMAT_NV12,
            GST_VIDEO_FORMAT_GBR})
        for (const RgbaClip* clip : {&small, &medium})
          print(*clip, std::string(mode) + " window-size=16 method=" + method, 3, Script::plain,
                format);
      for (const char* more : {"", " n-threads=1", " omega-threshold=10", " sample-step=4"}) {
        print(large, std::string(mode) + " window-size=60 method=" + method + more, 5);
        print(thin, std::string(mode) + " window-size=25 method=" + method + more, 5);
      }
    }
}

void print_real(const std::filesystem::path& data) {
  std::vector<std::filesystem::path> folders;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(data))
    if (entry.is_directory() && entry.path().filename() == "input") folders.push_back(entry);
  std::sort(folders.begin(), folders.end());
  for (const auto& folder : folders) {
    const RgbaClip clip = read_clip(folder, 220);
    if (clip.frames.empty()) continue;
    for (const char* properties :
         {"", "output=mask", "mode=live", "mode=live output=mask", "method=qdmd",
          "method=qdmd output=mask mode=live", "method=dmd output=foreground window-size=50"})
      print(clip, properties);
    print(clip, "window-size=40 iterations=3", 10, Script::freeze, GST_VIDEO_FORMAT_I420);
    print(clip, "window-size=60 mode=live", 9, Script::breaks, GST_VIDEO_FORMAT_BGRA);
  }
}

}  // namespace

int main(int argc, char** argv) {
  gst_init(&argc, &argv);
  print_simulated();
  if (const char* data = std::getenv("QDMD_DATA")) print_real(data);
}
