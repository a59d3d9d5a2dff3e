// SPDX-License-Identifier: LGPL-2.1-or-later
// Progress and problems on standard error: one line that changes on a terminal, else a line a job.
#pragma once

#include <mutex>
#include <string>

namespace qdmd::evaluation {

class Progress {
 public:
  Progress();
  ~Progress();

  void start(size_t jobs);
  void finish_job(const std::string& what);
  // A sentence that names its sequence; printed once.
  void problem(const std::string& sequence, const std::string& what);
  size_t problems() const;
  // Ends the line on a terminal: other output follows.
  void end();

 private:
  void clear_line();

  mutable std::mutex mutex_;
  const bool terminal_;
  size_t jobs_ = 0, finished_ = 0, problems_ = 0;
  bool line_is_open_ = false;
};

}  // namespace qdmd::evaluation
