// Robust Q-DMD: the background modes of a window whose foreground was taken out.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "core/dmd/decompose.h"
#include "core/gram/gram.h"
#include "core/learn/learner.h"
#include "core/learn/robust/absorbed.h"
#include "core/learn/robust/earlier_window.h"
#include "core/learn/robust/frame_memory.h"
#include "core/learn/robust/light.h"
#include "core/learn/robust/look_ahead.h"
#include "core/learn/robust/scene_watch.h"
#include "core/learn/robust/stable_frames.h"
#include "core/learn/robust/standing_looks.h"
#include "core/passes/fill.h"

namespace qdmd {

// What docs/robust.md measures other values of; users have no say in it.
struct RobustParameters {
  int cells_along = kCellsAlong;  // of the grid, along the short side
  // Frames that the start compares, at most: more cost time and say little new.
  int start_frames = 160;
  // A solve takes out what is above least_threshold, and above so many spreads of the frames that
  // show the pixel's background. What differs by less is mostly a shadow or a change of light, and
  // the mean of such samples is nearer to the background than what few frames show.
  int least_threshold = 26;
  int spreads = 4;
  // The least threshold of masks that users see: there, what differs a little may be somebody.
  int least_limit = 12;
  // Samples within half a spread of the background, at least so many levels, count in full.
  int least_reach = 2;
  // What an earlier window's background counts at most, in start frames of this one; 0: windows
  // know nothing of each other.
  float earlier_share = 0.5f;
  // Frames that are kept once they have left the window, as a share of those of it that a solve
  // looks at (mode=live: of all, some of which the next window still has), but not more than half
  // of the start frames.
  float remembered_share = 0.5f;
};

// The paper ends with the wish to combine Q-DMD with sparse methods; this is such a combination.
//   start    for each region the frames that show its background (find_stable_frames), and their
//            median: a background picture and its spread
//   repeat   what differs from the picture is foreground (find_mask) and becomes background
//            (Filler); Q-DMD of the filled window, of rank 1 unless another is asked for, with
//            amplitudes fitted to all frames, is the next background
// Where samples have more than 8 bits, the start, masks and inner products see the highest eight;
// what is filled and combined last has all bits.
// Global changes of light are divided out before and put back in L(t). Inner products are taken
// from sampled pixels, exactly; the pictures of the modes are combined from all.
class RobustLearner : public Learner {
 public:
  RobustLearner(const LearnOptions& options, int width, const Band& band,
                const RobustParameters& parameters = {});

  // Pixels of a band's background depend on rows so far from them.
  static int reach(const LearnOptions& options) { return kMaskReach * options.iterations; }

  FrameContents contents() const override {
    FrameContents contents = {1, parameters_.cells_along, 1, 1, options_.depth};
    if (options_.keeps_shared()) {
      contents.chroma_columns = options_.chroma_columns;
      contents.chroma_rows = options_.chroma_rows;
    }
    return contents;
  }
  std::vector<int> sample_steps() const override;
  bool in_one_piece() const override { return true; }
  uint64_t bytes(int window_size, int capacity, Models models, int threads) const override;
  bool may_read_frames(int) const override { return false; }
  uint64_t bytes_to_unshare() const override {
    return FrameMemory::bytes_to_unshare(remembered_frames(room_.window_size, room_.models),
                                         shape());
  }
  double solve_seconds(int window_size, Models models) const override;
  uint64_t solver_bytes(int window_size) const override;

  void begin(const LearnerRoom& room) override;
  void forget() override;
  void remember(Learnt* learnt) const override;
  void recall(const Learnt& learnt) override;
  bool makes_limits() const override { return true; }
  void set_sample_step(int step) override;
  void add(const SnapshotRange&, int, Slice) override {}
  void decompose(const SnapshotRange& snapshots) override;
  void build(Slice slice, BackgroundModel* model) override;
  SolveFacts facts() const override { return facts_; }
  int enough() const override { return 1 + std::min(calm_, kMostCalm); }
  void publish() override;

  void mend(const Compared& frame, BackgroundModel* model) override;
  void look_ahead(const Compared& frame, BackgroundModel* model) override;
  void set_absorb_frames(int64_t frames) override { absorb_frames_ = frames; }

  SceneSeen scene_of(int slot) override;
  void begin_scene() override;

  bool follows_light() const override { return true; }
  void follow(const std::vector<uint8_t> level[kChannels]) override;
  Gain light(int slot) override {
    return light_over(room_.frames->cells(), slot, background_cells_, published_, &light_scratch_);
  }

