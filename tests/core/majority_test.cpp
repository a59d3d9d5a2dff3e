// SPDX-License-Identifier: LGPL-2.1-or-later
// The majority of a mask's pixels: against counting, and in the pictures that the engine writes.
#include "core/passes/majority.h"

#include "core/foreground/vote.h"

#include "core/foreground/decision.h"
#include "tests/core/engine_util.h"
#include "tests/core/simd_targets.h"

namespace qdmd::test {
namespace {

// A mask after the vote of the pixels at most `reach` rows and columns away. The border's pixels
// stand for those outside.
std::vector<uint8_t> voted_by_counting(const std::vector<uint8_t>& mask, int width, int height,
                                       int reach) {
  const auto at = [&](int col, int row) {
    const int inside = std::clamp(row, 0, height - 1) * width + std::clamp(col, 0, width - 1);
    return mask[static_cast<size_t>(inside)];
  };
  std::vector<uint8_t> voted;
  for (int row = 0; row < height; ++row)
    for (int col = 0; col < width; ++col) {
      int white = 0, black = 0;
      for (int y = -reach; y <= reach; ++y)
        for (int x = -reach; x <= reach; ++x) ++(at(col + x, row + y) == 255 ? white : black);
      const bool own = at(col, row) == 255;
      const bool overruled = 5 * (own ? black : white) >= 3 * (white + black);
      voted.push_back(own != overruled ? 255 : 0);
    }
  return voted;
}

TEST(Majority, OfRowsIsCounted) {
  std::mt19937 rng(310);
  on_every_target([&] {
    for (size_t count : {1u, 2u, 15u, 16u, 33u, 64u, 127u, 1020u})
      for (int reach : {1, 2}) {
        const auto rows = static_cast<size_t>(2 * reach + 1);
        std::vector<std::vector<uint8_t>> padded;
        std::vector<std::unique_ptr<BeforeTheEdge<uint8_t>>> counts;
        std::vector<const uint8_t*> around;
        for (size_t r = 0; r < rows; ++r) {
          BeforeTheEdge<uint8_t> row(count + rows - 1);
          for (uint8_t& sample : row) sample = rng() % 256 > 120 ? 255 : 0;
          padded.emplace_back(row.begin(), row.end());
          counts.push_back(std::make_unique<BeforeTheEdge<uint8_t>>(count));
          count_columns(row.data(), count, reach, counts.back()->data());
          around.push_back(counts.back()->data());
        }
        BeforeTheEdge<uint8_t> out(count);
        const auto middle = static_cast<size_t>(reach);
        const uint8_t* const own = padded[middle].data() + middle;
        vote_row(around.data(), own, count, reach, out.data());
        for (size_t p = 0; p < count; ++p) {
          size_t white = 0;
          for (const auto& row : padded)
            for (size_t i = 0; i < rows; ++i) white += row[p + i] == 255;
          const size_t all = rows * rows, others = own[p] ? all - white : white;
          ASSERT_EQ(out[p] == 255, (own[p] == 255) != (5 * others >= 3 * all))
              << p << " of " << count;
        }
      }
  });
}

TEST(Majority, FollowsThePicturesSize) {
  EXPECT_EQ(voting_reach(320, 240), 2);
  EXPECT_EQ(voting_reach(240, 1080), 2);
  EXPECT_EQ(voting_reach(7680, 4320), 2);
  EXPECT_EQ(voting_reach(320, 239), 1);
  EXPECT_EQ(voting_reach(120, 120), 1);
  EXPECT_EQ(voting_reach(119, 1000), 0);
  EXPECT_EQ(voting_reach(1, 1), 0);
}

// Boxes that come and go, and noise of which some is above the threshold.
std::vector<uint8_t> frame(int width, int height, int t, std::mt19937& rng) {
  const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  std::vector<uint8_t> planes(3 * pixels);
  std::normal_distribution<float> noise(0, 7);
  for (size_t c = 0; c < 3; ++c)
    for (int row = 0; row < height; ++row)
      for (int col = 0; col < width; ++col) {
        const bool box = (col + 9 * t) % 37 < 6 && (row + 5 * t) % 23 < 7;
        const float level = static_cast<float>(box ? 170 : 90 + (row + col) % 40) + noise(rng);
        planes[c * pixels + static_cast<size_t>(row * width + col)] =
            static_cast<uint8_t>(std::clamp(level, 0.0f, 255.0f));
      }
  return planes;
}

// All pictures of one solve.
std::vector<std::vector<uint8_t>> pictures(const std::vector<std::vector<uint8_t>>& frames,
                                           int width, int height, Output output, int threads,
                                           bool by_regions = false) {
  auto options = window_of(static_cast<int>(frames.size()));
  options.dmd.rank = 1;
  options.foreground_threshold = 21;
  options.steps = {false, false, false, false, true, false};
  options.threads = threads;
  Engine engine;
  EXPECT_TRUE(engine.configure(options, width, height).ok());
  PackedPicture picture(width, height, 4, false, 4);
  for (const auto& planes : frames) {
    picture.fill(planes);
    EXPECT_TRUE(engine.push(picture.in()).ok());
  }
  EXPECT_TRUE(engine.drain().ok());
  std::vector<std::vector<uint8_t>> all;
  while (engine.next()) {
    if (by_regions) {
      std::vector<uint8_t> mask(picture.pixels()), residual(picture.pixels());
      engine.next()->foreground(mask.data(), residual.data());
      all.push_back(mask);
    }
    engine.next()->pop(output, picture.out());
    if (!by_regions) all.push_back(picture.planes());
  }
  return all;
}

TEST(Majority, IsWhatTheEngineWrites) {
  for (auto [width, height] : {std::pair{130, 121},
                               {1100, 125},
                               {1030, 245},
                               {120, 120},
                               {241, 240},
                               {119, 140},
                               {1100, 300},
                               {1021, 240},
                               {1022, 120}}) {
    SCOPED_TRACE(testing::Message() << width << "x" << height);
    std::mt19937 rng(311);
    std::vector<std::vector<uint8_t>> frames;
    for (int t = 0; t < 3; ++t) frames.push_back(frame(width, height, t, rng));
    const auto residual = pictures(frames, width, height, Output::foreground, 1);
    const size_t pixels = residual[0].size() / 3;
    size_t changed = 0;
    for (int threads : {1, 3}) {
      const auto mask = pictures(frames, width, height, Output::mask, threads);
      const auto cutout = pictures(frames, width, height, Output::cutout, threads);
      const auto of_regions = pictures(frames, width, height, Output::mask, threads, true);
      ASSERT_EQ(mask.size(), frames.size());
      for (size_t t = 0; t < frames.size(); ++t) {
        std::vector<uint8_t> alone(pixels);
        for (size_t p = 0; p < pixels; ++p) {
          int squared = 0;
          for (size_t c = 0; c < 3; ++c)
            squared += residual[t][c * pixels + p] * residual[t][c * pixels + p];
          alone[p] = squared > 21 * 21 ? 255 : 0;
        }
        const auto voted = voted_by_counting(alone, width, height, voting_reach(width, height));
        for (size_t p = 0; p < pixels; ++p) {
          changed += voted[p] != alone[p];
          ASSERT_EQ(of_regions[t][p], voted[p]) << t << ", " << p;
          for (size_t c = 0; c < 3; ++c) {
            const size_t i = c * pixels + p;
            ASSERT_EQ(mask[t][i], voted[p]) << t << ", " << p;
            ASSERT_EQ(cutout[t][i], voted[p] ? frames[t][i] : 0) << t << ", " << p;
          }
        }
      }
    }
    EXPECT_EQ(changed > 0, voting_reach(width, height) > 0) << "specks and holes are there";
  }
}

}  // namespace
}  // namespace qdmd::test
