// SPDX-License-Identifier: LGPL-2.1-or-later
// Highway, for a file that is compiled once for each instruction set. No include guard: each time
// includes it again. Before it:
//     #undef HWY_TARGET_INCLUDE
//     #define HWY_TARGET_INCLUDE "core/passes/this_file.cpp"
// A file that wants other instruction sets than these defines HWY_DISABLED_TARGETS before that.

// Never the best, or with vectors whose size the compiler does not know.
#ifndef HWY_DISABLED_TARGETS
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#endif
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/cache_control.h>
#include <hwy/highway.h>
