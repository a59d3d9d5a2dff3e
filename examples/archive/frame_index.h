// SPDX-License-Identifier: LGPL-2.1-or-later
// When the frames of files are shown, found without decoding them.
#pragma once

#include <gst/gst.h>

#include <string>
#include <vector>

namespace qdmd::archive {

struct FrameIndex {
  // In the order in which frames are shown, nanoseconds from the file's beginning. Empty: they
  // cannot be found so.
  std::vector<GstClockTime> times;
  // After a seek, frames have these times: their numbers can be told. False where that is not sure.
  bool exact = false;
  // A sentence for the user where the file ends long before the end that it names; or empty.
  std::string early_end;
};

// length: of a frame, nanoseconds. Never throws because of the file: reading it says what is wrong.
FrameIndex index_of(const std::string& file, GstClockTime length);

}  // namespace qdmd::archive
