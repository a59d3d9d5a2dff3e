// From a window's frames to a model of their background, in pieces.
#pragma once

#include <optional>

#include "core/background/background_model.h"
#include "core/background/effort.h"
#include "core/background/foreground.h"
#include "core/background/robust/robust_solver.h"
#include "core/dmd/options.h"
#include "core/gram/gram.h"

namespace qdmd {

// About the newest solve.
struct SolveReport {
  DmdSummary dmd;
  ForegroundStatistics foreground;
  int window_frames = 0;
  int sample_step = 1;  // the decomposition saw every k-th pixel in x and y
  int iterations = 1;
  // Seconds in the Gram matrix since the solve before, and in the decomposition, which for
  // Method::robust has all of it.
  double gram_time = 0, solve_time = 0;
  SolveCost cost;  // of Method::robust: its parts
};

// The steps of a solve: add_to_gram() for groups of frames, each in slices of pixels; decompose();
// build() in slices of pixels; finish(). One step at a time, from any thread; `pool`'s threads
// help. publish() then makes model() and report() the new ones: whoever evaluates the model calls
// it.
class WindowSolver {
 public:
  WindowSolver() = default;
  // For windows of `capacity` frames of width x height pixels, of which the decomposition sees
  // every sample_step-th in x and y. keep_pictures: the model outlives its window's frames.
  WindowSolver(const DmdOptions& options, int iterations, int capacity, int width, int height,
               int sample_step, bool keep_pictures, Pool* pool);

  // Bytes that the sampled pixels take beside the window: none where all are seen.
  static uint64_t sample_bytes(int capacity, int width, int height, int sample_step);

  // Takes in the frame that was just appended to `window`.
  void append(const Window& window);
  // Forgets all frames.
  void clear();
  // Forgets what earlier windows showed of the background.
  void forget() { robust_.forget(); }

  // Slice `index` of `count` of the inner products of the newest `frames` snapshots of `span` with
  // all of `span`. Slices of a group come in order.
  void add_to_gram(const SnapshotRange& span, int frames, int index = 0, int count = 1);
  // Once the Gram matrix has all snapshots. They stay as they are until build() and finish() are
  // done and, unless pictures are kept, until the next solve. What is finished and not yet
  // published stays, too.
  void decompose(const SnapshotRange& snapshots);
  // Slice `index` of `count` of the modes' pictures; slices come in order, then finish().
  void build(int index = 0, int count = 1);
  // The foreground's statistics.
  void finish(double fixed_threshold);
  void publish();

  // Of the solves to come, where the method is robust: at most the iterations and samples that it
  // was made for. While no solve is under way.
  void set_effort(const Effort& effort);

  // True where follow_light() does something: the method follows the light of each frame.
  bool follows_light() const { return robust(); }
  // Sets the model to the light of the frame in `slot` of the window.
  void follow_light(int slot);

  // Of the newest published solve.
  BackgroundModel& model() { return models_[newest_]; }
  SolveReport& report() { return report_; }
  const SolveReport& report() const { return report_; }

 private:
  int next() const { return keep_pictures_ ? 1 - newest_ : newest_; }

  bool robust() const { return options_.method == Method::robust; }

  DmdOptions options_;
  int width_ = 0, height_ = 0, sample_step_ = 1, iterations_ = 1;
  bool keep_pictures_ = false;
  Pool* pool_ = nullptr;
  Window samples_;
  SlidingGram gram_;
  RobustSolver robust_;
  double gram_seconds_ = 0;
  int appended_ = 0;  // frames since the newest decompose()
  float fresh_ = 1;   // their share of its snapshots
  // Of the newest decompose().
  std::optional<SnapshotRange> snapshots_;
  TemporalModel background_;
  SolveReport decomposed_;
  // Where pictures are kept, one is evaluated while the next is built.
  BackgroundModel models_[2];
  int newest_ = 0;
  SolveReport report_, next_report_;
};

}  // namespace qdmd
