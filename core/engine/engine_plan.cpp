// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/engine/engine_plan.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/align/restorer.h"
#include "core/foreground/decision.h"
#include "core/foreground/enlarger.h"
#include "core/foreground/soft_mask.h"
#include "core/frames/frame_reducer.h"
#include "core/learn/learner.h"
#include "core/learn/robust/robust_learner.h"
#include "core/parallel/workers.h"
#include "core/passes/read_samples.h"

namespace qdmd {
namespace {

// More than the sums of a Gram matrix can hold, or rows that are longer than a pass adds up. Bytes
// of fewer pixels, in any window, are below 2^63.
bool has_too_many_pixels(int width, int height) {
  constexpr int kLongestSide = 1 << 24;
  return width > kLongestSide || height > kLongestSide ||
         static_cast<uint64_t>(width) * static_cast<uint64_t>(height) >> 36;
}

LivePlan plan_of(const EngineOptions& options, const Learner& learner, int width, int height) {
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

Models models_of(Mode mode, int late_frames) {
  if (mode == Mode::live) return Models::two_of_live;
  return late_frames > 0 ? Models::two : Models::one;
}

// Frames that a camera's movement moves share no samples, which only a learner whose solves are one
// piece can meet while frames come.
std::unique_ptr<Learner> learner_of(const EngineOptions& options, int width, int height) {
  LearnOptions learnt = options;
  const bool moves = options.stabilize != Stabilize::off && options.method != Method::robust;
  if (moves) learnt.chroma_columns = learnt.chroma_rows = 1;
  return Learner::make(learnt, width, height);
}

std::string name_of(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

// "100 frames of 640x480".
std::string describe(const EngineOptions& options, const Reduction& size) {
  std::string text =
      std::to_string(options.window_size) + " frames of " + name_of(size.width, size.height);
  if (size.is_reduced())
    text += " (as " + name_of(size.small_width(), size.small_height()) +
            ", mask-scale=" + std::to_string(size.scale) + ")";
  return text;
}

// Of a process that has some rows of pictures.
Status check_rows(const EngineOptions& options) {
  using Code = Status::Code;
  if (!options.add) return {};
  if (options.method == Method::robust || options.mode != Mode::batch ||
      options.stabilize != Stabilize::off)
    return {Code::invalid_options,
            "processes share a picture's rows with method=qdmd and dmd, mode=batch and "
            "stabilize=off only"};
  if (options.method == Method::qdmd &&
      (options.dmd.solver == Solver::qr || options.dmd.solver == Solver::adjoint))
    return {Code::invalid_options,
            "solver=qr and solver=adjoint need all pixels in one process: use gram, gram-extended "
            "or auto"};
  if (options.mask_scale != 1)
    return {Code::invalid_options, "processes share a picture's rows with mask-scale=1 only"};
  if (options.first_row < 0 || options.first_row % options.chroma_rows != 0)
    return {Code::invalid_options, "pixels that share a sample belong to one process"};
  return {};
}

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
  if (!Reduction::is_scale(options.mask_scale))
    return {Code::invalid_options, "mask-scale must be 0 (chosen), 1, 2 or 4"};
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
  return check_rows(options);
}

}  // namespace

EnginePlan::EnginePlan(const EngineOptions& options, int width, int height)
    : options_(options), size_{width, height, 1} {
  status_ = check_options(options, width, height);
  if (!status_.ok()) return;
  size_.scale = options.mask_scale;
  if (has_too_many_pixels(width, height)) {
    layout_.bytes = UINT64_MAX;
  } else {
    const int small_width = size_.small_width(), small_height = size_.small_height();
    learner_ = learner_of(options, small_width, small_height);
    const bool live = options.mode == Mode::live;
    if (live) live_ = plan_of(options, *learner_, small_width, small_height);
    int late = 0;
    if (live)
      late = live_.most_late_frames();
    else if (!options.add)
      late = late_frames_of(options, *learner_);
    layout_ = layout_with(late);
    // Less time for a solve where there is no room for more frames.
    while (!live && late > 0 && layout_.bytes > options.max_memory)
      layout_ = layout_with(late /= 2);
    models_ = models_of(options.mode, layout_.late_frames);
  }
  status_ = check_memory();
}

EngineLayout EnginePlan::layout_with(int late_frames) const {
  const bool live = options_.mode == Mode::live;
  const int width = size_.small_width(), height = size_.small_height();
  EngineLayout layout;
  layout.late_frames = late_frames;
  layout.delay = live ? 0 : options_.window_size - 1 + late_frames;
  layout.sample_step = learner_->sample_steps().front();
  layout.capacity = options_.window_size + late_frames;
  // They are read until the last of them has left.
  if (!live && learner_->may_read_frames(options_.window_size))
    layout.capacity += options_.window_size;
  const FrameContents contents = learner_->contents();
  const ChromaShape shape = {width, height, contents.chroma_columns, contents.chroma_rows};
  layout.frame_bytes = FrameStore::plane_bytes(layout.capacity, width, height, contents);
  layout.store_bytes = FrameStore::bytes(layout.capacity, width, height, contents);
  if (!options_.window_on_disk.empty()) layout.store_bytes -= layout.frame_bytes;
  if (options_.mask_softness > 0) layout.soft_bytes = SoftMask::bytes(width, height);
  const uint64_t masks =
      Decision::bytes(width, height) + layout.soft_bytes + room_for_planes(shape, options_.depth);
  const uint64_t camera =
      options_.stabilize == Stabilize::off
          ? 0
          : Stabilizer::bytes(width, height) + Restorer::bytes(width, height, options_.depth);
  const uint64_t sizes = size_.is_reduced() ? FrameReducer::bytes(size_, options_.depth) +
                                                  Enlarger::bytes(size_, options_.depth)
                                            : 0;
  layout.bytes = saturating_sum(
      saturating_sum(layout.store_bytes, masks + camera + sizes),
      learner_->bytes(options_.window_size, layout.capacity, models_of(options_.mode, late_frames),
                      Workers::count(options_.threads)));
  return layout;
}

uint64_t EnginePlan::bytes_of_any_size() const {
  EngineOptions options = options_;
  options.add = nullptr;
  options.max_memory = UINT64_MAX;
  // Frames that arrive while a window is solved are left out where there is no room for them.
  options.frame_rate = 0;
  return std::min(EnginePlan(options, 1, 1).layout().bytes, layout_.bytes);
}

Status EnginePlan::check_memory() const {
  const std::string window = describe(options_, size_);
  if (layout_.bytes == UINT64_MAX)
    return {Status::Code::too_much_memory,
            "A window-size of " + window +
                " needs more memory than there can be, whatever max-memory allows: scale the video "
                "down, or lower window-size."};
  const uint64_t solver = learner_->solver_bytes(options_.window_size);
  if (solver > options_.max_memory)
    return {Status::Code::too_much_memory,
            "solver=adjoint with a window-size of " + window + " needs about " +
                std::to_string(solver) + " bytes and max-memory allows " +
                std::to_string(options_.max_memory) +
                ": use solver=gram, lower window-size, or scale the video down."};
  if (layout_.bytes <= options_.max_memory) return {};
  const uint64_t any_size = bytes_of_any_size();
  // Where frames are small, it is their number that counts.
  const bool few_pixels = any_size > layout_.bytes / 2;
  return {
      Status::Code::too_much_memory,
      "A window-size of " + window + " needs " + std::to_string(layout_.bytes) + " bytes (" +
          (options_.window_on_disk.empty() ? std::to_string(layout_.frame_bytes) + " for its frames"
                                           : "without its frames, which are on disk") +
          (few_pixels ? ", " + std::to_string(any_size) + " to decompose so many frames of any size"
                      : "") +
          ") and max-memory allows " + std::to_string(options_.max_memory) +
          ": lower window-size, " + (few_pixels ? "" : "scale the video down, ") +
          "or raise max-memory."};
}

Status EnginePlan::alpha_refused(uint64_t store_bytes) const {
  return {
      Status::Code::too_much_memory,
      "A window-size of " + describe(options_, size_) + " whose alpha varies needs " +
          std::to_string(layout_.bytes - layout_.store_bytes + store_bytes) +
          " bytes and max-memory allows " + std::to_string(options_.max_memory) +
          ": lower window-size, scale the video down, take the alpha out, or raise max-memory."};
}

Wishes EnginePlan::wishes_of(Wishes wishes) const {
  if (!size_.is_reduced()) return wishes;
  wishes.ignored = wishes.ignored.reduced(size_.scale);
  wishes.mask_softness = (wishes.mask_softness + size_.scale - 1) / size_.scale;
  return wishes;
}

Status EnginePlan::may_learn_from(const Learnt& learnt) const {
  const int width = size_.small_width(), height = size_.small_height();
  if (learnt.width == width && learnt.height == height) return {};
  const std::string its = name_of(learnt.width, learnt.height);
  std::string text = "it is the background of " + its + " video and this video is " +
                     name_of(size_.width, size_.height);
  if (size_.is_reduced())
    text += ", learnt as " + name_of(width, height) + ": set mask-scale to what it was";
  else
    text += ": scale the video";
  return {Status::Code::invalid_options, text + ", or save the background of video of this size."};
}

}  // namespace qdmd
