// SPDX-License-Identifier: LGPL-2.1-or-later
// The passes over pixels against their definitions, on every instruction set of this machine.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "core/passes/agreement.h"
#include "core/passes/combine.h"
#include "core/passes/median_network.h"
#include "core/passes/median_rows.h"
#include "core/passes/planes.h"
#include "core/passes/residual.h"
#include "tests/core/constants.h"
#include "tests/core/simd_targets.h"

namespace qdmd::test {
namespace {

constexpr uint8_t kCanary = 0x5A;

// Around the vectors of every instruction set, and a cache line.
constexpr int kWidths[] = {1, 3, 15, 16, 17, 33, 63, 64, 65, 255};

uint8_t random_byte(std::mt19937& rng) { return static_cast<uint8_t>(rng() >> 13); }

// ---- Medians ----

template <size_t kMost>
void expect_middle(std::vector<int> samples) {
  const MedianNetwork<kMost> network(samples.size());
  std::vector<int> sorted = samples;
  std::sort(sorted.begin(), sorted.end());
  for (const auto& [smaller, larger] : network)
    if (samples[larger] < samples[smaller]) std::swap(samples[larger], samples[smaller]);
  ASSERT_EQ(samples[network.lower_middle()], sorted[(sorted.size() - 1) / 2]) << sorted.size();
  ASSERT_EQ(samples[network.upper_middle()], sorted[sorted.size() / 2]) << sorted.size();
}

// What is right for all sequences of zeros and ones is for all others (Knuth, vol. 3, 5.3.4).
TEST(MedianNetwork, PutsTheMiddleOfAnySamplesInPlace) {
  for (size_t count = 1; count <= 16; ++count)
    for (unsigned ones = 0; ones < 1u << count; ++ones) {
      std::vector<int> samples(count);
      for (size_t i = 0; i < count; ++i) samples[i] = static_cast<int>(ones >> i & 1);
      expect_middle<16>(samples);
      if (testing::Test::HasFatalFailure()) return;
    }
  std::mt19937 rng(209);
  for (size_t count = 1; count <= 64; ++count)
    for (int turn = 0; turn < 200; ++turn) {
      std::vector<int> samples(count);
      for (int& sample : samples) sample = static_cast<int>(rng() % (turn % 2 ? 2 : 1000));
      expect_middle<64>(samples);
      if (testing::Test::HasFatalFailure()) return;
    }
}

TEST(MedianRows, IsTheMiddleOfEveryNumberOfRows) {
  std::mt19937 rng(210);
  std::uniform_real_distribution<float> level(0, 255);
  on_every_target([&] {
    for (size_t count = 1; count <= kMedianRows; ++count) {
      const size_t width = 1 + rng() % 40;
      std::vector<std::unique_ptr<BeforeTheEdge<float>>> rows;
      std::vector<const float*> pointers;
      std::vector<float> divisors;
      for (size_t i = 0; i < count; ++i) {
        rows.push_back(std::make_unique<BeforeTheEdge<float>>(width));
        for (float& sample : *rows.back()) sample = level(rng);
        pointers.push_back(rows.back()->data());
        divisors.push_back(i % 3 ? 1 : 0.5f + level(rng) / 255);
      }
      BeforeTheEdge<float> median(width);
      median_rows(pointers.data(), divisors.data(), count, width, median.data());
      for (size_t x = 0; x < width; ++x) {
        std::vector<float> sorted;
        for (size_t i = 0; i < count; ++i) sorted.push_back(pointers[i][x] / divisors[i]);
        std::sort(sorted.begin(), sorted.end());
        ASSERT_EQ(median[x], sorted[count / 2]) << count;
      }
    }
  });
}

// ---- Agreement of cells ----

TEST(Agreement, CountsCellsThatAreAlikeBelowTheEnd) {
  std::mt19937 rng(211);
  std::uniform_real_distribution<float> level(0, 255), noise(-6, 6);
  const float gain[3] = {1.1f, 1, 0.8f}, end = 245, most = 12;
  on_every_target([&] {
    for (int width : kWidths) {
      const auto cells = static_cast<size_t>(width);
      std::vector<std::unique_ptr<BeforeTheEdge<float>>> planes;
      for (int i = 0; i < 6; ++i) planes.push_back(std::make_unique<BeforeTheEdge<float>>(cells));
      const float* const a[3] = {planes[0]->data(), planes[1]->data(), planes[2]->data()};
      const float* const b[3] = {planes[3]->data(), planes[4]->data(), planes[5]->data()};
      Agreement slow;
      for (size_t cell = 0; cell < cells; ++cell) {
        float apart = 0;
        bool known = false;
        for (size_t c = 0; c < 3; ++c) {
          // A third of the samples are at the end, so that all of a cell's often are.
          const float shown = rng() % 3 ? level(rng) : 255;
          (*planes[c + 3])[cell] = shown;
          (*planes[c])[cell] = std::min(255.0f, gain[c] * shown + noise(rng));
          if (std::max(a[c][cell], b[c][cell]) >= end) continue;
          known = true;
          apart += std::abs(a[c][cell] / gain[c] - b[c][cell]);
        }
        slow.seen += known;
        slow.agree += known && apart < most;
      }
      const Agreement fast = find_agreement(a, b, cells, gain, end, most);
      ASSERT_EQ(fast.seen, slow.seen) << width;
      ASSERT_EQ(fast.agree, slow.agree) << width;
      if (cells > 60) {
        ASSERT_GT(slow.seen, slow.agree) << "nothing to tell apart";
      }
    }
  });
}

// ---- Packed pixels ----

struct Layout {
  const char* name;
  int bytes;              // of a pixel
  std::array<int, 4> at;  // of R, G, B, alpha or padding; -1: none
  bool padding;
};

// The ten formats of the element, and two that have to go another way: alpha in the middle, and
// pixels with bytes that belong to nobody.
const Layout kLayouts[] = {{"RGBx", 4, {0, 1, 2, 3}, true},   {"BGRx", 4, {2, 1, 0, 3}, true},
                           {"xRGB", 4, {1, 2, 3, 0}, true},   {"xBGR", 4, {3, 2, 1, 0}, true},
                           {"RGBA", 4, {0, 1, 2, 3}, false},  {"BGRA", 4, {2, 1, 0, 3}, false},
                           {"ARGB", 4, {1, 2, 3, 0}, false},  {"ABGR", 4, {3, 2, 1, 0}, false},
                           {"RGB", 3, {0, 1, 2, -1}, false},  {"BGR", 3, {2, 1, 0, -1}, false},
                           {"RAGB", 4, {0, 2, 3, 1}, false},  {"R-G-B-", 6, {0, 2, 4, -1}, false},
                           {"RGB-", 4, {0, 1, 2, -1}, false}, {"GBR", 3, {2, 0, 1, -1}, false}};

// A picture that ends with its last pixel's last byte before an inaccessible page.
class Packed {
 public:
  Packed(const Layout& layout, int width, int height, int gap, bool bottom_up)
      : layout_(layout),
        width_(width),
        height_(height),
        stride_(width * layout.bytes + gap),
        bottom_up_(bottom_up),
        bytes_(static_cast<size_t>(stride_ * (height - 1) + width * layout.bytes)) {
    std::fill(bytes_.begin(), bytes_.end(), kCanary);
  }

