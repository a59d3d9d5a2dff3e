// SPDX-License-Identifier: LGPL-2.1-or-later
// A window through the core at full rank, beside the paper's procedure to the letter on the same
// frames. That one takes too long for the window that users have, so its growth with the number of
// pixels is measured, too, and its time there follows from it.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "core/engine/engine.h"
#include "tests/bench/camera.h"
#include "tests/bench/clock.h"

namespace {

using namespace qdmd;
using namespace qdmd::bench;

struct Size {
  int width, height;

  double pixels() const { return double(width) * height; }
};

// Seconds from the first frame pushed to the last picture popped.
double time_of(const Size& size, int window, Solver solver) {
  const Camera camera(size.width, size.height, 4);
  std::vector<std::vector<uint8_t>> frames(size_t(window),
                                           std::vector<uint8_t>(camera.frame_bytes()));
  for (int t = 0; t < window; ++t) camera.render(t, frames[size_t(t)].data());
  std::vector<uint8_t> picture(camera.frame_bytes());
  const auto view = [&](auto* rgba, auto result) {
    for (int c = 0; c < 3; ++c) result.channel[c] = rgba + c;
    result.alpha = rgba + 3;
    result.width = size.width, result.height = size.height;
    result.pixel_stride = 4, result.row_stride = 4 * ptrdiff_t{size.width};
    return result;
  };

  EngineOptions options;
  options.method = Method::qdmd;
  options.window_size = window;
  options.dmd.solver = solver;
  options.dmd.amplitude = solver == Solver::adjoint ? Amplitude::first_frame : Amplitude::window;
  options.max_memory = uint64_t{16} << 30;
  Engine engine;
  const auto check = [](const Status& status) {
    if (!status.ok()) throw std::runtime_error(status.message);
  };
  check(engine.configure(options, size.width, size.height));
  const auto run = [&] {
    for (const auto& frame : frames) check(engine.push(view(frame.data(), ImageView())));
    check(engine.drain());
    while (engine.next())
      engine.next()->pop(Output::mask, view(picture.data(), MutableImageView()));
  };
  // A window before touches the memory; the adjoint does not care.
  if (solver != Solver::adjoint) run();
  return seconds_of(run);
}

}  // namespace

int main(int argc, char** argv) {
  int window = 200, turns = 3;
  bool brief = false;
  CLI::App app("A window through the core, and the literal procedure's time for the same frames");
  app.add_option("--window-size", window, "frames")->check(CLI::Range(3, 1000));
  app.add_option("--turns", turns, "times that everything is measured, for medians")
      ->check(CLI::Range(1, 100));
  app.add_flag("--short", brief, "a few seconds: small windows, whose numbers say little");
  CLI11_PARSE(app, argc, argv);

  const Size whole = brief ? Size{80, 60} : Size{320, 240};
  std::vector<Size> small = {{32, 24}, {48, 36}, {64, 48}};
  if (brief) {
    window = 10, turns = 1;
    small = {{16, 12}, {24, 18}, {32, 24}};
  }

  std::vector<std::vector<double>> adjoint(small.size()), gram(small.size());
  std::vector<double> core;
  for (int turn = 0; turn < turns; ++turn) {
    core.push_back(time_of(whole, window, Solver::gram));
    for (size_t i = 0; i < small.size(); ++i) {
      gram[i].push_back(time_of(small[i], window, Solver::gram));
      adjoint[i].push_back(time_of(small[i], window, Solver::adjoint));
      std::fprintf(stderr, "turn %d of %d: %d x %d, adjoint %.3g s, gram %.3g s\n", turn + 1, turns,
                   small[i].width, small[i].height, adjoint[i].back(), gram[i].back());
    }
  }

  // Least squares in logarithms. What does not grow with the pixels makes the exponent too small,
  // hence the time that is foretold: the ratio is a lower bound.
  double x = 0, y = 0, xx = 0, xy = 0;
  std::printf("frames %d, full rank, medians of %d\n\n", window, turns);
  std::printf("| pixels | solver=adjoint, s | solver=gram, s | ratio |\n|---|---|---|---|\n");
  for (size_t i = 0; i < small.size(); ++i) {
    const double slow = median(adjoint[i]), fast = median(gram[i]);
    std::printf("| %dx%d | %.3g | %.3g | %.0f |\n", small[i].width, small[i].height, slow, fast,
                slow / fast);
    const double log_pixels = std::log(small[i].pixels()), log_time = std::log(slow);
    x += log_pixels, y += log_time;
    xx += log_pixels * log_pixels, xy += log_pixels * log_time;
  }
  const auto n = static_cast<double>(small.size());
  const double exponent = (n * xy - x * y) / (n * xx - x * x);
  const double foretold =
      median(adjoint.back()) * std::pow(whole.pixels() / small.back().pixels(), exponent);
  std::printf("| %dx%d | %.3g (foretold, pixels^%.2f) | %.3g | %.0f |\n", whole.width, whole.height,
              foretold, exponent, median(core), foretold / median(core));
  return 0;
}
