// SPDX-License-Identifier: LGPL-2.1-or-later
// What a target demands: a process that breaks it ends, with a sentence.
#pragma once

#include <cstdio>
#include <cstdlib>

#define QDMD_DEMAND(condition)                                                     \
  do {                                                                             \
    if (!(condition)) {                                                            \
      std::fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                \
    }                                                                              \
  } while (false)
