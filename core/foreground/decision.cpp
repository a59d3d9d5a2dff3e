#include "core/foreground/decision.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/passes/bands.h"
#include "core/passes/distance.h"
#include "core/passes/majority.h"
#include "core/passes/residual.h"
#include "core/passes/sampling.h"
#include "core/passes/shading.h"

namespace qdmd {
namespace {

// Pixels whose share of a pass is worth waking a thread for.
constexpr size_t kPixelsPerPart = 65536;
// A pixel that is explained: another is nearer than this share of its own distance, squared.
constexpr uint32_t kNearer = 9, kNearerOf = 100;
// Above so many mean distances from what is around, in 1/256, a pixel in a texture that moves is
// foreground. Of Gaussian noise, 4.3 would be the 4 sqrt(3) sigma of automatic_threshold(); leaves
// are further off now and then.
constexpr int kMeanDistances = 1536;  // 1/256
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
void keep_beyond(const uint16_t* own, const uint8_t* limit, int count, uint8_t* mask) {
  for (int p = 0; p < count; ++p) mask[p] = own[p] > limit[p] * limit[p] ? mask[p] : 0;
}

// Keeps what is further than its texture moves.
void leave_texture(const uint16_t* nearest, const uint16_t* noise, const uint8_t* limit, int count,
                   uint8_t* mask) {
  for (int p = 0; p < count; ++p) {
    const int most = std::min(255, std::max<int>(limit[p], noise[p] * kMeanDistances >> 16));
    mask[p] = nearest[p] > most * most ? mask[p] : 0;
  }
}

void take_out(const uint8_t* __restrict what, int count, uint8_t* __restrict mask) {
  for (int p = 0; p < count; ++p) mask[p] = static_cast<uint8_t>(mask[p] & ~what[p]);
}

}  // namespace

struct Decision::Run {
  Run(int row, int first, int size) : y(row), left(first), count(size) {}
  int y, left, count;
  // Squared distances from L, and from the nearest L around.
  alignas(64) uint16_t own[kLongestRun], nearest[kLongestRun];
  alignas(64) uint8_t limit[kLongestRun];  // levels
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
      differing_(stride_ * static_cast<size_t>(height)),
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
  return 4 * (pixels + margin * rows) + 2 * pixels + MovingTexture::bytes(width, height);
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
  in_bands(height_, parts, [&](int first, int size) { compare(frame, first, size); });
  // A row of cells is at most so much work more than another.
  if (shadows_ == Shadows::marked) std::fill(shaded_.begin(), shaded_.end(), uint8_t{0});
  in_bands(grid.rows, parts > 1 ? grid.rows : 1, [&](int first, int size) {
    for (int row = first; row < first + size; ++row) explain(frame, row);
  });
  texture_.end_frame();
  in_bands(height_, parts, [&](int first, int size) { vote(first, size); });
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
      foreground_mask(x, level, count, frame.threshold, nullptr, differing_row(y) + left);
    }
    for (int c = 0; c < kChannels; ++c) repeat_border(level_row(c, y));
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
    repeat_border(differing_row(y));
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
    uint8_t* const differing = differing_row(y) + left;
    for (int p = 0; p < count;) {
      const int end = std::min(count, grid.left(col + 1) - left), size = end - p;
      const size_t cell = first_cell + static_cast<size_t>(col);
      if (sampled)
        texture_.add(cell, differing_pixels(differing + p, size),
                     explained_pixels(differing + p, run.own + p, run.nearest + p, size));
      if (!(steps_.texture && texture_.moves(cell) && !frame.fixed)) {
        keep_beyond(run.own + p, run.limit + p, size, differing + p);
      } else {
        uint16_t* const noise = texture_.noise(y) + left + p;
        leave_texture(run.nearest + p, noise, run.limit + p, size, differing + p);
        texture_.learn(cell, run.nearest + p, size, noise);
      }
      p = end;
      if (left + end == grid.left(col + 1)) ++col;
    }
    if (knows_light_ && shadows_ != Shadows::foreground) leave_shadows(frame, run, count);
    left += count;
  }
}

