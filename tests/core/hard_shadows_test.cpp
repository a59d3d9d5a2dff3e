// SPDX-License-Identifier: LGPL-2.1-or-later
// Hard shadows: what is taken out of a mask, against a slow reference; floors with shadows and
// things.
#include "core/foreground/hard_shadows.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include "gtest/gtest.h"
#include "tests/core/mask_util.h"

namespace qdmd::test {
namespace {

constexpr uint8_t kNoBlack[3] = {0, 0, 0};

ComparedPlanes planes_of(const Floor& frame, const Floor& level) {
  ComparedPlanes planes;
  for (int c = 0; c < 3; ++c)
    planes.x[c] = frame.level[c].data(), planes.l[c] = level.level[c].data();
  planes.x_stride = planes.l_stride = static_cast<size_t>(frame.width);
  return planes;
}

// ---- A slow reference ----

// The rules of hard_shadows.h, word by word: regions by flooding, sums by looking at all pairs.
class Reference {
 public:
  Reference(int width, int height, int step) : width_(width), height_(height), side_(2 * step) {
    cols_ = (width + side_ - 1) / side_, rows_ = (height + side_ - 1) / side_;
  }

  std::vector<uint8_t> take_out(const Floor& frame, const Floor& level, std::vector<uint8_t> mask) {
    const auto blocks = static_cast<size_t>(cols_ * rows_);
    blocks_.assign(blocks, {});
    for (int row = 0; row < rows_; ++row)
      for (int col = 0; col < cols_; ++col)
        blocks_[at(col, row)] = read(frame, level, mask, col, row);
    int regions = 0;
    std::vector<Sums> sums;
    for (size_t k = 0; k < blocks; ++k)
      if (blocks_[k].dark && blocks_[k].region < 0) {
        flood(k, regions++);
        sums.push_back(sums_of(regions - 1));
      }
    if (std::none_of(sums.begin(), sums.end(), [&](const Sums& of) { return is_judged(of); }))
      return mask;
    std::vector<bool> shadow(sums.size());
    for (size_t i = 0; i < sums.size(); ++i) shadow[i] = is_shadow(sums[i]);
    learn(sums);
    std::vector<uint8_t> left = mask;
    const auto kind = [&](int col, int row) {  // 2: shadow, 1: thing
      if (col < 0 || row < 0 || col >= cols_ || row >= rows_) return 0;
      const Block& block = blocks_[at(col, row)];
      if (!block.white) return 0;
      if (!block.dark) return 1;
      const auto region = static_cast<size_t>(block.region);
      return shadow[region] ? 2 : sums[region].blocks >= all_.least_blocks ? 1 : 0;
    };
    const auto beside = [&](int col, int row, int wanted) {
      for (int y = row - 1; y <= row + 1; ++y)
        for (int x = col - 1; x <= col + 1; ++x)
          if (kind(x, y) == wanted) return true;
      return false;
    };
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        const int col = x / side_, row = y / side_;
        if (kind(col, row) == 2 ||
            (kind(col, row) == 0 && beside(col, row, 2) && !beside(col, row, 1)))
          left[static_cast<size_t>(y * width_ + x)] = 0;
      }
    return left;
  }

 private:
  struct Block {
    bool white = false, dark = false;
    int region = -1;
    std::array<bool, 3> clipped{};
    std::array<int, 3> x{}, l{};
    int step = 0;
  };
  struct Sums {
    double blocks = 0, squares = 0, both = 0, light = 0, level = 0, pairs = 0;
    std::array<double, 3> ratio{}, clipped{};
  };

  size_t at(int col, int row) const { return static_cast<size_t>(row * cols_ + col); }

