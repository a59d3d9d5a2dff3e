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
  const uint64_t end = offset(slot + 1, 0);
  if (!pool || file_.data() || end <= taken_ || reserved_ < kLargePage) return;
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
