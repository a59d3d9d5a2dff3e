// SPDX-License-Identifier: LGPL-2.1-or-later
// The solve of a window: robust Q-DMD of its frames, told of what was known before.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "core/dmd/decompose.h"
#include "core/gram/gram.h"
#include "core/learn/robust/earlier_window.h"
#include "core/learn/robust/frame_memory.h"
#include "core/learn/robust/light.h"
#include "core/learn/robust/light_curve.h"
#include "core/learn/robust/median_picture.h"
#include "core/learn/robust/solve_history.h"
#include "core/learn/robust/stable_frames.h"
#include "core/passes/fill.h"

namespace qdmd {

// Owns the rooms that solves work in, and what the newest one found.
class WindowSolve {
 public:
  explicit WindowSolve(const RobustContext& context) : context_(context) {}
  // Takes the memory of windows of the context's room.
  void begin();
  // Of the modes' inner products: after the context's step has changed.
  void resize_samples();
  // Frames that a start compares at most, of the window and remembered ones; and a picture of
  // earlier windows.
  static uint64_t most_looks(const RobustContext& context, int window_size, Models models);
  static int remembered_frames(const RobustContext& context, int window_size, Models models);
  // What begin() takes; and what solve() takes for a moment.
  static uint64_t bytes(const RobustContext& context, int window_size, Models models, int threads);
  static uint64_t scratch_bytes(const RobustContext& context, int window_size, Models models,
                                int threads);

  // What was known before. Where the window shows another scene, it is forgotten.
  struct Known {
    EarlierWindow* earlier;
    FrameMemory* memory;
    SolveHistory* history;
  };
  // Makes `model` the background of a window, whose first snapshot is frame `first` of the stream.
  // Returns what its decomposition found.
  DmdSummary solve(const SnapshotRange& window, int64_t first, const Known& known,
                   BackgroundModel* model);

  // ---- What the newest solve found ----

  const ReferencePicture& reference() const { return reference_; }
  // Quarters of a level, mean of 5 x 5.
  const std::vector<uint8_t>& spread() const { return spread_; }
  const StableFrames& stable() const { return stable_; }
  // False for a frame that says nothing of the background: something disturbed it, or frames next
  // to it.
  bool is_shown(int64_t number) const;
  // How many frames its start compared.
  int start_frames() const { return start_frames_; }
  // The gains of all frames of the window, over picture `at` of `background`.
  std::vector<Gain> gains_of_frames(const GridFrames& background, int at);
  // Writes what masks that users see take for foreground at least: a level of each pixel.
  void write_limits(uint8_t* limits);

 private:
  struct Span {
    SnapshotRange all, snapshots;  // every stride-th is a snapshot of the decomposition
    int64_t first;
    int stride;
    int64_t number(int snapshot) const { return first + int64_t{stride} * snapshot; }
  };
  // What a start compares, in time order: remembered frames, those of the window, and last, where
  // it is known, the earlier background.
  struct Looks {
    int old = 0, count = 0;  // frames that are remembered, and all
    std::vector<LitPicture> pictures;
    std::vector<const float*> cells;
    std::vector<LightCurve> curves;  // from their light to unit light
    std::vector<int64_t> numbers;    // of the frames
    std::vector<int> snapshots;      // of the window
    Recollection recollection;
    GridFrames median;  // of the window's frames, in unit light; where anybody asks for it
  };
  Looks gather(const Known& known);
  void start(const Known& known);
  void choose_shown(const Known& known, int old);
  bool leave_out_disturbed(const WindowLight& light, const GridFrames& median);
  GridPictures cells_of_shown() const;
  bool is_black(int slot) const;
  void carry_gains();
  Gain light_of_earlier(const EarlierWindow& earlier, const GridFrames& here) const;
  bool has_ends(const EarlierWindow& earlier, const Gain& of_earlier, const GridFrames& here) const;
  void take_unit_of(const GridFrames& earlier, const Gain& gain, GridFrames* here);
  void unclip(const float* shown, const GridFrames& median, const Gain& gain, float* out) const;
  void prefer_darker(const Looks& looks, const GridPictures& chosen);
  void find_brightest();
  void fill_ends(int snapshot, uint8_t* bits) const;
  void take_background(const Looks& looks, const EarlierWindow& earlier);
  void find_curves(Looks* looks) const;
  void choose_curves(const Looks& looks);
  void follow_curves(const Looks& looks);
  void bend(size_t cell, const LightCurve& curve);
  void recall_spread(const EarlierWindow& earlier, std::vector<uint8_t>* spread) const;
  SampleLight light(int snapshot) const {
    return {gains_[static_cast<size_t>(snapshot)], context_.range()};
  }
  void refine_light();
  void ask_for_samples(const SnapshotRange& snapshots, int index) const;
  void refine_gains(const SnapshotRange& snapshots, const std::vector<int>& frames,
                    std::vector<Gain>* gains);
  void find_foreground(const SolveHistory& history);
  void take_out_rejected(int snapshot, uint8_t* bits) const;
  Decomposition decompose_filled();
  template <typename Sample>
  void combine(BackgroundModel* model);
  void take_reference(BackgroundModel* model, double t);
  // Calls work(first, count) for runs of all pixels, at most kMaxRun each, on the pool's threads.
  template <typename Work>
  void in_runs(const Work& work) {
    context_.room.pool->run((context_.pixels() + kMaxRun - 1) / kMaxRun, [&](size_t part) {
      const size_t first = part * kMaxRun;
      work(first, std::min(kMaxRun, context_.pixels() - first));
    });
  }

  const RobustContext& context_;
  std::optional<Span> window_;
  int start_frames_ = 0;
  std::vector<int> compared_;  // the snapshots of them, in order
  StableFrames stable_;
  StableFramesRoom stable_room_;
  ReferencePicture reference_;
  std::vector<uint8_t> spread_, reach_;
  std::vector<uint8_t> brightest_;  // of R, G and B of the background, where samples are others
  std::vector<Gain> gains_;         // of the snapshots
  std::vector<int> shown_;          // the snapshots that show the scene, in order
  bool any_black_ = false;          // some of the others are black
  bool clips_ = false;              // WindowLight::clips
  WindowMask mask_;                 // of the snapshots
  Window samples_;                  // filled
  SlidingGram gram_;
};

}  // namespace qdmd
