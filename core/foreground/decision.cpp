// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/foreground/decision.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <utility>

#include "core/foreground/full_depth.h"
#include "core/foreground/grey.h"
#include "core/foreground/mask_runs.h"
#include "core/foreground/vote.h"
#include "core/passes/bands.h"
#include "core/passes/distance.h"
#include "core/passes/mean_distance.h"
#include "core/passes/residual.h"
#include "core/passes/sampling.h"
#include "core/passes/shading.h"
#include "core/passes/unit_light.h"

namespace qdmd {
namespace {

// Rows that are compared and explained together, at least, and strips of rows at most: what differs
// is at one place of a picture, and all threads are to have a share of it.
constexpr int kStrip = 8, kMostStrips = 64;
// Pixels at most so far from foreground may say nothing of noise.
constexpr int kMostNear = 16;
// Pixels that are looked at together, at most: whole blocks.
constexpr int kLongestRun = 8 * kMaskBlock;

int in_256ths(double value) { return static_cast<int>(std::lround(256 * value)); }

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

  Around(Decision& all, int y, int left, int count) {
    const bool at_edge = left < kReach || left + count + kReach > all.shape_.width;
    for (int i = 0; i < kAlong; ++i) {
      const int row = std::clamp(y + i - kReach, 0, all.shape_.height - 1);
      differing[i] = all.differing_row(row) + left;
      for (int c = 0; c < kChannels; ++c) {
        const int at = kAlong * c + i;
        level[at] = all.level_row(c, row) + left;
        const uint8_t* const samples = all.now_.frame.x[c].high + all.shape_.first(row);
        x[at] = samples + left;
        if (!at_edge) continue;
        // The border's pixels stand for those outside.
        const int begin = std::max(left - kReach, 0),
                  end = std::min(left + count + kReach, all.shape_.width);
        uint8_t* const first = std::fill_n(inside_[at], begin - (left - kReach), samples[0]);
        uint8_t* const last = std::copy(samples + begin, samples + end, first);
        std::fill_n(last, left + count + kReach - end, samples[end - 1]);
        x[at] = inside_[at] + kReach;
      }
    }
  }

 private:
  uint8_t inside_[3 * kAlong][kMost + 2 * kReach];
};

// What find_shaded() wants to see of a run.
struct Decision::Lit {
  ShadingRows rows;

  Lit(Decision& all, int y, int left, int count) {
    constexpr int kReach = kShadingReach;
    const Shape& shape = all.shape_;
    if (y >= kReach && y + kReach < shape.height && left >= kReach &&
        left + count + kReach <= shape.width) {
      const int top = y - kReach;
      for (int c = 0; c < kChannels; ++c) {
        rows.x[c] = all.now_.frame.x[c].high + shape.first(top) + left;
        rows.l[c] = all.level_row(c, top) + left;
      }
      rows.differing = all.differing_row(top) + left;
      rows.x_step = static_cast<size_t>(shape.width);
      rows.l_step = shape.stride;
      return;
    }
    const Around<kReach, kMost> around(all, y, left, count);
    const auto copy = [&](const uint8_t* const* from, int which) {
      for (int i = 0; i < kShadingAlong; ++i)
        std::copy_n(from[i] - kReach, count + 2 * kReach, copies_[which][i]);
      return copies_[which][0] + kReach;
    };
    for (int c = 0; c < kChannels; ++c) {
      rows.x[c] = copy(around.x + kShadingAlong * c, c);
      rows.l[c] = copy(around.level + kShadingAlong * c, kChannels + c);
    }
    rows.differing = copy(around.differing, 2 * kChannels);
    rows.x_step = rows.l_step = kMost + 2 * kReach;
  }

