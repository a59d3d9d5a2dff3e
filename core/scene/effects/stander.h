// SPDX-License-Identifier: LGPL-2.1-or-later
// People who stand somewhere in the street for long, as the effects stand and leave place them.
#pragma once

#include <limits>

#include "core/scene/effect.h"

namespace qdmd::scene {

// When a person stands, in seconds, and what the truth says about it.
struct Standing {
  double from, until;
  bool part_of_background;  // while the person stands
};

// Adds `persons` actors that walk to a place from a side of the frame, stand there, and walk away
// on the other side. `busy` of them (a share) stand before the places of most contrast, the others
// before those of least, and nobody before another one while there is room.
void add_standers(int persons, double busy, const Standing& standing, Stream& stream, Plan* plan);

}  // namespace qdmd::scene
