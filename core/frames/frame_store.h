// SPDX-License-Identifier: LGPL-2.1-or-later
// A window's frames, with all that belongs to a frame.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/align/pose.h"
#include "core/align/resampler.h"
#include "core/base/image_view.h"
#include "core/passes/grid.h"
#include "core/passes/rgb_colours.h"
#include "core/planes/snapshot_range.h"

namespace qdmd {

// What is kept of each frame beside its planes.
struct FrameContents {
  int sample_step = 1;  // every k-th pixel in x and y once more, side by side; 1: none
  int cells_along = 0;  // means over the cells of a grid, so many along the short side; 0: none
  // Pixels that share a sample of channels 1 and 2 in all frames (ChromaShape): such samples are
  // kept once. 1: whatever frames share, each pixel has its own.
  int chroma_columns = 1, chroma_rows = 1;
  int depth = 8;         // bits of the frames' samples, 8 to 16. Cells are of the highest eight
  int first_sample = 0;  // the row that has the first sample of sample_step
  RgbColours rgb = {};
};

// The newest `capacity` frames of width x height pixels: planes, samples, cells, alpha. Everything
// of a frame is in the slot that append() names.
class FrameStore {
 public:
  FrameStore() = default;
  // Takes all memory but that for alpha that varies, which append() may take once, `most_bytes` in
  // all at most. file: of plane_bytes(), where the planes lie then; or nothing. Throws
  // std::bad_alloc.
  FrameStore(int capacity, int width, int height, const FrameContents& contents,
             uint64_t most_bytes = UINT64_MAX, PageFile file = {});

  // The bytes that such a store takes, without alpha that varies; and those of its planes.
  static uint64_t bytes(int capacity, int width, int height, const FrameContents& contents);
  static uint64_t plane_bytes(int capacity, int width, int height, const FrameContents& contents);
  // The bytes of memory that it has taken.
  uint64_t bytes() const;
  // These, and those of alpha that varies.
  uint64_t bytes_with_alpha() const { return bytes() + (alpha_ ? 0 : alpha_bytes()); }

  // Takes a copy of the frame, in place of the oldest where the store is full. Where samples are
  // kept once, the frame's pixels share them. False: its alpha varies, which needs more than
  // `most_bytes`. Throws std::bad_alloc. The newest frame is then undefined. pool may be null.
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
  int height() const { return height_; }
  int capacity() const { return planes_.capacity(); }
  // Frames held, in the order in which they came.
  const Window& window() const { return planes_; }
  int size() const { return planes_.size(); }
  int slot(int index) const { return planes_.slot(index); }
  // Since it was made, those that it no longer holds included.
  uint64_t frames_taken() const { return frames_taken_; }

  int depth() const { return planes_.depth(); }
  // By slot. Every sample_step-th pixel in x and y: the planes themselves where the step is 1.
  const PlaneSlots& samples() const { return sample_step_ > 1 ? samples_ : planes_; }
  const Grid& grid() const { return grid_; }
  const GridFrames& cells() const { return cells_; }
  // Samples of alpha in row order, or none where all are constant_alpha(), which is in units of the
  // lowest bit.
  Samples alpha(int slot) const;
  uint16_t constant_alpha(int slot) const;
  // Where the frame's camera looked; and, where that is not at rest, its planes as they came.
  const Pose& pose(int slot) const { return poses_[static_cast<size_t>(slot)]; }
  Samples untouched(int slot, int channel) const { return untouched_.samples(slot, channel); }

 private:
  size_t count() const { return static_cast<size_t>(capacity()); }
  uint64_t alpha_bytes() const {
    return static_cast<size_t>(sample_bytes(depth())) * count() * planes_.pixels();
  }
  MutableSamples alpha_of(int slot) const {
    const size_t pixels = planes_.pixels();
    return samples_in(alpha_.get(), count() * pixels, depth()) + static_cast<size_t>(slot) * pixels;
  }
  MutableSamples constant_of(int slot) {
    return samples_in(constant_alpha_.data(), count(), depth()) + static_cast<size_t>(slot);
  }
  void take_constant_alpha(int slot, const ImageView& frame);
  bool keep_alpha(int slot, const ImageView& frame);
  bool take_planes(int slot, const ImageView& frame, Pool* pool);
  bool is_constant_deep_alpha(int slot, const ImageView& frame);
  void take_contents(int slot, Pool* pool);
  bool unshare(uint64_t beside);

  int width_ = 0, height_ = 0, sample_step_ = 1, first_sample_ = 0;
  uint64_t most_bytes_ = UINT64_MAX, frames_taken_ = 0;
  RgbColours rgb_;
  Window planes_;
  PlaneSlots samples_;

  Grid grid_;
  GridFrames cells_;
  // Chroma of the newest frame, a sample for each pixel, where something is made of it.
  std::vector<uint8_t> spread_;
  // Video with alpha is nearly always opaque: its planes are kept only once one varies.
  std::unique_ptr<uint8_t[]> alpha_;
  std::vector<uint8_t> constant_alpha_, varies_;
  // Cameras nearly always stand still: their planes are kept twice only once one moves.
  PlaneSlots untouched_;
  std::vector<Pose> poses_;
};

}  // namespace qdmd
