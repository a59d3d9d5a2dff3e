// SPDX-License-Identifier: LGPL-2.1-or-later
// Edges of masks: which pixels of blurred things are background, and what stays as it is.
#include "core/foreground/edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <vector>

#include "gtest/gtest.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 70, kHeight = 60;
using Colour = std::array<double, 3>;

// A frame before a grey background, which shows `share` of each pixel's colour; and the mask of all
// that differs by more than 18 levels, which is what a decision begins with.
struct Picture {
  std::array<std::vector<uint8_t>, 3> x, l;
  std::vector<uint8_t> mask, inside, out;

  Picture(const std::function<double(int, int)>& share, const std::function<Colour(int, int)>& of) {
    for (auto* planes : {&x, &l})
      for (auto& plane : *planes) plane.assign(kWidth * kHeight, 100);
    mask.assign(kWidth * kHeight, 0);
    inside = out = mask;
    for (int row = 0; row < kHeight; ++row)
      for (int col = 0; col < kWidth; ++col) {
        double square = 0;
        for (size_t c = 0; c < 3; ++c) {
          uint8_t& sample = x[c][at(col, row)];
          sample =
              static_cast<uint8_t>(std::lround(100 + share(col, row) * (of(col, row)[c] - 100)));
          square += (sample - 100.0) * (sample - 100.0);
        }
        mask[at(col, row)] = square > 18 * 18 ? 255 : 0;
      }
  }
  static size_t at(int col, int row) { return static_cast<size_t>(row * kWidth + col); }
  const std::vector<uint8_t>& fit(int parts = 1) {
    EdgeView view = {};
    for (size_t c = 0; c < 3; ++c) view.planes.x[c] = x[c].data(), view.planes.l[c] = l[c].data();
    view.planes.x_stride = view.planes.l_stride = kWidth;
    view.width = kWidth, view.height = kHeight;
    view.mask = mask.data(), view.inside = inside.data();
    const auto in_parts = [&](const auto& work) {
      for (int i = 0; i < parts; ++i)
        work(kHeight * i / parts, kHeight * (i + 1) / parts - kHeight * i / parts);
    };
    in_parts([&](int first, int rows) { find_inside(view, first, rows); });
    in_parts([&](int first, int rows) { fit_edges(view, {}, first, rows, out.data()); });
    return out;
  }
};

// What a lens leaves of a disc's edge: a pixel's share falls from 1 to 0 around radius 20.
double disc(int col, int row) {
  return 1 / (1 + std::exp((std::hypot(col - 35, row - 30) - 20) / 0.5));
}
Colour dark(int, int) { return {20, 30, 40}; }

// The obvious way: all of it in floating point, the white pixels around each pixel counted anew.
std::vector<uint8_t> slowly_fitted(const Picture& picture) {
  const auto white = [&](int col, int row) {
    return col < 0 || row < 0 || col >= kWidth || row >= kHeight ||
           picture.mask[Picture::at(col, row)] == 255;
  };
  const auto all_white = [&](int col, int row, int reach) {
    for (int dy = -reach; dy <= reach; ++dy)
      for (int dx = -reach; dx <= reach; ++dx)
        if (!white(col + dx, row + dy)) return false;
    return true;
  };
  std::vector<uint8_t> fitted = picture.mask;
  for (int row = 0; row < kHeight; ++row)
    for (int col = 0; col < kWidth; ++col) {
      const bool edge = white(col, row) && !(white(col - 1, row) && white(col + 1, row) &&
                                             white(col, row - 1) && white(col, row + 1));
      if (!edge) continue;
      Colour thing = {}, own;
      int count = 0;
      for (int y = row - 3; y <= row + 3; y += 2)
        for (int x = col - 3; x <= col + 3; x += 2) {
          if (x < 0 || y < 0 || x >= kWidth || y >= kHeight || !all_white(x, y, 2)) continue;
          ++count;
          for (size_t c = 0; c < 3; ++c)
            thing[c] += picture.x[c][Picture::at(x, y)] - picture.l[c][Picture::at(x, y)];
        }
      if (count == 0) continue;
      double both = 0, squares = 0, rest = 0;
      for (size_t c = 0; c < 3; ++c) {
        thing[c] /= count;
        own[c] = picture.x[c][Picture::at(col, row)] - picture.l[c][Picture::at(col, row)];
        both += own[c] * thing[c];
        squares += thing[c] * thing[c];
      }
      const double share = both / squares;
      for (size_t c = 0; c < 3; ++c) rest += std::pow(own[c] - share * thing[c], 2);
      if (share < 0.5 && std::sqrt(rest) < 0.3 * std::sqrt(squares))
        fitted[Picture::at(col, row)] = 0;
    }
  return fitted;
}

