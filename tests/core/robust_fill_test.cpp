// SPDX-License-Identifier: LGPL-2.1-or-later
// The passes of robust Q-DMD over pixels against their definitions, on every instruction set of
// this machine.
#include "core/passes/fill.h"
#include "tests/core/robust_util.h"
#include "tests/core/simd_targets.h"

namespace qdmd::test {
namespace {

// A frame and a reference of which parts are alike.
struct Case {
  ReferencePicture reference;
  std::vector<uint8_t> frame[3];

  Case(int width, int height, std::mt19937& rng, float gain = 1) {
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
  }
  // The three planes for a call.
  std::array<const uint8_t*, 3> x() const {
    return {frame[0].data(), frame[1].data(), frame[2].data()};
  }
};

// find_mask() by its definition. margin: how far a pixel's mean residual is from its
// threshold.
struct Mask {
  std::vector<uint8_t> bits;
  std::vector<double> margin;
};

Mask naive_mask(const Case& c, const Gain& gain) {
  const ReferencePicture& r = c.reference;
  const bool lit = is_lit(gain);
  std::vector<int> residual(r.pixels());
  for (size_t p = 0; p < r.pixels(); ++p) {
    int d[3];
    for (size_t k = 0; k < 3; ++k)
      d[k] = c.frame[k][p] - (lit ? scaled(r.level[k][p], gain[k]) : r.level[k][p]);
    residual[p] = byte_of(norm(d));
  }
  const auto around = [&](int x, int y, int reach, auto value) {
    int sum = 0;
    for (int dy = -reach; dy <= reach; ++dy)
      for (int dx = -reach; dx <= reach; ++dx)
        sum += value(static_cast<size_t>(std::clamp(y + dy, 0, r.height - 1) * r.width +
                                         std::clamp(x + dx, 0, r.width - 1)));
    return sum;
  };
  Mask out;
  out.margin.resize(r.pixels());
  out.bits.assign(mask_bytes(r.pixels()), 0);
  std::vector<uint8_t> exceeds(r.pixels());
  for (int y = 0; y < r.height; ++y)
    for (int x = 0; x < r.width; ++x) {
      const auto p = static_cast<size_t>(y * r.width + x);
      const int sum = around(x, y, 2, [&](size_t q) { return residual[q]; });
      out.margin[p] = std::abs(sum / 25.0 - r.threshold[p]);
      exceeds[p] = sum > 25 * r.threshold[p];
    }
  for (int y = 0; y < r.height; ++y)
    for (int x = 0; x < r.width; ++x)
      if (around(x, y, 3, [&](size_t q) { return exceeds[q]; }) > 24) {
        const auto p = static_cast<size_t>(y * r.width + x);
        out.bits[p / 8] = static_cast<uint8_t>(out.bits[p / 8] | 1 << p % 8);
      }
  return out;
}

std::vector<uint8_t> mask_of(const Case& c, const Gain& gain) {
  // Memory of its own, so that a byte too many is seen.
  BeforeTheEdge<uint8_t> bits(mask_bytes(c.reference.pixels()));
  BeforeTheEdge<uint8_t> scratch(mask_scratch_bytes(c.reference.width, c.reference.height));
  // All of them are written.
  std::fill(bits.begin(), bits.end(), uint8_t{255});
  find_mask(c.reference, c.x().data(), gain, bits.data(), scratch.data());
  return {bits.begin(), bits.end()};
}

// ---- Masks ----

TEST(ForegroundMask, IsTheMajorityOfFiveByFiveDecisions) {
  on_every_target([] {
    std::mt19937 rng(31);
    size_t masked = 0, all = 0;
    for (int width = 1; width <= 140; ++width) {
      const Case c(width, 1 + static_cast<int>(rng() % 12), rng);
      const Mask expected = naive_mask(c, kSameLight);
      ASSERT_EQ(mask_of(c, kSameLight), expected.bits) << width << " x " << c.reference.height;
      for (size_t p = 0; p < c.reference.pixels(); ++p)
        masked += is_masked(expected.bits.data(), p);
      all += c.reference.pixels();
    }
    // The cases have both.
    EXPECT_GT(masked, all / 20);
    EXPECT_LT(masked, all - all / 20);
  });
}

// Powers of two: scaling rounds the same way with and without fused multiply-adds.
TEST(ForegroundMask, IsJudgedInTheFramesLight) {
  on_every_target([] {
    std::mt19937 rng(32);
    for (int width : {1, 4, 5, 16, 33, 64, 67})
      for (float g : {0.25f, 0.5f, 2.0f}) {
        const Case c(width, 9, rng, g);
        const Gain gain = {g, g, 2 * g};
        ASSERT_EQ(mask_of(c, gain), naive_mask(c, gain).bits) << width;
      }
  });
}

TEST(ForegroundMask, AnyGainIsWithinItsRounding) {
  on_every_target([] {
    std::mt19937 rng(33);
    for (float g : {0.37f, 0.9f, 1.3f}) {
      const Case c(61, 24, rng, g);
      const Gain gain = {g, 1.1f * g, 0.9f};
      const Mask expected = naive_mask(c, gain);
      const std::vector<uint8_t> found = mask_of(c, gain);
      // Where no decision around is near its threshold.
      for (int y = 3; y < 21; ++y)
        for (int x = 3; x < 58; ++x) {
          double margin = 255;
          for (int q = 0; q < 49; ++q)
            margin = std::min(
                margin, expected.margin[static_cast<size_t>((y + q / 7 - 3) * 61 + x + q % 7 - 3)]);
          const auto p = static_cast<size_t>(y * 61 + x);
          if (margin > 1) {
            ASSERT_EQ(is_masked(found.data(), p), is_masked(expected.bits.data(), p));
          }
        }
    }
  });
}

TEST(ForegroundMask, TheSameFrameHasNone) {
  std::mt19937 rng(35);
  Case c(50, 20, rng);
  for (size_t k = 0; k < 3; ++k) c.frame[k] = c.reference.level[k];
  for (uint8_t bits : mask_of(c, kSameLight)) EXPECT_EQ(bits, 0);
}

// ---- Masks of a window ----

// Whatever is kept of masks, they are read as they were found; what was found before is gone.
TEST(WindowMask, ReadsWhatWasFound) {
  std::mt19937 rng(49);
  for (size_t pixels : {size_t{1}, size_t{63}, size_t{64}, size_t{65}, size_t{4096}, size_t{4097},
                        size_t{10007}, size_t{64 * 64 * 3}}) {
    constexpr int kSnapshots = 7;
    const size_t bytes = mask_bytes(pixels);
    Pool pool(3);
    WindowMask mask(kSnapshots, pixels);
    for (int round = 0; round < 4; ++round) {
      // One is empty, one is set everywhere; others are empty in most places.
      std::vector<std::vector<uint8_t>> bits(kSnapshots, std::vector<uint8_t>(bytes));
      for (int t = 0; t < kSnapshots; ++t)
        for (size_t p = 0; p < pixels; ++p) {
          const unsigned share = t == 0 ? 0 : t == 1 ? 64 : 1u << (t - 2);
          if (t == 1 || rng() % (64 * 64) < share * share)
            bits[static_cast<size_t>(t)][p / 8] |= static_cast<uint8_t>(1 << p % 8);
        }
      const int count = kSnapshots - round;
      mask.find_all(count, &pool, [&](int t, size_t worker, uint8_t* out) {
        ASSERT_LT(worker, pool.threads());
        std::copy(bits[static_cast<size_t>(t)].begin(), bits[static_cast<size_t>(t)].end(), out);
      });
      for (int t = 0; t < count; ++t) {
        const auto& expected = bits[static_cast<size_t>(t)];
        BeforeTheEdge<uint8_t> whole(bytes);
        mask.read(t, whole.data());
        ASSERT_TRUE(std::equal(expected.begin(), expected.end(), whole.data()))
            << pixels << " pixels, snapshot " << t;
        for (int part = 0; part < 20; ++part) {
          const size_t first = rng() % (bytes / 8) * 8,
                       count_of = 8 * (1 + rng() % ((bytes - first) / 8));
          BeforeTheEdge<uint8_t> some(count_of);
          mask.read(t, 8 * first, 8 * count_of, some.data());
          ASSERT_TRUE(std::equal(some.data(), some.data() + count_of,
                                 expected.begin() + static_cast<ptrdiff_t>(first)))
              << pixels << " pixels, snapshot " << t << ", from byte " << first;
        }
      }
    }
  }
}

// ---- Filling ----

// Snapshots of one scene with noise, masked in places.
struct MaskedWindow {
  Window window;
  std::vector<std::vector<uint8_t>> bits;  // of snapshots
  WindowMask mask;                         // the same
  std::vector<Gain> gains;
  ReferencePicture reference;
  std::vector<uint8_t> reach;

