// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/core/allocator.h"

#include <execinfo.h>
#include <link.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <new>

#if defined(__has_feature)
#define QDMD_FEATURE(name) __has_feature(name)
#else
#define QDMD_FEATURE(name) 0
#endif
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && \
    !QDMD_FEATURE(address_sanitizer) && !QDMD_FEATURE(thread_sanitizer)
#define QDMD_REPLACES_MALLOC 1
#else
#define QDMD_REPLACES_MALLOC 0
#endif

namespace qdmd::test::allocator {
namespace {

constexpr int kDepth = 16;

struct Stack {
  void* frame[kDepth];
  int depth;
};

struct Range {
  uintptr_t first, last;
};

// Nothing here allocates: it would call itself.
std::atomic<bool> looking = false;
std::atomic<int64_t> allocations = 0, failures = 0;
std::atomic<int64_t> fail_from = 0, fail_to = 0;  // none: 0, 0
thread_local int unseen = 0;
thread_local bool inside = false;

std::atomic<const int*> only_thread = nullptr;  // where its `unseen` is

struct Ranges {
  Range range[32];
  int count;
  bool has(const void* at) const {
    const auto address = reinterpret_cast<uintptr_t>(at);
    return std::any_of(range, range + count, [address](const Range& r) {
      return address >= r.first && address < r.last;
    });
  }
};
Ranges ours;    // none: all
Ranges loader;  // keeps memory for threads that have ended

Stack first_stack, failed_stack;

std::atomic<bool> noting_places = false;
std::atomic<int64_t> noting_from = 0;
constexpr int64_t kMostPlaces = int64_t{1} << 20;
uint64_t places[kMostPlaces], place_sizes[kMostPlaces];

// Blocks that are alive: open addressing, nearest free slot.
struct Block {
  void* at;
  size_t size;
  Stack stack;
};
constexpr size_t kSlotBits = 18, kSlots = size_t{1} << kSlotBits;
Block table[kSlots];
std::atomic<int64_t> blocks = 0;
int64_t bytes = 0, peak = 0;
std::atomic<bool> noting_sites = false;
int64_t sites_wanted_at = 0;

struct Site {
  Stack stack;
  int64_t bytes, blocks;
};
constexpr int kMostSites = 4096;
Site sites[kMostSites];
int site_count = 0;

// A mutex of its own: those of the library may allocate where they meet a thread first.
class Lock {
 public:
  Lock() {
    while (taken.test_and_set(std::memory_order_acquire)) sched_yield();
  }
  ~Lock() { taken.clear(std::memory_order_release); }

