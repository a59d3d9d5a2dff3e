// What the effects of a scene cost in time per frame, each beside the scene without it.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <string>

#include "core/scene/paint.h"
#include "core/scene/scene.h"

namespace {

using namespace qdmd::scene;
using Clock = std::chrono::steady_clock;

constexpr int kSecondsOfScene = 8;

SceneOptions options(int width, int height) {
  SceneOptions result;
  result.width = width;
  result.height = height;
  return result;
}

// The whole of what the default scene has to do: the background's picture, and the mover on it.
class BareLoop {
 public:
  BareLoop(int width, int height)
      : backdrop_(width, height, 0, StreamSource(0, "backdrop")),
        mover_(width, height, 0, StreamSource(0, "mover"), {}) {}

  const Picture& frame(int64_t index) {
    picture_ = backdrop_.picture();
    placements_.clear();
    mover_.place(static_cast<double>(index) / 25, &placements_);
    for (const Placement& p : placements_) paint_sprite(*p.sprite, p.x, p.y, &picture_);
    return picture_;
  }

 private:
  Backdrop backdrop_;
  Crossing mover_;
  Picture picture_;
  std::vector<Placement> placements_;
};

void run_scene(benchmark::State& state, const std::string& text, unsigned wanted) {
  const auto width = static_cast<int>(state.range(0)), height = static_cast<int>(state.range(1));
  Scene scene(options(width, height), text);
  int64_t index = 0;
  for (auto _ : state) {
    scene.render(index, wanted);
    benchmark::DoNotOptimize(scene.frame().samples.data());
    index = (index + 1) % (25 * kSecondsOfScene);
  }
  state.SetItemsProcessed(state.iterations());
}

// The default scene and the bare loop in turn, so that both see the same machine: the ratio of
// their medians.
void default_against_bare_loop(benchmark::State& state) {
  const auto width = static_cast<int>(state.range(0)), height = static_cast<int>(state.range(1));
  Scene scene(options(width, height), "default");
  BareLoop bare(width, height);
  std::vector<double> with, without;
  const auto timed = [](auto&& work) {
    const auto begin = Clock::now();
    work();
    return std::chrono::duration<double>(Clock::now() - begin).count();
  };
  int64_t index = 0;
  for (auto _ : state) {
    const int64_t first = index;
    // Whoever comes second finds other caches: they take turns.
    const auto run_scene_frames = [&] {
      for (int64_t k = 0; k < 20; ++k) {
        scene.render(first + k, kFrame);
        benchmark::DoNotOptimize(scene.frame().samples.data());
      }
    };
    const auto run_bare_frames = [&] {
      for (int64_t k = 0; k < 20; ++k)
        benchmark::DoNotOptimize(bare.frame(first + k).samples.data());
    };
    if (index / 20 % 2 == 0) {
      with.push_back(timed(run_scene_frames));
      without.push_back(timed(run_bare_frames));
    } else {
      without.push_back(timed(run_bare_frames));
      with.push_back(timed(run_scene_frames));
    }
    index += 20;
  }
  const auto median = [](std::vector<double>& times) {
    std::nth_element(times.begin(), times.begin() + static_cast<ptrdiff_t>(times.size() / 2),
                     times.end());
    return times[times.size() / 2];
  };
  scene.render(60, kFrame);
  if (scene.frame().samples != bare.frame(60).samples)
    state.SkipWithError("the bare loop paints another picture");
  state.counters["ratio"] = median(with) / median(without);
}

void add(const std::string& name, const std::string& text, unsigned wanted) {
  benchmark::RegisterBenchmark(
      name.c_str(), [text, wanted](benchmark::State& state) { run_scene(state, text, wanted); })
      ->ArgNames({"width", "height"})
      ->Args({320, 240})
      ->Args({768, 576})
      ->Unit(benchmark::kMicrosecond);
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::RegisterBenchmark("default_against_bare_loop", default_against_bare_loop)
      ->ArgNames({"width", "height"})
      ->Args({320, 240})
      ->Args({768, 576})
      ->MinTime(0.5)
      ->Unit(benchmark::kMicrosecond);
  add("default", "", kFrame);
  add("default_with_truth", "", kFrame | kTruth | kLabels | kBoxes);
  for (const EffectInfo* info : effects()) add(info->name, info->name, kFrame);
  for (const Preset& preset : presets())
    if (*preset.effects) add(preset.name, preset.effects, kFrame);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
