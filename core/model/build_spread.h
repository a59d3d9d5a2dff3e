// SPDX-License-Identifier: LGPL-2.1-or-later
// A model's pictures from frames whose pixels share samples of chroma.
#pragma once

#include "core/model/background_model.h"
#include "core/parallel/pool.h"
#include "core/planes/snapshot_range.h"

namespace qdmd {

// BackgroundModel::build_from() with such snapshots, after begin_from(): samples are spread to
// pixels a run at a time. Throws std::bad_alloc.
void build_spread(const SnapshotRange& snapshots, size_t first, size_t count, Pool* pool,
                  BackgroundModel* model);
// The bytes that this takes.
uint64_t build_spread_bytes(int snapshots, int threads);

}  // namespace qdmd
