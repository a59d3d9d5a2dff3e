// What the benchmarks measure with.
#pragma once

#include <algorithm>
#include <chrono>
#include <vector>

namespace qdmd::bench {

inline double seconds() {
  using namespace std::chrono;
  return duration<double>(steady_clock::now().time_since_epoch()).count();
}

template <typename Work>
double seconds_of(Work&& work) {
  const double start = seconds();
  work();
  return seconds() - start;
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
