// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/frame_follower.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/learn/robust/learning_steps.h"
#include "core/learn/robust/places.h"

namespace qdmd {
namespace {

using namespace steps::pace;

}  // namespace

void FrameFollower::begin() {
  const Grid& grid = context_.grid;
  const Models models = context_.room.models;
  background_cells_ = GridFrames(grid, 2);
  unclipped_ = GridFrames(grid, 1);
  light_ = LightOfFrames(grid.cells());
  // Frames that wait can wait for a proof.
  if (context_.follows(models)) {
    memory_ = SceneMemory(grid, models == Models::two_of_live);
    standing_.resize(grid.cells());
  }
  if (models != Models::two_of_live) looks_ = StandingLooks(grid);
  absorbed_ = HistoryStarts(grid.cells());
  scene_ = SceneWatch(grid);
}

uint64_t FrameFollower::bytes(const RobustContext& context, Models models) {
  const Grid& grid = context.grid;
  return GridFrames::bytes(grid, 3) + LightOfFrames::bytes(grid.cells()) +
         (context.follows(models) ? SceneMemory::bytes(grid) + grid.cells() : 0) +
         (models == Models::two_of_live ? 0 : StandingLooks::bytes(grid)) +
         HistoryStarts::bytes(grid.cells()) + SceneWatch::bytes(grid);
}

void FrameFollower::forget() {
  light_.forget();
  looks_.forget();
  memory_.forget();
  disturbances_.forget();
  absorbed_.forget();
  uncovered_.forget();
  scene_.forget();
  exposure_.forget();
  other_scene_ = scene_begins_ = colours_begin_ = false;
  other_coloured_ = 0;
  new_colours_.reset();
  left_colours_.reset();
  calm_ = 0;
}

void FrameFollower::publish(bool whole) {
  // Not while the solve runs: frames that come beside it mend what it would be compared with.
  calm_ = whole && is_calm() ? calm_ + 1 : 0;
  published_ = 1 - published_;
  light_.forget();
  if (!std::exchange(scene_begins_, false)) return;
  looks_.forget();
  if (context_.room.models != Models::two_of_live) forget_places();
  colours_begin_ = other_scene_ = false;
}

// What the newest solve found is what the one in use has.
bool FrameFollower::is_calm() const {
  double sum = 0;
  size_t moved = 0;
  for (size_t cell = 0; cell < context_.grid.cells(); ++cell) {
    float distance = 0;
    for (int c = 0; c < kChannels; ++c)
      distance +=
          std::abs(background_cells_.plane(0, c)[cell] - background_cells_.plane(1, c)[cell]);
    sum += static_cast<double>(distance);
    moved += distance > kCalmCell;
  }
  const auto cells = static_cast<double>(context_.grid.cells());
  return sum < kCalmMean * cells && static_cast<double>(moved) < kMostMoved * cells;
}

// The cells of a frame; where its light is another one, without what samples at the end of their
// range hide.
FrameFollower::Cells FrameFollower::unclipped_cells(int slot, const Gain& light,
                                                    const StandingLooks& looks) {
  const Cells shown(context_.room.frames->cells(), slot);
  if (!is_lit(light)) return shown;
  const Cells background = this->background();
  for (size_t cell = 0; cell < context_.grid.cells(); ++cell) {
    const auto shows = shown.at(cell), look = Cells(looks.levels(), 0).at(cell);
    // Both may be hidden: it is what it was.
    const bool goes_on = looks.frames(static_cast<int>(cell)) > 0 && may_show(shows, look, light);
    const auto found = unclipped(shows, goes_on ? look : background.at(cell), light);
    for (size_t c = 0; c < kChannels; ++c)
      unclipped_.plane(0, static_cast<int>(c))[cell] = found[c];
  }
  return {unclipped_, 0};
}

SceneSeen FrameFollower::scene_of(int slot) {
  if (other_scene_ && scene_begins_) return SceneSeen::same;
  const GridFrames& cells = context_.room.frames->cells();
  const Cells frame(cells, slot);
  const Cells background = this->background();
  if (other_scene_) {
    // It is no scene of its own yet.
    if (!scene_.is_back(frame)) return SceneSeen::same;
    other_scene_ = false;
    return SceneSeen::the_one_before;
  }
  if (colours_begin_) return SceneSeen::same;
  const SceneSeen seen = scene_.follow(frame, background);
  other_scene_ = seen != SceneSeen::same;
  if (!other_scene_) return colours_of(frame);
  scene_.leave();
  left_colours_.reset();
  return seen;
}

// The same contours: a camera switches to infra-red, or back.
SceneSeen FrameFollower::colours_of(const Cells& frame) {
  const size_t cells = context_.grid.cells();
  const Cells background = this->background();
  if (context_.options.colours == Colours::grey) return SceneSeen::same;
  const Colouring now = colouring_of(frame, background, cells),
                  known = colouring_of(background, frame, cells);
  const bool other = scene_.shows_background() && now != known && now != Colouring::little &&
                     known != Colouring::little;
  other_coloured_ = other ? other_coloured_ + 1 : 0;
  if (other_coloured_ < steps::colour::kFrames) return SceneSeen::same;
  const bool returns = left_colours_ == now;
  // Somebody in colours may come before a grey wall.
  if (!returns && now != Colouring::none) return SceneSeen::same;
  new_colours_.reset();
  if (now == Colouring::none)
    new_colours_ = find_colour_map(frame, background, cells, context_.rgb);
  if (!returns && !new_colours_) return SceneSeen::same;
  other_coloured_ = 0;
  colours_begin_ = true;
  memory_.find_standing(&standing_);
  left_colours_ = known;
  return returns ? SceneSeen::earlier_colours : SceneSeen::other_colours;
}

void FrameFollower::begin_scene() {
  absorbed_.forget();
  disturbances_.forget();
  calm_ = 0;
  scene_begins_ = true;
  // Where frames wait, they show the scene before until publish().
  if (context_.room.models == Models::two_of_live) forget_places();
}

void FrameFollower::forget_places() {
  if (colours_begin_)
    memory_.begin_colours(standing_);
  else
    memory_.forget();
}

void FrameFollower::write(std::vector<LearntPlace>* places) const {
  places->resize(context_.grid.cells());
  for (size_t cell = 0; cell < places->size(); ++cell) {
    memory_.write(cell, newest_number(), &(*places)[cell]);
    absorbed_.write(cell, newest_number(), &(*places)[cell]);
  }
}

void FrameFollower::read(const LearntEarlier& from) {
  memory_.grow_up();
  if (from.places.empty()) return;
  const int64_t now = newest_number();
  each_with_its(context_.grid, from.rows, from.cols, [&](size_t cell, size_t its) {
    // What stands there now came since.
    if (colours_begin_ && !standing_.empty() && standing_[cell]) return;
    const LearntPlace& place = from.places[its];
    if (context_.room.models != Models::two_of_live) looks_.read(cell, now, place);
    if (memory_.read(cell, now, place)) absorbed_.read(cell, now, place);
  });
}

void FrameFollower::follow(const std::vector<uint8_t> level[kChannels]) {
  const uint8_t* const planes[kChannels] = {level[0].data(), level[1].data(), level[2].data()};
  context_.find_cells(planes, &background_cells_, published_);
  light_.forget();
}

}  // namespace qdmd