  // channel: 0 R, 1 G, 2 B, 3 alpha.
  uint8_t& at(int row, int col, int channel) { return bytes_[offset(row, col, channel)]; }
  size_t offset(int row, int col, int channel) const {
    const int line = bottom_up_ ? height_ - 1 - row : row;
    return static_cast<size_t>(line * stride_ + col * layout_.bytes +
                               layout_.at[static_cast<size_t>(channel)]);
  }
  bool has_alpha() const { return layout_.at[3] >= 0; }
  BeforeTheEdge<uint8_t>& bytes() { return bytes_; }

  template <typename Byte>
  BasicImageView<Byte> view() {
    BasicImageView<Byte> view;
    for (int c = 0; c < 3; ++c) view.channel[c] = &at(0, 0, c);
    if (has_alpha()) view.alpha = &at(0, 0, 3);
    view.alpha_is_padding = layout_.padding;
    view.width = width_;
    view.height = height_;
    view.pixel_stride = layout_.bytes;
    view.row_stride = bottom_up_ ? -stride_ : stride_;
    return view;
  }

 private:
  Layout layout_;
  int width_, height_, stride_;
  bool bottom_up_;
  BeforeTheEdge<uint8_t> bytes_;
};

// Calls check(layout, width, gap, bottom_up).
template <typename Check>
void for_every_layout(Check check) {
  for (const Layout& layout : kLayouts)
    for (int width : kWidths)
      for (int gap : {0, 13})
        for (bool bottom_up : {false, true}) {
          check(layout, width, gap, bottom_up);
          ASSERT_FALSE(testing::Test::HasFailure())
              << layout.name << ", width " << width << ", gap " << gap << ", bottom up "
              << bottom_up;
        }
}

constexpr int kHeight = 3;
constexpr std::pair<int, int> kRowRanges[] = {{0, 3}, {0, 1}, {1, 1}, {1, 2}, {2, 1}, {0, 2}};

TEST(SplitChannels, EveryLayoutWidthAndRowRange) {
  std::mt19937 rng(201);
  on_every_target([&] {
    for_every_layout([&](const Layout& layout, int width, int gap, bool bottom_up) {
      Packed frame(layout, width, kHeight, gap, bottom_up);
      for (uint8_t& byte : frame.bytes()) byte = random_byte(rng);
      const auto pixels = static_cast<size_t>(width * kHeight);
      for (const auto& [first, count] : kRowRanges) {
        std::array<std::unique_ptr<BeforeTheEdge<uint8_t>>, 3> planes;
        uint8_t* to[3];
        for (size_t c = 0; c < 3; ++c) {
          planes[c] = std::make_unique<BeforeTheEdge<uint8_t>>(pixels);
          std::fill(planes[c]->begin(), planes[c]->end(), kCanary);
          to[c] = planes[c]->data();
        }
        split_channels(frame.view<const uint8_t>(), first, count, 0, to);
        for (int row = 0; row < kHeight; ++row)
          for (int col = 0; col < width; ++col)
            for (int c = 0; c < 3; ++c) {
              const bool inside = row >= first && row < first + count;
              ASSERT_EQ(to[c][row * width + col], inside ? frame.at(row, col, c) : kCanary)
                  << "row " << row << ", column " << col << ", channel " << c << ", rows from "
                  << first;
            }
      }
    });
  });
}

TEST(SplitChannels, SeesOneAlphaSampleThatDiffers) {
  std::mt19937 rng(202);
  for (const Layout& layout : kLayouts)
    for (int width : {1, 3, 16, 17, 65})
      for (int gap : {0, 5})
        on_every_target([&] {
          Packed frame(layout, width, kHeight, gap, false);
          for (uint8_t& byte : frame.bytes()) byte = random_byte(rng);
          std::vector<uint8_t> planes(static_cast<size_t>(3 * width * kHeight));
          uint8_t* const to[3] = {planes.data(), planes.data() + width * kHeight,
                                  planes.data() + 2 * width * kHeight};
          const auto constant = [&](int first, int count, uint8_t alpha) {
            return split_channels(frame.view<const uint8_t>(), first, count, alpha, to);
          };
          if (!frame.has_alpha() || layout.padding) {
            EXPECT_TRUE(constant(0, kHeight, 77)) << layout.name << ": there is nothing to see";
            return;
          }
          const uint8_t value = random_byte(rng);
          for (int row = 0; row < kHeight; ++row)
            for (int col = 0; col < width; ++col) frame.at(row, col, 3) = value;
          EXPECT_TRUE(constant(0, kHeight, value)) << layout.name;
          EXPECT_FALSE(constant(0, kHeight, static_cast<uint8_t>(value + 1))) << layout.name;
          for (int row = 0; row < kHeight; ++row)
            for (int col = 0; col < width; ++col)
              for (int bit : {1, 0x80}) {
                frame.at(row, col, 3) = static_cast<uint8_t>(value ^ bit);
                for (const auto& [first, count] : kRowRanges)
                  ASSERT_EQ(constant(first, count, value), row < first || row >= first + count)
                      << layout.name << ", " << width << " wide, " << row << ", " << col;
                frame.at(row, col, 3) = value;
              }
        });
}

TEST(SplitChannels, PlanarPictures) {
  std::mt19937 rng(203);
  for (int gap : {0, 9}) {
    constexpr int kWidth = 37;
    std::vector<uint8_t> bytes(static_cast<size_t>(3 * kHeight * (kWidth + gap)));
    for (uint8_t& byte : bytes) byte = random_byte(rng);
    ImageView view;
    for (int c = 0; c < 3; ++c) view.channel[c] = bytes.data() + c * kHeight * (kWidth + gap);
    view.width = kWidth;
    view.height = kHeight;
    view.pixel_stride = 1;
    view.row_stride = kWidth + gap;
    std::vector<uint8_t> planes(3 * kHeight * kWidth);
    uint8_t* const to[3] = {planes.data(), planes.data() + kHeight * kWidth,
                            planes.data() + 2 * kHeight * kWidth};
    EXPECT_TRUE(split_channels(view, 0, kHeight, 9, to));
    for (int c = 0; c < 3; ++c)
      for (int row = 0; row < kHeight; ++row)
        for (int col = 0; col < kWidth; ++col)
          ASSERT_EQ(to[c][row * kWidth + col], view.channel[c][row * view.row_stride + col]);
  }
}

TEST(JoinChannels, WritesItsPixelsAndNothingElse) {
  std::mt19937 rng(204);
  on_every_target([&] {
    for_every_layout([&](const Layout& layout, int width, int gap, bool bottom_up) {
      for (const auto& [left, count] :
           {std::pair{0, width}, {width / 2, width - width / 2}, {0, (width + 1) / 2}}) {
        Packed out(layout, width, kHeight, gap, bottom_up);
        std::vector<std::unique_ptr<BeforeTheEdge<uint8_t>>> samples;
        for (int c = 0; c < 4; ++c) {
          samples.push_back(std::make_unique<BeforeTheEdge<uint8_t>>(static_cast<size_t>(count)));
          for (uint8_t& sample : *samples.back()) sample = random_byte(rng);
        }
        const uint8_t* const channels[3] = {samples[0]->data(), samples[1]->data(),
                                            samples[2]->data()};
        for (int row : {1, 2}) {
          std::vector<uint8_t> expected(out.bytes().begin(), out.bytes().end());
          for (int p = 0; p < count; ++p)
            for (int c = 0; c < (out.has_alpha() ? 4 : 3); ++c)
              expected[out.offset(row, left + p, c)] =
                  (*samples[static_cast<size_t>(c)])[static_cast<size_t>(p)];
          join_channels(channels, samples[3]->data(), static_cast<size_t>(count),
                        out.view<uint8_t>(), row, left);
          ASSERT_EQ(std::vector<uint8_t>(out.bytes().begin(), out.bytes().end()), expected)
              << "row " << row << ", " << count << " from " << left;
        }
      }
    });
  });
}

TEST(JoinChannels, UndoesSplitChannels) {
  std::mt19937 rng(205);
  for (const Layout& layout : kLayouts) {
    constexpr int kWidth = 117;
    Packed frame(layout, kWidth, 1, 0, false), again(layout, kWidth, 1, 0, false);
    std::vector<uint8_t> alpha(kWidth), planes(3 * kWidth);
    for (int col = 0; col < kWidth; ++col)
      for (int c = 0; c < (frame.has_alpha() ? 4 : 3); ++c) frame.at(0, col, c) = random_byte(rng);
    for (int col = 0; col < kWidth && frame.has_alpha(); ++col)
      alpha[static_cast<size_t>(col)] = frame.at(0, col, 3);
    uint8_t* const rows[3] = {planes.data(), planes.data() + kWidth, planes.data() + 2 * kWidth};
    split_channels(frame.view<const uint8_t>(), 0, 1, 0, rows);
    join_channels(rows, alpha.data(), kWidth, again.view<uint8_t>(), 0, 0);
    EXPECT_TRUE(std::equal(frame.bytes().begin(), frame.bytes().end(), again.bytes().begin()))
        << layout.name;
  }
}

// ---- What frame and background differ in ----

constexpr size_t kCounts[] = {0, 1, 3, 15, 16, 17, 31, 32, 33, 63, 64, 65, 255, 1024};

TEST(AbsoluteResidual, OfEveryPairOfLevels) {
  on_every_target([] {
    for (int level = 0; level < 256; ++level) {
      BeforeTheEdge<uint8_t> x(256), l(256), out(256);
      for (size_t p = 0; p < 256; ++p) {
        x[p] = static_cast<uint8_t>(p);
        l[p] = static_cast<uint8_t>(level);
      }
      absolute_residual(x.data(), l.data(), 256, out.data());
      for (size_t p = 0; p < 256; ++p)
        ASSERT_EQ(out[p], std::abs(static_cast<int>(p) - level)) << p << " - " << level;
    }
  });
}

TEST(AbsoluteResidual, OfAnyCount) {
  std::mt19937 rng(206);
  on_every_target([&] {
    for (size_t count : kCounts) {
      BeforeTheEdge<uint8_t> x(count), l(count), out(count);
      for (uint8_t& sample : x) sample = random_byte(rng);
      for (uint8_t& sample : l) sample = random_byte(rng);
      absolute_residual(x.data(), l.data(), count, out.data());
      for (size_t p = 0; p < count; ++p) ASSERT_EQ(out[p], std::abs(x[p] - l[p]));
    }
  });
}

// The largest integer whose square is at most `square`, at most 255.
int whole_root(int square) {
  const int root = static_cast<int>(std::lround(std::sqrt(square)));
  return std::min(255, root * root > square ? root - 1 : root);
}

TEST(ResidualNorm, OfEveryNorm) {
  on_every_target([] {
    BeforeTheEdge<uint8_t> red(256), green(256), blue(256), white(256), norm(256), quarters(256);
    std::fill(white.begin(), white.end(), static_cast<uint8_t>(255));
    for (size_t p = 0; p < 256; ++p) blue[p] = static_cast<uint8_t>(p);
    const uint8_t* const x[3] = {white.data(), green.data(), blue.data()};
    BeforeTheEdge<uint8_t> zero(256);
    std::fill(zero.begin(), zero.end(), static_cast<uint8_t>(0));
    const uint8_t* const l[3] = {red.data(), white.data(), zero.data()};
    for (int r = 0; r < 256; r += r < 72 ? 1 : 3) {
      std::fill(red.begin(), red.end(), static_cast<uint8_t>(255 - r));
      for (int g = 0; g <= r; ++g) {
        std::fill(green.begin(), green.end(), static_cast<uint8_t>(255 - g));
        residual_norm(x, l, 256, norm.data());
        residual_norm(x, l, 256, quarters.data(), 4);
        for (int b = 0; b < 256; ++b) {
          const int square = r * r + g * g + b * b;
          if (norm[static_cast<size_t>(b)] != whole_root(square) ||
              quarters[static_cast<size_t>(b)] != whole_root(16 * square))
            FAIL() << square;
        }
      }
    }
  });
}

TEST(ResidualNorm, OfAnyCount) {
  std::mt19937 rng(208);
  on_every_target([&] {
    for (size_t count : kCounts) {
      std::array<std::unique_ptr<BeforeTheEdge<uint8_t>>, 6> planes;
      for (auto& plane : planes) {
        plane = std::make_unique<BeforeTheEdge<uint8_t>>(count);
        for (uint8_t& sample : *plane) sample = random_byte(rng);
      }
      // As far apart as any, and so near that quarters of levels do not saturate.
      for (int step : {1, 16}) {
        BeforeTheEdge<uint8_t> norm(count), quarters(count);
        for (auto& plane : planes)
          for (uint8_t& sample : *plane) sample = static_cast<uint8_t>(sample / step);
        const uint8_t* const x[3] = {planes[0]->data(), planes[1]->data(), planes[2]->data()};
        const uint8_t* const l[3] = {planes[3]->data(), planes[4]->data(), planes[5]->data()};
        residual_norm(x, l, count, norm.data());
        residual_norm(x, l, count, quarters.data(), 4);
        for (size_t p = 0; p < count; ++p) {
          int square = 0;
          for (size_t c = 0; c < 3; ++c) square += (x[c][p] - l[c][p]) * (x[c][p] - l[c][p]);
          ASSERT_EQ(norm[p], whole_root(square));
          ASSERT_EQ(quarters[p], whole_root(16 * square));
        }
      }
    }
  });
}

int whole_steps(int square) {
  return static_cast<int>(std::floor(kResidualSteps * std::sqrt(static_cast<double>(square))));
}

// Also where it is at its limit, which it does not exceed.
TEST(ResidualSteps, OfEveryNormAndLimit) {
  on_every_target([] {
    BeforeTheEdge<uint8_t> red(256), green(256), blue(256), zero(256), limit(256);
    BeforeTheEdge<uint16_t> steps(256), unlimited(256);
    std::fill(zero.begin(), zero.end(), static_cast<uint8_t>(0));
    for (size_t p = 0; p < 256; ++p) blue[p] = static_cast<uint8_t>(p);
    const uint8_t* const x[3] = {red.data(), zero.data(), blue.data()};
    const uint8_t* const l[3] = {zero.data(), green.data(), zero.data()};
    for (int r = 0; r < 256; ++r) {
      std::fill(red.begin(), red.end(), static_cast<uint8_t>(r));
      for (int g = 0; g <= r; ++g) {
        std::fill(green.begin(), green.end(), static_cast<uint8_t>(g));
        for (int b = 0; b < 256; ++b)
          limit[static_cast<size_t>(b)] = static_cast<uint8_t>(whole_root(r * r + g * g + b * b));
        residual_steps(x, l, 256, limit.data(), steps.data());
        residual_steps(x, l, 256, nullptr, unlimited.data());
        for (int b = 0; b < 256; ++b) {
          const auto at = static_cast<size_t>(b);
          const int square = r * r + g * g + b * b, whole = whole_steps(square);
          const bool beyond = square > limit[at] * limit[at];
          if (steps[at] != whole + (beyond ? kResidualBeyond : 0) ||
              unlimited[at] != whole + (square > 0 ? kResidualBeyond : 0))
            FAIL() << square << " beyond " << int(limit[at]);
        }
      }
    }
    EXPECT_LT(whole_steps(3 * 255 * 255), kResidualBeyond);
  });
}

TEST(ResidualSteps, OfAnyCount) {
  std::mt19937 rng(209);
  on_every_target([&] {
    for (size_t count : kCounts) {
      std::array<std::unique_ptr<BeforeTheEdge<uint8_t>>, 7> planes;
      for (auto& plane : planes) {
        plane = std::make_unique<BeforeTheEdge<uint8_t>>(count);
        for (uint8_t& sample : *plane) sample = random_byte(rng);
      }
      BeforeTheEdge<uint16_t> steps(count);
      const uint8_t* const x[3] = {planes[0]->data(), planes[1]->data(), planes[2]->data()};
      const uint8_t* const l[3] = {planes[3]->data(), planes[4]->data(), planes[5]->data()};
      residual_steps(x, l, count, planes[6]->data(), steps.data());
      for (size_t p = 0; p < count; ++p) {
        int square = 0;
        for (size_t c = 0; c < 3; ++c) square += (x[c][p] - l[c][p]) * (x[c][p] - l[c][p]);
        const int limit = (*planes[6])[p];
        ASSERT_EQ(steps[p], whole_steps(square) + (square > limit * limit ? kResidualBeyond : 0));
      }
    }
  });
}

// Pixels of three channels, frame and background.
struct Pixels {
  std::vector<std::array<uint8_t, 6>> all;

