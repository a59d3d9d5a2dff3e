// SPDX-License-Identifier: LGPL-2.1-or-later
// Which frames of a window a solve looks at.
#pragma once

#include <algorithm>

#include "core/learn/learner.h"
#include "core/learn/robust/learning_steps.h"

namespace qdmd {

// Every second frame of a window like the default's tells nearly as much of its background as all
// do, in half of the time. Fewer than `least` snapshots tell less. Windows that overlap see most
// frames again: every third one is enough there.
struct Thinning {
  int least, most_stride;

  int stride_of(int frames) const {
    return frames < steps::pace::kLongWindow ? std::clamp(frames / least, 1, most_stride) : 1;
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
inline Thinning thinning_of(Models models) {
  using namespace steps::pace;
  return models == Models::two_of_live ? Thinning{kLeastOfLive, kMostStrideOfLive}
                                       : Thinning{kLeast, kMostStride};
}

// Frames between those that a solve looks at are not remembered. Windows that overlap still have a
// part of what is remembered, and need more of it: there all frames count.
inline int remembered_stride(Models models, int window_size) {
  return models == Models::two_of_live ? 1 : thinning_of(models).stride_of(window_size);
}

}  // namespace qdmd
