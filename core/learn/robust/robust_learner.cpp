#include "core/learn/robust/robust_learner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>

#include "core/dmd/qdmd.h"
#include "core/learn/robust/median_picture.h"
#include "core/learn/robust/thinning.h"
#include "core/passes/sampling.h"

namespace qdmd {
namespace {

// The step that leaves about 60 samples along the short side: more move no background
// (docs/robust.md).
int chosen_step(int width, int height) {
  return std::max(1, static_cast<int>(std::lround(std::min(width, height) / 60.0)));
}

// Samples along the short side that the coarsest step leaves: half of those that are chosen.
constexpr size_t kFewestSamples = 28;

// One of so many frames that a solve looks at may be remembered, for so many windows.
constexpr int kRememberedStep = 4, kRememberedWindows = 64;
// Frames between those that a solve looks at are not remembered. Windows that overlap still have a
// part of what is remembered, and need more of it: there all frames count.
int remembered_stride(Models models, int window_size) {
  return models == Models::two_of_live ? 1 : thinning_of(models).stride_of(window_size);
}

// A solve changed little if cells moved by less than a level in each channel on average, and no
// more than a tenth of them by two. Noise and clouds stay below that; a background of which parts
// are still hidden does not.
constexpr float kCalmMean = 3, kCalmCell = 6, kMostMoved = 0.1f;

// Levels, of each spread in steps of 1/4 level.
using Limits = std::array<uint8_t, 256>;

Limits limits_of_spreads(int spreads, int least) {
  Limits limits;
  for (int wide = 0; wide < 256; ++wide)
    limits[static_cast<size_t>(wide)] =
        static_cast<uint8_t>(std::clamp((spreads * wide + 3) / 4, least, 255));
  return limits;
}

// Makes a summary of frames that are `stride` apart one of frames that follow each other.
void divide_time(int stride, DmdSummary* summary) {
  summary->omega /= stride;
  summary->lambda = std::polar(std::pow(std::abs(summary->lambda), 1.0 / stride),
                               std::arg(summary->lambda) / stride);
}

}  // namespace

RobustLearner::RobustLearner(const LearnOptions& options, int width, const Band& band,
                             const RobustParameters& parameters)
    : options_(options),
      parameters_(parameters),
      band_(band),
      grid_(width, band.height(), parameters.cells_along),
      finest_step_(options.sample_step > 0 ? options.sample_step
                                           : chosen_step(width, band.height())),
      step_(finest_step_) {
  // What the paper fits to the first frame depends on what stood there.
  options_.dmd.amplitude = Amplitude::window;
  if (options_.dmd.rank == 0) options_.dmd.rank = 1;
  reference_.width = width;
  reference_.height = band.rows();
  if (!options.remembers) parameters_.earlier_share = parameters_.remembered_share = 0;
}

std::vector<int> RobustLearner::sample_steps() const {
  std::vector<int> steps = {finest_step_};
  const int side = std::min(grid_.width, grid_.height);
  while (sample_count(side, 2 * steps.back()) >= kFewestSamples) steps.push_back(2 * steps.back());
  return steps;
}

int RobustLearner::remembered_frames(int window_size, Models models) const {
  const int frames = window_size / remembered_stride(models, window_size);
  const double share = static_cast<double>(parameters_.remembered_share) * frames;
  return std::min(static_cast<int>(share), parameters_.start_frames / 2);
}

size_t RobustLearner::samples_at(int step) const {
  return static_cast<size_t>(band_.samples(step)) * sample_count(grid_.width, step);
}

// Own rows, counted among those that are kept.
SampledRows RobustLearner::sampled_rows() const {
  return {band_.first_sample(step_) - band_.first(), band_.own_end() - band_.first(), step_};
}

// Frames that a start compares, and a picture of earlier windows.
uint64_t RobustLearner::most_looks(int window_size, Models models) const {
  const int snapshots = thinning_of(models).most_snapshots(window_size);
  return static_cast<uint64_t>(std::min(snapshots, parameters_.start_frames) +
                               remembered_frames(window_size, models) + 1);
}

uint64_t RobustLearner::bytes(int window_size, int, Models models, int threads) const {
  const auto workers = static_cast<uint64_t>(threads);
  DmdOptions dmd = options_.dmd;
  if (models == Models::two_of_live) dmd.max_modes = BackgroundModel::most_modes(window_size);
  const int snapshots = thinning_of(models).most_snapshots(window_size),
            remembered = remembered_frames(window_size, models);
  const uint64_t looks = most_looks(window_size, models);
  const auto levels = [this](uint64_t planes) { return planes * grid_.cells() * sizeof(float); };
  // The reference and what an earlier window left: levels, spread, threshold, reach.
  const uint64_t pictures = pixels() * (2 * kChannels + 4);
  const uint64_t kept =
      pictures + LightScratch::bytes(grid_.cells()) + 3 * GridFrames::bytes(grid_, 1) + levels(3) +
      StableFrames::bytes(grid_, looks) + StableFramesRoom::bytes(grid_, looks) +
      WindowMask::bytes(snapshots, pixels()) +
      PlaneSlots::bytes(snapshots, samples_at(finest_step_)) +
      SlidingGram::bytes(snapshots, threads) + FrameMemory::bytes(remembered, shape(), grid_) +
      StandingLooks::bytes(grid_) + (looks_ahead(models) ? LookAhead::bytes(grid_) : 0) +
      2 * Absorbed::bytes(grid_.cells()) + SceneWatch::bytes(grid_) +
      static_cast<uint64_t>(window_size) * sizeof(Gain);
  // A scene that was left: levels and limits, and the same once more for windows to come. Where it
  // is back, there are two for a moment.
  const auto of_sample = static_cast<uint64_t>(sample_bytes(options_.depth));
  const uint64_t scene =
      models == Models::two_of_live ? pixels() * ((1 + of_sample) * kChannels + 2) : 0;
  const uint64_t made =
      (models == Models::one ? 1 : 2) *
      (BackgroundModel::bytes(pixels(), window_size, most_pictures(dmd, window_size), true) +
       pixels());
  // One after another: what a start compares, with densities and then a spread; masks; the
  // decomposition; the combination.
  const uint64_t start = GridFrames::bytes(grid_, static_cast<int>(looks) + 1) +
                         std::max<uint64_t>({light_of_bytes(grid_, threads),
                                             stable_frames_bytes(grid_, looks, threads),
                                             pixels() + blur_bytes(reference_.width, threads)});
  const uint64_t masks = workers * mask_scratch_bytes(grid_.width, grid_.height) +
                         WindowMask::scratch_bytes(pixels(), threads);
  const uint64_t filling = workers * (options_.depth > 8 ? Filler<uint16_t>::bytes(window_size)
                                                         : Filler<uint8_t>::bytes(window_size));
  return kept + made + scene +
         std::max({start, masks, scene,
                   decomposition_bytes(options_.dmd, static_cast<double>(samples_at(finest_step_)),
                                       window_size),
                   filling});
}

double RobustLearner::solve_seconds(int window_size, Models models) const {
  // Passes over pixels, and over the grid, which has at most so many cells as small pictures have
  // pixels.
  const double n = static_cast<double>(pixels()), small = std::min(1.0, n / 3000);
  const int snapshots = thinning_of(models).snapshots_of(window_size);
  return options_.iterations * (1e-3 * small + snapshots * (2.5e-4 * small + 2.2e-9 * n));
}

uint64_t RobustLearner::solver_bytes(int window_size) const {
  if (options_.dmd.solver != Solver::adjoint) return 0;
  return static_cast<uint64_t>(
      adjoint_bytes(static_cast<double>(samples_at(finest_step_)), window_size));
}

void RobustLearner::begin(const LearnerRoom& room) {
  room_ = room;
  const int snapshots = thinning_of(room.models).most_snapshots(room.window_size);
  if (room.models == Models::two_of_live)
    options_.dmd.max_modes = BackgroundModel::most_modes(room.window_size);
  background_cells_ = GridFrames(grid_, 2);
  light_scratch_ = LightScratch(grid_.cells());
  earlier_ = EarlierWindow(grid_);
  looks_ = StandingLooks(grid_);
  if (looks_ahead(room.models)) ahead_ = LookAhead(grid_);
  absorbed_ = absorbed_now_ = Absorbed(grid_.cells());
  scene_ = SceneWatch(grid_);
  stable_room_ = StableFramesRoom(grid_, most_looks(room.window_size, room.models));
  memory_ = FrameMemory(remembered_frames(room.window_size, room.models), shape(), grid_);
  mask_ = WindowMask(snapshots, pixels());
  samples_ = Window(snapshots, samples_at(finest_step_));
  gram_ = SlidingGram(snapshots, room.pool);
  for (auto& level : reference_.level) level.resize(pixels());
  reference_.threshold.resize(pixels());
  spread_.resize(pixels());
  // Runs read to their end.
  reach_.resize(room.frames->window().plane_size());
}

void RobustLearner::forget() {
  earlier_.forget();
  memory_.forget();
  looks_.forget();
  ahead_.forget();
  absorbed_.forget();
  scene_.forget();
  other_scene_ = scene_begins_ = false;
  stream_from_ = -1;
  calm_ = 0;
}

void RobustLearner::publish() {
  // Not while the solve runs: frames that come beside it mend what it would be compared with.
  calm_ = is_calm() ? calm_ + 1 : 0;
  published_ = 1 - published_;
  ahead_.publish(alone_, stable_, start_frames_);
  if (!std::exchange(scene_begins_, false)) return;
  looks_.forget();
  other_scene_ = false;
}

SceneSeen RobustLearner::scene_of(int slot) {
  if (other_scene_) return SceneSeen::same;
  const GridFrames& cells = room_.frames->cells();
  const float* const frame[3] = {cells.plane(slot, 0), cells.plane(slot, 1), cells.plane(slot, 2)};
  const float* const background[3] = {background_cells_.plane(published_, 0),
                                      background_cells_.plane(published_, 1),
                                      background_cells_.plane(published_, 2)};
  const SceneSeen seen = scene_.follow(frame, background);
  other_scene_ = seen != SceneSeen::same;
  if (other_scene_) scene_.leave();
  return seen;
}

void RobustLearner::begin_scene() {
  earlier_.forget();
  memory_.forget();
  absorbed_.forget();
  ahead_.forget();
  stream_from_ = -1;
  calm_ = 0;
  scene_begins_ = true;
}

void RobustLearner::remember(Learnt* learnt) const {
  learnt->earlier.reset();
  if (earlier_.known()) earlier_.write(grid_, &learnt->earlier.emplace());
}

void RobustLearner::recall(const Learnt& learnt) {
  if (parameters_.earlier_share <= 0) return;
  if (learnt.earlier)
    earlier_.read(grid_, *learnt.earlier);
  else
    earlier_.forget();
}

void RobustLearner::follow(const std::vector<uint8_t> level[kChannels]) {
  for (int c = 0; c < kChannels; ++c)
    cell_means(grid_, level[c].data(), background_cells_.plane(published_, c));
}

void RobustLearner::set_sample_step(int step) {
  step_ = step;
  samples_.resize(samples_at(step_));
}

// The background picture of the stable frames, its thresholds, and the light of each frame.
void RobustLearner::start(const SnapshotRange& snapshots) {
  const int m = snapshots.size();
  const GridFrames& cells = room_.frames->cells();
  GridPictures frames(grid_.cells());
  frames.reserve(m);
  for (int t = 0; t < m; ++t) frames.add(cells.plane(snapshots.slot(t), 0));
  // What was seen before, in the light of this window.
  GridFrames here;
  const int old = memory_.older_than(first_number());
  const bool recalls = old > 0 || earlier_.known();
  alone_ = !recalls;
  gains_ = light_of(frames, m, room_.pool, recalls ? &here : nullptr);

  const int of_window = std::min(m, parameters_.start_frames);
  const int count = of_window + old;
  std::vector<LitPicture> pictures(static_cast<size_t>(count));
  if (old > 0) {
    std::vector<LightScratch> scratch;
    for (size_t i = 0; i < room_.pool->threads(); ++i) scratch.emplace_back(grid_.cells());
    room_.pool->run(static_cast<size_t>(old), [&](size_t i, size_t worker) {
      const int k = static_cast<int>(i);
      pictures[i] = {{memory_.plane(k, 0), memory_.plane(k, 1), memory_.plane(k, 2)},
                     light_over(memory_.cells(), memory_.slot(k), here, 0, &scratch[worker]),
                     memory_.shape()};
    });
  }
  const auto frame_of = [&](int i) { return static_cast<int>(int64_t{i} * m / of_window); };
  for (int i = 0; i < of_window; ++i) {
    const int t = frame_of(i);
    pictures[static_cast<size_t>(old + i)] = {
        {snapshots.plane(t, 0), snapshots.plane(t, 1), snapshots.plane(t, 2)},
        gains_[static_cast<size_t>(t)],
        snapshots.shape()};
  }
  Recollection recollection;
  if (earlier_.known()) {
    LightScratch scratch(grid_.cells());
    pictures.push_back(earlier_.picture(light_over(earlier_.cells(), 0, here, 0, &scratch)));
    recollection = earlier_.recollection(parameters_.earlier_share * static_cast<float>(count));
    recollection.older_frames = old;
  }
  // Their cells in unit light: as they are, where that is theirs. Memory that nobody needs is not
  // touched.
  const size_t of_picture = kChannels * grid_.cells();
  const auto unlit = std::make_unique_for_overwrite<float[]>(pictures.size() * of_picture);
  GridPictures chosen(grid_.cells());
  chosen.reserve(static_cast<int>(pictures.size()));
  for (int i = 0; i < static_cast<int>(pictures.size()); ++i) {
    const float* const from = i == count ? earlier_.cells().plane(0, 0)
                              : i < old  ? memory_.cells().plane(memory_.slot(i), 0)
                                         : frames.plane(frame_of(i - old), 0);
    const LitPicture& picture = pictures[static_cast<size_t>(i)];
    if (!is_lit(picture.gain)) {
      chosen.add(from);
      continue;
    }
    float* const to = unlit.get() + static_cast<size_t>(i) * of_picture;
    for (size_t c = 0; c < kChannels; ++c) {
      const float inverse = 1 / picture.gain[c];
      const float* const channel = from + c * grid_.cells();
      std::transform(channel, channel + grid_.cells(), to + c * grid_.cells(),
                     [inverse](float level) { return level * inverse; });
    }
    chosen.add(to);
  }
  FirstLooks first_looks;
  if (absorbed_now_.any()) {
    std::vector<int64_t> numbers(static_cast<size_t>(count));
    for (int i = 0; i < count; ++i)
      numbers[static_cast<size_t>(i)] =
          i < old ? memory_.number(i) : first_number() + stride_ * frame_of(i - old);
    first_looks = absorbed_now_.first_looks(numbers);
  }
  stable_ = find_stable_frames(grid_, chosen, count, earlier_.known() ? &recollection : nullptr,
                               room_.pool, first_looks, &stable_room_);
  if (stable_.another_scene && old > 0) {
    memory_.forget();
    earlier_.forget();
    start(snapshots);
    return;
  }
  start_frames_ = count;

  uint8_t* background[kChannels];
  for (size_t c = 0; c < kChannels; ++c) background[c] = reference_.level[c].data();
  std::vector<uint8_t> spread(pixels());
  median_picture(grid_, band_, stable_, pictures, room_.pool, background, spread.data());
  recall_spread(&spread);
  blur(spread.data(), reference_.width, reference_.height, room_.pool, spread_.data());
  const Limits threshold = limits_of_spreads(parameters_.spreads, parameters_.least_threshold);
  Limits reach;
  for (int wide = 0; wide < 256; ++wide)
    reach[static_cast<size_t>(wide)] =
        static_cast<uint8_t>(std::max((wide + 4) / 8, parameters_.least_reach));
  in_runs([&](size_t first, size_t size) {
    for (size_t p = first; p < first + size; ++p) {
      reference_.threshold[p] = threshold[spread_[p]];
      reach_[p] = reach[spread_[p]];
    }
  });
}

// One picture has no spread: the one that an earlier window found.
void RobustLearner::recall_spread(std::vector<uint8_t>* spread) const {
  if (!earlier_.known()) return;
  for (int row = 0; row < grid_.rows; ++row)
    for (int col = 0; col < grid_.cols; ++col) {
      const auto frames = stable_.of_cell[static_cast<size_t>(row * grid_.cols + col)];
      if (frames.size() > 1 || frames.front() != start_frames_) continue;
      for (int y = std::max(grid_.top(row) - band_.first(), 0);
           y < std::min(grid_.top(row + 1) - band_.first(), band_.rows()); ++y) {
        const ptrdiff_t start = static_cast<ptrdiff_t>(y) * grid_.width;
        std::copy(earlier_.spread().begin() + start + grid_.left(col),
                  earlier_.spread().begin() + start + grid_.left(col + 1),
                  spread->begin() + start + grid_.left(col));
      }
    }
}

void RobustLearner::find_foreground(const SnapshotRange& snapshots) {
  // Taken here: tasks of the pool take no memory.
  const size_t scratch_size = mask_scratch_bytes(reference_.width, reference_.height);
  const auto scratch =
      std::make_unique_for_overwrite<uint8_t[]>(scratch_size * room_.pool->threads());
  mask_.find_all(snapshots.size(), room_.pool, [&](int t, size_t worker, uint8_t* bits) {
    find_mask(reference_, snapshots.picture(t), gains_[static_cast<size_t>(t)], bits,
              scratch.get() + worker * scratch_size);
  });
}

Decomposition RobustLearner::decompose_filled(const SnapshotRange& snapshots) {
  {
    const Clock::Span span(*room_.clock, Clock::samples);
    samples_.clear();
    while (samples_.size() < snapshots.size()) samples_.append();
    const size_t size = mask_bytes(pixels());
    const auto bits = std::make_unique_for_overwrite<uint8_t[]>(size * room_.pool->threads());
    room_.pool->run(static_cast<size_t>(snapshots.size()), [&](size_t part, size_t worker) {
      const int t = static_cast<int>(part), slot = samples_.slot(t);
      uint8_t* const own_bits = bits.get() + worker * size;
      mask_.read(t, own_bits);
      uint8_t* const out[3] = {samples_.plane(slot, 0), samples_.plane(slot, 1),
                               samples_.plane(slot, 2)};
      fill_samples(reference_, own_bits, snapshots.picture(t), gains_[part], reach_.data(),
                   sampled_rows(), out);
    });
    gram_.add_newest(samples_, samples_.size());
  }
  DmdOptions options = options_.dmd;
  options.omega_threshold *= stride_;
  const size_t seen = sample_count(grid_.width, grid_.height, step_);
  return qdmd::decompose(samples_, gram_.matrix(samples_, band_.team()), options,
                         static_cast<double>(seen));
}

// The modes' pictures from filled frames, run by run.
template <typename Sample>
void RobustLearner::combine(const SnapshotRange& snapshots, BackgroundModel* model) {
  std::vector<Filler<Sample>> fillers;
  for (size_t i = 0; i < room_.pool->threads(); ++i) fillers.emplace_back(snapshots.size());
  const size_t run = fillers[0].run();
  room_.pool->run((pixels() + run - 1) / run, [&](size_t part, size_t worker) {
    const size_t first = part * run, count = std::min(run, pixels() - first);
    model->build_from(
        fillers[worker].fill(snapshots, gains_, mask_, reference_, reach_.data(), first, count),
        first, count);
  });
}

// The next background picture: L(t) in unit light.
void RobustLearner::take_reference(BackgroundModel* model, double t) {
  model->set_time(t);
  in_runs([&](size_t first, size_t count) {
    uint8_t* const out[3] = {reference_.level[0].data() + first, reference_.level[1].data() + first,
                             reference_.level[2].data() + first};
    model->evaluate(first, count, out);
  });
}

// Calls work(first, count) for runs of all pixels, at most kMaxRun each, on the pool's threads.
template <typename Work>
void RobustLearner::in_runs(const Work& work) {
  room_.pool->run((pixels() + kMaxRun - 1) / kMaxRun, [&](size_t part) {
    const size_t first = part * kMaxRun;
    work(first, std::min(kMaxRun, pixels() - first));
  });
}

// The light of the frames by sampled pixels.
void RobustLearner::refine_light(const SnapshotRange& snapshots) {
  if (std::none_of(gains_.begin(), gains_.end(), is_lit)) return;
  const Clock::Span span(*room_.clock, Clock::samples);
  std::vector<int> all(gains_.size());
  std::iota(all.begin(), all.end(), 0);
  refine_gains(snapshots, all, &gains_);
  settle_light(&gains_);
}

// refine_gain() of some frames, by the samples of all members.
void RobustLearner::refine_gains(const SnapshotRange& snapshots, const std::vector<int>& frames,
                                 std::vector<Gain>* gains) {
  std::vector<GainSums> sums(frames.size());
  std::vector<uint8_t> goes_on(frames.size(), 1);
  const auto gain_of = [&](size_t i) -> Gain& { return (*gains)[static_cast<size_t>(frames[i])]; };
  for (int round = 0; round < kGainRounds; ++round) {
    room_.pool->run(frames.size(), [&](size_t i) {
      sums[i] = goes_on[i] ? gain_sums(reference_, snapshots.picture(frames[i]), gain_of(i),
                                       sampled_rows())
                           : GainSums{};
    });
    if (Team* team = band_.team(); team && !sums.empty())
      team->sum(Talk::light, {sums.front().data(), sums.size() * sums.front().size()});
    for (size_t i = 0; i < frames.size(); ++i)
      if (goes_on[i]) goes_on[i] = refine_gain(sums[i], &gain_of(i));
  }
}

void RobustLearner::decompose(const SnapshotRange& snapshots) {
  snapshots_ = snapshots;
  const uint64_t seen = room_.frames->frames_taken();
  fresh_ = std::min(1.0f,
                    static_cast<float>(seen - frames_seen_) / static_cast<float>(snapshots.size()));
  frames_seen_ = seen;
  if (stream_from_ < 0) stream_from_ = first_number();
  absorbed_.hand_over(&absorbed_now_);
}

void RobustLearner::build(Slice, BackgroundModel* model) {
  stride_ = thinning_of(room_.models).stride_of(snapshots_->size());
  const SnapshotRange snapshots = snapshots_->every(stride_);
  const Clock::Spent before = room_.clock->spent();
  facts_ = {};
  {
    const Clock::Span span(*room_.clock, Clock::solving);
    start(snapshots);
    for (int iteration = 0; iteration < options_.iterations; ++iteration) {
      refine_light(snapshots);
      find_foreground(snapshots);
      const Decomposition decomposition = decompose_filled(snapshots);
      facts_.dmd = decomposition.summary;
      divide_time(stride_, &facts_.dmd);
      const bool deep = options_.depth > 8 && iteration + 1 == options_.iterations;
      // Where all is so dark that its highest bits are 0, they have no mode.
      const bool dark = deep && facts_.dmd.background_modes == 0;
      model->begin_from(snapshots.size(), snapshots.pixels(),
                        dark ? mean_of_frames(snapshots.size()) : decomposition.background);
      model->set_stride(stride_);
      model->make_steady();
      if (deep)
        combine<uint16_t>(snapshots, model);
      else
        combine<uint8_t>(snapshots, model);
      take_reference(model, snapshots_->size() / 2);
    }
    end(model);
  }
  facts_.window_frames = snapshots_->size();
  facts_.sample_step = step_;
  facts_.iterations = options_.iterations;
  facts_.solve_time = room_.clock->spent().since(before).of_solves();
}

// The gains of all frames of the window: those between the snapshots have a light of their own.
std::vector<Gain> RobustLearner::gains_of_frames() {
  if (stride_ == 1) return gains_;
  std::vector<int> lit;
  std::vector<Gain> gains(static_cast<size_t>(snapshots_->size()), kSameLight);
  for (int t = 0; t < snapshots_->size(); ++t) {
    Gain& gain = gains[static_cast<size_t>(t)];
    const auto before = static_cast<size_t>(t / stride_);
    gain = gains_[before];
    if (t % stride_ == 0) continue;
    gain =
        light_between(room_.frames->cells(), snapshots_->slot(t), background_cells_, 1 - published_,
                      gains_[before], gains_[std::min(before + 1, gains_.size() - 1)]);
    if (is_lit(gain)) lit.push_back(t);
  }
  refine_gains(*snapshots_, lit, &gains);
  return gains;
}

// For windows to come.
void RobustLearner::keep_some() {
  const int step = kRememberedStep * remembered_stride(room_.models, room_.window_size);
  for (int i = 0; i < snapshots_->size(); ++i) {
    const int64_t number = first_number() + i;
    if ((number - stream_from_) % step != 0 || number <= memory_.newest()) continue;
    memory_.keep(number, *snapshots_, i, room_.frames->cells(),
                 int64_t{kRememberedWindows} * room_.window_size, room_.pool);
  }
}

// What the newest solve found is what the one in use has.
bool RobustLearner::is_calm() const {
  if (snapshots_->size() < room_.window_size || start_frames_ == 0) return false;
  double sum = 0;
  size_t moved = 0;
  for (size_t cell = 0; cell < grid_.cells(); ++cell) {
    float distance = 0;
    for (int c = 0; c < kChannels; ++c)
      distance +=
          std::abs(background_cells_.plane(0, c)[cell] - background_cells_.plane(1, c)[cell]);
    sum += static_cast<double>(distance);
    moved += distance > kCalmCell;
  }
  const auto cells = static_cast<double>(grid_.cells());
  return sum < kCalmMean * cells && static_cast<double>(moved) < kMostMoved * cells;
}

// What others ask the model, and what later windows are told.
void RobustLearner::end(BackgroundModel* model) {
  const uint8_t* const level[kChannels] = {reference_.level[0].data(), reference_.level[1].data(),
                                           reference_.level[2].data()};
  find_own_cells(grid_, band_, level, &background_cells_, 1 - published_, room_.pool);
  share_cells(grid_, band_, &background_cells_, 1 - published_);
  if (parameters_.earlier_share > 0)
    earlier_.take(grid_, reference_, spread_, background_cells_, 1 - published_, stable_,
                  start_frames_, fresh_);
  model->set_gains(gains_of_frames());
  keep_some();
  const Limits limit = limits_of_spreads(parameters_.spreads, parameters_.least_limit);
  uint8_t* const limits = model->make_limits();
  in_runs([&](size_t first, size_t size) {
    for (size_t p = first; p < first + size; ++p) limits[p] = limit[spread_[p]];
  });
}

}  // namespace qdmd
