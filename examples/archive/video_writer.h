// Videos without loss, a file a window, and one of all at the end.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "examples/archive/gst_pointers.h"

namespace qdmd::archive {

struct VideoShape {
  int width = 0, height = 0;  // pixels
  double rate = 0;            // frames a second
  bool grey = false;          // one byte a pixel, else R, G and B
};

// One Matroska file, or one PNG picture. Throws std::runtime_error with a sentence for the user.
class VideoWriter {
 public:
  // encoder: elements of GStreamer between raw video and the file.
  VideoWriter(const std::string& path, const VideoShape& shape, const std::string& encoder);

  // A frame without gaps between rows, shown from `time` on, in nanoseconds.
  void write(std::span<const uint8_t> frame, GstClockTime time);
  // After the last frame: the file is whole.
  void end();

 private:
  std::string path_;
  VideoShape shape_;
  size_t stride_ = 0;  // bytes from a row to the next in GStreamer's buffers
  PipelinePtr pipeline_;
  ElementPtr source_;
};

// The encoders that need no choice.
extern const char* const kLossless;
extern const char* const kPicture;

// Makes one video of those in `parts`, which are of one shape and encoder, without decoding them.
void join_videos(const std::vector<std::string>& parts, const std::string& path);

}  // namespace qdmd::archive