  // share: of the samples, in per cent, that are masked; the first pixels are masked in all
  // snapshots, in all but one, in all but two.
  MaskedWindow(int count, int pixels, int share, const std::vector<float>& lights,
               std::mt19937& rng, int most_noise = 60)
      : window(count, static_cast<size_t>(pixels)),
        bits(static_cast<size_t>(count),
             std::vector<uint8_t>(mask_bytes(static_cast<size_t>(pixels)))),
        mask(count, static_cast<size_t>(pixels)) {
    reference.width = pixels;
    reference.height = 1;
    for (auto& plane : reference.level) plane = random_picture(static_cast<size_t>(pixels), rng);
    const auto noisy = random_picture(static_cast<size_t>(pixels), rng, 0, most_noise);
    for (int t = 0; t < count; ++t) {
      const int slot = window.append();
      gains.push_back(kSameLight);
      for (size_t c = 0; c < 3; ++c) {
        gains.back()[c] = lights[(static_cast<size_t>(t) + c) % lights.size()];
        for (int p = 0; p < pixels; ++p) {
          const int noise = 1 + noisy[static_cast<size_t>(p)];
          const int level = reference.level[c][static_cast<size_t>(p)] +
                            static_cast<int>(rng() % static_cast<unsigned>(2 * noise)) - noise;
          window.plane(slot, static_cast<int>(c))[p] =
              static_cast<uint8_t>(std::clamp(level, 0, 255));
        }
      }
      for (int p = 0; p < pixels; ++p)
        if (p < 3 ? t >= p : static_cast<int>(rng() % 100) < share)
          of(t)[p / 8] = static_cast<uint8_t>(of(t)[p / 8] | 1 << p % 8);
    }
    Pool pool(2);
    mask.find_all(count, &pool, [&](int t, size_t, uint8_t* out) {
      std::copy(bits[static_cast<size_t>(t)].begin(), bits[static_cast<size_t>(t)].end(), out);
    });
    reach.assign(window.plane_size(), 0);
    for (int p = 0; p < pixels; ++p)
      reach[static_cast<size_t>(p)] = static_cast<uint8_t>(rng() % 256);
  }

