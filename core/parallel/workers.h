// The threads of a separator.
#pragma once

#include "core/parallel/pool.h"
#include "core/parallel/side_thread.h"

namespace qdmd {

// A pool for passes over pixels and, unless there is to be one thread only, a thread for the work
// that goes on beside the caller.
class Workers {
 public:
  static constexpr int kMost = 256;

  // The threads that Workers(threads) asks the system for.
  static int count(int threads);

  // `threads` <= kMost; 0: one for each core, and even on one core a thread for the work beside the
  // caller. There are fewer if the system starts no more.
  explicit Workers(int threads);

  Pool& pool() { return pool_; }
  SideThread& side() { return side_; }

  // Asks for another number of threads. It holds from the next follow() on that finds no work under
  // way.
  void ask_for(int threads) { asked_ = threads; }
  // While no pass runs.
  void follow();

 private:
  static bool may_work_beside(int threads);

  int threads_, asked_;
  Pool pool_;
  // The last member: it ends before the pool, which it may use.
  SideThread side_;
};

}  // namespace qdmd
