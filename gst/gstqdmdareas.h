// SPDX-License-Identifier: LGPL-2.1-or-later
// Rectangles as users write them, and as buffers carry them.
#pragma once

#include <gst/gst.h>

#include "core/base/ignored_areas.h"

namespace qdmd {

// An array of arrays <x, y, width, height> of ints, in pixels.
GParamSpec* areas_spec(const char* name, const char* nick, const char* blurb, GParamFlags flags);

// Appends the value's rectangles. Those that are not four ints, have no pixel or are too many are
// left out; returns how many these are.
guint add_areas_of(const GValue* value, IgnoredAreas* areas);
// The other way round.
void areas_to(const IgnoredAreas& areas, GValue* value);

// Appends those GstVideoRegionOfInterestMeta of the buffer whose type is this one; 0 is none.
void add_regions_of(GstBuffer* buffer, GQuark type, IgnoredAreas* areas);

}  // namespace qdmd
