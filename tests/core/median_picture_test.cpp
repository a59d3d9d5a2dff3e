// SPDX-License-Identifier: LGPL-2.1-or-later
// The median picture of stable frames against its definition, on every instruction set of this
// machine.
#include "core/learn/robust/median_picture.h"

#include "core/passes/median_block.h"
#include "tests/core/robust_util.h"
#include "tests/core/simd_targets.h"

namespace qdmd::test {
namespace {

// Snapshots of random frames; each cell has `chosen` of them.
struct Stack {
  Grid grid;
  Window window;
  std::vector<int> frame_of;
  std::vector<Gain> gains;
  StableFrames stable;

  Stack(int width, int height, int count, const std::vector<float>& lights, std::mt19937& rng)
      : grid(width, height), window(count, static_cast<size_t>(width * height)) {
    for (int t = 0; t < count; ++t)
      append_frame(window, random_picture(window.pixels(), rng, t % 3 == 0 ? 100 : 0, 255));
    for (int t = 0; t < count; ++t) {
      Gain gain;
      for (size_t c = 0; c < 3; ++c) gain[c] = lights[(static_cast<size_t>(t) + c) % lights.size()];
      gains.push_back(gain);
    }
    // The start does not see every frame.
    for (int t = 0; t<count; t += count> 40 ? 2 : 1) frame_of.push_back(t);
    stable.of_cell = FrameLists(grid.cells(), static_cast<int>(frame_of.size()));
    size_t many = 1;
    for (size_t cell = 0; cell < grid.cells(); ++cell) {
      std::vector<int> frames(frame_of.size());
      std::iota(frames.begin(), frames.end(), 0);
      std::shuffle(frames.begin(), frames.end(), rng);
      frames.resize(std::min(many, frames.size()));
      std::sort(frames.begin(), frames.end());
      for (int frame : frames) stable.of_cell.add(cell, frame);
      many = many % frame_of.size() + 1;
    }
  }
};

struct Median {
  std::vector<uint8_t> plane[3], spread;
};

template <typename T>
T middle_of(std::vector<T> values) {
  const auto high = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), high, values.end());
  const auto low = values.begin() + static_cast<ptrdiff_t>((values.size() - 1) / 2);
  const T upper = *high;
  std::nth_element(values.begin(), low, values.end());
  return static_cast<T>((*low + upper + 1) / 2);
}

Median naive_median(const Stack& stack) {
  const Grid& grid = stack.grid;
  Median out;
  for (auto& plane : out.plane) plane.resize(stack.window.pixels());
  out.spread.resize(stack.window.pixels());
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) {
      const auto known = stack.stable.of_cell[static_cast<size_t>(row * grid.cols + col)];
      std::vector<int> frames;
      const size_t count = std::min<size_t>(known.size(), kMedianFrames);
      // The middles of `count` equal parts.
      for (size_t i = 0; i < count; ++i)
        frames.push_back(
            stack.frame_of[static_cast<size_t>(known[(2 * i + 1) * known.size() / (2 * count)])]);
      for (int y = grid.top(row); y < grid.top(row + 1); ++y)
        for (int x = grid.left(col); x < grid.left(col + 1); ++x) {
          const auto p = static_cast<size_t>(y * grid.width + x);
          std::vector<std::array<int, 3>> away(count);
          for (size_t c = 0; c < 3; ++c) {
            std::vector<int> samples;
            for (int t : frames) {
              const float gain = stack.gains[static_cast<size_t>(t)][c];
              const uint8_t sample = stack.window.plane(t, static_cast<int>(c))[p];
              samples.push_back(gain == 1 ? sample : scaled(sample, 1 / gain));
            }
            const int median = middle_of(samples);
            out.plane[c][p] = static_cast<uint8_t>(median);
            for (size_t i = 0; i < count; ++i) away[i][c] = samples[i] - median;
          }
          std::vector<int> distances;
          for (const auto& d : away) {
            const int parts[3] = {d[0], d[1], d[2]};
            distances.push_back(byte_of(4 * norm(parts)));
          }
          out.spread[p] = static_cast<uint8_t>(count > 1 ? middle_of(distances) : 0);
        }
    }
  return out;
}

// What stable frames are.
std::vector<LitPicture> pictures_of(const Stack& stack) {
  std::vector<LitPicture> frames;
  for (int t : stack.frame_of)
    frames.push_back(
        {{stack.window.plane(t, 0), stack.window.plane(t, 1), stack.window.plane(t, 2)},
         stack.gains[static_cast<size_t>(t)]});
  return frames;
}

Median median_of(const Stack& stack, const std::vector<LitPicture>& frames, int threads) {
  Median out;
  for (auto& plane : out.plane) plane.assign(stack.window.pixels(), kUntouched);
  out.spread.assign(stack.window.pixels(), kUntouched);
  uint8_t* const planes[3] = {out.plane[0].data(), out.plane[1].data(), out.plane[2].data()};
  Pool pool(threads);
  median_picture(stack.grid, stack.stable, frames, &pool, planes, out.spread.data());
  return out;
}
Median median_of(const Stack& stack, int threads) {
  return median_of(stack, pictures_of(stack), threads);
}

