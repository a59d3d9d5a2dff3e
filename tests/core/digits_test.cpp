// SPDX-License-Identifier: LGPL-2.1-or-later
// Samples of more than 8 bits: each pass over them against its definition, on every instruction set
// of this machine.
#include "core/passes/digits.h"

#include <cmath>
#include <deque>
#include <random>
#include <vector>

#include "core/gram/gram.h"
#include "core/passes/combine.h"
#include "core/passes/fill.h"
#include "tests/core/simd_targets.h"

namespace qdmd::test {
namespace {

constexpr uint8_t kCanary = 0x5A;
constexpr size_t kCounts[] = {1,  2,  3,  7,  8,  9,   15,  16,  17,  31, 32,
                              33, 63, 64, 65, 66, 127, 128, 129, 255, 641};
constexpr SampleBits kBits[] = {{10, 0}, {10, 6}, {12, 0}, {12, 4}, {16, 0}, {9, 3}};

std::mt19937 rng(2101);

template <typename Samples>
void fill_randomly(Samples& samples, int most) {
  for (auto& sample : samples)
    sample = static_cast<std::decay_t<decltype(sample)>>(rng() % static_cast<unsigned>(most + 1));
}

int word_at(const uint8_t* from) { return from[0] | from[1] << 8; }

TEST(Digits, AreTheBitsOfWordsAtAnyDistance) {
  on_every_target([] {
    for (const SampleBits& bits : kBits)
      for (size_t count : kCounts)
        for (size_t stride : {2, 4, 8, 6, 3}) {
          // Bits around the samples are random, too. The last word is the last that may be read.
          BeforeTheEdge<uint8_t> from((count - 1) * stride + 2), high(count), low(count);
          fill_randomly(from, 255);
          split_digits(from.data(), static_cast<ptrdiff_t>(stride), bits, count,
                       {high.data(), low.data()});
          BeforeTheEdge<uint16_t> joined(count);
          join_digits({high.data(), low.data()}, bits.depth, count, joined.data());
          for (size_t p = 0; p < count; ++p) {
            const int sample = word_at(from.data() + p * stride) >> bits.shift & bits.most();
            ASSERT_EQ(high[p], sample >> bits.low()) << p << " of " << count << ", " << stride;
            ASSERT_EQ(low[p], sample & ((1 << bits.low()) - 1));
            ASSERT_EQ(joined[p], sample);
          }
        }
  });
}

TEST(Words, AreWrittenAtAnyDistanceAndNothingElse) {
  on_every_target([] {
    for (const SampleBits& bits : kBits)
      for (size_t count : kCounts)
        for (size_t stride : {2, 4, 8, 6}) {
          BeforeTheEdge<uint16_t> samples(count);
          fill_randomly(samples, bits.most());
          BeforeTheEdge<uint8_t> to((count - 1) * stride + 2);
          std::fill(to.begin(), to.end(), kCanary);
          put_words(samples.data(), bits, count, to.data(), static_cast<ptrdiff_t>(stride));
          for (size_t p = 0; p < count; ++p) {
            ASSERT_EQ(word_at(to.data() + p * stride), samples[p] << bits.shift);
            for (size_t i = p * stride + 2; i < (p + 1) * stride && i < to.size(); ++i)
              ASSERT_EQ(to[i], kCanary);
          }
        }
  });
}

TEST(Words, AreWrittenInPairsAndFours) {
  on_every_target([] {
    for (const SampleBits& bits : kBits)
      for (size_t count : kCounts) {
        std::vector<std::unique_ptr<BeforeTheEdge<uint16_t>>> rows;
        const uint16_t* samples[4];
        for (const uint16_t*& row : samples) {
          rows.push_back(std::make_unique<BeforeTheEdge<uint16_t>>(count));
          fill_randomly(*rows.back(), bits.most());
          row = rows.back()->data();
        }
        BeforeTheEdge<uint8_t> pairs(4 * count), fours(8 * count);
        put_pairs(samples, bits, count, pairs.data());
        put_fours(samples, bits, count, fours.data());
        for (size_t p = 0; p < count; ++p)
          for (size_t c = 0; c < 4; ++c) {
            if (c < 2) {
              ASSERT_EQ(word_at(pairs.data() + 4 * p + 2 * c), samples[c][p] << bits.shift);
            }
            ASSERT_EQ(word_at(fours.data() + 8 * p + 2 * c), samples[c][p] << bits.shift);
          }
      }
  });
}

TEST(Digits, OfAPixelAreAsFarFromTheBackgroundAsWholeSamples) {
  on_every_target([] {
    for (int low_bits : {2, 4, 8})
      for (size_t count : kCounts) {
        std::deque<BeforeTheEdge<uint8_t>> digits;
        std::deque<BeforeTheEdge<uint16_t>> background;
        for (int c = 0; c < 3; ++c) {
          fill_randomly(digits.emplace_back(count), 255);
          fill_randomly(digits.emplace_back(count), (1 << low_bits) - 1);
          fill_randomly(background.emplace_back(count), (256 << low_bits) - 1);
        }
        const Samples x[3] = {{digits[0].data(), digits[1].data()},
                              {digits[2].data(), digits[3].data()},
                              {digits[4].data(), digits[5].data()}};
        const uint16_t* const l[3] = {background[0].data(), background[1].data(),
                                      background[2].data()};
        BeforeTheEdge<uint64_t> out(count);
        squared_units(x, 8 + low_bits, l, count, out.data());
        for (size_t p = 0; p < count; ++p) {
          int64_t sum = 0;
          for (int c = 0; c < 3; ++c) {
            const int64_t whole = (int64_t{x[c].high[p]} << low_bits) + x[c].low[p];
            sum += (whole - l[c][p]) * (whole - l[c][p]);
          }
          ASSERT_EQ(out[p], static_cast<uint64_t>(sum));
        }
      }
  });
}

TEST(DeepRows, AreTheirDefinitions) {
  on_every_target([] {
    for (size_t count : kCounts) {
      BeforeTheEdge<uint16_t> x(count), l(count), residual(count), fitted(count), faded(count),
          one_row((count + 1) / 2), two_rows((count + 1) / 2);
      BeforeTheEdge<uint8_t> mask(count);
      fill_randomly(x, 65535);
      fill_randomly(l, 65535);
      fill_randomly(mask, 255);
      x[0] = l[0] = 65535, mask[0] = 255;
      const uint16_t black = 4096, white = 60160;
      residual_levels(x.data(), l.data(), black, white, count, residual.data());
      fit_levels(mask.data(), black, white, count, fitted.data());
      fade(x.data(), mask.data(), black, count, faded.data());
      mean_of_pairs(x.data(), nullptr, count, one_row.data());
      mean_of_pairs(x.data(), l.data(), count, two_rows.data());
      for (size_t p = 0; p < count; ++p) {
        ASSERT_EQ(residual[p], std::min(black + std::abs(x[p] - l[p]), int{white}));
        ASSERT_EQ(fitted[p], std::lround(black + (white - black) * mask[p] / 255.0));
        ASSERT_EQ(faded[p], std::lround(black + (x[p] - black) * mask[p] / 255.0));
      }
      for (size_t k = 0; k < one_row.size(); ++k) {
        double of_one = 0, of_two = 0;
        int number = 0;
        for (size_t p = 2 * k; p < std::min(count, 2 * k + 2); ++p, ++number)
          of_one += x[p], of_two += x[p] + l[p];
        ASSERT_EQ(one_row[k], static_cast<int>(of_one / number + 0.5));
        ASSERT_EQ(two_rows[k], static_cast<int>(of_two / number / 2 + 0.5));
      }
    }
  });
}

TEST(DeepLevels, AreRoundedToTheirDepth) {
  on_every_target([] {
    constexpr size_t kPictures = 3;
    std::uniform_real_distribution<float> level(-40, 300);
    for (int low_bits : {1, 2, 4, 8})
      for (size_t count : kCounts) {
        std::vector<std::unique_ptr<BeforeTheEdge<float>>> pictures;
        const float* rows[kPictures];
        for (const float*& row : rows) {
          pictures.push_back(std::make_unique<BeforeTheEdge<float>>(count));
          for (float& sample : *pictures.back()) sample = level(rng);
          row = pictures.back()->data();
        }
        // Exact products and sums: whole samples of 2^-10.
        for (auto& picture : pictures)
          for (float& sample : *picture) sample = std::round(sample * 1024) / 1024;
        const float weights[3 * kPictures] = {1, 0, 0, 0, 0.5f, 0.5f, 1, -1, 1};
        BeforeTheEdge<uint16_t> r(count), g(count), b(count);
        BeforeTheEdge<uint8_t> red(count), green(count), blue(count);
        uint16_t* const deep[3] = {r.data(), g.data(), b.data()};
        uint8_t* const high[3] = {red.data(), green.data(), blue.data()};
        deep_levels_of(weights, rows, kPictures, 8 + low_bits, 0, count, deep);
        high_digits_of(weights, rows, kPictures, 0, count, high);
        const double most = (256 << low_bits) - 1;
        for (size_t p = 0; p < count; ++p)
          for (size_t c = 0; c < 3; ++c) {
            double sum = 0;
            for (size_t k = 0; k < kPictures; ++k) sum += weights[kPictures * c + k] * rows[k][p];
            const double expected = std::clamp(std::floor(sum * (1 << low_bits) + 0.5), 0.0, most);
            ASSERT_EQ(deep[c][p], expected) << sum;
            ASSERT_EQ(high[c][p], std::clamp(std::floor(sum), 0.0, 255.0)) << sum;
          }
      }
  });
}

TEST(DeepPlanes, AreCombinedAsOthers) {
  on_every_target([] {
    for (size_t count : {size_t{1}, size_t{64}, size_t{200}}) {
      constexpr size_t kPlanes = 5, kSums = 6;
      const size_t padded = (count + 63) / 64 * 64;
      std::vector<std::unique_ptr<BeforeTheEdge<uint16_t>>> planes;
      const uint16_t* rows[kPlanes];
      for (const uint16_t*& row : rows) {
        planes.push_back(std::make_unique<BeforeTheEdge<uint16_t>>(padded));
        fill_randomly(*planes.back(), 65535);
        row = planes.back()->data();
      }
      std::vector<double> coefficients(8 * kPlanes);
      for (double& k : coefficients) k = static_cast<double>(rng() % 2048) / 1024 - 1;
      std::vector<std::vector<float>> sums(kSums, std::vector<float>(count));
      float* out[kSums];
      for (size_t k = 0; k < kSums; ++k) out[k] = sums[k].data();
      combine_planes(coefficients.data(), kSums, rows, kPlanes, 0, count, out);
      for (size_t k = 0; k < kSums; ++k)
        for (size_t p = 0; p < count; ++p) {
          double sum = 0;
          for (size_t j = 0; j < kPlanes; ++j)
            sum += coefficients[4 * (k / 4 * kPlanes + j) + k % 4] * rows[j][p];
          ASSERT_EQ(sums[k][p], static_cast<float>(sum));
        }
    }
  });
}

// A window of random samples.
struct DeepWindow {
  int low_bits;
  Window window;

