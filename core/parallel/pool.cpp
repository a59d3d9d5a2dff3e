// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/parallel/pool.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <exception>

namespace qdmd {
namespace {

// How long threads look for work before they sleep: several times what it takes to wake one, and
// as long as the work of one thread between two passes of a frame.
constexpr std::chrono::microseconds kLook{100};
// Looks between two glances at the clock.
constexpr int kGlance = 32;

}  // namespace

Pool::Pool(int threads) { start(threads); }

Pool::~Pool() { stop(); }

void Pool::resize(int threads) {
  stop();
  start(threads);
}

void Pool::start(int threads) {
  const auto wanted = static_cast<size_t>(std::max(threads, 1)) - 1;
  may_look_ = wanted < std::thread::hardware_concurrency();
  try {
    beds_ = std::make_unique<Bed[]>(wanted);
    shares_ = std::make_unique<Share[]>(wanted + 1);
    workers_.reserve(wanted);
    for (size_t worker = 1; worker <= wanted; ++worker)
      workers_.emplace_back([this, worker] { work(worker); });
  } catch (const std::exception&) {
    // The system gives no more threads, or no memory for them: those that are there do the work.
  }
}

void Pool::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    change();
  }
  for (size_t worker = 1; worker < threads(); ++worker) wake(worker);
  for (std::thread& worker : workers_) worker.join();
  workers_.clear();
  stopping_ = false;
}

void Pool::share_out(size_t parts) {
  for (size_t worker = 0; worker < threads(); ++worker) {
    shares_[worker].next.store(parts * worker / threads(), std::memory_order_relaxed);
    shares_[worker].end = parts * (worker + 1) / threads();
  }
}

void Pool::do_parts(const Job& job, size_t worker, Time then) noexcept {
  for (size_t i = 0; i < threads(); ++i) {
    Share& share = shares_[(worker + i) % threads()];
    for (;;) {
      // The mutex, which every worker takes before and after, orders what the parts read and write.
      const size_t part = share.next.fetch_add(1, std::memory_order_relaxed);
      if (part >= share.end) break;
      job.call(job.task, part, worker);
      if (then != Time::max() && std::chrono::steady_clock::now() >= then) return;
    }
  }
}

// Returns once ready(), or at the time `then`. ready() looks at what the mutex guards.
template <typename Ready>
void Pool::await(std::unique_lock<std::mutex>* lock, Bed* bed, Time then,
                 const Ready& ready) noexcept {
  if (may_look_) {
    const Time end = std::min(then, std::chrono::steady_clock::now() + kLook);
    while (!ready()) {
      const uint64_t seen = changes_.load(std::memory_order_relaxed);
      lock->unlock();
      bool changed = false, in_time = true;
      while (!changed && in_time) {
        for (int i = 0; i < kGlance && !changed; ++i) {
          hwy::Pause();
          changed = changes_.load(std::memory_order_acquire) != seen;
        }
        in_time = std::chrono::steady_clock::now() < end;
      }
      lock->lock();
      if (!in_time) break;
    }
  }
  if (then == Time::max())
    bed->wait(*lock, ready);
  else
    bed->wait_until(*lock, then, ready);
}

void Pool::run_job(size_t parts, Job job) noexcept {
  const size_t others = std::min(workers_.size(), parts - std::min<size_t>(parts, 1));
  if (others == 0) {
    for (size_t part = 0; part < parts; ++part) job.call(job.task, part, 0);
    return;
  }
  bool helping;
  size_t woken;
  {
    const std::lock_guard lock(mutex_);
    job_ = job;
    share_out(parts);
    ++jobs_begun_;
    helping = helping_;
    woken = std::min(others, workers_.size() - (kept_ ? 1 : 0));
    change();
  }
  for (size_t worker = 1; worker <= woken; ++worker) wake(worker);
  if (helping) helper_.notify_one();
  do_parts(job, 0, Time::max());
  std::unique_lock lock(mutex_);
  // A worker that has not woken by now finds nothing to do: only those inside are waited for.
  job_ = {};
  await(&lock, &idle_, Time::max(), [this] { return busy_ == 0; });
}

// Does parts of the job that is open.
void Pool::join(size_t worker, Time then, std::unique_lock<std::mutex>* lock) noexcept {
  const Job job = job_;
  ++busy_;
  lock->unlock();
  do_parts(job, worker, then);
  lock->lock();
  if (--busy_ == 0) {
    change();
    idle_.notify_one();
  }
}

void Pool::work(size_t worker) noexcept {
  uint64_t seen = 0, roused = 0;
  std::unique_lock lock(mutex_);
  const auto may_join = [&] {
    return job_.call && jobs_begun_ != seen && !(kept_ && worker == workers_.size());
  };
  for (;;) {
    await(&lock, &beds_[worker - 1], Time::max(),
          [&] { return stopping_ || may_join() || roused_ != roused; });
    if (stopping_) return;
    roused = roused_;
    if (!may_join()) continue;
    seen = jobs_begun_;
    join(worker, Time::max(), &lock);
  }
}

void Pool::rouse() {
  if (!may_look_) return;
  {
    const std::lock_guard lock(mutex_);
    ++roused_;
    change();
  }
  for (size_t worker = 1; worker < threads(); ++worker) wake(worker);
}

void Pool::keep_place() {
  const std::lock_guard lock(mutex_);
  kept_ = !workers_.empty();
}

void Pool::open_place() {
  {
    const std::lock_guard lock(mutex_);
    kept_ = false;
    change();
  }
  helper_.notify_one();
}

Pool::Time::duration Pool::help(Time then) noexcept {
  Time::duration worked{};
  std::unique_lock lock(mutex_);
  helping_ = true;
  uint64_t seen = 0;
  while (kept_ && std::chrono::steady_clock::now() < then) {
    await(&lock, &helper_, then, [&] { return !kept_ || (job_.call && jobs_begun_ != seen); });
    if (!kept_ || !job_.call || jobs_begun_ == seen) continue;
    seen = jobs_begun_;
    const Time begun = std::chrono::steady_clock::now();
    join(workers_.size(), then, &lock);
    worked += std::chrono::steady_clock::now() - begun;
  }
  helping_ = false;
  return worked;
}

}  // namespace qdmd