// Distances and limits of a run.
void Decision::look_at(const Comparison& frame, Run* run) {
  const size_t first =
      static_cast<size_t>(run->y) * static_cast<size_t>(width_) + static_cast<size_t>(run->left);
  const uint8_t* const x[3] = {frame.x[0] + first, frame.x[1] + first, frame.x[2] + first};
  const uint8_t* const level[3] = {level_row(0, run->y) + run->left,
                                   level_row(1, run->y) + run->left,
                                   level_row(2, run->y) + run->left};
  const auto count = static_cast<size_t>(run->count);
  squared_distance(x, level, count, run->own);
  const auto least = static_cast<uint8_t>(std::min(255.0, frame.threshold));
  if (frame.limits)
    std::transform(frame.limits + first, frame.limits + first + count, run->limit,
                   [least](uint8_t limit) { return std::max(limit, least); });
  else
    std::fill_n(run->limit, count, least);
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
  const auto most = static_cast<int>(kShadingRun);
  for (int first = 0; first < count; first += most) {
    const int left = run.left + first, size = std::min(most, count - first);
    uint8_t* const differing = differing_row(run.y) + left;
    if (!std::memchr(differing, 255, static_cast<size_t>(size))) continue;
    uint8_t inside[3 * kShadingAlong][kShadingRun + 2 * kShadingReach];
    const bool at_edge = left < kShadingReach || left + size + kShadingReach > width_;
    const uint8_t *x[3 * kShadingAlong], *level[3 * kShadingAlong];
    for (int c = 0; c < kChannels; ++c)
      for (int i = 0; i < kShadingAlong; ++i) {
        const int at = kShadingAlong * c + i;
        const int y = std::clamp(run.y + i - kShadingReach, 0, height_ - 1);
        level[at] = level_row(c, y) + left;
        const uint8_t* const row =
            frame.x[c] + static_cast<size_t>(y) * static_cast<size_t>(width_);
        x[at] = row + left;
        if (!at_edge) continue;
        // The border's pixels stand for those outside.
        for (int p = 0; p < size + 2 * kShadingReach; ++p)
          inside[at][p] = row[std::clamp(left + p - kShadingReach, 0, width_ - 1)];
        x[at] = inside[at] + kShadingReach;
      }
    uint8_t* const shaded =
        shaded_.data() + static_cast<size_t>(run.y) * static_cast<size_t>(width_) + left;
    find_shaded(x, level, black_, differing, run.limit + first, static_cast<size_t>(size), shaded);
    take_out(shaded, size, differing);
  }
}

void Decision::vote(int first_row, int row_count) {
  const auto width = static_cast<size_t>(width_);
  uint8_t* out = mask_.data() + static_cast<size_t>(first_row) * width;
  if (reach_ == 0) {
    for (int y = first_row; y < first_row + row_count; ++y, out += width)
      std::memcpy(out, differing_row(y), width);
    return;
  }
  constexpr int kRows = 2 * kMostReach + 1;
  alignas(64) uint8_t counts[kRows][kMaxRun];
  for (size_t left = 0; left < width; left += kMaxRun) {
    const size_t count = std::min(kMaxRun, width - left);
    int counted = std::max(0, first_row - reach_);
    for (int y = first_row; y < first_row + row_count; ++y) {
      for (const int end = std::min(height_, y + reach_ + 1); counted < end; ++counted)
        count_columns(differing_row(counted) + left - reach_, count, reach_,
                      counts[counted % kRows]);
      const uint8_t* around[kRows];
      for (int i = 0; i <= 2 * reach_; ++i)
        around[i] = counts[std::clamp(y + i - reach_, 0, height_ - 1) % kRows];
      vote_row(around, differing_row(y) + left, count, reach_,
               mask_.data() + static_cast<size_t>(y) * width + left);
    }
  }
}

}  // namespace qdmd
