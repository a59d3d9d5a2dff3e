#include "core/gram/window.h"

#include <cstring>
#include <limits>
#include <new>

namespace qdmd {
namespace {

constexpr size_t kAlignment = 64;

size_t padded(size_t pixels) { return (pixels + kAlignment - 1) / kAlignment * kAlignment; }

}  // namespace

void Window::Free::operator()(uint8_t* data) const {
  ::operator delete[](data, std::align_val_t(kAlignment));
}

uint64_t Window::bytes(int capacity, size_t pixels) {
  uint64_t bytes = 0;
  if (__builtin_mul_overflow(static_cast<uint64_t>(capacity) * kChannels, padded(pixels), &bytes))
    return std::numeric_limits<uint64_t>::max();
  return bytes;
}

Window::Window(int capacity, size_t pixels)
    : capacity_(capacity),
      pixels_(pixels),
      plane_size_(padded(pixels)),
      data_(static_cast<uint8_t*>(
          ::operator new[](bytes(capacity, pixels), std::align_val_t(kAlignment)))) {}

int Window::append() {
  if (size_ == capacity_) {
    oldest_ = (oldest_ + 1) % capacity_;
    --size_;
  }
  const int newest = slot(size_++);
  for (int c = 0; c < kChannels; ++c)
    std::memset(plane(newest, c) + pixels_, 0, plane_size_ - pixels_);
  return newest;
}

}  // namespace qdmd
