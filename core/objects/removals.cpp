// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/objects/removals.h"

namespace qdmd {
namespace {

// What grows by less does not grow.
constexpr double kGrown = 1.05;

}  // namespace

void Removals::add(const RemovedPlace& place, int64_t time, double reach) {
  for (Removal& removal : of_) {
    const ObjectBox room = removal.told ? removal.box : removal.box.wider(reach);
    if (shared(room, place.box) == 0) continue;
    if (removal.told) return;
    const ObjectBox all = both(removal.box, place.box);
    if (all.area() > kGrown * removal.box.area()) removal.newest = time;
    removal.box = all;
    removal.area += place.box.area();
    return;
  }
  of_.push_back({place.box, place.box.area(), time});
}

bool Removals::covers(const ObjectBox& box, int64_t time) const {
  return std::any_of(of_.begin(), of_.end(), [&](const Removal& removal) {
    return static_cast<double>(time - removal.newest) < kRests * kSecond &&
           2 * shared(removal.box.wider(removal.box.longer() / 4), box) > box.area();
  });
}

bool Removals::take(int64_t time, const std::function<bool(const ObjectBox&)>& is_free,
                    ObjectBox* box) {
  std::erase_if(of_, [&](const Removal& removal) {
    return static_cast<double>(time - removal.newest) > kLatePieces * kSecond;
  });
  for (Removal& removal : of_) {
    if (removal.told || static_cast<double>(time - removal.newest) < kSettles * kSecond) continue;
    if (!is_free(removal.box)) continue;
    removal.told = true;
    if (removal.area < kFills * removal.box.area()) continue;
    *box = removal.box;
    return true;
  }
  return false;
}

}  // namespace qdmd
