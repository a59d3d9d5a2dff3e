#include "core/foreground/decision.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/passes/bands.h"
#include "core/passes/distance.h"
#include "core/passes/majority.h"
#include "core/passes/mean_distance.h"
#include "core/passes/residual.h"
#include "core/passes/sampling.h"
#include "core/passes/shading.h"

namespace qdmd {
namespace {

// Pixels whose share of a pass is worth waking a thread for.
constexpr size_t kPixelsPerPart = 65536;
// A pixel that is explained: another is nearer than this share of its own distance, squared.
constexpr uint32_t kNearer = 9, kNearerOf = 100;
// Above so many mean distances, in 1/256, a pixel is foreground. Of Gaussian noise, 3.5 are 5.6
// sigma. Leaves are further from what is around now and then.
constexpr int kMeanDistances = 896, kMeansOfTextures = 1536;
// One row in so many of a frame tells how far its pixels are from L, other rows of each frame. What
// it tells counts at least 1 / kNoiseFrames.
constexpr int kNoiseRows = 8, kNoiseFrames = 8;
// Pixels at most so far from foreground say nothing of noise.
constexpr int kNearForeground = 4;
// Where noise alone asks for a threshold above this, in levels, means of 3 x 3 pixels are compared:
// their noise is a third. The pixel itself must exceed a share of the threshold.
constexpr double kNoisy = 36, kLeastOfMeans = 18, kLeastAlone = 0.5;
// Parts of the mask below these shares of the picture are specks, and holes.
constexpr size_t kLeastForeground = 5000, kLeastHole = 500;
// Runs end at multiples of it where the row goes on: no vector is begun for a few pixels.
constexpr int kRunUnit = 32, kLongestRun = 256;

int differing_pixels(const uint8_t* mask, int count) {
  int sum = 0;
  for (int p = 0; p < count; ++p) sum += mask[p] & 1;
  return sum;
}

int explained_pixels(const uint8_t* mask, const uint16_t* own, const uint16_t* nearest, int count) {
  int sum = 0;
  for (int p = 0; p < count; ++p)
    sum += (mask[p] & 1) & (kNearerOf * nearest[p] < kNearer * own[p]);
  return sum;
}

// Keeps what is further than its limit.
void keep_beyond(const uint16_t* __restrict own, const uint8_t* __restrict limit, int count,
                 uint8_t* __restrict mask) {
  for (int p = 0; p < count; ++p) mask[p] = own[p] > limit[p] * limit[p] ? mask[p] : 0;
}

// 255 where nothing was set and the distance is within its limit, else 0.
void keep_within(const uint16_t* __restrict own, const uint8_t* __restrict limit, int count,
                 uint8_t* __restrict mask) {
  for (int p = 0; p < count; ++p)
    mask[p] = (mask[p] == 0) & (own[p] <= limit[p] * limit[p]) ? 255 : 0;
}

void either(const uint8_t* __restrict a, const uint8_t* __restrict b, const uint8_t* __restrict c,
            int count, uint8_t* __restrict out) {
  for (int p = 0; p < count; ++p) out[p] = a[p] | b[p] | c[p];
}

// Whether the mask is set at a sample, or `wide` samples to the left or to the right of it.
void widen(const uint8_t* __restrict mask, int count, int wide, uint8_t* __restrict out) {
  for (int p = 0; p < count; ++p) out[p] = mask[p - wide] | mask[p] | mask[p + wide];
}

// Moves what is set in `what` from the mask to `taken`.
void take_out(const uint8_t* __restrict what, int count, uint8_t* __restrict mask,
              uint8_t* __restrict taken) {
  for (int p = 0; p < count; ++p) {
    taken[p] = what[p] & mask[p];
    mask[p] = static_cast<uint8_t>(mask[p] & ~what[p]);
  }
}

}  // namespace

struct Decision::Run {
  Run(int row, int first, int size) : y(row), left(first), count(size) {}
  int y, left, count;
  // Squared distances from L, and from the nearest L around.
  alignas(64) uint16_t own[kLongestRun], nearest[kLongestRun];
  alignas(64) uint8_t limit[kLongestRun];  // levels
};

// Rows of a frame, of L and of what differs around a run, with kReach samples more on both sides.
template <int kReach, int kMost>
struct Decision::Around {
  static constexpr int kAlong = 2 * kReach + 1;
  const uint8_t *x[3 * kAlong], *level[3 * kAlong], *differing[kAlong];

