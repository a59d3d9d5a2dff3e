// SPDX-License-Identifier: LGPL-2.1-or-later
// Places where frames showed that something has left which belonged to the background.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace qdmd {

struct UncoveredPlace {
  int x = 0, y = 0, width = 0, height = 0;  // pixels
  int64_t since =
      0;  // the frame (FrameStore::frames_taken()) from which on it shows what is behind
  int64_t stood = 0;  // frames for which it had shown what has left; 0: nobody knows
  // When it was noticed, counted likewise.
  int64_t noticed = 0;
};

// The newest of them, each until somebody has taken it. Takes no memory of its own.
class UncoveredPlaces {
 public:
  static constexpr size_t kMost = 64;

  void forget() { size_ = 0; }
  // One that is inside of another whose look came within `at_once` frames of its own is not added.
  // The oldest makes room for a new one.
  void add(const UncoveredPlace& place, int64_t at_once) {
    for (size_t i = 0; i < size_; ++i)
      if (std::abs(places_[i].place.since - place.since) <= at_once &&
          is_in(place, places_[i].place))
        return;
    if (size_ == kMost) erase(0);
    places_[size_++] = {place, false};
  }
  // The next that nobody took and whose look came with frame `number` or before. False: there is
  // none.
  bool take(int64_t number, UncoveredPlace* place) {
    for (size_t i = 0; i < size_; ++i) {
      if (places_[i].taken || places_[i].place.since > number) continue;
      places_[i].taken = true;
      *place = places_[i].place;
      return true;
    }
    return false;
  }

 private:
  struct Entry {
    UncoveredPlace place;
    bool taken;
  };
  static bool is_in(const UncoveredPlace& a, const UncoveredPlace& b) {
    return a.x >= b.x && a.y >= b.y && a.x + a.width <= b.x + b.width &&
           a.y + a.height <= b.y + b.height;
  }
  void erase(size_t index) {
    std::move(places_.begin() + static_cast<std::ptrdiff_t>(index) + 1,
              places_.begin() + static_cast<std::ptrdiff_t>(size_),
              places_.begin() + static_cast<std::ptrdiff_t>(index));
    --size_;
  }

  std::array<Entry, kMost> places_;
  size_t size_ = 0;
};

}  // namespace qdmd
