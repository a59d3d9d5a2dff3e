// SPDX-License-Identifier: LGPL-2.1-or-later
// random-windows COUNT [--digits] [--first SEED] [--frames MOST]: judges so many random windows and
// prints each fault, and a last line.
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "tests/core/solver_names.h"
#include "tests/stability/random_windows.h"

int main(int argc, char** argv) {
  using namespace qdmd;
  using namespace qdmd::stability;
  if (argc < 2) {
    std::fprintf(stderr, "random-windows COUNT [--digits] [--first SEED] [--frames MOST]\n");
    return 2;
  }
  const auto count = static_cast<uint64_t>(std::atoll(argv[1]));
  uint64_t first = 1;
  int frames = 12;
  bool digits = false;
  for (int i = 2; i < argc; ++i) {
    if (!std::strcmp(argv[i], "--digits")) digits = true;
    if (!std::strcmp(argv[i], "--first") && i + 1 < argc)
      first = static_cast<uint64_t>(std::atoll(argv[++i]));
    if (!std::strcmp(argv[i], "--frames") && i + 1 < argc) frames = std::atoi(argv[++i]);
  }
  uint64_t faults = 0, solves = 0, bounds = 0, without = 0;
  double worst = 0;
  for (uint64_t seed = first; seed < first + count; ++seed) {
    const auto window = random_window(seed, frames);
    const auto options = random_options(seed);
    const auto verdict = judge(window.clip, options, digits);
    solves += static_cast<uint64_t>(verdict.solves);
    bounds += static_cast<uint64_t>(verdict.finite_bounds);
    without += verdict.without_reference;
    worst = std::max(worst, verdict.worst);
    for (const auto& fault : verdict.faults) {
      ++faults;
      std::printf("%llu (%s; %zu pixels, %zu frames, rank %d, %s, threshold %g) %s\n",
                  static_cast<unsigned long long>(seed), window.kind.c_str(), window.clip.pixels,
                  window.clip.size(), options.rank,
                  options.amplitude == Amplitude::window ? "window" : "first-frame",
                  options.omega_threshold, fault.c_str());
      std::fflush(stdout);
    }
  }
  std::printf("%llu windows, %llu solves: %llu faults", static_cast<unsigned long long>(count),
              static_cast<unsigned long long>(solves), static_cast<unsigned long long>(faults));
  if (digits)
    std::printf(
        "; %llu finite bounds, the true error at most %.2g of its bound; %llu windows without an "
        "answer in 50 digits",
        static_cast<unsigned long long>(bounds), worst, static_cast<unsigned long long>(without));
  std::printf("\n");
  return faults > 0;
}