 private:
  static std::atomic_flag taken;
};
std::atomic_flag Lock::taken;

void take_stack(Stack* stack) {
  inside = true;
  stack->depth = backtrace(stack->frame, kDepth);
  inside = false;
}

// Several threads may fail at once.
void keep_stack(Stack* kept) {
  Stack stack;
  take_stack(&stack);
  const Lock lock;
  *kept = stack;
}

bool same(const Stack& a, const Stack& b) {
  return a.depth == b.depth && std::equal(a.frame, a.frame + static_cast<size_t>(a.depth), b.frame);
}

size_t home(const void* at) {
  return static_cast<size_t>((reinterpret_cast<uintptr_t>(at) >> 4) * 0x9E3779B97F4A7C15u >>
                             (64 - kSlotBits));
}

// The slot of `at`, or the free one where it would go.
size_t slot_of(const void* at) {
  size_t slot = home(at);
  while (table[slot].at && table[slot].at != at) slot = (slot + 1) % kSlots;
  return slot;
}

// By stack, what is alive.
void note_sites_now() {
  site_count = 0;
  for (const Block& block : table) {
    if (!block.at) continue;
    int i = 0;
    while (i < site_count && !same(sites[i].stack, block.stack)) ++i;
    if (i == kMostSites) continue;
    if (i == site_count) sites[site_count++] = {block.stack, 0, 0};
    sites[i].bytes += static_cast<int64_t>(block.size);
    ++sites[i].blocks;
  }
  std::sort(sites, sites + site_count,
            [](const Site& a, const Site& b) { return a.bytes > b.bytes; });
}

void add(void* at, size_t size) {
  Stack stack;
  stack.depth = 0;
  if (noting_sites) take_stack(&stack);
  const Lock lock;
  if (blocks > static_cast<int64_t>(kSlots / 2)) {
    constexpr char kMessage[] = "tests/core/allocator.cpp: too many blocks\n";
    [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, kMessage, sizeof kMessage - 1);
    std::abort();
  }
  Block& block = table[slot_of(at)];
  block.at = at;
  block.size = size;
  block.stack = stack;
  ++blocks;
  bytes += static_cast<int64_t>(size);
  peak = std::max(peak, bytes);
  if (noting_sites && site_count == 0 && bytes >= sites_wanted_at) note_sites_now();
}

// True: it was in the table, and no longer is.
bool remove(const void* at, size_t* size) {
  if (!at || blocks == 0) return false;
  const Lock lock;
  size_t slot = slot_of(at);
  if (!table[slot].at) return false;
  *size = table[slot].size;
  bytes -= static_cast<int64_t>(*size);
  --blocks;
  // Entries behind it that could not have their home move up.
  for (size_t next = (slot + 1) % kSlots; table[next].at; next = (next + 1) % kSlots) {
    const size_t from_home = (next - home(table[next].at)) % kSlots;
    if (from_home < (next - slot) % kSlots) continue;
    table[slot] = table[next];
    slot = next;
  }
  table[slot].at = nullptr;
  return true;
}

bool sees(const void* caller) {
  if (!looking || unseen > 0 || inside) return false;
  const int* const only = only_thread;
  if (only && only != &unseen) return false;
  return !loader.has(caller) && (ours.count == 0 || ours.has(caller));
}

// Counts an allocation. False: it shall fail.
bool allow(size_t size) {
  const int64_t n = ++allocations;
  if (n == 1) keep_stack(&first_stack);
  if (const int64_t noted = n - noting_from; noting_places && noted <= kMostPlaces) {
    Stack stack;
    take_stack(&stack);
    uint64_t hash = 0;
    // What is above differs with who called the engine.
    for (int i = 0; i < std::min(stack.depth, 9); ++i)
      hash = (hash ^ reinterpret_cast<uintptr_t>(stack.frame[i])) * 0x100000001B3u;
    places[noted - 1] = hash;
    place_sizes[noted - 1] = size;
  }
  if (n < fail_from || n >= fail_to) return true;
  ++failures;
  keep_stack(&failed_stack);
  return false;
}

void print(const Stack& stack) { backtrace_symbols_fd(stack.frame, stack.depth, STDERR_FILENO); }

struct Search {
  const char* object;
  Ranges* into;
  bool found;
};

int note_object(dl_phdr_info* info, size_t, void* data) {
  auto* search = static_cast<Search*>(data);
  if (!std::strstr(info->dlpi_name, search->object)) return 0;
  search->found = true;
  for (int i = 0; i < info->dlpi_phnum; ++i) {
    const auto& header = info->dlpi_phdr[i];
    if (header.p_type != PT_LOAD || !(header.p_flags & PF_X)) continue;
    Ranges& into = *search->into;
    if (into.count == static_cast<int>(std::size(into.range))) std::abort();
    const uintptr_t first = info->dlpi_addr + header.p_vaddr;
    into.range[into.count++] = {first, first + header.p_memsz};
  }
  return 0;
}

bool note_code(const char* object, Ranges* into) {
  Search search = {object, into, false};
  dl_iterate_phdr(note_object, &search);
  return search.found;
}

}  // namespace

bool sees_all() { return QDMD_REPLACES_MALLOC; }

bool see_only(const char* object) {
  ours.count = 0;
  return note_code(object, &ours) && note_code("libstdc++", &ours);
}

void see_only_this_thread(bool only) { only_thread = only ? &unseen : nullptr; }

void start() {
  looking = false;
  // It does not move, and threads of a run before this one may look at it.
  if (loader.count == 0) note_code("/ld-linux", &loader);
  // The first one loads a library.
  Stack none;
  take_stack(&none);
  fail_no_more();
  allocations = failures = 0;
  noting_places = noting_sites = false;
  {
    const Lock lock;
    first_stack.depth = failed_stack.depth = 0;
    if (blocks > 0)
      for (Block& block : table) block.at = nullptr;
    blocks = 0;
    bytes = peak = 0;
    site_count = 0;
  }
  looking = true;
}

void stop() { looking = false; }

Seen seen() {
  const Lock lock;
  return {allocations, failures, blocks, bytes, peak};
}

void forget_peak() {
  const Lock lock;
  peak = bytes;
}

void fail(int64_t n, Failing failing) {
  fail_from = n;
  fail_to = failing == Failing::one ? n + 1 : INT64_MAX;
}

void fail_no_more() { fail_from = fail_to = 0; }

Unseen::Unseen() { ++unseen; }
Unseen::~Unseen() { --unseen; }

SeenAgain::SeenAgain() : depth_(unseen) { unseen = 0; }
SeenAgain::~SeenAgain() { unseen = depth_; }

void note_places() {
  noting_from = allocations.load();
  noting_places = true;
}

uint64_t place(int64_t n) { return n <= kMostPlaces ? places[n - 1] : 0; }

int64_t first_of(int64_t bytes) {
  const int64_t noted = std::min(allocations.load() - noting_from, kMostPlaces);
  for (int64_t n = 1; n <= noted; ++n)
    if (place_sizes[n - 1] >= static_cast<uint64_t>(bytes)) return n;
  return 0;
}

void note_sites(int64_t at) {
  sites_wanted_at = at;
  noting_sites = true;
}

void print_first() { print(first_stack); }

void print_failed() { print(failed_stack); }

void print_sites(int most) {
  for (int i = 0; i < std::min(most, site_count); ++i) {
    std::fprintf(stderr, "%ld bytes in %ld blocks\n", static_cast<long>(sites[i].bytes),
                 static_cast<long>(sites[i].blocks));
    print(sites[i].stack);
  }
}

}  // namespace qdmd::test::allocator

