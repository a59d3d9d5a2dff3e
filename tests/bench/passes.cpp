// SPDX-License-Identifier: LGPL-2.1-or-later
// The streaming passes over pixels, each beside the time that memory alone needs for the bytes that
// it reads and writes: whether a pass is bound by memory or by arithmetic. One thread,
// and the time that it computed, because others may use the machine.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "core/foreground/decision.h"
#include "core/foreground/foreground.h"
#include "core/foreground/picture.h"
#include "core/passes/combine.h"
#include "core/passes/planes.h"
#include "core/passes/residual.h"
#include "core/planes/snapshot_range.h"
#include "tests/bench/camera.h"
#include "tests/bench/clock.h"

namespace {

using namespace qdmd;
using namespace qdmd::bench;

constexpr int kPictures = 4;  // of one quaternion mode

struct Size {
  int width, height, window;

  size_t pixels() const { return size_t(width) * size_t(height); }
};

template <typename Byte>
BasicImageView<Byte> view_of(const Size& size, Byte* rgba) {
  BasicImageView<Byte> view;
  for (int c = 0; c < kChannels; ++c) view.channel[c] = rgba + c;
  view.alpha = rgba + 3;
  view.width = size.width, view.height = size.height;
  view.pixel_stride = 4, view.row_stride = 4 * ptrdiff_t{size.width};
  return view;
}

// What the passes work on: a window of frames, packed frames that come and go as from a pool, and a
// model with the pictures of one mode. Each turn is another frame's.
struct Scene {
  static constexpr int kPool = 4;

  Size size;
  Window window;
  std::vector<uint8_t> in[kPool], out[kPool], levels;
  std::vector<float> pictures;
  std::vector<double> coefficients;
  BackgroundModel model, clean;
  Decision decision;
  Pool pool{1};
  int turn = 0;

  explicit Scene(const Size& size_)
      : size(size_),
        window(size.window, size.pixels()),
        levels(3 * size.pixels()),
        pictures(kPictures * size.pixels()),
        decision(size.width, size.height, Colours::rgb) {
    const Camera camera(size.width, size.height, 4);
    for (auto& frame : in) frame.resize(camera.frame_bytes());
    for (auto& frame : out) frame.resize(camera.frame_bytes());
    for (int t = 0; t < size.window; ++t) {
      camera.render(t, in[t % kPool].data());
      turn = window.append();
      split();
    }
    coefficients.assign(static_cast<size_t>(kPictures * kChannels * size.window),
                        1.0 / size.window);
    // The mean of all frames: as many pictures and weights as any mode has.
    QuaternionMatrixd mean(size.window, 1);
    for (int t = 0; t < size.window; ++t) mean.set(t, 0, Quaterniond(1.0 / size.window));
    TemporalModel temporal(size.window);
    temporal.add_mode(mean, {1.0, 0.0}, 0.0, Quaterniond(1.0));
    model.build(window, temporal);
    model.set_time(0);
    make_clean();
  }

  // What masks are made against: the median of the frames has no boxes.
  void make_clean() {
    std::vector<uint8_t> median[3];
    std::vector<uint8_t> seen(static_cast<size_t>(size.window));
    for (int c = 0; c < kChannels; ++c)
      for (size_t p = 0; p < size.pixels(); ++p) {
        for (int t = 0; t < size.window; ++t) seen[static_cast<size_t>(t)] = window.plane(t, c)[p];
        std::nth_element(seen.begin(), seen.begin() + size.window / 2, seen.end());
        median[c].push_back(seen[static_cast<size_t>(size.window / 2)]);
      }
    clean.make_room(size.pixels(), false);
    clean.freeze_as({8, {median[0], median[1], median[2]}, {}}, nullptr, size.pixels());
    clean.set_time(0);
  }

  uint8_t* plane(int c) { return window.plane(turn, c); }
  uint8_t* level(int c) { return levels.data() + static_cast<size_t>(c) * size.pixels(); }
  uint8_t* packed_in() { return in[turn % kPool].data(); }
  uint8_t* packed_out() { return out[turn % kPool].data(); }
  void decide() { decision.decide({{plane(0), plane(1), plane(2)}, &clean, 18}, nullptr); }
  void next() { turn = (turn + 1) % size.window; }

