// Inner products by several threads.
#pragma once

#include "core/gram/kernel.h"

namespace qdmd {

// kernel.dot_products by up to `threads` threads, the caller's among them; fewer where the work is
// too small or no more can be started. The same bits for any number. Throws std::bad_alloc.
void parallel_dot_products(const Kernel& kernel, int threads, const uint8_t* const* rows,
                           size_t row_count, const uint8_t* const* cols, size_t col_count,
                           size_t length, int64_t* out);

}  // namespace qdmd
