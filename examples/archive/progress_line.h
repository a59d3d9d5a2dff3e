// SPDX-License-Identifier: LGPL-2.1-or-later
// What a job says while it runs: how far it is, and how long it still takes.
#pragma once

#include <chrono>
#include <cstdint>

namespace qdmd::archive {

// On standard error: one line that changes on a terminal, else a line now and then.
class ProgressLine {
 public:
  explicit ProgressLine(bool quiet);

  // Work begins where that share of the recording was read, 0 .. 1.
  void begin(double share);
  // True when something is to be shown again.
  bool is_time() const;
  // Of so many frames in all; 0: nobody knows.
  void show(double share, int64_t frames, int64_t all);
  void say(const char* what);
  void end();

 private:
  using Clock = std::chrono::steady_clock;

  bool quiet_, terminal_, open_ = false;
  double begun_at_ = 0;
  Clock::time_point begin_, said_;
};

}  // namespace qdmd::archive
