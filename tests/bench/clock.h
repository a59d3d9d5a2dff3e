// SPDX-License-Identifier: LGPL-2.1-or-later
// What the benchmarks measure with.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <vector>

namespace qdmd::bench {

inline double seconds_on(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Seconds that all threads of this process spent on a core: what others take of the machine is not
// in it.
inline double cpu_seconds() { return seconds_on(CLOCK_PROCESS_CPUTIME_ID); }

template <typename Work>
double seconds_of(Work&& work, clockid_t clock = CLOCK_MONOTONIC) {
  const double start = seconds_on(clock);
  work();
  return seconds_on(clock) - start;
}

// How often the programs that compare things in turn do so: the variable QDMD_BENCH_TURNS.
inline int turns_asked_for() {
  const char* asked = std::getenv("QDMD_BENCH_TURNS");
  return asked ? std::max(1, std::atoi(asked)) : 7;
}

// The value below which a share of `values` lies; 0 of none.
inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto index = static_cast<size_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  const auto place = values.begin() + static_cast<ptrdiff_t>(index);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

inline double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

}  // namespace qdmd::bench
