// SPDX-License-Identifier: LGPL-2.1-or-later
// The passes of method=robust, each by itself on what the passes before it left: time of one thread
// that it computed. Names say what a pixel or a cell is counted of: where a pass looks at all
// frames at once, a frame's pixel; of the pictures on the grid, a frame's cell, or a pair of
// frames' cell.
#include <benchmark/benchmark.h>

#include <memory>
#include <string>
#include <vector>

#include "core/learn/robust/light.h"
#include "core/learn/robust/median_picture.h"
#include "core/learn/robust/stable_frames.h"
#include "core/passes/fill.h"
#include "core/passes/mask.h"
#include "core/passes/patch_density.h"
#include "core/passes/residual.h"
#include "tests/bench/camera.h"
#include "tests/bench/clock.h"

namespace {

using namespace qdmd;
using namespace qdmd::bench;

struct Size {
  int width, height, window;

  size_t pixels() const { return size_t(width) * size_t(height); }
};

// A window of frames and what a solve finds of them.
struct Solve {
  Size size;
  Grid grid;
  Window window;
  GridFrames cells;
  Pool pool{1};
  std::vector<Gain> gains;
  std::vector<LitPicture> pictures, shared_pictures;
  PlaneSlots shared;
  StableFrames stable;
  ReferencePicture reference;
  std::vector<uint8_t> spread, reach, scratch, bits;
  WindowMask mask;
  Filler<uint8_t> filler;
  int turn = 0;

  explicit Solve(const Size& size_)
      : size(size_),
        grid(size_.width, size_.height),
        window(size_.window, size_.pixels()),
        cells(grid, size_.window),
        gains(static_cast<size_t>(size_.window), kSameLight),
        spread(size_.pixels()),
        reach(window.plane_size(), 2),
        scratch(mask_scratch_bytes(size_.width, size_.height)),
        mask(size_.window, size_.pixels()),
        filler(size_.window) {
    const Camera camera(size.width, size.height, 3);
    std::vector<uint8_t> frame(camera.frame_bytes());
    for (int t = 0; t < size.window; ++t) {
      camera.render(t, frame.data());
      const int slot = window.append();
      for (int c = 0; c < kChannels; ++c) {
        uint8_t* plane = window.plane(slot, c);
        for (size_t p = 0; p < size.pixels(); ++p) plane[p] = frame[3 * p + static_cast<size_t>(c)];
        cell_means(grid, plane, cells.plane(t, c));
      }
      pictures.push_back({{x(t)[0], x(t)[1], x(t)[2]}, kSameLight});
    }
    stable = find_stable_frames(grid, cells, size.window, nullptr, &pool);
    reference.width = size.width;
    reference.height = size.height;
    for (auto& level : reference.level) level.resize(size.pixels());
    reference.threshold.assign(size.pixels(), 12);
    find_median();
    share_chroma();
    bits.resize(mask_bytes(size.pixels()));
    mask.find_all(size.window, &pool, [this](int t, size_t, uint8_t* out) {
      find_mask(reference, x(t).data(), kSameLight, out, scratch.data());
    });
  }

