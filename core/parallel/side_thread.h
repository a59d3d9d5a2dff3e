// SPDX-License-Identifier: LGPL-2.1-or-later
// One piece of work that goes on while its caller does something else.
#pragma once

#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

namespace qdmd {

// Runs one function at a time on a thread of its own, which sleeps between them. All calls come
// from one thread.
class SideThread {
 public:
  // If `active` is false, or the system gives no more threads, start() runs its function itself.
  explicit SideThread(bool active);
  SideThread(const SideThread&) = delete;
  SideThread& operator=(const SideThread&) = delete;
  // Waits for the function that runs; its exception is lost.
  ~SideThread();

  // As `active` of the constructor, from the next start() on. While nothing runs.
  void set_active(bool active);
  // Begins to run `work`; call finish() or abandon() for the work before. True: `work` is already
  // done, because there is no thread.
  bool start(std::function<void()> work);
  // Waits until the work that start() began is done (at once if there is none), and throws on its
  // exception.
  void finish();
  // Waits as finish() does, but forgets the exception: nobody wants the result.
  void abandon() noexcept;
  // Waits as finish() does, but keeps the exception for finish().
  void rest() noexcept { wait(); }
  // Waits until the work that start() began is done, or until the time `then`.
  void wait_until(std::chrono::steady_clock::time_point then);
  // True where nothing runs.
  bool idle();

 private:
  void begin();
  void end();
  void loop() noexcept;
  void run() noexcept;
  void wait();

  std::mutex mutex_;
  std::condition_variable changed_;
  // What the mutex guards; work_ and error_ belong to the thread while busy_.
  bool busy_ = false, stopping_ = false;
  std::function<void()> work_;
  std::exception_ptr error_;
  std::thread thread_;
};

}  // namespace qdmd
