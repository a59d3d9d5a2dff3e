#include "core/background/engine.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "core/dmd/decompose.h"
#include "core/dmd/qdmd.h"

namespace qdmd {
namespace {

// Frames that enter the Gram matrix together: few enough that little is left to do when a window is
// full, enough that they fill a register tile and the window is not read from memory for each of
// them.
constexpr int kGramGroup = 16;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

int thread_count(const EngineOptions& options) {
  if (options.threads > 0) return options.threads;
  // Zero where the system does not tell.
  return static_cast<int>(std::clamp<unsigned>(std::thread::hardware_concurrency(), 1,
                                               unsigned{EngineOptions::kMaxThreads}));
}

void copy_plane(const uint8_t* from, const ImageView& frame, uint8_t* to) {
  for (int row = 0; row < frame.height; ++row, from += frame.row_stride, to += frame.width) {
    const uint8_t* sample = from;
    for (int col = 0; col < frame.width; ++col, sample += frame.pixel_stride) to[col] = *sample;
  }
}

Status check(const EngineOptions& options, int width, int height) {
  using Code = Status::Code;
  if (width < 1 || height < 1) return {Code::invalid_options, "a frame needs at least one pixel"};
  if (options.window_size < EngineOptions::kMinWindow ||
      options.window_size > EngineOptions::kMaxWindow)
    return {Code::invalid_options, "window-size must be 2 to 2048 frames"};
  if (options.dmd.rank < 0 || !(options.dmd.omega_threshold >= 0) ||
      !(options.foreground_threshold >= 0))
    return {Code::invalid_options,
            "rank, omega-threshold and foreground-threshold must not be negative"};
  if (options.threads < 0 || options.threads > EngineOptions::kMaxThreads)
    return {Code::invalid_options, "n-threads must be 0 (all cores) to 256"};
  const std::string frames = std::to_string(options.window_size) + " frames of " +
                             std::to_string(width) + "x" + std::to_string(height);
  const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  const uint64_t window = Window::bytes(options.window_size, pixels);
  if (window > options.max_memory)
    return {Code::too_much_memory,
            "A window-size of " + frames + " needs " + std::to_string(window) +
                " bytes and max-memory allows " + std::to_string(options.max_memory) +
                ": lower window-size, scale the video down, or raise max-memory."};
  if (options.dmd.method == Method::qdmd && options.dmd.solver == Solver::adjoint) {
    const double solver = adjoint_bytes(static_cast<double>(pixels), options.window_size);
    if (solver > static_cast<double>(options.max_memory))
      return {Code::too_much_memory,
              "solver=adjoint with a window-size of " + frames + " needs about " +
                  std::to_string(static_cast<uint64_t>(solver)) + " bytes and max-memory allows " +
                  std::to_string(options.max_memory) +
                  ": use solver=gram, lower window-size, or scale the video down."};
  }
  return {};
}

}  // namespace

Status Engine::configure(const EngineOptions& options, int width, int height) {
  const Status status = check(options, width, height);
  if (!status.ok()) return status;
  options_ = options;
  width_ = width;
  height_ = height;
  const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  // The old window goes first: two at once would break the promise of max-memory.
  window_ = Window();
  window_ = Window(options.window_size, pixels);
  gram_ = SlidingGram();
  pool_ = std::make_unique<Pool>(thread_count(options));
  gram_ = SlidingGram(options.window_size, pool_.get());
  alpha_ = AlphaStore(options.window_size);
  report_ = SolveReport();
  solves_ = 0;
  flush();
  return {};
}

Status Engine::push(const ImageView& frame) {
  if (window_.capacity() == 0)
    return {Status::Code::not_configured, "configure the engine before pushing frames"};
  if (ready_ > 0)
    return {Status::Code::frames_are_waiting, "pop the frames that are ready before pushing more"};
  if (frame.width != width_ || frame.height != height_)
    return {Status::Code::invalid_options, "configure the engine anew for frames of another size"};
  if (start_new_window_) flush();
  const int slot = window_.append();
  for (int c = 0; c < kChannels; ++c) copy_plane(frame.channel[c], frame, window_.plane(slot, c));
  alpha_.set(slot, frame);
  ++pending_;
  // Frames of the window before are left out: they count only if this window ends early.
  if (++not_in_gram_ == std::min(kGramGroup, options_.window_size))
    update_gram(not_in_gram_, pending_);
  if (pending_ == options_.window_size) solve();
  return {};
}

Status Engine::drain() {
  if (window_.capacity() == 0)
    return {Status::Code::not_configured, "configure the engine before draining it"};
  if (pending_ > ready_) solve();
  start_new_window_ = true;
  return {};
}

void Engine::flush() {
  window_.clear();
  pending_ = ready_ = 0;
  start_new_window_ = false;
  not_in_gram_ = 0;
  gram_seconds_ = 0;
}

void Engine::update_gram(int count, int span) {
  const auto start = std::chrono::steady_clock::now();
  gram_.add_newest(window_, count, span);
  not_in_gram_ = 0;
  gram_seconds_ += seconds_since(start);
}

void Engine::solve() {
  if (pending_ < window_.size())
    update_gram(pending_, window_.size());
  else if (not_in_gram_ > 0)
    update_gram(not_in_gram_, pending_);
  const auto start = std::chrono::steady_clock::now();
  const Decomposition decomposition = decompose(window_, gram_.matrix(window_), options_.dmd);
  report_.solve_time = seconds_since(start);
  report_.dmd = decomposition.summary;
  report_.window_frames = window_.size();
  model_.build(window_, decomposition.background);
  report_.foreground = foreground_statistics(window_, model_, options_.foreground_threshold);
  report_.gram_time = gram_seconds_;
  gram_seconds_ = 0;
  ++solves_;
  ready_ = pending_;
}

void Engine::set_foreground_threshold(double threshold) {
  options_.foreground_threshold = threshold;
  report_.foreground.threshold =
      threshold > 0 ? threshold : automatic_threshold(report_.foreground.noise);
}

void Engine::pop(Output output, const MutableImageView& out) {
  if (ready_ == 0) return;
  const int index = window_.size() - pending_;
  const int slot = window_.slot(index);
  model_.set_time(index);
  write_output(window_, slot, model_, output, report_.foreground.threshold, alpha_.samples(slot),
               alpha_.constant(slot), out);
  --pending_;
  --ready_;
}

}  // namespace qdmd