  Block read(const Floor& frame, const Floor& level, const std::vector<uint8_t>& mask, int col,
             int row) const {
    Block block;
    std::array<double, 3> x{}, l{};
    int count = 0;
    for (int y : {row * side_, row * side_ + side_ / 2})
      for (int at : {col * side_, col * side_ + side_ / 2}) {
        const size_t p = frame.index(std::min(at, width_ - 1), std::min(y, height_ - 1));
        if (mask[p] == 0) continue;
        ++count;
        for (size_t c = 0; c < 3; ++c) x[c] += frame.level[c][p], l[c] += level.level[c][p];
      }
    if (count < 2) return block;
    block.white = true;
    int sum = 0, brightest = INT32_MIN;
    const auto whole = [](double log) { return static_cast<int>(std::lround(4096 * log)); };
    for (size_t c = 0; c < 3; ++c) {
      const auto quarters = [&](double total) {
        return std::floor(4 * static_cast<double>(static_cast<float>(total) *
                                                  (1 / static_cast<float>(count))) +
                          0.5) /
               4;
      };
      block.x[c] = whole(std::log(quarters(x[c]) + 2));
      block.l[c] = whole(std::log(quarters(l[c]) + 2));
      block.step = std::max(block.step, whole(all_.step + all_.noise / (quarters(x[c]) + 2)));
      block.clipped[c] = l[c] / count >= all_.clipped;
      sum += block.x[c] - block.l[c];
      brightest = std::max(brightest, block.x[c] - block.l[c]);
    }
    block.dark = sum < -3 * whole(all_.dark) && brightest < whole(all_.dark / 6);
    return block;
  }

  void flood(size_t first, int region) {
    std::queue<size_t> next;
    next.push(first);
    blocks_[first].region = region;
    while (!next.empty()) {
      const size_t k = next.front();
      next.pop();
      const int col = static_cast<int>(k) % cols_, row = static_cast<int>(k) / cols_;
      for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        if (col + dx < 0 || col + dx >= cols_ || row + dy < 0 || row + dy >= rows_) continue;
        Block& other = blocks_[at(col + dx, row + dy)];
        const Block& block = blocks_[k];
        bool near = other.dark && other.region < 0;
        for (size_t c = 0; c < 3; ++c)
          near &= std::abs((block.x[c] - block.l[c]) - (other.x[c] - other.l[c])) <
                  std::max(block.step, other.step);
        if (!near) continue;
        other.region = region;
        next.push(at(col + dx, row + dy));
      }
    }
  }

  Sums sums_of(int region) const {
    Sums sums;
    for (int row = 0; row < rows_; ++row)
      for (int col = 0; col < cols_; ++col) {
        const Block& a = blocks_[at(col, row)];
        if (!a.white) continue;
        if (a.region == region) {
          ++sums.blocks;
          for (size_t c = 0; c < 3; ++c) {
            sums.ratio[c] += (a.x[c] - a.l[c]) / 4096.0;
            sums.squares += std::pow((a.x[c] - a.l[c]) / 4096.0, 2);
            sums.clipped[c] += a.clipped[c];
          }
        }
        for (const auto& [right, down] : {std::pair{1, 0}, {2, 0}, {0, 1}, {0, 2}}) {
          if (col + right >= cols_ || row + down >= rows_) continue;
          const Block& b = blocks_[at(col + right, row + down)];
          if (!b.white) continue;
          const double weight = 0.5 * ((a.region == region) + (b.region == region));
          for (size_t c = 0; c < 3; ++c) {
            if (a.clipped[c] || b.clipped[c]) continue;
            const double dx = std::clamp((b.x[c] - a.x[c]) / 4096.0, -all_.edge, all_.edge),
                         dl = std::clamp((b.l[c] - a.l[c]) / 4096.0, -all_.edge, all_.edge);
            sums.both += weight * dx * dl, sums.light += weight * dx * dx;
            sums.level += weight * dl * dl, sums.pairs += weight;
          }
        }
      }
    return sums;
  }

  std::array<int, 3> ratio_of(const Sums& sums) const {
    const double r = sums.ratio[0] / sums.blocks, g = sums.ratio[1] / sums.blocks,
                 b = sums.ratio[2] / sums.blocks;
    const auto place = [&](double log) { return static_cast<int>(std::floor(log / all_.width)); };
    return {std::clamp(place(-(r + g + b) / 3), 0, 19), std::clamp(place(g - r), -5, 4),
            std::clamp(place(b - g), -5, 4)};
  }

