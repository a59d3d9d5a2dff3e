// SPDX-License-Identifier: LGPL-2.1-or-later
// What is known of each place of the scene, and by what proof: what stands there came, or it was
// uncovered.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/learn/robust/history_starts.h"
#include "core/learn/robust/judgements.h"
#include "core/learn/robust/region_contours.h"
#include "core/learn/robust/shown_counts.h"
#include "core/learn/robust/standing_looks.h"

namespace qdmd {

// Where something stands before the background when a solve begins, also as long as nobody can say
// whether it came: the older look stays.
struct Proofs {
  Proofs() = default;
  explicit Proofs(size_t cells) : came(cells), since(cells) {}
  static uint64_t bytes(uint64_t cells) { return cells * (sizeof(uint8_t) + sizeof(int64_t)); }

  std::vector<uint8_t> came;
  std::vector<int64_t> since;  // the frame with which it came; kUnsure: nobody has said that yet
  static constexpr int64_t kUnsure = INT64_MAX;
  bool any = false;    // something stands somewhere
  bool young = false;  // SceneMemory::young()
};

// Follows the frames of a stream as they come. A region that shows something else than its
// background, and shows it steadily, is judged by two proofs:
//   motion    what comes arrives through the places around it and stops; what leaves goes on
//             through them. So things pass there before the change, or after it.
//   contours  what stands before something else ends in an edge, which what is behind does not have
//             (contours_of: in full resolution).
// | what frames show                                                   | what the region is      |
// |--------------------------------------------------------------------|-------------------------|
// | the background's contour is stronger, motion does not say the      | left                    |
// |   contrary, and all around has settled                             |                         |
// | much stronger, and nothing has settled for 2 kMoves frames         | left                    |
// | both proofs are clear (kClear, kClearBoth), in a larger region     | left, at once           |
// | a few cells beside what left, which changed when that did          | left                    |
// | it lies beside what came: the background's contour must be much    | left                    |
// |   stronger                                                         |                         |
// | looks came all over the picture at once, and nothing went there    | nothing, for kLasts     |
// | most of the picture differs                                        | nothing, for kLasts;    |
// |                                                                    |   then left: no object  |
// | there, the background in less light                                | shaded: older look stays|
// | anything else, for 3 kMoves frames                                 | came: older look stays, |
// |                                                                    |   if it is known        |
// | the scene is young (mode=live)                                     | contours alone decide   |
class SceneMemory {
 public:
  SceneMemory() = default;
  // Takes all memory but what judge() needs for a moment. live: frames are not waiting for what is
  // said of them.
  SceneMemory(const Grid& grid, bool live);
  static uint64_t bytes(const Grid& grid);

  // Nothing is known.
  void forget();
  // What is known of a cell, for a file and back: see StandingLooks.
  void write(size_t cell, int64_t now, LearntPlace* out) const;
  bool read(size_t cell, int64_t now, const LearntPlace& from);
  // Somebody else has seen enough frames: neither the scene nor its places are young.
  void grow_up() {
    followed_ = std::max(followed_, young_frames_);
    shown_.grow_up();
  }
  // Marks where something stands before the background.
  void find_standing(std::vector<uint8_t>* stands) const;
  // The same places in other colours: their background is known, and where `stands` says so,
  // something still stands before it.
  void begin_colours(const std::vector<uint8_t>& stands);
  // The next frame of the stream, its levels divided by `gain`. number: counts frames.
  void follow(const float* const frame[3], const Gain& gain, int64_t number) {
    looks_.follow(frame, gain, number);
    ++followed_;
  }
  // What the cells show.
  const StandingLooks& looks() const { return looks_; }
  StandingLooks& looks() { return looks_; }

  // The contours of a region in the newest frame and in the background.
  using Contours = std::function<RegionContours(const std::vector<int>& region)>;
  // Judges what does not show its background, after follow(). Returns the cells that show now what
  // is behind what has left, and the cells next to them that belong to it. Good until the next
  // call. May throw std::bad_alloc.
  const std::vector<int>& judge(const float* const background[3], const Contours& contours);
  // True where something new stands in enough cells that the next solve should look at it.
  bool any_news() const { return news_; }
  // True while so few frames were seen that nothing is known: looks are judged by contours alone,
  // as windows judge them.
  bool young() const { return followed_ < young_frames_; }
  // Makes `solve` what is known, with the background of the newest judge(). Takes no memory.
  void hand_over(Proofs* solve);

  // Where something was found to have left, and since when.
  HistoryStarts& uncovered() { return uncovered_; }

 private:
  using Of = Judgements::Of;
  // The share of the cells around a region before which something passes, a frame's mean, in the
  // frames before and after it changed; and of those next to it now.
  struct Motion {
    double before = 0, after = 0, near = 0;
  };
  // The frames between which a region changed: the last that showed what was there before, and the
  // first that shows what is there now.
  struct Change {
    int64_t from = 0, until = 0;
    bool known = false;  // something was known before
  };
  Change change_of(const std::vector<int>& region) const;
  Motion motion_around(const std::vector<int>& region, const Change& change);
  bool has_left(const std::vector<int>& region, const Change& change, double stronger,
                const Motion& motion) const;
  void judge(const std::vector<int>& region, const Contours& contours);
  void decide(const std::vector<int>& region, Of of);
  bool came_beside(const std::vector<int>& region) const;
  bool is_all_over(int64_t since) const;
  bool left_beside(const std::vector<int>& region) const;
  void widen(const float* const background[3]);
  void forget_what_went();
  void leave_out_shaded(const float* const background[3]);
  bool is_most_of_picture() const;
  void judge_as_one();
  float apart(int cell, const float* const background[3]) const;
  // What was said of what the cell shows now.
  Of of(int cell) const { return said_.of(cell, looks_.since(cell)); }

  Grid grid_;
  StandingLooks looks_;
  HistoryStarts uncovered_;
  Judgements said_;
  ShownCounts shown_;
  std::vector<uint8_t> differs_, unjudged_, marks_;  // by cells
  std::vector<int> found_, around_, differing_;
  bool news_ = false;
  int64_t young_frames_ = 0, followed_ = 0;
  double settled_ = 0;  // kSettled, or that of live
  // Looks that came until then in cells that are marked stood there in other colours.
  int64_t stood_until_ = StandingLooks::kNever;
};

}  // namespace qdmd
