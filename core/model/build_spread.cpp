// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/model/build_spread.h"

#include <algorithm>
#include <memory>

#include "core/passes/bands.h"
#include "core/passes/digits.h"
#include "core/passes/read_samples.h"
#include "core/planes/read_ahead.h"

namespace qdmd {
namespace {

// Pixels of all snapshots that are spread at once: they stay in the second-level cache.
constexpr size_t kRun = 1024;

// Where samples of snapshot t are: in `room`, which has space for kRun of them, or elsewhere.
const uint8_t* read(const SnapshotRange& snapshots, int t, int channel, size_t first, size_t count,
                    uint8_t* room) {
  return read_samples(snapshots, t, channel, first, count, room);
}
const uint16_t* read(const SnapshotRange& snapshots, int t, int channel, size_t first, size_t count,
                     uint16_t* room) {
  uint8_t spread[2][kRun];
  join_digits(read_whole_samples(snapshots, t, channel, first, count, {spread[0], spread[1]}),
              snapshots.depth(), count, room);
  return room;
}

template <typename Sample>
void build_runs(const SnapshotRange& snapshots, size_t first, size_t count, Pool* pool,
                BackgroundModel* model) {
  constexpr size_t kUnit = BackgroundModel::kSliceUnit;
  const size_t planes_of_run = kChannels * static_cast<size_t>(snapshots.size());
  // Taken here: tasks of the pool take no memory.
  const auto room =
      std::make_unique_for_overwrite<Sample[]>(planes_of_run * kRun * pool->threads());
  const auto planes =
      std::make_unique_for_overwrite<const Sample*[]>(planes_of_run * pool->threads());
  const auto parts = static_cast<int>(std::max<size_t>(1, count / kWorthAThread));
  ReadAhead ahead(snapshots, pool->threads());
  pool->run(static_cast<size_t>(parts), [&](size_t part, size_t worker) {
    const Slice slice = {static_cast<int>(part), parts};
    const size_t begin = first + slice.first(count, kUnit), end = begin + slice.size(count, kUnit);
    const Sample** const of_run = planes.get() + worker * planes_of_run;
    for (size_t p = begin; p < end; p += kRun) {
      const size_t length = std::min(kRun, end - p);
      ahead.read(worker, p, length);
      Sample* to = room.get() + worker * planes_of_run * kRun;
      for (int t = 0; t < snapshots.size(); ++t)
        for (int c = 0; c < kChannels; ++c, to += kRun)
          of_run[kChannels * t + c] = read(snapshots, t, c, p, length, to);
      model->build_from(of_run, p, length);
    }
  });
}

}  // namespace

uint64_t build_spread_bytes(int snapshots, int threads) {
  return static_cast<uint64_t>(threads) * static_cast<uint64_t>(snapshots) * kChannels *
         (kRun + sizeof(uint8_t*));
}

void build_spread(const SnapshotRange& snapshots, size_t first, size_t count, Pool* pool,
                  BackgroundModel* model) {
  if (snapshots.depth() == 8)
    build_runs<uint8_t>(snapshots, first, count, pool, model);
  else
    build_runs<uint16_t>(snapshots, first, count, pool, model);
}

}  // namespace qdmd
