// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/sensor_noise.h"

#include <cmath>

namespace qdmd::scene {

SensorNoise::SensorNoise(const NoiseModel& model) : normal_(normal_quantiles(kQuantiles)) {
  for (size_t level = 0; level < deviation_.size(); ++level)
    deviation_[level] = static_cast<float>(std::sqrt(model.variance(static_cast<double>(level))));
}

void SensorNoise::add(Stream& stream, Picture* picture) const {
  uint8_t* sample = picture->samples.data();
  const size_t count = picture->samples.size();
  // Four 16-bit indices a draw.
  for (size_t i = 0; i < count; i += 4) {
    uint64_t bits = stream.next();
    const size_t end = std::min(i + 4, count);
    for (size_t k = i; k < end; ++k, bits >>= 16) {
      const float level =
          static_cast<float>(sample[k]) + deviation_[sample[k]] * normal_[bits & 0xffff];
      sample[k] = static_cast<uint8_t>(std::min(std::max(level, 0.0f), 255.0f) + 0.5f);
    }
  }
}

}  // namespace qdmd::scene
