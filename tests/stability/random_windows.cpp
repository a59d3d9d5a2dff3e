// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/stability/random_windows.h"

#include <cmath>
#include <optional>
#include <sstream>

#include "core/dmd/decompose.h"
#include "tests/core/solver_names.h"
#include "tests/stability/decimal_solver.h"

namespace qdmd::stability {
namespace {

using test::Clip;
using Levels = std::vector<uint8_t>;

constexpr Solver kSolvers[] = {Solver::automatic, Solver::gram, Solver::gram_extended, Solver::qr,
                               Solver::adjoint};

class Maker {
 public:
  Maker(uint64_t seed, int most_frames, size_t most_side)
      : rng_(static_cast<unsigned>(seed * 2654435761u + (seed >> 32) + 1)) {
    const size_t width = 1 + below(most_side), height = 1 + below(most_side);
    pixels_ = width * height;
    count_ = 2 + below(static_cast<size_t>(most_frames - 1));
  }

  RandomWindow make() {
    RandomWindow result{base(), ""};
    result.kind = kind_;
    // Half of all get something on top.
    while (below(2) == 0) spoil(&result.clip);
    result.kind = kind_;
    return result;
  }

 private:
  size_t below(size_t limit) { return rng_() % limit; }
  Levels picture(int low = 0, int high = 255) {
    return test::random_picture(pixels_, rng_, low, high);
  }
  Levels tame_picture() {
    const int low = static_cast<int>(below(120));
    return picture(low, low + static_cast<int>(below(136)));
  }
  void name(const char* text) { kind_ += (kind_.empty() ? "" : ", ") + std::string(text); }

  Clip of(const std::vector<Levels>& pictures, const std::vector<size_t>& order) {
    Clip clip(pixels_, 0);
    for (size_t index : order) clip.frames.push_back(pictures[index]);
    return clip;
  }
  std::vector<Levels> some_pictures(size_t most) {
    std::vector<Levels> all(1 + below(most));
    for (auto& one : all) one = tame_picture();
    return all;
  }

  Clip base() {
    const size_t m = count_;
    switch (below(12)) {
      case 0: {
        name("few distinct frames");
        const auto pictures = some_pictures(4);
        std::vector<size_t> order(m);
        for (auto& index : order) index = below(pictures.size());
        return of(pictures, order);
      }
      case 1: {
        name("a cycle");
        const auto pictures = some_pictures(6);
        std::vector<size_t> order(m);
        for (size_t t = 0; t < m; ++t) order[t] = t % pictures.size();
        return of(pictures, order);
      }
      case 2: {
        name("frames twice");
        const auto pictures = some_pictures(m);
        std::vector<size_t> order(m);
        for (size_t t = 0; t < m; ++t) order[t] = std::min(t / 2, pictures.size() - 1);
        return of(pictures, order);
      }
      case 3: {
        name("there and back");
        const auto pictures = some_pictures((m + 1) / 2);
        std::vector<size_t> order(m);
        for (size_t t = 0; t < m; ++t)
          order[t] = std::min(t < m - 1 - t ? t : m - 1 - t, pictures.size() - 1);
        return of(pictures, order);
      }
      case 4: {
        name("one level blinks");
        Clip clip = test::static_clip(tame_picture(), m);
        const size_t period = 2 + below(3), p = below(3 * pixels_);
        for (size_t t = 0; t < m; ++t)
          if (t % period == 1) clip.frames[t][p] ^= 1;
        return clip;
      }
      case 5: {
        name("fade");
        const Levels still = tame_picture();
        const double factor = 0.5 + static_cast<double>(below(100)) / 100;
        Clip clip(pixels_, m);
        for (size_t t = 0; t < m; ++t)
          for (size_t c = 0; c < 3; ++c)
            for (size_t p = 0; p < pixels_; ++p)
              clip.set(t, c, p, still[c * pixels_ + p] * std::pow(factor, static_cast<double>(t)));
        return clip;
      }
      case 6: {
        name("ramp");
        const Levels still = picture(0, 100), slope = picture(0, 8);
        Clip clip(pixels_, m);
        for (size_t t = 0; t < m; ++t)
          for (size_t i = 0; i < still.size(); ++i)
            clip.frames[t][i] = static_cast<uint8_t>(still[i] + t * slope[i]);
        return clip;
      }
      case 7: {
        name("noise");
        return test::noisy_clip(pixels_, m, 0.3 + 0.1 * static_cast<double>(below(80)), rng_);
      }
      case 8: {
        name("two levels");
        const auto low = static_cast<uint8_t>(below(256)), high = static_cast<uint8_t>(below(256));
        Clip clip(pixels_, m);
        for (auto& frame : clip.frames)
          for (auto& level : frame) level = below(2) ? low : high;
        return clip;
      }
      case 9: {
        name("mover");
        Clip clip = test::static_clip(tame_picture(), m);
        const size_t length = 1 + below(pixels_);
        for (size_t t = 0; t < m; ++t)
          for (size_t i = 0; i < length; ++i)
            for (size_t c = 0; c < 3; ++c)
              clip.at(t, c, (t * length + i) % pixels_) = static_cast<uint8_t>(80 * (c + 1));
        return clip;
      }
      case 10: {
        name("colours turn");
        const Levels start = tame_picture();
        Clip clip(pixels_, m);
        for (size_t t = 0; t < m; ++t)
          for (size_t c = 0; c < 3; ++c)
            for (size_t p = 0; p < pixels_; ++p)
              clip.at(t, (c + t) % 3, p) = start[c * pixels_ + p];
        return clip;
      }
      default:
        name("unrelated frames");
        return test::random_clip(pixels_, m, rng_);
    }
  }

