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
  // caller. There are fewer if the system starts no more. beside: false if nothing may go on beside
  // the caller, whatever the number.
  explicit Workers(int threads, bool beside = true);

  Pool& pool() { return pool_; }
  SideThread& side() { return side_; }

  // Asks for another number of threads. It holds from the next follow() on that finds no work under
  // way.
  void ask_for(int threads) { asked_ = threads; }
  // While no pass runs.
  void follow();

 private:
  bool may_work_beside(int threads) const;

  int threads_, asked_;
  bool beside_;
  Pool pool_;
  // The last member: it ends before the pool, which it may use.
  SideThread side_;
};

}  // namespace qdmd
