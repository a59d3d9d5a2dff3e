// Tells the core what a video format's samples are.
#pragma once

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

}  // namespace qdmd
