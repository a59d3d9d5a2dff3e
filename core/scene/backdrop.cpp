// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/backdrop.h"

#include <cmath>
#include <vector>

namespace qdmd::scene {
namespace {

// What one house looks like.
struct House {
  double left, right, top;  // shares of the frame
  Colour wall;
};

Colour random_colour(Stream& stream, int low, int high) {
  Colour colour;
  for (auto& level : colour) level = to_level(stream.uniform(low, high));
  return colour;
}

// Houses side by side over the whole canvas.
std::vector<House> build_houses(const StreamSource& streams) {
  std::vector<House> houses;
  Stream stream = streams.at(StreamSource::kSetup);
  for (double left = -1; left < 2;) {
    const double width = stream.uniform(0.14, 0.30);
    const double top = kHorizon + stream.uniform(-0.16, 0.06);
    houses.push_back({left, left + width, top, random_colour(stream, 70, 190)});
    left += width;
  }
  return houses;
}

// Smooth noise in -1 .. 1: bilinear between random numbers at the points of a grid.
class Texture {
 public:
  explicit Texture(uint64_t key) : key_(key) {}

  double operator()(double x, double y) const {
    const double left = std::floor(x), top = std::floor(y);
    const double u = x - left, v = y - top;
    const auto i = static_cast<int64_t>(left), j = static_cast<int64_t>(top);
    return (1 - v) * ((1 - u) * at(i, j) + u * at(i + 1, j)) +
           v * ((1 - u) * at(i, j + 1) + u * at(i + 1, j + 1));
  }

 private:
  double at(int64_t i, int64_t j) const {
    const uint64_t h = Stream::mix(key_ ^ Stream::mix(static_cast<uint64_t>(i) * 0x9e3779b1u +
                                                      static_cast<uint64_t>(j) * 0x85ebca77u));
    return static_cast<double>(h >> 11) * 0x1p-52 - 1;
  }

  uint64_t key_;
};

struct Region {
  double left, top, right, bottom;  // shares of the frame

