// SPDX-License-Identifier: LGPL-2.1-or-later
// A recording, stretch after stretch, by as many processes as there are.
#pragma once

#include <cstdint>
#include <string>

#include "examples/archive/separation.h"

namespace qdmd::archive {

struct JobOptions : SeparationOptions {
  int64_t stretch = 0;   // frames; 0: chosen
  int64_t warm_up = -1;  // frames; below 0: chosen
  int jobs = 1;          // processes that this one starts, if above 1
  // Of so many shares, this process does one, from 1 on; 0: whatever nobody else does.
  int part = 0, parts = 0;
  bool join = false;  // only that
  bool resume = false;
  std::string report;  // a file of JSON, "-" for standard output; empty: none
  bool quiet = false;
};

// argv: of this program, for processes that it starts. Returns its exit status. Throws
// std::invalid_argument or std::runtime_error with a sentence for the user.
int run_job(const JobOptions& options, char** argv);

}  // namespace qdmd::archive
