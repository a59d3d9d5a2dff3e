// SPDX-License-Identifier: LGPL-2.1-or-later
// Frames of recordings, from any place on.
#pragma once

#include <gst/video/video.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/image_view.h"
#include "examples/archive/gst_pointers.h"
#include "gst/videoview.h"

namespace qdmd::archive {

// Where reading begins.
struct Place {
  size_t file = 0;         // of the files, or of the folder's pictures
  GstClockTime begin = 0;  // when that file begins, in the recording
  // A time of that file: decoding begins with a key frame before it; none: with the file.
  GstClockTime seek = GST_CLOCK_TIME_NONE;
  // Times of frames are taken as the files have them, and frames without one are left out.
  bool trusts_times = false;
};

// Reads files one after another as one recording, or a folder's pictures (PNG or JPEG) in the order
// of their names. Whatever can be decoded is. Frames keep their format where the element takes it,
// else the nearest that loses nothing; if later ones differ, they become like the first. Grey
// pictures become coloured, because others may follow. Throws std::runtime_error with a sentence
// for the user.
class FrameReader {
 public:
  // rate: of pictures, and of files that do not say theirs, frames a second. like: what frames are
  // to be; null: like the first.
  FrameReader(std::vector<std::string> paths, double rate, const GstVideoInfo* like = nullptr);
  ~FrameReader();

  // Before the first next().
  void begin_at(const Place& place);
  // The next frame, from the beginning or from the place that was given: from a key frame before a
  // time, there may be earlier ones. False at the end.
  bool next();
  // It, good until the next call.
  GstBuffer* buffer() const;
  ImageView view();
  // When it is shown, in nanoseconds from the recording's first frame.
  GstClockTime time() const { return time_; }
  // Once there is a frame: of all frames, with their rate.
  const GstVideoInfo& info() const;
  // Files, or pictures.
  const std::vector<std::string>& files() const { return files_; }
  bool pictures() const { return pictures_; }

 private:
  struct Kept;
  void open();
  bool feed();
  bool next_of_file();
  bool take(SamplePtr sample);
  std::string what_failed() const;

  std::vector<std::string> files_;
  bool pictures_ = false, trusts_times_ = false;
  double rate_;
  size_t next_file_ = 0;
  GstClockTime seek_ = GST_CLOCK_TIME_NONE;
  std::unique_ptr<Kept> kept_;
  PipelinePtr pipeline_;
  ElementPtr source_, sink_;
  SamplePtr sample_;
  std::optional<MappedVideoFrame> frame_;
  // Where the file begins, and where its newest frame ends, in time.
  GstClockTime begin_ = 0, end_ = 0, time_ = 0;
};

}  // namespace qdmd::archive
