#include "core/model/build_spread.h"

#include <algorithm>
#include <memory>

#include "core/passes/bands.h"
#include "core/passes/read_samples.h"

namespace qdmd {
namespace {

// Pixels of all snapshots that are spread at once: they stay in the second-level cache.
constexpr size_t kRun = 1024;

// Pixels whose share of a pass is worth waking a thread for.
constexpr size_t kPixelsPerPart = 16384;

}  // namespace

uint64_t build_spread_bytes(int snapshots, int threads) {
  return static_cast<uint64_t>(threads) * static_cast<uint64_t>(snapshots) *
         ((kChannels - 1) * kRun + kChannels * sizeof(uint8_t*));
}

void build_spread(const SnapshotRange& snapshots, size_t first, size_t count, Pool* pool,
                  BackgroundModel* model) {
  constexpr size_t kUnit = BackgroundModel::kSliceUnit;
  const auto frames = static_cast<size_t>(snapshots.size());
  const size_t planes_of_chroma = (kChannels - 1) * frames;
  // Taken here: tasks of the pool take no memory.
  const auto room =
      std::make_unique_for_overwrite<uint8_t[]>(planes_of_chroma * kRun * pool->threads());
  const auto planes =
      std::make_unique_for_overwrite<const uint8_t*[]>(kChannels * frames * pool->threads());
  const auto parts = static_cast<int>(std::max<size_t>(1, count / kPixelsPerPart));
  pool->run(static_cast<size_t>(parts), [&](size_t part, size_t worker) {
    const Slice slice = {static_cast<int>(part), parts};
    const size_t begin = first + slice.first(count, kUnit), end = begin + slice.size(count, kUnit);
    const uint8_t** const of_run = planes.get() + worker * kChannels * frames;
    for (size_t p = begin; p < end; p += kRun) {
      const size_t length = std::min(kRun, end - p);
      uint8_t* to = room.get() + worker * planes_of_chroma * kRun;
      for (size_t t = 0; t < frames; ++t)
        for (int c = 0; c < kChannels; ++c) {
          of_run[kChannels * t + static_cast<size_t>(c)] =
              read_samples(snapshots, static_cast<int>(t), c, p, length, to);
          if (c > 0) to += kRun;
        }
      model->build_from(of_run, p, length);
    }
  });
}

}  // namespace qdmd
