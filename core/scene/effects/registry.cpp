// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/effects/infos.h"

namespace qdmd::scene {

std::span<const EffectInfo* const> effects() {
  // Clothes before those who wear them; leaves near the camera are in front of everybody; a shadow
  // lies on the floor that mirrors; the night's noise before the sensor's, and colour is taken from
  // both; what a recorder writes, the codec after that, and then what happens to the signal on its
  // way.
  static const EffectInfo* const kEffects[] = {
      &kLowRate, &kLength,      &kCamouflage, &kStop,     &kAbandon,     &kRemove, &kStand,
      &kLeave,   &kClutter,     &kBootstrap,  &kFoliage,  &kLeaves,      &kTrees,  &kWater,
      &kBoat,    &kFlicker,     &kShadow,     &kMirror,   &kMotionBlur,  &kRain,   &kSnow,
      &kFog,     &kDefocus,     &kJitter,     &kFade,     &kLightSwitch, &kLamp,   &kHeadlights,
      &kCloud,   &kNight,       &kBands,      &kExposure, &kFocusSearch, &kNoise,  &kInfrared,
      &kClock,   &kCompression, &kLostBlocks, &kSmear,    &kLostSignal,  &kFrozen,
  };
  return kEffects;
}

}  // namespace qdmd::scene
