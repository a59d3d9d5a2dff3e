// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/window_solve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "core/dmd/qdmd.h"
#include "core/learn/robust/thinning.h"
#include "core/planes/read_ahead.h"

namespace qdmd {
namespace {

// Makes a summary of frames that are `stride` apart one of frames that follow each other.
void divide_time(int stride, DmdSummary* summary) {
  summary->omega /= stride;
  summary->lambda = std::polar(std::pow(std::abs(summary->lambda), 1.0 / stride),
                               std::arg(summary->lambda) / stride);
}

}  // namespace

void WindowSolve::begin() {
  const LearnerRoom& room = context_.room;
  const int snapshots = thinning_of(room.models).most_snapshots(room.window_size);
  const size_t pixels = context_.pixels();
  stable_room_ =
      StableFramesRoom(context_.grid, most_looks(context_, room.window_size, room.models));
  mask_ = WindowMask(snapshots, pixels);
  samples_ = Window(snapshots, context_.samples_at(context_.finest_step));
  gram_ = SlidingGram(snapshots, room.pool);
  reference_.width = context_.grid.width;
  reference_.height = context_.grid.height;
  for (auto& level : reference_.level) level.resize(pixels);
  reference_.threshold.resize(pixels);
  spread_.resize(pixels);
  if (context_.rgb.converts()) brightest_.resize(pixels);
  // Runs read to their end.
  reach_.resize(room.frames->window().plane_size());
}

void WindowSolve::resize_samples() { samples_.resize(context_.samples_at(context_.step)); }

uint64_t WindowSolve::most_looks(const RobustContext& context, int window_size, Models models) {
  const int snapshots = thinning_of(models).most_snapshots(window_size);
  return static_cast<uint64_t>(std::min(snapshots, context.parameters.start_frames) +
                               remembered_frames(context, window_size, models) + 1);
}

int WindowSolve::remembered_frames(const RobustContext& context, int window_size, Models models) {
  const int frames = window_size / remembered_stride(models, window_size);
  const double share = static_cast<double>(context.parameters.remembered_share) * frames;
  return std::min(static_cast<int>(share), context.parameters.start_frames / 2);
}

uint64_t WindowSolve::bytes(const RobustContext& context, int window_size, Models models,
                            int threads) {
  const int snapshots = thinning_of(models).most_snapshots(window_size);
  const uint64_t looks = most_looks(context, window_size, models), pixels = context.pixels();
  // The reference: levels, spread, threshold, reach, and what is brightest.
  return pixels * (kChannels + (context.rgb.converts() ? 4 : 3)) +
         StableFrames::bytes(context.grid, looks) + StableFramesRoom::bytes(context.grid, looks) +
         WindowMask::bytes(snapshots, pixels) +
         PlaneSlots::bytes(snapshots, context.samples_at(context.finest_step)) +
         SlidingGram::bytes(snapshots, threads) + static_cast<uint64_t>(window_size) * sizeof(Gain);
}

// One after another: what a start compares, with densities and then a spread; masks; the
// decomposition; the combination.
uint64_t WindowSolve::scratch_bytes(const RobustContext& context, int window_size, Models models,
                                    int threads) {
  const auto workers = static_cast<uint64_t>(threads);
  const Grid& grid = context.grid;
  const uint64_t looks = most_looks(context, window_size, models), pixels = context.pixels();
  // Cells in unit light are written once the light is known.
  const uint64_t start = std::max(GridFrames::bytes(grid, 1) + light_of_bytes(grid, threads),
                                  GridFrames::bytes(grid, static_cast<int>(looks) + 1) +
                                      std::max<uint64_t>(stable_frames_bytes(grid, looks, threads),
                                                         pixels + blur_bytes(grid.width, threads)));
  const uint64_t masks = workers * mask_scratch_bytes(grid.width, grid.height) +
                         WindowMask::scratch_bytes(pixels, threads);
  const uint64_t filling =
      workers * (context.options.depth > 8 ? Filler<uint16_t>::bytes(window_size)
                                           : Filler<uint8_t>::bytes(window_size));
  const auto samples = static_cast<double>(context.samples_at(context.finest_step));
  return std::max(
      {start, masks, decomposition_bytes(context.options.dmd, samples, window_size), filling});
}

DmdSummary WindowSolve::solve(const SnapshotRange& window, int64_t first, const Known& known,
                              BackgroundModel* model) {
  const LearnOptions& options = context_.options;
  const int stride = thinning_of(context_.room.models).stride_of(window.size());
  window_ = {window, window.every(stride), first, stride};
  const SnapshotRange& snapshots = window_->snapshots;
  DmdSummary found;
  start(known);
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    refine_light();
    find_foreground(*known.history);
    const Decomposition decomposition = decompose_filled();
    found = decomposition.summary;
    divide_time(stride, &found);
    const bool deep = options.depth > 8 && iteration + 1 == options.iterations;
    // Where all is so dark that its highest bits are 0, they have no mode.
    const bool dark = deep && found.background_modes == 0;
    model->begin_from(snapshots.size(), snapshots.pixels(),
                      dark ? mean_of_frames(snapshots.size()) : decomposition.background);
    model->set_stride(stride);
    model->make_steady();
    if (deep)
      combine<uint16_t>(model);
    else
      combine<uint8_t>(model);
    take_reference(model, window.size() / 2);
  }
  return found;
}

