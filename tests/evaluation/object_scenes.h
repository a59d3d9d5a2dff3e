// SPDX-License-Identifier: LGPL-2.1-or-later
// What the masks of simulated scenes show, and what is true of them.
#pragma once

#include <chrono>
#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

#include "core/foreground/regions.h"
#include "core/objects/object_tracker.h"
#include "tests/evaluation/object_scores.h"

namespace qdmd::evaluation {

struct ObservedFrame {
  std::vector<Region> regions;  // of the element's mask, apart
  std::vector<RemovedPlace> removed;
  std::vector<NumberedBox> truth;
};

struct ObservedScene {
  std::string scene;
  uint64_t seed = 0;
  int width = 0, height = 0;
  double rate = 25;
  std::vector<ObservedFrame> frames;
  double mask_seconds = 0, region_seconds = 0;  // that all frames took
};

inline double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// Whose masks: the element's in a mode, or the true ones, which say what the tracker does alone.
enum class MasksOf { live, batch, truth };

// Runs the engine over a scene of 320x240 pixels.
ObservedScene observe(const std::string& scene, uint64_t seed, int frames, MasksOf masks);

// To a file and back, so that trackers can be compared without masks being made anew.
void write(const ObservedScene& scene, std::ostream* out);
bool read(std::istream* in, ObservedScene* scene);

}  // namespace qdmd::evaluation