 private:
  size_t pixels() const { return reference_.pixels(); }
  // The shape of kept frames.
  ChromaShape shape() const {
    const FrameContents contents = this->contents();
    return {reference_.width, reference_.height, contents.chroma_columns, contents.chroma_rows};
  }
  size_t samples_at(int step) const;
  SampledRows sampled_rows() const;
  int remembered_frames(int window_size, Models models) const;
  // Windows that know nothing of each other are given nothing of each other.
  bool looks_ahead(Models models) const {
    return models != Models::two_of_live && parameters_.earlier_share > 0;
  }
  uint64_t most_looks(int window_size, Models models) const;
  // The number of the first snapshot, counted like FrameStore::frames_taken().
  int64_t first_number() const { return static_cast<int64_t>(frames_seen_) - snapshots_->size(); }
  void start(const SnapshotRange& snapshots);
  void refine_light(const SnapshotRange& snapshots);
  void refine_gains(const SnapshotRange& snapshots, const std::vector<int>& frames,
                    std::vector<Gain>* gains);
  void recall_spread(std::vector<uint8_t>* spread) const;
  void find_foreground(const SnapshotRange& snapshots);
  Decomposition decompose_filled(const SnapshotRange& snapshots);
  template <typename Sample>
  void combine(const SnapshotRange& snapshots, BackgroundModel* model);
  void take_reference(BackgroundModel* model, double t);
  std::vector<Gain> gains_of_frames();
  void keep_some();
  // Frames that cells of a background are taken from, each in its own light.
  struct LitFrames {
    SnapshotRange frames;
    std::array<LitSlot, kMendingFrames> at;
    std::span<const LitSlot> slots() const {
      return {at.data(), static_cast<size_t>(frames.size())};
    }
  };
  LitFrames lit_frames(const Compared& frame, const Gain& light, const BackgroundModel* of_window);
  void mend_uncovered(std::vector<int> cells, const StandingLooks& looks, const Compared& frame,
                      const Gain& light, const BackgroundModel* of_window, BackgroundModel* model);
  void mend(const std::vector<int>& cells, const StandingLooks& looks, const Compared& frame,
            const LitFrames& lit, BackgroundModel* model);
  void replace(const std::vector<int>& cells, const StandingLooks& looks, const LitFrames& lit,
               BackgroundModel* model);
  bool is_calm() const;
  void replace_deep(const std::vector<int>& cells, const LitFrames& lit,
                    BackgroundModel* model) const;
  void end(BackgroundModel* model);
  template <typename Work>
  void in_runs(const Work& work);

  // Hops that are left out between two solves, at most.
  static constexpr int kMostCalm = 3;

  LearnOptions options_;
  RobustParameters parameters_;
  Band band_;
  Grid grid_;  // of the whole picture
  int finest_step_, step_;
  LearnerRoom room_ = {};
  GridFrames background_cells_;  // of the published and the newest solve, in unit light
  int published_ = 0;
  LightScratch light_scratch_;  // of light()
  EarlierWindow earlier_;
  FrameMemory memory_;
  StandingLooks looks_;  // of the frames that were compared with the background in use
  LookAhead ahead_;      // of those that came
  int64_t absorb_frames_ = 0;
  Absorbed absorbed_, absorbed_now_;  // so far, and those that the solve knows of
  SceneWatch scene_;
  // Solves in a row that changed little, since a cell was mended.
  int calm_ = 0;
  // Another scene was seen; and solves know of it, but no background yet.
  bool other_scene_ = false, scene_begins_ = false;
  // What belongs to the newest solve: its window, the share of it that no solve before had, of
  // which every stride-th frame is a snapshot of the decomposition, frames that the start compared,
  // and what it found.
  std::optional<SnapshotRange> snapshots_;
  float fresh_ = 1;
  int stride_ = 1;
  int64_t stream_from_ = -1;  // the first frame since forget(); -1: none was solved
  uint64_t frames_seen_ = 0;  // that the store had taken by then
  int start_frames_ = 0;
  bool alone_ = false;  // no window was known before
  StableFrames stable_;
  StableFramesRoom stable_room_;
  ReferencePicture reference_;
  std::vector<uint8_t> spread_;  // quarters of a level, mean of 5 x 5
  std::vector<uint8_t> reach_;
  std::vector<Gain> gains_;  // of the snapshots
  WindowMask mask_;          // of the snapshots
  Window samples_;           // filled
  SlidingGram gram_;
  SolveFacts facts_;
};

}  // namespace qdmd
