// A window's frames, with all that belongs to a frame.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/align/pose.h"
#include "core/align/resampler.h"
#include "core/base/image_view.h"
#include "core/gram/window.h"
#include "core/parallel/band.h"
#include "core/passes/grid.h"

namespace qdmd {

// What is kept of each frame beside its planes.
struct FrameContents {
  int sample_step = 1;  // every k-th pixel in x and y once more, side by side; 1: none
  int cells_along = 0;  // means over the cells of a grid, so many along the short side; 0: none
  // Pixels that share a sample of channels 1 and 2 in all frames (ChromaShape): such samples are
  // kept once. 1: whatever frames share, each pixel has its own.
  int chroma_columns = 1, chroma_rows = 1;
  // Bits of a sample below its highest eight, 0 to 8. With some, frames come with so many: planes,
  // samples and cells are of the highest eight bits, and the bits below are kept beside planes and
  // samples, once where pixels share them.
  int low_bits = 0;
};

// The newest `capacity` frames of width x height pixels: planes, samples, cells, alpha. Everything
// of a frame is in the slot that append() names. Of a band, planes and alpha have the rows that are
// kept, samples are the own ones, and cells those of the whole picture, which members share.
class FrameStore {
 public:
  FrameStore() = default;
  // Takes all memory but that for alpha that varies, which append() may take once, `most_bytes` in
  // all at most. Throws std::bad_alloc.
  FrameStore(int capacity, int width, const Band& band, const FrameContents& contents,
             uint64_t most_bytes = UINT64_MAX);

  // The bytes that such a store takes, without alpha that varies.
  static uint64_t bytes(int capacity, int width, const Band& band, const FrameContents& contents);
  // Those that it has taken.
  uint64_t bytes() const;
  // With alpha that varies.
  uint64_t bytes_with_alpha() const { return bytes() + (alpha_ ? 0 : alpha_bytes()); }

  // Takes a copy of the frame, in place of the oldest where the store is full. Where samples are
  // kept once, the frame's pixels share them. False: its alpha
  // varies, which needs more than `most_bytes`. Throws std::bad_alloc. The newest frame is then
  // undefined. pool may be null.
  bool append(const ImageView& frame, Pool* pool = nullptr);
  // The planes, samples and cells of frame `index` become what the canvas shows of them; the planes
  // as they came stay in untouched(). What is outside of the frame is as in the frame before, or,
  // where there is none, as in this one. False, and nothing is done: there is no room
  // in `most_bytes`, for that and for `beside` bytes that others take then. Where pixels share
  // samples, those of all frames get their own first, for good. Throws std::bad_alloc.
  bool steady(int index, const Pose& pose, Resampler* resampler, Pool* pool, uint64_t beside = 0);
  // Pixels share samples: nobody may read frames while the first one is moved.
  bool shares_samples() const { return planes_.shape().is_shared(); }
  // Forgets all frames.
  void clear() { planes_.clear(); }

  int width() const { return width_; }
  int height() const { return height_; }  // rows that are kept
  const Band& band() const { return band_; }
  int capacity() const { return planes_.capacity(); }
  // Frames held, in the order in which they came.
  const Window& window() const { return planes_; }
  int size() const { return planes_.size(); }
  int slot(int index) const { return planes_.slot(index); }
  // Since it was made, those that it no longer holds included.
  uint64_t frames_taken() const { return frames_taken_; }

  // Bits below the planes' eight, and `range` of window() with them.
  int low_bits() const { return low_bits_; }
  SnapshotRange whole(const SnapshotRange& range) const { return range.with_low(low_, low_bits_); }
  // The same of samples(), once every sample_step-th pixel.
  SnapshotRange whole_samples(const SnapshotRange& range) const {
    return range.in(samples()).with_low(sample_step_ > 1 ? low_samples_ : low_, low_bits_);
  }
  // What is below the planes, where low_bits() is not 0.
  KeptPicture low_picture(int slot) const { return low_.picture(slot); }

  // By slot. Every sample_step-th pixel in x and y: the planes themselves where the step is 1.
  const PlaneSlots& samples() const { return sample_step_ > 1 ? samples_ : planes_; }
  const Grid& grid() const { return grid_; }
  // Of a band, all members call this alike: what each found since the last call becomes everybody's
  // here, so that no member waits for others with each frame.
  const GridFrames& cells() const;
  // Samples of alpha in row order, or null where all are constant_alpha().
  const uint8_t* alpha(int slot) const;
  // Where the frame's camera looked; and, where that is not at rest, its planes as they came.
  const Pose& pose(int slot) const { return poses_[static_cast<size_t>(slot)]; }
  const uint8_t* untouched(int slot, int channel) const { return untouched_.plane(slot, channel); }
  const uint8_t* untouched_low(int slot, int channel) const {
    return untouched_low_.plane(slot, channel);
  }
  uint8_t constant_alpha(int slot) const { return constant_alpha_[static_cast<size_t>(slot)]; }
  // Low digits of alpha, where low_bits() is not 0.
  const uint8_t* alpha_low(int slot) const;
  uint8_t constant_alpha_low(int slot) const {
    return constant_alpha_low_[static_cast<size_t>(slot)];
  }

 private:
  uint64_t alpha_bytes() const {
    return (low_bits_ > 0 ? 2 : 1) * static_cast<uint64_t>(capacity()) *
           static_cast<uint64_t>(planes_.pixels());
  }
  uint8_t* alpha_of(int slot) const {
    return alpha_.get() + static_cast<size_t>(slot) * planes_.pixels();
  }
  bool keep_alpha(int slot, const ImageView& frame);
  bool take_planes(int slot, const ImageView& frame, uint8_t alpha, Pool* pool);
  void take_contents(int slot, Pool* pool);
  void take_every_step(const KeptPicture& picture, int slot, PlaneSlots* samples);
  void take_deep_planes(int slot, const ImageView& frame);
  bool take_deep_alpha(int slot, const ImageView& frame);
  bool make_alpha();
  bool unshare(uint64_t beside);

  Band band_;
  int width_ = 0, height_ = 0, sample_step_ = 1, low_bits_ = 0;
  uint64_t most_bytes_ = UINT64_MAX, frames_taken_ = 0;
  Window planes_;
  PlaneSlots samples_, low_, low_samples_;
  Grid grid_;
  // Only a band's are to be shared: others do not change by being looked at.
  mutable GridFrames cells_;
  mutable std::vector<uint8_t> to_share_;
  mutable bool any_to_share_ = false;
  // Chroma of the newest frame, a sample for each pixel, where something is made of it.
  std::vector<uint8_t> spread_;
  // Video with alpha is nearly always opaque: its planes are kept only once one varies.
  std::unique_ptr<uint8_t[]> alpha_;
  std::vector<uint8_t> constant_alpha_, constant_alpha_low_, varies_;
  // Cameras nearly always stand still: their planes are kept twice only once one moves.
  PlaneSlots untouched_, untouched_low_;
  std::vector<Pose> poses_;
};

}  // namespace qdmd
