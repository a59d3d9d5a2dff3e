// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/align/resampler.h"

#include "core/passes/bands.h"

namespace qdmd {
namespace {

// Rows whose share is worth waking a thread for.
constexpr int kRowsPerBand = 64;

}  // namespace

void Resampler::run(Samples from, int depth, const Affine& place, MutableSamples to, int width,
                    int height, Pool* pool) {
  Resampling task;
  task.from = from;
  task.from_width = task.width = width;
  task.from_height = task.height = height;
  task.to = to;
  task.depth = depth;
  const auto single = [](double value) { return static_cast<float>(value); };
  task.places = {single(place.xx), single(place.xy), single(place.offset.x),
                 single(place.yx), single(place.yy), single(place.offset.y)};
  if (!pool || height < 2 * kRowsPerBand) {
    resample(task, 0, height, &rooms_[0]);
    return;
  }
  for_bands(*pool, height, height / kRowsPerBand, [&](int first, int count, size_t worker) {
    resample(task, first, count, &rooms_[worker]);
  });
}

}  // namespace qdmd
