// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/base/large_vector.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <new>

namespace qdmd {
namespace {

// Large pages begin at multiples of their size.
std::align_val_t alignment_of(size_t bytes) {
  return std::align_val_t(bytes < kLargePage ? kLargeAlignment : kLargePage);
}

#ifdef MADV_HUGEPAGE
// What the system says of large pages; nothing where it knows none.
struct Said {
  char text[64] = {};

  explicit Said(const char* path) {
    const int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) return;
    if (read(file, text, sizeof(text) - 1) < 0) text[0] = 0;
    close(file);
  }
};

// Where they are for those who ask, and as large as we think: with a base of 64 KiB they have
// hundreds of megabytes. Where everybody has them, nobody need ask.
bool must_ask() {
  static const bool must =
      std::strstr(Said("/sys/kernel/mm/transparent_hugepage/enabled").text, "[madvise]") &&
      std::strtoull(Said("/sys/kernel/mm/transparent_hugepage/hpage_pmd_size").text, nullptr, 10) ==
          kLargePage;
  return must;
}
#endif

// Asks for whole large pages only: what is behind the last one would be taken with it. This is
// advice; memory in small pages is as good.
void ask(void* data, size_t bytes, bool large) {
#ifdef MADV_HUGEPAGE
  if (bytes >= kLargePage && must_ask())
    madvise(data, bytes / kLargePage * kLargePage, large ? MADV_HUGEPAGE : MADV_NOHUGEPAGE);
#else
  (void)data, (void)bytes, (void)large;
#endif
}

}  // namespace

void* take_large(size_t bytes) {
  // The C++ library rounds the size up to the alignment; that must not wrap around to 0.
  if (bytes > std::numeric_limits<ptrdiff_t>::max()) throw std::bad_alloc();
  void* const data = ::operator new(bytes, alignment_of(bytes));
  ask(data, bytes, true);
  return data;
}

void take_pages(void* data, size_t bytes) noexcept {
#ifdef MADV_POPULATE_WRITE
  // Systems that do not know it take pages when they are written.
  static const auto page = static_cast<uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto first = reinterpret_cast<uintptr_t>(data) / page * page;
  const auto end = (reinterpret_cast<uintptr_t>(data) + bytes + page - 1) / page * page;
  if (bytes > 0) madvise(reinterpret_cast<void*>(first), end - first, MADV_POPULATE_WRITE);
#else
  (void)data, (void)bytes;
#endif
}

void give_back_large(void* data, size_t bytes) noexcept {
  // The C library may give it to somebody who touches little of it.
  ask(data, bytes, false);
  ::operator delete(data, alignment_of(bytes));
}

}  // namespace qdmd
