// SPDX-License-Identifier: LGPL-2.1-or-later
// From the canvas back to where a frame's camera looked.
#pragma once

#include <cstdint>
#include <memory>

#include "core/align/resampler.h"
#include "core/base/channels.h"
#include "core/model/background_model.h"

namespace qdmd {

// Pictures of one frame. What the canvas does not know of it is the frame itself, and no
// foreground.
class Restorer {
 public:
  // Takes all memory. For frames of width x height pixels; depth: bits of their samples.
  Restorer(int width, int height, int depth = 8);
  static uint64_t bytes(int width, int height, int depth = 8);

  // Takes a background's picture as it is on the canvas, which is `pixels` large. pool may be null.
  void write_canvas(const BackgroundModel& model, size_t pixels, Pool* pool);
  // The highest eight bits of it.
  const uint8_t* canvas(int channel) const { return samples(canvas_, channel).high; }
  // Makes that picture as it is seen from `pose`; frame: the frame's own planes.
  void restore_level(const Pose& pose, const Samples frame[3], Resampler* resampler, Pool* pool);
  Samples level(int channel) const { return samples(level_, channel); }

  // A mask on the canvas, of 255 and 0 where it is hard, seen from `pose`.
  uint8_t* restore_mask(const Pose& pose, const uint8_t* mask, bool hard, Resampler* resampler,
                        Pool* pool) {
    return restore(pose, mask, hard, resampler, pool, mask_.get());
  }
  // restore_mask() for a second one, which is hard.
  uint8_t* restore_shaded(const Pose& pose, const uint8_t* shaded, Resampler* resampler,
                          Pool* pool) {
    return restore(pose, shaded, true, resampler, pool, shaded_.get());
  }

 private:
  uint8_t* restore(const Pose& pose, const uint8_t* mask, bool hard, Resampler* resampler,
                   Pool* pool, uint8_t* out) const;
  size_t pixels() const { return static_cast<size_t>(width_) * static_cast<size_t>(height_); }

  // Pages are touched once they are used: most cameras stand still.
  using Planes = std::unique_ptr<uint8_t[]>;
  MutableSamples samples(const Planes& picture, int channel) const {
    return samples_in(picture.get(), kChannels * pixels(), depth_) +
           static_cast<size_t>(channel) * pixels();
  }

  int width_, height_, depth_;
  Planes canvas_, level_, mask_, shaded_;
};

}  // namespace qdmd