  uint8_t* of(int t) { return bits[static_cast<size_t>(t)].data(); }
  bool is_masked(int t, size_t p) const {
    return qdmd::is_masked(bits[static_cast<size_t>(t)].data(), p);
  }
  uint8_t unit(int t, size_t c, size_t p) const {
    const float gain = gains[static_cast<size_t>(t)][c];
    const uint8_t sample = window.plane(t, static_cast<int>(c))[p];
    return gain == 1 ? sample : scaled(sample, 1 / gain);
  }
  int level(size_t c, size_t p) const {
    std::vector<int> samples;
    for (int t = 0; t < window.size(); ++t)
      if (!is_masked(t, p)) samples.push_back(unit(t, c, p));
    if (samples.empty()) return reference.level[c][p];
    std::sort(samples.begin(), samples.end());
    return (samples[(samples.size() - 1) / 2] + samples[samples.size() / 2]) / 2;
  }
  // median: level(c, p).
  int filled(int t, size_t c, size_t p, bool draw, int median) const {
    if (is_masked(t, p)) return median;
    if (!draw) return unit(t, c, p);
    return median + std::clamp<int>(unit(t, c, p) - median, -reach[p], reach[p]);
  }
};

void expect_filled(const MaskedWindow& w, bool draw, int tolerance = 0) {
  Filler<uint8_t> filler(w.window.size());
  const size_t pixels = w.window.pixels();
  for (size_t first = 0; first < pixels; first += filler.run()) {
    const size_t count = std::min(filler.run(), pixels - first);
    const uint8_t* const* planes = filler.fill(w.window, w.gains, w.mask, w.reference,
                                               draw ? w.reach.data() : nullptr, first, count);
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = first; p < first + count; ++p) {
        const int median = w.level(c, p);
        for (int t = 0; t < w.window.size(); ++t)
          ASSERT_NEAR(planes[3 * static_cast<size_t>(t) + c][p - first],
                      w.filled(t, c, p, draw, median), tolerance)
              << "frame " << t << " pixel " << p << " of " << pixels;
      }
  }
}

TEST(Filler, MaskedSamplesBecomeTheMedianOfTheOthers) {
  on_every_target([] {
    std::mt19937 rng(51);
    for (int share : {0, 20, 60, 97, 100})
      for (const auto& [count, pixels] :
           {std::pair{1, 5}, {2, 64}, {3, 65}, {7, 130}, {16, 300}, {60, 200}}) {
        SCOPED_TRACE(testing::Message() << count << " frames, " << share << " % masked");
        const MaskedWindow w(count, pixels, share, {1}, rng);
        expect_filled(w, false);
        expect_filled(w, true);
      }
  });
}

// Where all medians are near the reference they are looked for there; levels at both ends, too.
TEST(Filler, MediansMayBeNearTheReference) {
  on_every_target([] {
    std::mt19937 rng(55);
    for (int share : {0, 30, 97})
      for (int count : {1, 2, 8, 41, 300})
        for (int noise : {0, 1, 3, 6}) {
          SCOPED_TRACE(testing::Message() << count << " frames, noise " << noise);
          MaskedWindow w(count, 260, share, {1}, rng, noise);
          if (testing::Test::HasFatalFailure()) return;
          // A pixel far from it here and there.
          if (noise == 3)
            w.reference.level[1][70] = static_cast<uint8_t>(w.reference.level[1][70] ^ 128);
          expect_filled(w, true);
        }
  });
}

// Samples are counted in bytes: more frames than those can count.
TEST(Filler, WindowsMayBeLong) {
  on_every_target([] {
    std::mt19937 rng(52);
    for (int count : {254, 255, 256, 257, 700}) expect_filled({count, 70, 30, {1}, rng}, true);
  });
}

TEST(Filler, RunsCoverLargePictures) {
  std::mt19937 rng(53);
  const MaskedWindow w(9, 20001, 30, {1}, rng);
  ASSERT_LT(Filler<uint8_t>(9).run(), w.window.pixels());
  expect_filled(w, true);
}

TEST(Filler, FillsInUnitLight) {
  on_every_target([] {
    std::mt19937 rng(54);
    expect_filled({20, 150, 30, {1, 0.5f, 2, 0.25f}, rng}, false);
    // Scaling may round a tie by one, in the median, too.
    expect_filled({20, 150, 30, {1, 0.83f, 1.17f}, rng}, false, 1);
    expect_filled({20, 150, 30, {1, 0.83f, 1.17f}, rng}, true, 2);
  });
}

TEST(FillSamples, TakesEveryStepthPixel) {
  std::mt19937 rng(36);
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 5}, {40, 31}})
    for (int step : {1, 2, 3, 8})
      for (float g : {1.0f, 0.5f, 2.0f}) {
        const Case c(width, height, rng, g);
        const Gain gain = {g, g, g};
        const auto bits = random_picture(mask_bytes(c.reference.pixels()), rng);
        const auto cols = static_cast<size_t>((width + step - 1) / step);
        const size_t count = cols * static_cast<size_t>((height + step - 1) / step);
        BeforeTheEdge<uint8_t> r(count), gr(count), b(count);
        uint8_t* const out[3] = {r.data(), gr.data(), b.data()};
        std::vector<uint8_t> reach(c.reference.pixels());
        for (auto& most : reach) most = static_cast<uint8_t>(rng() % 256);
        fill_samples(c.reference, bits.data(), c.x().data(), gain, reach.data(), {0, height, step},
                     out);
        for (size_t i = 0; i < count; ++i) {
          const size_t p = i / cols * static_cast<size_t>(step) * static_cast<size_t>(width) +
                           i % cols * static_cast<size_t>(step);
          for (size_t k = 0; k < 3; ++k) {
            const int level = c.reference.level[k][p], unit = scaled(c.frame[k][p], 1 / g);
            ASSERT_EQ(out[k][i], is_masked(bits.data(), p)
                                     ? level
                                     : level + std::clamp(unit - level, -int{reach[p]}, +reach[p]));
          }
        }
      }
}

