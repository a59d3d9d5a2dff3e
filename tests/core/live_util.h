// SPDX-License-Identifier: LGPL-2.1-or-later
// The live mode the slow way: every model afresh from its frames.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/dmd/channel_dmd.h"
#include "core/dmd/decompose.h"
#include "core/engine/live_plan.h"
#include "core/foreground/foreground.h"
#include "tests/core/engine_util.h"

namespace qdmd::test {

inline EngineOptions live_of(int window, int hop = 0) {
  EngineOptions options = window_of(window);
  options.mode = Mode::live;
  options.hop_size = hop;
  options.threads = 1;
  return options;
}

// Every k-th pixel in x and y of frames of width x height.
inline Clip sampled(const Clip& clip, int width, int height, int step) {
  std::vector<size_t> kept;
  for (int row = 0; row < height; row += step)
    for (int col = 0; col < width; col += step)
      kept.push_back(static_cast<size_t>(row * width + col));
  Clip small(kept.size(), clip.size());
  for (size_t t = 0; t < clip.size(); ++t)
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < kept.size(); ++p) small.at(t, c, p) = clip.at(t, c, kept[p]);
  return small;
}

inline Clip part_of(const Clip& clip, size_t first, size_t count) {
  Clip part(clip.pixels, count);
  std::copy_n(clip.frames.begin() + static_cast<ptrdiff_t>(first), count, part.frames.begin());
  return part;
}

// L(t) of a window by the definition, in plain loops over the modes' numbers: nothing of the
// engine's arithmetic for pictures is in it.
class PlainModel {
 public:
  PlainModel(const Window& seen, const IntegerMatrix& gram, const DmdOptions& options,
             bool channels)
      : snapshots_(seen.size()) {
    if (snapshots_ == 1) {
      // A single snapshot is its own background.
      modes_.push_back({-1, 1.0, 0, {{1, 0, 0, 0}}, {1, 0, 0, 0}});
      return;
    }
    if (channels) {
      for (int c = 0; c < kChannels; ++c) add(c, channel_dmd(channel_gram(gram, c), options));
      return;
    }
    const BackgroundModes found = quaternion_modes(seen, gram, options);
    for (Eigen::Index p = 0; p < found.eigenvalues.size(); ++p) {
      Mode mode{-1, found.eigenvalues(p), found.reference_times(p), {}, {}};
      for (int t = 0; t < snapshots_; ++t)
        mode.combination.push_back(parts_of(found.combination.get(t, p)));
      mode.amplitude = parts_of(found.amplitudes.get(p, 0));
      modes_.push_back(mode);
    }
  }

  struct Level {
    double value = 0;
    double scale = 0;  // the sum of what is added up to it, each in absolute value
  };
  // The level of each sample, three planes.
  std::vector<Level> at(const Clip& clip, double t) const {
    std::vector<Level> levels(3 * clip.pixels);
    for (const Mode& mode : modes_) {
      const std::complex<double> growth =
          t == mode.reference_time ? 1 : std::pow(mode.lambda, t - mode.reference_time);
      // The factor of (R i + G j + B k) in (R i + G j + B k) c (g b): one quaternion for a
      // snapshot, whatever the pixel.
      const Parts grown = product({growth.real(), growth.imag(), 0, 0}, mode.amplitude);
      for (size_t s = 0; s < clip.size(); ++s) {
        const Parts share = product(mode.combination[s], grown);
        const double size = 255 * size_of(mode.combination[s]) * size_of(grown);
        for (size_t p = 0; p < clip.pixels; ++p) {
          Parts x = {0, 0, 0, 0};
          for (size_t c = 0; c < 3; ++c)
            if (mode.channel < 0) x[c + 1] = clip.at(s, c, p);
          // A channel's mode is complex: its real part counts.
          if (mode.channel >= 0) x[0] = clip.at(s, static_cast<size_t>(mode.channel), p);
          const Parts l = product(x, share);
          for (size_t c = 0; c < 3; ++c) {
            Level& level = levels[c * clip.pixels + p];
            if (mode.channel < 0) level.value += l[c + 1];
            if (mode.channel == static_cast<int>(c)) level.value += l[0];
            level.scale += size;
          }
        }
      }
    }
    return levels;
  }

 private:
  using Parts = std::array<double, 4>;  // 1, i, j, k
  struct Mode {
    int channel;  // -1: all, as quaternions
    std::complex<double> lambda;
    double reference_time;
    std::vector<Parts> combination;  // of the snapshots
    Parts amplitude;
  };