  void check(double threshold, size_t first, size_t count) const {
    std::vector<std::unique_ptr<BeforeTheEdge<uint8_t>>> planes;
    for (size_t c = 0; c < 6; ++c) {
      planes.push_back(std::make_unique<BeforeTheEdge<uint8_t>>(count));
      for (size_t p = 0; p < count; ++p) (*planes.back())[p] = all[first + p][c];
    }
    const uint8_t* const x[3] = {planes[0]->data(), planes[1]->data(), planes[2]->data()};
    const uint8_t* const l[3] = {planes[3]->data(), planes[4]->data(), planes[5]->data()};
    BeforeTheEdge<uint8_t> mask(count), limits(count), limited(count);
    foreground_mask(x, l, count, threshold, nullptr, mask.data());
    std::mt19937 rng(static_cast<uint32_t>(first + count));
    for (uint8_t& limit : limits) limit = random_byte(rng);
    foreground_mask(x, l, count, threshold, limits.data(), limited.data());
    for (size_t p = 0; p < count; ++p) {
      int64_t sum = 0;
      for (size_t c = 0; c < 3; ++c) {
        const int64_t difference = all[first + p][c] - all[first + p][3 + c];
        sum += difference * difference;
      }
      // More digits than a double, so that a norm at the threshold is not rounded to either side.
      const bool above =
          std::sqrt(static_cast<long double>(sum)) > static_cast<long double>(threshold);
      ASSERT_EQ(mask[p], above ? 255 : 0) << "squared norm " << sum << ", threshold " << threshold;
      ASSERT_EQ(limited[p], above && sum > limits[p] * limits[p] ? 255 : 0)
          << "squared norm " << sum << ", limit " << int{limits[p]};
    }
  }
};

// From none to more than any norm. 255.998^2 is the last below the 16-bit sums' end.
constexpr double kThresholds[] = {0,     0.5,    1,       17.99, 18,     18.01,    127.5,
                                  255,   255.99, 255.998, 256,   256.01, 300,      441,
                                  441.5, 441.67, 441.68,  442,   1e9,    kInfinity};

TEST(ForegroundMask, EqualsItsDefinition) {
  std::mt19937 rng(207);
  constexpr int kDistances[] = {0, 1, 2, 3, 10, 17, 18, 19, 127, 128, 180, 181, 182, 254, 255};
  Pixels pixels;
  for (int r : kDistances)
    for (int g : kDistances)
      for (int b : kDistances) {
        std::array<uint8_t, 6> pixel;
        const int distances[] = {r, g, b};
        for (size_t c = 0; c < 3; ++c) {
          // Either side may be the brighter one.
          const auto low = static_cast<uint8_t>(rng() % static_cast<uint32_t>(256 - distances[c]));
          const auto high = static_cast<uint8_t>(low + distances[c]);
          const bool up = rng() % 2 == 0;
          pixel[c] = up ? high : low;
          pixel[3 + c] = up ? low : high;
        }
        pixels.all.push_back(pixel);
      }
  // Norms of 18 (in several ways), of 255, and of 256 exactly.
  for (const std::array<uint8_t, 3>& d : {std::array<uint8_t, 3>{18, 0, 0},
                                          {0, 18, 0},
                                          {12, 12, 6},
                                          {16, 8, 2},
                                          {255, 0, 0},
                                          {0, 0, 255},
                                          {170, 170, 85},
                                          {0, 0, 0},
                                          {255, 255, 255}})
    pixels.all.push_back({d[0], d[1], d[2], 0, 0, 0});
  on_every_target([&] {
    for (double threshold : kThresholds) {
      pixels.check(threshold, 0, pixels.all.size());
      ASSERT_FALSE(testing::Test::HasFatalFailure());
    }
  });
}

TEST(ForegroundMask, OfAnyCount) {
  std::mt19937 rng(208);
  Pixels pixels;
  for (int p = 0; p < 1100; ++p) {
    std::array<uint8_t, 6> pixel;
    for (uint8_t& sample : pixel) sample = random_byte(rng);
    pixels.all.push_back(pixel);
  }
  on_every_target([&] {
    for (double threshold : {0.0, 100.0, 255.0, 300.0})
      for (size_t count : kCounts) pixels.check(threshold, count % 7, count);
  });
}

TEST(ApplyMask, KeepsWhereWhiteAndClearsWhereBlack) {
  std::mt19937 rng(209);
  on_every_target([&] {
    for (size_t count : kCounts) {
      BeforeTheEdge<uint8_t> x(count), mask(count), out(count);
      for (size_t p = 0; p < count; ++p) {
        x[p] = random_byte(rng);
        mask[p] = rng() % 2 ? 255 : 0;
      }
      apply_mask(x.data(), mask.data(), count, out.data());
      for (size_t p = 0; p < count; ++p) ASSERT_EQ(out[p], mask[p] ? x[p] : 0);
    }
  });
}

}  // namespace
}  // namespace qdmd::test
