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

// A thing stands since the earliest place from which on it stayed near to where it is now.
void ObjectLife::judge_standing(int64_t time, int64_t stop) {
  const Place& now = places_.back();
  const auto away = [&](const Place& from) { return std::hypot(now.x - from.x, now.y - from.y); };
  if (stands_) {
    if (away(*stood_at_) > std::max(2 * kPixels, kMovedOn * box_.longer())) {
      stands_ = false;
      places_.erase(places_.begin(), places_.end() - 1);
    }
    return;
  }
  auto since = places_.end();
  while (since != places_.begin() && away(*std::prev(since)) <= still()) --since;
  if (since == places_.end() || time - since->time < stop) return;
  stands_ = true;
  standing_since_ = since->time;
  stood_at_ = now;
}

void ObjectLife::follow(const ObjectBox* box, int64_t time, int64_t frame) {
  ++frames_;
  if (!box) {
    gone_ = first_ && time - last_ >= time_of(options_->gone_seconds, frame);
    return;
  }
  ++seen_;
  box_ = *box;
  last_ = time;
  const Place now = {time, box->middle_x(), box->middle_y()};
  longest_ = std::max(longest_, box->longer());
  if (!first_) first_ = before_ = now;
  // Boxes tremble: that is no way.
  if (const double step = std::hypot(now.x - before_.x, now.y - before_.y); step > 2 * kPixels) {
    way_ += step;
    before_ = now;
  }
  const int64_t stop = time_of(options_->stop_seconds, frame);
  places_.push_back(now);
  // One that is older than `stop` stays, from which on it may have stood.
  while (places_.size() > 2 && time - places_[1].time >= stop) places_.pop_front();
  const double gone = std::hypot(now.x - first_->x, now.y - first_->y);
  came_ |= gone >= box_.longer() / 2;
  judge_standing(time, stop);

  auto third = places_.begin();
  while (std::next(third) != places_.end() &&
         time - third->time > static_cast<int64_t>(kSecond) / 3)
    ++third;
  const double seconds = static_cast<double>(time - third->time) / kSecond;
  speed_ = seconds > 0 ? std::hypot(now.x - third->x, now.y - third->y) / seconds : 0;

  if (appeared_) return;
  const int64_t seen = time - first_->time;
  const double enough = std::max(2 * kPixels, std::min(longest_ / 2, kWay * height_));
  const bool goes = gone >= enough && gone >= kStraight * way_ &&
                    seen >= time_of(options_->appear_seconds, frame);
  auto stays = places_.end();
  while (stays != places_.begin() &&
         std::hypot(now.x - std::prev(stays)->x, now.y - std::prev(stays)->y) <= still())
    --stays;
  const bool stood = stays != places_.end() &&
                     time - stays->time >= time_of(kStandingShows * options_->stop_seconds, frame);
  appeared_ =
      longest_ >= options_->min_size * height_ && seen_ >= kMostFrames * frames_ && (goes || stood);
}

}  // namespace qdmd
