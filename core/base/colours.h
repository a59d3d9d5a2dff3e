// What the channels of a pixel are.
#pragma once

#include <cstdint>

namespace qdmd {

// Only the caller knows; it decides which videos a background belongs to.
enum class Colours : uint8_t { rgb, yuv, grey };

}  // namespace qdmd
