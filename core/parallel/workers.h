// SPDX-License-Identifier: LGPL-2.1-or-later
// The threads of a separator.
#pragma once

#include <atomic>
#include <functional>

#include "core/parallel/pool.h"
#include "core/parallel/side_thread.h"

namespace qdmd {

// A pool for passes over pixels and, unless there is to be one thread only, a thread for the work
// that goes on beside the caller. The work beside may use the pool; while it runs, nobody else
// does, and the caller counts as one of the threads: where it waits, it helps.
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
  // The pool, or null while the work beside has it.
  Pool* idle_pool() { return idle() ? &pool_ : nullptr; }

  // A pass comes in a moment (Pool::rouse), unless the work beside has the pool.
  void rouse() {
    if (idle()) pool_.rouse();
  }

  // SideThread's, of the work beside.
  bool start(std::function<void()> work);
  void finish();
  void abandon() noexcept;
  void rest() noexcept;
  bool idle() { return side_.idle(); }
  // Threads' time that went into the work since start(): that of the thread beside, all of it, and
  // of the caller where it helped.
  Pool::Time::duration done() const;
  // Helps until so much went into it, or it is over.
  void help_until_done(Pool::Time::duration work);

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
  std::function<void()> work_;
  Pool::Time begun_{};
  Pool::Time::duration helped_{};
  // When the newest work was over; not yet: 0.
  std::atomic<Pool::Time::rep> over_{0};
  // The last member: it ends before the pool, which it may use.
  SideThread side_;
};

}  // namespace qdmd
