// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/robust_learner.h"

#include <algorithm>
#include <cmath>

#include "core/dmd/qdmd.h"
#include "core/learn/robust/learning_steps.h"
#include "core/learn/robust/thinning.h"

namespace qdmd {
namespace {

using namespace steps::pace;

// The step that leaves about kSamplesAlong samples along the short side.
int chosen_step(int width, int height) {
  return std::max(1, static_cast<int>(std::lround(std::min(width, height) / kSamplesAlong)));
}

}  // namespace

static RobustContext context_of(const LearnOptions& options, int width, int height,
                                const RobustParameters& parameters) {
  const int finest = options.sample_step > 0 ? options.sample_step : chosen_step(width, height);
  RobustContext context = {options, parameters, Grid(width, height, parameters.cells_along), finest,
                           finest};
  // Levels are those of R, G and B.
  const double level = level_of(options.colours);
  for (int* of : {&context.parameters.least_threshold, &context.parameters.least_limit})
    *of = static_cast<int>(std::lround(level * *of));
  // What the paper fits to the first frame depends on what stood there.
  context.options.dmd.amplitude = Amplitude::window;
  if (context.options.dmd.rank == 0) context.options.dmd.rank = 1;
  return context;
}

RobustLearner::RobustLearner(const LearnOptions& options, int width, int height,
                             const RobustParameters& parameters)
    : context_(context_of(options, width, height, parameters)),
      memory_(context_),
      history_(context_),
      solve_(context_),
      follower_(context_) {}

std::vector<int> RobustLearner::sample_steps() const {
  std::vector<int> steps = {context_.finest_step};
  const int side = std::min(context_.grid.width, context_.grid.height);
  while (sample_count(side, 2 * steps.back()) >= kFewestSamples) steps.push_back(2 * steps.back());
  return steps;
}

uint64_t RobustLearner::bytes(int window_size, int, Models models, int threads) const {
  RobustContext context = context_;
  DmdOptions& dmd = context.options.dmd;
  const uint64_t pixels = context.pixels();
  const uint64_t scratch = WindowSolve::scratch_bytes(context, window_size, models, threads);
  if (models == Models::two_of_live) dmd.max_modes = BackgroundModel::most_modes(window_size);
  // A scene that was left: levels and limits, and the same once more for windows to come, with what
  // is known of cells. Where it is back, there are two for a moment.
  const auto of_sample = static_cast<uint64_t>(sample_bytes(context.options.depth));
  const uint64_t scene = models == Models::two_of_live
                             ? pixels * ((1 + of_sample) * kChannels + 2) +
                                   context.grid.cells() * (3 * sizeof(float) + sizeof(LearntPlace))
                             : 0;
  const uint64_t made =
      (models == Models::one ? 1 : 2) *
      (BackgroundModel::bytes(pixels, window_size, most_pictures(dmd, window_size), true) + pixels);
  return WindowSolve::bytes(context, window_size, models, threads) +
         StreamMemory::bytes(context, window_size, models) + FrameFollower::bytes(context, models) +
         SolveHistory::bytes(context.grid.cells()) + made + scene + std::max(scratch, scene);
}

uint64_t RobustLearner::bytes_to_unshare() const {
  const LearnerRoom& room = context_.room;
  return FrameMemory::bytes_to_unshare(
      WindowSolve::remembered_frames(context_, room.window_size, room.models), context_.shape());
}

double RobustLearner::solve_seconds(int window_size, Models models) const {
  // Passes over pixels, and over the grid, which has at most so many cells as small pictures have
  // pixels.
  const double n = static_cast<double>(context_.pixels()), small = std::min(1.0, n / 3000);
  const int snapshots = thinning_of(models).snapshots_of(window_size);
  return context_.options.iterations * (1e-3 * small + snapshots * (2.5e-4 * small + 2.2e-9 * n));
}

uint64_t RobustLearner::solver_bytes(int window_size) const {
  if (context_.options.dmd.solver != Solver::adjoint) return 0;
  return static_cast<uint64_t>(
      adjoint_bytes(static_cast<double>(context_.samples_at(context_.finest_step)), window_size));
}

void RobustLearner::begin(const LearnerRoom& room) {
  context_.room = room;
  if (room.models == Models::two_of_live)
    context_.options.dmd.max_modes = BackgroundModel::most_modes(room.window_size);
  memory_.begin();
  history_.begin();
  solve_.begin();
  follower_.begin();
}

void RobustLearner::forget() {
  memory_.forget();
  history_.forget();
  follower_.forget();
}

void RobustLearner::publish() {
  const bool whole = window_ && window_->size() >= context_.room.window_size;
  follower_.publish(whole && solve_.start_frames() > 0);
}

void RobustLearner::begin_scene(bool returns) {
  memory_.begin_scene(returns);
  if (const ColourMap* map = follower_.new_colours(); map && !returns) memory_.recolour(*map);
  follower_.begin_scene();
}

bool RobustLearner::recolour(Learnt* learnt) const {
  const ColourMap* const map = follower_.new_colours();
  if (map) qdmd::recolour(*map, context_.range(), learnt);
  return map != nullptr;
}

void RobustLearner::remember(Learnt* learnt) const {
  learnt->earlier.reset();
  if (!memory_.earlier().known()) return;
  LearntEarlier& earlier = learnt->earlier.emplace();
  memory_.earlier().write(context_.grid, &earlier);
  follower_.write(&earlier.places);
}

void RobustLearner::recall(const Learnt& learnt) {
  if (context_.parameters.earlier_share <= 0) return;
  if (!learnt.earlier) return memory_.earlier()->forget();
  memory_.earlier()->read(context_, *learnt.earlier);
  follower_.read(*learnt.earlier);
}

void RobustLearner::set_sample_step(int step) {
  context_.step = step;
  solve_.resize_samples();
}

void RobustLearner::decompose(const SnapshotRange& snapshots) {
  window_ = snapshots;
  if (follower_.has_found_exposure()) memory_.begin_from_here();
  settled_ = follower_.settled();
  memory_.see(snapshots);
  follower_.tell(&history_);
}

void RobustLearner::build(Slice, BackgroundModel* model) {
  const Clock::Spent before = context_.room.clock->spent();
  facts_ = {};
  {
    const Clock::Span span(*context_.room.clock, Clock::solving);
    facts_.dmd = solve_.solve(*window_, memory_.first_number(),
                              {memory_.earlier(), memory_.frames(), &history_}, model);
    // What others ask the model, and what later windows are told.
    GridFrames* const cells = follower_.cells();
    const int next = 1 - follower_.used();
    const uint8_t* const level[kChannels] = {solve_.reference().level[0].data(),
                                             solve_.reference().level[1].data(),
                                             solve_.reference().level[2].data()};
    find_cells(context_.grid, level, cells, next, context_.room.pool);
    context_.rgb.convert(cells->cells(), cells->channels(next).data());
    model->set_gains(solve_.gains_of_frames(*cells, next));
    memory_.take(solve_, *cells, next, history_);
    solve_.write_limits(model->make_limits());
  }
  facts_.settled = settled_;
  facts_.window_frames = window_->size();
  facts_.sample_step = context_.step;
  facts_.iterations = context_.options.iterations;
  facts_.solve_time = context_.room.clock->spent().since(before).of_solves();
}

}  // namespace qdmd
