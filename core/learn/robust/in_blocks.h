// SPDX-License-Identifier: LGPL-2.1-or-later
// Loops over cells, some at a time: plain loops inside, which the compiler makes vectors of.
#pragma once

#include <cstddef>

namespace qdmd {

// Cells that are looked at together.
constexpr size_t kTogether = 64;

// Calls work(first, count) for blocks of cells; for most of them `count` is a constant, which
// compilers make better loops of.
template <typename Work>
void in_blocks(size_t cells, const Work& work) {
  size_t first = 0;
  for (; first + kTogether <= cells; first += kTogether) work(first, kTogether);
  if (first < cells) work(first, cells - first);
}

}  // namespace qdmd
