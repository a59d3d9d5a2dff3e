#include "core/scene/effects/infos.h"

namespace qdmd::scene {

std::span<const EffectInfo* const> effects() {
  // Clothes before those who wear them; leaves near the camera are in front of everybody; a shadow
  // lies on the floor that mirrors; the night's noise before the sensor's; the codec last.
  static const EffectInfo* const kEffects[] = {
      &kLowRate,     &kLength,     &kCamouflage, &kStop,     &kAbandon, &kRemove,      &kClutter,
      &kBootstrap,   &kFoliage,    &kLeaves,     &kTrees,    &kWater,   &kFlicker,     &kShadow,
      &kMirror,      &kMotionBlur, &kRain,       &kSnow,     &kDefocus, &kJitter,      &kFade,
      &kLightSwitch, &kNight,      &kBands,      &kExposure, &kNoise,   &kCompression,
  };
  return kEffects;
}

}  // namespace qdmd::scene
