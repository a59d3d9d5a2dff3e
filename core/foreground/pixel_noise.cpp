#include "core/foreground/pixel_noise.h"

#include <cmath>

namespace qdmd {

void learn_noise(const uint16_t* __restrict squared, const uint8_t* __restrict learns, int count,
                 float share, uint16_t* __restrict mean) {
  for (int p = 0; p < count; ++p) {
    const float level = std::min(std::sqrt(static_cast<float>(squared[p])), kMostNoise);
    const auto known = static_cast<float>(mean[p]);
    const float next = known + share * (256 * level - known) + 0.5f;
    mean[p] = static_cast<uint16_t>(static_cast<int>(learns[p] ? next : known));
  }
}

void raise_limit(const uint16_t* __restrict mean, int factor, int count,
                 uint8_t* __restrict limit) {
  for (int p = 0; p < count; ++p)
    limit[p] = static_cast<uint8_t>(std::min(255, std::max<int>(limit[p], mean[p] * factor >> 16)));
}

}  // namespace qdmd
