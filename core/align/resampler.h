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
  void run(const uint8_t* from, const Affine& place, uint8_t* to, int width, int height,
           Pool* pool);
  // As run(), for samples of more than 8 bits, high digits and low ones; low planes are null
  // where low_bits is 0.
  void run_deep(const uint8_t* from, const uint8_t* from_low, int low_bits, const Affine& place,
                uint8_t* to, uint8_t* to_low, int width, int height, Pool* pool);

 private:
  std::vector<ResampleRoom> rooms_;
};

}  // namespace qdmd
