// The live mode the slow way: every model afresh from its frames.
#pragma once

#include <algorithm>
#include <string>

#include "core/foreground/foreground.h"
#include "core/engine/live_plan.h"
#include "core/dmd/decompose.h"
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

// The model of a clip's frames [first, first + count) from a Gram matrix of their own.
struct FreshModel {
  Clip clip;
  Window window;
  BackgroundModel model;
  DmdSummary summary;
  ForegroundStatistics foreground;

  // `seen`: what the decomposition sees of the same frames.
  FreshModel(const Clip& clip_, const Clip& seen, const EngineOptions& options)
      : clip(clip_), window(to_window(clip)) {
    DmdOptions dmd = options.dmd;
    const bool live = options.mode == Mode::live;
    if (live) dmd.max_modes = BackgroundModel::most_modes(options.window_size);
    const Window seen_window = to_window(seen);
    const Decomposition decomposition =
        options.method == Method::dmd ? decompose_channels(gram_of(seen_window), dmd)
                                      : decompose(seen_window, gram_of(seen_window), dmd);
    summary = decomposition.summary;
    model.begin(window, decomposition.background, live);
    model.build_slice(0, clip.pixels);
    foreground = foreground_statistics(window, model, options.foreground_threshold);
  }
  FreshModel(const Clip& clip_, const EngineOptions& options) : FreshModel(clip_, clip_, options) {}
  FreshModel(const FreshModel&) = delete;
  FreshModel& operator=(const FreshModel&) = delete;

  std::vector<uint8_t> background(double t) {
    std::vector<uint8_t> out(3 * clip.pixels);
    model.set_time(t);
    for (size_t first = 0; first < clip.pixels; first += kMaxRun) {
      uint8_t* const rows[3] = {out.data() + first, out.data() + clip.pixels + first,
                                out.data() + 2 * clip.pixels + first};
      model.evaluate(first, std::min(kMaxRun, clip.pixels - first), rows);
    }
    return out;
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
inline void expect_naive(const Clip& clip, const EngineOptions& options,
                         Output output = Output::background) {
  Strip strip(clip.pixels, options);
  NaiveLive naive(clip, options);
  for (size_t t = 0; t < clip.size(); ++t) {
    ASSERT_TRUE(strip.push(clip.frames[t]).ok());
    ASSERT_TRUE(strip.engine.ready());
    ASSERT_EQ(strip.engine.pending(), 1);
    ASSERT_EQ(strip.pop(output), naive.next(output)) << "frame " << t;
    ASSERT_FALSE(strip.engine.ready());
    ASSERT_EQ(strip.engine.pending(), 0);
    ASSERT_EQ(strip.engine.solves(), naive.solves());
    ASSERT_EQ(strip.engine.report().window_frames, naive.newest().window.size());
    ASSERT_EQ(strip.engine.report().foreground.threshold, naive.newest().foreground.threshold);
    ASSERT_EQ(strip.engine.report().dmd.lambda, naive.newest().summary.lambda);
  }
}

}  // namespace qdmd::test
