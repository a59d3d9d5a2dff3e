// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/align/restorer.h"

#include <algorithm>

namespace qdmd {

Restorer::Restorer(int width, int height, int depth)
    : width_(width), height_(height), depth_(depth) {
  const auto make = [this](int planes) {
    return std::make_unique_for_overwrite<uint8_t[]>(static_cast<size_t>(planes) * pixels());
  };
  canvas_ = make(kChannels * sample_bytes(depth));
  level_ = make(kChannels * sample_bytes(depth));
  mask_ = make(1);
  shaded_ = make(1);
}

uint64_t Restorer::bytes(int width, int height, int depth) {
  return static_cast<uint64_t>(2 * kChannels * sample_bytes(depth) + 2) *
         static_cast<uint64_t>(width) * static_cast<uint64_t>(height);
}

void Restorer::write_canvas(const BackgroundModel& model, size_t pixels, Pool* pool) {
  const MutableSamples out[3] = {samples(canvas_, 0), samples(canvas_, 1), samples(canvas_, 2)};
  model.evaluate_all(pixels, out, pool);
}

void Restorer::restore_level(const Pose& pose, const Samples frame[3], Resampler* resampler,
                             Pool* pool) {
  resampler->prepare(pool);
  const Affine place = affine(pose, middle_of(width_, height_));
  for (int c = 0; c < kChannels; ++c) {
    copy_samples(frame[c], pixels(), samples(level_, c));
    resampler->run(samples(canvas_, c), depth_, place, samples(level_, c), width_, height_, pool);
  }
}

uint8_t* Restorer::restore(const Pose& pose, const uint8_t* mask, bool hard, Resampler* resampler,
                           Pool* pool, uint8_t* out) const {
  resampler->prepare(pool);
  std::fill_n(out, pixels(), uint8_t{0});
  resampler->run(mask, 8, affine(pose, middle_of(width_, height_)), out, width_, height_, pool);
  if (hard)
    for (size_t p = 0; p < pixels(); ++p) out[p] = out[p] >= 128 ? 255 : 0;
  return out;
}

}  // namespace qdmd
