// SPDX-License-Identifier: LGPL-2.1-or-later
// Follows the frames of a stream between its solves, with the background in use.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "core/learn/robust/colour_map.h"
#include "core/learn/robust/disturbances.h"
#include "core/learn/robust/exposure_watch.h"
#include "core/learn/robust/history_starts.h"
#include "core/learn/robust/learning_steps.h"
#include "core/learn/robust/light.h"
#include "core/learn/robust/scene_memory.h"
#include "core/learn/robust/scene_watch.h"
#include "core/learn/robust/solve_history.h"
#include "core/learn/robust/standing_looks.h"

namespace qdmd {

// Mends the background where frames show that something has left or was absorbed, notices other
// scenes, and knows the light of frames. Solves run beside it: what they are told is a copy.
class FrameFollower {
 public:
  explicit FrameFollower(const RobustContext& context) : context_(context) {}
  // Takes all memory.
  void begin();
  static uint64_t bytes(const RobustContext& context, Models models);
  void forget();

  // The cells of two backgrounds, in unit light: picture used() is of the one in use; a solve
  // writes the other one, and publish() puts it in use. whole: it is of a whole window.
  GridFrames* cells() { return &background_cells_; }
  int used() const { return published_; }
  void publish(bool whole);
  // What is known of cells, for a file and back. Where read() throws, all is as it was.
  void write(std::vector<LearntPlace>* places) const;
  void read(const LearntEarlier& from);
  // The background in use is this picture now.
  void follow(const std::vector<uint8_t> level[kChannels]);
  // While a camera that starts looks for its exposure, nothing that it shows is known for sure.
  bool settled() const { return exposure_.settled(); }
  // True once, when that is over.
  bool has_found_exposure() { return exposure_.has_found(); }
  // Solves are told what is known.
  void tell(SolveHistory* history) { history->take(&absorbed_, &memory_, disturbances_); }
  // Learner::enough().
  int enough() const { return 1 + std::min(calm_, steps::pace::kMostCalm); }

  // As those of a Learner.
  void mend(const Learner::Compared& frame, BackgroundModel* model);
  void look_ahead(const Learner::Compared& frame, BackgroundModel* model);
  UncoveredPlaces* uncovered() { return &uncovered_; }
  void set_absorb_frames(int64_t frames) { absorb_frames_ = frames; }
  SceneSeen scene_of(int slot);
  void begin_scene();
  // What makes the background's colours those of the newest frames, after scene_of() said that they
  // are others; null: nobody knows.
  const ColourMap* new_colours() const { return new_colours_ ? &*new_colours_ : nullptr; }
  Gain light(int slot) {
    return context_.of_format(
        light_.over(context_.room.frames->cells(), slot, background_cells_, published_));
  }

 private:
  // Of the newest frame, or -1.
  int64_t newest_number() const {
    return static_cast<int64_t>(context_.room.frames->frames_taken()) - 1;
  }
  // Frames that cells of a background are taken from, each in its own light.
  struct LitFrames {
    SnapshotRange frames;
    std::array<LitSlot, Learner::kMendingFrames> at;
    std::span<const LitSlot> slots() const {
      return {at.data(), static_cast<size_t>(frames.size())};
    }
  };
  // The three channels of a picture of cells.
  struct Cells {
    const float* of[kChannels];
    Cells(const GridFrames& cells, int at)
        : of{cells.plane(at, 0), cells.plane(at, 1), cells.plane(at, 2)} {}
    operator const float* const*() const { return of; }
    std::array<float, kChannels> at(size_t cell) const {
      return {of[0][cell], of[1][cell], of[2][cell]};
    }
  };
  Cells background() const { return {background_cells_, published_}; }
  Cells unclipped_cells(int slot, const Gain& light, const StandingLooks& looks);
  bool is_calm() const;
  void forget_places();
  void follow_disturbances(const Cells& frame, const Gain& light, int64_t number);
  void note_uncovered(const std::vector<int>& cells, const StandingLooks& looks, int64_t number);
  SceneSeen colours_of(const Cells& frame);
  LitFrames lit_frames(const Learner::Compared& frame, const Gain& light,
                       const BackgroundModel* of_window);
  void mend_uncovered(std::vector<int> cells, const StandingLooks& looks,
                      const Learner::Compared& frame, const Gain& light,
                      const BackgroundModel* of_window, BackgroundModel* model);
  void mend(const std::vector<int>& cells, const StandingLooks& looks,
            const Learner::Compared& frame, const LitFrames& lit, BackgroundModel* model);
  void replace(const std::vector<int>& cells, const StandingLooks& looks, const LitFrames& lit,
               BackgroundModel* model);
  void replace_deep(const std::vector<int>& cells, const LitFrames& lit,
                    BackgroundModel* model) const;

  const RobustContext& context_;
  GridFrames background_cells_;
  GridFrames unclipped_;  // of a frame
  int published_ = 0;
  LightOfFrames light_;
  SceneMemory memory_;             // what frames that came showed
  std::vector<uint8_t> standing_;  // by cells: something stands when colours change
  Disturbances disturbances_;
  StandingLooks looks_;  // what frames showed when they were compared, in batch
  HistoryStarts absorbed_;
  UncoveredPlaces uncovered_;
  int64_t absorb_frames_ = 0;
  SceneWatch scene_;
  ExposureWatch exposure_;
  // Solves in a row that changed little, since a cell was mended.
  int calm_ = 0;
  // In other colours: frames in a row; until the background in use has them, too; and the colours
  // that are known to have been left.
  int other_coloured_ = 0;
  bool colours_begin_ = false;
  std::optional<ColourMap> new_colours_;
  std::optional<Colouring> left_colours_;
  // Another scene was seen; and solves know of it, but no background yet.
  bool other_scene_ = false, scene_begins_ = false;
};

}  // namespace qdmd
