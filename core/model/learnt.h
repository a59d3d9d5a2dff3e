// What was learnt of a scene's background, to go on with later.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/channels.h"
#include "core/base/colours.h"
#include "core/planes/owned_picture.h"

namespace qdmd {

// What a window of method=robust leaves to the next. Planes have width * height samples.
struct LearntEarlier {
  std::vector<uint8_t> level[kChannels], spread;
  // What the cells of a grid have.
  int rows = 0, cols = 0;
  std::vector<float> weight, limit;
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
