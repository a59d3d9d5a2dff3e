// SPDX-License-Identifier: LGPL-2.1-or-later
// How well boxes with numbers follow the true ones, and how well events are told.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "core/objects/object.h"

namespace qdmd::evaluation {

struct NumberedBox {
  int64_t id = 0;
  ObjectBox box;
};

// MOTA of CLEAR MOT (Bernardin and Stiefelhagen 2008) and IDF1 (Ristani et al. 2016), as the MOT
// challenge computes them: boxes that overlap by half or more may be pairs; a pair of the frame
// before is kept as long as it may be one.
class TrackingScores {
 public:
  void add_frame(const std::vector<NumberedBox>& truth, const std::vector<NumberedBox>& found);
  // Adds another stream's, whose numbers are its own.
  void add(TrackingScores other);

  double mota() const;
  double idf1() const;
  int64_t switches() const { return switches_; }
  int64_t missed() const { return missed_; }
  int64_t wrong() const { return wrong_; }
  int64_t true_boxes() const { return true_boxes_; }
  // Makes what idf1() needs of the frames so far. Before add() and idf1().
  void finish();

 private:
  int64_t true_boxes_ = 0, found_boxes_ = 0, missed_ = 0, wrong_ = 0, switches_ = 0, together_ = 0;
  std::map<int64_t, int64_t> before_;                     // whom each true one was a pair with last
  std::map<std::pair<int64_t, int64_t>, int64_t> pairs_;  // frames in which two may be a pair
};

struct TimedEvent {
  ObjectEvent::Kind kind;
  int64_t owner;  // of a true one
  int frame;
  ObjectBox box;
};

struct EventScores {
  int true_events = 0, in_time = 0, late = 0, missed = 0, wrong = 0;
  std::vector<int> delays;  // of those in time and late, frames
  void add(const EventScores& other);
};

// The true box of an owner in a frame; null: it has none there.
using TrueBox = std::function<const ObjectBox*(int64_t owner, int frame)>;

// An event is told in time from kEarly frames before its condition holds until kLate after it, with
// a box that overlaps the true one by half; until kMuchLate it is late. Each is counted once. What
// moves is somewhere else by then: the box is compared with the owner's in the frame that tells it.
// Of what is gone or was removed, and where the owner has none, with the true event's.
inline constexpr int kEarly = 10, kLate = 10, kMuchLate = 75;
// Those of one kind; last: of the frames. verbose: prints what is not as it should be.
EventScores score_events(const std::vector<TimedEvent>& truth, const std::vector<TimedEvent>& told,
                         const TrueBox& true_box, ObjectEvent::Kind kind, int last,
                         const char* verbose);

}  // namespace qdmd::evaluation
