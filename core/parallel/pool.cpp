#include "core/parallel/pool.h"

#include <algorithm>
#include <exception>

namespace qdmd {

Pool::Pool(int threads) { start(threads); }

Pool::~Pool() { stop(); }

void Pool::resize(int threads) {
  stop();
  start(threads);
}

void Pool::start(int threads) {
  const auto wanted = static_cast<size_t>(std::max(threads, 1)) - 1;
  try {
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
  }
  wake_.notify_all();
  for (std::thread& worker : workers_) worker.join();
  workers_.clear();
  stopping_ = false;
}

void Pool::do_parts(const Job& job, size_t parts, size_t worker) noexcept {
  for (;;) {
    // The mutex, which every worker takes before and after, orders what the parts read and write.
    const size_t part = next_part_.fetch_add(1, std::memory_order_relaxed);
    if (part >= parts) return;
    job.call(job.task, part, worker);
  }
}

void Pool::run_job(size_t parts, Job job) noexcept {
  const size_t helpers = std::min(workers_.size(), parts - std::min<size_t>(parts, 1));
  if (helpers == 0) {
    for (size_t part = 0; part < parts; ++part) job.call(job.task, part, 0);
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    job_ = job;
    parts_ = parts;
    ++jobs_begun_;
    next_part_.store(0, std::memory_order_relaxed);
  }
  for (size_t k = 0; k < helpers; ++k) wake_.notify_one();
  do_parts(job, parts, 0);
  std::unique_lock lock(mutex_);
  // A worker that has not woken by now finds nothing to do: only those inside are waited for.
  job_ = {};
  idle_.wait(lock, [this] { return busy_ == 0; });
}

void Pool::work(size_t worker) noexcept {
  uint64_t seen = 0;
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [&] { return stopping_ || (job_.call && jobs_begun_ != seen); });
    if (stopping_) return;
    seen = jobs_begun_;
    const Job job = job_;
    const size_t parts = parts_;
    ++busy_;
    lock.unlock();
    do_parts(job, parts, worker);
    lock.lock();
    if (--busy_ == 0) idle_.notify_one();
  }
}

}  // namespace qdmd
