// SPDX-License-Identifier: LGPL-2.1-or-later
// Takes the foreground out of a window: what is no background becomes background.
#pragma once

#include <vector>

#include "core/passes/mask.h"
#include "core/passes/sampling.h"
#include "core/passes/window_mask.h"
#include "core/planes/snapshot_range.h"

namespace qdmd {

// Fills runs of pixels of all snapshots. One for each thread. Sample: uint8_t, for the samples'
// highest eight bits; uint16_t for whole samples of more bits, whose medians and distances are in
// units of the lowest bit.
template <typename Sample>
class Filler {
 public:
  // Runs of up to run() pixels, a multiple of 64: they stay in the second-level cache.
  // range: what light may make of samples.
  explicit Filler(int snapshots, const SampleRange& range = {});
  static uint64_t bytes(int snapshots);
  Filler(Filler&&) = default;  // not copied: planes_ points into samples_
  size_t run() const { return run_; }

  // Pixels first .. first + count - 1 in unit light; `first` is a multiple of 64. Where a snapshot
  // is masked, it becomes the median of the pixel's other snapshots, or the reference's level where
  // there are none (for whole samples the middle of it). Others are drawn to that median until they
  // are no farther from it than `reach`: one step of Huber's estimate of the mean (Robust
  // Statistics, 1981). reach: width * height samples, or null: any distance.
  // Returns a plane of samples for each channel of each snapshot, readable up to the next multiple
  // of 64; they are good until the next call.
  const Sample* const* fill(const SnapshotRange& snapshots, const std::vector<Gain>& gains,
                            const WindowMask& mask, const ReferencePicture& reference,
                            const uint8_t* reach, size_t first, size_t count);

 private:
  void take_rows(const SnapshotRange& snapshots, const std::vector<Gain>& gains,
                 const WindowMask& mask, size_t first, size_t count);

  size_t run_;
  SampleRange range_;
  std::vector<Sample> samples_;
  std::vector<uint8_t> keep_;
  std::vector<const Sample*> planes_;
  std::vector<uint16_t> masked_;  // snapshots, of each pixel
  std::vector<uint8_t> spread_;   // a row of samples that pixels share
  std::vector<uint8_t> bits_;     // of a snapshot's mask
};

// Every step-th pixel in some rows of one frame in unit light, the reference's where it is masked,
// drawn to that as Filler does to the median: for inner products. out: ceil(width / step) samples
// of each of these rows a channel.
void fill_samples(const ReferencePicture& reference, const uint8_t* bits, const KeptPicture& x,
                  const SampleLight& light, const uint8_t* reach, const SampledRows& rows,
                  uint8_t* const out[3]);

}  // namespace qdmd
