// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/bench/accuracy_error.h"

#include <algorithm>
#include <memory>
#include <random>

#include "core/dmd/decompose.h"
#include "tests/bench/accuracy_quality.h"
#include "tests/core/solver_names.h"
#include "tests/stability/assessment.h"
#include "tests/stability/decimal_solver.h"

namespace qdmd::bench {
namespace {

using stability::HardCase;

constexpr Solver kSolvers[] = {Solver::gram, Solver::gram_extended, Solver::qr, Solver::adjoint};
// More pixels than the complex adjoint has memory and patience for.
constexpr size_t kMostForAdjoint = 1000;

// Pictures that hardly differ, each under a light of its own: picture k falls to 2^-k of its
// strength from frame to frame, without rounding.
struct Fade {
  int frames, pictures;
  int most;  // the largest level that leaves room for the sum
};
// x_t = sum_k 2^-kt P_k, where the pictures are the same but for one level at one pixel each: the
// more pixels there are, the less they differ in direction. All modes are there at full strength,
// with the eigenvalues 1, 1/2, 1/4: to tell them apart takes the smallest singular value. (The
// background of a still picture with noise would show little: it belongs to the largest singular
// value alone.)
Window nearly_equal_pictures(const Fade& fade, size_t pixels, unsigned seed) {
  std::mt19937 rng(seed);
  std::uniform_int_distribution<int> level(1, fade.most);
  std::vector<uint8_t> picture(3 * pixels);
  for (auto& sample : picture) sample = static_cast<uint8_t>(level(rng));
  Window window(fade.frames, pixels);
  for (int t = 0; t < fade.frames; ++t) {
    const int slot = window.append();
    const auto strength = [&](int k) { return 1 << (k * (fade.frames - 1 - t)); };
    int sum = 0;
    for (int k = 0; k < fade.pictures; ++k) sum += strength(k);
    for (size_t c = 0; c < kChannels; ++c) {
      uint8_t* const plane = window.plane(slot, static_cast<int>(c));
      for (size_t p = 0; p < pixels; ++p)
        plane[p] = static_cast<uint8_t>(picture[c * pixels + p] * sum);
    }
    for (int k = 0; k + 1 < fade.pictures; ++k)
      window.plane(slot, k)[pixels / 2] += static_cast<uint8_t>(strength(k));
  }
  return window;
}

// A light that falls to two thirds from frame to frame, over `pixels` pixels. What stays is dim: a
// few pixels that hardly change, with the mode nearest 1. Amplitudes are fitted to the bright
// frames as well, so that the problem's own condition number is about the square of that of X.
Window bright_and_dim(size_t pixels, unsigned seed) {
  constexpr size_t kDim = 4;
  constexpr int kFrames = 4;
  std::mt19937 rng(seed);
  std::uniform_int_distribution<int> base(1, 9), level(2, 6), change(0, 2);
  std::vector<uint8_t> light(3 * pixels), dim(3 * 2 * kDim);
  for (auto& sample : light) sample = static_cast<uint8_t>(base(rng));
  for (auto& sample : dim) sample = static_cast<uint8_t>(level(rng));
  Window window(kFrames, 2 * kDim + pixels);
  for (int strength : {27, 18, 12, 8}) {
    const int slot = window.append();
    for (size_t c = 0; c < kChannels; ++c) {
      uint8_t* const plane = window.plane(slot, static_cast<int>(c));
      // The dim pixels come first and last, where errors are looked at.
      for (size_t p = 0; p < 2 * kDim; ++p)
        plane[p < kDim ? p : p + pixels] =
            static_cast<uint8_t>(dim[c * 2 * kDim + p] + change(rng));
      for (size_t p = 0; p < pixels; ++p)
        plane[kDim + p] = static_cast<uint8_t>(light[c * pixels + p] * strength);
    }
  }
  return window;
}

// Windows whose condition number grows with the pixels.
struct Family {
  std::string name;
  std::function<Window(size_t pixels, unsigned seed)> make;
};

std::vector<Family> families() {
  const auto pictures = [](const std::string& name, const Fade& fade) {
    return Family{"family: " + name, [fade](size_t pixels, unsigned seed) {
                    return nearly_equal_pictures(fade, pixels, seed);
                  }};
  };
  // More frames than singular values: these come from an SVD or from a Hermitian eigenproblem. At
  // full rank there is a pencil of triangular matrices.
  return {pictures("two pictures; rank 2 of 4", {5, 2, 13}),
          pictures("two pictures; full rank", {3, 2, 50}),
          pictures("three pictures; full rank", {4, 3, 3}),
          {"family: a light goes out; full rank", bright_and_dim}};
}

void measure_case(const std::string& scenes, const HardCase& hard_case, Table* table) {
  const auto point_of = [&](Solver solver) {
    Point point{"error", scenes, hard_case.name, "qdmd", test::name_of(solver), 0, 1, 0, 1, 0, 0};
    std::replace(point.name.begin(), point.name.end(), ',', ';');
    return point;
  };
  if (std::all_of(std::begin(kSolvers), std::end(kSolvers), [&](Solver solver) {
        return table->has(point_of(solver)) || (solver == Solver::adjoint && hard_case.large);
      }))
    return;
  const auto assessment = stability::assess(hard_case, Amplitude::window);
  for (const auto& result : assessment.solvers) {
    const Point point = point_of(result.solver);
    if (table->has(point)) continue;
    table->add(point, {{"condition", assessment.condition},
                       {"movement", assessment.movement},
                       {"sensitivity", assessment.sensitivity},
                       {"lambda_error", result.lambda_error},
                       {"background_error", result.background_error},
                       {"rank_found", result.rank},
                       // Fewer singular values than there are: another problem was solved.
                       {"dropped", assessment.rank - result.rank}});
  }
}

IntegerMatrix gram_of(const Window& window) {
  SlidingGram gram(window.capacity());
  gram.add_newest(window, window.size());
  return gram.matrix(window);
}

Window window_of(const TrueClip& clip) {
  const cv::Size size = clip.frames[0].size();
  Window window(static_cast<int>(clip.frames.size()), static_cast<size_t>(size.area()));
  for (const cv::Mat& frame : clip.frames) {
    const int slot = window.append();
    for (int p = 0; p < size.area(); ++p)
      for (int c = 0; c < kChannels; ++c) window.plane(slot, c)[p] = frame.data[3 * p + 2 - c];
  }
  return window;
}

// Some pixels all over the picture.
Eigen::MatrixXd probes_of(const Window& window) {
  constexpr Eigen::Index kProbes = 64;
  Eigen::MatrixXd pixels(3 * kProbes, window.size());
  for (int t = 0; t < window.size(); ++t)
    for (Eigen::Index i = 0; i < kProbes; ++i)
      for (int c = 0; c < kChannels; ++c)
        pixels(3 * i + c, t) = window.plane(
            window.slot(t), c)[static_cast<size_t>(i) * (window.pixels() - 1) / (kProbes - 1)];
  return pixels;
}

void measure_solvers(const std::string& scene, int frames, int turns, double seconds,
                     Table* table) {
  constexpr int kWidth = 96, kHeight = 72;
  std::vector<Point> points;
  std::vector<DmdOptions> options;
  for (int rank : {0, 3, 1})
    for (Solver solver : kSolvers) {
      // The adjoint's SVD takes minutes for more.
      if (solver == Solver::adjoint && frames > 12) continue;
      const Point point{"error", "solvers", scene,  "qdmd", test::name_of(solver), rank, 1,
                        frames,  1,         kWidth, kHeight};
      if (table->has(point)) continue;
      points.push_back(point);
      options.emplace_back().solver = solver;
      options.back().rank = rank;
    }
  if (points.empty()) return;

  const Window window = window_of(simulated(scene, kWidth, kHeight, frames));
  const IntegerMatrix gram = gram_of(window);
  const stability::DecimalSolver reference(gram, probes_of(window));
  std::map<int, stability::Answer> exact;  // by rank
  std::vector<Values> values;
  std::vector<Job> jobs;
  for (const DmdOptions& asked : options) {
    if (!exact.contains(asked.rank)) exact[asked.rank] = reference.solve(asked);
    const auto modes = quaternion_modes(window, gram, asked);
    const auto error = stability::distance(exact[asked.rank], reference.answer(modes));
    values.push_back({{"lambda_error", error.lambda},
                      {"background_error", error.background},
                      {"rank_found", modes.summary.rank},
                      {"condition", modes.summary.condition}});
    // From the frames to L(t)'s coefficients; bounds go by the Gram matrix, whatever the solver.
    jobs.push_back({[&window, asked] { decompose(window, gram_of(window), asked); },
                    static_cast<double>(frames)});
  }
  const auto times = in_turn(jobs, turns, seconds);
  for (size_t i = 0; i < points.size(); ++i) {
    times[i].put(&values[i]);
    table->add(points[i], values[i]);
  }
}

}  // namespace

void add_conditions(bool brief, Table* table, Steps* steps) {
  const unsigned seeds = brief ? 1 : 5;
  const size_t most = brief ? 1000 : 8000000;
  for (const Family& family : families())
    for (size_t pixels = 2; pixels < most; pixels *= brief ? 8 : 4)
      for (unsigned seed = 1; seed <= seeds; ++seed) {
        const std::string name = std::to_string(pixels) + " pixels; seed " + std::to_string(seed);
        steps->push_back({"error: " + family.name + ", " + name, [=] {
                            measure_case(family.name,
                                         {name, "", [=] { return family.make(pixels, seed); },
                                          pixels > kMostForAdjoint},
                                         table);
                          }});
      }
}

void add_hard_cases(bool brief, Table* table, Steps* steps) {
  for (const HardCase& hard_case : stability::hard_cases()) {
    // A window of more than a thousand frames takes a minute in 50 digits.
    if (hard_case.name == "1024 frames" || (brief && hard_case.large)) continue;
    steps->push_back({"error: " + hard_case.name,
                      [&hard_case, table] { measure_case("hard cases", hard_case, table); }});
  }
}

void add_solvers(bool brief, int turns, double seconds, Table* table, Steps* steps) {
  const std::vector<int> windows = brief ? std::vector<int>{8} : std::vector<int>{12, 25, 50};
  for (const std::string scene : {"basic", "illumination-changes"})
    for (int frames : windows)
      steps->push_back({"error: " + scene + ", " + std::to_string(frames) + " frames",
                        [=] { measure_solvers(scene, frames, turns, seconds, table); }});
}

}  // namespace qdmd::bench
