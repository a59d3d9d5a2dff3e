// SPDX-License-Identifier: LGPL-2.1-or-later
// Which of the allocations that allocator.h saw a test lets fail, one trial each, and what is said
// where one ends the process.
//
// Short: of all cases together the first allocation of each place in the code.
//   QDMD_LONG=1      every allocation of each case
//   QDMD_SHOW_OOM=1  how many there are, case by case
#pragma once

#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <string>
#include <vector>

#include "tests/core/allocator.h"

namespace qdmd::test {

inline const bool kLongTrials = std::getenv("QDMD_LONG") != nullptr;

// The trial's name is printed where the process ends in the middle.
inline std::string& trial_name() {
  static std::string name;
  return name;
}

inline void report_trial(int signal) {
  allocator::stop();
  std::signal(signal, SIG_DFL);
  std::fprintf(stderr, "ended: %s; what failed:\n", trial_name().c_str());
  allocator::print_failed();
  std::raise(signal);
}

// Which of the first `last` allocations since allocator::note_places() are to fail.
inline std::vector<int64_t> allocations_to_try(const std::string& what, int64_t last) {
  static std::set<uint64_t> tried;
  std::vector<int64_t> numbers;
  for (int64_t n = 1; n <= last; ++n)
    if (kLongTrials || tried.insert(allocator::place(n)).second) numbers.push_back(n);
  if (std::getenv("QDMD_SHOW_OOM")) {
    std::printf("%s: %zu of %ld allocations\n", what.c_str(), numbers.size(),
                static_cast<long>(last));
    std::fflush(stdout);
  }
  return numbers;
}

// How allocation n fails: in the long form alone and, where a case asks for it, with all after it.
inline std::vector<allocator::Failing> ways_to_fail(int64_t n, bool also_all) {
  using allocator::Failing;
  if (!kLongTrials) return {n % 3 == 0 ? Failing::all : Failing::one};
  if (also_all) return {Failing::one, Failing::all};
  return {Failing::one};
}

inline std::string trial_suffix(int64_t n, allocator::Failing failing) {
  return ", allocation " + std::to_string(n) +
         (failing == allocator::Failing::one ? "" : " and all after it");
}

}  // namespace qdmd::test
