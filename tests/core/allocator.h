// SPDX-License-Identifier: LGPL-2.1-or-later
// Stands in for the allocator of a test program that is linked with allocator.cpp: counts
// allocations, makes them fail, and knows what is alive.
#pragma once

#include <cstdint>

namespace qdmd::test::allocator {

// False with other C libraries and under sanitizers, which replace the C library's functions
// themselves: only operator new is seen then, and fails.
bool sees_all();

// From now on only what `object`, a shared object's name, allocates by itself or through the C++
// library is seen. False: it is not loaded. What else allocates in its process (GLib ends the
// process where it gets no memory) is left alone.
bool see_only(const char* object);

// From now on only what the calling thread allocates is seen, or (false) what any thread does.
void see_only_this_thread(bool only);

// On the threads that are seen, since start().
struct Seen {
  int64_t allocations = 0, failed = 0;
  // Alive, of what was allocated since start(), as asked for; and the most bytes at any time.
  int64_t blocks = 0, bytes = 0, peak = 0;
};

// Forgets all and begins to look. Nothing fails.
void start();
// Allocations are no longer seen; what is freed still is.
void stop();
Seen seen();
// Only bytes that are alive count for Seen::peak from now on.
void forget_peak();

enum class Failing {
  one,  // the n-th alone
  all   // the n-th and all after it
};
// n: 1 for the first allocation after start().
void fail(int64_t n, Failing failing);
void fail_no_more();

// While it lives, what its thread allocates is not seen and does not fail.
class Unseen {
 public:
  Unseen();
  ~Unseen();
  Unseen(const Unseen&) = delete;
  Unseen& operator=(const Unseen&) = delete;
};

// What its thread allocates is seen in spite of an Unseen around it.
class SeenAgain {
 public:
  SeenAgain();
  ~SeenAgain();
  SeenAgain(const SeenAgain&) = delete;
  SeenAgain& operator=(const SeenAgain&) = delete;

 private:
  int depth_;
};

// ---- Where from: slower, and off until asked for after start() ----

// Numbers the code that allocates: place(n), n = 1 for the first allocation from now on, is the
// same for those with the same callers.
void note_places();
uint64_t place(int64_t n);
// The first allocation from then on of at least so many bytes; 0: there was none.
int64_t first_of(int64_t bytes);
// Notes the stack of every block, and what is alive when `bytes` first are.
void note_sites(int64_t bytes);
// To standard error, as `addr2line -fiCe` reads it: the first allocation since start(), the one
// that failed last, and the sites with most bytes at the time that note_sites() was told.
void print_first();
void print_failed();
void print_sites(int most);

}  // namespace qdmd::test::allocator
