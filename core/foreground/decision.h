// SPDX-License-Identifier: LGPL-2.1-or-later
// Which pixels of a stream's frames are foreground.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/colours.h"
#include "core/base/ignored_areas.h"
#include "core/base/large_vector.h"
#include "core/base/levels.h"
#include "core/foreground/compared_planes.h"
#include "core/foreground/decision_steps.h"
#include "core/foreground/flat_things.h"
#include "core/foreground/hard_shadows.h"
#include "core/foreground/moving_texture.h"
#include "core/foreground/overlays.h"
#include "core/foreground/pixel_noise.h"
#include "core/foreground/specks.h"
#include "core/model/background_model.h"
#include "core/parallel/pool.h"
#include "core/passes/read_samples.h"
#include "core/passes/rgb_colours.h"

namespace qdmd {

// What becomes of the background in another light.
enum class Shadows {
  background,  // it is background
  foreground,  // nothing is known of light
  marked       // background, and 127 in a picture of the mask
};

// A frame and what it is compared with.
struct Comparison {
  Samples x[3];                     // the frame's planes
  const BackgroundModel* model;     // at the frame's time
  double threshold = 0;             // quaternion norm in levels above which a pixel differs
  const uint8_t* limits = nullptr;  // the same of each pixel, where that is more; or null
  // The user set this threshold: it holds in textures that move, too.
  bool fixed = false;
  // Where all is background, whatever the frame shows, and nothing is learnt from it; or null.
  const IgnoredAreas* ignored = nullptr;
  Shadows shadows = Shadows::background;
  // What x are the planes of, if their rows are to be made; or null, if they are there.
  const PlaneRows* rows = nullptr;
};

// A pixel that differs from L is foreground unless
//   - it is L in another light (find_shaded; see Shadows; not in grey pictures: there the frame
//     before had no colour),
//   - it is hardly further from L than it is all the time (PixelNoise),
//   - it is in a texture that moves (MovingTexture), as near as ever to the background next to it,
//     and in no flat thing (FlatThings),
//   - most of the pixels around it are background (vote_row), which makes a background pixel
//     foreground, too,
//   - it belongs to a part that is too small; holes that are too small are foreground (Specks),
//   - it belongs to a region in much less light (HardShadows; as find_shaded),
//   - it is at the mask's edge, and shows less than half of what is there (fit_edges; not in grey
//     pictures),
//   - it is text that a recorder draws (Overlays).
// In much noise, means of 3 x 3 pixels are compared. Of samples of more than 8 bits a pixel's own
// distance from L is that of whole samples; means, what is around, and light are compared in the
// highest 8 bits, noise is learnt from them, and where the user's threshold is so low that these
// need not differ at all, light is not looked at. Learns from the frames that it decides, which
// come in the stream's order.
class Decision {
 public:
  // Takes all memory. For frames of that size and these colours, in which black is that of
  // `levels`.
  Decision(int width, int height, Colours colours, const DecisionSteps& steps = {},
           const Levels& levels = {});
  static uint64_t bytes(int width, int height);

  // The next frame is of another stream.
  void forget();
  // The next frame is of another scene: what was learnt of this one is kept, in place of what was
  // kept before. returns: of the scene that was left last, whose statistics are in use again. Takes
  // memory; where it throws, nothing has changed.
  void change_scene(bool returns);
  // True where no frame was decided since forget().
  bool new_born() const { return frames_ == 0; }

  // Decides the next frame; the calls below are about this frame. pool may be null. Results do not
  // depend on it.
  void decide(const Comparison& frame, Pool* pool);
  // 255 where foreground, else 0; samples in row order.
  const uint8_t* mask() const { return of_.mask.data(); }
  // A second mask where shadows are marked: 255 where light alone differs.
  const uint8_t* shaded() const {
    return now_.frame.shadows == Shadows::marked ? of_.shaded.data() : nullptr;
  }
  // L of a row in that frame, 3 planes.
  void level(int y, const uint8_t* out[3]) const;
  // From a row to the next.
  size_t level_stride() const { return shape_.stride; }