 private:
  static constexpr int kMost = kShadingRun;
  uint8_t copies_[2 * kChannels + 1][kShadingAlong][kMost + 2 * kShadingReach];
};

namespace {

// The constants that are levels of R, G and B.
DecisionSteps in_levels_of(Colours colours, DecisionSteps steps) {
  const double level = level_of(colours);
  steps.constants.noisy *= level;
  steps.constants.least_of_means *= level;
  steps.constants.light.least_rest *= static_cast<float>(level);
  return steps;
}

int search_step(int width, int height) { return std::max(1, std::min(width, height) / 240); }

}  // namespace

Decision::Shape::Shape(int width_, int height_, bool votes)
    : width(width_),
      height(height_),
      step(search_step(width, height)),
      margin(kPlaces * step),
      reach(votes ? voting_reach(width, height) : 0),
      strips(std::clamp(height / std::max({kStrip, margin, kShadingReach}), 1, kMostStrips)),
      stride(static_cast<size_t>(width + 2 * margin)) {}

Decision::Decision(int width, int height, Colours colours, const DecisionSteps& steps,
                   const Levels& levels)
    : shape_(width, height, steps.vote),
      steps_(in_levels_of(colours, steps)),
      colours_(colours),
      grey_(colours == Colours::grey),
      texture_(width, height, steps.constants),
      flat_(width, height, shape_.step, colours, steps.constants),
      noise_(width, height, steps.constants),
      hard_(width, height, shape_.step, steps.constants.hard),
      overlays_(width, height, steps.constants),
      specks_(width, height),
      unknown_(static_cast<size_t>(shape_.strips)) {
  for (auto& level : of_.level) level.resize(shape_.padded(), 0);
  of_.differing.resize(shape_.padded(), 0);
  of_.foreground.resize(shape_.padded(), 0);
  of_.mask.resize(shape_.pixels(), 0);
  of_.shaded.resize(shape_.pixels(), 0);
  std::copy_n(levels.black, kChannels, black_);
  rgb_ = RgbColours(colours, levels);
}

uint64_t Decision::bytes(int width, int height) {
  const Shape shape(width, height, true);
  return 5 * uint64_t{shape.padded()} + 2 * uint64_t{shape.pixels()} +
         MovingTexture::bytes(width, height) + FlatThings::bytes(width, height, shape.step) +
         PixelNoise::bytes(width, height) + HardShadows::bytes(width, height, shape.step) +
         Overlays::bytes(width, height) + Specks::bytes(width, height);
}

void Decision::forget() {
  texture_.forget();
  flat_.forget();
  noise_.forget();
  hard_.forget();
  overlays_.forget();
  frames_ = 0;
  grey_ = colours_ == Colours::grey;
}

void Decision::change_scene(bool returns) {
  if (!left_) {
    left_ = Statistics{texture_, flat_, noise_, hard_.known(), overlays_, frames_};
    returns = false;
  } else {
    std::swap(left_->texture, texture_);
    std::swap(left_->flat, flat_);
    std::swap(left_->noise, noise_);
    std::swap(left_->hard, hard_.known());
    std::swap(left_->overlays, overlays_);
    std::swap(left_->frames, frames_);
  }
  if (!returns) forget();
}

void Decision::level(int y, const uint8_t* out[3]) const {
  for (size_t c = 0; c < kChannels; ++c) out[c] = of_.level[c].data() + shape_.offset(y);
}

void Decision::decide(const Comparison& frame, Pool* pool) {
  const auto in_rows = [&](const auto& work) {
    for_rows(pool, shape_.height, shape_.pixels(), work);
  };
  now_.frame = frame;
  now_.pool = pool;
  // Without limits of pixels, ghosts look like noise, and like textures.
  now_.means = steps_.smooth && !frame.fixed && frame.limits && frame.threshold > constants().noisy;
  now_.textures = steps_.texture && !frame.fixed && frame.limits;
  const Gain& light = frame.model->shown_light();
  now_.darker = std::any_of(light.begin(), light.end(), [](float gain) { return gain < 1; });
  now_.threshold =
      now_.means ? std::max(constants().least_of_means, frame.threshold / 3) : frame.threshold;
  now_.whole = frame.model->depth() > 8 && !now_.means;
  // Noise is as much brighter as the light is; a little more is within the limits.
  now_.light =
      frame.fixed ? 1 : std::max(1.0f, 0.8f * (light[0] + light[1] + light[2]) / kChannels);
  now_.threshold *= now_.light;
  now_.below = now_.whole && frame.fixed && now_.threshold < kCutLevels;
  now_.level_known =
      std::exchange(picture_, frame.model->picture()) == frame.model->picture() && !now_.darker;
  if (now_.darker) picture_ = 0;
  look();
  // All are there now.
  now_.frame.rows = nullptr;
  if (now_.textures) {
    // The second frame is the first one that can differ from what was there before: it is looked
    // at again now that it is known what moves in it.
    const bool again = texture_.frames() == 1;
    const uint8_t* const x[3] = {frame.x[0].high, frame.x[1].high, frame.x[2].high};
    texture_.end_frame(x, !again);
    if (again) {
      clear_marks();
      in_rows([&](int first, int size) { explain(first, size); });
      texture_.end_frame(x);
    }
  }
  if (now_.textures && steps_.flat) keep_flat_things();
  const bool learns = steps_.noise && !frame.fixed;
  in_rows([&](int first, int size) {
    vote({of_.foreground.data() + shape_.offset(0), shape_.stride, shape_.width, shape_.height,
          shape_.reach},
         first, size, of_.mask.data());
  });
  uint8_t* const mask = of_.mask.data();
  take_out_specks(255, constants().least_foreground);
  take_out_specks(0, constants().least_hole);
  // Pixels around it may have overruled some.
  if (frame.ignored) frame.ignored->clear_rows(0, shape_.height, shape_.width, mask);
  if (learns) {
    in_rows([&](int first, int size) { learn(first, size); });
    noise_.end_frame(mask);
  }
  // Where a shadow or an edge was is no place to learn noise from. Much noise hides texture, and
  // what an edge shows. In grey, no colour tells another part of a thing from less of it.
  if (steps_.hard && !now_.means && knows_light() && !much_moves()) leave_hard_shadows();
  if (steps_.edges && !now_.means && !grey_ && !frame.fixed) leave_edges();
  if (steps_.overlays && !frame.fixed) overlays_.take_out(mask);
  find_colour();
  ++frames_;
}

void Decision::find_colour() {
  const uint8_t* const x[3] = {now_.frame.x[0].high, now_.frame.x[1].high, now_.frame.x[2].high};
  grey_ = is_grey(x, static_cast<size_t>(shape_.width), static_cast<size_t>(shape_.height),
                  colours_, black_);
}

const uint8_t* Decision::mask_row(int y) const {
  return of_.mask.data() + shape_.first(std::clamp(y, 0, shape_.height - 1));
}

void Decision::clear_marks() {
  if (now_.frame.shadows == Shadows::marked)
    std::fill(of_.shaded.begin(), of_.shaded.end(), uint8_t{0});
}

// What differs, and what of it is foreground. A strip of rows is explained by the thread that
// compares the last of the rows around it, which are still near then.
void Decision::look() {
  clear_marks();
  const int strips = shape_.strips;
  const auto in_strips = [&](const auto& work) {
    const auto strip = [&](size_t index) {
      const int top = shape_.top(static_cast<int>(index));
      work(static_cast<int>(index), top, shape_.top(static_cast<int>(index) + 1) - top);
    };
    if (now_.pool && is_shared_out(shape_.pixels()))
      now_.pool->run(static_cast<size_t>(strips), strip);
    else
      for (int index = 0; index < strips; ++index) strip(static_cast<size_t>(index));
  };
  for (int index = 0; index < strips; ++index) {
    const int beside = (index > 0 ? 1 : 0) + (index + 1 < strips ? 1 : 0);
    unknown_[static_cast<size_t>(index)].store(1 + beside, std::memory_order_relaxed);
  }
  in_strips([&](int index, int top, int count) {
    compare(top, count);
    if (now_.means) return;
    for (int i = std::max(index - 1, 0); i <= std::min(index + 1, strips - 1); ++i)
      // What others have compared is seen here.
      if (unknown_[static_cast<size_t>(i)].fetch_sub(1, std::memory_order_acq_rel) == 1)
        explain(shape_.top(i), shape_.top(i + 1) - shape_.top(i));
  });
  if (!now_.means) return;
  in_strips([&](int, int top, int count) { compare_means(top, count); });
  in_strips([&](int, int top, int count) { explain(top, count); });
}

// Where L is known from samples at the end of their range, it is at least so bright: what is
// brighter in less light agrees.
void Decision::raise_ends(size_t first, size_t count, uint8_t* const level[3]) const {
  const uint8_t* const x[3] = {now_.frame.x[0].high + first, now_.frame.x[1].high + first,
                               now_.frame.x[2].high + first};
  rgb_.raise_ends(count, constants().at_end, now_.frame.model->shown_light(), x, level);
}

// L, and which pixels differ from it.
void Decision::compare(int first_row, int row_count) {
  if (now_.frame.rows) now_.frame.rows->read(first_row, row_count);
  const auto width = static_cast<size_t>(shape_.width);
  for (int y = first_row; y < first_row + row_count; ++y) {
    for (size_t left = 0; left < width; left += kMaxRun) {
      const size_t count = std::min(kMaxRun, width - left), first = shape_.first(y) + left;
      uint8_t* const level[3] = {level_row(0, y) + left, level_row(1, y) + left,
                                 level_row(2, y) + left};
      if (!now_.level_known) now_.frame.model->evaluate(first, count, level);
      if (now_.darker) raise_ends(first, count, level);
      const uint8_t* const x[3] = {now_.frame.x[0].high + first, now_.frame.x[1].high + first,
                                   now_.frame.x[2].high + first};
      if (now_.whole)
        full_depth_mask(now_.frame, level, now_.threshold, first, count, differing_row(y) + left);
      else if (!now_.means)
        foreground_mask(x, level, count, now_.threshold, nullptr, differing_row(y) + left);
    }
    for (int c = 0; c < kChannels && !now_.level_known; ++c) repeat_border(level_row(c, y));
    if (now_.frame.ignored) now_.frame.ignored->clear(y, 0, shape_.width, differing_row(y));
    repeat_border(differing_row(y));
  }
}

// Which means differ.
void Decision::compare_means(int first_row, int row_count) {
  const auto most = static_cast<int>(now_.threshold * now_.threshold);
  const double share = constants().least_alone * now_.frame.threshold;
  const auto alone = static_cast<int>(share * share);
  for (int y = first_row; y < first_row + row_count; ++y) {
    uint8_t* const row = differing_row(y);
    for (int left = 0; left < shape_.width; left += kLongestRun) {
      Run run(y, left, std::min(kLongestRun, shape_.width - left));
      look_at(&run);
      const Around<0, kLongestRun> middle(*this, y, left, run.count);
      // Pixels next to something differ in their means, but not by themselves.
      squared_distance(middle.x, middle.level, static_cast<size_t>(run.count), run.nearest);
      for (int p = 0; p < run.count; ++p)
        row[left + p] = run.own[p] > most && run.nearest[p] > alone ? 255 : 0;
    }
    if (now_.frame.ignored) now_.frame.ignored->clear(y, 0, shape_.width, row);
    repeat_border(row);
  }
}

void Decision::repeat_border(uint8_t* row) const {
  const auto margin = static_cast<size_t>(shape_.margin);
  std::memset(row - margin, row[0], margin);
  std::memset(row + shape_.width, row[shape_.width - 1], margin);
}

// Only what differs is looked at, and what moves.
void Decision::explain(int first_row, int row_count) {
  const Grid& grid = texture_.grid();
  int grid_row = -1;
  size_t first_cell = 0;
  bool moving = false;
  for (int y = first_row; y < first_row + row_count; ++y) {
    if (grid_row < 0 || grid.top(grid_row + 1) <= y) {
      do ++grid_row;
      while (grid.top(grid_row + 1) <= y);
      first_cell = static_cast<size_t>(grid_row) * static_cast<size_t>(grid.cols);
      moving = false;
      for (int col = 0; col < grid.cols; ++col)
        moving |= moves(first_cell + static_cast<size_t>(col));
    }
    const uint8_t* const differing = differing_row(y);
    uint8_t* const foreground = foreground_row(y);
    const auto busy = [&](int left) {
      const int right = std::min(left + kMaskBlock, shape_.width);
      bool any = copy_if_any(differing + left, right - left, foreground + left);
      if (moving)
        for (int at = texture_.col_of(left); at <= texture_.col_of(right - 1); ++at)
          any |= moves(first_cell + static_cast<size_t>(at));
      return any;
    };
    int first = -1;  // of the columns that wait to be looked at
    for (int left = 0; left < shape_.width; left += kMaskBlock) {
      const bool any = busy(left);
      if (first >= 0 && (!any || left - first == kLongestRun)) {
        explain_run(y, first, left, grid_row);
        first = -1;
      }
      if (any && first < 0) first = left;
    }
    if (first >= 0) explain_run(y, first, shape_.width, grid_row);
    repeat_border(foreground);
  }
}

// Columns left .. right - 1 of a row of pixels.
void Decision::explain_run(int y, int left, int right, int grid_row) {
  const Grid& grid = texture_.grid();
  const auto first_cell = static_cast<size_t>(grid_row) * static_cast<size_t>(grid.cols);
  // Where nothing moves, a few rows are enough.
  const bool sampled = now_.textures && texture_.samples(y);
  bool moving = false;
  int col = texture_.col_of(left);
  for (int at = col; at <= texture_.col_of(right - 1); ++at)
    moving |= moves(first_cell + static_cast<size_t>(at));
  Run run(y, left, right - left);
  // The next row has something about here, too.
  if (y + 1 < shape_.height) {
    fetch(noise_.row(y + 1) + left, run.count);
    if (now_.frame.limits) fetch(now_.frame.limits + shape_.first(y + 1) + left, run.count);
  }
  look_at(&run);
  if (now_.whole)
    full_depth_distance(now_.frame, shape_.first(y) + static_cast<size_t>(left),
                        static_cast<size_t>(run.count), run.own);
  if (sampled || moving) look_around(&run);
  uint16_t moved[kLongestRun];
  if (sampled) {
    const Around<0, kLongestRun> middle(*this, y, left, run.count);
    const uint8_t* const before[3] = {texture_.before(0, y) + left, texture_.before(1, y) + left,
                                      texture_.before(2, y) + left};
    squared_distance(middle.x, before, static_cast<size_t>(run.count), moved);
  }
  const uint8_t* const differing = differing_row(y) + left;
  uint8_t* const foreground = foreground_row(y) + left;
  uint16_t* const noise = noise_.row(y) + left;
  const int factor = in_256ths(constants().mean_distances),
            of_textures = in_256ths(constants().means_of_textures);
  if (!moving) {
    if (!now_.frame.fixed) raise_limit(noise, factor, static_cast<size_t>(run.count), run.limit);
    // Limits are whole levels: what a user's threshold says is known.
    if (!now_.below) keep_beyond(run.own, run.limit, static_cast<size_t>(run.count), foreground);
  }
  for (int p = 0; p < run.count && (moving || sampled); ++col) {
    const int end = std::min(run.count, grid.left(col + 1) - left);
    const auto size = static_cast<size_t>(end - p);
    const size_t cell = first_cell + static_cast<size_t>(col);
    if (sampled)
      texture_.add(cell, {differing + p, run.own + p, run.nearest + p, moved + p, end - p},
                   now_.frame.threshold);
    if (moves(cell)) {
      uint8_t limit[kLongestRun];
      std::copy_n(run.limit + p, size, limit);
      raise_limit(noise + p, of_textures, size, limit);
      keep_beyond(run.nearest + p, limit, size, foreground + p);
      uint16_t known[kLongestRun];
      std::copy_n(noise + p, size, known);
      learn_distance(run.nearest + p, size, texture_.share(cell), noise + p);
      if (now_.frame.ignored)
        now_.frame.ignored->visit(y, left + p, end - p, [&](int64_t first, int64_t last) {
          std::copy(known + first, known + last, noise + p + first);
        });
    } else if (moving) {
      raise_limit(noise + p, factor, size, run.limit + p);
      keep_beyond(run.own + p, run.limit + p, size, foreground + p);
    }
    p = end;
  }
  if (steps_.light && knows_light()) leave_shadows(run);
}

// Distances and limits of a run.
void Decision::look_at(Run* run) {
  const auto count = static_cast<size_t>(run->count);
  if (now_.means) {
    const Around<1, kLongestRun> around(*this, run->y, run->left, run->count);
    smoothed_distance(around.x, around.level, count, run->own);
  } else {
    const Around<0, kLongestRun> middle(*this, run->y, run->left, run->count);
    squared_distance(middle.x, middle.level, count, run->own);
  }
  const auto least = static_cast<uint8_t>(std::min(255.0, now_.threshold));
  if (!now_.frame.limits) {
    std::fill_n(run->limit, count, least);
    return;
  }
  const uint8_t* const limits = now_.frame.limits + shape_.first(run->y) + run->left;
  std::copy_n(limits, count, run->limit);
  if (now_.means)
    for (size_t p = 0; p < count; ++p) run->limit[p] /= 3;
  if (now_.light > 1)
    for (size_t p = 0; p < count; ++p) run->limit[p] = in_light(run->limit[p], {now_.light});
  for (size_t p = 0; p < count; ++p) run->limit[p] = std::max(run->limit[p], least);
}

// Distances from the nearest pixels around.
void Decision::look_around(Run* run) {
  const Around<0, kLongestRun> middle(*this, run->y, run->left, run->count);
  const uint8_t* rows[3 * kPlacesAlong];
  for (int c = 0; c < kChannels; ++c)
    for (int i = 0; i < kPlacesAlong; ++i) {
      const int row = std::clamp(run->y + (i - kPlaces) * shape_.step, 0, shape_.height - 1);
      rows[kPlacesAlong * c + i] = level_row(c, row) + run->left;
    }
  nearest_distance(middle.x, rows, static_cast<size_t>(run->count), shape_.step, run->nearest);
}

// Whether the background in another light is to be left out, and can be told.
bool Decision::knows_light() const {
  return !grey_ && !now_.below && now_.frame.shadows != Shadows::foreground;
}

void Decision::keep_flat_things() {
  flat_.keep({planes(), differing_row(0)}, now_.pool, foreground_row(0));
  if (!steps_.light || !knows_light()) return;
  flat_.visit_runs(now_.pool, [&](int y, int left, int count) {
    for (const int end = left + count; left < end; left += kLongestRun) {
      Run run(y, left, std::min(kLongestRun, end - left));
      look_at(&run);
      leave_shadows(run);
    }
  });
}

void Decision::leave_shadows(const Run& run) {
  constexpr auto kMost = static_cast<int>(kShadingRun);
  uint8_t* const foreground = foreground_row(run.y) + run.left;
  uint8_t* const marks = now_.frame.shadows == Shadows::marked
                             ? of_.shaded.data() + shape_.first(run.y) + run.left
                             : nullptr;
  for (int first = 0; first < run.count;) {
    const void* const next =
        std::memchr(foreground + first, 255, static_cast<size_t>(run.count - first));
    if (!next) return;
    first = static_cast<int>(static_cast<const uint8_t*>(next) - foreground);
    // Whole ones are quicker.
    const int at = std::clamp(run.count - kMost, 0, first), size = std::min(kMost, run.count - at);
    const Lit lit(*this, run.y, run.left + at, size);
    uint8_t shaded[kMost];
    find_shaded(lit.rows, black_, foreground + at, run.limit + at, constants().light,
                static_cast<size_t>(size), shaded);
    take_out(shaded, size, foreground + at, marks ? marks + at : nullptr);
    first = at + size;
  }
}

// Only pixels that are background, and not next to foreground, or foreground for a moment.
void Decision::learn(int first_row, int row_count) {
  const Grid& grid = texture_.grid();
  const int near = std::min(kMostNear, static_cast<int>(constants().near_foreground));
  int grid_row = 0;
  for (int y = first_row; y < first_row + row_count; ++y) {
    if (!noise_.learns_from(y)) continue;
    while (grid.top(grid_row + 1) <= y) ++grid_row;
    const auto first_cell = static_cast<size_t>(grid_row) * static_cast<size_t>(grid.cols);
    const uint8_t* const rows[3] = {mask_row(y - near), mask_row(y), mask_row(y + near)};
    for (int left = 0; left < shape_.width; left += kLongestRun) {
      Run run(y, left, std::min(kLongestRun, shape_.width - left));
      look_at(&run);
      uint8_t column[kLongestRun + 2 * kMostNear], wide[kLongestRun];
      const int start = left - near, length = run.count + 2 * near;
      // The border's pixels stand for those outside.
      const int from = std::max(start, 0), to = std::min(start + length, shape_.width);
      uint8_t *const first = column + (from - start), *const last = column + (to - start);
      either(rows[0] + from, rows[1] + from, rows[2] + from, to - from, first);
      std::fill(column, first, *first);
      std::fill(last, column + length, last[-1]);
      widen(column + near, run.count, near, wide);
      uint8_t now[kLongestRun];
      std::copy_n(rows[1] + left, run.count, now);
      // Textures that move have learnt already.
      for (int col = 0; col < grid.cols; ++col) {
        if (!moves(first_cell + static_cast<size_t>(col))) continue;
        const int begin = std::max(grid.left(col) - left, 0),
                  end = std::min(grid.left(col + 1) - left, run.count);
        for (int p = begin; p < end; ++p) wide[p] = 255, now[p] = 0;
      }
      if (now_.frame.ignored)
        now_.frame.ignored->visit(y, left, run.count, [&](int64_t begin, int64_t end) {
          std::fill(wide + begin, wide + end, uint8_t{255});
          std::fill(now + begin, now + end, uint8_t{0});
        });
      noise_.learn(y, static_cast<size_t>(left), static_cast<size_t>(run.count), run.own, run.limit,
                   wide, now);
    }
  }
}

}  // namespace qdmd
