// SPDX-License-Identifier: LGPL-2.1-or-later
// Tells the core what a video format's samples are.
#pragma once

#include <algorithm>
#include <iterator>

#include "core/engine/engine_options.h"
#include "gst/videoview.h"

namespace qdmd {

inline Colours colours_of(const GstVideoInfo& info) {
  if (GST_VIDEO_INFO_IS_YUV(&info)) return Colours::yuv;
  return GST_VIDEO_INFO_IS_GRAY(&info) ? Colours::grey : Colours::rgb;
}

// All of the options that depend on the format.
inline void set_format(const GstVideoInfo& info, EngineOptions* options) {
  options->colours = colours_of(info);
  options->levels = levels_of(info);
  options->depth = bits_of(info).depth;
  options->chroma_columns = 1 << GST_VIDEO_FORMAT_INFO_W_SUB(info.finfo, 1);
  options->chroma_rows = 1 << GST_VIDEO_FORMAT_INFO_H_SUB(info.finfo, 1);
}

// Frames of both have samples at the same places, and the same of them are black and white. What
// else the caps say (rate, shape of pixels, colour space) changes no sample.
inline bool has_same_samples(const GstVideoInfo& one, const GstVideoInfo& other) {
  const auto same = [](const auto& a, const auto& b) {
    return std::equal(std::begin(a), std::end(a), std::begin(b));
  };
  if (GST_VIDEO_INFO_FORMAT(&one) != GST_VIDEO_INFO_FORMAT(&other) ||
      GST_VIDEO_INFO_WIDTH(&one) != GST_VIDEO_INFO_WIDTH(&other) ||
      GST_VIDEO_INFO_HEIGHT(&one) != GST_VIDEO_INFO_HEIGHT(&other) ||
      GST_VIDEO_INFO_SIZE(&one) != GST_VIDEO_INFO_SIZE(&other))
    return false;
  const Levels levels = levels_of(one), others = levels_of(other);
  return same(levels.black, others.black) && same(levels.white, others.white);
}

}  // namespace qdmd
