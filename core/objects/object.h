// SPDX-License-Identifier: LGPL-2.1-or-later
// Things that come, stand and go: what is known of one, and what is told of it.
#pragma once

#include <algorithm>
#include <cstdint>

namespace qdmd {

// A box of the picture, pixels; its middle moves by parts of a pixel.
struct ObjectBox {
  double x = 0, y = 0, width = 0, height = 0;

  double right() const { return x + width; }
  double bottom() const { return y + height; }
  double middle_x() const { return x + width / 2; }
  double middle_y() const { return y + height / 2; }
  double area() const { return width * height; }
  double longer() const { return std::max(width, height); }
  // By so many pixels on every side.
  ObjectBox wider(double by) const { return {x - by, y - by, width + 2 * by, height + 2 * by}; }
};

inline ObjectBox both(const ObjectBox& a, const ObjectBox& b) {
  const double x = std::min(a.x, b.x), y = std::min(a.y, b.y);
  return {x, y, std::max(a.right(), b.right()) - x, std::max(a.bottom(), b.bottom()) - y};
}

// The pixels that two boxes share.
inline double shared(const ObjectBox& a, const ObjectBox& b) {
  const double width = std::min(a.right(), b.right()) - std::max(a.x, b.x);
  const double height = std::min(a.bottom(), b.bottom()) - std::max(a.y, b.y);
  return width > 0 && height > 0 ? width * height : 0;
}

// Their share of both together, 0 to 1.
inline double overlap(const ObjectBox& a, const ObjectBox& b) {
  const double of_both = shared(a, b), all = a.area() + b.area() - of_both;
  return all > 0 ? of_both / all : 0;
}

// How far the middle of one is from that of the other, pixels.
double distance(const ObjectBox& a, const ObjectBox& b);

// Times are nanoseconds of a clock that the caller keeps: it does not go back.
inline constexpr int64_t kNoTime = INT64_MIN;
inline constexpr double kSecond = 1e9;

struct Object {
  int id = 0;                        // from 1 on; no two things of a tracker have the same
  ObjectBox box;                     // in the newest frame that showed it
  int area = 0;                      // masked pixels
  double mean_residual = 0;          // of these, levels
  double vx = 0, vy = 0;             // pixels a second
  int64_t first_time = 0;            // of the first frame that showed it
  int64_t first_stamp = 0;           // what the caller said of that frame (ObjectFrame::stamp)
  int64_t standing_since = kNoTime;  // kNoTime: it moves
  bool appeared = false;             // it was told of
  bool shares_region = false;        // with others: its box is an estimate
};

struct ObjectEvent {
  enum class Kind {
    appeared,       // a thing, and no leaf or speck, was seen for ObjectOptions::appear_seconds
    stopped,        // it came here and stands for stop_seconds
    left_behind,    // it stands, never moved, and what brought it went stop_seconds ago
    removed,        // something that belonged to the background was taken
    moved_on,       // what stopped, or was left behind, goes on
    gone,           // nothing showed it for gone_seconds
    motion_begins,  // something moves in the picture
    motion_ends     // nothing has moved for grace_seconds
  };
  Kind kind = Kind::appeared;
  Object object;         // not of motion_begins and motion_ends
  bool cut_off = false;  // gone, motion_ends: the stream ended before
};

// The name that users see.
inline const char* name_of(ObjectEvent::Kind kind) {
  using Kind = ObjectEvent::Kind;
  switch (kind) {
    case Kind::appeared:
      return "appeared";
    case Kind::stopped:
      return "stopped";
    case Kind::left_behind:
      return "left-behind";
    case Kind::removed:
      return "removed";
    case Kind::moved_on:
      return "moved-on";
    case Kind::gone:
      return "gone";
    case Kind::motion_begins:
      return "motion-begins";
    default:
      return "motion-ends";
  }
}

struct ObjectOptions {
  // The longer side of an object's box, in parts of the picture's height.
  double min_size = 1.0 / 60;
  // Seconds; and at least three frames. See ObjectEvent::Kind.
  double appear_seconds = 0.2, stop_seconds = 2, gone_seconds = 1, grace_seconds = 3;
  // What belonged to the background had been there for so long.
  double removed_seconds = 4;
  // Nothing is told before so much of the stream is known.
  double settle_seconds = 4;
};

}  // namespace qdmd
