// SPDX-License-Identifier: LGPL-2.1-or-later
// Prints the table of docs/notebook/numerics.md: each hard case, each solver, against 50 digits.
#include <cstdio>
#include <string>

#include "tests/stability/assessment.h"

namespace {

using qdmd::Amplitude;
using qdmd::Solver;
using namespace qdmd::stability;

std::string power_of_ten(double value) {
  char text[32];
  if (value < 1e-30) return "0";
  if (!(value < 1e300)) return "any";
  std::snprintf(text, sizeof text, "%.0e", value);
  return text;
}

std::string cell(const Assessment& assessment, Solver solver) {
  for (const auto& result : assessment.solvers) {
    if (result.solver != solver) continue;
    std::string text =
        power_of_ten(result.lambda_error) + " / " + power_of_ten(result.background_error);
    if (result.dropped) text += " (rank " + std::to_string(result.rank) + ")";
    return text;
  }
  return "too large";
}

}  // namespace

int main() {
  std::printf(
      "| case | what is hard | m, rank, condition of X | condition of the problem | gram | "
      "gram-extended | qr | adjoint |\n|---|---|---|---|---|---|---|---|\n");
  for (const auto& hard_case : hard_cases()) {
    std::fprintf(stderr, "%s\n", hard_case.name.c_str());
    const Assessment a = assess(hard_case, Amplitude::window);
    std::printf("| %s | %s | %d, %d, %.1e | %s |", hard_case.name.c_str(), hard_case.hard.c_str(),
                a.frames, a.rank, a.condition, power_of_ten(a.sensitivity).c_str());
    for (Solver solver : {Solver::gram, Solver::gram_extended, Solver::qr, Solver::adjoint})
      std::printf(" %s |", cell(a, solver).c_str());
    std::printf("\n");
    std::fflush(stdout);
  }
}
