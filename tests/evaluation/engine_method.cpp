// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/evaluation/engine_method.h"

#include <algorithm>
#include <stdexcept>

#include "core/engine/engine.h"
#include "tests/evaluation/background_taker.h"
#include "tests/evaluation/clip.h"

namespace qdmd::evaluation {

namespace {

// Properties that engine_options() reads, and `mode`, whose only value is the engine's batch mode.
constexpr const char* kKnown[] = {
    "window-size", "rank",        "omega-threshold", "amplitude", "solver", "foreground-threshold",
    "iterations",  "sample-step", "max-memory",      "n-threads", "mode",   "stabilize"};

EngineOptions engine_options(GstElement* element) {
  guint window_size = 0, rank = 0, threads = 0, iterations = 0, sample_step = 0;
  gint method = 0, amplitude = 0, solver = 0, stabilize = 0;
  guint64 max_memory = 0;
  EngineOptions options;
  g_object_get(element, "window-size", &window_size, "rank", &rank, "n-threads", &threads, "method",
               &method, "amplitude", &amplitude, "solver", &solver, "max-memory", &max_memory,
               "stabilize", &stabilize, "iterations", &iterations, "sample-step", &sample_step,
               "omega-threshold", &options.dmd.omega_threshold, "foreground-threshold",
               &options.foreground_threshold, nullptr);
  options.window_size = static_cast<int>(window_size);
  options.threads = static_cast<int>(threads);
  options.iterations = static_cast<int>(iterations);
  options.sample_step = static_cast<int>(sample_step);
  options.max_memory = max_memory;
  options.dmd.rank = static_cast<int>(rank);
  // The element's enums have the core's values.
  options.method = static_cast<qdmd::Method>(method);
  options.dmd.amplitude = static_cast<Amplitude>(amplitude);
  options.dmd.solver = static_cast<Solver>(solver);
  options.stabilize = static_cast<Stabilize>(stabilize);
  return options;
}

void require(const Status& status) {
  if (!status.ok()) throw std::runtime_error(status.message);
}

class EngineMethod : public Method {
 public:
  EngineMethod(const std::string& name, const ElementOptions& options)
      : Method(name), options_(options) {}

  Separation separate(const Task& task) const override {
    Separation result;
    BackgroundTaker backgrounds(task.picture, task.frames.size());
    const Stopwatch watch;
    run(task, Output::background, [&](const cv::Mat& picture) { backgrounds.take(picture); });
    result.seconds = watch.seconds();
    result.background = backgrounds.result();
    if (task.masks)
      run(task, Output::mask, [&](const cv::Mat& picture) {
        cv::Mat mask;
        cv::extractChannel(picture, mask, 0);
        result.masks.push_back(mask);
      });
    return result;
  }

 private:
  template <typename See>
  void run(const Task& task, Output output, See see) const {
    const Ref<GstElement> element = make_element();
    options_.apply(element.get(), name(), task.frames.size());
    Engine engine;
    const cv::Size size = task.frames[0].size();
    require(engine.configure(engine_options(element.get()), size.width, size.height));
    cv::Mat picture(size, CV_8UC3);
    const auto take = [&] {
      while (engine.next()) {
        engine.next()->pop(output, view_of(picture));
        see(picture);
      }
    };
    for (const cv::Mat& frame : task.frames) {
      require(engine.push(view_of(frame)));
      take();
    }
    require(engine.drain());
    take();
  }

  const ElementOptions options_;
};

}  // namespace

Methods engine_methods(const ElementOptions& options) {
  for (const auto& [name, value] : options.properties)
    if (std::none_of(std::begin(kKnown), std::end(kKnown),
                     [&, &set = name](const char* known) { return set == known; }))
      throw std::invalid_argument("the property '" + name + "' works in the element alone, not " +
                                  "with --in-process");
  Methods methods;
  for (const auto& name : element_methods())
    methods.push_back(std::make_unique<EngineMethod>(name, options));
  return methods;
}

}  // namespace qdmd::evaluation
