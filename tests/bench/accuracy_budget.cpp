// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/bench/accuracy_budget.h"

#include <gst/check/gstharness.h>

#include <atomic>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>
#include <thread>

#include "core/metrics/picture_scores.h"
#include "tests/bench/accuracy_quality.h"
#include "tests/bench/clock.h"
#include "tests/evaluation/clip.h"

namespace qdmd::bench {
namespace {

using evaluation::view_of;

constexpr int kThreads = 2;
// Every k-th background is scored: enough, and less than the frames take.
constexpr size_t kScored = 10;

// Busy threads, as many as the element has.
class Load {
 public:
  Load() {
    for (int i = 0; i < kThreads; ++i)
      threads_.emplace_back([this] {
        while (!stop_.load(std::memory_order_relaxed)) {
        }
      });
  }
  ~Load() {
    stop_ = true;
    for (auto& thread : threads_) thread.join();
  }
  Load(const Load&) = delete;
  Load& operator=(const Load&) = delete;

 private:
  std::atomic<bool> stop_ = false;
  std::vector<std::thread> threads_;
};

using Harness = std::unique_ptr<GstHarness, void (*)(GstHarness*)>;

Harness harness_of(const std::string& mode, double budget, int window, cv::Size size) {
  Harness harness(gst_harness_new_parse(("qdmdbackground output=background mode=" + mode +
                                         " window-size=" + std::to_string(window) +
                                         " n-threads=" + std::to_string(kThreads) +
                                         " time-budget=" + std::to_string(budget))
                                            .c_str()),
                  gst_harness_teardown);
  gst_harness_set_src_caps_str(
      harness.get(), ("video/x-raw,format=BGR,framerate=25/1,width=" + std::to_string(size.width) +
                      ",height=" + std::to_string(size.height))
                         .c_str());
  gst_harness_play(harness.get());
  return harness;
}

// Rows of BGR are padded to multiples of 4 bytes.
gsize stride_of(const cv::Mat& frame) { return (static_cast<gsize>(frame.cols) * 3 + 3) / 4 * 4; }

GstBuffer* buffer_of(const cv::Mat& frame, size_t index) {
  const gsize stride = stride_of(frame);
  GstBuffer* const buffer =
      gst_buffer_new_allocate(nullptr, stride * static_cast<gsize>(frame.rows), nullptr);
  for (int row = 0; row < frame.rows; ++row)
    gst_buffer_fill(buffer, stride * static_cast<gsize>(row), frame.ptr(row),
                    static_cast<gsize>(frame.cols) * 3);
  GST_BUFFER_PTS(buffer) = index * 40 * GST_MSECOND;
  GST_BUFFER_DURATION(buffer) = 40 * GST_MSECOND;
  return buffer;
}

double error_of(GstBuffer* buffer, const cv::Mat& truth) {
  GstMapInfo map;
  if (!gst_buffer_map(buffer, &map, GST_MAP_READ))
    throw std::runtime_error("a buffer cannot be read");
  const cv::Mat found(truth.size(), CV_8UC3, map.data, stride_of(truth));
  const double error = average_grey_error(luma(view_of(found)), luma(view_of(truth)));
  gst_buffer_unmap(buffer, &map);
  return error;
}

// What the budget came to.
Values effort_of(GstElement* element) {
  GstStructure* stats = nullptr;
  g_object_get(element, "stats", &stats, nullptr);
  const auto number = [stats](const char* name) {
    guint value = 0;
    gst_structure_get_uint(stats, name, &value);
    return static_cast<double>(value);
  };
  Values found = {{"found_period", number("solve-period")},
                  {"found_step", number("sample-step")},
                  {"found_iterations", number("iterations")}};
  gst_structure_free(stats);
  return found;
}

// What the element was at, on the way through the clip.
struct Outcome {
  std::vector<double> seconds;  // of each frame pushed, with the frames that came out with it
  std::vector<double> errors;   // AGE, of some frames
  std::vector<Values> efforts;  // at the end of each window

