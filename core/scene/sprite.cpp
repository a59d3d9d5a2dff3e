// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/sprite.h"

#include <cmath>
#include <numbers>
#include <optional>

namespace qdmd::scene {
namespace {

// Fills runs, area, extent and mean from the pixels for which `opaque(x, y)` holds.
template <typename Opaque>
void find_runs(Sprite* sprite, Opaque opaque) {
  int left = sprite->width(), right = 0, top = sprite->height(), bottom = 0;
  for (int y = 0; y < sprite->height(); ++y)
    for (int x = 0; x < sprite->width(); ++x) {
      if (!opaque(x, y)) continue;
      if (!sprite->runs.empty() && sprite->runs.back().y == y &&
          sprite->runs.back().x + sprite->runs.back().length == x)
        ++sprite->runs.back().length;
      else
        sprite->runs.push_back({y, x, 1});
      left = std::min(left, x), right = std::max(right, x + 1);
      top = std::min(top, y), bottom = y + 1;
      ++sprite->area;
      for (size_t c = 0; c < 3; ++c) sprite->mean[c] += sprite->picture.at(x, y)[c];
    }
  for (auto& value : sprite->mean) value /= std::max(sprite->area, 1);
  sprite->extent = {left, top, right - left, bottom - top};
}

// `paint(u, v)` gives the colour at a point, both coordinates in 0 .. 1, or nothing where the
// sprite is transparent. A sprite too small to catch any of it is all of the colour at `fallback`.
template <typename Paint>
Sprite rasterize(int width, int height, const Colour& fallback, Paint paint) {
  Sprite sprite;
  sprite.picture = Picture(std::max(width, 1), std::max(height, 1));
  Plane opaque(sprite.width(), sprite.height());
  bool any = false;
  for (int y = 0; y < sprite.height(); ++y)
    for (int x = 0; x < sprite.width(); ++x) {
      const std::optional<Colour> colour =
          paint((x + 0.5) / sprite.width(), (y + 0.5) / sprite.height());
      *opaque.at(x, y) = colour.has_value();
      any |= colour.has_value();
      std::copy_n(colour.value_or(fallback).begin(), 3, sprite.picture.at(x, y));
    }
  find_runs(&sprite, [&](int x, int y) { return !any || *opaque.at(x, y) != 0; });
  return sprite;
}

bool in_ellipse(double u, double v, double centre_u, double centre_v, double half_u,
                double half_v) {
  const double a = (u - centre_u) / half_u, b = (v - centre_v) / half_v;
  return a * a + b * b <= 1;
}

Colour shaded(const Colour& colour, double factor) {
  return {to_level(colour[0] * factor), to_level(colour[1] * factor), to_level(colour[2] * factor)};
}

}  // namespace

Sprite draw_person(int height, const Colour& coat, const Colour& trousers, double phase) {
  const double swing = std::sin(2 * std::numbers::pi * phase);
  const auto paint = [&](double u, double v) -> std::optional<Colour> {
    if (in_ellipse(u, v, 0.5, 0.09, 0.17, 0.085)) return Colour{205, 165, 140};
    if (v >= 0.17 && v < 0.56 && std::abs(u - 0.5) < 0.24 + 0.10 * (v - 0.17)) {
      // Folds of the coat, and a scarf.
      if (v < 0.215) return shaded(coat, 1.35);
      return shaded(coat, 0.9 + 0.15 * std::sin(u * 25 + v * 9));
    }
    if (v >= 0.56) {
      const double reach = (v - 0.56) / 0.44 * 0.26 * swing;
      const double near_leg = std::abs(u - 0.46 - reach), far_leg = std::abs(u - 0.54 + reach);
      if (v > 0.95 && std::min(near_leg, far_leg) < 0.15) return Colour{38, 34, 32};
      if (near_leg < 0.12) return trousers;
      if (far_leg < 0.12) return shaded(trousers, 0.75);
    }
    return std::nullopt;
  };
  return rasterize(static_cast<int>(std::lround(kWidthOfPerson * height)), height, coat, paint);
}

Sprite draw_van(int width, int height, const Colour& paint_colour) {
  const auto paint = [&](double u, double v) -> std::optional<Colour> {
    if (v > 0.80 &&
        (in_ellipse(u, v, 0.2, 0.88, 0.09, 0.12) || in_ellipse(u, v, 0.8, 0.88, 0.09, 0.12)))
      return Colour{30, 30, 32};
    if (v > 0.88) return std::nullopt;
    if (u > 0.93 && v < 0.4) return std::nullopt;
    if (u > 0.72 && u < 0.9 && v > 0.12 && v < 0.42) return Colour{60, 75, 90};
    if (v > 0.5 && v < 0.56) return shaded(paint_colour, 0.6);
    return shaded(paint_colour, 1.05 - 0.2 * v);
  };
  return rasterize(width, height, paint_colour, paint);
}

Sprite draw_lorry(int width, int height, const Colour& paint_colour) {
  const auto paint = [&](double u, double v) -> std::optional<Colour> {
    if (v > 0.9) return Colour{34, 34, 36};
    if (u > 0.86 && v > 0.15 && v < 0.5) return Colour{65, 80, 95};
    const bool seam = u * 5 - std::floor(u * 5) < 0.03;
    return shaded(paint_colour, seam ? 0.7 : 1.1 - 0.25 * v);
  };
  return rasterize(width, height, paint_colour, paint);
}

Sprite draw_boat(int width, int height, const Colour& paint_colour, std::span<const Colour> coats) {
  const auto paint = [&](double u, double v) -> std::optional<Colour> {
    // The hull narrows downwards.
    if (v > 0.6)
      return std::abs(u - 0.5) < 0.5 - 0.2 * (v - 0.6) ? std::optional(paint_colour) : std::nullopt;
    const double place = u * static_cast<double>(coats.size());
    const auto person = static_cast<size_t>(place);
    if (person >= coats.size()) return std::nullopt;
    // Shares of the height from the middle of the person.
    const double beside = (place - std::floor(place) - 0.5) / static_cast<double>(coats.size()) *
                          width / std::max(height, 1);
    if (in_ellipse(beside, v, 0, 0.12, 0.11, 0.12)) return Colour{190, 150, 125};
    if (v > 0.22 && std::abs(beside) < 0.18) return coats[person];
    return std::nullopt;
  };
  return rasterize(width, height, paint_colour, paint);
}

Sprite draw_bag(int height, const Colour& leather) {
  const auto paint = [&](double u, double v) -> std::optional<Colour> {
    const bool handle =
        in_ellipse(u, v, 0.5, 0.3, 0.28, 0.28) && !in_ellipse(u, v, 0.5, 0.3, 0.18, 0.2);
    if (v > 0.3) return shaded(leather, v > 0.55 && v < 0.62 ? 0.6 : 1.0);
    if (handle) return shaded(leather, 0.7);
    return std::nullopt;
  };
  return rasterize(static_cast<int>(std::lround(1.2 * height)), height, leather, paint);
}

Sprite draw_leaf(double length, double angle, const Colour& green) {
  constexpr double kWidth = 0.42;  // over the length
  const double cosine = std::cos(angle), sine = std::sin(angle);
  const auto paint = [&](double u, double v) -> std::optional<Colour> {
    // Along the leaf, -1 .. 1, and across it.
    const double along = 2 * ((u - 0.5) * cosine + (v - 0.5) * sine);
    const double across = 2 * ((v - 0.5) * cosine - (u - 0.5) * sine) / kWidth;
    if (std::abs(along) > 1 || std::abs(across) > 1 - along * along) return std::nullopt;
    const double rib = std::abs(across) < 0.08 ? 1.25 : 1;
    const double side_ribs = 1 + 0.12 * std::sin(14 * (along - 0.6 * std::abs(across)));
    return shaded(green, (1 + 0.25 * across + 0.15 * along) * rib * side_ribs);
  };
  const int side = std::max(1, static_cast<int>(std::lround(length)));
  return rasterize(side, side, green, paint);
}

Sprite mirrored(const Sprite& sprite) {
  Sprite result;
  result.picture = Picture(sprite.width(), sprite.height());
  Plane opaque(sprite.width(), sprite.height());
  for (int y = 0; y < sprite.height(); ++y)
    for (int x = 0; x < sprite.width(); ++x)
      std::copy_n(sprite.picture.at(x, y), 3, result.picture.at(sprite.width() - 1 - x, y));
  for (const auto& run : sprite.runs)
    for (int x = run.x; x < run.x + run.length; ++x) *opaque.at(sprite.width() - 1 - x, run.y) = 1;
  find_runs(&result, [&](int x, int y) { return *opaque.at(x, y) != 0; });
  return result;
}

Sprite repainted(const Sprite& sprite, const std::array<double, 3>& mean, double contrast) {
  Sprite result = sprite;
  result.mean = {};
  for (const auto& run : result.runs)
    for (int x = run.x; x < run.x + run.length; ++x)
      for (size_t c = 0; c < 3; ++c) {
        uint8_t* level = result.picture.at(x, run.y) + c;
        *level = to_level(mean[c] + contrast * (*level - sprite.mean[c]));
        result.mean[c] += *level;
      }
  for (auto& value : result.mean) value /= std::max(result.area, 1);
  return result;
}

}  // namespace qdmd::scene
