// SPDX-License-Identifier: LGPL-2.1-or-later
// Inner products by register tiles, for each vector instruction set.
#pragma once

#include <vector>

#include "core/gram/kernel.h"

namespace qdmd {

// The kernels that this machine can run, the fastest first. May be empty.
std::vector<Kernel> tile_kernels();

}  // namespace qdmd
