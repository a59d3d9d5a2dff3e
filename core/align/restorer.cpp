#include "core/align/restorer.h"

#include <algorithm>

namespace qdmd {

Restorer::Restorer(int width, int height) : width_(width), height_(height) {
  const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  for (auto* planes : {&canvas_, &level_})
    for (auto& plane : *planes) plane.resize(pixels);
  mask_.resize(pixels);
  shaded_.resize(pixels);
}

uint64_t Restorer::bytes(int width, int height) {
  return (2 * kChannels + 2) * static_cast<uint64_t>(width) * static_cast<uint64_t>(height);
}

void Restorer::write_canvas(const BackgroundModel& model, size_t pixels) {
  for (size_t first = 0; first < pixels; first += kMaxRun) {
    uint8_t* const out[3] = {canvas_[0].data() + first, canvas_[1].data() + first,
                             canvas_[2].data() + first};
    model.evaluate(first, std::min(kMaxRun, pixels - first), out);
  }
}

void Restorer::restore_level(const Pose& pose, const uint8_t* const frame[3], Resampler* resampler,
                             Pool* pool) {
  resampler->prepare(pool);
  const Affine place = affine(pose, middle_of(width_, height_));
  for (size_t c = 0; c < kChannels; ++c) {
    std::copy_n(frame[c], level_[c].size(), level_[c].data());
    resampler->run(canvas_[c].data(), place, level_[c].data(), width_, height_, pool);
  }
}

uint8_t* Restorer::restore(const Pose& pose, const uint8_t* mask, bool hard, Resampler* resampler,
                           Pool* pool, std::vector<uint8_t>* out) {
  resampler->prepare(pool);
  std::fill(out->begin(), out->end(), uint8_t{0});
  resampler->run(mask, affine(pose, middle_of(width_, height_)), out->data(), width_, height_,
                 pool);
  if (hard)
    for (uint8_t& sample : *out) sample = sample >= 128 ? 255 : 0;
  return out->data();
}

}  // namespace qdmd
