// SPDX-License-Identifier: LGPL-2.1-or-later
// A floor, what comes and goes before it, and a memory of that, whose contours each test says. The
// constants are those of scene_memory.cpp.
#pragma once

#include <array>
#include <functional>

#include "core/learn/robust/scene_memory.h"
#include "tests/core/robust_util.h"

namespace qdmd::test {

inline constexpr int kRows = 24, kCols = 32;
inline constexpr float kFloor = 100, kBag = 40;
inline constexpr int kSteady = StandingLooks::kSteady;
// A region that nothing proves came after so many frames; disturbances and other scenes last.
inline constexpr int kCame = 60, kLasts = 75;

struct Rect {
  int top, left, rows, cols;
  bool has(int row, int col) const {
    return row >= top && row < top + rows && col >= left && col < left + cols;
  }
  // So many cells wider on all sides.
  Rect wider(int by) const { return {top - by, left - by, rows + 2 * by, cols + 2 * by}; }
};
inline constexpr Rect kPlace = {8, 10, 8, 8};

// (strong - weak) / (strong + weak + 1) of the background's contour and the look's.
inline RegionContours contours(float background, float look, size_t pairs = 50, size_t open = 0) {
  return {look, background, pairs, open};
}
inline constexpr float kHardly = 33, kWeak = 27, kStrong = 30, kLess = 20, kMuchLess = 10;
inline RegionContours hardly_stronger() { return contours(kHardly, kWeak); }    // 0.10
inline RegionContours stronger() { return contours(kStrong, kLess); }           // 0.20
inline RegionContours much_stronger() { return contours(kStrong, kMuchLess); }  // 0.49
inline RegionContours clear() { return contours(60, 4); }                       // 0.86
inline RegionContours weaker() { return contours(kMuchLess, kStrong); }

// A floor, and what lies before it; the memory sees all of it.
class Stage {
 public:
  explicit Stage(bool live = false) : memory(grid, live) {
    for (std::vector<float>* planes : {&background, &shown})
      planes->assign(kChannels * grid.cells(), kFloor);
    // Enough frames have shown the floor.
    if (!live) memory.grow_up();
  }

  // What is seen, or known, at a place from now on.
  void show(const Rect& place, float level) { paint(place, level, &shown); }
  void know(const Rect& place, float level) { paint(place, level, &background); }
  // What is seen there is known from now on.
  void know_what_is_seen() { background = shown; }
  // Things pass there in frames to come: no two frames are alike.
  void passes(std::function<bool(int row, int col)> where) { passes_ = std::move(where); }
  void nothing_passes() { passes_ = nullptr; }

  // The next frames. Returns the cells that were found in the last of them.
  std::vector<int> frames(int count) {
    std::vector<int> found;
    for (int i = 0; i < count; ++i) {
      std::vector<float> frame = shown;
      ++number;
      for (size_t at = 0; at < frame.size(); ++at) {
        const int cell = static_cast<int>(at % grid.cells());
        if (passes_ && passes_(cell / kCols, cell % kCols))
          frame[at] = number % 2 ? 180.0f : 220.0f;
      }
      const auto of = [&](std::vector<float>& planes) {
        return std::array<const float*, 3>{planes.data(), planes.data() + grid.cells(),
                                           planes.data() + 2 * grid.cells()};
      };
      memory.follow(of(frame).data(), kSameLight, number);
      found = memory.judge(of(background).data(), [&](const std::vector<int>& region) {
        ++asked;
        return contour(region);
      });
    }
    return found;
  }
  // Frames until something is found; most + 1: nothing is.
  int frames_until_found(int most) {
    for (int i = 1; i <= most; ++i)
      if (!frames(1).empty()) return i;
    return most + 1;
  }
  // A place whose background is a bag and that shows the floor from the next frame on.
  void bag_leaves(const Rect& place = kPlace) {
    know(place, kBag);
    show(place, kBag);
    frames(50);
    show(place, kFloor);
  }
  // A place whose background is the floor and that shows a bag from the next frame on.
  void bag_comes(const Rect& place = kPlace) {
    frames(50);
    show(place, kBag);
  }
  Proofs proofs() {
    Proofs solve(grid.cells());
    memory.hand_over(&solve);
    return solve;
  }
  int cell(int row, int col) const { return row * kCols + col; }

  Grid grid = grid_of(kRows, kCols);
  SceneMemory memory;
  std::vector<float> background, shown;
  int64_t number = 1000;
  std::function<RegionContours(const std::vector<int>& region)> contour = [](const auto&) {
    return weaker();
  };
  int asked = 0;  // for contours
  void say(const RegionContours& of_all) {
    contour = [of_all](const auto&) { return of_all; };
  }

 private:
  void paint(const Rect& place, float level, std::vector<float>* planes) {
    for (size_t at = 0; at < planes->size(); ++at) {
      const int cell = static_cast<int>(at % grid.cells());
      if (place.has(cell / kCols, cell % kCols)) (*planes)[at] = level;
    }
  }
  std::function<bool(int row, int col)> passes_;
};

// Which cells are in a list, as a picture.
inline std::vector<uint8_t> marked(const std::vector<int>& cells) {
  std::vector<uint8_t> marks(size_t{kRows} * kCols);
  for (int cell : cells) marks[static_cast<size_t>(cell)] = 1;
  return marks;
}
inline bool has_all(const std::vector<int>& cells, const Rect& place) {
  const auto marks = marked(cells);
  for (int row = 0; row < kRows; ++row)
    for (int col = 0; col < kCols; ++col)
      if (place.has(row, col) && !marks[static_cast<size_t>(row * kCols + col)]) return false;
  return true;
}
// Nothing is in the list that is not in the place.
inline bool only(const std::vector<int>& cells, const Rect& place) {
  return std::all_of(cells.begin(), cells.end(),
                     [&](int cell) { return place.has(cell / kCols, cell % kCols); });
}

// Just beside a place, where it must be settled; and further away, where motion is looked for.
inline auto beside(const Rect& place) {
  return [place](int row, int col) { return place.wider(1).has(row, col) && !place.has(row, col); };
}
inline auto around(const Rect& place) {
  return [place](int row, int col) {
    return place.wider(5).has(row, col) && !place.wider(2).has(row, col);
  };
}

}  // namespace qdmd::test
