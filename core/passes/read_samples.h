// Frames in which pixels share samples, read as if each pixel had its own.
#pragma once

#include "core/gram/window.h"

namespace qdmd {

// Samples of pixels first .. first + count - 1 in row order, of a channel of snapshot `index`:
// where they are, or, where pixels share them, in `room`, which has space for `count`.
const uint8_t* read_samples(const SnapshotRange& snapshots, int index, int channel, size_t first,
                            size_t count, uint8_t* room);

// The planes of the frame in a slot. Where pixels share samples, those of channels 1 and 2 are made
// in `room`, which has space for 2 x pixels() samples; else it may be null.
void read_planes(const PlaneSlots& frames, int slot, uint8_t* room, const uint8_t* planes[3]);

}  // namespace qdmd
