// Robust Q-DMD: the background modes of a window whose foreground was taken out.
#pragma once

#include "core/background/background_model.h"
#include "core/background/effort.h"
#include "core/background/robust/earlier.h"
#include "core/background/robust/fill.h"
#include "core/background/robust/stable_frames.h"
#include "core/dmd/decompose.h"
#include "core/gram/gram.h"

namespace qdmd {

// What docs/robust.md measures other values of; users have no say in it.
struct RobustParameters {
  int cells_along = kCellsAlong;  // of the grid, along the short side
  // Frames that the start compares, at most: more cost time and say little new.
  int start_frames = 160;
  // A pixel is foreground above least_threshold, and above so many spreads of the frames that show
  // its background.
  int least_threshold = 12;
  int spreads = 4;
  // Samples within half a spread of the background, at least so many levels, count in full.
  int least_reach = 2;
  // What an earlier window's background counts at most, in start frames of this one; 0: windows
  // know nothing of each other.
  float earlier_share = 0.5f;
};

// The paper ends with the wish to combine Q-DMD with sparse methods; this is such a combination.
//   start    for each region the frames that show its background (find_stable_frames), and their
//            median: a background picture and its spread
//   repeat   what differs from the picture is foreground (find_mask) and becomes background
//   (Filler);
//            Q-DMD of the filled window, of rank 1 unless another is asked for, with amplitudes
//            fitted to all frames, is the next background
// Global changes of light are divided out before and put back in L(t). Inner products are taken
// from sampled pixels, exactly; the pictures of the modes are combined from all.
class RobustSolver {
 public:
  RobustSolver() = default;
  // For windows of `capacity` frames of width x height pixels. `iterations` >= 1.
  RobustSolver(const DmdOptions& options, int iterations, int sample_step, int capacity, int width,
               int height, Pool* pool, const RobustParameters& parameters = {});

  // Bytes beside the window: cells, masks, samples, pictures, and what a start compares.
  static uint64_t bytes(int capacity, int width, int height, int sample_step);

  // The step that leaves about 60 samples along the short side: more move no background
  // (docs/robust.md).
  static int chosen_step(int width, int height);

  // Takes in the frame in `slot` of `window`.
  void append(const Window& window, int slot);
  // The light of the frame in `slot` over the published background.
  Gain light(int slot) const { return light_over(cells_, slot, background_cells_, published_); }
  // From now on light() compares with the newest solve. Not while one runs.
  void publish() { published_ = 1 - published_; }
  // Forgets what earlier windows showed.
  void forget() { earlier_.forget(); }
  // Of the solves to come: at most as many samples as it was made for. Throws std::bad_alloc.
  void set_effort(int iterations, int sample_step);
  // Makes `model` the window's background. fresh: the share of the snapshots that no solve before
  // had.
  DmdSummary solve(const SnapshotRange& snapshots, float fresh, BackgroundModel* model);
  // What the newest solve took.
  const SolveCost& cost() const { return cost_; }

 private:
  void start(const SnapshotRange& snapshots);
  void refine_light(const SnapshotRange& snapshots);
  void recall_spread(std::vector<uint8_t>* spread) const;
  void find_foreground(const SnapshotRange& snapshots);
  Decomposition decompose_filled(const SnapshotRange& snapshots);
  void combine(const SnapshotRange& snapshots, BackgroundModel* model);
  void take_reference(BackgroundModel* model, double t);
  void end(float fresh, BackgroundModel* model);

  DmdOptions options_;
  RobustParameters parameters_;
  int iterations_ = 1, step_ = 1, capacity_ = 0;
  SolveCost cost_;
  Pool* pool_ = nullptr;
  Grid grid_;
  GridFrames cells_;             // by slot
  GridFrames background_cells_;  // of the published and the newest solve, in unit light
  int published_ = 0;
  Earlier earlier_;
  // Of the newest start: frames that it compared, and what it found.
  int start_frames_ = 0;
  StableFrames stable_;
  Reference reference_;
  std::vector<uint8_t> spread_;  // quarters of a level, mean of 5 x 5
  std::vector<uint8_t> reach_;
  std::vector<Gain> gains_;  // of the snapshots
  WindowMask mask_;          // of the snapshots
  Window samples_;           // filled
  SlidingGram gram_;
};

}  // namespace qdmd
