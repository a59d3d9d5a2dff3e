// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/objects/object_life.h"

#include <cmath>

namespace qdmd {
namespace {

// In frames: what is shorter says nothing.
constexpr int64_t kLeastFrames = 3;
// A way is straight if its ends are so far apart, in parts of its length.
constexpr double kStraight = 0.5;
// What is seen in a smaller share of the frames flickers.
constexpr double kMostFrames = 0.7;
// Pixels: boxes of a mask are no better.
constexpr double kPixels = 1.5;

int64_t time_of(double seconds, int64_t frame) {
  return std::max(static_cast<int64_t>(seconds * kSecond), kLeastFrames * frame);
}

}  // namespace

double distance(const ObjectBox& a, const ObjectBox& b) {
  return std::hypot(a.middle_x() - b.middle_x(), a.middle_y() - b.middle_y());
}

double ObjectLife::still() const { return std::max(kPixels, kStill * box_.longer()); }

double ObjectLife::way(const ObjectBox& from, const ObjectBox& to) const {
  const auto along = [](double low, double high, bool at_low, bool at_high) {
    if (at_low && at_high) return 0.0;
    if (at_low) return std::abs(high);
    if (at_high) return std::abs(low);
    return low * high > 0 ? std::min(std::abs(low), std::abs(high)) : 0;
  };
  const auto at_start = [](double from_low, double to_low) {
    return std::min(from_low, to_low) <= kPixels;
  };
  const auto at_end = [](double from_high, double to_high, int end) {
    return std::max(from_high, to_high) >= end - kPixels;
  };
  return std::hypot(along(to.x - from.x, to.right() - from.right(), at_start(from.x, to.x),
                          at_end(from.right(), to.right(), width_)),
                    along(to.y - from.y, to.bottom() - from.bottom(), at_start(from.y, to.y),
                          at_end(from.bottom(), to.bottom(), height_)));
}

// Since when it stayed near to where it is now.
int64_t ObjectLife::stays_since() const {
  size_t at = count_ - 1;
  while (at > 0 && distance(box_, place(at - 1).box) <= still()) --at;
  return place(at).time;
}

// One that is older than `stop` stays, from which on it may have stood.
void ObjectLife::add_place(int64_t time, int64_t stop) {
  const auto drop = [this] {
    begin_ = (begin_ + 1) % kPlaces;
    --count_;
  };
  while (count_ > 2 && time - place(1).time >= stop) drop();
  // Of long times, the newest place stands for those close before it.
  const bool close =
      count_ > 1 && time - place(count_ - 2).time < stop / static_cast<int64_t>(kPlaces - 4);
  if (close)
    --count_;
  else if (count_ == kPlaces)
    drop();
  places_[(begin_ + count_++) % kPlaces] = {time, box_};
}

void ObjectLife::judge_standing(int64_t time, int64_t stop) {
  if (stands_) {
    if (distance(box_, stood_at_->box) > std::max(2 * kPixels, kMovedOn * box_.longer())) {
      stands_ = false;
      begin_ = (begin_ + count_ - 1) % kPlaces;
      count_ = 1;
    }
    return;
  }
  const int64_t since = stays_since();
  if (time - since < stop) return;
  stands_ = true;
  standing_since_ = since;
  stood_at_ = {time, box_};
}

void ObjectLife::miss(int64_t time, int64_t frame) {
  ++frames_;
  gone_ = first_ && time - last_ >= time_of(options_->gone_seconds, frame);
}

void ObjectLife::follow(const Sight& sight, int64_t time, int64_t frame) {
  ++frames_;
  ++seen_;
  box_ = sight.box;
  last_ = time;
  if (sight.alone && alone_since_ == kNoTime) alone_since_ = time;
  longest_ = std::max(longest_, box_.longer());
  if (!first_) {
    first_ = {time, sight.region};
    before_ = box_;
  }
  // Boxes tremble: that is no way.
  if (const double step = distance(box_, before_); step > 2 * kPixels) {
    way_ += step;
    before_ = box_;
  }
  const int64_t stop = time_of(options_->stop_seconds, frame);
  add_place(time, stop);
  double largest = 0;
  for (size_t at = 0; at < count_; ++at) largest = std::max(largest, place(at).box.area());
  if (2 * box_.area() >= largest) last_whole_ = box_;
  const double gone = way(first_->box, sight.region);
  came_ |= gone >= box_.longer() / 2;
  judge_standing(time, stop);
  was_left_ = stands_ && !came_ && alone_since_ != kNoTime && time - alone_since_ >= stop;
  if (appeared_) return;
  const double enough = std::max(2 * kPixels, std::min(longest_ / 2, kWay * height_));
  const bool goes = gone >= enough && gone >= kStraight * way_ &&
                    time - first_->time >= time_of(options_->appear_seconds, frame);
  const bool stood =
      alone_since_ != kNoTime && time - std::max(stays_since(), alone_since_) >=
                                     time_of(kStandingShows * options_->stop_seconds, frame);
  appeared_ =
      longest_ >= options_->min_size * height_ && seen_ >= kMostFrames * frames_ && (goes || stood);
}

}  // namespace qdmd
