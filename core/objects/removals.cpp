#include "core/objects/removals.h"

#include <cstddef>

namespace qdmd {

void Removals::add(const RemovedPlace& place, int64_t time, double reach) {
  for (Removal& removal : of_) {
    if (shared(removal.box.wider(reach), place.box) == 0) continue;
    removal = {both(removal.box, place.box), time};
    return;
  }
  of_.push_back({place.box, time});
}

bool Removals::take(int64_t time, ObjectBox* box) {
  for (size_t i = 0; i < of_.size(); ++i) {
    if (static_cast<double>(time - of_[i].newest) < kSettles * kSecond) continue;
    *box = of_[i].box;
    of_.erase(of_.begin() + static_cast<std::ptrdiff_t>(i));
    return true;
  }
  return false;
}

}  // namespace qdmd
