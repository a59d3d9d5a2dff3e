// The threads of a separator.
#pragma once

#include "core/parallel/pool.h"
#include "core/parallel/side_thread.h"

namespace qdmd {

// A pool for passes over pixels and, unless it is to be one thread, one for what goes on beside the
// caller.
class Workers {
 public:
  static constexpr int kMost = 256;

  // The threads that Workers(threads) asks the system for.
  static int count(int threads);

  // `threads` <= kMost; 0: one for each core, and what goes on beside the caller has its own even
  // on one core. Fewer where the system starts no more. beside: false where nothing may go on
  // beside the caller, whatever the number.
  explicit Workers(int threads, bool beside = true);

  Pool& pool() { return pool_; }
  SideThread& side() { return side_; }

  // Another number, from the next follow() on that finds nothing under way.
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