  void split() {
    uint8_t* const to[3] = {plane(0), plane(1), plane(2)};
    benchmark::DoNotOptimize(split_channels(view_of(size, std::as_const(in[turn % kPool]).data()),
                                            0, size.height, 255, to));
  }
};

// Made once for all passes of a size.
Scene& scene_of(const Size& size) {
  static std::unique_ptr<Scene> scene;
  if (!scene || scene->size.pixels() != size.pixels()) {
    scene.reset();
    scene = std::make_unique<Scene>(size);
  }
  return *scene;
}

struct Span {
  uint8_t* data;
  size_t size;
};
template <typename T>
Span span(std::vector<T>& values) {
  return {reinterpret_cast<uint8_t*>(values.data()), values.size() * sizeof(T)};
}

// What a pass reads and writes in a turn.
struct Traffic {
  std::vector<Span> read, written;
};

uint64_t sum(const uint8_t* from, size_t size) {
  uint64_t words[8] = {};
  for (size_t i = 0; i + 64 <= size; i += 64) {
    uint64_t line[8];
    std::memcpy(line, from + i, 64);
    for (int k = 0; k < 8; ++k) words[k] += line[k];
  }
  return std::accumulate(words, words + 8, uint64_t{0});
}

// The least that memory and caches allow: the same bytes are copied from where the pass reads to
// where it writes; what is left of the one kind is summed, of the other filled.
void touch(const Traffic& traffic) {
  size_t i = 0, done = 0;
  for (const Span& to : traffic.written)
    for (size_t at = 0; at < to.size;) {
      if (i == traffic.read.size()) {
        std::memset(to.data + at, 1, to.size - at);
        break;
      }
      const Span& from = traffic.read[i];
      const size_t size = std::min(to.size - at, from.size - done);
      std::memcpy(to.data + at, from.data + done, size);
      at += size, done += size;
      if (done == from.size) ++i, done = 0;
    }
  for (; i < traffic.read.size(); ++i, done = 0)
    benchmark::DoNotOptimize(sum(traffic.read[i].data + done, traffic.read[i].size - done));
  benchmark::ClobberMemory();
}

// Both in turn, on frames that were touched equally long ago; medians. Where of_memory is 1, a pass
// takes no longer than its bytes do.
template <typename TrafficOf, typename Pass>
void measure(benchmark::State& state, Scene& scene, TrafficOf traffic_of, Pass pass) {
  const auto pixels = static_cast<double>(scene.size.pixels());
  std::vector<double> times, of_memory;
  double bytes = 0;
  for (auto _ : state) {
    const Traffic traffic = traffic_of(scene);
    const double least = seconds_of([&] { touch(traffic); }, CLOCK_THREAD_CPUTIME_ID);
    scene.next();
    const double took = seconds_of([&] { pass(scene); }, CLOCK_THREAD_CPUTIME_ID);
    benchmark::ClobberMemory();
    scene.next();
    state.SetIterationTime(took);
    times.push_back(took);
    of_memory.push_back(least / took);
    bytes = 0;
    for (const Span& part : traffic.read) bytes += double(part.size);
    for (const Span& part : traffic.written) bytes += double(part.size);
  }
  state.counters["ns/pixel"] = 1e9 * median(times) / pixels;
  if (bytes == 0) return;
  state.counters["bytes/pixel"] = bytes / pixels;
  state.counters["GB/s"] = bytes / 1e9 / median(times);
  state.counters["of_memory"] = median(of_memory);
}

template <typename TrafficOf, typename Pass>
void add(const char* name, const Size& size, TrafficOf traffic_of, Pass pass) {
  const std::string full =
      std::string(name) + "/" + std::to_string(size.width) + "x" + std::to_string(size.height);
  benchmark::RegisterBenchmark(
      full.c_str(),
      [=](benchmark::State& state) { measure(state, scene_of(size), traffic_of, pass); })
      ->Unit(benchmark::kMicrosecond)
      ->UseManualTime();
}

std::vector<Span> planes_of(Scene& scene) {
  std::vector<Span> all;
  for (int c = 0; c < kChannels; ++c) all.push_back({scene.plane(c), scene.size.pixels()});
  return all;
}

void add_output(const char* name, Output output, const Size& size) {
  const auto traffic = [output](Scene& scene) {
    Traffic all = {{}, {span(scene.out[scene.turn % Scene::kPool])}};
    if (output != Output::background) all.read = planes_of(scene);
    // In place of the model's own, which have the same size and are used as often.
    all.read.push_back(span(scene.pictures));
    return all;
  };
  add(name, size, traffic, [output](Scene& scene) {
    const OutputTask task = {{scene.plane(0), scene.plane(1), scene.plane(2)},
                             &scene.model,
                             output,
                             scene.decision.mask(),
                             nullptr,
                             nullptr,
                             255};
    if (output == Output::mask || output == Output::cutout) scene.decide();
    write_picture(task, {}, view_of(scene.size, scene.packed_out()), 0, scene.size.height);
  });
}

void add_all(const Size& size) {
  const auto packed_in = [](Scene& scene) { return span(scene.in[scene.turn % Scene::kPool]); };
  const auto packed_out = [](Scene& scene) { return span(scene.out[scene.turn % Scene::kPool]); };
  add(
      "memcpy", size,
      [=](Scene& scene) {
        return Traffic{{packed_in(scene)}, {packed_out(scene)}};
      },
      [](Scene& scene) { std::memcpy(scene.packed_out(), scene.packed_in(), scene.in[0].size()); });
  add(
      "split_channels", size,
      [=](Scene& scene) {
        return Traffic{{packed_in(scene)}, planes_of(scene)};
      },
      [](Scene& scene) { scene.split(); });
  // Once a window: time for a pixel of the pictures, not of a frame.
  add(
      "combine_planes", size,
      [](Scene& scene) {
        Traffic all = {{}, {span(scene.pictures)}};
        for (int t = 0; t < scene.size.window; ++t)
          for (int c = 0; c < kChannels; ++c)
            all.read.push_back({scene.window.plane(t, c), scene.size.pixels()});
        return all;
      },
      [](Scene& scene) {
        std::vector<const uint8_t*> planes;
        for (int t = 0; t < scene.size.window; ++t)
          for (int c = 0; c < kChannels; ++c) planes.push_back(scene.window.plane(t, c));
        constexpr size_t kRun = 256;  // as the model goes
        const size_t pixels = scene.size.pixels();
        for (size_t first = 0; first < pixels; first += kRun) {
          float* sums[kPictures];
          for (size_t k = 0; k < kPictures; ++k)
            sums[k] = scene.pictures.data() + k * pixels + first;
          combine_planes(scene.coefficients.data(), kPictures, planes.data(), planes.size(), first,
                         std::min(kRun, pixels - first), sums);
        }
      });
  add(
      "levels_of", size,
      [](Scene& scene) {
        return Traffic{{span(scene.pictures)}, {span(scene.levels)}};
      },
      [](Scene& scene) {
        const float weights[3 * kPictures] = {0.5f, 0.5f, 0, 0, 0, 0.5f, 0.5f, 0, 0, 0, 0.5f, 0.5f};
        const size_t pixels = scene.size.pixels();
        const float* pictures[kPictures];
        for (size_t k = 0; k < kPictures; ++k) pictures[k] = scene.pictures.data() + k * pixels;
        for (size_t first = 0; first < pixels; first += kMaxRun) {
          uint8_t* const to[3] = {scene.level(0) + first, scene.level(1) + first,
                                  scene.level(2) + first};
          levels_of(weights, pictures, kPictures, first, std::min(kMaxRun, pixels - first), to);
        }
      });
  const auto frame_and_levels = [](Scene& scene, size_t channels) {
    Traffic all = {planes_of(scene), {{scene.packed_out(), channels * scene.size.pixels()}}};
    all.read.push_back(span(scene.levels));
    return all;
  };
  add(
      "absolute_residual", size, [=](Scene& scene) { return frame_and_levels(scene, 3); },
      [](Scene& scene) {
        const size_t pixels = scene.size.pixels();
        for (int c = 0; c < kChannels; ++c)
          absolute_residual(scene.plane(c), scene.level(c), pixels,
                            scene.packed_out() + size_t(c) * pixels);
      });
  add(
      "foreground_mask", size, [=](Scene& scene) { return frame_and_levels(scene, 1); },
      [](Scene& scene) {
        const uint8_t* const x[3] = {scene.plane(0), scene.plane(1), scene.plane(2)};
        const uint8_t* const l[3] = {scene.level(0), scene.level(1), scene.level(2)};
        foreground_mask(x, l, scene.size.pixels(), 18, nullptr, scene.packed_out());
      });
  add(
      "apply_mask", size,
      [](Scene& scene) {
        const size_t pixels = scene.size.pixels();
        Traffic all = {planes_of(scene), {{scene.packed_out(), 3 * pixels}}};
        all.read.push_back({scene.level(0), pixels});
        return all;
      },
      [](Scene& scene) {
        const size_t pixels = scene.size.pixels();
        for (int c = 0; c < kChannels; ++c)
          apply_mask(scene.plane(c), scene.level(0), pixels,
                     scene.packed_out() + size_t(c) * pixels);
      });
  add(
      "join_channels", size,
      [=](Scene& scene) {
        Traffic all = {planes_of(scene), {packed_out(scene)}};
        all.read.push_back({scene.level(0), scene.size.pixels()});
        return all;
      },
      [](Scene& scene) {
        // Rows without gaps are one long row, as write_picture has it.
        const size_t pixels = scene.size.pixels();
        const MutableImageView out = view_of(scene.size, scene.packed_out());
        for (size_t first = 0; first < pixels; first += kMaxRun) {
          const uint8_t* const from[3] = {scene.plane(0) + first, scene.plane(1) + first,
                                          scene.plane(2) + first};
          join_channels(from, scene.level(0) + first, std::min(kMaxRun, pixels - first), out, 0,
                        static_cast<int>(first));
        }
      });
  add_output("write_background", Output::background, size);
  add_output("write_foreground", Output::foreground, size);
  add_output("write_mask", Output::mask, size);
  add_output("write_cutout", Output::cutout, size);
  // Looks at a sample, once a window: time for a pixel of one frame.
  add(
      "foreground_statistics", size, [](Scene&) { return Traffic(); },
      [](Scene& scene) {
        benchmark::DoNotOptimize(foreground_statistics(scene.window, scene.model, 0, scene.pool));
      });
}

}  // namespace

int main(int argc, char** argv) {
  for (const Size& size : {Size{160, 120, 25}, Size{320, 240, 100}, Size{1920, 1080, 60}})
    add_all(size);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
