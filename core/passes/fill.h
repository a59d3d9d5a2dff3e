// Takes the foreground out of a window: what is no background becomes background.
#pragma once

#include <vector>

#include "core/gram/window.h"
#include "core/passes/mask.h"
#include "core/passes/sampling.h"
#include "core/passes/window_mask.h"

namespace qdmd {

// Fills runs of pixels of all snapshots. One for each thread.
class Filler {
 public:
  // Runs of up to run() pixels, a multiple of 64: they stay in the second-level cache.
  // deep: for fill_deep(), else for fill().
  explicit Filler(int snapshots, bool deep = false);
  static uint64_t bytes(int snapshots, bool deep = false);
  Filler(Filler&&) = default;  // not copied: planes_ points into samples_
  size_t run() const { return run_; }

  // Pixels first .. first + count - 1 in unit light; `first` is a multiple of 64. Where a snapshot
  // is masked, it becomes the median of the pixel's other snapshots, or the reference's level where
  // there are none. Others are
  // drawn to that median until they are no farther from it than `reach`: one step of Huber's
  // estimate of the mean (Robust Statistics, 1981). reach: width * height samples, or null: any
  // distance.
  // Returns a plane of samples for each channel of each snapshot, readable up to the next multiple
  // of 64; they are good until the next call.
  const uint8_t* const* fill(const SnapshotRange& snapshots, const std::vector<Gain>& gains,
                             const WindowMask& mask, const ReferencePicture& reference,
                             const uint8_t* reach, size_t first, size_t count);
  // The same of snapshots with low digits: whole samples, their medians and distances, in units of
  // the lowest bit. Where there are no others, the middle of the reference's level.
  const uint16_t* const* fill_deep(const SnapshotRange& snapshots, const std::vector<Gain>& gains,
                                   const WindowMask& mask, const ReferencePicture& reference,
                                   const uint8_t* reach, size_t first, size_t count);

 private:
  template <typename T>
  void list_rows(size_t planes, std::vector<T>* samples, std::vector<const T*>* rows);
  template <typename Take>
  void take_rows(const SnapshotRange& snapshots, const std::vector<Gain>& gains,
                 const WindowMask& mask, size_t first, size_t padded, const Take& take);

  size_t run_;
  std::vector<uint8_t> samples_, keep_;
  std::vector<uint16_t> deep_samples_;
  std::vector<const uint8_t*> planes_;
  std::vector<const uint16_t*> deep_planes_;
  std::vector<uint16_t> masked_;  // snapshots, of each pixel
  std::vector<uint8_t> spread_;   // a row of samples that pixels share, or of their two digits
  std::vector<uint8_t> bits_;     // of a snapshot's mask
};

// Every step-th pixel in x and y of one frame in unit light, the reference's where it is masked,
// drawn to that as Filler does to the median: for inner products. out: ceil(width / step) *
// ceil(height / step) samples a channel.
void fill_samples(const ReferencePicture& reference, const uint8_t* bits, const uint8_t* const x[3],
                  const Gain& gain, const uint8_t* reach, int step, uint8_t* const out[3]);
// The same of some rows.
void fill_samples(const ReferencePicture& reference, const uint8_t* bits, const KeptPicture& x,
                  const Gain& gain, const uint8_t* reach, const SampledRows& rows,
                  uint8_t* const out[3]);

}  // namespace qdmd
