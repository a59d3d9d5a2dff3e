// SPDX-License-Identifier: LGPL-2.1-or-later
// What was taken away from the background, gathered from the places that were uncovered.
#pragma once

#include <functional>
#include <vector>

#include "core/objects/object.h"

namespace qdmd {

// A place where frames show that something has left which belonged to the background.
struct RemovedPlace {
  ObjectBox box;
  double stood_seconds = 0;  // it had been there for so long
};

// Places are found piece by piece. What is uncovered next to another piece, not long after it, is
// of the same thing; it is told once it has not grown for kSettles seconds. Pieces that are found
// there within kLatePieces seconds more say nothing new. Regions there are
// rests of it, until kRests seconds after it grew last.
class Removals {
 public:
  static constexpr double kSettles = 0.7, kLatePieces = 10, kFills = 0.3, kRests = 2;

  void forget() { of_.clear(); }
  void add(const RemovedPlace& place, int64_t time, double reach);
  // Half of a box is where something is being uncovered: it is a rest of that.
  bool covers(const ObjectBox& box, int64_t time) const;
  // The next that is complete at that time, and whose place is free: its box. False: there is none.
  bool take(int64_t time, const std::function<bool(const ObjectBox&)>& is_free, ObjectBox* box);

 private:
  struct Removal {
    ObjectBox box;
    double area;     // of the pieces
    int64_t newest;  // when it grew last
    bool told = false;
  };
  std::vector<Removal> of_;
};

}  // namespace qdmd