  static Parts parts_of(const Quaterniond& q) { return {q.w, q.x, q.y, q.z}; }
  static Parts parts_of(const std::complex<double>& c) { return {c.real(), c.imag(), 0, 0}; }
  static double size_of(const Parts& q) {
    return std::abs(q[0]) + std::abs(q[1]) + std::abs(q[2]) + std::abs(q[3]);
  }
  // Hamilton's: i j = k, j k = i, k i = j.
  static Parts product(const Parts& a, const Parts& b) {
    return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
  }
  static Eigen::MatrixXd channel_gram(const IntegerMatrix& gram, int channel) {
    const Eigen::Index m = gram.rows() / kChannels;
    Eigen::MatrixXd g(m, m);
    for (Eigen::Index s = 0; s < m; ++s)
      for (Eigen::Index t = 0; t < m; ++t)
        g(s, t) = static_cast<double>(gram(kChannels * s + channel, kChannels * t + channel));
    return g;
  }
  void add(int channel, const ChannelModes& found) {
    for (Eigen::Index p = 0; p < found.eigenvalues.size(); ++p) {
      Mode mode{channel, found.eigenvalues(p), found.reference_times(p), {}, {}};
      for (int t = 0; t < snapshots_; ++t)
        mode.combination.push_back(parts_of(found.combination(t, p)));
      mode.amplitude = parts_of(found.amplitudes(p));
      modes_.push_back(mode);
    }
  }

  int snapshots_;
  std::vector<Mode> modes_;
};

// The model of a clip's frames [first, first + count) from a Gram matrix of their own. Slices,
// threads and time change no bit of it, and that is what it is for; what it says is compared with
// the definition, too.
struct FreshModel {
  Clip clip;
  Window window;
  BackgroundModel model;
  DmdSummary summary;
  ForegroundStatistics foreground;
  std::optional<PlainModel> plain;

  // `seen`: what the decomposition sees of the same frames.
  FreshModel(const Clip& clip_, const Clip& seen, const EngineOptions& options)
      : clip(clip_), window(to_window(clip)) {
    DmdOptions dmd = options.dmd;
    const bool live = options.mode == Mode::live;
    if (live) dmd.max_modes = BackgroundModel::most_modes(options.window_size);
    const Window seen_window = to_window(seen);
    const IntegerMatrix gram = gram_of(seen_window);
    const bool channels = options.method == Method::dmd;
    const Decomposition decomposition =
        channels ? decompose_channels(gram, dmd) : decompose(seen_window, gram, dmd);
    plain.emplace(seen_window, gram, dmd, channels);
    summary = decomposition.summary;
    model.begin(window, decomposition.background, live);
    model.build_slice(0, clip.pixels);
    Pool pool(1);
    foreground = foreground_statistics(window, model, options.foreground_threshold, pool);
    expect_foreground_by_sorting(options.foreground_threshold);
  }
  FreshModel(const Clip& clip_, const EngineOptions& options) : FreshModel(clip_, clip_, options) {}
  FreshModel(const FreshModel&) = delete;
  FreshModel& operator=(const FreshModel&) = delete;

  // As `evaluate`, and no farther from the definition than rounding takes it.
  std::vector<uint8_t> background(double t) {
    const std::vector<uint8_t> out = evaluate(t);
    const auto exact = plain->at(clip, t);
    // Half a level for 8 bits. Pictures and weights are in single precision: each is rounded and
    // every picture is added once, some four operations for each of 3 m samples' shares at most.
    constexpr double kSingle = std::numeric_limits<float>::epsilon();
    for (size_t i = 0; i < out.size(); ++i) {
      const double tolerance =
          0.5 + 4 * 3 * static_cast<double>(clip.size()) * kSingle * exact[i].scale;
      const double error = std::abs(out[i] - std::clamp(exact[i].value, 0.0, 255.0));
      if (!(error <= tolerance)) {
        ADD_FAILURE() << "sample " << i << " at time " << t << " is " << int{out[i]} << ", not "
                      << exact[i].value << " within " << tolerance;
        break;
      }
    }
    return out;
  }

 private:
  std::vector<uint8_t> evaluate(double t) {
    std::vector<uint8_t> out(3 * clip.pixels);
    model.set_time(t);
    for (size_t first = 0; first < clip.pixels; first += kMaxRun) {
      uint8_t* const rows[3] = {out.data() + first, out.data() + clip.pixels + first,
                                out.data() + 2 * clip.pixels + first};
      model.evaluate(first, std::min(kMaxRun, clip.pixels - first), rows);
    }
    return out;
  }

  // Small pictures are looked at as a whole, in up to 12 frames that are spread evenly.
  void expect_foreground_by_sorting(double fixed_threshold) {
    if (clip.pixels > kMaxRun) return;
    std::vector<double> residuals;
    const size_t last = clip.size() - 1, frames = std::min<size_t>(12, clip.size());
    for (size_t i = 0; i < frames; ++i) {
      const size_t t = last == 0 ? 0 : i * last / (frames - 1);
      const auto level = evaluate(static_cast<double>(t));
      for (size_t p = 0; p < clip.pixels; ++p) {
        double squares = 0;
        for (size_t c = 0; c < 3; ++c)
          squares += std::pow(clip.at(t, c, p) - level[c * clip.pixels + p], 2);
        residuals.push_back(std::sqrt(squares));
      }
    }
    std::sort(residuals.begin(), residuals.end());
    // The quartile is told to an eighth of a level, as are those that are above the threshold; a
    // few epsilon for the division.
    constexpr double kBin = 1.0 / 8;
    const double quartile = residuals[(residuals.size() + 3) / 4 - 1];
    const double found = 1.1012 * foreground.noise;
    EXPECT_LE(found, quartile + 4 * kEpsilon * 442);
    EXPECT_GT(found, quartile - kBin - 4 * kEpsilon * 442);
    const double automatic = std::max(4 * std::sqrt(3.0) * foreground.noise, 18.0);
    EXPECT_NEAR(foreground.threshold, fixed_threshold > 0 ? fixed_threshold : automatic,
                4 * kEpsilon * 442 * 7);
    const auto above = [&](double threshold) {
      const auto first = std::upper_bound(residuals.begin(), residuals.end(), threshold);
      return static_cast<double>(residuals.end() - first) / static_cast<double>(residuals.size());
    };
    EXPECT_LE(foreground.ratio, above(foreground.threshold) + kEpsilon);
    EXPECT_GE(foreground.ratio, above(foreground.threshold + kBin) - kEpsilon);
  }
};

