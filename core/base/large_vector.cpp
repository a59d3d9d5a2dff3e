#include "core/base/large_vector.h"

#include <sys/mman.h>

#include <cstddef>
#include <limits>
#include <new>

namespace qdmd {
namespace {

constexpr size_t kLargePage = size_t{2} << 20;

// Large pages begin at multiples of their size.
std::align_val_t alignment_of(size_t bytes) {
  return std::align_val_t(bytes < kLargePage ? kLargeAlignment : kLargePage);
}

}  // namespace

void* take_large(size_t bytes) {
  // The library rounds up to the alignment, past the largest number and back to 0.
  if (bytes > std::numeric_limits<ptrdiff_t>::max()) throw std::bad_alloc();
  void* const data = ::operator new(bytes, alignment_of(bytes));
#ifdef MADV_HUGEPAGE
  // Whole ones only: what is behind the last one would be taken with it. This is advice; memory in
  // small pages is as good.
  if (bytes >= kLargePage) madvise(data, bytes / kLargePage * kLargePage, MADV_HUGEPAGE);
#endif
  return data;
}

void give_back_large(void* data, size_t bytes) noexcept {
  ::operator delete(data, alignment_of(bytes));
}

}  // namespace qdmd
