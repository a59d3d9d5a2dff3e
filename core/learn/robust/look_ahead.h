// What frames that wait say of the first window's background: it knows nothing of what came before.
#pragma once

#include <cstdint>
#include <vector>

#include "core/learn/robust/stable_frames.h"
#include "core/learn/robust/standing_looks.h"

namespace qdmd {

// Follows frames as they come, while those of a stream's first window wait to leave. What stood
// there in most of that window's frames, and is gone in frames that came after it, was no
// background.
class LookAhead {
 public:
  LookAhead() = default;
  // Takes all memory.
  explicit LookAhead(const Grid& grid);
  static uint64_t bytes(const Grid& grid) { return StandingLooks::bytes(grid) + grid.cells(); }

  // A stream, or a scene, begins.
  void forget();
  // A background is in use now, whose cells show what these of `frames` frames show. first: no
  // window of the stream was known when it was made.
  void publish(bool first, const StableFrames& stable, int frames);
  // False: nothing is looked for until the next stream.
  bool follows() const { return state_ != State::over; }
  bool knows_background() const { return state_ == State::first_window; }

  // The next frame of the stream, its levels divided by `gain`; while it follows().
  void follow(const float* const frame[3], const Gain& gain, int64_t number) {
    looks_.follow(frame, gain, number);
  }
  // Cells that show now what is behind the background in use. Good until the next call.
  const std::vector<int>& uncovered(const float* const background[3]);
  const StandingLooks& looks() const { return looks_; }

 private:
  enum class State { before, first_window, over };

  State state_ = State::before;
  StandingLooks looks_;
  std::vector<uint8_t> percent_;  // of the window's frames that show the cell's background
};

}  // namespace qdmd
