// SPDX-License-Identifier: LGPL-2.1-or-later
// Pictures of floors, and what decides about them.
#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "core/foreground/decision.h"
#include "core/parallel/pool.h"

namespace qdmd::test {

// Planes R, G and B of a picture.
struct Floor {
  int width, height;
  std::vector<uint8_t> level[3];

  Floor(int w, int h) : width(w), height(h) {
    for (auto& plane : level) plane.resize(static_cast<size_t>(w) * static_cast<size_t>(h));
  }
  size_t pixels() const { return level[0].size(); }
  size_t index(int x, int y) const { return static_cast<size_t>(y * width + x); }
  // Planes one after the other, as PackedPicture::fill() has them.
  std::vector<uint8_t> planes() const {
    std::vector<uint8_t> all;
    for (const auto& plane : level) all.insert(all.end(), plane.begin(), plane.end());
    return all;
  }
  void paint(const Rectangle& area, const std::array<int, 3>& colour) {
    for (int y = std::max(0, area.y); y < std::min(height, area.y + area.height); ++y)
      for (int x = std::max(0, area.x); x < std::min(width, area.x + area.width); ++x)
        for (size_t c = 0; c < 3; ++c) level[c][index(x, y)] = static_cast<uint8_t>(colour[c]);
  }
};

// A floor with a grain.
inline Floor grainy_floor(int width, int height, std::mt19937& rng) {
  Floor floor(width, height);
  for (size_t p = 0; p < floor.pixels(); ++p) {
    const int grain = static_cast<int>(rng() % 41) - 20;
    for (size_t c = 0; c < 3; ++c)
      floor.level[c][p] = static_cast<uint8_t>(150 - 25 * static_cast<int>(c) + grain);
  }
  return floor;
}

// The floor with a sensor's noise.
inline Floor with_noise(Floor floor, double sigma, std::mt19937& rng) {
  std::normal_distribution<double> noise(0, sigma);
  for (auto& plane : floor.level)
    for (uint8_t& sample : plane)
      sample = static_cast<uint8_t>(std::lround(std::clamp(sample + noise(rng), 0.0, 255.0)));
  return floor;
}

// Decides about frames before one background, which stays.
class Watcher {
 public:
  // What pixels must exceed, and, in much noise, each of them by itself.
  double threshold = 18;
  std::vector<uint8_t> limits = {};

  explicit Watcher(const Floor& background)
      : decision_(background.width, background.height, Colours::rgb) {
    model_.make_room(background.pixels(), false);
    model_.freeze_as({8, {background.level[0], background.level[1], background.level[2]}, {}},
                     nullptr, background.pixels());
    model_.set_time(0);
  }
  std::vector<uint8_t> mask_of(const Floor& frame, const IgnoredAreas* ignored = nullptr,
                               Pool* pool = nullptr) {
    Comparison all = {{frame.level[0].data(), frame.level[1].data(), frame.level[2].data()},
                      &model_,
                      threshold,
                      limits.empty() ? nullptr : limits.data()};
    all.ignored = ignored;
    decision_.decide(all, pool);
    return {decision_.mask(), decision_.mask() + frame.pixels()};
  }
  Decision& decision() { return decision_; }

 private:
  BackgroundModel model_;
  Decision decision_;
};

}  // namespace qdmd::test