void WindowSolve::find_foreground(const SolveHistory& history) {
  const SnapshotRange& snapshots = window_->snapshots;
  find_brightest();
  // Taken here: tasks of the pool take no memory.
  const size_t scratch_size = mask_scratch_bytes(reference_.width, reference_.height);
  const auto scratch =
      std::make_unique_for_overwrite<uint8_t[]>(scratch_size * context_.room.pool->threads());
  mask_.find_all(snapshots.size(), context_.room.pool, [&](int t, size_t worker, uint8_t* bits) {
    snapshots.will_need(t);
    snapshots.will_need(t + 1);
    if (!std::binary_search(shown_.begin(), shown_.end(), t)) {
      std::fill_n(bits, mask_bytes(context_.pixels()), uint8_t{255});
      return;
    }
    find_mask(reference_, snapshots.picture(t), light(t), bits,
              scratch.get() + worker * scratch_size);
    history.take_out(window_->number(t), bits);
    // Where samples clip, the same thing looks like two.
    if (!clips_) take_out_rejected(t, bits);
    if (clips_) fill_ends(t, bits);
  });
}

// Takes out what a contour says stands before the background, however little it differs.
void WindowSolve::take_out_rejected(int snapshot, uint8_t* bits) const {
  if (compared_.empty()) return;
  // The compared snapshot that is nearest in time.
  auto at = std::lower_bound(compared_.begin(), compared_.end(), snapshot);
  if (at == compared_.end() || (at != compared_.begin() && snapshot - at[-1] < *at - snapshot))
    --at;
  const auto look =
      static_cast<size_t>(start_frames_ - std::ssize(compared_) + (at - compared_.begin()));
  const Rejected& rejected = stable_.rejected;
  for (size_t i = 0; i < rejected.cells().size(); ++i)
    if (rejected.shows(i, look)) set_cell(context_.grid, rejected.cells()[i], bits);
}

// Takes out what the background would show at the end of the samples' range: such a sample says
// only that it is at least so bright.
void WindowSolve::fill_ends(int snapshot, uint8_t* bits) const {
  const Gain& gain = gains_[static_cast<size_t>(snapshot)];
  if (!is_lit(gain)) return;
  const auto take_out = [&](const uint8_t* level, float of) {
    const auto least = static_cast<int>(std::ceil(steps::light::kBright / of));
    if (of <= 1 || least > 255) return;
    for (size_t p = 0; p < context_.pixels(); ++p)
      bits[p / 8] = static_cast<uint8_t>(bits[p / 8] | (level[p] >= least) << (p % 8));
  };
  if (!brightest_.empty()) return take_out(brightest_.data(), luma_gain(gain));
  for (size_t c = 0; c < kChannels; ++c) take_out(reference_.level[c].data(), gain[c]);
}

// The largest of R, G and B of the background's pixels, where samples are others.
void WindowSolve::find_brightest() {
  if (!clips_ || brightest_.empty()) return;
  in_runs([&](size_t first, size_t count) {
    float rgb[kChannels][kMaxRun];
    float* const rows[kChannels] = {rgb[0], rgb[1], rgb[2]};
    for (size_t c = 0; c < kChannels; ++c)
      std::copy_n(reference_.level[c].data() + first, count, rgb[c]);
    context_.rgb.convert(count, rows);
    for (size_t p = 0; p < count; ++p)
      brightest_[first + p] = static_cast<uint8_t>(std::max({rgb[0][p], rgb[1][p], rgb[2][p]}));
  });
}

Decomposition WindowSolve::decompose_filled() {
  const SnapshotRange& snapshots = window_->snapshots;
  {
    const Clock::Span span(*context_.room.clock, Clock::samples);
    samples_.clear();
    while (samples_.size() < snapshots.size()) samples_.append();
    const size_t size = mask_bytes(context_.pixels());
    const auto bits =
        std::make_unique_for_overwrite<uint8_t[]>(size * context_.room.pool->threads());
    context_.room.pool->run(static_cast<size_t>(snapshots.size()), [&](size_t part, size_t worker) {
      const int t = static_cast<int>(part), slot = samples_.slot(t);
      ask_for_samples(snapshots, t);
      ask_for_samples(snapshots, t + 1);
      uint8_t* const own_bits = bits.get() + worker * size;
      mask_.read(t, own_bits);
      uint8_t* const out[3] = {samples_.plane(slot, 0), samples_.plane(slot, 1),
                               samples_.plane(slot, 2)};
      fill_samples(reference_, own_bits, snapshots.picture(t), light(t), reach_.data(),
                   context_.sampled_rows(), out);
    });
    gram_.add_newest(samples_, samples_.size());
  }
  DmdOptions options = context_.options.dmd;
  options.omega_threshold *= window_->stride;
  const size_t seen = sample_count(context_.grid.width, context_.grid.height, context_.step);
  return qdmd::decompose(samples_, gram_.matrix(samples_), options, static_cast<double>(seen));
}

