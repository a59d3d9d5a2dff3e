// SPDX-License-Identifier: LGPL-2.1-or-later
// The property `background`: a picture that is made when somebody asks for it.
#pragma once

#include <gst/video/video.h>

#include "core/engine/engine.h"
#include "gst/pointers.h"

namespace qdmd {

// Calls are with the lock that protects the engine.
class BackgroundSample {
 public:
  // Pictures from now on are of these caps. Call keep() before.
  void set_caps(const GstVideoInfo& info, CapsPtr caps);
  // A solve was published; the frames that come out with it have this time.
  void solved(const GstSegment& segment, GstClockTime timestamp, GstClockTime duration);
  // The newest background. It is made now where the engine has a newer one than the last. Null
  // before the first solve, and where there is no memory for it.
  GstSample* get(Engine& engine);
  // The engine is about to forget its background: the picture of it stays. After an error, which
  // makes it forget at once, the picture is the last that somebody asked for.
  void keep(Engine& engine) {
    const SamplePtr made(get(engine));
    newer_ = false;
  }
  // Null until the next solve.
  void forget();

 private:
  BufferPtr make(Engine& engine) const;

  GstVideoInfo info_ = {};
  CapsPtr caps_;
  GstSegment segment_ = {};
  GstClockTime timestamp_ = GST_CLOCK_TIME_NONE, duration_ = GST_CLOCK_TIME_NONE;
  bool newer_ = false;  // the engine's background is newer than sample_
  SamplePtr sample_;
};

}  // namespace qdmd
