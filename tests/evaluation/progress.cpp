// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/evaluation/progress.h"

#include <unistd.h>

#include <cstdio>

namespace qdmd::evaluation {

Progress::Progress() : terminal_(isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() { clear_line(); }

void Progress::start(size_t jobs) {
  const std::lock_guard lock(mutex_);
  jobs_ = jobs;
}

void Progress::finish_job(const std::string& what) {
  const std::lock_guard lock(mutex_);
  clear_line();
  std::fprintf(stderr, "%zu/%zu %s%s", ++finished_, jobs_, what.c_str(), terminal_ ? "" : "\n");
  std::fflush(stderr);
  line_is_open_ = terminal_;
}

void Progress::problem(const std::string& sequence, const std::string& what) {
  const std::lock_guard lock(mutex_);
  clear_line();
  ++problems_;
  std::fprintf(stderr, "%s: %s\n", sequence.c_str(), what.c_str());
}

size_t Progress::problems() const {
  const std::lock_guard lock(mutex_);
  return problems_;
}

void Progress::end() {
  const std::lock_guard lock(mutex_);
  clear_line();
}

void Progress::clear_line() {
  if (line_is_open_) std::fputs("\r\033[K", stderr);
  line_is_open_ = false;
}

}  // namespace qdmd::evaluation
