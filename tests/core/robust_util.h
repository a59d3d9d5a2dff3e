// SPDX-License-Identifier: LGPL-2.1-or-later
// What the tests of robust Q-DMD share: windows of real size, coarse pictures, whole runs.
#pragma once

#include <cmath>
#include <memory>

#include "core/parallel/pool.h"
#include "core/passes/grid.h"
#include "tests/core/engine_util.h"

namespace qdmd::test {

// A level as a sample: at most 255, rounded down.
inline uint8_t byte_of(float level) {
  return static_cast<uint8_t>(static_cast<int>(level < 255.0f ? level : 255.0f));
}
inline uint8_t scaled(uint8_t sample, float factor) {
  return byte_of(static_cast<float>(sample) * factor + 0.5f);
}
inline float norm(const int (&d)[3]) {
  return std::sqrt(static_cast<float>(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
}

inline Grid grid_of(int rows, int cols) {
  Grid grid;
  grid.rows = rows;
  grid.cols = cols;
  grid.width = cols;
  grid.height = rows;
  return grid;
}

inline EngineOptions robust_of(int window, int iterations = EngineOptions().iterations) {
  EngineOptions options;
  options.window_size = window;
  options.method = Method::robust;
  options.iterations = iterations;
  options.threads = 1;
  return options;
}

// All frames of a clip of width x height through an engine, drained at the end.
inline std::vector<std::vector<uint8_t>> run_engine(const Clip& clip, int width, int height,
                                                    const EngineOptions& options,
                                                    Output output = Output::background) {
  std::vector<std::vector<uint8_t>> all;
  Engine engine;
  const Status status = engine.configure(options, width, height);
  EXPECT_TRUE(status.ok()) << status.message;
  const auto take = [&] {
    while (engine.next()) {
      PackedPicture picture(width, height);
      engine.next()->pop(output, picture.out());
      all.push_back(picture.planes());
    }
  };
  for (const auto& frame : clip.frames) {
    PackedPicture picture(width, height);
    picture.fill(frame);
    EXPECT_TRUE(engine.push(picture.in()).ok());
    take();
  }
  EXPECT_TRUE(engine.drain().ok());
  take();
  return all;
}

inline double mean_error(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
  return sum / static_cast<double>(a.size());
}

// The per-sample median over a clip's frames, the upper of two middle ones.
inline std::vector<uint8_t> temporal_median(const Clip& clip) {
  std::vector<uint8_t> median(3 * clip.pixels), samples(clip.size());
  for (size_t i = 0; i < median.size(); ++i) {
    for (size_t t = 0; t < clip.size(); ++t) samples[t] = clip.frames[t][i];
    const auto middle = samples.begin() + static_cast<ptrdiff_t>(samples.size() / 2);
    std::nth_element(samples.begin(), middle, samples.end());
    median[i] = *middle;
  }
  return median;
}

// Cells of any levels.
inline GridFrames random_frames(const Grid& grid, int count, float low, float high,
                                std::mt19937& rng) {
  GridFrames frames(grid, count);
  std::uniform_real_distribution<float> level(low, high);
  for (int t = 0; t < count; ++t)
    for (int c = 0; c < kChannels; ++c)
      for (size_t i = 0; i < grid.cells(); ++i) frames.plane(t, c)[i] = level(rng);
  return frames;
}

}  // namespace qdmd::test
