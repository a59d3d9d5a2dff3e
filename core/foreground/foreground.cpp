// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/foreground/foreground.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <vector>

#include "core/passes/read_samples.h"
#include "core/passes/residual.h"

namespace qdmd {
namespace {

// L(t) of one run of pixels.
struct BackgroundRun {
  alignas(64) uint8_t level[3][kMaxRun];
  uint8_t* const rows[3] = {level[0], level[1], level[2]};
};

// Bins of a histogram of distances, and counts of pixels within their limits and beyond.
constexpr size_t kBins = kResidualBeyond, kCounts = 2 * kBins;

}  // namespace

double automatic_threshold(double noise, Colours colours) {
  return std::max(4 * std::sqrt(3.0) * noise, 18 * level_of(colours));
}

ForegroundStatistics foreground_statistics(const SnapshotRange& snapshots, BackgroundModel& model,
                                           double fixed_threshold, Pool& pool,
                                           const IgnoredAreas& ignored, int width,
                                           Colours colours) {
  constexpr int kFrames = 12;
  constexpr size_t kRunsPerFrame = 24;
  constexpr double kBinsPerLevel = kResidualSteps;
  // All pixels by distance, and those beyond their limits.
  std::array<int64_t, kBins> histogram{}, beyond_limits{};
  const uint8_t* limits = fixed_threshold > 0 ? nullptr : model.limits();
  const int frames = std::min(kFrames, snapshots.size());
  const size_t pixels = snapshots.pixels();
  const size_t runs = (pixels + kMaxRun - 1) / kMaxRun;
  const size_t step = std::max<size_t>(1, (runs + kRunsPerFrame - 1) / kRunsPerFrame);
  // What each thread counts in one frame: pixels within their limits, and those beyond. That is
  // less than a solve takes, which is over.
  static_assert(kRunsPerFrame * kMaxRun < 65536);
  std::vector<uint16_t> of_threads(kCounts * pool.threads());
  for (int i = 0; i < frames; ++i) {
    const int t = frames == 1 ? 0 : i * (snapshots.size() - 1) / (frames - 1);
    model.set_time(t);
    // Other frames look at other runs.
    const size_t first_run = static_cast<size_t>(i) % step;
    pool.run((runs - std::min(runs, first_run) + step - 1) / step, [&](size_t part, size_t worker) {
      const size_t run = first_run + part * step;
      const size_t first = run * kMaxRun, count = std::min(kMaxRun, pixels - first);
      BackgroundRun background;
      model.evaluate(first, count, background.rows);
      uint8_t counted[kMaxRun];
      std::fill_n(counted, count, uint8_t{1});
      ignored.clear_run(first, count, width, counted);
      const uint8_t* x[kChannels];
      uint8_t room[kChannels][kMaxRun];
      for (int c = 0; c < kChannels; ++c)
        x[c] = read_samples(snapshots, t, c, first, count, room[c]);
      uint16_t steps[kMaxRun];
      residual_steps(x, background.rows, count, limits ? limits + first : nullptr, steps);
      uint16_t* const mine = of_threads.data() + worker * kCounts;
      for (size_t p = 0; p < count; ++p)
        mine[steps[p]] = static_cast<uint16_t>(mine[steps[p]] + counted[p]);
    });
    for (size_t of_thread = 0; of_thread < of_threads.size(); of_thread += kCounts) {
      uint16_t* const within = of_threads.data() + of_thread;
      const uint16_t* const beyond = within + kBins;
      for (size_t bin = 0; bin < kBins; ++bin) {
        histogram[bin] += within[bin] + beyond[bin];
        beyond_limits[bin] += beyond[bin];
      }
      std::fill_n(within, kCounts, uint16_t{0});
    }
  }

  const int64_t total = std::accumulate(histogram.begin(), histogram.end(), int64_t{0});
  ForegroundStatistics statistics;
  int64_t below = 0;
  size_t quartile = 0;
  while (quartile + 1 < histogram.size() && 4 * (below + histogram[quartile]) < total)
    below += histogram[quartile++];
  statistics.noise = static_cast<double>(quartile) / kBinsPerLevel / 1.1012;
  statistics.threshold =
      fixed_threshold > 0 ? fixed_threshold : automatic_threshold(statistics.noise, colours);
  int64_t above = 0;
  for (size_t bin = 0; bin < histogram.size(); ++bin)
    if (static_cast<double>(bin) / kBinsPerLevel > statistics.threshold)
      above += beyond_limits[bin];
  statistics.ratio = total > 0 ? static_cast<double>(above) / static_cast<double>(total) : 0;
  return statistics;
}

}  // namespace qdmd
