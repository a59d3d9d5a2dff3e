// SPDX-License-Identifier: LGPL-2.1-or-later
// estimator-table [SEEDS]: prints the table of docs/notebook/numerics.md that shows what noise does
// to each estimator, against fades whose lambda is known.
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

constexpr size_t kPixels = 80 * 60;
constexpr int kDarkest = 20, kBrightest = 100;

struct Mean {
  double sum = 0, squares = 0;
  int count = 0;
  void add(double x) { sum += x, squares += x * x, ++count; }
  double mean() const { return sum / count; }
  // The standard deviation of one of the values.
  double deviation() const {
    return std::sqrt(std::max(0.0, squares / count - mean() * mean()) * count / (count - 1));
  }
};

test::Clip fading(double factor, double sigma, size_t count, unsigned seed) {
  std::mt19937 rng(seed);
  const auto picture = test::random_picture(kPixels, rng, kDarkest, kBrightest);
  std::normal_distribution<float> noise(0, static_cast<float>(sigma));
  test::Clip clip(kPixels, count);
  double light = 1;
  for (size_t t = 0; t < count; ++t, light *= factor)
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < kPixels; ++p)
        clip.set(t, c, p, light * picture[c * kPixels + p] + static_cast<double>(noise(rng)));
  return clip;
}

// What such frames' Gram matrix is on average over all noise: what noise adds to the products of
// different frames averages out.
QuaternionMatrixd expected_gram(double factor, double sigma, size_t count) {
  const double n = 3.0 * kPixels, spread = kBrightest - kDarkest;
  const double square =
      n * (std::pow((kDarkest + kBrightest) / 2.0, 2) + spread * (spread + 2) / 12.0);
  QuaternionMatrixd gram(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(count));
  for (Eigen::Index c = 0; c < gram.cols(); ++c)
    for (Eigen::Index r = 0; r < gram.rows(); ++r)
      gram.a(r, c) = square * std::pow(factor, static_cast<double>(r + c)) +
                     (r == c ? n * sigma * sigma : 0.0);
  return gram;
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
        // The errors of |lambda|, and of L's light from the first frame to the last, in percent.
        const double last = static_cast<double>(frames - 1);
        const auto errors = [&](const Way& way, const SnapshotFactor<double>& snapshots) {
          DmdOptions options;
          options.estimator = way.estimator;
          options.rank = way.rank;
          const auto modes = solve_factor(snapshots, options);
          const double ratio = (snapshots.r * shares_at(modes, last)).norm() /
                               (snapshots.r * shares_at(modes, 0)).norm();
          return std::pair{1e6 * (std::abs(modes.eigenvalues(0)) - factor),
                           100 * (ratio / std::pow(factor, last) - 1)};
        };
        Mean lambda[std::size(kWays)], light[std::size(kWays)];
        for (int seed = 0; seed < seeds; ++seed) {
          const auto snapshots = factorize_gram(test::quaternion_gram_of(
              fading(factor, sigma, frames, static_cast<unsigned>(1000 * seed) + 7)));
          for (size_t k = 0; k < std::size(kWays); ++k) {
            const auto [of_lambda, of_light] = errors(kWays[k], snapshots);
            lambda[k].add(of_lambda);
            light[k].add(of_light);
          }
        }
        const auto average = factorize_gram(expected_gram(factor, sigma, frames));
        std::printf("| %g | %zu | %g |", sigma, frames, factor);
        for (size_t k = 0; k < std::size(kWays); ++k) {
          const auto [of_lambda, of_light] = errors(kWays[k], average);
          std::printf(" %.2g ± %.1g; %.2g ± %.1g |", of_lambda, lambda[k].deviation(), of_light,
                      light[k].deviation());
        }
        std::printf("\n");
        std::fflush(stdout);
      }
}
