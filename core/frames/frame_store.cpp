// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/frames/frame_store.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <limits>
#include <utility>

#include "core/passes/bands.h"
#include "core/passes/chroma.h"
#include "core/passes/digits.h"
#include "core/passes/planes.h"
#include "core/passes/read_samples.h"
#include "core/passes/sampling.h"

namespace qdmd {
namespace {

ChromaShape shape_of(int width, int height, const FrameContents& contents) {
  return {width, height, contents.chroma_columns, contents.chroma_rows};
}

// Samples of a channel.
size_t samples_of(int width, int height, const FrameContents& contents) {
  const int step = contents.sample_step;
  return static_cast<size_t>((height - contents.first_sample + step - 1) / step) *
         sample_count(width, step);
}

// Samples of a row that are worked on beside the planes.
size_t spread_size(int width, const FrameContents& contents) {
  if (contents.depth == 8 && contents.chroma_columns == 1) return 0;
  return 2 * static_cast<size_t>(width);
}

// Takes rows first .. end - 1 of `width` samples of a channel, which lie as `at` says. room: as for
// take_row().
void take_rows(const uint8_t* from, const Spacing& at, SampleBits bits, int first, int end,
               int width, uint8_t* room, MutableSamples plane) {
  const auto size = static_cast<size_t>(width);
  for (int y = first; y < end; ++y) {
    const MutableSamples row = plane + static_cast<size_t>(y) * size;
    // Rows that share samples are alike.
    if (y > first && y % at.rows != 0)
      copy_samples(plane + static_cast<size_t>(y - 1) * size, size, row);
    else
      take_row(from + y / at.rows * at.row_stride, at, bits, size, room, row);
  }
}

}  // namespace

FrameStore::FrameStore(int capacity, int width, int height, const FrameContents& contents,
                       uint64_t most_bytes, PageFile file)
    : width_(width),
      height_(height),
      sample_step_(contents.sample_step),
      first_sample_(contents.first_sample),
      most_bytes_(most_bytes),
      rgb_(contents.rgb),
      planes_(capacity, shape_of(width, height_, contents), contents.depth, std::move(file)),
      spread_(spread_size(width, contents)),
      constant_alpha_(static_cast<size_t>(sample_bytes(contents.depth) * capacity), 255),
      varies_(static_cast<size_t>(capacity), 0),
      poses_(static_cast<size_t>(capacity)) {
  if (sample_step_ > 1)
    samples_ = PlaneSlots(capacity, samples_of(width, height, contents), contents.depth);
  if (contents.cells_along > 0) {
    grid_ = Grid(width, height, contents.cells_along);
    cells_ = GridFrames(grid_, capacity);
  }
}

uint64_t FrameStore::plane_bytes(int capacity, int width, int height,
                                 const FrameContents& contents) {
  return PlaneSlots::bytes(capacity, shape_of(width, height, contents), contents.depth);
}

uint64_t FrameStore::bytes(int capacity, int width, int height, const FrameContents& contents) {
  uint64_t bytes = plane_bytes(capacity, width, height, contents);
  const auto of_alpha = static_cast<size_t>(sample_bytes(contents.depth));
  uint64_t beside = (of_alpha + 1 + sizeof(Pose)) * static_cast<uint64_t>(capacity) +
                    spread_size(width, contents);
  if (contents.sample_step > 1)
    beside += PlaneSlots::bytes(capacity, samples_of(width, height, contents), contents.depth);
  if (contents.cells_along > 0)
    beside += GridFrames::bytes(Grid(width, height, contents.cells_along), capacity);
  if (__builtin_add_overflow(bytes, beside, &bytes)) return std::numeric_limits<uint64_t>::max();
  return bytes;
}

uint64_t FrameStore::bytes() const {
  return planes_.bytes() + samples_.bytes() + cells_.bytes() + (alpha_ ? alpha_bytes() : 0) +
         spread_.size() + constant_alpha_.size() + varies_.size() + untouched_.bytes() +
         poses_.size() * sizeof(Pose);
}

bool FrameStore::append(const ImageView& frame, Pool* pool) {
  const int slot = planes_.append(pool);
  ++frames_taken_;
  poses_[static_cast<size_t>(slot)] = {};
  take_constant_alpha(slot, frame);
  const bool constant = take_planes(slot, frame, pool);
  varies_[static_cast<size_t>(slot)] = !constant;
  if (!constant && !keep_alpha(slot, frame)) return false;
  take_contents(slot, pool);
  planes_.written(slot);
  return true;
}

// What is made of the planes.
void FrameStore::take_contents(int slot, Pool* pool) {
  const KeptPicture picture = planes_.picture(slot);
  if (sample_step_ > 1) {
    samples_.pad(slot);
    const MutableSamples to[] = {samples_.samples(slot, 0), samples_.samples(slot, 1),
                                 samples_.samples(slot, 2)};
    take_samples(picture, width_, {first_sample_, height_, sample_step_}, spread_.data(), to);
  }
  if (cells_.cells() == 0) return;
  find_cells(grid_, picture, &cells_, slot, pool);
  rgb_.convert(cells_.cells(), cells_.channels(slot).data());
}

bool FrameStore::unshare(uint64_t beside) {
  const uint64_t more = beside + PlaneSlots::bytes(capacity(), planes_.pixels(), depth());
  if (more > most_bytes_ || bytes() > most_bytes_ - more) return false;
  most_bytes_ -= beside;
  Window window = planes_.unshared();
  for (int i = 0; i < planes_.size(); ++i) {
    window.pad(slot(i));
    for (int c = 0; c < kChannels; ++c)
      copy_plane(planes_.picture(slot(i)), c, planes_.pixels(), window.samples(slot(i), c));
  }
  planes_ = std::move(window);
  return true;
}

bool FrameStore::steady(int index, const Pose& pose, Resampler* resampler, Pool* pool,
                        uint64_t beside) {
  if (shares_samples() && !unshare(beside)) return false;
  if (untouched_.capacity() == 0) {
    const uint64_t more = PlaneSlots::bytes(capacity(), planes_.pixels(), depth());
    if (more > most_bytes_ || bytes() > most_bytes_ - more) return false;
    untouched_ = PlaneSlots(capacity(), planes_.pixels(), depth());
  }
  const int slot = this->slot(index), before = index > 0 ? this->slot(index - 1) : slot;
  const bool was_moved = !this->pose(slot).is_rest();
  resampler->prepare(pool);
  const Affine place = affine(inverse(pose), middle_of(width_, height_));
  const size_t pixels = planes_.pixels();
  for (int c = 0; c < kChannels; ++c) {
    const MutableSamples plane = planes_.samples(slot, c), own = untouched_.samples(slot, c);
    if (!was_moved) copy_samples(plane, pixels, own);
    copy_samples(before != slot ? planes_.samples(before, c) : own, pixels, plane);
    resampler->run(own, depth(), place, plane, width_, height_, pool);
  }
  poses_[static_cast<size_t>(slot)] = pose;
  take_contents(slot, pool);
  planes_.written(slot);
  return true;
}

// What the alpha samples of a frame are if all are equal: its first one, the largest where it has
// none.
void FrameStore::take_constant_alpha(int slot, const ImageView& frame) {
  const auto largest = static_cast<uint16_t>(frame.bits.most());
  const bool has_alpha = frame.alpha && !frame.alpha_is_padding;
  take_row(has_alpha ? frame.alpha : reinterpret_cast<const uint8_t*>(&largest),
           {sizeof largest, 0, 1, 1}, {depth(), has_alpha ? frame.bits.shift : 0}, 1, nullptr,
           constant_of(slot));
}

// True: every alpha sample is the constant one.
bool FrameStore::take_planes(int slot, const ImageView& frame, Pool* pool) {
  const ChromaShape& shape = planes_.shape();
  const MutableSamples planes[] = {planes_.samples(slot, 0), planes_.samples(slot, 1),
                                   planes_.samples(slot, 2)};
  const auto take = [&](int c, bool as_shared, int first, int end) {
    Spacing at = frame.spacing(c);
    if (as_shared) at.columns = at.rows = 1;
    take_rows(frame.channel[c], at, frame.bits, first, end,
              as_shared ? shape.chroma_width() : width_, spread_.data(), planes[c]);
  };
  if (frame.bits.is_deep()) {
    for (int c = 0; c < kChannels; ++c) {
      const bool as_shared = c > 0 && shape.is_shared();
      if (c > 0 && frame.channel[c] == frame.channel[0])
        copy_samples(planes[0], planes_.pixels(), planes[c]);
      else
        take(c, as_shared, 0, as_shared ? shape.chroma_height() : height_);
    }
    return is_constant_deep_alpha(slot, frame);
  }
  const uint8_t alpha = *constant_of(slot).high;
  std::atomic<bool> constant{true};
  if (!shape.is_shared()) {
    uint8_t* const levels[3] = {planes[0].high, planes[1].high, planes[2].high};
    for_rows(pool, height_, planes_.pixels(), [&](int first, int count) {
      if (!split_channels(frame, first, count, alpha, levels)) constant = false;
    });
    return constant;
  }
  for_rows(pool, shape.chroma_height(), planes_.pixels(), [&](int first, int count) {
    const int top = first * shape.rows, end = std::min(top + count * shape.rows, height_);
    take(0, false, top, end);
    for (int c = 1; c < kChannels; ++c) take(c, true, first, first + count);
    if (!is_constant_alpha(frame, top, end - top, alpha)) constant = false;
  });
  return constant;
}

bool FrameStore::is_constant_deep_alpha(int slot, const ImageView& frame) {
  if (!frame.alpha) return true;
  const auto width = static_cast<size_t>(width_);
  const MutableSamples row = samples_in(spread_.data(), width, depth());
  const Spacing at = frame.spacing(3);
  for (int y = 0; y < height_; ++y) {
    take_row(frame.alpha + y * at.row_stride, at, frame.bits, width, nullptr, row);
    if (!are_all(row, constant_of(slot), width)) return false;
  }
  return true;
}

// False: no room for alpha that varies.
bool FrameStore::keep_alpha(int slot, const ImageView& frame) {
  if (!alpha_) {
    if (bytes_with_alpha() > most_bytes_) return false;
    // Without touching it.
    alpha_ = std::make_unique_for_overwrite<uint8_t[]>(alpha_bytes());
  }
  take_rows(frame.alpha, frame.spacing(3), frame.bits, 0, height_, width_, nullptr, alpha_of(slot));
  return true;
}

Samples FrameStore::alpha(int slot) const {
  return varies_[static_cast<size_t>(slot)] ? alpha_of(slot) : MutableSamples();
}

uint16_t FrameStore::constant_alpha(int slot) const {
  const Samples constants = samples_in(constant_alpha_.data(), count(), depth());
  return static_cast<uint16_t>(sample_at(constants, static_cast<size_t>(slot), depth()));
}

}  // namespace qdmd
