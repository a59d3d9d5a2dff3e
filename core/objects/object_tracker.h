// SPDX-License-Identifier: LGPL-2.1-or-later
// Follows things through the regions of masks, and tells what becomes of them.
#pragma once

#include <span>
#include <vector>

#include "core/foreground/regions.h"
#include "core/objects/assignment.h"
#include "core/objects/object.h"
#include "core/objects/object_life.h"
#include "core/objects/object_motion.h"
#include "core/objects/removals.h"

namespace qdmd {

// What a frame shows.
struct ObjectFrame {
  // Of the mask, which may stay apart where boxes overlap (RegionFinder::find).
  std::span<const Region> regions;
  // Where it and the frames before it showed that something has left, each once.
  std::span<const RemovedPlace> removed;
  int64_t time = 0;   // nanoseconds, later than that of the frame before
  int64_t stamp = 0;  // anything that the caller wants to find again in objects that begin here
};

// Each thing has a number. Which has which, from frame to frame:
//  - A thing goes on as it went, with a steady velocity (a filter of fixed gains, the limit of a
//    Kalman filter's). Regions and things are assigned to each other by the Hungarian method; a
//    pair costs what their boxes do not share, and the distance of their middles.
//  - A thing that no region shows goes on unseen, until gone_seconds are over.
//  - Two meet: their region shows both. Each keeps its number, its size and its velocity; the outer
//    edges of the region say where those are that are outermost there and move.
//  - They part: each region goes to the thing that is expected there.
//  - Pieces of a thing beside each other are one, as long as they lie where the thing is expected.
//  - A piece that is left where a thing no longer is, is a new thing with a number of its own; the
//    thing that goes on keeps its number.
//  - Two of which one had not appeared yet are one where they meet.
//  - A region larger than a third of the picture is no thing: it says nothing.
class ObjectTracker {
 public:
  ObjectTracker() = default;
  ObjectTracker(const ObjectTracker&) = delete;
  ObjectTracker& operator=(const ObjectTracker&) = delete;

  // For pictures of that size. Nothing is known; numbers go on.
  void begin(int width, int height, const ObjectOptions& options);
  // The events of a frame, in the order of their numbers. Good until the next call. May throw
  // std::bad_alloc; nothing is known then.
  const std::vector<ObjectEvent>& push(const ObjectFrame& frame);
  // The stream ends here: each object that appeared is gone, cut off. Nothing is known.
  const std::vector<ObjectEvent>& end();
  // The next thing gets number 1 again: another stream begins.
  void begin_numbers() { next_id_ = 1; }
  // Holds from the next frame on.
  void set_options(const ObjectOptions& options) { options_ = options; }

  // What the newest frame shows: each region once, with its pieces, or, where things share it, once
  // for each. Where a region is too large for a thing, all of the frame's, with number 0.
  const std::vector<Object>& objects() const { return objects_; }
  // True between motion_begins and motion_ends.
  bool any_motion() const { return in_motion_; }
  // Regions of fewer pixels are no objects: a quarter of a square of min_size.
  static int least_area(int height, const ObjectOptions& options);

 private:
  struct Track {
    Object object;
    ObjectLife life;
    ObjectMotion motion;
    ObjectBox expected;                  // in this frame
    int region = -1;                     // that shows it in this frame; -1: none
    bool seen = false;                   // in this frame
    int64_t last_seen = 0;               // the frame's time
    int64_t hidden_since = kNoTime;      // in a region with room for another one alone
    bool went_out = false;               // over the edge of the picture
    bool stopped = false, left = false;  // told
  };

  void predict(double seconds);
  void assign(const ObjectFrame& frame);
  void share_regions(const ObjectFrame& frame);
  void take_pieces(const ObjectFrame& frame);
  void begin_tracks(const ObjectFrame& frame);
  void measure(const ObjectFrame& frame, double seconds);
  void measure_together(const std::vector<size_t>& tracks, const ObjectBox& region, double seconds);
  void find_hidden(int64_t time);
  void tell(const ObjectFrame& frame);
  void tell_of_removals(const ObjectFrame& frame);
  void tell_of_motion(int64_t time);
  int64_t last_motion(const Track& track) const;
  bool is_flood(const Region& region) const;
  bool is_alone(const Track& track) const;
  void add(ObjectEvent::Kind kind, const Object& object, bool cut_off = false);

  ObjectOptions options_;
  int width_ = 0, height_ = 0;
  int next_id_ = 1;
  std::vector<Track> tracks_;
  std::vector<Object> objects_;
  std::vector<ObjectEvent> events_;
  Removals removals_;
  Assignment assignment_;
  std::vector<double> cost_;
  std::vector<ObjectBox> boxes_;            // of the frame's regions
  std::vector<std::vector<size_t>> shown_;  // by regions: the tracks that each shows
  std::vector<char> has_old_;
  std::vector<int> kept_;
  std::vector<int> owner_;  // of each region: a track, or -1
  int64_t time_ = kNoTime, frame_ = 0, begun_ = kNoTime;
  int64_t moved_ = kNoTime;  // the last motion of what is gone
  bool in_motion_ = false;
};

}  // namespace qdmd
