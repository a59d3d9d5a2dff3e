// What becomes of one thing: it appears, stops, moves on and is gone, from its boxes alone.
#pragma once

#include <deque>
#include <optional>

#include "core/objects/object.h"

namespace qdmd {

// One thing whose box is told frame by frame. Sides and ways are in pixels of the picture.
// | a thing      | once                                                                           |
// |--------------|--------------------------------------------------------------------------------|
// | appeared     | its longer side is min_size, it was seen for appear_seconds, in most frames,   |
// |              | and it went straight on by half its longer side or kWay of the height,         |
// |              | whichever is less; or it stood for kStandingShows of stop_seconds              |
// | stands       | its middle stayed within kStill of its longer side for stop_seconds            |
// | moved on     | it stood, and its middle is kMovedOn of its longer side away from there        |
// | gone         | no frame showed it for gone_seconds                                            |
class ObjectLife {
 public:
  static constexpr double kWay = 1.0 / 30, kStill = 0.06, kMovedOn = 0.25, kStandingShows = 0.5;

  ObjectLife(const ObjectOptions& options, int picture_height)
      : options_(&options), height_(picture_height) {}

  // A frame showed it, or did not (null). time: of the frame, later than that of the one before.
  // frame: nanoseconds that frames last.
  void follow(const ObjectBox* box, int64_t time, int64_t frame);

  // Frames of so many nanoseconds said nothing.
  void wait(int64_t time) { last_ += time; }

  bool appeared() const { return appeared_; }
  // It stands, since then; or kNoTime.
  int64_t standing_since() const { return stands_ ? standing_since_ : kNoTime; }
  // It has come here by its own motion: it went further than its own size's half since it was first
  // seen.
  bool came_by_itself() const { return came_; }
  // It has moved since it stood last, or stood never.
  bool moves() const { return !stands_; }
  bool gone() const { return gone_; }
  // Pixels a second, a mean of the last third of a second.
  double speed() const { return speed_; }

 private:
  struct Place {
    int64_t time;
    double x, y;
  };
  double still() const;
  void judge_standing(int64_t time, int64_t stop);

  const ObjectOptions* options_;
  int height_;
  ObjectBox box_;
  std::deque<Place> places_;  // of the last stop_seconds
  std::optional<Place> first_, stood_at_;
  Place before_ = {};
  double longest_ = 0, way_ = 0, speed_ = 0;
  int64_t last_ = 0, standing_since_ = kNoTime;
  int frames_ = 0, seen_ = 0;
  bool appeared_ = false, came_ = false, stands_ = false, gone_ = false;
};

}  // namespace qdmd
