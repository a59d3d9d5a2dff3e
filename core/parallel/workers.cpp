// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/parallel/workers.h"

#include <algorithm>
#include <thread>
#include <utility>

namespace qdmd {
namespace {

using Steady = std::chrono::steady_clock;

}  // namespace

int Workers::count(int threads) {
  if (threads > 0) return std::min(threads, kMost);
  // Zero where the system does not tell.
  return static_cast<int>(
      std::clamp<unsigned>(std::thread::hardware_concurrency(), 1, unsigned{kMost}));
}

Workers::Workers(int threads, bool beside)
    : threads_(threads),
      asked_(threads),
      beside_(beside),
      pool_(count(threads)),
      side_(may_work_beside(threads)) {}

bool Workers::start(std::function<void()> work) {
  struct Place {
    Workers& all;
    ~Place() {
      all.over_ = Steady::now().time_since_epoch().count();
      all.pool_.open_place();
    }
  };
  work_ = std::move(work);
  pool_.keep_place();
  begun_ = Steady::now();
  helped_ = {};
  over_ = 0;
  return side_.start([this] {
    const Place place = {*this};
    // Nothing of it lives on when it is over.
    std::exchange(work_, nullptr)();
  });
}

void Workers::finish() {
  helped_ += pool_.help();
  side_.finish();
}

void Workers::abandon() noexcept {
  helped_ += pool_.help();
  side_.abandon();
}

void Workers::rest() noexcept {
  helped_ += pool_.help();
  side_.rest();
}

Pool::Time::duration Workers::done() const {
  const Pool::Time::rep over = over_;
  const Pool::Time end = over ? Pool::Time(Pool::Time::duration(over)) : Steady::now();
  return end - begun_ + helped_;
}

void Workers::help_until_done(Pool::Time::duration work) {
  // What is less is not worth a wait.
  constexpr std::chrono::microseconds kLeast{50};
  for (;;) {
    const Pool::Time::duration missing = work - done();
    if (idle() || missing < kLeast) return;
    // Two threads do twice as much, unless there is nothing to help with.
    const Pool::Time then = Steady::now() + missing / 2;
    helped_ += pool_.help(then);
    side_.wait_until(then);
  }
}

void Workers::follow() {
  if (asked_ == threads_ || !side_.idle()) return;
  threads_ = asked_;
  pool_.resize(count(threads_));
  side_.set_active(may_work_beside(threads_));
}

// A core that all threads share goes from one to the other: frames pass while a solve goes on.
bool Workers::may_work_beside(int threads) const { return beside_ && threads != 1; }

}  // namespace qdmd