  void spoil(Clip* clip) {
    const size_t m = clip->size();
    switch (below(7)) {
      case 0: {
        name("one channel alone");
        const size_t kept = below(3);
        for (auto& frame : clip->frames)
          for (size_t i = 0; i < frame.size(); ++i)
            if (i / pixels_ != kept) frame[i] = 0;
        break;
      }
      case 1: {
        name("one channel missing");
        const size_t lost = below(3);
        for (auto& frame : clip->frames)
          for (size_t i = 0; i < frame.size(); ++i)
            if (i / pixels_ == lost) frame[i] = 0;
        break;
      }
      case 2:
        name("a black frame");
        clip->frames[below(3) == 0 ? 0 : below(2) ? m - 1 : below(m)].assign(3 * pixels_, 0);
        break;
      case 3: {
        name("black parts");
        const size_t first = below(pixels_);
        for (auto& frame : clip->frames)
          for (size_t i = 0; i < frame.size(); ++i)
            if (i % pixels_ >= first) frame[i] = 0;
        break;
      }
      case 4:
        name("grey");
        for (auto& frame : clip->frames)
          for (size_t p = 0; p < pixels_; ++p)
            frame[pixels_ + p] = frame[2 * pixels_ + p] = frame[p];
        break;
      case 5:
        name("one level wrong");
        clip->frames[below(m)][below(3 * pixels_)] ^= 1;
        break;
      default:
        name("a frame again");
        clip->frames[below(m)] = Levels(clip->frames[below(m)]);
        break;
    }
  }

  std::mt19937 rng_;
  std::string kind_;
  size_t pixels_, count_;
};

bool finite(const Decomposition& result, int frames) {
  const DmdSummary& summary = result.summary;
  bool good = std::isfinite(std::abs(summary.lambda)) && !std::isnan(summary.omega) &&
              std::isfinite(summary.residual) && std::isfinite(summary.condition) &&
              !std::isnan(summary.rounding_bound) && !std::isnan(summary.sensitivity) &&
              result.background.basis().allFinite();
  for (double t : {0.0, frames / 2.0, frames - 1.0, 4.0 * frames})
    good = good && result.background.weights(t).allFinite();
  return good;
}

Eigen::MatrixXd pixels_of(const Clip& clip) {
  Eigen::MatrixXd pixels(3 * static_cast<Eigen::Index>(clip.pixels),
                         static_cast<Eigen::Index>(clip.size()));
  for (size_t t = 0; t < clip.size(); ++t)
    for (size_t p = 0; p < clip.pixels; ++p)
      for (size_t c = 0; c < 3; ++c)
        pixels(static_cast<Eigen::Index>(3 * p + c), static_cast<Eigen::Index>(t)) =
            clip.at(t, c, p);
  return pixels;
}

// In levels; infinite where one has a mode and the other has none.
double level_error(const Answer& reference, const Answer& other) {
  double largest = 0;
  for (size_t i = 0; i < reference.background.size(); ++i) {
    const auto error = static_cast<double>(abs(reference.background[i] - other.background[i]));
    if (!(error <= largest)) largest = error;
  }
  return largest >= 0 ? largest : std::numeric_limits<double>::infinity();
}

}  // namespace

RandomWindow random_window(uint64_t seed, int most_frames, size_t most_side) {
  return Maker(seed, most_frames, most_side).make();
}

DmdOptions random_options(uint64_t seed) {
  std::mt19937 rng(static_cast<unsigned>(seed * 40503u + 7));
  DmdOptions options;
  options.rank = static_cast<int>(rng() % 5);
  if (rng() % 2) options.rank = 0;
  options.amplitude = rng() % 3 ? Amplitude::window : Amplitude::first_frame;
  const double thresholds[] = {0, 0, 0, 0, 0.05, 0.3, 1, 1e9};
  options.omega_threshold = thresholds[rng() % 8];
  return options;
}

Verdict judge(const Clip& clip, const DmdOptions& options, bool digits) {
  Verdict verdict;
  const Window window = test::to_window(clip);
  SlidingGram sliding(window.capacity());
  sliding.add_newest(window, window.size());
  const IntegerMatrix gram = sliding.matrix(window);
  std::optional<DecimalSolver> reference;
  Answer answer;
  if (digits) {
    reference.emplace(gram, pixels_of(clip));
    answer = reference->solve(options);
    // The eigenvalue iteration in 50 digits has its limit, too.
    verdict.without_reference = !answer.converged;
    digits = answer.converged;
  }
  for (Solver solver : kSolvers) {
    DmdOptions asked = options;
    asked.solver = solver;
    const Decomposition result = decompose(window, gram, asked);
    ++verdict.solves;
    if (!finite(result, window.size())) {
      verdict.faults.push_back(std::string(test::name_of(solver)) + ": not a number");
      continue;
    }
    const double bound = result.summary.rounding_bound;
    verdict.errors.push_back(-1);
    if (!digits || !(bound < std::numeric_limits<double>::infinity())) continue;
    ++verdict.finite_bounds;
    const double error =
        level_error(answer, reference->answer(quaternion_modes(window, gram, asked)));
    verdict.errors.back() = error > 0 ? error / bound : 0;
    verdict.worst = std::max(verdict.worst, verdict.errors.back());
    if (!(error <= bound)) {
      std::ostringstream line;
      line << test::name_of(solver) << ": off by " << error << " levels, bound " << bound
           << ", rank " << result.summary.rank << " of " << answer.rank << ", lambda "
           << result.summary.lambda.real() << " " << result.summary.lambda.imag() << " truly "
           << static_cast<double>(answer.lambda.real()) << " "
           << static_cast<double>(answer.lambda.imag());
      verdict.faults.push_back(line.str());
    }
  }
  return verdict;
}

}  // namespace qdmd::stability
