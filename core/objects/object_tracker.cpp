// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/objects/object_tracker.h"

#include <algorithm>
#include <cmath>

namespace qdmd {
namespace {

// Pairs that are worse are none: 1 - overlap, and half the distance of the middles in units of the
// longer side.
constexpr double kMostCost = 1.45, kOfDistance = 0.5, kNoPair = 1e6, kYoung = 0.2;
// A thing is in a region, or a region in a thing, with so large a share of its pixels.
constexpr double kInside = 0.5;
// A region that is so much smaller than a thing is a piece.
constexpr double kPiece = 0.35;
// A thing may look so many times as large, with all its pieces, as before.
constexpr double kGrows = 1.3;
// Seconds that an unseen thing goes on as it went; that which has not appeared waits for so long.
constexpr double kGoesOn = 0.5, kWaits = 0.2;
// So large a share of the picture is no thing.
constexpr double kMostOfPicture = 1.0 / 3;
// What was removed is told if its pieces fill so large a share of its box, and its longer side is
// so large a share of the picture's height: places are found in cells.
constexpr double kLeastRemoved = 1.0 / 20;
// A thing inside another one whose region has room for that one alone has gone, after seconds.
constexpr double kDouble = 0.8, kHidden = 2;

ObjectBox box_of(const Region& region) {
  return {static_cast<double>(region.x), static_cast<double>(region.y),
          static_cast<double>(region.width), static_cast<double>(region.height)};
}

double cost_of(const ObjectBox& expected, const ObjectBox& region) {
  const double far = distance(expected, region) / std::max(expected.longer(), region.longer());
  const double cost = 1 - overlap(expected, region) + kOfDistance * far;
  return cost > kMostCost ? kNoPair : cost;
}

int64_t nanoseconds(double seconds) { return static_cast<int64_t>(seconds * kSecond); }

}  // namespace

void ObjectTracker::begin(int width, int height, const ObjectOptions& options) {
  options_ = options;
  width_ = width, height_ = height;
  tracks_.clear(), objects_.clear(), events_.clear();
  tracks_.reserve(RegionFinder::kMostRegions);
  removals_.forget();
  time_ = moved_ = begun_ = kNoTime;
  frame_ = 0;
  in_motion_ = false;
}

int ObjectTracker::least_area(int height, const ObjectOptions& options) {
  const double side = options.min_size * height;
  return std::max(4, static_cast<int>(std::lround(side * side / 4)));
}

void ObjectTracker::add(ObjectEvent::Kind kind, const Object& object, bool cut_off) {
  events_.push_back({kind, object, cut_off});
}

void ObjectTracker::predict(double seconds) {
  for (Track& track : tracks_) {
    track.region = -1;
    track.seen = false;
    const double unseen = static_cast<double>(time_ - track.last_seen) / kSecond;
    const bool stays = track.life.standing_since() != kNoTime || unseen > kGoesOn + seconds;
    track.expected = track.motion.expect(stays ? 0 : std::min(seconds, kGoesOn));
  }
}

void ObjectTracker::assign(const ObjectFrame& frame) {
  const size_t regions = frame.regions.size();
  owner_.assign(regions, -1);
  cost_.resize(tracks_.size() * regions);
  for (size_t t = 0; t < tracks_.size(); ++t) {
    const Track& track = tracks_[t];
    const ObjectBox& at = track.expected;
    const auto shows = [&](const ObjectBox& box) { return shared(box, at) > kInside * at.area(); };
    const bool shown = std::any_of(boxes_.begin(), boxes_.end(), shows);
    for (size_t r = 0; r < regions; ++r) {
      double& cost = cost_[t * regions + r];
      cost = cost_of(at, boxes_[r]);
      // A piece of what another region shows.
      const bool piece = shown && boxes_[r].area() < kPiece * at.area();
      if (track.went_out || piece) cost = kNoPair;
      // Of two, the one that is known for longer.
      if (!track.object.appeared) cost += kYoung;
    }
  }
  const std::vector<int>& pairs = assignment_.solve(cost_, tracks_.size(), regions);
  for (size_t t = 0; t < tracks_.size(); ++t) {
    if (pairs[t] < 0 || cost_[t * regions + static_cast<size_t>(pairs[t])] >= kNoPair) continue;
    tracks_[t].region = pairs[t];
    tracks_[t].seen = true;
    owner_[static_cast<size_t>(pairs[t])] = static_cast<int>(t);
  }
}

// Things without a region of their own, in that of another one.
void ObjectTracker::share_regions(const ObjectFrame& frame) {
  for (Track& track : tracks_) {
    if (track.seen || track.went_out) continue;
    double most = kInside * track.expected.area();
    for (size_t r = 0; r < frame.regions.size(); ++r) {
      const double inside = shared(track.expected, boxes_[r]);
      if (owner_[r] < 0 || inside < most) continue;
      most = inside;
      track.region = static_cast<int>(r);
      track.seen = true;
    }
  }
  // One that has not appeared yet was a piece of the other.
  has_old_.assign(frame.regions.size(), 0);
  for (const Track& track : tracks_)
    if (track.seen && track.object.appeared) has_old_[static_cast<size_t>(track.region)] = 1;
  kept_.assign(frame.regions.size(), -1);
  for (const Track& track : tracks_) {
    if (!track.seen || track.object.appeared) continue;
    int& first = kept_[static_cast<size_t>(track.region)];
    if (first < 0 || track.object.id < first) first = track.object.id;
  }
  std::erase_if(tracks_, [&](const Track& track) {
    if (!track.seen || track.object.appeared) return false;
    const auto r = static_cast<size_t>(track.region);
    return has_old_[r] || kept_[r] != track.object.id;
  });
  for (int& owner : owner_) owner = -1;
  for (size_t t = 0; t < tracks_.size(); ++t)
    if (tracks_[t].seen) {
      int& owner = owner_[static_cast<size_t>(tracks_[t].region)];
      if (owner < 0) owner = static_cast<int>(t);
    }
}

// Regions of nobody that lie where a thing is expected: boxes_ of its region grows.
void ObjectTracker::take_pieces(const ObjectFrame& frame) {
  for (size_t r = 0; r < frame.regions.size(); ++r) {
    if (owner_[r] >= 0) continue;
    for (size_t t = 0; t < tracks_.size(); ++t) {
      const Track& track = tracks_[t];
      if (!track.seen) continue;
      const ObjectBox room = track.expected.wider(0.1 * track.expected.longer());
      if (shared(room, boxes_[r]) < kInside * boxes_[r].area()) continue;
      // What is hidden for the most part has no box of its own.
      if (boxes_[r].area() < kPiece * track.expected.area()) owner_[r] = static_cast<int>(t);
      if (owner_[static_cast<size_t>(track.region)] != static_cast<int>(t)) continue;
      ObjectBox& its = boxes_[static_cast<size_t>(track.region)];
      const ObjectBox all = both(its, boxes_[r]);
      if (all.width > std::max(its.width, kGrows * track.expected.width) ||
          all.height > std::max(its.height, kGrows * track.expected.height))
        continue;
      its = all;
      owner_[r] = static_cast<int>(t);
      break;
    }
  }
}

void ObjectTracker::begin_tracks(const ObjectFrame& frame) {
  for (size_t r = 0; r < frame.regions.size(); ++r) {
    if (owner_[r] >= 0) continue;
    const ObjectBox& box = boxes_[r];
    Track track = {{},
                   ObjectLife(options_, width_, height_),
                   ObjectMotion(box, width_, height_),
                   box,
                   static_cast<int>(r),
                   true};
    track.object.id = next_id_++;
    track.object.first_time = frame.time;
    track.object.first_stamp = frame.stamp;
    owner_[r] = static_cast<int>(tracks_.size());
    tracks_.push_back(std::move(track));
  }
}

bool ObjectTracker::is_flood(const Region& region) const {
  return region.area > kMostOfPicture * width_ * height_;
}

// Things in one region, of which each has kept its size.
void ObjectTracker::measure_together(const std::vector<size_t>& tracks, const ObjectBox& region,
                                     double seconds) {
  const auto outermost = [&](auto edge) {
    return *std::min_element(tracks.begin(), tracks.end(), [&](size_t a, size_t b) {
      return edge(tracks_[a].expected) < edge(tracks_[b].expected);
    });
  };
  const size_t left = outermost([](const ObjectBox&b) { return b.x; }),
               right = outermost([](const ObjectBox&b) { return -b.right(); }),
               top = outermost([](const ObjectBox&b) { return b.y; }),
               bottom = outermost([](const ObjectBox&b) { return -b.bottom(); });
  for (size_t t : tracks) {
    Track& track = tracks_[t];
    // What stands is where it was.
    if (track.life.standing_since() == kNoTime) {
      // Nobody knows how far it went while frames were missing.
      track.motion.go_on(std::min(seconds, kGoesOn));
      const auto off = [](bool low, double by_low, bool high, double by_high) {
        return low && high ? (by_low + by_high) / 2 : low ? by_low : high ? by_high : 0;
      };
      const ObjectBox& at = track.expected;
      track.motion.correct(
          off(t == left, region.x - at.x, t == right, region.right() - at.right()),
          off(t == top, region.y - at.y, t == bottom, region.bottom() - at.bottom()), seconds);
    }
    track.object.box = track.motion.box();
  }
}

void ObjectTracker::measure(const ObjectFrame& frame, double seconds) {
  // Lists keep their memory.
  if (shown_.size() < frame.regions.size()) shown_.resize(frame.regions.size());
  for (std::vector<size_t>& shown : shown_) shown.clear();
  for (size_t t = 0; t < tracks_.size(); ++t) {
    if (tracks_[t].seen)
      shown_[static_cast<size_t>(tracks_[t].region)].push_back(t);
    else if (tracks_[t].life.standing_since() == kNoTime &&
             frame.time - tracks_[t].last_seen <= nanoseconds(kGoesOn))
      tracks_[t].motion.go_on(seconds);
  }
  for (size_t r = 0; r < frame.regions.size(); ++r) {
    if (shown_[r].empty()) continue;
    const ObjectBox& region = boxes_[r];
    const bool together = shown_[r].size() > 1;
    double all = 0;
    for (size_t t : shown_[r]) all += tracks_[t].expected.area();
    if (together) measure_together(shown_[r], region, seconds);
    for (size_t t : shown_[r]) {
      Track& track = tracks_[t];
      Object& object = track.object;
      object.mean_residual = frame.regions[r].mean_residual;
      const double share = together ? track.expected.area() / all : 1;
      object.area = static_cast<int>(std::lround(share * frame.regions[r].area));
      object.shares_region = together;
      if (!together) {
        track.motion.follow(region, track.life.standing_since() != kNoTime, seconds);
        object.box = region;
      }
      object.vx = track.motion.vx(), object.vy = track.motion.vy();
      track.last_seen = frame.time;
    }
  }
  // Pieces count, too.
  for (size_t r = 0; r < frame.regions.size(); ++r) {
    if (owner_[r] < 0 || !shown_[r].empty()) continue;
    tracks_[static_cast<size_t>(owner_[r])].object.area += frame.regions[r].area;
  }
  find_hidden(frame.time);
}

void ObjectTracker::find_hidden(int64_t time) {
  for (Track& track : tracks_) {
    const bool with_others = track.seen && shown_[static_cast<size_t>(track.region)].size() > 1;
    const bool hidden =
        with_others && std::any_of(tracks_.begin(), tracks_.end(), [&](const Track& other) {
          return &other != &track && other.seen && other.region == track.region &&
                 other.object.id < track.object.id &&
                 overlap(other.object.box, boxes_[static_cast<size_t>(track.region)]) > kDouble &&
                 shared(track.object.box, other.object.box) > kDouble * track.object.box.area();
        });
    if (!hidden)
      track.hidden_since = kNoTime;
    else if (track.hidden_since == kNoTime)
      track.hidden_since = time;
  }
}

// Nothing that moves is beside it.
bool ObjectTracker::is_alone(const Track& track) const {
  const ObjectBox around = track.object.box.wider(track.object.box.longer() / 2);
  return std::none_of(tracks_.begin(), tracks_.end(), [&](const Track& other) {
    return &other != &track && other.seen && other.object.appeared && other.life.moves() &&
           shared(other.object.box, around) > 0;
  });
}

void ObjectTracker::tell(const ObjectFrame& frame) {
  using Kind = ObjectEvent::Kind;
  for (Track& track : tracks_) {
    Object& object = track.object;
    const ObjectBox box = track.motion.box();
    if (track.seen)
      track.life.follow({box, object.box, is_alone(track)}, frame.time, frame_);
    else
      track.life.miss(frame.time, frame_);
    const bool stood = object.standing_since != kNoTime;
    object.standing_since = track.life.standing_since();
    if (!track.seen) {
      track.went_out |= track.motion.goes_out();
      continue;
    }
    if (!object.appeared && frame.time - begun_ >= nanoseconds(options_.settle_seconds) &&
        track.life.appeared() && !removals_.covers(object.box, frame.time)) {
      object.appeared = true;
      add(Kind::appeared, object);
    }
    if (!object.appeared) continue;
    const bool stands = object.standing_since != kNoTime;
    if (stood && !stands && (track.stopped || track.left)) {
      track.stopped = track.left = false;
      add(Kind::moved_on, object);
    }
    if (!stands || track.stopped || track.left) continue;
    if (track.life.came_by_itself()) {
      track.stopped = true;
      add(Kind::stopped, object);
    } else if (track.life.was_left()) {
      track.left = true;
      add(Kind::left_behind, object);
    }
  }
  const int64_t waits = std::max(nanoseconds(kWaits), 2 * frame_);
  std::erase_if(tracks_, [&](const Track& track) {
    const bool hidden =
        track.hidden_since != kNoTime && frame.time - track.hidden_since > nanoseconds(kHidden);
    if (!track.object.appeared) return frame.time - track.last_seen > waits;
    if (!track.life.gone() && !hidden) return false;
    moved_ = std::max(moved_, last_motion(track));
    Object gone = track.object;
    gone.box = track.life.last_whole();
    add(Kind::gone, gone);
    return true;
  });
}

void ObjectTracker::tell_of_removals(const ObjectFrame& frame) {
  using Kind = ObjectEvent::Kind;
  for (const RemovedPlace& place : frame.removed)
    if (place.stood_seconds >= options_.removed_seconds)
      removals_.add(place, frame.time, height_ / 4.0);
  ObjectBox box;
  // Where what was uncovered is foreground again, it was not the background.
  const auto is_free = [&](const ObjectBox& place) {
    double covered = 0;
    for (const ObjectBox& region : boxes_) covered += shared(region, place);
    return covered < kInside * place.area();
  };
  while (removals_.take(frame.time, is_free, &box)) {
    if (box.longer() < std::max(kLeastRemoved, options_.min_size) * height_) continue;
    // Where it was, the mask may have had a region that never moved.
    const auto its = std::find_if(tracks_.begin(), tracks_.end(), [&](const Track& track) {
      return !track.life.came_by_itself() && overlap(track.object.box, box) > kInside;
    });
    Object object;
    if (its != tracks_.end()) {
      object = its->object;
    } else {
      object.id = next_id_++;
      object.first_time = frame.time;
      object.first_stamp = frame.stamp;
    }
    object.box = box;
    add(Kind::removed, object);
    if (its != tracks_.end() && !object.appeared) tracks_.erase(its);
  }
}

void ObjectTracker::tell_of_motion(int64_t time) {
  using Kind = ObjectEvent::Kind;
  int64_t newest = moved_;
  for (const Track& track : tracks_)
    if (track.object.appeared) newest = std::max(newest, last_motion(track));
  if (newest == time && !in_motion_) {
    in_motion_ = true;
    // Before what moves is told of.
    events_.insert(events_.begin(), {Kind::motion_begins, {}, false});
  }
  if (!in_motion_ || time - newest < nanoseconds(options_.grace_seconds)) return;
  in_motion_ = false;
  add(Kind::motion_ends, {});
}

// What stands has moved until it stood.
int64_t ObjectTracker::last_motion(const Track& track) const {
  const int64_t since = track.life.standing_since();
  return since == kNoTime ? track.last_seen : since;
}

const std::vector<ObjectEvent>& ObjectTracker::push(const ObjectFrame& frame) {
  events_.clear();
  const int64_t step = time_ == kNoTime ? 0 : std::max<int64_t>(1, frame.time - time_);
  time_ = frame.time;
  if (begun_ == kNoTime) begun_ = frame.time;
  // The shortest of the last steps: frames may be missing.
  frame_ = frame_ == 0 || step < frame_ ? step : frame_ + (step - frame_) / 16;
  const double seconds = std::max(1e-3, static_cast<double>(step) / kSecond);
  boxes_.clear();
  bool flood = false;
  for (const Region& region : frame.regions) {
    boxes_.push_back(box_of(region));
    flood |= is_flood(region);
  }
  objects_.clear();
  if (flood) {
    // Nobody is gone because of it.
    for (Track& track : tracks_) {
      track.last_seen += step;
      track.life.wait(step);
    }
    for (size_t r = 0; r < frame.regions.size(); ++r) {
      Object& object = objects_.emplace_back();
      object.box = boxes_[r];
      object.area = frame.regions[r].area;
      object.mean_residual = frame.regions[r].mean_residual;
      object.first_time = frame.time;
      object.first_stamp = frame.stamp;
    }
    return events_;
  }
  predict(seconds);
  assign(frame);
  share_regions(frame);
  take_pieces(frame);
  begin_tracks(frame);
  measure(frame, seconds);
  tell(frame);
  tell_of_removals(frame);
  tell_of_motion(frame.time);
  for (const Track& track : tracks_)
    if (track.seen) objects_.push_back(track.object);
  return events_;
}

const std::vector<ObjectEvent>& ObjectTracker::end() {
  events_.clear();
  for (const Track& track : tracks_)
    if (track.object.appeared) add(ObjectEvent::Kind::gone, track.object, true);
  if (in_motion_) add(ObjectEvent::Kind::motion_ends, {}, true);
  const std::vector<ObjectEvent> told = std::move(events_);
  begin(width_, height_, options_);
  events_ = told;
  return events_;
}

}  // namespace qdmd
