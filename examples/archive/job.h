// A recording, window after window, shared by the processes of a job.
#pragma once

#include <string>
#include <vector>

#include "core/engine/engine.h"
#include "examples/archive/mpi_team.h"
#include "examples/archive/outputs.h"

namespace qdmd::archive {

struct JobOptions {
  std::vector<std::string> recordings;  // files, or one folder of pictures
  std::vector<Wanted> wanted;
  EngineOptions engine;
  Shadows shadows = Shadows::background;
  double absorb_time = 300;  // seconds; 0: never
  double rate = 25;          // of pictures, frames a second
  std::string encoder = kLossless;
  bool resume = false;
  std::string report;  // a file of JSON, "-" for standard output; empty: none
  bool quiet = false;
};

// team: null where this process is alone. Throws std::invalid_argument or std::runtime_error with a
// sentence for the user.
void run_job(const JobOptions& options, MpiTeam* team);

}  // namespace qdmd::archive
