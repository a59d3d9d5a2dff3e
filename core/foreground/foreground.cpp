#include "core/foreground/foreground.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "core/passes/majority.h"
#include "core/passes/planes.h"
#include "core/passes/residual.h"

namespace qdmd {
namespace {

// L(t) of one run of pixels.
struct BackgroundRun {
  alignas(64) uint8_t level[3][kMaxRun];
  uint8_t* const rows[3] = {level[0], level[1], level[2]};
};

// The mask of pixels that decide alone.
void exceeds(const OutputTask& task, size_t first, size_t count, const BackgroundRun& background,
             uint8_t* mask) {
  const uint8_t* const x[3] = {task.x[0] + first, task.x[1] + first, task.x[2] + first};
  foreground_mask(x, background.rows, count, task.threshold,
                  task.limits ? task.limits + first : nullptr, mask);
}

constexpr int kVotingRun = static_cast<int>(kMaxRun) - 2 * kMostReach;

// The mask of columns `left` .. left + count() - 1 after the vote, row after row. The border's
// pixels stand for those outside.
class VotingStrip {
 public:
  VotingStrip(const OutputTask& task, int width, int height, int left, int reach, int first_row)
      : task_(task),
        width_(width),
        height_(height),
        left_(left),
        count_(static_cast<size_t>(std::min(kVotingRun, width - left))),
        reach_(reach),
        row_(first_row),
        counted_(std::max(0, first_row - reach)) {}

  size_t count() const { return count_; }
  // Writes the next row, and returns it.
  const uint8_t* next(uint8_t* mask) {
    for (const int end = std::min(height_, row_ + reach_ + 1); counted_ < end; ++counted_)
      count_row(counted_);
    const uint8_t* around[kRows];
    for (int i = 0; i <= 2 * reach_; ++i)
      around[i] = counts_[std::clamp(row_ + i - reach_, 0, height_ - 1) % kRows];
    vote_row(around, padded_[row_ % kRows] + reach_, count_, reach_, mask);
    ++row_;
    return mask;
  }

 private:
  static constexpr int kRows = 2 * kMostReach + 1;

  void count_row(int row) {
    const int begin = std::max(0, left_ - reach_);
    const int end = std::min(width_, left_ + static_cast<int>(count_) + reach_);
    const size_t first =
        static_cast<size_t>(row) * static_cast<size_t>(width_) + static_cast<size_t>(begin);
    const auto size = static_cast<size_t>(end - begin);
    task_.model->evaluate(first, size, background_.rows);
    const auto before = static_cast<size_t>(begin - (left_ - reach_));
    uint8_t* const padded = padded_[row % kRows];
    exceeds(task_, first, size, background_, padded + before);
    std::memset(padded, padded[before], before);
    const size_t whole = count_ + 2 * static_cast<size_t>(reach_);
    std::memset(padded + before + size, padded[before + size - 1], whole - before - size);
    count_columns(padded, count_, reach_, counts_[row % kRows]);
  }

