// Videos without loss, a file a window, and one of all at the end.
#pragma once

#include <gst/video/video.h>

#include <span>
#include <string>
#include <vector>

#include "examples/archive/gst_pointers.h"

namespace qdmd::archive {

// One Matroska file, or one PNG picture. Throws std::runtime_error with a sentence for the user.
class VideoWriter {
 public:
  // Writes frames like `info`, `rate` a second. encoder: elements of GStreamer between raw video
  // and the file.
  VideoWriter(const std::string& path, const GstVideoInfo& info, double rate,
              const std::string& encoder);

  // A frame, as it lies in GStreamer's buffers, shown from `time` on, in nanoseconds.
  void write(std::span<const uint8_t> frame, GstClockTime time);
  // After the last frame: the file is whole.
  void end();

 private:
  std::string path_;
  GstClockTime length_;  // of a frame
  PipelinePtr pipeline_;
  ElementPtr source_;
};

// The encoders that need no choice.
extern const char* const kLossless;
extern const char* const kPicture;

// Makes one video of those in `parts`, which are of one shape and encoder, without decoding them.
void join_videos(const std::vector<std::string>& parts, const std::string& path);

}  // namespace qdmd::archive
