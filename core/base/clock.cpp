// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/base/clock.h"

namespace qdmd {
namespace {

thread_local Clock::Span* innermost = nullptr;

}  // namespace

Clock::Spent Clock::spent() const {
  Spent spent;
  for (size_t work = 0; work < kWorks; ++work)
    spent.seconds_[work] =
        1e-9 * static_cast<double>(nanoseconds_[work].load(std::memory_order_relaxed));
  return spent;
}

void Clock::charge(Work work, double seconds) {
  nanoseconds_[work].fetch_add(static_cast<int64_t>(1e9 * seconds), std::memory_order_relaxed);
}

Clock::Span::Span(Clock& clock, Work work)
    : clock_(clock), work_(work), outer_(innermost), start_(std::chrono::steady_clock::now()) {
  if (outer_) outer_->charge(start_);
  innermost = this;
}

Clock::Span::~Span() {
  const Time now = std::chrono::steady_clock::now();
  charge(now);
  if (outer_) outer_->start_ = now;
  innermost = outer_;
}

void Clock::Span::charge(Time now) {
  const auto nanoseconds =
      std::chrono::duration_cast<std::chrono::nanoseconds>(now - start_).count();
  clock_.nanoseconds_[work_].fetch_add(nanoseconds, std::memory_order_relaxed);
}

}  // namespace qdmd