  DeepWindow(int capacity, size_t pixels, int bits)
      : low_bits(bits), window(capacity, pixels, 8 + bits) {}
  void append() {
    const int slot = window.append();
    for (int c = 0; c < kChannels; ++c)
      for (size_t p = 0; p < window.pixels(); ++p) {
        window.samples(slot, c).high[p] = static_cast<uint8_t>(rng() % 256);
        window.samples(slot, c).low[p] = static_cast<uint8_t>(rng() % (1u << low_bits));
      }
  }
  SnapshotRange all() const { return window; }
};

void expect_products(const SnapshotRange& snapshots, const IntegerMatrix& gram) {
  for (int s = 0; s < snapshots.size(); ++s)
    for (int t = 0; t < snapshots.size(); ++t)
      for (int c = 0; c < kChannels; ++c)
        for (int d = 0; d < kChannels; ++d) {
          int64_t sum = 0;
          for (size_t p = 0; p < snapshots.pixels(); ++p)
            sum += static_cast<int64_t>(snapshots.sample(s, c, p)) *
                   static_cast<int64_t>(snapshots.sample(t, d, p));
          ASSERT_EQ(gram(3 * s + c, 3 * t + d), sum) << s << " " << t;
        }
}

TEST(DeepGram, IsExactForWholeSamples) {
  for (int low_bits : {1, 2, 4, 8})
    for (size_t pixels : {size_t{1}, size_t{63}, size_t{200}}) {
      DeepWindow window(5, pixels, low_bits);
      SlidingGram gram(5, {}, 8 + low_bits);
      for (int t = 0; t < 12; ++t) {
        window.append();
        const SnapshotRange all = window.all();
        const size_t middle = all.plane_size() > 64 ? 64 : all.plane_size();
        gram.add_slice(all, 1, 0, middle);
        gram.add_slice(all, 1, middle, all.plane_size() - middle);
        expect_products(all, gram.matrix(all));
        if (testing::Test::HasFatalFailure()) return;
      }
      gram.add_slice(window.all(), 5, 0, window.window.plane_size());
      expect_products(window.all(), gram.matrix(window.all()));
    }
}

// Filler<uint16_t>::fill() by its definition, in light that rounds the same way in any order of
// steps.
TEST(DeepFilling, IsTheMedianAndTheReachOfWholeSamples) {
  on_every_target([] {
    for (int low_bits : {2, 4, 8})
      for (int snapshots : {1, 2, 9, 14})
        for (size_t pixels : {size_t{1}, size_t{130}}) {
          DeepWindow window(snapshots, pixels, low_bits);
          const int most = (256 << low_bits) - 1;
          ReferencePicture reference;
          reference.width = static_cast<int>(pixels), reference.height = 1;
          for (auto& level : reference.level) {
            level.resize(pixels);
            fill_randomly(level, 255);
          }
          std::vector<std::vector<uint8_t>> bits(static_cast<size_t>(snapshots),
                                                 std::vector<uint8_t>(mask_bytes(pixels)));
          std::vector<Gain> gains;
          for (int t = 0; t < snapshots; ++t) {
            window.append();
            gains.push_back(t % 3 == 0 ? kSameLight : t % 3 == 1 ? Gain{2, 2, 2} : Gain{.5, 1, 2});
            std::vector<uint8_t>& of_snapshot = bits[static_cast<size_t>(t)];
            for (size_t p = 0; p < pixels; ++p) {
              // Most are near the reference, some are not; some pixels are masked in all.
              for (size_t c = 0; c < 3; ++c)
                if (rng() % 4 != 0)
                  window.window.plane(t, static_cast<int>(c))[p] =
                      static_cast<uint8_t>(std::clamp(reference.level[c][p] * gains.back()[c] +
                                                          2.0f * static_cast<float>(rng() % 3),
                                                      0.0f, 255.0f));
              if (rng() % 4 == 0 || p % 50 == 7)
                of_snapshot[p / 8] = static_cast<uint8_t>(of_snapshot[p / 8] | 1 << p % 8);
            }
          }
          Pool pool(1);
          WindowMask mask(snapshots, pixels);
          mask.find_all(snapshots, &pool, [&](int t, size_t, uint8_t* out) {
            std::copy_n(bits[static_cast<size_t>(t)].data(), mask_bytes(pixels), out);
          });
          const auto masked = [&](int t, size_t p) {
            return is_masked(bits[static_cast<size_t>(t)].data(), p);
          };
          std::vector<uint8_t> reach((pixels + 63) / 64 * 64);
          for (auto& r : reach) r = static_cast<uint8_t>(rng() % 12);
          Filler<uint16_t> filler(snapshots);
          const SnapshotRange all = window.all();
          for (size_t first = 0; first < pixels; first += filler.run()) {
            const size_t count = std::min(filler.run(), pixels - first);
            const uint16_t* const* filled =
                filler.fill(all, gains, mask, reference, reach.data(), first, count);
            for (size_t c = 0; c < 3; ++c)
              for (size_t p = first; p < first + count; ++p) {
                std::vector<int> own, kept;
                for (int t = 0; t < snapshots; ++t) {
                  const float factor = 1 / gains[static_cast<size_t>(t)][c];
                  const double sample = all.sample(t, static_cast<int>(c), p) * factor;
                  own.push_back(static_cast<int>(std::min<double>(sample + 0.5, most)));
                  if (!masked(t, p)) kept.push_back(own.back());
                }
                std::sort(kept.begin(), kept.end());
                int middle = (2 * reference.level[c][p] + 1) << low_bits >> 1;
                if (!kept.empty())
                  middle = (kept[(kept.size() - 1) / 2] + kept[kept.size() / 2]) / 2;
                for (int t = 0; t < snapshots; ++t) {
                  const int limit = masked(t, p) ? 0 : reach[p] << low_bits;
                  ASSERT_EQ(filled[3 * static_cast<size_t>(t) + c][p - first],
                            std::clamp(own[static_cast<size_t>(t)], middle - limit, middle + limit))
                      << low_bits << " bits, snapshot " << t << " of " << snapshots;
                }
              }
          }
        }
  });
}

}  // namespace
}  // namespace qdmd::test
