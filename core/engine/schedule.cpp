// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/engine/schedule.h"

#include <utility>

namespace qdmd {
namespace {

// Frames between backgrounds that frames are compared with: they hardly change.
constexpr int64_t kReferenceFrames = 50;

}  // namespace

bool Schedule::take(const ImageView& frame) {
  if (background().known()) workers().rouse();
  if (!frames().append(frame, idle_pool())) return false;
  Stabilizer* const stabilizer = stage_.stabilizer;
  if (!stabilizer || no_room_) return true;
  const IgnoredAreas& ignored = background().wishes().ignored;
  if (background().known() && wants_reference(*stabilizer)) {
    referred_to_ = background().solves();
    show_newest();
    stage_.restorer->write_canvas(background().model(), frames().window().pixels(), idle_pool());
    stabilizer->refer_to(stage_.restorer->canvas(stabilizer->channel()), ignored);
  }
  const PlaneSlots& planes = frames().window();
  const int slot = frames().window().newest_slot(), channel = stabilizer->channel();
  const Pose pose = stabilizer->follow(planes.plane(slot, channel), ignored);
  if (!pose.is_rest()) {
    if (frames().shares_samples()) wait();
    steady(frames().size() - 1, pose, idle_pool());
  }
  if (!stabilizer->canvas_moved().is_rest()) move_canvas(stabilizer->canvas_moved());
  return true;
}

// A frame that brings a new background costs enough: the one after it takes the reference, even if
// it brings another one.
bool Schedule::wants_reference(const Stabilizer& stabilizer) {
  const uint64_t solves = background().solves();
  const bool is_new = std::exchange(solves_before_, solves) != solves,
             was_new = std::exchange(was_new_, is_new);
  if (solves == referred_to_) return false;
  const bool is_time = stabilizer.frames_since_reference() >= kReferenceFrames;
  return referred_to_ == 0 || (is_time && (!is_new || was_new));
}

// Frames before the newest, where they are still looked at and nothing was made of them yet.
void Schedule::move_canvas(const Pose& to) {
  if (!holds_frames() || !background().learner().in_one_piece() || no_room_) return;
  wait();
  for (int i = 0; i + 1 < frames().size() && !no_room_; ++i) {
    const Pose pose = compose(inverse(to), frames().pose(frames().slot(i)));
    steady(i, pose, &workers().pool());
  }
}

void Schedule::steady(int index, const Pose& pose, Pool* pool) {
  no_room_ = !frames().steady(index, pose, &stage_.stabilizer->resampler(), pool,
                              background().learner().bytes_to_unshare());
}

}  // namespace qdmd