  bool contains(double x, double y) const {
    return x >= left && x < right && y >= top && y < bottom;
  }
  Box box(int width, int height, int margin) const {
    const auto edge = [](double share, int length) {
      return static_cast<int>(std::lround(share * length));
    };
    const int x = edge(left, width), y = edge(top, height);
    return {x + margin, y + margin, edge(right, width) - x, edge(bottom, height) - y};
  }
};

constexpr Region kTreeCrown{0.70, 0.10, 0.98, 0.52};
constexpr Region kTrunk{0.825, 0.40, 0.855, 0.68};
constexpr Region kCanalWater{-1, kCanal, 2, 2};
constexpr Region kShopWindow{0.10, 0.47, 0.24, 0.60};

bool in_crown(double x, double y) {
  const double u = (x - 0.84) / 0.135, v = (y - 0.31) / 0.195;
  return u * u + v * v < 1;
}

// What the walls, the road and so on are made of.
struct Materials {
  std::vector<House> houses;
  Colour sky, pavement, road, water, leaves, screen;
  Texture coarse, fine;
};

Materials make_materials(const StreamSource& streams) {
  Stream stream = streams.at(StreamSource::kSetup - 1);
  const auto around = [&](int r, int g, int b) {
    return Colour{to_level(r + stream.uniform(-15, 15)), to_level(g + stream.uniform(-15, 15)),
                  to_level(b + stream.uniform(-15, 15))};
  };
  const Colour sky = around(150, 185, 215), pavement = around(165, 160, 150),
               road = around(95, 97, 102), water = around(70, 105, 120),
               leaves = around(60, 110, 50), screen = around(120, 150, 200);
  const Texture coarse(stream.next()), fine(stream.next());
  return {build_houses(streams), sky, pavement, road, water, leaves, screen, coarse, fine};
}

// A wall with rows of windows, in the house's own coordinates.
Colour wall(const House& house, double x, double y) {
  const double u = (x - house.left) / 0.05, v = (y - house.top) / 0.07;
  const double across = u - std::floor(u), down = v - std::floor(v);
  const bool window =
      v > 0.5 && y < kPavement - 0.08 && across > 0.3 && across < 0.75 && down > 0.25 && down < 0.8;
  return window ? Colour{45, 55, 68} : house.wall;
}

// The colour at a point of the frame, both coordinates as shares, before any texture; `contrast`
// is how strong the texture is there.
Colour colour_at(const Materials& m, double x, double y, double* contrast) {
  *contrast = 8;
  if (in_crown(x, y)) {
    *contrast = 45;
    return m.leaves;
  }
  if (kTrunk.contains(x, y)) return {85, 65, 48};
  if (kShopWindow.contains(x, y)) return m.screen;
  if (y >= kCanal) {
    *contrast = 22;
    return m.water;
  }
  if (y >= kRoad) {
    const bool marking = std::abs(y - 0.80) < 0.008 && x * 8 - std::floor(x * 8) < 0.55;
    return marking ? Colour{215, 215, 205} : m.road;
  }
  if (y >= kPavement) return m.pavement;
  for (const House& house : m.houses)
    if (x >= house.left && x < house.right && y >= house.top) return wall(house, x, y);
  *contrast = 5;
  const double bright = 1 + 0.15 * std::clamp(y / kHorizon, 0.0, 1.0);
  return {to_level(m.sky[0] * bright), to_level(m.sky[1] * bright), to_level(m.sky[2] * bright)};
}

}  // namespace

Backdrop::Backdrop(int width, int height, int margin, const StreamSource& streams)
    : margin_(margin), picture_(width + 2 * margin, height + 2 * margin) {
  const Materials materials = make_materials(streams);
  for (int y = 0; y < picture_.height; ++y)
    for (int x = 0; x < picture_.width; ++x) {
      const double px = x - margin + 0.5, py = y - margin + 0.5;
      double contrast = 0;
      const Colour base = colour_at(materials, px / width, py / height, &contrast);
      const double grain = contrast * (0.6 * materials.coarse(px / width * 60, py / height * 60) +
                                       0.4 * materials.fine(px / 1.5, py / 1.5));
      uint8_t* pixel = picture_.at(x, y);
      // Room for light, noise and weather on both sides.
      for (size_t c = 0; c < 3; ++c) pixel[c] = to_level(std::clamp(base[c] + grain, 16.0, 235.0));
    }
  const Box canvas{0, 0, picture_.width, picture_.height};
  tree_crown_ = intersection(canvas, kTreeCrown.box(width, height, margin));
  canal_ = intersection(canvas, kCanalWater.box(width, height, margin));
  shop_window_ = intersection(canvas, kShopWindow.box(width, height, margin));
}

Box Backdrop::seen(const Box& wanted) const {
  const Box frame{0, 0, picture_.width - 2 * margin_, picture_.height - 2 * margin_};
  Box box = intersection(frame, wanted);
  if (box.empty()) box = frame;
  return {box.x + margin_, box.y + margin_, box.width, box.height};
}

std::array<double, 3> Backdrop::mean(const Box& wanted) const {
  const Box box = seen(wanted);
  std::array<double, 3> sum{};
  for (int y = box.y; y < box.bottom(); ++y)
    for (int x = box.x; x < box.right(); ++x)
      for (size_t c = 0; c < 3; ++c) sum[c] += picture_.at(x, y)[c];
  for (auto& value : sum) value /= static_cast<double>(box.width) * box.height;
  return sum;
}

double Backdrop::contrast(const Box& wanted) const {
  const Box box = seen(wanted);
  const std::array<double, 3> level = mean(wanted);
  std::array<double, 3> squares{};
  for (int y = box.y; y < box.bottom(); ++y)
    for (int x = box.x; x < box.right(); ++x)
      for (size_t c = 0; c < 3; ++c) {
        const double off = picture_.at(x, y)[c] - level[c];
        squares[c] += off * off;
      }
  double sum = 0;
  for (const double value : squares)
    sum += std::sqrt(value / (static_cast<double>(box.width) * box.height));
  return sum / 3;
}

}  // namespace qdmd::scene
