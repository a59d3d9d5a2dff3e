// SPDX-License-Identifier: LGPL-2.1-or-later
// Videos and pictures as files, without loss.
#pragma once

#include <gst/video/video.h>

#include <string>
#include <vector>

#include "core/base/image_view.h"
#include "examples/archive/gst_pointers.h"

namespace qdmd::archive {

// The encoder that needs no choice.
extern const char* const kLossless;

// Elements from raw video like `info` to what the encoder makes of it.
std::string encoding(const std::string& encoder, const GstVideoInfo& info);

// One PNG. Throws std::runtime_error with a sentence for the user, as below.
void write_png(const std::string& path, const GstVideoInfo& info, GstBuffer* picture);

// Makes one video of those in `parts`, which are of one shape and encoder, without decoding them.
void join_videos(const std::vector<std::string>& parts, const std::string& path);

}  // namespace qdmd::archive
