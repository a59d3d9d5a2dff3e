// The property `background`: a picture that is made when somebody asks for it.
#pragma once

#include <gst/video/video.h>

#include "core/engine/engine.h"
#include "gst/frameio.h"
#include "gst/pointers.h"

namespace qdmd {

// Calls are with the lock that protects the engine.
class BackgroundSample {
 public:
  // Pictures from now on are of these caps. The newest one of others was kept before.
  void set_caps(const GstVideoInfo& info, CapsPtr caps);
  // A solve was published; the frames that come out with it have this time.
  void solved(const GstSegment& segment, GstClockTime timestamp, GstClockTime duration);
  // The newest background, which is made of the engine's where that has a newer one; null before
  // the first solve, and where there is no memory for it.
  GstSample* get(Engine& engine, FrameIo& io);
  // The engine is about to forget its background: the picture of it stays.
  void keep(Engine& engine, FrameIo& io) {
    SamplePtr(get(engine, io));
    newer_ = false;
  }
  // There is none, as long as nothing is solved.
  void forget();

 private:
  BufferPtr make(Engine& engine, FrameIo& io) const;

  GstVideoInfo info_ = {};
  CapsPtr caps_;
  GstSegment segment_ = {};
  GstClockTime timestamp_ = GST_CLOCK_TIME_NONE, duration_ = GST_CLOCK_TIME_NONE;
  bool newer_ = false;  // the engine's background is newer than sample_
  SamplePtr sample_;
};

}  // namespace qdmd