namespace allocator = qdmd::test::allocator;

#if QDMD_REPLACES_MALLOC
extern "C" {
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* old, size_t size);
void* __libc_memalign(size_t alignment, size_t size);
void __libc_free(void* memory);
}
#else
extern "C" __attribute__((weak)) void* __real_malloc(size_t size);

namespace {
void* __libc_malloc(size_t size) { return __real_malloc ? __real_malloc(size) : malloc(size); }
void* __libc_memalign(size_t alignment, size_t size) {
  return aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
}
void __libc_free(void* memory) { free(memory); }
}  // namespace
#endif

namespace {

// Does `work`, which gives `size` bytes, for `caller`; null: there are none.
template <typename Work>
void* allocate(const void* caller, size_t size, Work work) {
  const bool sees = allocator::sees(caller);
  if (sees && !allocator::allow(size)) return nullptr;
  void* memory = work();
  if (sees && memory) allocator::add(memory, size);
  return memory;
}

void release(void* memory) {
  size_t size = 0;
  // Before another thread is given the same address.
  allocator::remove(memory, &size);
  __libc_free(memory);
}

void* allocate_or_throw(const void* caller, size_t size, size_t alignment) {
  void* memory = allocate(caller, size, [&] {
    return alignment > 0 ? __libc_memalign(alignment, size) : __libc_malloc(size > 0 ? size : 1);
  });
  if (!memory) throw std::bad_alloc();
  return memory;
}

}  // namespace

#define CALLER __builtin_return_address(0)

#if QDMD_REPLACES_MALLOC

namespace {

void* reallocate(const void* caller, void* old, size_t size) {
  const bool sees = allocator::sees(caller);
  if (sees && !allocator::allow(size)) return nullptr;
  size_t old_size = 0;
  const bool known = allocator::remove(old, &old_size);
  void* memory = __libc_realloc(old, size);
  if (!memory && size > 0 && known) allocator::add(old, old_size);
  if (memory && (known || sees)) allocator::add(memory, size);
  return memory;
}

}  // namespace

extern "C" {

void* malloc(size_t size) {
  void* memory = allocate(CALLER, size, [&] { return __libc_malloc(size); });
  if (!memory) errno = ENOMEM;
  return memory;
}
void* calloc(size_t count, size_t size) {
  void* memory = allocate(CALLER, count * size, [&] { return __libc_calloc(count, size); });
  if (!memory) errno = ENOMEM;
  return memory;
}
void* realloc(void* old, size_t size) {
  void* memory = reallocate(CALLER, old, size);
  if (!memory) errno = ENOMEM;
  return memory;
}
void* memalign(size_t alignment, size_t size) {
  void* memory = allocate(CALLER, size, [&] { return __libc_memalign(alignment, size); });
  if (!memory) errno = ENOMEM;
  return memory;
}
void* aligned_alloc(size_t alignment, size_t size) {
  void* memory = allocate(CALLER, size, [&] { return __libc_memalign(alignment, size); });
  if (!memory) errno = ENOMEM;
  return memory;
}
int posix_memalign(void** out, size_t alignment, size_t size) {
  void* memory = allocate(CALLER, size, [&] { return __libc_memalign(alignment, size); });
  if (!memory) return ENOMEM;
  *out = memory;
  return 0;
}
void free(void* memory) { release(memory); }

}  // extern "C"

#else

// Where the linker is told so (--wrap=malloc), malloc in the program's own code, which is Eigen's,
// fails, too; what it gives is not known to be alive.
extern "C" {
void* __wrap_malloc(size_t size);
void* __wrap_malloc(size_t size) {
  return allocator::sees(CALLER) && !allocator::allow(size) ? nullptr : __real_malloc(size);
}
}

#endif

// The library's would call malloc: the caller would be the library for all.
void* operator new(size_t size) { return allocate_or_throw(CALLER, size, 0); }
void* operator new[](size_t size) { return allocate_or_throw(CALLER, size, 0); }
void* operator new(size_t size, std::align_val_t alignment) {
  return allocate_or_throw(CALLER, size, static_cast<size_t>(alignment));
}
void* operator new[](size_t size, std::align_val_t alignment) {
  return allocate_or_throw(CALLER, size, static_cast<size_t>(alignment));
}
// A stable sort takes its buffer here.
void* operator new(size_t size, const std::nothrow_t&) noexcept {
  return allocate(CALLER, size, [&] { return __libc_malloc(size > 0 ? size : 1); });
}
void operator delete(void* memory) noexcept { release(memory); }
void operator delete[](void* memory) noexcept { release(memory); }
void operator delete(void* memory, size_t) noexcept { release(memory); }
void operator delete[](void* memory, size_t) noexcept { release(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete(void* memory, size_t, std::align_val_t) noexcept { release(memory); }
void operator delete[](void* memory, size_t, std::align_val_t) noexcept { release(memory); }