 private:
  // The pictures' shape. Rows are `stride` samples apart and have `margin` samples more on both
  // sides; the background is searched `step` pixels apart, and `reach` pixels vote.
  struct Shape {
    int width, height, step, margin, reach;
    int strips;  // of rows, each as high as what explain() sees around a row
    size_t stride;

    Shape(int width, int height, bool votes);
    size_t pixels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
    size_t padded() const { return stride * static_cast<size_t>(height); }
    // Where a row with margins begins, and one without.
    size_t offset(int y) const {
      return static_cast<size_t>(y) * stride + static_cast<size_t>(margin);
    }
    size_t first(int y) const { return static_cast<size_t>(y) * static_cast<size_t>(width); }
    // The first row of a strip; that behind the last one is the height.
    int top(int strip) const { return static_cast<int>(int64_t{height} * strip / strips); }
  };
  // A frame's L, what differs from it, and what is foreground before and after the vote; and
  // where light alone differs.
  struct Pictures {
    LargeVector<uint8_t> level[3], differing, foreground, mask, shaded;
  };
  // What is compared, and how: means or pixels, above how many levels; textures that move are
  // looked for.
  struct Now {
    Comparison frame = {};
    Pool* pool = nullptr;
    bool means = false, textures = false;
    bool whole = false;  // own distances are of all bits, more than 8 (full_depth.h)
    bool below = false;  // pixels may differ that are the same in 8 bits
    double threshold = 0;
    float light = 1;           // how much brighter the frame is than L in unit light, 1 at least
    bool level_known = false;  // L is still that of the frame before
    bool darker = false;       // a channel has less light than L in unit light
  };
  // Pixels left .. left + count - 1 of a row.
  struct Run;
  template <int kReach, int kMost>
  struct Around;
  struct Lit;

  uint8_t* level_row(int channel, int y) { return of_.level[channel].data() + shape_.offset(y); }
  uint8_t* differing_row(int y) { return of_.differing.data() + shape_.offset(y); }
  uint8_t* foreground_row(int y) { return of_.foreground.data() + shape_.offset(y); }
  const DecisionConstants& constants() const { return steps_.constants; }
  bool moves(size_t cell) const { return now_.textures && texture_.moves(cell); }
  void clear_marks();
  void take_out_specks(uint8_t colour, double share);
  void find_colour();
  // The mask's row y, or the nearest one.
  const uint8_t* mask_row(int y) const;
  void look();
  // Steps of a frame; threads have rows of their own.
  void compare(int first_row, int row_count);
  void raise_ends(size_t first, size_t count, uint8_t* const level[3]) const;
  void compare_means(int first_row, int row_count);
  void explain(int first_row, int row_count);
  void explain_run(int y, int left, int right, int grid_row);
  void look_at(Run* run);
  void look_around(Run* run);
  bool knows_light() const;
  bool much_moves() const;
  ComparedPlanes planes() const;
  void keep_flat_things();
  void leave_shadows(const Run& run);
  void leave_hard_shadows();
  void leave_edges();
  void learn(int first_row, int row_count);
  // Samples in the margins.
  void repeat_border(uint8_t* row) const;

  Shape shape_;
  DecisionSteps steps_;
  // Samples without light. Grey pixels all have one colour: light cannot be told from things.
  uint8_t black_[3];
  RgbColours rgb_;
  Colours colours_;
  bool grey_ = false;  // the newest frame is
  MovingTexture texture_;
  FlatThings flat_;
  PixelNoise noise_;
  HardShadows hard_;
  Overlays overlays_;
  struct Statistics {
    MovingTexture texture;
    FlatThings flat;
    PixelNoise noise;
    HardShadows::Known hard;
    Overlays overlays;
    int64_t frames;
  };
  std::optional<Statistics> left_;  // of the scene before
  Specks specks_;
  // By strip: itself and those beside it are counted, while a frame's are not compared yet.
  std::vector<std::atomic<int>> unknown_;
  int64_t frames_ = 0;
  uint64_t picture_ = 0;  // of the model: whose L there is
  Now now_;
  Pictures of_;
};

}  // namespace qdmd
