// SPDX-License-Identifier: LGPL-2.1-or-later
// Pictures of the frames' own size, of what was found in a smaller one.
#pragma once

#include <cstdint>
#include <memory>

#include "core/base/channels.h"
#include "core/base/ignored_areas.h"
#include "core/base/reduction.h"
#include "core/foreground/picture.h"
#include "core/parallel/pool.h"

namespace qdmd {

// All pixels that one of the smaller picture stands for are like it, but for masks. Where something
// covers a part of a pixel at its edge, that pixel differs from L by a part of what others do: the
// edge of a hard mask is half-way up (edge_row). That of a soft mask fades between the middles of
// pixels.
class Enlarger {
 public:
  // depth: bits of the frames' samples. Takes all memory, whose pages are touched once they are
  // used: by hard masks one byte a pixel.
  Enlarger(const Reduction& size, int depth);
  static uint64_t bytes(const Reduction& size, int depth);

  const Reduction& size() const { return size_; }
  // Where masks are black, in pixels of the frames.
  void set_ignored(const IgnoredAreas& ignored) { ignored_ = ignored; }

  // All that the task's picture is made of becomes as large as the frames. Good until the next
  // call. A hard mask's edge is looked for in the task's x and L, if it has L. pool may be null.
  void enlarge(OutputTask* task, Pool* pool);
  // Room for a byte for each pixel of the smaller picture, until the next call of enlarge().
  uint8_t* room() { return small_level_.get(); }
  // out: of the frames' size. The smaller picture's samples.
  void repeat(const uint8_t* samples, uint8_t* out, Pool* pool) const {
    repeat(samples, static_cast<size_t>(size_.small_width()), out, pool);
  }

 private:
  void find_edges(const OutputTask& task, Pool* pool);
  struct Block;
  template <typename Visit>
  void for_blocks(Visit visit) const;
  bool is_near(const uint8_t* mask, int row, const Block& block) const;
  void find_edge(const uint8_t* mask, int row);
  void cut_residual(const OutputTask& task, int row, const Block& block);
  void fade(const uint8_t* mask, uint8_t* out, Pool* pool) const;
  void repeat(const uint8_t* samples, size_t stride, uint8_t* out, Pool* pool) const;
  MutableSamples repeat(Samples samples, size_t stride, MutableSamples out, Pool* pool) const;

  using Memory = std::unique_ptr<uint8_t[]>;
  MutableSamples plane(const Memory& planes, size_t channel, size_t pixels) const {
    return samples_in(planes.get(), kChannels * pixels, depth_) + channel * pixels;
  }

  Reduction size_;
  int depth_;
  IgnoredAreas ignored_;
  // Residuals in the mask, and the mask, with a sample more at both ends of rows; and what is
  // means around each pixel.
  size_t padded_width() const { return static_cast<size_t>(size_.small_width()) + 2; }
  uint8_t* padded(const Memory& plane, int row) const {
    return plane.get() + static_cast<size_t>(row) * padded_width() + 1;
  }
  Memory residual_, padded_mask_, means_;
  Memory mask_, shaded_, alpha_, frame_, level_, small_level_;
};

}  // namespace qdmd