TEST(Edges, AreWhereHalfOfAPixelIsTheThings) {
  Picture picture(disc, dark);
  const std::vector<uint8_t> before = picture.mask, &after = picture.fit();
  int wrong_before = 0, wrong_after = 0;
  for (int row = 0; row < kHeight; ++row)
    for (int col = 0; col < kWidth; ++col) {
      const bool thing = disc(col, row) >= 0.5;
      wrong_before += thing != (before[Picture::at(col, row)] == 255);
      wrong_after += thing != (after[Picture::at(col, row)] == 255);
    }
  // The mask was a pixel too wide, all around: some 125 pixels.
  EXPECT_GT(wrong_before, 60);
  EXPECT_EQ(0, wrong_after);
}

TEST(Edges, AreThoseOfTheObviousWay) {
  uint32_t seed = 5;
  for (int turn = 0; turn < 8; ++turn) {
    // Blobs of several colours, on the picture's border, too.
    std::array<double, 12> random;
    for (double& value : random) value = (seed = seed * 1664525 + 1013904223) / 4294967296.0;
    Picture picture(
        [&](int col, int row) {
          const double a = std::hypot(col - 70 * random[0], row - 60 * random[1]) - 18 * random[2],
                       b = std::hypot(col - 70 * random[3], row - 60 * random[4]) - 15 * random[5];
          return 1 / (1 + std::exp(std::min(a, b) / (0.4 + random[6])));
        },
        [&](int col, int row) -> Colour {
          return {20 + 200 * random[7], 128 + 127 * std::sin(random[8] * col),
                  128 + 100 * std::sin(random[9] * row)};
        });
    EXPECT_EQ(slowly_fitted(picture), picture.fit(1 + turn)) << turn;
  }
}

TEST(Edges, OfAnotherPartStay) {
  // A grey coat with white seams, five pixels wide, that differ from the background by less.
  const auto thing = [](int col, int row) {
    return col >= 20 && col < 50 && row >= 10 && row < 50 ? 1.0 : 0.0;
  };
  Picture picture(thing, [](int col, int row) -> Colour {
    const bool seam = col < 22 || col >= 48 || row < 12 || row >= 48;
    return seam ? Colour{100, 100, 160} : Colour{20, 20, 20};
  });
  const std::vector<uint8_t> before = picture.mask;
  EXPECT_EQ(before, picture.fit());
}

TEST(Edges, OfThinThingsStay) {
  // Nothing is inside of what is four pixels wide: nobody knows its colour.
  Picture picture(
      [](int col, int) {
        const double apart = std::abs(col - 30);
        return apart < 1 ? 1.0 : apart < 2 ? 0.3 : 0.0;
      },
      dark);
  const std::vector<uint8_t> before = picture.mask;
  EXPECT_GT(std::count(before.begin(), before.end(), 255), 0);
  EXPECT_EQ(before, picture.fit());
}

TEST(Edges, OfThePictureAreNone) {
  // It reaches beyond all four sides, and the picture is dark to its border.
  Picture picture([](int, int) { return 1.0; },
                  [](int col, int row) -> Colour {
                    const bool border =
                        col == 0 || row == 0 || col == kWidth - 1 || row == kHeight - 1;
                    return border ? Colour{80, 80, 80} : Colour{10, 10, 10};
                  });
  const std::vector<uint8_t> before = picture.mask;
  EXPECT_EQ(kWidth * kHeight, std::count(before.begin(), before.end(), 255));
  EXPECT_EQ(before, picture.fit());
}

TEST(Edges, OfNothingAreNone) {
  Picture picture([](int, int) { return 0.0; }, dark);
  const std::vector<uint8_t>& fitted = picture.fit(7);
  EXPECT_EQ(0, std::count(fitted.begin(), fitted.end(), 255));
}

}  // namespace
}  // namespace qdmd::test
