// estimator-table [SEEDS]: prints the table of docs/numerics.md that shows what noise does to each
// estimator, against fades whose lambda is known.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "core/dmd/error_bound.h"
#include "core/dmd/estimator.h"
#include "core/dmd/qdmd.h"
#include "tests/core/clips.h"

namespace {

using namespace qdmd;

constexpr size_t kPixels = 64 * 48;

struct Mean {
  double sum = 0, squares = 0;
  int count = 0;
  void add(double x) { sum += x, squares += x * x, ++count; }
  double mean() const { return sum / count; }
  // Its standard error.
  double error() const {
    const double spread = std::max(0.0, squares / count - mean() * mean());
    return std::sqrt(spread / std::max(1, count - 1));
  }
};

test::Clip fading(double factor, double sigma, size_t count, unsigned seed) {
  std::mt19937 rng(seed);
  const auto picture = test::random_picture(kPixels, rng, 30, 200);
  std::normal_distribution<float> noise(0, static_cast<float>(sigma));
  test::Clip clip(kPixels, count);
  double light = 1;
  for (size_t t = 0; t < count; ++t, light *= factor)
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < kPixels; ++p)
        clip.set(t, c, p, light * picture[c * kPixels + p] + static_cast<double>(noise(rng)));
  return clip;
}

struct Way {
  const char* name;
  Estimator estimator;
  int rank;
};
constexpr Way kWays[] = {{"exact", Estimator::exact, 0},
                         {"exact, rank 1", Estimator::exact, 1},
                         {"forward-backward", Estimator::forward_backward, 1},
                         {"total", Estimator::total, 1},
                         {"optimized", Estimator::optimized, 0},
                         {"optimized, rank 1", Estimator::optimized, 1}};

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 6;
  std::printf("| noise | frames | lambda |");
  for (const Way& way : kWays) std::printf(" %s |", way.name);
  std::printf("\n|---|---|---|---|---|---|---|---|---|\n");
  for (double factor : {1.0, 0.999})
    for (double sigma : {1.0, 3.0, 10.0})
      for (size_t frames : {size_t{50}, size_t{200}}) {
        Mean bias[std::size(kWays)], light[std::size(kWays)];
        for (int seed = 0; seed < seeds; ++seed) {
          const auto gram = test::quaternion_gram_of(
              fading(factor, sigma, frames, static_cast<unsigned>(1000 * seed) + 7));
          const auto factors = factorize_gram(gram);
          const double last = static_cast<double>(frames - 1);
          for (size_t k = 0; k < std::size(kWays); ++k) {
            DmdOptions options;
            options.estimator = kWays[k].estimator;
            options.rank = kWays[k].rank;
            const auto modes = solve_factor(factors, options);
            bias[k].add(std::abs(modes.eigenvalues(0)) - factor);
            // How much darker L gets from the first frame to the last than the truth does.
            const double ratio = (factors.r * shares_at(modes, last)).norm() /
                                 (factors.r * shares_at(modes, 0)).norm();
            light[k].add(100 * (ratio / std::pow(factor, last) - 1));
          }
        }
        std::printf("| %g | %zu | %g |", sigma, frames, factor);
        for (size_t k = 0; k < std::size(kWays); ++k)
          std::printf(" %.2g ± %.1g; %.2g ± %.1g |", 1e6 * bias[k].mean(), 1e6 * bias[k].error(),
                      light[k].mean(), light[k].error());
        std::printf("\n");
        std::fflush(stdout);
      }
}
