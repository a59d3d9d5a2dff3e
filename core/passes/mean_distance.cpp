#include "core/passes/mean_distance.h"

#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/passes/mean_distance.cpp"
#include "core/passes/simd.h"

HWY_BEFORE_NAMESPACE();
namespace qdmd {
namespace HWY_NAMESPACE {

// Plain loops, which the compiler makes vectors of for each instruction set.

void learn(const uint16_t* HWY_RESTRICT squared, const uint8_t* HWY_RESTRICT learns, size_t count,
           float share, uint16_t* HWY_RESTRICT mean) {
  for (size_t p = 0; p < count; ++p) {
    const float distance = std::sqrt(static_cast<float>(squared[p]));
    const float level = distance < kMostMeanDistance ? distance : kMostMeanDistance;
    const auto known = static_cast<float>(mean[p]);
    const int next = static_cast<int>(known + share * (256 * level - known) + 0.5f);
    mean[p] = static_cast<uint16_t>(learns[p] ? next : mean[p]);
  }
}

void raise(const uint16_t* HWY_RESTRICT mean, int factor, size_t count,
           uint8_t* HWY_RESTRICT limit) {
  for (size_t p = 0; p < count; ++p) {
    const int own = mean[p] * factor >> 16;
    const int larger = own > limit[p] ? own : limit[p];
    limit[p] = static_cast<uint8_t>(larger < 255 ? larger : 255);
  }
}

void learn_of_noise(const uint16_t* HWY_RESTRICT squared, const uint8_t* HWY_RESTRICT limit,
                    const uint8_t* HWY_RESTRICT near, const uint8_t* HWY_RESTRICT now,
                    const uint8_t* HWY_RESTRICT before, const NoiseRates& rates, size_t count,
                    uint16_t* HWY_RESTRICT mean) {
  const int factor = rates.factor, most_of_moments = rates.most_of_moments;
  const float share = rates.share, share_of_moments = rates.share_of_moments;
  for (size_t p = 0; p < count; ++p) {
    const int known = mean[p], own = squared[p];
    const int raised = known * factor >> 16, larger = raised > limit[p] ? raised : limit[p],
              most = larger < 255 ? larger : 255;
    const int momentary = most * most_of_moments >> 8, far = momentary < 255 ? momentary : 255;
    const bool calm = (near[p] == 0) & (own <= most * most);
    const bool moment = (now[p] & ~before[p]) != 0;
    const int counts = calm | (own < far * far) ? own : far * far;
    const float distance = std::sqrt(static_cast<float>(counts));
    const float level = distance < kMostMeanDistance ? distance : kMostMeanDistance;
    const float by = calm ? share : moment ? share_of_moments : 0.0f;
    const auto from = static_cast<float>(known);
    mean[p] = static_cast<uint16_t>(static_cast<int>(from + by * (256 * level - from) + 0.5f));
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {

HWY_EXPORT(learn);
HWY_EXPORT(raise);
HWY_EXPORT(learn_of_noise);

void learn_distance(const uint16_t* squared, const uint8_t* learns, size_t count, float share,
                    uint16_t* mean) {
  HWY_DYNAMIC_DISPATCH(learn)(squared, learns, count, share, mean);
}

void raise_limit(const uint16_t* mean, int factor, size_t count, uint8_t* limit) {
  HWY_DYNAMIC_DISPATCH(raise)(mean, factor, count, limit);
}

void learn_noise(const uint16_t* squared, const uint8_t* limit, const uint8_t* near,
                 const uint8_t* now, const uint8_t* before, const NoiseRates& rates, size_t count,
                 uint16_t* mean) {
  HWY_DYNAMIC_DISPATCH(learn_of_noise)
  (squared, limit, near, now, before, rates, count, mean);
}

}  // namespace qdmd
#endif
