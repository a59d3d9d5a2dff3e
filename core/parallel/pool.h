// SPDX-License-Identifier: LGPL-2.1-or-later
// Threads that wait for work, shared by all passes over pixels.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <type_traits>
#include <vector>

namespace qdmd {

// Runs the parts of one piece of work on several threads, the caller's among them. The others are
// started once. Between calls they look for work for some microseconds, and then sleep: the passes
// of a frame follow each other so quickly that waking a thread would take longer than its parts.
// A thread begins with the parts that it has in every call, so that what it knows of a band of a
// picture is still in its cache in the next pass and in the next frame; then it does what others
// have left. So which thread does which part may differ from call to call: parts must write to
// places of their own, or combine to the same result in any order.
class Pool {
 public:
  // `threads` counts the caller of run(); fewer work where the system starts no more.
  explicit Pool(int threads);
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;
  // Not while run() runs.
  ~Pool();

  // From now on `threads` work. Not while run() runs.
  void resize(int threads);

  // Threads that work, the caller's included; at least 1.
  size_t threads() const { return workers_.size() + 1; }

  // Calls task(part), or task(part, worker) where it takes both, once for each part < `parts`, and
  // returns when all are done. 0 <= worker < threads(), and no two calls with the same worker
  // overlap: what a thread keeps for itself, it keeps there. A task does not throw and does not
  // call run(). Several threads must not call run() at once. Nothing is allocated.
  template <typename Task>
  void run(size_t parts, Task&& task) noexcept {
    using Plain = std::remove_reference_t<Task>;
    const auto call = [](const void* what, size_t part, size_t worker) noexcept {
      auto& plain = *static_cast<Plain*>(const_cast<void*>(what));
      if constexpr (std::is_invocable_v<Plain&, size_t, size_t>)
        plain(part, worker);
      else
        plain(part);
    };
    run_job(parts, {call, std::addressof(task)});
  }

  // run() comes in a moment: threads that sleep look for work again. To wake them takes so long
  // that a first short pass would be over before they begin.
  void rouse();

  // The calling thread is going to give another one work to do that calls run(), and goes on
  // beside it. Until open_place(), one thread fewer helps there, so that there are never more at
  // work than cores; help() takes its place. Not while run() runs.
  void keep_place();
  // That work is over. From any thread, while no run() runs.
  void open_place();
  using Time = std::chrono::steady_clock::time_point;
  // The calling thread has nothing else to do: it does its share of the work for which a place is
  // kept, until open_place() or, about, the time `then`. Returns for how long there was something
  // to do.
  Time::duration help(Time then = Time::max()) noexcept;

 private:
  struct Job {
    void (*call)(const void* task, size_t part, size_t worker) noexcept = nullptr;
    const void* task = nullptr;
  };
  // The parts that a thread begins with: `next` to `end` are not begun yet.
  struct alignas(64) Share {
    std::atomic<size_t> next{0};
    size_t end = 0;
  };
  // Where one thread sleeps. The last one is for help().
  using Bed = std::condition_variable;

  void start(int threads);
  void stop();
  void run_job(size_t parts, Job job) noexcept;
  void work(size_t worker) noexcept;
  void join(size_t worker, Time then, std::unique_lock<std::mutex>* lock) noexcept;
  void share_out(size_t parts);
  void do_parts(const Job& job, size_t worker, Time then) noexcept;
  template <typename Ready>
  void await(std::unique_lock<std::mutex>* lock, Bed* bed, Time then, const Ready& ready) noexcept;
  void wake(size_t worker) { beds_[worker - 1].notify_one(); }
  void change() { changes_.fetch_add(1, std::memory_order_release); }

  std::mutex mutex_;
  Bed idle_, helper_;
  std::unique_ptr<Bed[]> beds_;  // of the workers
  // What the mutex guards.
  Job job_;                  // open to workers where `call` is set
  uint64_t jobs_begun_ = 0;  // a worker joins each of them at most once
  uint64_t roused_ = 0;      // calls of rouse()
  size_t busy_ = 0;          // workers inside job_
  bool stopping_ = false;
  bool kept_ = false;     // the last worker's place
  bool helping_ = false;  // somebody waits in it

  std::atomic<uint64_t> changes_{0};  // of the above: what those look at who do not sleep yet
  std::unique_ptr<Share[]> shares_;   // of the caller of run(), and of the workers
  bool may_look_ = false;             // there is a core for each thread
  std::vector<std::thread> workers_;
};

}  // namespace qdmd