// The modes' pictures from filled frames, run by run.
template <typename Sample>
void WindowSolve::combine(BackgroundModel* model) {
  const SnapshotRange& snapshots = window_->snapshots;
  std::vector<Filler<Sample>> fillers;
  for (size_t i = 0; i < context_.room.pool->threads(); ++i)
    fillers.emplace_back(snapshots.size(), context_.range());
  const size_t run = fillers[0].run();
  ReadAhead ahead(snapshots, fillers.size());
  context_.room.pool->run((context_.pixels() + run - 1) / run, [&](size_t part, size_t worker) {
    const size_t first = part * run, count = std::min(run, context_.pixels() - first);
    ahead.read(worker, first, count);
    model->build_from(
        fillers[worker].fill(snapshots, gains_, mask_, reference_, reach_.data(), first, count),
        first, count);
  });
}

// The next background picture: L(t) in unit light.
void WindowSolve::take_reference(BackgroundModel* model, double t) {
  model->set_time(t);
  in_runs([&](size_t first, size_t count) {
    uint8_t* const out[3] = {reference_.level[0].data() + first, reference_.level[1].data() + first,
                             reference_.level[2].data() + first};
    model->evaluate(first, count, out);
  });
}

// The light of the frames by sampled pixels.
void WindowSolve::refine_light() {
  if (std::none_of(gains_.begin(), gains_.end(), is_lit)) return;
  const Clock::Span span(*context_.room.clock, Clock::samples);
  refine_gains(window_->snapshots, shown_, &gains_);
  if (!clips_ && !shown_.empty()) {
    std::vector<Gain> gains;
    for (const int t : shown_) gains.push_back(gains_[static_cast<size_t>(t)]);
    settle_light(&gains);
    for (size_t i = 0; i < gains.size(); ++i) gains_[static_cast<size_t>(shown_[i])] = gains[i];
  }
  carry_gains();
}

// Those of the sampled rows are read soon.
void WindowSolve::ask_for_samples(const SnapshotRange& snapshots, int index) const {
  if (!snapshots.on_disk() || index >= snapshots.size()) return;
  const SampledRows rows = context_.sampled_rows();
  const auto width = static_cast<size_t>(context_.grid.width);
  for (int row = rows.first; row < rows.end; row += rows.step)
    snapshots.will_need(index, static_cast<size_t>(row) * width, width);
}

// refine_gain() of some frames.
void WindowSolve::refine_gains(const SnapshotRange& snapshots, const std::vector<int>& frames,
                               std::vector<Gain>* gains) {
  std::vector<GainSums> sums(frames.size());
  std::vector<uint8_t> goes_on(frames.size(), 1);
  const auto gain_of = [&](size_t i) -> Gain& { return (*gains)[static_cast<size_t>(frames[i])]; };
  for (int round = 0; round < kGainRounds; ++round) {
    context_.room.pool->run(frames.size(), [&](size_t i) {
      for (size_t next = i; next < std::min(i + 2, frames.size()); ++next)
        ask_for_samples(snapshots, frames[next]);
      sums[i] = goes_on[i] ? gain_sums(reference_, snapshots.picture(frames[i]),
                                       {gain_of(i), context_.range()}, context_.sampled_rows(),
                                       context_.end_of_range(0))
                           : GainSums{};
    });
    for (size_t i = 0; i < frames.size(); ++i)
      if (goes_on[i]) goes_on[i] = refine_gain(sums[i], &gain_of(i), context_.one_gain());
  }
}

// The gains of all frames of the window: those between the snapshots have a light of their own.
std::vector<Gain> WindowSolve::gains_of_frames(const GridFrames& background, int at) {
  const SnapshotRange& all = window_->all;
  const int stride = window_->stride;
  if (stride == 1) return gains_;
  std::vector<int> lit;
  std::vector<Gain> gains(static_cast<size_t>(all.size()), kSameLight);
  for (int t = 0; t < all.size(); ++t) {
    Gain& gain = gains[static_cast<size_t>(t)];
    const auto before = static_cast<size_t>(t / stride);
    gain = gains_[before];
    if (t % stride == 0) continue;
    if (is_black(all.slot(t))) {
      gain.fill(steps::light::kLeastGain);
      continue;
    }
    gain = light_between(context_.room.frames->cells(), all.slot(t), background, at, gains_[before],
                         gains_[std::min(before + 1, gains_.size() - 1)]);
    if (is_lit(gain)) lit.push_back(t);
  }
  refine_gains(all, lit, &gains);
  return gains;
}

}  // namespace qdmd
