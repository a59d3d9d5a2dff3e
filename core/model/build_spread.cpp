#include "core/model/build_spread.h"

#include <algorithm>
#include <memory>

#include "core/passes/bands.h"
#include "core/passes/digits.h"
#include "core/passes/read_samples.h"

namespace qdmd {
namespace {

// Pixels of all snapshots that are spread at once: they stay in the second-level cache.
constexpr size_t kRun = 1024;

// `read(t, channel, first, count, room)` says where samples of snapshot t are: in `room`, which has
// space for kRun of them, or elsewhere.
template <typename Sample, typename Read>
void build_runs(int snapshots, size_t first, size_t count, const Read& read, Pool* pool,
                BackgroundModel* model) {
  constexpr size_t kUnit = BackgroundModel::kSliceUnit;
  const size_t planes_of_run = kChannels * static_cast<size_t>(snapshots);
  // Taken here: tasks of the pool take no memory.
  const auto room =
      std::make_unique_for_overwrite<Sample[]>(planes_of_run * kRun * pool->threads());
  const auto planes =
      std::make_unique_for_overwrite<const Sample*[]>(planes_of_run * pool->threads());
  const auto parts = static_cast<int>(std::max<size_t>(1, count / kWorthAThread));
  pool->run(static_cast<size_t>(parts), [&](size_t part, size_t worker) {
    const Slice slice = {static_cast<int>(part), parts};
    const size_t begin = first + slice.first(count, kUnit), end = begin + slice.size(count, kUnit);
    const Sample** const of_run = planes.get() + worker * planes_of_run;
    for (size_t p = begin; p < end; p += kRun) {
      const size_t length = std::min(kRun, end - p);
      Sample* to = room.get() + worker * planes_of_run * kRun;
      for (int t = 0; t < snapshots; ++t)
        for (int c = 0; c < kChannels; ++c, to += kRun)
          of_run[kChannels * t + c] = read(t, c, p, length, to);
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
  if (snapshots.low_bits() == 0) {
    build_runs<uint8_t>(
        snapshots.size(), first, count,
        [&](int t, int c, size_t p, size_t length, uint8_t* room) {
          return read_samples(snapshots, t, c, p, length, room);
        },
        pool, model);
    return;
  }
  build_runs<uint16_t>(
      snapshots.size(), first, count,
      [&](int t, int c, size_t p, size_t length, uint16_t* room) {
        uint8_t high[kRun], low[kRun];
        join_digits(read_samples(snapshots, t, c, p, length, high),
                    read_low_samples(snapshots, t, c, p, length, low), snapshots.low_bits(), length,
                    room);
        return room;
      },
      pool, model);
}

}  // namespace qdmd
