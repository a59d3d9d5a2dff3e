// The passes of robust Q-DMD over pixels against their definitions, on every instruction set of
// this machine.
#include "core/background/robust/fill.h"
#include "core/background/robust/median_picture.h"
#include "tests/core/robust_util.h"
#include "tests/core/simd_targets.h"

namespace qdmd::test {
namespace {

uint8_t byte_of(float level) {
  return static_cast<uint8_t>(static_cast<int>(level < 255.0f ? level : 255.0f));
}
uint8_t scaled(uint8_t sample, float factor) {
  return byte_of(static_cast<float>(sample) * factor + 0.5f);
}
float norm(const int (&d)[3]) {
  return std::sqrt(static_cast<float>(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
}

// A frame and a reference of which parts are alike.
struct Case {
  Reference reference;
  std::vector<uint8_t> frame[3];

  Case(int width, int height, std::mt19937& rng, float gain = 1, bool reach = false) {
    reference.width = width;
    reference.height = height;
    const size_t pixels = reference.pixels();
    std::normal_distribution<float> noise(0, 6);
    for (size_t c = 0; c < 3; ++c) {
      reference.level[c].resize(pixels);
      frame[c].resize(pixels);
      for (size_t p = 0; p < pixels; ++p) {
        reference.level[c][p] = static_cast<uint8_t>(rng() % 256);
        const float seen = static_cast<float>(reference.level[c][p]) * gain + noise(rng);
        frame[c][p] = byte_of(std::max(0.0f, seen));
      }
    }
    // Objects: runs of other levels.
    for (size_t p = 0; p < pixels; ++p)
      if (p / 7 % 4 == 0)
        for (auto& plane : frame) plane[p] = static_cast<uint8_t>(rng() % 256);
    reference.threshold.resize(pixels);
    for (auto& t : reference.threshold) t = static_cast<uint8_t>(6 + rng() % 60);
    if (rng() % 8 == 0) reference.threshold[rng() % pixels] = 255;
    if (!reach) return;
    reference.reach.resize(pixels);
    for (auto& r : reference.reach) r = static_cast<uint8_t>(rng() % 30);
  }
  // The three planes for a call.
  std::array<const uint8_t*, 3> x() const {
    return {frame[0].data(), frame[1].data(), frame[2].data()};
  }
};

// fill_rows() of a whole frame by its definition. margin: how far a pixel's mean residual is from
// its threshold.
struct Filled {
  std::vector<uint8_t> plane[3];
  std::vector<double> margin;
};

Filled naive_fill(const Case& c, const Gain& gain) {
  const Reference& r = c.reference;
  const bool lit = is_lit(gain);
  std::vector<int> residual(r.pixels());
  for (size_t p = 0; p < r.pixels(); ++p) {
    int d[3];
    for (size_t k = 0; k < 3; ++k)
      d[k] = c.frame[k][p] - (lit ? scaled(r.level[k][p], gain[k]) : r.level[k][p]);
    residual[p] = byte_of(norm(d));
  }
  Filled out;
  out.margin.resize(r.pixels());
  for (auto& plane : out.plane) plane.resize(r.pixels());
  for (int y = 0; y < r.height; ++y)
    for (int x = 0; x < r.width; ++x) {
      int sum = 0;
      for (int dy = -2; dy <= 2; ++dy)
        for (int dx = -2; dx <= 2; ++dx)
          sum += residual[static_cast<size_t>(std::clamp(y + dy, 0, r.height - 1) * r.width +
                                              std::clamp(x + dx, 0, r.width - 1))];
      const auto p = static_cast<size_t>(y * r.width + x);
      out.margin[p] = std::abs(sum / 25.0 - r.threshold[p]);
      for (size_t k = 0; k < 3; ++k) {
        const int level = r.level[k][p];
        int sample = lit ? scaled(c.frame[k][p], 1 / gain[k]) : c.frame[k][p];
        if (sum > 25 * r.threshold[p]) sample = level;
        if (!r.reach.empty()) {
          const int reach = r.reach[p];
          // std::round() rounds halves away from zero.
          const double drawn = std::round(1.5 * std::clamp(sample - level, -reach, reach));
          sample = std::clamp(level + static_cast<int>(drawn), 0, 255);
        }
        out.plane[k][p] = static_cast<uint8_t>(sample);
      }
    }
  return out;
}

// By fill_rows() in strips of `rows`.
Filled fill(const Case& c, const Gain& gain, int rows) {
  const auto width = static_cast<size_t>(c.reference.width);
  std::vector<uint8_t> scratch;
  Filled out;
  for (auto& plane : out.plane) plane.assign(c.reference.pixels(), kUntouched);
  for (int first = 0; first < c.reference.height; first += rows) {
    const int count = std::min(rows, c.reference.height - first);
    // Memory of its own, so that a sample too many is seen.
    std::unique_ptr<BeforeTheEdge<uint8_t>> strips[3];
    for (auto& strip : strips)
      strip = std::make_unique<BeforeTheEdge<uint8_t>>(width * static_cast<size_t>(count));
    uint8_t* const to[3] = {strips[0]->data(), strips[1]->data(), strips[2]->data()};
    fill_rows(c.reference, c.x().data(), gain, first, count, to, &scratch);
    for (size_t k = 0; k < 3; ++k)
      std::copy(strips[k]->begin(), strips[k]->end(),
                out.plane[k].begin() + static_cast<ptrdiff_t>(static_cast<size_t>(first) * width));
  }
  return out;
}

// ---- Filling ----

TEST(FillRows, IsTheFiveByFiveDecision) {
  on_every_target([] {
    std::mt19937 rng(31);
    for (int width = 1; width <= 70; ++width) {
      const int height = 1 + static_cast<int>(rng() % 12);
      for (bool reach : {false, true}) {
        const Case c(width, height, rng, 1, reach);
        const Filled expected = naive_fill(c, kSameLight), filled = fill(c, kSameLight, height);
        for (size_t k = 0; k < 3; ++k)
          ASSERT_EQ(filled.plane[k], expected.plane[k]) << width << " x " << height;
      }
    }
  });
}

// Powers of two: scaling rounds the same way with and without fused multiply-adds.
TEST(FillRows, IsDoneInUnitLight) {
  on_every_target([] {
    std::mt19937 rng(32);
    for (int width : {1, 4, 5, 16, 33, 64, 67})
      for (float g : {0.25f, 0.5f, 2.0f}) {
        const Case c(width, 9, rng, g, width % 2 == 1);
        const Gain gain = {g, g, 2 * g};
        const Filled expected = naive_fill(c, gain), filled = fill(c, gain, 9);
        for (size_t k = 0; k < 3; ++k) ASSERT_EQ(filled.plane[k], expected.plane[k]) << width;
      }
  });
}

TEST(FillRows, AnyGainIsWithinItsRounding) {
  on_every_target([] {
    std::mt19937 rng(33);
    for (float g : {0.37f, 0.9f, 1.3f}) {
      const Case c(61, 14, rng, g);
      const Gain gain = {g, 1.1f * g, 0.9f};
      const Filled expected = naive_fill(c, gain), filled = fill(c, gain, 5);
      for (size_t k = 0; k < 3; ++k)
        for (size_t p = 0; p < c.reference.pixels(); ++p)
          if (expected.margin[p] > 1) {
            ASSERT_NEAR(filled.plane[k][p], expected.plane[k][p], 1);
          }
    }
  });
}

TEST(FillRows, AnyStripsGiveTheSameRows) {
  on_every_target([] {
    std::mt19937 rng(34);
    for (float g : {1.0f, 0.7f}) {
      const Case c(43, 23, rng, g, true);
      const Gain gain = {g, g, g};
      const Filled whole = fill(c, gain, 23);
      for (int rows : {1, 2, 3, 4, 5, 7, 11, 22})
        for (size_t k = 0; k < 3; ++k)
          ASSERT_EQ(fill(c, gain, rows).plane[k], whole.plane[k]) << rows;
    }
  });
}

TEST(FillRows, TheSameFrameComesBack) {
  std::mt19937 rng(35);
  Case c(50, 20, rng);
  for (size_t k = 0; k < 3; ++k) c.frame[k] = c.reference.level[k];
  for (size_t k = 0; k < 3; ++k) EXPECT_EQ(fill(c, kSameLight, 6).plane[k], c.reference.level[k]);
}

TEST(FillSamples, IsTheDecisionOfThePixelAlone) {
  std::mt19937 rng(36);
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 5}, {40, 31}})
    for (int step : {1, 2, 3, 8})
      for (float g : {1.0f, 0.5f, 2.0f}) {
        const Case c(width, height, rng, g);
        const Gain gain = {g, g, g};
        const auto cols = static_cast<size_t>((width + step - 1) / step);
        const size_t count = cols * static_cast<size_t>((height + step - 1) / step);
        BeforeTheEdge<uint8_t> r(count), gr(count), b(count);
        uint8_t* const out[3] = {r.data(), gr.data(), b.data()};
        fill_samples(c.reference, c.x().data(), gain, step, out);
        for (size_t i = 0; i < count; ++i) {
          const size_t p = i / cols * static_cast<size_t>(step) * static_cast<size_t>(width) +
                           i % cols * static_cast<size_t>(step);
          double squared = 0;
          for (size_t k = 0; k < 3; ++k)
            squared += std::pow(c.frame[k][p] - c.reference.level[k][p] * double{g}, 2);
          const bool foreground = std::sqrt(squared) > c.reference.threshold[p];
          for (size_t k = 0; k < 3; ++k)
            ASSERT_EQ(out[k][i],
                      foreground ? c.reference.level[k][p] : scaled(c.frame[k][p], 1 / g));
        }
      }
}

// ---- Light ----

TEST(RefineGain, IsTheGainOfWhatFits) {
  std::mt19937 rng(37);
  for (float g : {0.5f, 0.8f, 1.0f, 1.25f})
    for (int step : {1, 2, 5}) {
      // Three quarters of the frame in another light, the rest objects.
      const Case c(160, 120, rng, g);
      // Off by some per cent, as the coarse grid leaves it.
      const Gain before = {g * 1.03f, g * 0.97f, g * 1.02f};
      const Gain found = refine_gain(c.reference, c.x().data(), before, step);
      for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(found[k] / g, 1, 0.01) << g << " step " << step;
    }
}

TEST(RefineGain, StaysWhereTooLittleFits) {
  std::mt19937 rng(38);
  Case c(64, 48, rng);
  for (auto& plane : c.frame)
    for (auto& sample : plane) sample = static_cast<uint8_t>(rng() % 256);
  std::fill(c.reference.threshold.begin(), c.reference.threshold.end(), uint8_t{12});
  const Gain before = {0.8f, 0.9f, 1.1f};
  EXPECT_EQ(refine_gain(c.reference, c.x().data(), before, 1), before);
  // Black against black says nothing of light.
  for (size_t k = 0; k < 3; ++k) {
    std::fill(c.frame[k].begin(), c.frame[k].end(), uint8_t{0});
    std::fill(c.reference.level[k].begin(), c.reference.level[k].end(), uint8_t{0});
  }
  EXPECT_EQ(refine_gain(c.reference, c.x().data(), before, 1), before);
  // White is clipped.
  for (size_t k = 0; k < 3; ++k) {
    std::fill(c.frame[k].begin(), c.frame[k].end(), uint8_t{255});
    std::fill(c.reference.level[k].begin(), c.reference.level[k].end(), uint8_t{255});
  }
  EXPECT_EQ(refine_gain(c.reference, c.x().data(), kSameLight, 1), kSameLight);
}

// ---- Blur ----

TEST(Blur, IsTheMeanOfFiveByFive) {
  on_every_target([] {
    std::mt19937 rng(39);
    for (int width : {1, 2, 3, 4, 5, 17, 64, 70})
      for (int height : {1, 2, 3, 5, 9}) {
        const auto plane = random_picture(static_cast<size_t>(width * height), rng);
        BeforeTheEdge<uint8_t> out(static_cast<size_t>(width * height));
        blur(plane.data(), width, height, out.data());
        for (int y = 0; y < height; ++y)
          for (int x = 0; x < width; ++x) {
            int sum = 0;
            for (int dy = -2; dy <= 2; ++dy)
              for (int dx = -2; dx <= 2; ++dx)
                sum += plane[static_cast<size_t>(std::clamp(y + dy, 0, height - 1) * width +
                                                 std::clamp(x + dx, 0, width - 1))];
            ASSERT_EQ(out[static_cast<size_t>(y * width + x)], std::lround(sum / 25.0));
          }
      }
  });
}

// ---- Median ----

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
    stable.of_cell.resize(grid.cells());
    size_t many = 1;
    for (auto& cell : stable.of_cell) {
      for (int i = 0; i < static_cast<int>(frame_of.size()); ++i) cell.push_back(i);
      std::shuffle(cell.begin(), cell.end(), rng);
      cell.resize(std::min(many, cell.size()));
      std::sort(cell.begin(), cell.end());
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
      const auto& known = stack.stable.of_cell[static_cast<size_t>(row * grid.cols + col)];
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

Median median_of(const Stack& stack, int threads) {
  Median out;
  for (auto& plane : out.plane) plane.assign(stack.window.pixels(), kUntouched);
  out.spread.assign(stack.window.pixels(), kUntouched);
  uint8_t* const planes[3] = {out.plane[0].data(), out.plane[1].data(), out.plane[2].data()};
  Pool pool(threads);
  median_picture(stack.window, stack.grid, stack.stable, stack.frame_of, stack.gains, &pool, planes,
                 out.spread.data());
  return out;
}

TEST(MedianPicture, IsTheMiddleOfEveryNumberOfFrames) {
  on_every_target([] {
    std::mt19937 rng(41);
    // Cells have 1 to 31 frames, then more that are thinned; one has a single row of wide cells.
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