  bool is_judged(const Sums& sums) const {
    if (sums.blocks < all_.least_blocks) return false;
    double squares = sums.squares / sums.blocks;
    for (const double ratio : sums.ratio) squares -= std::pow(ratio / sums.blocks, 2);
    if (std::sqrt(squares / 3) >= all_.most_spread) return false;
    for (size_t red = 0; red < 3; ++red)
      for (size_t blue = red + 1; blue < 3; ++blue) {
        const double bluer = (sums.ratio[blue] - sums.ratio[red]) / sums.blocks;
        const bool red_bound = sums.clipped[red] > all_.clipped_share * sums.blocks,
                   blue_bound = sums.clipped[blue] > all_.clipped_share * sums.blocks;
        if (bluer < -(red_bound && !blue_bound ? all_.redder_bound : all_.redder)) return false;
        if (bluer > (blue_bound && !red_bound ? all_.bluer_bound : all_.bluer)) return false;
      }
    return true;
  }

  bool is_shadow(const Sums& sums) const {
    if (!is_judged(sums)) return false;
    const auto place = ratio_of(sums);
    const double level = sums.level + all_.noise_of_pair * sums.pairs;
    double both_known = sums.both, level_known = level;
    for (const auto& [other, known] : known_)
      if (std::abs(other[0] - place[0]) <= 1 && std::abs(other[1] - place[1]) <= 1 &&
          std::abs(other[2] - place[2]) <= 1)
        both_known += known[0], level_known += known[1];
    const double slope = both_known / (level_known + all_.least_known);
    const double trust = all_.least_trust + all_.trust * sums.light / std::max(sums.pairs, 0.5);
    return slope > all_.slope_of_ratio &&
           (sums.both + trust * slope) / (level + trust) > all_.slope_of_region;
  }

  void learn(const std::vector<Sums>& regions) {
    for (auto& [place, known] : known_)
      for (double& sum : known) sum *= std::exp2(-1 / all_.half_life);
    for (const Sums& sums : regions) {
      if (!is_judged(sums) || (sums.blocks < 4 * all_.least_blocks && sums.both > 0.3 * sums.level))
        continue;
      auto& known = known_[ratio_of(sums)];
      known[0] += sums.both;
      known[1] += sums.level + all_.noise_of_pair * sums.pairs;
    }
  }

  HardShadowConstants all_;
  int width_, height_, side_, cols_, rows_;
  std::vector<Block> blocks_;
  std::map<std::array<int, 3>, std::array<double, 2>> known_;
};

Rectangle place_in(const Floor& floor, std::mt19937& rng, int size) {
  return {static_cast<int>(rng() % static_cast<unsigned>(floor.width)),
          static_cast<int>(rng() % static_cast<unsigned>(floor.height)), size, 2 * size};
}

void shade(const Floor& level, const Rectangle& area, const std::array<double, 3>& gain,
           Floor* frame, std::vector<uint8_t>* mask) {
  for (int y = area.y; y < std::min(level.height, area.y + area.height); ++y)
    for (int x = area.x; x < std::min(level.width, area.x + area.width); ++x) {
      const size_t p = level.index(x, y);
      for (size_t c = 0; c < 3; ++c)
        frame->level[c][p] = static_cast<uint8_t>(std::lround(gain[c] * level.level[c][p]));
      (*mask)[p] = 255;
    }
}

void put(const Rectangle& area, const std::array<int, 3>& colour, Floor* frame,
         std::vector<uint8_t>* mask) {
  frame->paint(area, colour);
  for (int y = area.y; y < std::min(frame->height, area.y + area.height); ++y)
    for (int x = area.x; x < std::min(frame->width, area.x + area.width); ++x)
      (*mask)[frame->index(x, y)] = 255;
}

