// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/stability/assessment.h"

#include <cmath>

#include "core/dmd/decompose.h"
#include "tests/core/clips.h"
#include "tests/stability/decimal_solver.h"

namespace qdmd::stability {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
// Directions of perturbation that are tried, and the room for those that are not.
constexpr unsigned kDirections = 3;
constexpr double kRoom = 10;

IntegerMatrix gram_of(const Window& window) {
  // Two threads at most: CI has no more.
  Pool pool(2);
  SlidingGram gram(window.capacity(), &pool);
  gram.add_newest(window, window.size());
  return gram.matrix(window);
}

// All pixels of a small picture; the corners and the middle of a large one.
Eigen::MatrixXd probed_pixels(const Window& window) {
  std::vector<size_t> probes;
  if (window.pixels() <= 64)
    for (size_t p = 0; p < window.pixels(); ++p) probes.push_back(p);
  else
    probes = {0, window.pixels() / 2, window.pixels() - 1};
  Eigen::MatrixXd pixels(3 * probes.size(), window.size());
  for (int t = 0; t < window.size(); ++t)
    for (size_t i = 0; i < probes.size(); ++i)
      for (int c = 0; c < kChannels; ++c)
        pixels(static_cast<Eigen::Index>(3 * i) + c, t) =
            window.plane(window.slot(t), c)[probes[i]];
  return pixels;
}

double worst(const Distance& distance) { return std::max(distance.lambda, distance.background); }

// How far the answer moves when the snapshots do, by `size` of the longest. The rank is held: what
// a solver counts as zero stays zero.
double movement(const DecimalSolver& reference, DmdOptions options, const Answer& answer,
                double size) {
  double largest = 0;
  options.rank = answer.rank;
  for (unsigned seed = 1; seed <= kDirections; ++seed)
    largest =
        std::max(largest, worst(distance(answer, reference.solve_perturbed(options, size, seed))));
  return kRoom * largest + size * answer.cancellation;
}

bool is_finite(const BackgroundModes& modes) {
  const DmdSummary& summary = modes.summary;
  return modes.eigenvalues.allFinite() && modes.combination.all_finite() &&
         modes.amplitudes.all_finite() && modes.reference_times.allFinite() &&
         std::isfinite(std::abs(summary.lambda)) && !std::isnan(summary.omega) &&
         std::isfinite(summary.residual) && std::isfinite(summary.condition);
}

// What a solver counts as zero, and its backward error in the snapshots, over the longest.
struct Precision {
  double tolerance, backward;
};
Precision precision(Solver solver, double pixels, double frames, double condition) {
  const double small = 8 * frames * kEpsilon;
  // Errors of n rows add up like random numbers.
  const double tall = 8 * (frames + std::sqrt(pixels)) * kEpsilon;
  switch (solver) {
    case Solver::gram:
      // An error of epsilon in G is one of up to epsilon times the condition number in X.
      return {std::sqrt(4 * frames * kEpsilon), small * condition};
    case Solver::gram_extended:
      return {4 * frames * kEpsilon, small};
    case Solver::qr:
      return {std::max(pixels, frames) * kEpsilon, tall};
    case Solver::adjoint:
    case Solver::automatic:
      break;
  }
  return {2 * std::max(pixels, frames) * kEpsilon, tall};
}

}  // namespace

Assessment assess(const HardCase& hard_case, Amplitude amplitude) {
  const Window window = hard_case.make();
  const IntegerMatrix gram = gram_of(window);
  const DecimalSolver reference(gram, probed_pixels(window));
  const auto pixels = static_cast<double>(window.pixels());
  const double frames = window.size();
  const auto singular = reference.singular_values();
  DmdOptions options;
  options.amplitude = amplitude;
  const Answer answer = reference.solve(options);

  Assessment result;
  result.frames = window.size();
  result.rank = answer.rank;
  if (!singular.empty()) result.condition = singular.front() / singular.back();
  const double rounding = 8 * frames * kEpsilon;
  result.movement = movement(reference, options, answer, rounding);
  result.sensitivity = result.movement / (kRoom * rounding);

  for (Solver solver : {Solver::gram, Solver::gram_extended, Solver::qr, Solver::adjoint}) {
    if (solver == Solver::adjoint && hard_case.large) continue;
    DmdOptions asked = options;
    asked.solver = solver;
    const BackgroundModes modes = quaternion_modes(window, gram, asked);
    SolverResult& entry = result.solvers.emplace_back();
    entry.solver = solver;
    entry.finite = is_finite(modes);
    entry.rank = modes.summary.rank;
    entry.residual = modes.summary.residual;
    if (!entry.finite) continue;

    const Answer found = reference.answer(modes);
    entry.fit = found.fit;
    // A solver that counts a singular value as zero solves the problem of one rank less.
    entry.dropped = entry.rank < answer.rank;
    double condition = result.condition;
    Answer expected = answer;
    DmdOptions same_rank = options;
    if (entry.dropped && entry.rank > 0) {
      const auto kept = static_cast<size_t>(entry.rank);
      entry.dropped_value = singular[kept] / singular[0];
      condition = singular[0] / singular[kept - 1];
      same_rank.rank = entry.rank;
      expected = reference.solve(same_rank);
    }
    const Precision precise = precision(solver, pixels, frames, condition);
    entry.tolerance = precise.tolerance;
    entry.bound = precise.backward < 0.1
                      ? movement(reference, same_rank, expected, precise.backward)
                      : std::numeric_limits<double>::infinity();
    const Distance error = distance(expected, found);
    entry.lambda_error = error.lambda;
    entry.background_error = error.background;
  }
  return result;
}

}  // namespace qdmd::stability
