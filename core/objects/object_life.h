// SPDX-License-Identifier: LGPL-2.1-or-later
// What becomes of one thing: it appears, stops, moves on and is gone, from its boxes alone.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "core/objects/object.h"

namespace qdmd {

// One thing whose box is told frame by frame. Sides and ways are in pixels of the picture. A box
// that grows on one side has not gone anywhere: its way is that of the side that moved less, but at
// the edge of the picture, where the thing comes in.
// | a thing      | once                                                                           |
// |--------------|--------------------------------------------------------------------------------|
// | appeared     | its longer side is min_size, it was seen for appear_seconds, in most frames,   |
// |              | and it went straight on by half its longer side or kWay of the height,         |
// |              | whichever is less; or it stood for kStandingShows of stop_seconds, alone       |
// | stands       | its middle stayed within kStill of its longer side for stop_seconds            |
// | was left     | it stands where it was first seen, and has been alone for stop_seconds         |
// | moved on     | it stood, and its middle is kMovedOn of its longer side away from there        |
// | gone         | no frame showed it for gone_seconds                                            |
class ObjectLife {
 public:
  static constexpr double kWay = 1.0 / 30, kStill = 0.06, kMovedOn = 0.25, kStandingShows = 0.5;

  ObjectLife(const ObjectOptions& options, int picture_width, int picture_height)
      : options_(&options), width_(picture_width), height_(picture_height) {}

  // How a frame shows it.
  struct Sight {
    ObjectBox box;     // its own
    ObjectBox region;  // the whole of what shows it
    // Nothing that moves is beside it. What stands where it was put down is seen for itself from
    // the first time on that it is alone.
    bool alone;
  };
  // A frame showed it, or did not. time: of the frame, later than that of the one before. frame:
  // nanoseconds that frames last.
  void follow(const Sight& sight, int64_t time, int64_t frame);
  void miss(int64_t time, int64_t frame);
  // Frames of so many nanoseconds said nothing.
  void wait(int64_t time) { last_ += time; }

  bool appeared() const { return appeared_; }
  // It stands, since then; or kNoTime.
  int64_t standing_since() const { return stands_ ? standing_since_ : kNoTime; }
  // It has come here by its own motion: it went further than half its size since it was first seen.
  bool came_by_itself() const { return came_; }
  // It stands where it was first seen, and has been for itself for stop_seconds.
  bool was_left() const { return was_left_; }
  bool moves() const { return !stands_; }
  bool gone() const { return gone_; }
  // The last box that was not small beside those before it: what goes out over the edge of the
  // picture is not cut off there.
  const ObjectBox& last_whole() const { return last_whole_; }

 private:
  struct Place {
    int64_t time;
    ObjectBox box;
  };
  double still() const;
  double way(const ObjectBox& from, const ObjectBox& to) const;
  // 0: the oldest.
  const Place& place(size_t at) const { return places_[(begin_ + at) % kPlaces]; }
  void add_place(int64_t time, int64_t stop);
  int64_t stays_since() const;
  void judge_standing(int64_t time, int64_t stop);

  const ObjectOptions* options_;
  int width_, height_;
  ObjectBox box_, last_whole_, before_;
  // Of the last stop_seconds, so many at most, the oldest first.
  static constexpr size_t kPlaces = 64;
  std::array<Place, kPlaces> places_;
  size_t begin_ = 0, count_ = 0;
  std::optional<Place> first_, stood_at_;  // first_: a region
  double longest_ = 0, way_ = 0;
  int64_t last_ = 0, standing_since_ = kNoTime, alone_since_ = kNoTime;
  int frames_ = 0, seen_ = 0;
  bool appeared_ = false, came_ = false, stands_ = false, gone_ = false, was_left_ = false;
};

}  // namespace qdmd
