#include "core/scene/effects/infos.h"

namespace qdmd::scene {

std::span<const EffectInfo* const> effects() {
  // Clothes before those who wear them; a shadow lies on the floor that mirrors; the night's noise
  // before the sensor's; the codec last.
  static const EffectInfo* const kEffects[] = {
      &kLowRate,    &kLength, &kCamouflage, &kStop,    &kAbandon,     &kRemove, &kClutter,
      &kBootstrap,  &kLeaves, &kTrees,      &kWater,   &kFlicker,     &kShadow, &kMirror,
      &kMotionBlur, &kRain,   &kSnow,       &kDefocus, &kJitter,      &kFade,   &kLightSwitch,
      &kNight,      &kBands,  &kExposure,   &kNoise,   &kCompression,
  };
  return kEffects;
}

}  // namespace qdmd::scene
