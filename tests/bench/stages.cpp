// SPDX-License-Identifier: LGPL-2.1-or-later
// Where the time of a batch goes: a whole window through the engine's steps, each timed by itself,
// in milliseconds for a frame. The engine runs the same steps, but the Gram matrix beside frames.
#include <benchmark/benchmark.h>

#include <array>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "core/engine/background.h"
#include "core/engine/engine.h"
#include "tests/bench/camera.h"
#include "tests/bench/clock.h"

namespace {

using namespace qdmd;
using namespace qdmd::bench;

// As the engine does it.
constexpr int kGroup = 16;  // frames that enter the Gram matrix together
constexpr size_t kPixelsPerBand = 32768;

struct Case {
  Method method;
  int width, height, window, threads;

  // The options of a user who sets no more than that.
  EngineOptions options() const {
    EngineOptions options;
    options.method = method;
    options.window_size = window;
    options.threads = threads;
    options.max_memory = UINT64_MAX;
    return options;
  }
};

template <typename Byte>
BasicImageView<Byte> view_of(const Case& c, Byte* rgba) {
  BasicImageView<Byte> view;
  for (int i = 0; i < kChannels; ++i) view.channel[i] = rgba + i;
  view.alpha = rgba + 3;
  view.width = c.width, view.height = c.height;
  view.pixel_stride = 4, view.row_stride = 4 * ptrdiff_t{c.width};
  return view;
}

constexpr const char* kStages[] = {"conversion",  "Gram",       "solve",
                                   "combination", "statistics", "output"};
using StageTimes = std::array<double, std::size(kStages)>;  // seconds for a window

class Batch {
 public:
  explicit Batch(const Case& c)
      : c_(c),
        camera_(c.width, c.height, 4),
        in_(camera_.frame_bytes()),
        out_(camera_.frame_bytes()),
        pool_(c.threads),
        background_(Learner::make(c.options(), c.width, c.height),
                    {&frames_, c.window, Models::one, &pool_, &clock_}) {}

  StageTimes run() {
    // One thread's time is what it computed, because others may use the machine.
    const clockid_t clock = c_.threads == 1 ? CLOCK_THREAD_CPUTIME_ID : CLOCK_MONOTONIC;
    const auto took = [clock](auto&& work) { return seconds_of(work, clock); };
    frames_.clear();
    StageTimes times{};
    auto& [conversion, gram, solve, combination, statistics, output] = times;
    for (int t = 0, fresh = 0; t < c_.window; ++t) {
      camera_.render(t, in_.data());
      conversion += took([&] { append_frame(); });
      if (++fresh < kGroup && t + 1 < c_.window) continue;
      gram +=
          took([&] { background_.learner().add(frames_.window(), std::exchange(fresh, 0), {}); });
    }
    solve = took([&] { background_.begin(frames_.window()); });
    combination = took([&] { background_.build({}); });
    statistics = took([&] {
      background_.finish({});
      background_.publish();
    });
    for (int t = 0; t < c_.window; ++t) output += took([&] { write(t); });
    return times;
  }
  const SolveReport& report() const { return background_.report(); }

 private:
  void append_frame() { frames_.append(view_of(c_, std::as_const(in_).data())); }

  void write(int t) {
    BackgroundModel& model = background_.model();
    model.set_time(t);
    const Window& window = frames_.window();
    const int slot = frames_.slot(t);
    const PlaneRows x(window.picture(slot), nullptr);
    const OutputTask task = {{x.plane(0), x.plane(1), x.plane(2)},
                             &model,
                             Output::mask,
                             background_.decision().mask(),
                             nullptr,
                             nullptr,
                             255};
    background_.decide(x, &pool_);
    const auto bands = static_cast<int>(std::max<size_t>(1, window.pixels() / kPixelsPerBand));
    for_bands(pool_, c_.height, bands, [&](int first, int count, size_t) {
      write_picture(task, {}, view_of(c_, out_.data()), first, count);
    });
    benchmark::ClobberMemory();
  }

  Case c_;
  Camera camera_;
  std::vector<uint8_t> in_, out_;
  Pool pool_;
  Clock clock_;
  FrameStore frames_{c_.window, c_.width, c_.height,
                     Learner::make(c_.options(), c_.width, c_.height)->contents()};
  Background background_;
};

void stages(benchmark::State& state, const Case& c) {
  Batch batch(c);
  // Memory is touched for the first time.
  batch.run();
  std::array<std::vector<double>, std::size(kStages)> times;
  std::vector<double> totals;
  for (auto _ : state) {
    const StageTimes taken = batch.run();
    for (size_t i = 0; i < taken.size(); ++i) times[i].push_back(taken[i]);
    totals.push_back(std::accumulate(taken.begin(), taken.end(), 0.0));
    state.SetIterationTime(totals.back());
    if (batch.report().dmd.background_modes == 0) state.SkipWithError("there is no background");
  }
  for (size_t i = 0; i < times.size(); ++i)
    state.counters[std::string("ms/") + kStages[i]] = 1e3 * median(times[i]) / c.window;
  state.counters["ms/total"] = 1e3 * median(totals) / c.window;
}

}  // namespace

int main(int argc, char** argv) {
  const int turns = turns_asked_for();
  std::vector<Case> cases;
  // The default first. The plain method keeps the name that docs/performance.md goes by.
  for (Method method : {EngineOptions().method, Method::qdmd}) {
    cases.push_back({method, 160, 120, 25, 1});
    for (int threads : {1, 2}) {
      for (auto [width, height] : {std::pair{320, 240}, {640, 480}, {1280, 720}, {1920, 1080}})
        cases.push_back({method, width, height, 100, threads});
      for (int window : {25, 50, 200, 400}) cases.push_back({method, 320, 240, window, threads});
      cases.push_back({method, 768, 576, 200, threads});
      cases.push_back({method, 1920, 1080, 60, threads});
    }
  }
  for (const Case& c : cases)
    benchmark::RegisterBenchmark(
        ((c.method == Method::qdmd ? "stages/" : "stages/robust/") + std::to_string(c.width) + "x" +
         std::to_string(c.height) + "/window:" + std::to_string(c.window) +
         "/threads:" + std::to_string(c.threads))
            .c_str(),
        [c](benchmark::State& state) { stages(state, c); })
        ->Unit(benchmark::kMillisecond)
        ->Iterations(turns)
        ->UseManualTime();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
