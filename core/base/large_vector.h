// SPDX-License-Identifier: LGPL-2.1-or-later
// Vectors of many megabytes, in large pages.
#pragma once

#include <cstddef>
#include <limits>
#include <new>
#include <utility>
#include <vector>

namespace qdmd {

constexpr size_t kLargeAlignment = 64, kLargePage = size_t{2} << 20;
// Memory of so many bytes, which begins at a multiple of kLargeAlignment. From kLargePage on, the
// system is asked to give it in pages as large as that, if that is a size that it has: pages of 4
// KiB each cost a visit to the kernel when they are touched for the first time, which can take
// longer than all that is done with them. Memory that nobody touches is not taken, except for what
// a large page has of it. Throws std::bad_alloc.
void* take_large(size_t bytes);
void give_back_large(void* data, size_t bytes) noexcept;
// Takes the pages of memory of take_large() that is going to be written, as far as the system can
// do that. What is written there stays. If the host of a virtual machine finds new memory slowly,
// threads that take some pages each wait at once.
void take_pages(void* data, size_t bytes) noexcept;
// For a std::unique_ptr to it.
struct GiveBackLarge {
  size_t bytes = 0;
  void operator()(void* data) const { give_back_large(data, bytes); }
};

template <typename T>
class LargeAllocator {
 public:
  using value_type = T;

  LargeAllocator() = default;
  template <typename U>
  LargeAllocator(const LargeAllocator<U>&) noexcept {}  // NOLINT

  T* allocate(size_t count) {
    if (count > std::numeric_limits<size_t>::max() / sizeof(T)) throw std::bad_array_new_length();
    return static_cast<T*>(take_large(count * sizeof(T)));
  }
  void deallocate(T* data, size_t count) noexcept { give_back_large(data, count * sizeof(T)); }
  // Nothing is set, and so nothing touched, where no value is given.
  template <typename U, typename... Values>
  void construct(U* at, Values&&... values) {
    if constexpr (sizeof...(values) == 0)
      ::new (static_cast<void*>(at)) U;
    else
      ::new (static_cast<void*>(at)) U(std::forward<Values>(values)...);
  }

  friend bool operator==(const LargeAllocator&, const LargeAllocator&) { return true; }
};

// LargeVector<T>(count) and resize(count) leave new values as they are in memory; (count, value)
// and resize(count, value) set them.
template <typename T>
using LargeVector = std::vector<T, LargeAllocator<T>>;

// Makes it `count` values, which are not set and need not be the old ones, without memory for more
// and without the old memory beside the new.
template <typename T>
void make_room(LargeVector<T>* values, size_t count) {
  if (values->capacity() < count) LargeVector<T>().swap(*values);
  values->resize(count);
}

}  // namespace qdmd
