#include "core/background/robust/robust_solver.h"

#include <algorithm>
#include <cmath>

#include "core/background/robust/median_picture.h"
#include "core/background/stopwatch.h"

namespace qdmd {
namespace {

size_t sampled(int width, int height, int step) {
  const auto along = [step](int size) { return static_cast<size_t>((size + step - 1) / step); };
  return along(width) * along(height);
}

}  // namespace

int RobustSolver::chosen_step(int width, int height) {
  return std::max(1, static_cast<int>(std::lround(std::min(width, height) / 60.0)));
}

uint64_t RobustSolver::bytes(int capacity, int width, int height, int sample_step) {
  const RobustParameters parameters;
  const uint64_t cells = Grid(width, height, parameters.cells_along).cells();
  const auto frames = static_cast<uint64_t>(capacity);
  const uint64_t looks =
      std::min<uint64_t>(frames, static_cast<uint64_t>(parameters.start_frames)) + 1;
  const uint64_t pixels = static_cast<uint64_t>(width) * static_cast<uint64_t>(height);
  // The ring, its copy at a start, the frames compared, their densities twice.
  const uint64_t of_cells =
      cells * sizeof(float) * (2 * kChannels * frames + (kChannels + 2) * looks);
  // The reference and what an earlier window left: levels, spread, threshold, reach.
  const uint64_t of_pictures = pixels * (2 * kChannels + 4);
  return of_cells + of_pictures + WindowMask::bytes(capacity, static_cast<size_t>(pixels)) +
         Window::bytes(capacity, sampled(width, height, sample_step));
}

RobustSolver::RobustSolver(const DmdOptions& options, int iterations, int sample_step, int capacity,
                           int width, int height, Pool* pool, const RobustParameters& parameters)
    : options_(options),
      parameters_(parameters),
      iterations_(iterations),
      step_(sample_step),
      capacity_(capacity),
      pool_(pool),
      grid_(width, height, parameters.cells_along),
      cells_(grid_, capacity),
      background_cells_(grid_, 2),
      earlier_(grid_),
      mask_(capacity, static_cast<size_t>(width) * static_cast<size_t>(height)),
      samples_(capacity, sampled(width, height, sample_step)),
      gram_(capacity, pool) {
  // What the paper fits to the first frame depends on what stood there.
  options_.amplitude = Amplitude::window;
  options_.method = Method::qdmd;
  if (options_.rank == 0) options_.rank = 1;
  reference_.width = width;
  reference_.height = height;
}

void RobustSolver::set_effort(int iterations, int sample_step) {
  iterations_ = iterations;
  if (sample_step == step_) return;
  // The old samples go first: two sets at once would break the promise of max-memory. Until there
  // are new ones, there is no step.
  step_ = 0;
  samples_ = Window();
  samples_ = Window(capacity_, sampled(grid_.width, grid_.height, sample_step));
  step_ = sample_step;
}

void RobustSolver::append(const Window& window, int slot) {
  for (int c = 0; c < kChannels; ++c)
    cell_means(grid_, window.plane(slot, c), cells_.plane(slot, c));
}

// The background picture of the stable frames, its thresholds, and the light of each frame.
void RobustSolver::start(const SnapshotRange& snapshots) {
  const int m = snapshots.size();
  GridFrames frames(grid_, m);
  for (int t = 0; t < m; ++t)
    for (int c = 0; c < kChannels; ++c)
      std::copy_n(cells_.plane(snapshots.slot(t), c), grid_.cells(), frames.plane(t, c));
  gains_ = light_of(frames, m);

  const int count = std::min(m, parameters_.start_frames);
  std::vector<LitPicture> pictures(static_cast<size_t>(count));
  GridFrames chosen(grid_, count + 1);
  const auto choose = [&](const GridFrames& from, int frame, int i, const LitPicture& picture) {
    pictures[static_cast<size_t>(i)] = picture;
    for (int c = 0; c < kChannels; ++c) {
      const float inverse = 1 / picture.gain[static_cast<size_t>(c)];
      std::transform(from.plane(frame, c), from.plane(frame, c) + grid_.cells(), chosen.plane(i, c),
                     [inverse](float level) { return level * inverse; });
    }
  };
  for (int i = 0; i < count; ++i) {
    const int t = static_cast<int>(int64_t{i} * m / count);
    choose(frames, t, i,
           {{snapshots.plane(t, 0), snapshots.plane(t, 1), snapshots.plane(t, 2)},
            gains_[static_cast<size_t>(t)]});
  }
  Recollection recollection;
  if (earlier_.known()) {
    const GridFrames here = median_frame(frames, m, gains_);
    pictures.emplace_back();
    choose(earlier_.cells(), 0, count, earlier_.picture(light_over(earlier_.cells(), 0, here, 0)));
    recollection = earlier_.recollection(parameters_.earlier_share * static_cast<float>(count));
  }
  stable_ =
      find_stable_frames(grid_, chosen, count, earlier_.known() ? &recollection : nullptr, pool_);
  start_frames_ = count;

  const size_t pixels = reference_.pixels();
  uint8_t* background[kChannels];
  for (size_t c = 0; c < kChannels; ++c) {
    reference_.level[c].resize(pixels);
    background[c] = reference_.level[c].data();
  }
  std::vector<uint8_t> spread(pixels);
  // Runs read to their end.
  reach_.resize(snapshots.plane_size());
  median_picture(grid_, stable_, pictures, pool_, background, spread.data());
  recall_spread(&spread);
  blur(spread.data(), reference_.width, reference_.height, reach_.data());
  spread_.assign(reach_.begin(), reach_.begin() + static_cast<ptrdiff_t>(pixels));
  reference_.threshold.resize(pixels);
  for (size_t p = 0; p < pixels; ++p) {
    // In steps of 1/4 level.
    const int wide = reach_[p];
    reference_.threshold[p] = static_cast<uint8_t>(
        std::clamp((parameters_.spreads * wide + 3) / 4, parameters_.least_threshold, 255));
    reach_[p] = static_cast<uint8_t>(std::max((wide + 4) / 8, parameters_.least_reach));
  }
}

// One picture has no spread: the one that an earlier window found.
void RobustSolver::recall_spread(std::vector<uint8_t>* spread) const {
  if (!earlier_.known()) return;
  for (int row = 0; row < grid_.rows; ++row)
    for (int col = 0; col < grid_.cols; ++col) {
      const auto& frames = stable_.of_cell[static_cast<size_t>(row * grid_.cols + col)];
      if (frames.size() > 1 || frames.front() != start_frames_) continue;
      for (int y = grid_.top(row); y < grid_.top(row + 1); ++y) {
        const ptrdiff_t start = static_cast<ptrdiff_t>(y) * grid_.width;
        std::copy(earlier_.spread().begin() + start + grid_.left(col),
                  earlier_.spread().begin() + start + grid_.left(col + 1),
                  spread->begin() + start + grid_.left(col));
      }
    }
}

void RobustSolver::find_foreground(const SnapshotRange& snapshots) {
  std::vector<std::vector<uint8_t>> scratch(pool_->threads());
  pool_->run(static_cast<size_t>(snapshots.size()), [&](size_t part, size_t worker) {
    const int t = static_cast<int>(part);
    const uint8_t* const x[3] = {snapshots.plane(t, 0), snapshots.plane(t, 1),
                                 snapshots.plane(t, 2)};
    find_mask(reference_, x, gains_[part], mask_.of(t), &scratch[worker]);
  });
}

Decomposition RobustSolver::decompose_filled(const SnapshotRange& snapshots) {
  {
    const Stopwatch watch(&cost_.samples);
    samples_.clear();
    while (samples_.size() < snapshots.size()) samples_.append();
    pool_->run(static_cast<size_t>(snapshots.size()), [&](size_t part) {
      const int t = static_cast<int>(part), slot = samples_.slot(t);
      const uint8_t* const x[3] = {snapshots.plane(t, 0), snapshots.plane(t, 1),
                                   snapshots.plane(t, 2)};
      uint8_t* const out[3] = {samples_.plane(slot, 0), samples_.plane(slot, 1),
                               samples_.plane(slot, 2)};
      fill_samples(reference_, mask_.of(t), x, gains_[part], reach_.data(), step_, out);
    });
    gram_.add_newest(samples_, samples_.size());
  }
  return decompose(samples_, gram_.matrix(samples_), options_);
}

// The modes' pictures from filled frames, run by run.
void RobustSolver::combine(const SnapshotRange& snapshots, BackgroundModel* model) {
  std::vector<Filler> fillers;
  for (size_t i = 0; i < pool_->threads(); ++i) fillers.emplace_back(snapshots.size());
  const size_t pixels = reference_.pixels(), run = fillers[0].run();
  pool_->run((pixels + run - 1) / run, [&](size_t part, size_t worker) {
    const size_t first = part * run, count = std::min(run, pixels - first);
    model->build_from(
        fillers[worker].fill(snapshots, gains_, mask_, reference_, reach_.data(), first, count),
        first, count);
  });
}

// The next background picture: L(t) in unit light.
void RobustSolver::take_reference(BackgroundModel* model, double t) {
  model->set_time(t);
  for (size_t first = 0; first < reference_.pixels(); first += kMaxRun) {
    const size_t count = std::min(kMaxRun, reference_.pixels() - first);
    uint8_t* const out[3] = {reference_.level[0].data() + first, reference_.level[1].data() + first,
                             reference_.level[2].data() + first};
    model->evaluate(first, count, out);
  }
}

// The light of the frames by sampled pixels.
void RobustSolver::refine_light(const SnapshotRange& snapshots) {
  if (std::none_of(gains_.begin(), gains_.end(), is_lit)) return;
  const Stopwatch watch(&cost_.samples);
  pool_->run(gains_.size(), [&](size_t part) {
    const int t = static_cast<int>(part);
    const uint8_t* const x[3] = {snapshots.plane(t, 0), snapshots.plane(t, 1),
                                 snapshots.plane(t, 2)};
    gains_[part] = refine_gain(reference_, x, gains_[part], step_);
  });
  settle_light(&gains_);
}

DmdSummary RobustSolver::solve(const SnapshotRange& snapshots, float fresh,
                               BackgroundModel* model) {
  cost_ = SolveCost();
  double all = 0, iterations = 0;
  DmdSummary summary;
  {
    const Stopwatch watch(&all);
    start(snapshots);
    for (int iteration = 0; iteration < iterations_; ++iteration) {
      const Stopwatch one(&iterations);
      refine_light(snapshots);
      find_foreground(snapshots);
      const Decomposition decomposition = decompose_filled(snapshots);
      summary = decomposition.summary;
      model->begin(snapshots, decomposition.background, true);
      combine(snapshots, model);
      take_reference(model, snapshots.size() / 2);
    }
    end(fresh, model);
  }
  cost_.once = all - iterations;
  cost_.iterations = iterations - cost_.samples;
  return summary;
}

// What others ask the model, and what later windows are told.
void RobustSolver::end(float fresh, BackgroundModel* model) {
  for (int c = 0; c < kChannels; ++c)
    cell_means(grid_, reference_.level[static_cast<size_t>(c)].data(),
               background_cells_.plane(1 - published_, c));
  if (parameters_.earlier_share > 0)
    earlier_.take(grid_, reference_, spread_, stable_, start_frames_, fresh);
  model->set_gains(gains_);
  // A pixel alone is judged more strictly than with those around it.
  std::vector<uint8_t> limits(reference_.pixels());
  std::transform(
      reference_.threshold.begin(), reference_.threshold.end(), limits.begin(),
      [](int threshold) { return static_cast<uint8_t>(std::min(255, 3 * threshold / 2)); });
  model->set_limits(std::move(limits));
}

}  // namespace qdmd
