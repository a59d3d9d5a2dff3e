#include "core/engine/engine_options.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/align/restorer.h"
#include "core/foreground/decision.h"
#include "core/foreground/soft_mask.h"
#include "core/learn/learner.h"
#include "core/learn/robust/robust_learner.h"
#include "core/parallel/workers.h"
#include "core/passes/read_samples.h"

namespace qdmd {
namespace {

// Rows of the picture where a member's own ones may begin: a row of cells does, and pixels that
// share a sample stay together.
std::vector<int> tops_of(const EngineOptions& options, int width, int height) {
  const Grid grid(width, height);
  std::vector<int> tops;
  for (int row = 0; row < grid.rows; ++row)
    if (grid.top(row) % options.chroma_rows == 0) tops.push_back(grid.top(row));
  return tops;
}

// More than the sums of a Gram matrix can hold, or rows that are longer than a pass adds up. Bytes
// of fewer pixels, in any window, are below 2^63.
bool has_too_many_pixels(int width, int height) {
  constexpr int kLongestSide = 1 << 24;
  return width > kLongestSide || height > kLongestSide ||
         static_cast<uint64_t>(width) * static_cast<uint64_t>(height) >> 36;
}

LivePlan plan_for(const EngineOptions& options, const Learner& learner, int width, int height) {
  const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  const int piece = learner.in_one_piece()
                        ? LivePlan::piece_frames(pixels, learner.solve_seconds(options.window_size,
                                                                               Models::two_of_live))
                        : 0;
  return LivePlan(options.window_size, options.hop_size, PlaneSlots::bytes(1, pixels), piece);
}

uint64_t saturating_sum(uint64_t a, uint64_t b) {
  return __builtin_add_overflow(a, b, &a) ? UINT64_MAX : a;
}

// In batch mode.
int late_frames_of(const EngineOptions& options, const Learner& learner) {
  // A solve that takes less of a frame's time is done at once.
  constexpr double kAtOnce = 1.0 / 3;
  // Other machines, and other work on this one.
  constexpr double kMargin = 4;
  const double frames =
      learner.solve_seconds(options.window_size, Models::two) * options.frame_rate;
  if (!(frames > kAtOnce)) return 0;
  return static_cast<int>(
      std::min<double>(std::ceil(kMargin * frames), (options.window_size + 3) / 4));
}

EngineLayout layout_with(const EngineOptions& options, const Learner& learner, int width,
                         int picture_height, int late_frames) {
  const Band band = band_of(options, width, picture_height);
  const int height = band.rows();
  const bool live = options.mode == Mode::live;
  EngineLayout layout;
  layout.late_frames = late_frames;
  layout.delay = live ? 0 : options.window_size - 1 + late_frames;
  layout.sample_step = learner.sample_steps().front();
  layout.capacity = options.window_size + late_frames;
  // They are read until the last of them has left.
  if (!live && learner.may_read_frames(options.window_size)) layout.capacity += options.window_size;
  const FrameContents contents = learner.contents();
  const ChromaShape shape = {width, height, contents.chroma_columns, contents.chroma_rows};
  layout.frame_bytes = PlaneSlots::bytes(layout.capacity, shape, options.depth);
  layout.store_bytes = FrameStore::bytes(layout.capacity, width, band, contents);
  if (options.mask_softness > 0) layout.soft_bytes = SoftMask::bytes(width, height);
  const uint64_t masks =
      Decision::bytes(width, band) + layout.soft_bytes + room_for_planes(shape, options.depth);
  const uint64_t camera =
      options.stabilize == Stabilize::off
          ? 0
          : Stabilizer::bytes(width, height) + Restorer::bytes(width, height, options.depth);
  layout.bytes = saturating_sum(
      saturating_sum(layout.store_bytes, masks + camera),
      learner.bytes(options.window_size, layout.capacity, models_of(options.mode, late_frames),
                    Workers::count(options.threads)));
  return layout;
}

}  // namespace

LivePlan plan_of(const EngineOptions& options, int width, int height) {
  return plan_for(options, *learner_of(options, width, height), width, height);
}

std::unique_ptr<Learner> learner_of(const EngineOptions& options, int width, int height) {
  LearnOptions learnt = options;
  const bool moves = options.stabilize != Stabilize::off && options.method != Method::robust;
  if (moves) learnt.chroma_columns = learnt.chroma_rows = 1;
  return Learner::make(learnt, width, band_of(options, width, height));
}

Models models_of(Mode mode, int late_frames) {
  if (mode == Mode::live) return Models::two_of_live;
  return late_frames > 0 ? Models::two : Models::one;
}

EngineLayout layout_of(const EngineOptions& options, int width, int height) {
  if (has_too_many_pixels(width, height)) {
    EngineLayout layout;
    layout.bytes = UINT64_MAX;
    return layout;
  }
  const auto learner = learner_of(options, width, height);
  if (options.mode == Mode::live)
    return layout_with(options, *learner, width, height,
                       plan_for(options, *learner, width, height).most_late_frames());
  // Less time for a solve where there is no room for more frames.
  for (int late = options.team ? 0 : late_frames_of(options, *learner);; late /= 2) {
    const EngineLayout layout = layout_with(options, *learner, width, height, late);
    if (late == 0 || layout.bytes <= options.max_memory) return layout;
  }
}

std::string describe(const EngineOptions& options, int width, int height) {
  return std::to_string(options.window_size) + " frames of " + std::to_string(width) + "x" +
         std::to_string(height);
}

Band band_of(const EngineOptions& options, int width, int height) {
  if (!options.team) return Band(height);
  const std::vector<int> tops = tops_of(options, width, height);
  const auto size = static_cast<size_t>(options.team->size());
  std::vector<int> ends;
  for (size_t rank = 1; rank < size; ++rank) ends.push_back(tops[rank * tops.size() / size]);
  ends.push_back(height);
  const int learnt = options.method == Method::robust ? RobustLearner::reach(options) : 0;
  const int halo = learnt + Decision::reach(width, height), together = options.chroma_rows;
  return Band(options.team, std::move(ends), (halo + together - 1) / together * together);
}

namespace {

Status check_team(const EngineOptions& options, int width, int height) {
  using Code = Status::Code;
  if (!options.team) return {};
  if (options.mode != Mode::batch || options.stabilize != Stabilize::off ||
      options.mask_softness > 0 || options.depth > 8)
    return {
        Code::invalid_options,
        "processes share a window in mode=batch with stabilize=off and mask-softness=0 only, of "
        "video of 8 bits"};
  // What an earlier window's background was is not known as far outwards as its frames are.
  if (options.method == Method::robust && options.remembers)
    return {Code::invalid_options,
            "processes that share a window forget it before the next: remembers=false"};
  if (options.method != Method::dmd &&
      (options.dmd.solver == Solver::qr || options.dmd.solver == Solver::adjoint))
    return {Code::invalid_options,
            "solver=qr and solver=adjoint need all pixels in one process: use gram, gram-extended "
            "or auto"};
  const auto most = static_cast<int>(tops_of(options, width, height).size());
  if (options.team->size() > most)
    return {Code::invalid_options, "frames of " + std::to_string(width) + "x" +
                                       std::to_string(height) + " can be shared by " +
                                       std::to_string(most) + " processes at most: start fewer"};
  return {};
}

}  // namespace

Status check_options(const EngineOptions& options, int width, int height) {
  using Code = Status::Code;
  if (width < 1 || height < 1) return {Code::invalid_options, "a frame needs at least one pixel"};
  if (options.window_size < EngineOptions::kMinWindow ||
      options.window_size > EngineOptions::kMaxWindow)
    return {Code::invalid_options, "window-size must be 2 to 2048 frames"};
  if (options.hop_size < 0 ||
      (options.mode == Mode::live && options.hop_size > options.window_size))
    return {Code::invalid_options, "hop-size must be 0 (a quarter of the window) to window-size"};
  if (options.iterations < 1 || options.iterations > EngineOptions::kMaxIterations)
    return {Code::invalid_options, "iterations must be 1 to 20"};
  if (options.sample_step < 0 || options.sample_step > EngineOptions::kMaxSampleStep)
    return {Code::invalid_options, "sample-step must be 0 (chosen) to 64"};
  if (options.dmd.rank < 0 || !(options.dmd.omega_threshold >= 0) ||
      !(options.foreground_threshold >= 0))
    return {Code::invalid_options,
            "rank, omega-threshold and foreground-threshold must not be negative"};
  if (options.mask_softness < 0 || options.mask_softness > kMostSoftness)
    return {Code::invalid_options, "mask-softness must be 0 (hard) to 15 pixels"};
  if (options.depth < 8 || options.depth > EngineOptions::kMostDepth)
    return {Code::invalid_options, "a sample has 8 to 16 bits"};
  if (options.chroma_columns < 1 || options.chroma_columns > 2 || options.chroma_rows < 1 ||
      options.chroma_rows > 2)
    return {Code::invalid_options, "one or two pixels in a row or column share a sample"};
  if (options.chroma_columns * options.chroma_rows > 1 && options.colours != Colours::yuv)
    return {Code::invalid_options, "pixels share samples of U and V, not of other colours"};
  if (!(options.frame_rate >= 0)) return {Code::invalid_options, "a frame rate is not negative"};
  if (options.threads < 0 || options.threads > EngineOptions::kMaxThreads)
    return {Code::invalid_options, "n-threads must be 0 (all cores) to 256"};
  if (Status status = check_team(options, width, height); !status.ok()) return status;
  const EngineLayout layout = layout_of(options, width, height);
  if (layout.bytes == UINT64_MAX)
    return {Code::too_much_memory,
            "A window-size of " + describe(options, width, height) +
                " needs more memory than there can be, whatever max-memory allows: scale the video "
                "down, or lower window-size."};
  const uint64_t solver = Learner::make(options, width, band_of(options, width, height))
                              ->solver_bytes(options.window_size);
  if (solver > options.max_memory)
    return {Code::too_much_memory,
            "solver=adjoint with a window-size of " + describe(options, width, height) +
                " needs about " + std::to_string(solver) + " bytes and max-memory allows " +
                std::to_string(options.max_memory) +
                ": use solver=gram, lower window-size, or scale the video down."};
  if (layout.bytes > options.max_memory)
    return {Code::too_much_memory,
            "A window-size of " + describe(options, width, height) + " needs " +
                std::to_string(layout.bytes) + " bytes (" + std::to_string(layout.frame_bytes) +
                " for its frames) and max-memory allows " + std::to_string(options.max_memory) +
                ": lower window-size, scale the video down, or raise max-memory."};
  return {};
}

}  // namespace qdmd
