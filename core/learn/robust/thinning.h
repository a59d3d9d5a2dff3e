// Which frames of a window a solve looks at.
#pragma once

#include <algorithm>

#include "core/learn/learner.h"

namespace qdmd {

// Every second frame of a window like the default's tells nearly as much of its background as all
// do, in half of the time. Fewer than `least` snapshots tell less. Windows that overlap see most
// frames again: every third one is enough there. A window of kLongWindow frames and more is for the
// best background that there is.
constexpr int kLongWindow = 120;
struct Thinning {
  int least, most_stride;

  int stride_of(int frames) const {
    return frames < kLongWindow ? std::clamp(frames / least, 1, most_stride) : 1;
  }
  int snapshots_of(int frames) const {
    const int stride = stride_of(frames);
    return (frames + stride - 1) / stride;
  }
  // The most snapshots of windows that grow up to this size.
  int most_snapshots(int window_size) const {
    int most = 0;
    for (int frames = 1; frames <= window_size; ++frames)
      most = std::max(most, snapshots_of(frames));
    return most;
  }
};
constexpr Thinning thinning_of(Models models) {
  return models == Models::two_of_live ? Thinning{33, 3} : Thinning{50, 2};
}

}  // namespace qdmd
