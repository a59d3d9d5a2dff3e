// SPDX-License-Identifier: LGPL-2.1-or-later
#include "examples/archive/launch.h"

#include <signal.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <thread>
#include <vector>

namespace qdmd::archive {
namespace {

constexpr const char* kChild = "QDMD_ARCHIVE_CHILD_OF";
// Processes that are killed one after another: something is wrong that starting does not mend.
constexpr int kMostDeaths = 3;

const char* variable(const char* name) {
  const char* const text = std::getenv(name);
  return text && *text ? text : nullptr;
}

pid_t start(char** argv) {
  pid_t process = 0;
  if (posix_spawn(&process, "/proc/self/exe", nullptr, nullptr, argv, environ) != 0)
    throw std::runtime_error("no process can be started");
  return process;
}

void end_all(const std::vector<pid_t>& processes) {
  for (pid_t process : processes) kill(process, SIGKILL);
  for (pid_t process : processes) waitpid(process, nullptr, 0);
}

}  // namespace

Ranks ranks_of_environment() {
  // Open MPI; any PMIx and PMI (Slurm, MPICH); and what Slurm says itself of a step.
  static constexpr const char* kRanks[][2] = {{"OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"},
                                              {"PMI_RANK", "PMI_SIZE"},
                                              {"SLURM_PROCID", "SLURM_STEP_NUM_TASKS"}};
  for (const auto& [rank, size] : kRanks) {
    if (!variable(rank) || !variable(size)) continue;
    Ranks ranks = {std::atoi(variable(rank)), std::atoi(variable(size)), ""};
    for (const char* name :
         {"PMIX_NAMESPACE", "PMI_JOBID", "SLURM_JOB_ID", "SLURM_STEP_ID", "SLURM_RESTART_COUNT"})
      if (const char* const text = variable(name)) ranks.job += std::string(text) + " ";
    if (ranks.size > 1) return ranks;
  }
  return {};
}

bool is_child() {
  const char* const parent = variable(kChild);
  if (!parent) return false;
  // Nobody goes on where the process that shares the work out is gone.
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != std::atoi(parent)) std::_Exit(1);
  return true;
}

int run_processes(int count, char** argv, const std::function<void()>& meanwhile) {
  setenv(kChild, std::to_string(getpid()).c_str(), 1);
  std::vector<pid_t> processes;
  for (int i = 0; i < count; ++i) processes.push_back(start(argv));
  int deaths = 0;
  try {
    while (!processes.empty()) {
      int state = 0;
      const pid_t ended = waitpid(-1, &state, WNOHANG);
      if (ended <= 0) {
        meanwhile();
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
        continue;
      }
      processes.erase(std::remove(processes.begin(), processes.end(), ended), processes.end());
      if (WIFSIGNALED(state) && ++deaths <= kMostDeaths) {
        std::fprintf(stderr,
                     "qdmd-archive: process %d was ended by signal %d: its stretch is done "
                     "again\n",
                     ended, WTERMSIG(state));
        processes.push_back(start(argv));
      } else if (WIFSIGNALED(state) || WEXITSTATUS(state) != 0) {
        end_all(processes);
        return WIFSIGNALED(state) ? 1 : WEXITSTATUS(state);
      }
    }
  } catch (...) {
    end_all(processes);
    throw;
  }
  return 0;
}

}  // namespace qdmd::archive
