#include "core/align/restorer.h"

#include <algorithm>

namespace qdmd {

Restorer::Restorer(int width, int height, int low_bits)
    : width_(width), height_(height), low_bits_(low_bits) {
  const auto make = [this](Plane* plane) {
    *plane = std::make_unique_for_overwrite<uint8_t[]>(pixels());
  };
  for (auto* planes : {&canvas_, &level_})
    for (Plane& plane : *planes) make(&plane);
  for (auto* planes : {&canvas_low_, &level_low_})
    for (Plane& plane : *planes)
      if (low_bits > 0) make(&plane);
  make(&mask_);
  make(&shaded_);
}

uint64_t Restorer::bytes(int width, int height, bool deep) {
  return ((deep ? 4 : 2) * kChannels + 2) * static_cast<uint64_t>(width) *
         static_cast<uint64_t>(height);
}

void Restorer::write_canvas(const BackgroundModel& model, size_t pixels, Pool* pool) {
  const auto write = [&](size_t run) {
    const size_t first = run * kMaxRun, count = std::min(kMaxRun, pixels - first);
    uint8_t* const out[3] = {canvas_[0].get() + first, canvas_[1].get() + first,
                             canvas_[2].get() + first};
    if (low_bits_ == 0) {
      model.evaluate(first, count, out);
      return;
    }
    uint8_t* const low[3] = {canvas_low_[0].get() + first, canvas_low_[1].get() + first,
                             canvas_low_[2].get() + first};
    model.evaluate_digits(first, count, out, low);
  };
  const size_t runs = (pixels + kMaxRun - 1) / kMaxRun;
  if (pool)
    pool->run(runs, write);
  else
    for (size_t run = 0; run < runs; ++run) write(run);
}

void Restorer::restore_level(const Pose& pose, const uint8_t* const frame[3],
                             const uint8_t* const low[3], Resampler* resampler, Pool* pool) {
  resampler->prepare(pool);
  const Affine place = affine(pose, middle_of(width_, height_));
  for (size_t c = 0; c < kChannels; ++c) {
    std::copy_n(frame[c], pixels(), level_[c].get());
    if (low_bits_ > 0) std::copy_n(low[c], pixels(), level_low_[c].get());
    resampler->run_deep(canvas_[c].get(), canvas_low_[c].get(), low_bits_, place, level_[c].get(),
                        level_low_[c].get(), width_, height_, pool);
  }
}

uint8_t* Restorer::restore(const Pose& pose, const uint8_t* mask, bool hard, Resampler* resampler,
                           Pool* pool, uint8_t* out) const {
  resampler->prepare(pool);
  std::fill_n(out, pixels(), uint8_t{0});
  resampler->run(mask, affine(pose, middle_of(width_, height_)), out, width_, height_, pool);
  if (hard)
    for (size_t p = 0; p < pixels(); ++p) out[p] = out[p] >= 128 ? 255 : 0;
  return out;
}

}  // namespace qdmd
