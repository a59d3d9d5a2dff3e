// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/parallel/side_thread.h"

#include <exception>
#include <utility>

namespace qdmd {

SideThread::SideThread(bool active) {
  if (active) begin();
}

SideThread::~SideThread() { end(); }

void SideThread::set_active(bool active) {
  if (active == thread_.joinable()) return;
  if (active)
    begin();
  else
    end();
}

void SideThread::begin() {
  try {
    thread_ = std::thread([this] { loop(); });
  } catch (const std::exception&) {
    // No thread, or no memory for one: start() does the work itself.
  }
}

void SideThread::end() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
  stopping_ = false;
}

void SideThread::run() noexcept {
  try {
    work_();
  } catch (...) {
    error_ = std::current_exception();
  }
}

void SideThread::loop() noexcept {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return busy_ || stopping_; });
    if (!busy_) return;
    lock.unlock();
    run();
    lock.lock();
    busy_ = false;
    changed_.notify_all();
  }
}

bool SideThread::start(std::function<void()> work) {
  work_ = std::move(work);
  if (!thread_.joinable()) {
    run();
    return true;
  }
  {
    const std::lock_guard lock(mutex_);
    busy_ = true;
  }
  changed_.notify_all();
  return false;
}

bool SideThread::idle() {
  const std::lock_guard lock(mutex_);
  return !busy_;
}

void SideThread::wait() {
  if (!thread_.joinable()) return;
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !busy_; });
}

void SideThread::wait_until(std::chrono::steady_clock::time_point then) {
  if (!thread_.joinable()) return;
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, then, [this] { return !busy_; });
}

void SideThread::abandon() noexcept {
  wait();
  error_ = nullptr;
}

void SideThread::finish() {
  wait();
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

}  // namespace qdmd
