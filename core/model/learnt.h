// What was learnt of a scene's background, to go on with later.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/channels.h"

namespace qdmd {

// What a pixel's three channels are. Only the caller knows; it decides which videos a background
// belongs to.
enum class Colours : uint8_t { rgb, yuv, grey };

// Of method=robust: what a window leaves to the next. Planes have width * height samples.
struct LearntEarlier {
  std::vector<uint8_t> level[kChannels], spread;
  // By the cells of a grid.
  int rows = 0, cols = 0;
  std::vector<float> weight, limit;
};

// A background in use with its statistics, and what windows to come are told of it. Planes have
// width * height samples.
struct Learnt {
  using EarlierWindow = LearntEarlier;

  int width = 0, height = 0;
  Colours colours = Colours::rgb;
  std::vector<uint8_t> level[kChannels];  // L as it was shown, of more than 8 bits the highest
  // So many bits below these, 0 to 8; where there are none, the planes are empty.
  int low_bits = 0;
  std::vector<uint8_t> low[kChannels];
  std::vector<uint8_t> limits;  // BackgroundModel::limits(), or empty
  double noise = 0;             // ForegroundStatistics::noise
  std::optional<EarlierWindow> earlier;
};

}  // namespace qdmd
