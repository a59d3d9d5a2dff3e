// SPDX-License-Identifier: LGPL-2.1-or-later
// Windows larger than a machine: the processes of an MPI job have some rows of each picture.
#pragma once

#include "examples/archive/job.h"

namespace qdmd::archive {

// Writes the background of each window, which is that of one process to the last bit: only sums of
// integers go from process to process, and rows of the pictures. Method qdmd and dmd, and nothing
// but --background x.png. Returns the exit status. Throws std::invalid_argument or
// std::runtime_error with a sentence for the user; where processes wait for this one, the job is
// ended.
int run_rows(const JobOptions& options, int* argc, char*** argv);

}  // namespace qdmd::archive
