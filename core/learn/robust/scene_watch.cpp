// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/scene_watch.h"

#include <algorithm>
#include <cmath>

#include "core/learn/robust/learning_steps.h"

namespace qdmd {
namespace {

using namespace steps::scene;

// What two lists of edges have in common.
struct Products {
  double aa = 0, bb = 0, ab = 0;
  size_t count = 0;

  // Four at a time have sums of their own: none waits for the one before.
  void add(const float* a, const float* b, size_t more) {
    constexpr size_t kLanes = 4;
    double lanes[3][kLanes] = {};
    const auto add_one = [&](size_t i, size_t lane) {
      lanes[0][lane] += static_cast<double>(a[i] * a[i]);
      lanes[1][lane] += static_cast<double>(b[i] * b[i]);
      lanes[2][lane] += static_cast<double>(a[i] * b[i]);
    };
    size_t i = 0;
    for (; i + kLanes <= more; i += kLanes)
      for (size_t lane = 0; lane < kLanes; ++lane) add_one(i + lane, lane);
    for (; i < more; ++i) add_one(i, 0);
    const auto sum = [](const double* of) { return of[0] + of[1] + of[2] + of[3]; };
    aa += sum(lanes[0]);
    bb += sum(lanes[1]);
    ab += sum(lanes[2]);
    count += more;
  }
  bool flat(double energy) const { return energy < kFlat * kFlat * static_cast<double>(count); }
  bool below(double correlation) const { return ab < correlation * std::sqrt(aa * bb); }
};

}  // namespace

SceneWatch::SceneWatch(const Grid& grid)
    : grid_(grid),
      rows_(static_cast<size_t>(grid.rows) / 2),
      cols_(static_cast<size_t>(grid.cols) / 2),
      blocks_(rows_ * cols_) {
  background_.resize(2 * kChannels * blocks_.size());
  left_.resize(background_.size());
  for (auto& edges : frames_) edges.resize(background_.size());
}

uint64_t SceneWatch::bytes(const Grid& grid) {
  const auto half = [](int length) { return static_cast<uint64_t>(length) / 2; };
  return half(grid.rows) * half(grid.cols) * (1 + (2 + kFrames) * 2 * kChannels) * sizeof(float);
}

void SceneWatch::find_edges(const float* const planes[3], std::vector<float>* edges) {
  const auto stride = static_cast<size_t>(grid_.cols);
  float* edge = edges->data();
  for (size_t c = 0; c < kChannels; ++c) {
    float* block = blocks_.data();
    for (size_t row = 0; row < rows_; ++row, block += cols_) {
      const float *const above = planes[c] + 2 * row * stride, *const below = above + stride;
      for (size_t col = 0; col < cols_; ++col)
        block[col] =
            (above[2 * col] + above[2 * col + 1] + below[2 * col] + below[2 * col + 1]) / 4;
    }
    for (size_t row = 0; row < rows_; ++row, edge += 2 * cols_) {
      const float* const here = blocks_.data() + row * cols_;
      // There is no edge at the border.
      const float* const below = row + 1 < rows_ ? here + cols_ : here;
      for (size_t col = 0; col + 1 < cols_; ++col) {
        edge[2 * col] = here[col + 1] - here[col];
        edge[2 * col + 1] = below[col] - here[col];
      }
      edge[2 * cols_ - 2] = 0;
      edge[2 * cols_ - 1] = below[cols_ - 1] - here[cols_ - 1];
    }
  }
}

SceneWatch::Look SceneWatch::look_of(const std::vector<float>& frame,
                                     const std::vector<float>& background) const {
  Products tiles[kTilesAlong * kTilesAlong];
  // Where column `tile` of tiles begins.
  const auto begin = [this](size_t tile) { return (tile * cols_ + kTilesAlong - 1) / kTilesAlong; };
  size_t i = 0;
  for (size_t c = 0; c < kChannels; ++c)
    for (size_t row = 0; row < rows_; ++row) {
      Products* tile = tiles + row * kTilesAlong / rows_ * kTilesAlong;
      for (size_t at = 0; at < kTilesAlong; ++at, ++tile) {
        const size_t edges = 2 * (begin(at + 1) - begin(at));
        tile->add(frame.data() + i, background.data() + i, edges);
        i += edges;
      }
    }
  size_t edged = 0, of_background = 0, strange = 0;
  for (const Products& tile : tiles) {
    const bool frame_flat = tile.flat(tile.aa), background_flat = tile.flat(tile.bb);
    if (frame_flat && background_flat) continue;
    ++edged;
    of_background += background_flat ? 0 : 1;
    strange += frame_flat != background_flat || tile.below(kStrangeTile);
  }
  // Somebody who stands before a bare wall brings edges to many tiles.
  constexpr size_t kAll = kTilesAlong * kTilesAlong;
  if (static_cast<double>(strange) < kStrangeShare * static_cast<double>(edged)) return Look::same;
  return 2 * of_background >= kAll || 8 * edged >= 7 * kAll ? Look::strange : Look::doubtful;
}

bool SceneWatch::alike(const std::vector<float>& a, const std::vector<float>& b) const {
  Products all;
  all.add(a.data(), b.data(), a.size());
  return (all.flat(all.aa) && all.flat(all.bb)) || !all.below(kAlike);
}

void SceneWatch::leave() {
  left_ = background_;
  left_known_ = true;
  strange_ = returned_ = 0;
}

bool SceneWatch::is_back(const float* const frame[3]) {
  std::vector<float>& newest = frames_[next_];
  next_ = (next_ + 1) % kFrames;
  find_edges(frame, &newest);
  returned_ = look_of(newest, left_) == Look::same ? returned_ + 1 : 0;
  return returned_ >= steps::scene::kReturn;
}

SceneSeen SceneWatch::follow(const float* const frame[3], const float* const background[3]) {
  shows_background_ = false;
  if (std::min(rows_, cols_) < 2 * kTilesAlong) return SceneSeen::same;
  find_edges(background, &background_);
  std::vector<float>& newest = frames_[next_];
  next_ = (next_ + 1) % kFrames;
  find_edges(frame, &newest);
  const Look look = look_of(newest, background_);
  shows_background_ = look == Look::same;
  strange_ = look == Look::strange ? strange_ + 1 : 0;
  const bool returned = look != Look::same && left_known_ && look_of(newest, left_) == Look::same;
  returned_ = returned ? returned_ + 1 : 0;
  if (returned_ == steps::scene::kReturn) return SceneSeen::the_one_before;
  return strange_ >= kFrames && alike(newest, frames_[next_]) ? SceneSeen::another
                                                              : SceneSeen::same;
}

}  // namespace qdmd
