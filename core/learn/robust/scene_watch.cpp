#include "core/learn/robust/scene_watch.h"

#include <algorithm>
#include <cmath>

namespace qdmd {
namespace {

// Below this, a frame does not look like the background; above kSame, it looks like the one that
// came kFrames - 1 before it. Of eight recorded clips and the simulated scenes, leaves over most of
// the picture come down to 0.14 for as many frames, and then do not look like each other (0.2); any
// two of the clips are alike by less than 0.1 (docs/robust.md).
constexpr double kOther = 0.25, kSame = 0.5;
// Edges of fewer levels, root of the mean square, are none: noise of blocks is far below.
constexpr double kFlat = 2;
// Fewer blocks along a side say nothing.
constexpr size_t kFewest = 4;

}  // namespace

SceneWatch::SceneWatch(const Grid& grid)
    : grid_(grid),
      rows_(static_cast<size_t>(grid.rows) / 2),
      cols_(static_cast<size_t>(grid.cols) / 2),
      blocks_(rows_ * cols_) {
  for (Edges* edges : {&background_, &frames_[0], &frames_[1], &frames_[2], &frames_[3],
                       &frames_[4], &frames_[5], &frames_[6], &frames_[7]})
    edges->steps.resize(2 * kChannels * rows_ * cols_);
}

uint64_t SceneWatch::bytes(const Grid& grid) {
  const uint64_t blocks =
      (static_cast<uint64_t>(grid.rows) / 2) * (static_cast<uint64_t>(grid.cols) / 2);
  return blocks * (1 + (1 + kFrames) * 2 * kChannels) * sizeof(float);
}

void SceneWatch::find(const float* const planes[3], Edges* edges) {
  const auto stride = static_cast<size_t>(grid_.cols);
  float* step = edges->steps.data();
  edges->energy = 0;
  const auto note = [&](float difference) {
    *step++ = difference;
    edges->energy += static_cast<double>(difference * difference);
  };
  for (size_t c = 0; c < kChannels; ++c) {
    for (size_t row = 0; row < rows_; ++row)
      for (size_t col = 0; col < cols_; ++col) {
        const float* cell = planes[c] + 2 * row * stride + 2 * col;
        blocks_[row * cols_ + col] = (cell[0] + cell[1] + cell[stride] + cell[stride + 1]) / 4;
      }
    for (size_t row = 0; row < rows_; ++row)
      for (size_t col = 0; col < cols_; ++col) {
        const size_t at = row * cols_ + col;
        if (col + 1 < cols_) note(blocks_[at + 1] - blocks_[at]);
        if (row + 1 < rows_) note(blocks_[at + cols_] - blocks_[at]);
      }
  }
}

double SceneWatch::alike(const Edges& a, const Edges& b) const {
  double sum = 0;
  for (size_t i = 0; i < a.steps.size(); ++i) sum += static_cast<double>(a.steps[i] * b.steps[i]);
  return sum / std::sqrt(std::max(a.energy * b.energy, 1e-9));
}

bool SceneWatch::strange(const Edges& frame) {
  const auto flat = [&](const Edges& edges) {
    return edges.energy < kFlat * kFlat * static_cast<double>(edges.steps.size());
  };
  // Two flat pictures are one scene; a flat one, and one with edges, are not.
  if (flat(frame) || flat(background_)) return flat(frame) != flat(background_);
  return alike(frame, background_) < kOther;
}

bool SceneWatch::follow(const float* const frame[3], const float* const background[3]) {
  if (std::min(rows_, cols_) < kFewest) return false;
  find(background, &background_);
  Edges& newest = frames_[next_];
  next_ = (next_ + 1) % kFrames;
  find(frame, &newest);
  strange_ = strange(newest) ? strange_ + 1 : 0;
  if (strange_ < kFrames) return false;
  const Edges& first = frames_[next_];
  const bool both_flat =
      newest.energy + first.energy < kFlat * kFlat * static_cast<double>(newest.steps.size());
  return both_flat || alike(newest, first) > kSame;
}

}  // namespace qdmd
