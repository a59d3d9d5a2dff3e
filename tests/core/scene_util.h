// SPDX-License-Identifier: LGPL-2.1-or-later
// Frames of scenes as values that tests compare.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace qdmd::test {

inline constexpr unsigned kEverything =
    scene::kFrame | scene::kTruth | scene::kLabels | scene::kBoxes;

// What a scene says about one frame, as far as it was asked.
struct Shot {
  std::vector<uint8_t> frame, background, labels;
  std::vector<scene::Box> boxes;
  std::array<double, 3> gain{};
  std::vector<double> rows;
  double shift_x = 0, shift_y = 0;

  bool operator==(const Shot&) const = default;
};

inline Shot shoot(scene::Scene* scene, int64_t index, unsigned wanted = kEverything) {
  scene->render(index, wanted);
  Shot shot;
  if (wanted & scene::kFrame) shot.frame = scene->frame().samples;
  if (wanted & scene::kTruth) shot.background = scene->background().samples;
  if (wanted & scene::kLabels) shot.labels = scene->labels().samples;
  if (wanted & scene::kBoxes) shot.boxes = scene->boxes();
  shot.gain = scene->light().gain;
  shot.rows = scene->light().rows;
  shot.shift_x = scene->shift_x();
  shot.shift_y = scene->shift_y();
  return shot;
}

inline scene::SceneOptions options(int width, int height, double rate = 25, uint64_t seed = 7) {
  scene::SceneOptions result;
  result.width = width;
  result.height = height;
  result.frames_per_second = rate;
  result.seed = seed;
  return result;
}

inline std::vector<std::string> effect_names() {
  std::vector<std::string> names;
  for (const auto* info : scene::effects()) names.emplace_back(info->name);
  return names;
}

// Every preset and every effect alone.
inline std::vector<std::string> scene_names() {
  std::vector<std::string> names = effect_names();
  for (const auto& preset : scene::presets()) names.emplace_back(preset.name);
  return names;
}

inline double mean(const std::vector<uint8_t>& samples) {
  double sum = 0;
  for (const uint8_t sample : samples) sum += sample;
  return sum / static_cast<double>(samples.size());
}

}  // namespace qdmd::test
