// SPDX-License-Identifier: LGPL-2.1-or-later
// The descriptions of the effects; each is defined in the one file that simulates it.
#pragma once

#include "core/scene/effect.h"

namespace qdmd::scene {

extern const EffectInfo kLowRate, kLength, kCamouflage, kStop, kAbandon, kRemove, kStand, kLeave,
    kClutter, kBootstrap, kFoliage, kLeaves, kTrees, kWater, kBoat, kFlicker, kShadow, kMirror,
    kMotionBlur, kRain, kSnow, kFog, kDefocus, kJitter, kFade, kLightSwitch, kLamp, kHeadlights,
    kCloud, kNight, kBands, kExposure, kFocusSearch, kNoise, kInfrared, kClock, kCompression,
    kLostBlocks, kSmear, kLostSignal, kFrozen;

// For EffectInfo::make.
template <typename Class>
std::unique_ptr<Effect> make_effect(Values values, const StreamSource& streams) {
  return std::make_unique<Class>(values, streams);
}

}  // namespace qdmd::scene
