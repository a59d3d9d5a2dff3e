// Frames of every format that the element takes, as the core's pictures.
#pragma once

#include <vector>

#include "core/foreground/foreground.h"
#include "gst/videoview.h"

namespace qdmd {

// R, G and B are the core's channels, and so are Y, U and V, each chroma sample standing for the
// pixels that share it: a pixel's quaternion is R i + G j + B k or Y i + U j + V k. Grey is all
// three channels. Formats that the core cannot read in place go through planes of this object.
class FrameIo {
 public:
  // What it takes for frames of `info`.
  static guint64 bytes(const GstVideoInfo& info);
  // Gives it back.
  void clear() { std::vector<uint8_t>().swap(samples_); }

  ImageView read(const MappedVideoFrame& frame);
  // Calls fill(view), which writes what `output` says, and puts it into the frame. In Y, U and V a
  // residual is shown by its luma, and black and white are those of video: 16 and 235, with a
  // mask's greys in between.
  template <typename Fill>
  void write(MappedVideoFrame* frame, Output output, Fill fill) {
    if (frame->has_view()) {
      fill(frame->view<uint8_t>());
      return;
    }
    fill(planes(frame->frame()));
    put(&frame->frame(), output);
  }

 private:
  MutableImageView planes(const GstVideoFrame& frame);
  void put(GstVideoFrame* frame, Output output) const;

  std::vector<uint8_t> samples_;
};

}  // namespace qdmd