  // Milliseconds a frame of frames first .. last - 1.
  double mean(size_t first, size_t last) const {
    double sum = 0;
    for (size_t t = first; t < last; ++t) sum += seconds[t];
    return 1e3 * sum / static_cast<double>(last - first);
  }
};

// loaded_from: the frame with which the load begins.
Outcome run(const TrueClip& clip, const std::string& mode, double budget, int window,
            std::optional<size_t> loaded_from) {
  const Harness harness = harness_of(mode, budget, window, clip.frames[0].size());
  std::optional<Load> load;
  Outcome outcome;
  const std::unique_ptr<GstElement, void (*)(gpointer)> element(
      gst_harness_find_element(harness.get(), "qdmdbackground"), gst_object_unref);
  size_t received = 0;
  const auto take = [&] {
    while (GstBuffer* const picture = gst_harness_try_pull(harness.get())) {
      if (received % kScored == 0)
        outcome.errors.push_back(error_of(picture, clip.truths[received]));
      gst_buffer_unref(picture);
      ++received;
    }
  };
  for (size_t t = 0; t < clip.frames.size(); ++t) {
    if (t == loaded_from) load.emplace();
    GstBuffer* const buffer = buffer_of(clip.frames[t], t);
    outcome.seconds.push_back(seconds_of([&] {
      if (gst_harness_push(harness.get(), buffer) != GST_FLOW_OK)
        throw std::runtime_error("qdmdbackground refuses a frame");
    }));
    take();
    if ((t + 1) % static_cast<size_t>(window) == 0)
      outcome.efforts.push_back(effort_of(element.get()));
  }
  load.reset();
  gst_harness_push_event(harness.get(), gst_event_new_eos());
  take();
  if (received != clip.frames.size()) throw std::runtime_error("qdmdbackground has lost frames");
  return outcome;
}

void measure(const TrueClip& clip, const std::string& mode, double budget, int window, bool loaded,
             Table* table) {
  const cv::Size size = clip.frames[0].size();
  const Point point{"budget",
                    mode + (loaded ? "; load" : ""),
                    clip.name + "; " + std::to_string(static_cast<int>(budget)) + " ms",
                    "robust",
                    "gram",
                    0,
                    0,
                    window,
                    1,
                    size.width,
                    size.height};
  if (table->has(point)) return;
  const auto of_window = static_cast<size_t>(window);
  const size_t frames = clip.frames.size(), half = frames / 2 / of_window * of_window;
  const Outcome outcome =
      run(clip, mode, budget, window, loaded ? std::optional(half) : std::nullopt);
  Values values = outcome.efforts.back();
  // The first two windows find out.
  values["changes"] = 0;
  for (size_t w = 2; w < outcome.efforts.size(); ++w)
    values["changes"] += outcome.efforts[w] != outcome.efforts[w - 1];
  values["budget_ms"] = budget;
  values["ms"] = outcome.mean(0, frames);
  values["before_ms"] = outcome.mean(0, half);
  values["first_ms"] = outcome.mean(half, half + 2 * of_window);
  values["after_ms"] = outcome.mean(half + 2 * of_window, frames);
  double sum = 0;
  for (double error : outcome.errors) sum += error;
  values["age"] = sum / static_cast<double>(outcome.errors.size());
  table->add(point, values);
}

}  // namespace

void add_budgets(bool brief, Table* table, Steps* steps) {
  gst_init(nullptr, nullptr);
  if (!gst_plugin_load_file(QDMD_PLUGIN, nullptr))
    throw std::runtime_error("cannot load " QDMD_PLUGIN);
  const int window = brief ? 10 : 100;
  const auto add = [&](const std::string& scene, const std::string& mode, bool loaded,
                       const std::shared_ptr<TrueClip>& clip) {
    // 0: no limit.
    for (const double budget : {0.0, 2.0, 5.0, 20.0})
      steps->push_back({"budget: " + scene + ", " + mode + (loaded ? ", under load" : ""), [=] {
                          // Rendered with the first step that needs it.
                          if (clip->frames.empty())
                            *clip = brief ? simulated(scene, 96, 72, 60)
                                          : simulated(scene, 768, 576, 1200);
                          measure(*clip, mode, budget, window, loaded, table);
                        }});
  };
  // Things that stay become background: an old one is wrong. A light that changes is followed by an
  // old one, too.
  const auto things = std::make_shared<TrueClip>(), lights = std::make_shared<TrueClip>();
  for (const std::string mode : {"batch", "live"})
    for (const bool loaded : {false, true}) add("intermittent-motion", mode, loaded, things);
  steps->push_back({"budget: the next scene", [things] { *things = TrueClip(); }});
  add("illumination-changes", "batch", false, lights);
  steps->push_back({"budget: done", [lights] { *lights = TrueClip(); }});
}

}  // namespace qdmd::bench
