#include "core/background/foreground.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace qdmd {
namespace {

constexpr size_t kRun = BackgroundModel::kMaxRun;

// L(t) of one run of pixels.
struct BackgroundRun {
  std::array<std::array<uint8_t, kRun>, kChannels> level;

  void evaluate(const BackgroundModel& model, size_t first, size_t count) {
    uint8_t* const rows[3] = {level[0].data(), level[1].data(), level[2].data()};
    model.evaluate(first, count, rows);
  }
};

int squared_distance(const uint8_t* const x[3], const BackgroundRun& l, size_t p) {
  int sum = 0;
  for (size_t c = 0; c < kChannels; ++c) {
    const int difference = x[c][p] - l.level[c][p];
    sum += difference * difference;
  }
  return sum;
}

struct Planes {
  const uint8_t* channel[3];
  Planes(const Window& window, int slot, size_t first) {
    for (int c = 0; c < kChannels; ++c) channel[c] = window.plane(slot, c) + first;
  }
};

}  // namespace

double automatic_threshold(double noise) { return std::max(4 * std::sqrt(3.0) * noise, 18.0); }

ForegroundStatistics foreground_statistics(const Window& window, BackgroundModel& model,
                                           double fixed_threshold) {
  constexpr int kFrames = 12;
  constexpr size_t kRunsPerFrame = 24;
  constexpr double kBinsPerLevel = 8;
  // The largest quaternion norm of a difference is 255 sqrt(3).
  std::array<uint32_t, static_cast<size_t>(442 * kBinsPerLevel)> histogram{};
  uint64_t total = 0;
  BackgroundRun background;
  const int frames = std::min(kFrames, window.size());
  const size_t runs = (window.pixels() + kRun - 1) / kRun;
  const size_t step = (runs + kRunsPerFrame - 1) / kRunsPerFrame;
  for (int i = 0; i < frames; ++i) {
    const int t = frames == 1 ? 0 : i * (window.size() - 1) / (frames - 1);
    model.set_time(t);
    // Other frames look at other runs.
    for (size_t run = static_cast<size_t>(i) % std::max<size_t>(step, 1); run < runs; run += step) {
      const size_t first = run * kRun;
      const size_t count = std::min(kRun, window.pixels() - first);
      background.evaluate(model, first, count);
      const Planes x(window, window.slot(t), first);
      for (size_t p = 0; p < count; ++p) {
        const double norm = std::sqrt(squared_distance(x.channel, background, p));
        ++histogram[static_cast<size_t>(norm * kBinsPerLevel)];
      }
      total += count;
    }
  }

  ForegroundStatistics statistics;
  uint64_t below = 0;
  size_t quartile = 0;
  while (quartile + 1 < histogram.size() && 4 * (below + histogram[quartile]) < total)
    below += histogram[quartile++];
  statistics.noise = static_cast<double>(quartile) / kBinsPerLevel / 1.1012;
  statistics.threshold =
      fixed_threshold > 0 ? fixed_threshold : automatic_threshold(statistics.noise);
  uint64_t above = 0;
  for (size_t bin = 0; bin < histogram.size(); ++bin)
    if (static_cast<double>(bin) / kBinsPerLevel > statistics.threshold) above += histogram[bin];
  statistics.ratio = total > 0 ? static_cast<double>(above) / static_cast<double>(total) : 0;
  return statistics;
}

void write_output(const Window& window, int slot, const BackgroundModel& model, Output output,
                  double threshold, const uint8_t* alpha, uint8_t constant_alpha,
                  const MutableImageView& out) {
  const auto width = static_cast<size_t>(out.width);
  const double squared_threshold = threshold * threshold;
  BackgroundRun background;
  for (int row = 0; row < out.height; ++row) {
    for (size_t left = 0; left < width; left += kRun) {
      const size_t count = std::min(kRun, width - left);
      const size_t first = static_cast<size_t>(row) * width + left;
      background.evaluate(model, first, count);
      const Planes x(window, slot, first);
      const ptrdiff_t start =
          row * out.row_stride + static_cast<ptrdiff_t>(left) * out.pixel_stride;
      std::array<uint8_t, kRun> foreground;
      if (output == Output::mask || output == Output::cutout)
        for (size_t p = 0; p < count; ++p)
          foreground[p] = squared_distance(x.channel, background, p) > squared_threshold ? 255 : 0;
      for (size_t c = 0; c < kChannels; ++c) {
        uint8_t* to = out.channel[c] + start;
        const uint8_t* from = x.channel[c];
        const uint8_t* level = background.level[c].data();
        const ptrdiff_t stride = out.pixel_stride;
        switch (output) {
          case Output::background:
            for (size_t p = 0; p < count; ++p, to += stride) *to = level[p];
            break;
          case Output::foreground:
            for (size_t p = 0; p < count; ++p, to += stride)
              *to = static_cast<uint8_t>(std::abs(from[p] - level[p]));
            break;
          case Output::mask:
            for (size_t p = 0; p < count; ++p, to += stride) *to = foreground[p];
            break;
          case Output::cutout:
            for (size_t p = 0; p < count; ++p, to += stride) *to = from[p] & foreground[p];
            break;
        }
      }
      if (!out.alpha) continue;
      uint8_t* to = out.alpha + start;
      for (size_t p = 0; p < count; ++p, to += out.pixel_stride) {
        if (out.alpha_is_padding) {
          *to = 255;
          continue;
        }
        const uint8_t own = alpha ? alpha[first + p] : constant_alpha;
        *to = output == Output::cutout ? own & foreground[p] : own;
      }
    }
  }
}

}  // namespace qdmd