// ---- Light ----

// The gain after all rounds.
Gain refined(const Case& c, Gain gain, int step) {
  for (int round = 0; round < kGainRounds; ++round)
    if (!refine_gain(gain_sums(c.reference, c.x().data(), gain, {0, c.reference.height, step}),
                     &gain))
      break;
  return gain;
}

TEST(RefineGain, IsTheGainOfWhatFits) {
  std::mt19937 rng(37);
  for (float g : {0.5f, 0.8f, 1.0f, 1.25f})
    for (int step : {1, 2, 5}) {
      // Three quarters of the frame in another light, the rest objects.
      const Case c(160, 120, rng, g);
      // Off by some per cent, as the coarse grid leaves it.
      const Gain before = {g * 1.03f, g * 0.97f, g * 1.02f};
      const Gain found = refined(c, before, step);
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
  EXPECT_EQ(refined(c, before, 1), before);
  // Black against black says nothing of light.
  for (size_t k = 0; k < 3; ++k) {
    std::fill(c.frame[k].begin(), c.frame[k].end(), uint8_t{0});
    std::fill(c.reference.level[k].begin(), c.reference.level[k].end(), uint8_t{0});
  }
  EXPECT_EQ(refined(c, before, 1), before);
  // White is clipped.
  for (size_t k = 0; k < 3; ++k) {
    std::fill(c.frame[k].begin(), c.frame[k].end(), uint8_t{255});
    std::fill(c.reference.level[k].begin(), c.reference.level[k].end(), uint8_t{255});
  }
  EXPECT_EQ(refined(c, kSameLight, 1), kSameLight);
}

TEST(RefineGain, OneStepOfLightInOnePixelIsEnough) {
  Gain gain = {1.5f, 0.5f, 1};
  EXPECT_TRUE(refine_gain({1, 1, 0, 1, 2, 0, 1, 1}, &gain));
  EXPECT_EQ(gain, (Gain{1, 0.5f, 1}));
}

// ---- Blur ----

TEST(Blur, IsTheMeanOfFiveByFive) {
  Pool pool(3);
  on_every_target([&] {
    std::mt19937 rng(39);
    for (int width : {1, 2, 3, 4, 5, 17, 64, 70})
      for (int height : {1, 2, 3, 5, 9, 65, 100}) {
        const auto plane = random_picture(static_cast<size_t>(width * height), rng);
        BeforeTheEdge<uint8_t> out(static_cast<size_t>(width * height));
        blur(plane.data(), width, height, &pool, out.data());
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

}  // namespace
}  // namespace qdmd::test