// A frame's picture by the definition of the output.
inline std::vector<uint8_t> picture_of(const std::vector<uint8_t>& frame,
                                       const std::vector<uint8_t>& background, Output output,
                                       double threshold) {
  const size_t pixels = frame.size() / 3;
  std::vector<uint8_t> out(frame.size());
  for (size_t p = 0; p < pixels; ++p) {
    int squared = 0;
    for (size_t c = 0; c < 3; ++c) {
      const int difference = frame[c * pixels + p] - background[c * pixels + p];
      squared += difference * difference;
    }
    const bool white = std::sqrt(squared) > threshold;
    for (size_t c = 0; c < 3; ++c) {
      const size_t i = c * pixels + p;
      switch (output) {
        case Output::background:
          out[i] = background[i];
          break;
        case Output::foreground:
          out[i] = static_cast<uint8_t>(std::abs(frame[i] - background[i]));
          break;
        case Output::mask:
          out[i] = white ? 255 : 0;
          break;
        case Output::cutout:
          out[i] = white ? frame[i] : 0;
          break;
      }
    }
  }
  return out;
}

inline constexpr Output kOutputs[] = {Output::background, Output::foreground, Output::mask,
                                      Output::cutout};

// When a window that fills up is solved: frame numbers from 1, by the definition.
inline bool is_boundary(int frame, int hop, int first_solve = 1) {
  int solve = first_solve;
  while (solve < frame) solve += std::clamp(solve / 2, 1, hop);
  return solve == frame;
}

inline int hop_of(const EngineOptions& options) {
  return options.hop_size > 0 ? options.hop_size : std::max(1, options.window_size / 4);
}

// What a live engine with small frames of width x 1 must give for frames [0, clip.size()): each
// solve is there with its own last frame.
class NaiveLive {
 public:
  NaiveLive(const Clip& clip, const EngineOptions& options) : clip_(clip), options_(options) {}

  std::vector<uint8_t> next(Output output) {
    const size_t t = frame_++;
    if (is_boundary(static_cast<int>(t) + 1, hop_of(options_))) {
      const size_t size = std::min(t + 1, static_cast<size_t>(options_.window_size));
      first_ = t + 1 - size;
      const Clip part = part_of(clip_, first_, size);
      const int step = std::max(options_.sample_step, 1);
      newest_ = std::make_unique<FreshModel>(
          part, sampled(part, static_cast<int>(clip_.pixels), 1, step), options_);
      ++solves_;
    }
    background_ = newest_->background(static_cast<double>(t - first_));
    return picture_of(clip_.frames[t], background_, output, newest_->foreground.threshold);
  }
  uint64_t solves() const { return solves_; }
  const FreshModel& newest() const { return *newest_; }

 private:
  const Clip& clip_;
  EngineOptions options_;
  size_t frame_ = 0, first_ = 0;
  uint64_t solves_ = 0;
  std::unique_ptr<FreshModel> newest_;
  std::vector<uint8_t> background_;
};

// Pushes a clip through a live engine and compares every picture.
inline void expect_naive(const Clip& clip, EngineOptions options,
                         Output output = Output::background) {
  options = with_pixels_alone(options);
  Strip strip(clip.pixels, options);
  NaiveLive naive(clip, options);
  for (size_t t = 0; t < clip.size(); ++t) {
    ASSERT_TRUE(strip.push(clip.frames[t]).ok());
    ASSERT_TRUE(strip.engine.next());
    ASSERT_EQ(strip.engine.report().pending, 1);
    ASSERT_EQ(strip.pop(output), naive.next(output)) << "frame " << t;
    ASSERT_FALSE(strip.engine.next());
    ASSERT_EQ(strip.engine.report().pending, 0);
    ASSERT_EQ(strip.engine.report().solves, naive.solves());
    ASSERT_EQ(strip.engine.report().solve.window_frames, naive.newest().window.size());
    ASSERT_EQ(strip.engine.report().solve.foreground.threshold,
              naive.newest().foreground.threshold);
    ASSERT_EQ(strip.engine.report().solve.dmd.lambda, naive.newest().summary.lambda);
  }
}

}  // namespace qdmd::test
