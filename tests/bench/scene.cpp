// SPDX-License-Identifier: LGPL-2.1-or-later
// What the effects of a scene cost in time per frame, each beside the scene without it.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <memory>
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

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// The default scene and the bare loop beside each other in memory of their own.
struct Pair {
  Scene scene;
  BareLoop bare;
  std::vector<double> with, without;  // seconds for kFramesAtOnce

  Pair(int width, int height) : scene(options(width, height), "default"), bare(width, height) {}
};

// Both in turn, so that they see the same machine: the ratio of their medians. Where buffers happen
// to lie moves a copy's time by some percent: several pairs, and the median of their ratios.
void default_against_bare_loop(benchmark::State& state) {
  constexpr int kPairs = 9;
  constexpr int64_t kFramesAtOnce = 20;
  const auto width = static_cast<int>(state.range(0)), height = static_cast<int>(state.range(1));
  std::vector<std::unique_ptr<Pair>> pairs;
  for (int i = 0; i < kPairs; ++i) pairs.push_back(std::make_unique<Pair>(width, height));
  const auto timed = [](auto&& work) {
    const auto begin = Clock::now();
    work();
    return std::chrono::duration<double>(Clock::now() - begin).count();
  };
  int64_t first = 0;
  for (auto _ : state) {
    Pair& pair = *pairs[static_cast<size_t>(first / kFramesAtOnce) % kPairs];
    const auto run_scene_frames = [&] {
      for (int64_t k = 0; k < kFramesAtOnce; ++k) {
        pair.scene.render(first + k, kFrame);
        benchmark::DoNotOptimize(pair.scene.frame().samples.data());
      }
    };
    const auto run_bare_frames = [&] {
      for (int64_t k = 0; k < kFramesAtOnce; ++k)
        benchmark::DoNotOptimize(pair.bare.frame(first + k).samples.data());
    };
    // Once untimed: the pair's memory comes into the cache.
    run_bare_frames();
    run_scene_frames();
    // Whoever comes second finds other caches: they take turns.
    if (pair.with.size() % 2 == 0) {
      pair.with.push_back(timed(run_scene_frames));
      pair.without.push_back(timed(run_bare_frames));
    } else {
      pair.without.push_back(timed(run_bare_frames));
      pair.with.push_back(timed(run_scene_frames));
    }
    first += kFramesAtOnce;
  }
  std::vector<double> ratios;
  for (const auto& pair : pairs) {
    if (!pair->with.empty()) ratios.push_back(median(pair->with) / median(pair->without));
    pair->scene.render(60, kFrame);
    if (pair->scene.frame().samples != pair->bare.frame(60).samples)
      state.SkipWithError("the bare loop paints another picture");
  }
  state.counters["ratio"] = median(ratios);
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