  Around(Decision& all, const Comparison& frame, int y, int left, int count) {
    const bool at_edge = left < kReach || left + count + kReach > all.width_;
    for (int i = 0; i < kAlong; ++i) {
      const int row = std::clamp(y + i - kReach, 0, all.height_ - 1);
      differing[i] = all.differing_row(row) + left;
      for (int c = 0; c < kChannels; ++c) {
        const int at = kAlong * c + i;
        level[at] = all.level_row(c, row) + left;
        const uint8_t* const samples =
            frame.x[c] + static_cast<size_t>(row) * static_cast<size_t>(all.width_);
        x[at] = samples + left;
        if (!at_edge) continue;
        // The border's pixels stand for those outside.
        for (int p = 0; p < count + 2 * kReach; ++p)
          inside_[at][p] = samples[std::clamp(left + p - kReach, 0, all.width_ - 1)];
        x[at] = inside_[at] + kReach;
      }
    }
  }

 private:
  uint8_t inside_[3 * kAlong][kMost + 2 * kReach];
};

int voting_reach(int width, int height) {
  return std::min(kMostReach, std::min(width, height) / 120);
}

Decision::Decision(int width, int height, Colours colours, const DecisionSteps& steps)
    : width_(width),
      height_(height),
      step_(std::max(1, std::min(width, height) / 240)),
      margin_(kPlaces * step_),
      reach_(steps.vote ? voting_reach(width, height) : 0),
      stride_(static_cast<size_t>(width + 2 * margin_)),
      steps_(steps),
      texture_(width, height),
      noise_(width, height),
      specks_(width, height),
      differing_(stride_ * static_cast<size_t>(height)),
      foreground_(differing_.size()),
      mask_(static_cast<size_t>(width) * static_cast<size_t>(height)),
      shaded_(mask_.size()) {
  for (auto& level : level_) level.resize(differing_.size());
  if (colours == Colours::yuv) black_[0] = 16, black_[1] = black_[2] = 128;
  knows_light_ = steps.light && colours != Colours::grey;
}

uint64_t Decision::bytes(int width, int height) {
  const auto rows = static_cast<uint64_t>(height);
  const auto margin =
      static_cast<uint64_t>(2 * kPlaces * std::max(1, std::min(width, height) / 240));
  const auto pixels = static_cast<uint64_t>(width) * rows;
  return 5 * (pixels + margin * rows) + 2 * pixels + MovingTexture::bytes(width, height) +
         PixelNoise::bytes(width, height) + Specks::bytes(width, height);
}

void Decision::forget() {
  texture_.forget();
  noise_.forget();
  frames_ = 0;
}

void Decision::level(int y, const uint8_t* out[3]) const {
  for (size_t c = 0; c < kChannels; ++c) out[c] = level_[c].data() + offset(y);
}

void Decision::decide(const Comparison& frame, Pool* pool) {
  const Grid& grid = texture_.grid();
  const size_t pixels = mask_.size();
  // Fewer parts than rows, so that each has some.
  const int parts = static_cast<int>(
      std::clamp<size_t>(pixels / kPixelsPerPart, 1, static_cast<size_t>(grid.rows)));
  const auto in_bands = [&](int length, int count, auto band) {
    if (pool && count > 1)
      for_bands(*pool, length, count, [&](int first, int size, size_t) { band(first, size); });
    else
      band(0, length);
  };
  // Without limits of pixels, what looks like noise may be ghosts.
  noisy_ = steps_.smooth && !frame.fixed && frame.limits && frame.threshold > kNoisy;
  threshold_ = noisy_ ? std::max(kLeastOfMeans, frame.threshold / 3) : frame.threshold;
  if (shadows_ == Shadows::marked) std::fill(shaded_.begin(), shaded_.end(), uint8_t{0});
  in_bands(height_, parts, [&](int first, int size) { compare(frame, first, size); });
  if (noisy_)
    in_bands(height_, parts, [&](int first, int size) { compare_means(frame, first, size); });
  // A row of cells is at most so much work more than another.
  in_bands(grid.rows, parts > 1 ? grid.rows : 1, [&](int first, int size) {
    for (int row = first; row < first + size; ++row) explain(frame, row);
  });
  texture_.end_frame();
  in_bands(height_, parts, [&](int first, int size) { vote(first, size); });
  if (steps_.specks && reach_ > 0) {
    specks_.take_out(mask_.data(), 255, pixels / kLeastForeground, true);
    specks_.take_out(mask_.data(), 0, pixels / kLeastHole, false);
  }
  // Pixels around it may have overruled some.
  if (frame.ignored) frame.ignored->clear_rows(0, height_, width_, mask_.data());
  if (steps_.noise && !frame.fixed)
    in_bands(height_, parts, [&](int first, int size) { learn(frame, first, size); });
  ++frames_;
}

// L, and which pixels differ from it.
void Decision::compare(const Comparison& frame, int first_row, int row_count) {
  const auto width = static_cast<size_t>(width_);
  for (int y = first_row; y < first_row + row_count; ++y) {
    const size_t start = static_cast<size_t>(y) * width;
    for (size_t left = 0; left < width; left += kMaxRun) {
      const size_t count = std::min(kMaxRun, width - left), first = start + left;
      uint8_t* const level[3] = {level_row(0, y) + left, level_row(1, y) + left,
                                 level_row(2, y) + left};
      frame.model->evaluate(first, count, level);
      const uint8_t* const x[3] = {frame.x[0] + first, frame.x[1] + first, frame.x[2] + first};
      if (!noisy_) foreground_mask(x, level, count, threshold_, nullptr, differing_row(y) + left);
    }
    for (int c = 0; c < kChannels; ++c) repeat_border(level_row(c, y));
    if (frame.ignored) frame.ignored->clear(y, 0, width_, differing_row(y));
    repeat_border(differing_row(y));
  }
}

// Which means differ.
void Decision::compare_means(const Comparison& frame, int first_row, int row_count) {
  const auto most = static_cast<int>(threshold_ * threshold_);
  const auto alone =
      static_cast<int>(kLeastAlone * kLeastAlone * frame.threshold * frame.threshold);
  for (int y = first_row; y < first_row + row_count; ++y) {
    uint8_t* const row = differing_row(y);
    for (int left = 0; left < width_; left += kLongestRun) {
      Run run(y, left, std::min(kLongestRun, width_ - left));
      look_at(frame, &run);
      const size_t first = static_cast<size_t>(y) * static_cast<size_t>(width_) + left;
      const uint8_t* const x[3] = {frame.x[0] + first, frame.x[1] + first, frame.x[2] + first};
      const uint8_t* const level[3] = {level_row(0, y) + left, level_row(1, y) + left,
                                       level_row(2, y) + left};
      // Pixels next to something differ in their means, but not by themselves.
      squared_distance(x, level, static_cast<size_t>(run.count), run.nearest);
      for (int p = 0; p < run.count; ++p)
        row[left + p] = run.own[p] > most && run.nearest[p] > alone ? 255 : 0;
    }
    if (frame.ignored) frame.ignored->clear(y, 0, width_, row);
    repeat_border(row);
  }
}

void Decision::repeat_border(uint8_t* row) const {
  const auto margin = static_cast<size_t>(margin_);
  std::memset(row - margin, row[0], margin);
  std::memset(row + width_, row[width_ - 1], margin);
}

// One row of cells. Only what differs is looked at, and what moves.
void Decision::explain(const Comparison& frame, int grid_row) {
  const Grid& grid = texture_.grid();
  const auto first_cell = static_cast<size_t>(grid_row) * static_cast<size_t>(grid.cols);
  for (int y = grid.top(grid_row); y < grid.top(grid_row + 1); ++y) {
    const uint8_t* const differing = differing_row(y);
    uint8_t* const foreground = foreground_row(y);
    std::memcpy(foreground, differing, static_cast<size_t>(width_));
    // Neighbouring cells are one span.
    for (int col = 0; col < grid.cols;) {
      const auto busy = [&](int at) {
        const int left = grid.left(at), right = grid.left(at + 1);
        return texture_.moves(first_cell + static_cast<size_t>(at)) ||
               std::memchr(differing + left, 255, static_cast<size_t>(right - left)) != nullptr;
      };
      if (!busy(col)) {
        ++col;
        continue;
      }
      const int first = col;
      while (col < grid.cols && busy(col)) ++col;
      explain_span(frame, y, grid_row, first, col);
    }
    repeat_border(foreground);
  }
}

// Columns of cells first .. last - 1 of a row of pixels.
void Decision::explain_span(const Comparison& frame, int y, int grid_row, int first, int last) {
  const Grid& grid = texture_.grid();
  const auto first_cell = static_cast<size_t>(grid_row) * static_cast<size_t>(grid.cols);
  // Where nothing moves, a few rows are enough.
  const bool sampled = texture_.samples(y);
  bool moving = false;
  for (int at = first; at < last; ++at)
    moving |= texture_.moves(first_cell + static_cast<size_t>(at));
  int col = first;
  for (int left = grid.left(first), right = grid.left(last); left < right;) {
    const int count = std::min(kLongestRun, right - left);
    // Samples behind the span are of no use, but quicker.
    Run run(y, left, std::min((count + kRunUnit - 1) / kRunUnit * kRunUnit, width_ - left));
    look_at(frame, &run);
    if (sampled || moving) look_around(frame, &run);
    const uint8_t* const differing = differing_row(y) + left;
    uint8_t* const foreground = foreground_row(y) + left;
    uint16_t* const noise = noise_.row(y) + left;
    for (int p = 0; p < count;) {
      const int end = std::min(count, grid.left(col + 1) - left), size = end - p;
      const size_t cell = first_cell + static_cast<size_t>(col);
      if (sampled)
        texture_.add(cell, differing_pixels(differing + p, size),
                     explained_pixels(differing + p, run.own + p, run.nearest + p, size));
      if (moves(cell, frame)) {
        uint8_t limit[kLongestRun], all[kLongestRun];
        std::copy_n(run.limit + p, size, limit);
        raise_limit(noise + p, kMeansOfTextures, static_cast<size_t>(size), limit);
        keep_beyond(run.nearest + p, limit, size, foreground + p);
        std::fill_n(all, size, uint8_t{255});
        if (frame.ignored) frame.ignored->clear(y, left + p, size, all);
        learn_distance(run.nearest + p, all, static_cast<size_t>(size), texture_.share(cell),
                       noise + p);
      } else {
        if (!frame.fixed)
          raise_limit(noise + p, kMeanDistances, static_cast<size_t>(size), run.limit + p);
        keep_beyond(run.own + p, run.limit + p, size, foreground + p);
      }
      p = end;
      if (left + end == grid.left(col + 1)) ++col;
    }
    if (knows_light_ && shadows_ != Shadows::foreground) leave_shadows(frame, run, count);
    left += count;
  }
}

bool Decision::moves(size_t cell, const Comparison& frame) const {
  return steps_.texture && !frame.fixed && texture_.moves(cell);
}

// Distances and limits of a run.
void Decision::look_at(const Comparison& frame, Run* run) {
  const size_t first =
      static_cast<size_t>(run->y) * static_cast<size_t>(width_) + static_cast<size_t>(run->left);
  const auto count = static_cast<size_t>(run->count);
  if (noisy_) {
    const Around<1, kLongestRun> around(*this, frame, run->y, run->left, run->count);
    smoothed_distance(around.x, around.level, count, run->own);
  } else {
    const uint8_t* const x[3] = {frame.x[0] + first, frame.x[1] + first, frame.x[2] + first};
    const uint8_t* const level[3] = {level_row(0, run->y) + run->left,
                                     level_row(1, run->y) + run->left,
                                     level_row(2, run->y) + run->left};
    squared_distance(x, level, count, run->own);
  }
  const auto least = static_cast<uint8_t>(std::min(255.0, threshold_));
  if (!frame.limits) {
    std::fill_n(run->limit, count, least);
    return;
  }
  std::copy_n(frame.limits + first, count, run->limit);
  if (noisy_)
    for (size_t p = 0; p < count; ++p) run->limit[p] /= 3;
  for (size_t p = 0; p < count; ++p) run->limit[p] = std::max(run->limit[p], least);
}

// Distances from the nearest pixels around.
void Decision::look_around(const Comparison& frame, Run* run) {
  const size_t first =
      static_cast<size_t>(run->y) * static_cast<size_t>(width_) + static_cast<size_t>(run->left);
  const uint8_t* const x[3] = {frame.x[0] + first, frame.x[1] + first, frame.x[2] + first};
  const uint8_t* rows[3 * kPlacesAlong];
  for (int c = 0; c < kChannels; ++c)
    for (int i = 0; i < kPlacesAlong; ++i)
      rows[kPlacesAlong * c + i] =
          level_row(c, std::clamp(run->y + (i - kPlaces) * step_, 0, height_ - 1)) + run->left;
  nearest_distance(x, rows, static_cast<size_t>(run->count), step_, run->nearest);
}

// The first `count` pixels of a run.
void Decision::leave_shadows(const Comparison& frame, const Run& run, int count) {
  constexpr auto kMost = static_cast<int>(kShadingRun);
  for (int first = 0; first < count; first += kMost) {
    const int left = run.left + first, size = std::min(kMost, count - first);
    uint8_t* const foreground = foreground_row(run.y) + left;
    if (!std::memchr(foreground, 255, static_cast<size_t>(size))) continue;
    const Around<kShadingReach, kMost> around(*this, frame, run.y, left, size);
    uint8_t shaded[kMost];
    find_shaded(around.x, around.level, black_, around.differing, run.limit + first,
                static_cast<size_t>(size), shaded);
    uint8_t* const marks =
        shaded_.data() + static_cast<size_t>(run.y) * static_cast<size_t>(width_) + left;
    take_out(shaded, size, foreground, marks);
  }
}

void Decision::vote(int first_row, int row_count) {
  const auto width = static_cast<size_t>(width_);
  uint8_t* out = mask_.data() + static_cast<size_t>(first_row) * width;
  if (reach_ == 0) {
    for (int y = first_row; y < first_row + row_count; ++y, out += width)
      std::memcpy(out, foreground_row(y), width);
    return;
  }
  constexpr int kRows = 2 * kMostReach + 1;
  alignas(64) uint8_t counts[kRows][kMaxRun];
  for (size_t left = 0; left < width; left += kMaxRun) {
    const size_t count = std::min(kMaxRun, width - left);
    int counted = std::max(0, first_row - reach_);
    for (int y = first_row; y < first_row + row_count; ++y) {
      for (const int end = std::min(height_, y + reach_ + 1); counted < end; ++counted)
        count_columns(foreground_row(counted) + left - reach_, count, reach_,
                      counts[counted % kRows]);
      const uint8_t* around[kRows];
      for (int i = 0; i <= 2 * reach_; ++i)
        around[i] = counts[std::clamp(y + i - reach_, 0, height_ - 1) % kRows];
      vote_row(around, foreground_row(y) + left, count, reach_,
               mask_.data() + static_cast<size_t>(y) * width + left);
    }
  }
}

// The noise of pixels that are background, and not next to foreground.
void Decision::learn(const Comparison& frame, int first_row, int row_count) {
  const Grid& grid = texture_.grid();
  const float share =
      1 / static_cast<float>(std::min<int64_t>(frames_ / kNoiseRows + 1, kNoiseFrames));
  int grid_row = 0;
  for (int y = first_row; y < first_row + row_count; ++y) {
    if ((y + frames_) % kNoiseRows != 0) continue;
    while (grid.top(grid_row + 1) <= y) ++grid_row;
    const auto first_cell = static_cast<size_t>(grid_row) * static_cast<size_t>(grid.cols);
    const auto row_of = [&](int at) {
      return mask_.data() +
             static_cast<size_t>(std::clamp(at, 0, height_ - 1)) * static_cast<size_t>(width_);
    };
    const uint8_t* const rows[3] = {row_of(y - kNearForeground), row_of(y),
                                    row_of(y + kNearForeground)};
    int col = 0;
    for (int left = 0; left < width_; left += kLongestRun) {
      Run run(y, left, std::min(kLongestRun, width_ - left));
      look_at(frame, &run);
      uint16_t* const noise = noise_.row(y) + left;
      raise_limit(noise, kMeanDistances, static_cast<size_t>(run.count), run.limit);
      uint8_t column[kLongestRun + 2 * kNearForeground], learns[kLongestRun];
      const int start = left - kNearForeground, wide = run.count + 2 * kNearForeground;
      if (start >= 0 && start + wide <= width_)
        either(rows[0] + start, rows[1] + start, rows[2] + start, wide, column);
      else
        for (int p = 0; p < wide; ++p) {
          const int at = std::clamp(start + p, 0, width_ - 1);
          column[p] = rows[0][at] | rows[1][at] | rows[2][at];
        }
      widen(column + kNearForeground, run.count, kNearForeground, learns);
      keep_within(run.own, run.limit, run.count, learns);
      // Textures that move have learnt already.
      while (col < grid.cols && grid.left(col) < left + run.count) {
        const int begin = std::max(grid.left(col), left) - left;
        const int end = std::min(grid.left(col + 1), left + run.count) - left;
        if (moves(first_cell + static_cast<size_t>(col), frame))
          std::fill(learns + begin, learns + end, uint8_t{0});
        if (grid.left(col + 1) > left + run.count) break;
        ++col;
      }
      if (frame.ignored) frame.ignored->clear(y, left, run.count, learns);
      learn_distance(run.own, learns, static_cast<size_t>(run.count), share, noise);
    }
  }
}

}  // namespace qdmd
