// SPDX-License-Identifier: LGPL-2.1-or-later
// The median of the frames that show the background, and how far they lie from it.
#pragma once

#include "core/base/channels.h"
#include "core/learn/robust/stable_frames.h"
#include "core/passes/median_block.h"
#include "core/planes/chroma_shape.h"
#include "core/planes/read_ahead.h"

namespace qdmd {

struct LitPicture {
  const uint8_t* plane[kChannels];
  Gain gain;
  ChromaShape shape = {};  // of planes of shared samples; else nothing
};

// background[c][p]: the median over the frames of p's cell, in unit light; more than kMedianFrames
// are thinned evenly. spread[p]: the median of their quaternion distances from it, in steps of 1/4
// level, up to 255. frames[i]: what stable frame i is. range: what light may make of samples.
// ahead: of those frames that may lie in a file; or null.
void median_picture(const Grid& grid, const StableFrames& stable,
                    const std::vector<LitPicture>& frames, Pool* pool, uint8_t* const background[3],
                    uint8_t* spread, const SampleRange& range = {}, ReadAhead* ahead = nullptr);

}  // namespace qdmd
