// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/foreground/hard_shadows.h"

#include <algorithm>
#include <cmath>

#include "core/foreground/mask_runs.h"
#include "core/foreground/parts.h"
#include "core/passes/bands.h"

namespace qdmd {
namespace {

// Of a block: bits of clipped channels are the lowest three. Its region may be a shadow.
constexpr uint8_t kWhite = 8, kDark = 16, kJudged = 32;
// Logs are whole numbers, so that sums do not depend on their order. Levels have quarters. What is
// added to a level keeps noise near black small.
constexpr double kLogs = 4096, kAdded = 2;
constexpr int kQuarters = 4;
constexpr size_t kLevels = 255 * kQuarters + 1;
// Regions of a frame: more are left in the mask.
constexpr size_t kMostRegions = 4096;
constexpr uint16_t kNoRegion = kMostRegions;
// Blocks are compared with those so many to the right and below, at most.
constexpr int kFar = 2;
// Ratios of light: how dark, and the logs of G over R and B over G.
constexpr int kDepths = 20, kHues = 10;
constexpr size_t kRatios = size_t{kDepths} * kHues * kHues;

int side_of(int step) { return 2 * step; }
int along(int pixels, int step) { return (pixels + side_of(step) - 1) / side_of(step); }

int whole(double log) { return static_cast<int>(std::lround(kLogs * log)); }

size_t ratio_at(int depth, int green, int blue) {
  return (static_cast<size_t>(depth) * kHues + static_cast<size_t>(green)) * kHues +
         static_cast<size_t>(blue);
}

// The sum over a ratio and those next to it.
double around(const std::vector<float>& sums, size_t ratio) {
  const int blue = static_cast<int>(ratio % kHues), green = static_cast<int>(ratio / kHues % kHues),
            depth = static_cast<int>(ratio / kHues / kHues);
  double sum = 0;
  for (int d = std::max(depth - 1, 0); d <= std::min(depth + 1, kDepths - 1); ++d)
    for (int g = std::max(green - 1, 0); g <= std::min(green + 1, kHues - 1); ++g)
      for (int b = std::max(blue - 1, 0); b <= std::min(blue + 1, kHues - 1); ++b)
        sum += sums[ratio_at(d, g, b)];
  return sum;
}

}  // namespace

HardShadows::HardShadows(int width, int height, int step, const HardShadowConstants& constants)
    : constants_(constants),
      width_(width),
      height_(height),
      side_(side_of(step)),
      cols_(along(width, step)),
      rows_(along(height, step)),
      logs_(kLevels),
      steps_(kLevels),
      dark_(whole(constants.dark)),
      hardly_dark_(whole(constants.dark / 6)),
      edge_(whole(constants.edge)),
      clipped_(static_cast<int>(kQuarters * constants.clipped)) {
  const size_t blocks = static_cast<size_t>(cols_) * static_cast<size_t>(rows_);
  for (size_t quarters = 0; quarters < logs_.size(); ++quarters) {
    const double level = static_cast<double>(quarters) / kQuarters + kAdded;
    logs_[quarters] = static_cast<int16_t>(whole(std::log(level)));
    steps_[quarters] = static_cast<int16_t>(whole(constants.step + constants.noise / level));
  }
  flags_.resize(blocks);
  white_.reserve(blocks);
  in_rows_ = RowLists<uint32_t>(static_cast<size_t>(rows_), static_cast<size_t>(cols_));
  blocks_.resize(blocks);
  part_.resize(blocks);
  named_.resize(blocks);
  regions_.reserve(std::min(kMostRegions, blocks));
  known_ = {std::vector<float>(kRatios), std::vector<float>(kRatios)};
}

uint64_t HardShadows::bytes(int width, int height, int step) {
  const uint64_t cols = uint64_t(along(width, step)), rows = uint64_t(along(height, step)),
                 blocks = cols * rows;
  return RowLists<uint32_t>::bytes(rows, cols) +
         blocks * (sizeof(uint8_t) + sizeof(Block) + 2 * sizeof(uint32_t) + sizeof(uint16_t)) +
         std::min<uint64_t>(kMostRegions, blocks) * sizeof(Region) + 2 * kRatios * sizeof(float) +
         2 * kLevels * sizeof(int16_t);
}

void HardShadows::forget() {
  std::fill(known_.both.begin(), known_.both.end(), 0.0f);
  std::fill(known_.level.begin(), known_.level.end(), 0.0f);
}

// Quarters of levels of R, G and B, of the mean of two to four samples.
std::array<int, 3> HardShadows::quarters_of(const std::array<int, 3>& sum, int count,
                                            const RgbColours& rgb, const uint8_t black[3]) const {
  std::array<int, 3> quarters;
  if (rgb.converts()) {
    const float share = 1 / static_cast<float>(count);
    RgbColours::Pixel mean;
    for (size_t c = 0; c < 3; ++c) mean[c] = static_cast<float>(sum[c]) * share;
    mean = rgb.rgb(mean);
    for (size_t c = 0; c < 3; ++c) quarters[c] = static_cast<int>(kQuarters * mean[c] + 0.5f);
  } else {
    const int thirds = count == 2 ? 6 : count == 3 ? 4 : 3;  // of quarters
    for (size_t c = 0; c < 3; ++c) quarters[c] = (thirds * sum[c] + 1) / 3 - kQuarters * black[c];
  }
  for (int& of : quarters) of = std::clamp(of, 0, static_cast<int>(kLevels) - 1);
  return quarters;
}

// The mean of those of four pixels that are in the mask, of two at least.
void HardShadows::read_block(const ComparedPlanes& planes, const RgbColours& rgb,
                             const uint8_t black[3], const uint8_t* mask, int col, int row) {
  const auto left = static_cast<size_t>(col * side_), top = static_cast<size_t>(row * side_);
  const size_t right =
                   std::min(left + static_cast<size_t>(side_ / 2), static_cast<size_t>(width_ - 1)),
               bottom =
                   std::min(top + static_cast<size_t>(side_ / 2), static_cast<size_t>(height_ - 1));
  std::array<int, 3> x{}, l{};
  int count = 0;
  for (const size_t y : {top, bottom})
    for (const size_t at : {left, right}) {
      if (mask[y * static_cast<size_t>(width_) + at] == 0) continue;
      ++count;
      for (size_t c = 0; c < 3; ++c) {
        x[c] += planes.x[c][y * planes.x_stride + at];
        l[c] += planes.l[c][y * planes.l_stride + at];
      }
    }
  if (count < 2) return;
  const std::array<int, 3> lit = quarters_of(x, count, rgb, black),
                           level = quarters_of(l, count, rgb, black);
  const size_t here = index(col, row);
  Block& block = blocks_[here];
  uint8_t flags = kWhite;
  int sum = 0, brightest = INT32_MIN;
  block.step = steps_[static_cast<size_t>(std::min({lit[0], lit[1], lit[2]}))];
  for (size_t c = 0; c < 3; ++c) {
    block.x[c] = logs_[static_cast<size_t>(lit[c])];
    block.l[c] = logs_[static_cast<size_t>(level[c])];
    const int ratio = block.x[c] - block.l[c];
    sum += ratio;
    brightest = std::max(brightest, ratio);
    if (level[c] >= clipped_) flags |= static_cast<uint8_t>(1 << c);
  }
  if (sum < -3 * dark_ && brightest < hardly_dark_) flags |= kDark;
  flags_[here] = flags;
  in_rows_.add(static_cast<size_t>(row), static_cast<uint32_t>(here));
}

// False where no block is in the mask.
bool HardShadows::read_blocks(const ComparedPlanes& planes, const RgbColours& rgb,
                              const uint8_t black[3], Pool* pool, const uint8_t* mask) {
  for (const uint32_t block : white_) flags_[block] = 0;
  const size_t pixels = static_cast<size_t>(width_) * static_cast<size_t>(height_);
  for_rows(pool, rows_, pixels, [&](int first, int size) {
    for (int row = first; row < first + size; ++row) read_row(planes, rgb, black, mask, row);
  });
  in_rows_.collect(&white_);
  return !white_.empty();
}

void HardShadows::read_row(const ComparedPlanes& planes, const RgbColours& rgb,
                           const uint8_t black[3], const uint8_t* mask, int row) {
  in_rows_.clear(static_cast<size_t>(row));
  const int top = row * side_, middle = std::min(top + side_ / 2, height_ - 1);
  const uint8_t* const first = mask + static_cast<size_t>(top) * static_cast<size_t>(width_);
  const uint8_t* const second = mask + static_cast<size_t>(middle) * static_cast<size_t>(width_);
  int a = next_of(first, 0, width_, 255), b = next_of(second, 0, width_, 255);
  while (std::min(a, b) < width_) {
    const int col = std::min(a, b) / side_, next = std::min((col + 1) * side_, width_);
    read_block(planes, rgb, black, mask, col, row);
    const auto go_on = [&](const uint8_t* in, int from) {
      if (from >= next) return from;
      return next < width_ && in[next] != 0 ? next : next_of(in, next, width_, 255);
    };
    a = go_on(first, a), b = go_on(second, b);
  }
}

void HardShadows::join(size_t a, size_t b) {
  const Block &one = blocks_[a], &other = blocks_[b];
  const int step = std::max(one.step, other.step);
  for (size_t c = 0; c < 3; ++c)
    if (std::abs((one.x[c] - one.l[c]) - (other.x[c] - other.l[c])) >= step) return;
  const auto named = [this](uint32_t block) -> uint32_t& { return part_[block]; };
  const uint32_t first = part_of(static_cast<uint32_t>(a), named),
                 second = part_of(static_cast<uint32_t>(b), named);
  // The first block stands for all.
  part_[std::max(first, second)] = std::min(first, second);
}

void HardShadows::find_regions() {
  const auto cols = static_cast<size_t>(cols_);
  for (const uint32_t k : white_) {
    if ((flags_[k] & kDark) == 0) continue;
    part_[k] = k;
    if (k % cols > 0 && (flags_[k - 1] & kDark) != 0) join(k - 1, k);
    if (k >= cols && (flags_[k - cols] & kDark) != 0) join(k - cols, k);
  }
  regions_.clear();
  for (const uint32_t k : white_) {
    named_[k] = kNoRegion;
    if ((flags_[k] & kDark) == 0) continue;
    const uint32_t part = part_of(k, [this](uint32_t i) -> uint32_t& { return part_[i]; });
    if (part != k) {
      named_[k] = named_[part];
    } else if (regions_.size() < regions_.capacity() && regions_.size() < kMostRegions) {
      named_[k] = static_cast<uint16_t>(regions_.size());
      regions_.push_back({});
    }
    if (named_[k] == kNoRegion) continue;
    Region& region = regions_[named_[k]];
    ++region.blocks;
    for (size_t c = 0; c < 3; ++c) {
      const int64_t ratio = blocks_[k].x[c] - blocks_[k].l[c];
      region.ratio[c] += ratio;
      region.squares += ratio * ratio;
      region.clipped[c] += flags_[k] >> c & 1;
    }
  }
}

// Pairs of a block and those to the right and below: half of what each says goes to either's
// region, if it is judged. A thing ends where its ratio of light changes with the background; so
// blocks of other regions, and of none, count, too.
void HardShadows::add_pairs(size_t here) {
  const int col = static_cast<int>(here) % cols_, row = static_cast<int>(here) / cols_;
  const auto judged = [this](size_t block) {
    return (flags_[block] & kJudged) != 0 ? &regions_[named_[block]] : nullptr;
  };
  for (int i = 0; i < 2 * kFar; ++i) {
    const int right = i < kFar ? i + 1 : 0, down = i < kFar ? 0 : i - kFar + 1;
    if (col + right >= cols_ || row + down >= rows_) continue;
    const size_t there = index(col + right, row + down);
    const auto either = static_cast<uint8_t>(flags_[here] | flags_[there]);
    if (flags_[there] == 0 || (either & kJudged) == 0) continue;
    int64_t both = 0, light = 0, level = 0, pairs = 0;
    for (size_t c = 0; c < 3; ++c) {
      if ((either >> c & 1) != 0) continue;
      const int dx = std::clamp(blocks_[there].x[c] - blocks_[here].x[c], -edge_, edge_),
                dl = std::clamp(blocks_[there].l[c] - blocks_[here].l[c], -edge_, edge_);
      both += dx * dl, light += dx * dx, level += dl * dl, ++pairs;
    }
    for (Region* region : {judged(here), judged(there)}) {
      if (!region) continue;
      region->both += both, region->light += light, region->level += level;
      region->pairs += pairs;
    }
  }
}

bool HardShadows::is_large(const Region& region) const {
  return static_cast<double>(region.blocks) >= constants_.least_blocks;
}

// False where no region can be a shadow.
bool HardShadows::find_judged() {
  bool any = false;
  for (Region& region : regions_) any |= region.judged = is_large(region) && is_lit(region);
  for (const uint32_t block : white_)
    if (named_[block] != kNoRegion && regions_[named_[block]].judged) flags_[block] |= kJudged;
  return any;
}

// Whether the ratio of light may be that of the sky to the sun and the sky.
bool HardShadows::is_lit(const Region& region) const {
  const auto count = static_cast<double>(region.blocks);
  const auto log_of = [&](size_t c) {
    return static_cast<double>(region.ratio[c]) / count / kLogs;
  };
  const auto is_bound = [&](size_t c) {
    return static_cast<double>(region.clipped[c]) > constants_.clipped_share * count;
  };
  double squares = static_cast<double>(region.squares) / count / (kLogs * kLogs);
  for (size_t c = 0; c < 3; ++c) squares -= log_of(c) * log_of(c);
  if (squares / 3 >= constants_.most_spread * constants_.most_spread) return false;
  for (const auto& [red, blue] : {std::pair<size_t, size_t>{0, 1}, {1, 2}, {0, 2}}) {
    const double bluer = log_of(blue) - log_of(red);
    if (bluer < -(is_bound(red) && !is_bound(blue) ? constants_.redder_bound : constants_.redder) ||
        bluer > (is_bound(blue) && !is_bound(red) ? constants_.bluer_bound : constants_.bluer))
      return false;
  }
  return true;
}

size_t HardShadows::ratio_of(const Region& region) const {
  const double width = kLogs * constants_.width * static_cast<double>(region.blocks);
  const auto [r, g, b] = region.ratio;
  const auto place = [&](double log, int middle, int count) {
    return std::clamp(static_cast<int>(std::floor(log / width)) + middle, 0, count - 1);
  };
  return ratio_at(place(-static_cast<double>(r + g + b) / 3, 0, kDepths),
                  place(static_cast<double>(g - r), kHues / 2, kHues),
                  place(static_cast<double>(b - g), kHues / 2, kHues));
}

// Which regions are shadows; then those that are large add to what is known: outlines before a
// camera that shakes are small, and follow the background.
void HardShadows::decide() {
  constexpr double kSquares = 2 * kLogs * kLogs;  // each pair was added twice
  const auto level_of_region = [&](const Region& region) {
    return static_cast<double>(region.level) / kSquares +
           constants_.noise_of_pair * static_cast<double>(region.pairs) / 2;
  };
  for (Region& region : regions_) {
    if (!region.judged) continue;
    const size_t ratio = ratio_of(region);
    const double both = static_cast<double>(region.both) / kSquares,
                 level = level_of_region(region);
    const double known = (both + around(known_.both, ratio)) /
                         (level + around(known_.level, ratio) + constants_.least_known);
    const double variance = static_cast<double>(region.light) / (kLogs * kLogs) /
                            static_cast<double>(std::max<int64_t>(region.pairs, 1));
    const double trust = constants_.trust * variance + constants_.least_trust;
    region.shadow = known > constants_.slope_of_ratio &&
                    (both + trust * known) / (level + trust) > constants_.slope_of_region;
  }
  const auto kept = static_cast<float>(std::exp2(-1 / constants_.half_life));
  for (size_t k = 0; k < kRatios; ++k) known_.both[k] *= kept, known_.level[k] *= kept;
  for (const Region& region : regions_) {
    const bool small =
        static_cast<double>(region.blocks) < constants_.teaching * constants_.least_blocks;
    const bool follows =
        static_cast<double>(region.both) > constants_.follows * static_cast<double>(region.level);
    if (!region.judged || (small && follows)) continue;
    const size_t ratio = ratio_of(region);
    known_.both[ratio] += static_cast<float>(static_cast<double>(region.both) / kSquares);
    known_.level[ratio] += static_cast<float>(level_of_region(region));
  }
}

bool HardShadows::is_shadow(size_t block) const {
  return flags_[block] != 0 && named_[block] != kNoRegion && regions_[named_[block]].shadow;
}

// Small regions are neither.
bool HardShadows::is_thing(size_t block) const {
  if (flags_[block] == 0) return false;
  if (named_[block] == kNoRegion) return true;
  const Region& region = regions_[named_[block]];
  return !region.shadow && is_large(region);
}

bool HardShadows::next_to_thing(int col, int row) const {
  for (int y = std::max(row - 1, 0); y <= std::min(row + 1, rows_ - 1); ++y)
    for (int x = std::max(col - 1, 0); x <= std::min(col + 1, cols_ - 1); ++x)
      if (is_thing(index(x, y))) return true;
  return false;
}

bool HardShadows::clear(int col, int row, uint8_t* mask, uint8_t* marks) const {
  bool any = false;
  const int right = std::min((col + 1) * side_, width_),
            bottom = std::min((row + 1) * side_, height_);
  for (int y = row * side_; y < bottom; ++y)
    for (int x = col * side_; x < right; ++x) {
      const size_t p =
          static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
      any |= mask[p] != 0;
      if (marks) marks[p] |= mask[p];
      mask[p] = 0;
    }
  return any;
}

// The block, and what is left of the shadow at its border.
bool HardShadows::clear_shadow(size_t block, uint8_t* mask, uint8_t* marks) const {
  const int col = static_cast<int>(block) % cols_, row = static_cast<int>(block) / cols_;
  bool any = clear(col, row, mask, marks);
  for (int y = std::max(row - 1, 0); y <= std::min(row + 1, rows_ - 1); ++y)
    for (int x = std::max(col - 1, 0); x <= std::min(col + 1, cols_ - 1); ++x) {
      const size_t beside = index(x, y);
      if (!is_shadow(beside) && !is_thing(beside) && !next_to_thing(x, y))
        any |= clear(x, y, mask, marks);
    }
  return any;
}

bool HardShadows::take_out(const ComparedPlanes& planes, const RgbColours& rgb,
                           const uint8_t black[3], Pool* pool, uint8_t* mask, uint8_t* marks) {
  if (!read_blocks(planes, rgb, black, pool, mask)) return false;
  find_regions();
  if (!find_judged()) return false;
  for (const uint32_t block : white_) add_pairs(block);
  decide();
  bool any = false;
  for (const uint32_t block : white_)
    if (is_shadow(block)) any |= clear_shadow(block, mask, marks);
  return any;
}

}  // namespace qdmd
