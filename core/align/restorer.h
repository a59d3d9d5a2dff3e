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
  // Takes all memory. For frames of width x height pixels; low_bits: of samples of more than 8 bits
  // those below the highest eight.
  Restorer(int width, int height, int low_bits = 0);
  static uint64_t bytes(int width, int height, bool deep = false);

  // Takes a background's picture as it is on the canvas, which is `pixels` large. pool may be null.
  void write_canvas(const BackgroundModel& model, size_t pixels, Pool* pool);
  const uint8_t* canvas(int channel) const { return canvas_[static_cast<size_t>(channel)].get(); }
  // Makes that picture as seen from `pose`; frame, low: the frame's own planes.
  void restore_level(const Pose& pose, const uint8_t* const frame[3], const uint8_t* const low[3],
                     Resampler* resampler, Pool* pool);
  const uint8_t* level(int channel) const { return level_[static_cast<size_t>(channel)].get(); }
  // The low digits of level(), or null.
  const uint8_t* level_low(int channel) const {
    return level_low_[static_cast<size_t>(channel)].get();
  }

  // A mask on the canvas, of 255 and 0 where it is hard, seen from `pose`.
  uint8_t* restore_mask(const Pose& pose, const uint8_t* mask, bool hard, Resampler* resampler,
                        Pool* pool) {
    return restore(pose, mask, hard, resampler, pool, mask_.get());
  }
  // As restore_mask(), a second mask.
  uint8_t* restore_shaded(const Pose& pose, const uint8_t* shaded, Resampler* resampler,
                          Pool* pool) {
    return restore(pose, shaded, true, resampler, pool, shaded_.get());
  }

 private:
  uint8_t* restore(const Pose& pose, const uint8_t* mask, bool hard, Resampler* resampler,
                   Pool* pool, uint8_t* out) const;
  size_t pixels() const { return static_cast<size_t>(width_) * static_cast<size_t>(height_); }

  int width_, height_, low_bits_;
  // Pages are touched once they are used: most cameras stand still.
  using Plane = std::unique_ptr<uint8_t[]>;
  Plane canvas_[kChannels], level_[kChannels], mask_, shaded_;
  Plane canvas_low_[kChannels], level_low_[kChannels];
};

}  // namespace qdmd