TEST(MedianPicture, IsTheMiddleOfEveryNumberOfFrames) {
  on_every_target([] {
    std::mt19937 rng(41);
    // Cells have one frame to all, of which many are thinned; one has a single row of wide cells.
    for (const auto& [width, height, count] :
         {std::array{60, 50, 31}, {64, 49, 40}, {70, 60, 90}, {331, 2, 7}, {1, 1, 1}}) {
      SCOPED_TRACE(testing::Message() << width << " x " << height << ", " << count);
      const Stack stack(width, height, count, {1}, rng);
      const Median expected = naive_median(stack), found = median_of(stack, 1);
      for (size_t c = 0; c < 3; ++c) ASSERT_EQ(found.plane[c], expected.plane[c]);
      ASSERT_EQ(found.spread, expected.spread);
    }
  });
}

TEST(MedianPicture, IsTakenInUnitLight) {
  on_every_target([] {
    std::mt19937 rng(42);
    const Stack exact(50, 60, 35, {1, 0.5f, 2, 0.25f}, rng);
    const Median expected = naive_median(exact), found = median_of(exact, 2);
    for (size_t c = 0; c < 3; ++c) ASSERT_EQ(found.plane[c], expected.plane[c]);
    ASSERT_EQ(found.spread, expected.spread);
    // Fused multiply-adds may round other ties.
    const Stack any(50, 60, 35, {1, 0.83f, 1.17f}, rng);
    const Median near = naive_median(any), other = median_of(any, 2);
    for (size_t p = 0; p < any.window.pixels(); ++p) {
      for (size_t c = 0; c < 3; ++c) ASSERT_NEAR(other.plane[c][p], near.plane[c][p], 1);
      ASSERT_NEAR(other.spread[p], near.spread[p], 4 * std::sqrt(3.0) * 2 + 1);
    }
  });
}

// Chroma that pixels share, in planes of its own and spread over the stack's frames.
std::vector<std::vector<uint8_t>> share_chroma(const ChromaShape& shape, std::mt19937& rng,
                                               Stack* stack) {
  std::vector<std::vector<uint8_t>> planes;
  for (int t = 0; t < stack->window.size(); ++t)
    for (int c = 1; c < kChannels; ++c) {
      std::vector<uint8_t>& samples = planes.emplace_back(shape.samples());
      for (uint8_t& sample : samples) sample = static_cast<uint8_t>(rng() % 256);
      for (int y = 0; y < shape.height; ++y)
        for (int x = 0; x < shape.width; ++x)
          stack->window.plane(stack->window.slot(t), c)[y * shape.width + x] =
              samples[static_cast<size_t>(y / shape.rows * shape.chroma_width() + x / 2)];
    }
  return planes;
}

// Cells of an odd width begin with the second pixel of a pair. What an earlier window found is a
// frame whose pixels have their own samples.
TEST(MedianPicture, OfSharedSamplesIsThatOfPixels) {
  on_every_target([] {
    std::mt19937 rng(44);
    for (const auto& [width, height, count] :
         {std::array{60, 50, 31}, {63, 49, 40}, {70, 60, 20}, {331, 3, 7}, {1300, 7, 5}, {1, 1, 1}})
      for (int rows : {1, 2})
        for (int own : {0, 2, 7}) {
          SCOPED_TRACE(testing::Message() << width << " x " << height << ", " << count << ", "
                                          << rows << " rows, own samples in " << own);
          const ChromaShape shape = {width, height, 2, rows};
          Stack stack(width, height, count, {1, 0.5f, 2, 0.25f}, rng);
          const auto shared = share_chroma(shape, rng, &stack);
          std::vector<LitPicture> frames = pictures_of(stack);
          for (size_t i = 0; i < frames.size(); ++i) {
            if (own > 0 && i % static_cast<size_t>(own) == 0) continue;
            const auto t = static_cast<size_t>(stack.frame_of[i]);
            for (size_t c = 1; c < kChannels; ++c)
              frames[i].plane[c] = shared[(kChannels - 1) * t + c - 1].data();
            frames[i].shape = shape;
          }
          const Median expected = naive_median(stack), found = median_of(stack, frames, 2);
          for (size_t c = 0; c < 3; ++c) ASSERT_EQ(found.plane[c], expected.plane[c]);
          ASSERT_EQ(found.spread, expected.spread);
        }
  });
}

TEST(MedianPicture, AnyNumberOfThreadsGivesTheSameBits) {
  std::mt19937 rng(43);
  const Stack stack(120, 90, 33, {1, 0.9f}, rng);
  const Median one = median_of(stack, 1);
  for (int threads : {2, 3, 7}) {
    const Median other = median_of(stack, threads);
    for (size_t c = 0; c < 3; ++c) EXPECT_EQ(other.plane[c], one.plane[c]);
    EXPECT_EQ(other.spread, one.spread);
  }
}

}  // namespace
}  // namespace qdmd::test
