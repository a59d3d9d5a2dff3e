// SPDX-License-Identifier: LGPL-2.1-or-later
// Pictures from one pose to another, by the threads that there are.
#pragma once

#include <algorithm>
#include <vector>

#include "core/align/pose.h"
#include "core/parallel/pool.h"
#include "core/passes/resample.h"

namespace qdmd {

// Keeps what threads need for it.
class Resampler {
 public:
  // Before run() with that pool, or null. May throw std::bad_alloc.
  void prepare(Pool* pool) { rooms_.resize(std::max(rooms_.size(), pool ? pool->threads() : 1)); }
  // resample() of whole pictures, both width x height: pixel p of `to` is at place(p).
  void run(Samples from, int depth, const Affine& place, MutableSamples to, int width, int height,
           Pool* pool);

 private:
  std::vector<ResampleRoom> rooms_;
};

}  // namespace qdmd
