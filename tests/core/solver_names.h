// SPDX-License-Identifier: LGPL-2.1-or-later
// Solvers by the names that users see.
#pragma once

#include "core/dmd/options.h"

namespace qdmd::test {

inline const char* name_of(Solver solver) {
  switch (solver) {
    case Solver::gram:
      return "gram";
    case Solver::gram_extended:
      return "gram-extended";
    case Solver::qr:
      return "qr";
    case Solver::adjoint:
      return "adjoint";
    case Solver::automatic:
      return "auto";
  }
  return "";
}

}  // namespace qdmd::test
