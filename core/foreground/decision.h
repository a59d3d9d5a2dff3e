// Which pixels of a stream's frames are foreground.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/foreground/ignored.h"
#include "core/foreground/moving_texture.h"
#include "core/foreground/pixel_noise.h"
#include "core/foreground/specks.h"
#include "core/model/background_model.h"
#include "core/model/learnt.h"
#include "core/parallel/pool.h"

namespace qdmd {

// What becomes of the background in another light.
enum class Shadows {
  background,  // it is background
  foreground,  // nothing is known of light
  marked       // background, and 127 in a picture of the mask
};

// A frame and what it is compared with.
struct Comparison {
  const uint8_t* x[3];              // the frame's planes
  const BackgroundModel* model;     // at the frame's time
  double threshold = 0;             // quaternion norm in levels above which a pixel differs
  const uint8_t* limits = nullptr;  // the same of each pixel, where that is more; or null
  // Somebody asked for this threshold: it holds in textures that move, too.
  bool fixed = false;
  // Where all is background, whatever the frame shows, and nothing is learnt from it; or null.
  const IgnoredAreas* ignored = nullptr;
};

// Steps that can be left out, to see what they are worth (docs/masks.md); users have no say in it.
struct DecisionSteps {
  bool smooth = true;   // means of 3 x 3 pixels where there is much noise
  bool noise = true;    // PixelNoise
  bool texture = true;  // MovingTexture
  bool light = true;    // find_shaded
  bool vote = true;
  bool specks = true;  // Specks; only after a vote
};

// A pixel that differs from L is foreground unless
//   - it is L in another light (find_shaded; see Shadows; not in grey pictures),
//   - it is hardly further from L than it is all the time (PixelNoise),
//   - it is in a texture that moves (MovingTexture), and as near as ever to the background next to
//     it,
//   - most of the pixels around it are background (vote_row), which makes a background pixel
//     foreground, too,
//   - it belongs to a part that is too small; holes that are too small are foreground (Specks).
// In much noise, means of 3 x 3 pixels are compared. Learns from the frames that it decides, which
// come in the stream's order.
class Decision {
 public:
  // Takes all memory. For frames of width x height pixels of these colours.
  Decision(int width, int height, Colours colours, const DecisionSteps& steps = {});
  static uint64_t bytes(int width, int height);

  // The next frame is of another stream.
  void forget();
  void set_shadows(Shadows shadows) { shadows_ = shadows; }
  Shadows shadows() const { return shadows_; }
  // True where no frame was decided since forget().
  bool new_born() const { return frames_ == 0; }

  // Decides the next frame: what follows is about it. pool: or null. Results do not depend on it.
  void decide(const Comparison& frame, Pool* pool);
  // 255 where foreground, else 0; width * height samples in row order.
  const uint8_t* mask() const { return mask_.data(); }
  // The same where shadows are marked: 255 where light alone differs.
  const uint8_t* shaded() const { return shadows_ == Shadows::marked ? shaded_.data() : nullptr; }
  // L of a row in that frame, 3 planes.
  void level(int y, const uint8_t* out[3]) const;

 private:
  // Pixels left .. left + count - 1 of a row.
  struct Run;
  template <int kReach, int kMost>
  struct Around;

  // Rows are `stride_` samples apart and have `margin_` samples more on both sides.
  size_t offset(int y) const {
    return static_cast<size_t>(y) * stride_ + static_cast<size_t>(margin_);
  }
  uint8_t* level_row(int channel, int y) { return level_[channel].data() + offset(y); }
  uint8_t* differing_row(int y) { return differing_.data() + offset(y); }
  uint8_t* foreground_row(int y) { return foreground_.data() + offset(y); }
  bool moves(size_t cell, const Comparison& frame) const;
  // Steps of a frame; threads have rows of their own.
  void compare(const Comparison& frame, int first_row, int row_count);
  void compare_means(const Comparison& frame, int first_row, int row_count);
  void explain(const Comparison& frame, int grid_row);
  void explain_span(const Comparison& frame, int y, int grid_row, int first, int last);
  void look_at(const Comparison& frame, Run* run);
  void look_around(const Comparison& frame, Run* run);
  void leave_shadows(const Comparison& frame, const Run& run, int count);
  void vote(int first_row, int row_count);
  void learn(const Comparison& frame, int first_row, int row_count);
  // Samples in the margins.
  void repeat_border(uint8_t* row) const;

  int width_, height_, step_, margin_, reach_;
  size_t stride_;
  DecisionSteps steps_;
  Shadows shadows_ = Shadows::background;
  // Samples without light. Grey pixels all have one colour: light cannot be told from things.
  uint8_t black_[3] = {0, 0, 0};
  bool knows_light_;
  MovingTexture texture_;
  PixelNoise noise_;
  Specks specks_;
  int64_t frames_ = 0;
  // Of the frame: means are compared, and what they must exceed.
  bool noisy_ = false;
  double threshold_ = 0;
  // Of the frame: L, what differs from it, and what is foreground before and after the vote.
  std::vector<uint8_t> level_[3], differing_, foreground_, mask_, shaded_;
};

// A pixel of a mask is overruled where three fifths of those at most so many rows and columns from
// it are the other: 2, less in pictures whose short side is below 240 pixels, 0 (it decides alone)
// below 120. Compression, and noise near the threshold, leave specks and holes of single pixels;
// what is as narrow as they are goes with them.
int voting_reach(int width, int height);

}  // namespace qdmd
