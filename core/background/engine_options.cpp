#include "core/background/engine_options.h"

#include <cmath>

#include "core/background/live_schedule.h"
#include "core/background/window_solver.h"
#include "core/dmd/qdmd.h"

namespace qdmd {
namespace {

// The coarsest step that moved the background of no sequence of docs/sampling.md by more than 0.1
// level: there is none above 1.
constexpr int kChosenStep = 1;

}  // namespace

LiveSchedule schedule_of(const EngineOptions& options, size_t pixels) {
  return LiveSchedule(options.window_size, options.hop_size, Window::bytes(1, pixels),
                      options.dmd.method == Method::robust);
}

EngineLayout layout_of(const EngineOptions& options, int width, int height) {
  const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  EngineLayout layout;
  layout.sample_step = options.sample_step > 0 ? options.sample_step
                       : options.dmd.method == Method::robust
                           ? RobustSolver::chosen_step(width, height)
                           : kChosenStep;
  layout.capacity = options.window_size;
  if (options.mode == Mode::live)
    layout.capacity += schedule_of(options, pixels).most_late_frames();
  layout.frame_bytes = Window::bytes(layout.capacity, pixels);
  const uint64_t beside =
      options.dmd.method == Method::robust
          ? RobustSolver::bytes(layout.capacity, width, height, layout.sample_step)
          : WindowSolver::sample_bytes(layout.capacity, width, height, layout.sample_step);
  if (__builtin_add_overflow(layout.frame_bytes, beside, &layout.bytes)) layout.bytes = UINT64_MAX;
  return layout;
}

Status check_options(const EngineOptions& options, int width, int height) {
  using Code = Status::Code;
  if (width < 1 || height < 1) return {Code::invalid_options, "a frame needs at least one pixel"};
  if (options.window_size < EngineOptions::kMinWindow ||
      options.window_size > EngineOptions::kMaxWindow)
    return {Code::invalid_options, "window-size must be 2 to 2048 frames"};
  if (options.hop_size < 0 || options.hop_size > options.window_size)
    return {Code::invalid_options, "hop-size must be 0 (a quarter of the window) to window-size"};
  if (options.iterations < 1 || options.iterations > EngineOptions::kMaxIterations)
    return {Code::invalid_options, "iterations must be 1 to 20"};
  if (options.sample_step < 0 || options.sample_step > EngineOptions::kMaxSampleStep)
    return {Code::invalid_options, "sample-step must be 0 (chosen) to 64"};
  if (options.dmd.rank < 0 || !(options.dmd.omega_threshold >= 0) ||
      !(options.foreground_threshold >= 0))
    return {Code::invalid_options,
            "rank, omega-threshold and foreground-threshold must not be negative"};
  if (options.threads < 0 || options.threads > EngineOptions::kMaxThreads)
    return {Code::invalid_options, "n-threads must be 0 (all cores) to 256"};
  const std::string frames = std::to_string(options.window_size) + " frames of " +
                             std::to_string(width) + "x" + std::to_string(height);
  const EngineLayout layout = layout_of(options, width, height);
  if (layout.bytes > options.max_memory)
    return {Code::too_much_memory,
            "A window-size of " + frames + " needs " + std::to_string(layout.bytes) + " bytes (" +
                std::to_string(layout.frame_bytes) + " for its frames) and max-memory allows " +
                std::to_string(options.max_memory) +
                ": lower window-size, scale the video down, or raise max-memory."};
  if (options.dmd.method != Method::dmd && options.dmd.solver == Solver::adjoint) {
    // Method::robust decomposes sampled pixels only.
    const int step = options.dmd.method == Method::robust ? layout.sample_step : 1;
    const double pixels = std::ceil(static_cast<double>(width) / step) *
                          std::ceil(static_cast<double>(height) / step);
    const double solver = adjoint_bytes(pixels, options.window_size);
    if (solver > static_cast<double>(options.max_memory))
      return {Code::too_much_memory,
              "solver=adjoint with a window-size of " + frames + " needs about " +
                  std::to_string(static_cast<uint64_t>(solver)) + " bytes and max-memory allows " +
                  std::to_string(options.max_memory) +
                  ": use solver=gram, lower window-size, or scale the video down."};
  }
  return {};
}

}  // namespace qdmd
