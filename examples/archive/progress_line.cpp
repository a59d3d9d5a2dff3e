// SPDX-License-Identifier: LGPL-2.1-or-later
#include "examples/archive/progress_line.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <string>

namespace qdmd::archive {
namespace {

std::string duration_text(double seconds) {
  char text[48];
  if (seconds < 90)
    std::snprintf(text, sizeof text, "%.0f s", seconds);
  else if (seconds < 5400)
    std::snprintf(text, sizeof text, "%.0f min", seconds / 60);
  else
    std::snprintf(text, sizeof text, "%.1f h", seconds / 3600);
  return text;
}

}  // namespace

ProgressLine::ProgressLine(bool quiet)
    : quiet_(quiet), terminal_(isatty(STDERR_FILENO) != 0), begin_(Clock::now()), said_(begin_) {}

void ProgressLine::begin(double share) {
  begun_at_ = share;
  begin_ = Clock::now();
}

bool ProgressLine::is_time() const {
  return !quiet_ && Clock::now() - said_ >= std::chrono::seconds(terminal_ ? 1 : 5);
}

void ProgressLine::show(double share, int64_t frames, int64_t all) {
  said_ = Clock::now();
  const double seconds = std::chrono::duration<double>(said_ - begin_).count();
  const double done = share - begun_at_;
  std::string text = std::to_string(frames) + " frames";
  if (all > 0) {
    char part[64];
    std::snprintf(part, sizeof part, " of %lld, %.1f %%", static_cast<long long>(all), 100 * share);
    text += part;
    // The first frames come after the first window.
    if (done > 0) text += ", about " + duration_text(seconds * (1 - share) / done) + " left";
  }
  std::fprintf(stderr, "%s%s%s", terminal_ ? "\r\033[K" : "", text.c_str(), terminal_ ? "" : "\n");
  std::fflush(stderr);
  open_ = terminal_;
}

void ProgressLine::say(const char* what) {
  if (quiet_) return;
  std::fprintf(stderr, "%s%s%s", terminal_ ? "\r\033[K" : "", what, terminal_ ? "" : "\n");
  std::fflush(stderr);
  open_ = terminal_;
}

void ProgressLine::end() {
  if (open_) std::fputs("\r\033[K", stderr);
  open_ = false;
}

}  // namespace qdmd::archive