  const OutputTask& task_;
  int width_, height_, left_;
  size_t count_;
  int reach_;
  int row_;      // next
  int counted_;  // rows, from the first that is needed
  BackgroundRun background_;
  alignas(64) uint8_t padded_[kRows][kMaxRun], counts_[kRows][kMaxRun];
};

}  // namespace

double automatic_threshold(double noise) { return std::max(4 * std::sqrt(3.0) * noise, 18.0); }

ForegroundStatistics foreground_statistics(const SnapshotRange& snapshots, BackgroundModel& model,
                                           double fixed_threshold) {
  constexpr int kFrames = 12;
  constexpr size_t kRunsPerFrame = 24;
  constexpr double kBinsPerLevel = 8;
  // The largest quaternion norm of a difference is 255 sqrt(3).
  std::array<uint32_t, static_cast<size_t>(442 * kBinsPerLevel)> histogram{}, beyond_limits{};
  const uint8_t* limits = fixed_threshold > 0 ? nullptr : model.limits();
  uint64_t total = 0;
  BackgroundRun background;
  const int frames = std::min(kFrames, snapshots.size());
  const size_t runs = (snapshots.pixels() + kMaxRun - 1) / kMaxRun;
  const size_t step = (runs + kRunsPerFrame - 1) / kRunsPerFrame;
  for (int i = 0; i < frames; ++i) {
    const int t = frames == 1 ? 0 : i * (snapshots.size() - 1) / (frames - 1);
    model.set_time(t);
    // Other frames look at other runs.
    for (size_t run = static_cast<size_t>(i) % std::max<size_t>(step, 1); run < runs; run += step) {
      const size_t first = run * kMaxRun;
      const size_t count = std::min(kMaxRun, snapshots.pixels() - first);
      model.evaluate(first, count, background.rows);
      for (size_t p = 0; p < count; ++p) {
        int squared = 0;
        for (int c = 0; c < kChannels; ++c) {
          const int difference = snapshots.plane(t, c)[first + p] - background.level[c][p];
          squared += difference * difference;
        }
        const double norm = std::sqrt(squared);
        const auto bin = static_cast<size_t>(norm * kBinsPerLevel);
        ++histogram[bin];
        if (!limits || squared > limits[first + p] * limits[first + p]) ++beyond_limits[bin];
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
    if (static_cast<double>(bin) / kBinsPerLevel > statistics.threshold)
      above += beyond_limits[bin];
  statistics.ratio = total > 0 ? static_cast<double>(above) / static_cast<double>(total) : 0;
  return statistics;
}

int voting_reach(int width, int height) {
  return std::min(kMostReach, std::min(width, height) / 120);
}

void write_output(const OutputTask& task, const MutableImageView& out, int first_row,
                  int row_count) {
  const bool masked = task.output == Output::mask || task.output == Output::cutout;
  const int reach = masked ? voting_reach(out.width, out.height) : 0;
  BackgroundRun background;
  alignas(64) uint8_t made[3][kMaxRun], mask_run[kMaxRun], constant_alpha[kMaxRun], alpha[kMaxRun];
  if (out.alpha)
    std::memset(constant_alpha, out.alpha_is_padding ? 255 : task.constant_alpha, kMaxRun);
  const auto image_width = static_cast<size_t>(out.width);

  // A run of a row, with its mask where there is one.
  const auto write_run = [&](size_t first, size_t count, const uint8_t* mask, int row, int left) {
    const uint8_t* const x[3] = {task.x[0] + first, task.x[1] + first, task.x[2] + first};
    const uint8_t* channels[3];
    for (int c = 0; c < kChannels; ++c) {
      channels[c] = made[c];
      switch (task.output) {
        case Output::background:
          channels[c] = background.level[c];
          break;
        case Output::foreground:
          absolute_residual(x[c], background.level[c], count, made[c]);
          break;
        case Output::mask:
          channels[c] = mask;
          break;
        case Output::cutout:
          apply_mask(x[c], mask, count, made[c]);
          break;
      }
    }
    const uint8_t* own = constant_alpha;
    if (task.alpha && !out.alpha_is_padding) own = task.alpha + first;
    if (task.output == Output::cutout && out.alpha && !out.alpha_is_padding) {
      apply_mask(own, mask, count, alpha);
      own = alpha;
    }
    join_channels(channels, own, count, out, row, left);
  };

  if (reach > 0) {
    for (int left = 0; left < out.width; left += kVotingRun) {
      VotingStrip strip(task, out.width, out.height, left, reach, first_row);
      for (int row = first_row; row < first_row + row_count; ++row) {
        const size_t first = static_cast<size_t>(row) * image_width + static_cast<size_t>(left);
        write_run(first, strip.count(), strip.next(mask_run), row, left);
      }
    }
    return;
  }
  size_t rows = static_cast<size_t>(row_count), width = image_width;
  // Rows without gaps are one long row.
  if (out.row_stride == out.pixel_stride * out.width) width *= std::exchange(rows, 1);
  for (size_t row = 0; row < rows; ++row)
    for (size_t left = 0; left < width; left += kMaxRun) {
      const size_t count = std::min(kMaxRun, width - left);
      const size_t first = static_cast<size_t>(first_row) * image_width + row * width + left;
      task.model->evaluate(first, count, background.rows);
      if (masked) exceeds(task, first, count, background, mask_run);
      write_run(first, count, mask_run, first_row + static_cast<int>(row), static_cast<int>(left));
    }
}

void write_foreground(const OutputTask& task, int width, int height, uint8_t* mask,
                      uint8_t* residual) {
  BackgroundRun background;
  const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  const int reach = voting_reach(width, height);
  for (size_t first = 0; first < pixels; first += kMaxRun) {
    const size_t count = std::min(kMaxRun, pixels - first);
    task.model->evaluate(first, count, background.rows);
    const uint8_t* const x[3] = {task.x[0] + first, task.x[1] + first, task.x[2] + first};
    if (reach == 0) exceeds(task, first, count, background, mask + first);
    residual_norm(x, background.rows, count, residual + first);
  }
  if (reach == 0) return;
  for (int left = 0; left < width; left += kVotingRun) {
    VotingStrip strip(task, width, height, left, reach, 0);
    for (int row = 0; row < height; ++row)
      strip.next(mask + static_cast<size_t>(row) * static_cast<size_t>(width) +
                 static_cast<size_t>(left));
  }
}

}  // namespace qdmd
