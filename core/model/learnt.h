// SPDX-License-Identifier: LGPL-2.1-or-later
// What was learnt of a scene's background, to go on with later.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/channels.h"
#include "core/base/colours.h"
#include "core/planes/owned_picture.h"

namespace qdmd {

// What is known of a cell of the scene. Levels are those of the scene's own light; times are frames
// before the newest one, or kNever.
struct LearntPlace {
  static constexpr uint32_t kNever = UINT32_MAX;
  // Of the picture that is shown: it shows its background, or nobody can say; something came; what
  // was its background has left.
  static constexpr uint8_t kNone = 0, kCame = 1, kLeft = 2;

  // What it shows, and what it showed before.
  float look[kChannels] = {}, before[kChannels] = {};
  // When the look came, and the one before; the last frame that showed that.
  uint32_t since = kNever, before_since = kNever, before_until = kNever;
  // When the look came that was judged; when it was last seen that something has left; since when
  // that stands which is background because it stood for so long.
  uint32_t judged_since = kNever, left = kNever, absorbed_since = kNever;
  // Bit k % 64 of word k / 64: something passed before the look k frames before the newest one.
  uint64_t passed[2] = {};
  uint8_t judgement = kNone;
  uint8_t is_absorbed_news = 0;  // 1: no window has been told yet
};

// What windows of method=robust leave to the next. Planes have width * height samples.
struct LearntEarlier {
  std::vector<uint8_t> level[kChannels], spread;
  // What the cells of a grid have: how many frames showed the background, up to which distance, and
  // how many could have shown it.
  int rows = 0, cols = 0;
  std::vector<float> weight, limit, looked;
  std::vector<LearntPlace> places;  // of the same cells; empty: nothing is known
};

// A background in use with its statistics, and what windows to come are told of it. Planes have
// width * height samples.
struct Learnt {
  using EarlierWindow = LearntEarlier;

  int width = 0, height = 0;
  Colours colours = Colours::rgb;
  OwnedPicture picture;         // L as it was shown
  std::vector<uint8_t> limits;  // BackgroundModel::limits(), or empty
  double noise = 0;             // ForegroundStatistics::noise
  std::optional<EarlierWindow> earlier;
};

}  // namespace qdmd
