// SPDX-License-Identifier: LGPL-2.1-or-later
// Processes that work on the same job: those that mpirun or srun started, and those that this one
// starts.
#pragma once

#include <functional>
#include <string>

namespace qdmd::archive {

// What mpirun, srun or the like say of this process.
struct Ranks {
  int rank = 0, size = 1;
  std::string job;  // another one for each start; empty: nobody started several
};
Ranks ranks_of_environment();

// True in a process that run_processes() started.
bool is_child();

// Starts this program `count` times more, and again where one is killed, and waits for them.
// meanwhile: called now and then. Returns the exit status of the first that fails, whereupon the
// others are ended, or 0. Throws std::runtime_error.
int run_processes(int count, char** argv, const std::function<void()>& meanwhile);

}  // namespace qdmd::archive