  std::array<const uint8_t*, 3> x(int t) const {
    return {window.plane(t, 0), window.plane(t, 1), window.plane(t, 2)};
  }
  // Makes frames in which 2 x 2 pixels share the samples of channels 1 and 2.
  void share_chroma() {
    const ChromaShape shape = {size.width, size.height, 2, 2};
    shared = PlaneSlots(size.window, shape);
    for (int t = 0; t < size.window; ++t) {
      LitPicture& picture = shared_pictures.emplace_back(pictures[size_t(t)]);
      for (int c = 1; c < kChannels; ++c) {
        uint8_t* to = shared.plane(t, c);
        for (int y = 0; y < shape.height; y += 2)
          for (int x = 0; x < shape.width; x += 2)
            *to++ = window.plane(t, c)[size_t(y) * size_t(shape.width) + size_t(x)];
        picture.plane[c] = shared.plane(t, c);
      }
      picture.shape = shape;
    }
  }
  void find_median() { find_median(pictures); }
  void find_median(const std::vector<LitPicture>& of) {
    uint8_t* const background[3] = {reference.level[0].data(), reference.level[1].data(),
                                    reference.level[2].data()};
    median_picture(grid, stable, of, &pool, background, spread.data());
  }
  void find_mask_of(int t) {
    find_mask(reference, x(t).data(), kSameLight, bits.data(), scratch.data());
  }
  int next() { return turn = (turn + 1) % size.window; }
};

// Made once for all passes of a size.
Solve& solve_of(const Size& size) {
  static std::unique_ptr<Solve> solve;
  if (!solve || solve->size.pixels() != size.pixels()) {
    solve.reset();
    solve = std::make_unique<Solve>(size);
  }
  return *solve;
}

// counter: "ns/pixel" or the like. count(solve): of them in a turn.
template <typename Count, typename Pass>
void add(const char* name, const Size& size, const char* counter, Count count, Pass pass) {
  const std::string full =
      std::string(name) + "/" + std::to_string(size.width) + "x" + std::to_string(size.height);
  benchmark::RegisterBenchmark(full.c_str(),
                               [=](benchmark::State& state) {
                                 Solve& solve = solve_of(size);
                                 std::vector<double> times;
                                 for (auto _ : state) {
                                   const double took =
                                       seconds_of([&] { pass(solve); }, CLOCK_THREAD_CPUTIME_ID);
                                   benchmark::ClobberMemory();
                                   state.SetIterationTime(took);
                                   times.push_back(took);
                                 }
                                 state.counters[counter] = 1e9 * median(times) / count(solve);
                               })
      ->Unit(benchmark::kMicrosecond)
      ->UseManualTime();
}

void add_all(const Size& size) {
  const auto pixels = [](const Solve& solve) { return double(solve.size.pixels()); };
  const auto all_pixels = [](const Solve& solve) {
    return double(solve.size.pixels()) * solve.size.window;
  };
  const auto all_cells = [](const Solve& solve) {
    return double(solve.grid.cells()) * solve.size.window;
  };
  add("cell_means", size, "ns/pixel", pixels, [](Solve& solve) {
    const int t = solve.next();
    for (int c = 0; c < kChannels; ++c)
      cell_means(solve.grid, solve.x(t)[size_t(c)], solve.cells.plane(t, c));
  });
  add("light_of", size, "ns/cell", all_cells, [](Solve& solve) {
    benchmark::DoNotOptimize(light_of(solve.cells, solve.size.window, &solve.pool));
  });
  add(
      "patch_density", size, "ns/pair",
      [](const Solve& solve) {
        return double(solve.grid.cells()) * solve.size.window * (solve.size.window + 1) / 2;
      },
      [](Solve& solve) {
        std::vector<float> density(solve.grid.cells() * size_t(solve.size.window));
        PatchFrames(solve.grid, solve.cells, solve.size.window, &solve.pool)
            .density(solve.size.window, &solve.pool, density.data());
        benchmark::DoNotOptimize(density.data());
      });
  add("find_stable_frames", size, "ns/cell", all_cells, [](Solve& solve) {
    benchmark::DoNotOptimize(
        find_stable_frames(solve.grid, solve.cells, solve.size.window, nullptr, &solve.pool));
  });
  // Costs what the cells' frames are, up to kMedianFrames: a pixel of the picture.
  add("median_picture", size, "ns/pixel", pixels, [](Solve& solve) { solve.find_median(); });
  add("median_picture_of_shared_chroma", size, "ns/pixel", pixels,
      [](Solve& solve) { solve.find_median(solve.shared_pictures); });
  add("residual_norm", size, "ns/pixel", pixels, [](Solve& solve) {
    const uint8_t* const l[3] = {solve.reference.level[0].data(), solve.reference.level[1].data(),
                                 solve.reference.level[2].data()};
    residual_norm(solve.x(solve.next()).data(), l, solve.size.pixels(), solve.spread.data());
  });
  add("find_mask", size, "ns/pixel", pixels,
      [](Solve& solve) { solve.find_mask_of(solve.next()); });
  add(
      "fill_samples", size, "ns/sample",
      [](const Solve& solve) { return double(solve.size.pixels()) / 16; },
      [](Solve& solve) {
        const int t = solve.next();
        uint8_t* const out[3] = {solve.spread.data(), solve.spread.data(), solve.spread.data()};
        solve.mask.read(t, solve.bits.data());
        fill_samples(solve.reference, solve.bits.data(), solve.x(t).data(), kSameLight,
                     solve.reach.data(), {0, solve.size.height, 4}, out);
      });
  add("fill", size, "ns/pixel", all_pixels, [](Solve& solve) {
    const size_t all = solve.size.pixels();
    for (size_t first = 0; first < all; first += solve.filler.run())
      benchmark::DoNotOptimize(solve.filler.fill(solve.window, solve.gains, solve.mask,
                                                 solve.reference, solve.reach.data(), first,
                                                 std::min(solve.filler.run(), all - first)));
  });
}

}  // namespace

int main(int argc, char** argv) {
  for (const Size& size :
       {Size{160, 120, 25}, Size{320, 240, 100}, Size{768, 576, 100}, Size{1920, 1080, 100}})
    add_all(size);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