TEST(HardShadows, AreThoseOfASlowReference) {
  std::mt19937 rng(661);
  size_t taken = 0, white = 0;
  for (const auto& [width, height, step] :
       {std::tuple{61, 47, 1}, {120, 81, 1}, {150, 100, 2}, {3, 200, 1}, {1, 1, 1}}) {
    Floor level = grainy_floor(width, height, rng);
    // Part of the floor is at the end of its range.
    level.paint({0, 0, width / 3, height / 2}, {255, 251, 200});
    level = with_noise(level, 3, rng);
    HardShadows fast(width, height, step);
    Reference slow(width, height, step);
    for (int t = 0; t < 40; ++t) {
      Floor frame = level;
      std::vector<uint8_t> mask(level.pixels());
      for (int i = 0; i < 3; ++i) {
        shade(level, place_in(level, rng, 14), {0.4, 0.42, 0.45}, &frame, &mask);
        put(place_in(level, rng, 10), {20 + static_cast<int>(rng() % 90), 50, 60}, &frame, &mask);
      }
      shade(level, place_in(level, rng, 8), {0.5, 0.4, 0.3}, &frame, &mask);
      frame = with_noise(frame, 2, rng);
      const std::vector<uint8_t> expected = slow.take_out(frame, level, mask);
      std::vector<uint8_t> found = mask, marks(mask.size());
      fast.take_out(planes_of(frame, level), {}, kNoBlack, nullptr, found.data(), marks.data());
      ASSERT_EQ(found, expected) << width << " x " << height << ", frame " << t;
      for (size_t p = 0; p < mask.size(); ++p) ASSERT_EQ(mask[p], found[p] | marks[p]);
      white += static_cast<size_t>(std::count(mask.begin(), mask.end(), 255));
      taken += static_cast<size_t>(std::count(marks.begin(), marks.end(), 255));
    }
  }
  EXPECT_GT(taken, white / 5);
  EXPECT_LT(taken, white * 4 / 5);
}

// ---- What stays ----

// The share of a region that is taken, after 30 frames in which it is somewhere else.
template <typename Paint>
double taken_of(const Floor& level, const Paint& paint) {
  std::mt19937 rng(662);
  HardShadows shadows(level.width, level.height, 1);
  double share = 0;
  for (int t = 0; t < 30; ++t) {
    Floor frame = level;
    std::vector<uint8_t> mask(level.pixels());
    paint(Rectangle{10 + 4 * t, 20, 24, 50}, &frame, &mask);
    frame = with_noise(frame, 2, rng);
    std::vector<uint8_t> left = mask;
    shadows.take_out(planes_of(frame, level), {}, kNoBlack, nullptr, left.data(), nullptr);
    share = 1 - static_cast<double>(std::count(left.begin(), left.end(), 255)) /
                    static_cast<double>(std::count(mask.begin(), mask.end(), 255));
  }
  return share;
}

TEST(HardShadows, HaveTheBackgroundsTextureAndTheSkysColour) {
  std::mt19937 rng(663);
  const Floor grainy = grainy_floor(200, 120, rng);
  Floor flat(200, 120);
  flat.paint({0, 0, 200, 120}, {150, 125, 100});
  const auto shaded = [](const Floor& level, const std::array<double, 3>& gain) {
    return taken_of(level, [&](const Rectangle& area, Floor* frame, std::vector<uint8_t>* mask) {
      shade(level, area, gain, frame, mask);
    });
  };
  EXPECT_GT(shaded(grainy, {0.4, 0.4, 0.4}), 0.95);
  EXPECT_GT(shaded(grainy, {0.2, 0.22, 0.25}), 0.95);
  // No sky is so red, or so blue.
  EXPECT_EQ(shaded(grainy, {0.5, 0.4, 0.3}), 0);
  EXPECT_EQ(shaded(grainy, {0.2, 0.3, 0.5}), 0);
  // Nobody can tell this from a coat.
  EXPECT_EQ(shaded(flat, {0.4, 0.4, 0.4}), 0);
  // A coat.
  EXPECT_EQ(taken_of(grainy,
                     [](const Rectangle& area, Floor* frame, std::vector<uint8_t>* mask) {
                       put(area, {60, 50, 40}, frame, mask);
                     }),
            0);
}

}  // namespace
}  // namespace qdmd::test
