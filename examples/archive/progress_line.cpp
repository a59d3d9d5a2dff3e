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

void ProgressLine::show(double share, int64_t frames, int64_t window) {
  const Clock::time_point now = Clock::now();
  if (quiet_ || now - said_ < std::chrono::seconds(terminal_ ? 1 : 5)) return;
  said_ = now;
  const double seconds = std::chrono::duration<double>(now - begin_).count();
  const double done = std::max(share - begun_at_, 1e-6), left = std::max(1 - share, 0.0);
  std::fprintf(stderr, "%s%lld frames, window %lld, %.1f %%, about %s left%s",
               terminal_ ? "\r\033[K" : "", static_cast<long long>(frames),
               static_cast<long long>(window), 100 * share,
               duration_text(seconds * left / done).c_str(), terminal_ ? "" : "\n");
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
