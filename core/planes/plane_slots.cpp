// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/planes/plane_slots.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "core/parallel/pool.h"

namespace qdmd {
namespace {

constexpr size_t kAlignment = 64;
static_assert(kAlignment <= kLargeAlignment);

size_t padded(size_t pixels) { return (pixels + kAlignment - 1) / kAlignment * kAlignment; }

}  // namespace

uint64_t PlaneSlots::bytes(int capacity, size_t pixels, size_t chroma_samples, int depth) {
  uint64_t slot = 0, bytes = 0;
  if (__builtin_mul_overflow(2, padded(chroma_samples), &slot) ||
      __builtin_add_overflow(slot, padded(pixels), &slot) ||
      __builtin_mul_overflow(static_cast<uint64_t>(capacity * sample_bytes(depth)), slot, &bytes))
    return std::numeric_limits<uint64_t>::max();
  return bytes;
}

PlaneSlots::PlaneSlots(int capacity, size_t pixels, size_t chroma_samples, int depth, PageFile file)
    : capacity_(capacity),
      depth_(depth),
      pixels_(pixels),
      plane_size_(padded(pixels)),
      chroma_samples_(chroma_samples),
      chroma_size_(padded(chroma_samples)),
      reserved_(bytes(capacity, pixels, chroma_samples, depth)),
      memory_(file.data() ? nullptr : static_cast<uint8_t*>(take_large(reserved_)),
              GiveBackLarge{reserved_}),
      file_(std::move(file)) {}

void PlaneSlots::take_pages(int slot, Pool* pool) {
  if (on_disk()) return file_.forget(offset(slot, 0), slot_size());
  const uint64_t end = offset(slot + 1, 0);
  if (!pool || end <= taken_ || reserved_ < kLargePage) return;
  // As many for each thread, of machines with few.
  const uint64_t together = std::min<uint64_t>(pool->threads(), 4);
  const uint64_t needed = (end - taken_ + kLargePage - 1) / kLargePage;
  const uint64_t pages = (needed + together - 1) / together * together;
  pool->run(static_cast<size_t>(pages), [&](size_t page) {
    const uint64_t first = taken_ + page * kLargePage;
    if (first < reserved_)
      qdmd::take_pages(memory_.get() + first, std::min<uint64_t>(kLargePage, reserved_ - first));
  });
  taken_ = std::min(taken_ + pages * kLargePage, reserved_);
}

void PlaneSlots::written(int slot) const {
  if (on_disk()) file_.written(offset(slot, 0), slot_size());
}

void PlaneSlots::will_need(int slot) const {
  if (on_disk()) file_.will_need(offset(slot, 0), slot_size());
}

void PlaneSlots::will_need(int slot, size_t first, size_t count) const {
  if (!on_disk()) return;
  for (int c = 0; c < kChannels; ++c) {
    size_t begin = first, end = first + count;
    if (c > 0 && shape_.is_shared()) {
      // Rows of them.
      const auto width = static_cast<size_t>(shape_.width), rows = static_cast<size_t>(shape_.rows),
                 samples = static_cast<size_t>(shape_.chroma_width());
      begin = first / width / rows * samples;
      end = std::min((end - 1) / width / rows * samples + samples, chroma_samples_);
    }
    for (int digit = 0; digit < sample_bytes(depth_); ++digit)
      file_.will_need(offset(slot, c) + static_cast<size_t>(digit) * digit_size() + begin,
                      end - begin);
  }
}

void PlaneSlots::pad(int slot) {
  for (int c = 0; c < kChannels; ++c) {
    const size_t samples = c == 0 ? pixels_ : chroma_samples_,
                 size = c == 0 ? plane_size_ : chroma_size_;
    const MutableSamples plane = this->samples(slot, c);
    for (uint8_t* digits : {plane.high, plane.low})
      if (digits) std::memset(digits + samples, 0, size - samples);
  }
}

void PlaneSlots::resize(size_t pixels) {
  pixels_ = chroma_samples_ = pixels;
  plane_size_ = chroma_size_ = padded(pixels);
}

}  // namespace qdmd
