// SPDX-License-Identifier: LGPL-2.1-or-later
// Scenes as text: presets, and lists of effects with their values.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/effect.h"

namespace qdmd::scene {

// An effect that a scene names, with a value for each of its parameters.
struct NamedEffect {
  const EffectInfo* info;
  std::vector<double> values;
};

struct Preset {
  const char* name;
  const char* effects;  // as text
  const char* intent;
};

// Presets that are not one effect alone. Every effect's name is a preset too: that effect with its
// standard values, which is the smallest scene that shows it.
std::span<const Preset> presets();

// Reads "preset" or "effect=value:parameter=value,effect,...", also mixed. Spaces do not count. The
// effects come in the order of effects(), whatever the text's; of two with one name the later
// holds. The empty text and "default" name no effect.
// Throws std::invalid_argument with a sentence that lists what is allowed.
std::vector<NamedEffect> parse_scene(std::string_view text);

}  // namespace qdmd::scene
