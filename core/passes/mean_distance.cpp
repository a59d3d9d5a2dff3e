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
    const float level = distance < kMostDistance ? distance : kMostDistance;
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

}  // namespace HWY_NAMESPACE
}  // namespace qdmd
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace qdmd {

HWY_EXPORT(learn);
HWY_EXPORT(raise);

void learn_distance(const uint16_t* squared, const uint8_t* learns, size_t count, float share,
                    uint16_t* mean) {
  HWY_DYNAMIC_DISPATCH(learn)(squared, learns, count, share, mean);
}

void raise_limit(const uint16_t* mean, int factor, size_t count, uint8_t* limit) {
  HWY_DYNAMIC_DISPATCH(raise)(mean, factor, count, limit);
}

}  // namespace qdmd
#endif
