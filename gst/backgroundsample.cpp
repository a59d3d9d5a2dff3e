// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gst/backgroundsample.h"

#include <exception>
#include <utility>

#include "gst/videoview.h"

GST_DEBUG_CATEGORY_EXTERN(qdmd_background_debug);
#define GST_CAT_DEFAULT qdmd_background_debug

namespace qdmd {

void BackgroundSample::set_caps(const GstVideoInfo& info, CapsPtr caps) {
  info_ = info;
  caps_ = std::move(caps);
  newer_ = false;
}

void BackgroundSample::solved(const GstSegment& segment, GstClockTime timestamp,
                              GstClockTime duration) {
  segment_ = segment;
  timestamp_ = timestamp;
  duration_ = duration;
  newer_ = true;
}

void BackgroundSample::forget() {
  sample_.reset();
  newer_ = false;
}

BufferPtr BackgroundSample::make(Engine& engine) const {
  // GStreamer's own allocator ends the process where there is no memory.
  const gsize size = GST_VIDEO_INFO_SIZE(&info_);
  gpointer memory = g_try_malloc0(size);
  if (!memory) return nullptr;
  BufferPtr buffer(
      gst_buffer_new_wrapped_full(GstMemoryFlags(0), memory, size, 0, size, memory, g_free));
  bool written = false;
  {
    MappedVideoFrame frame(&info_, buffer.get(), GST_MAP_WRITE);
    if (!frame) return nullptr;
    written = engine.write_background(frame.view<uint8_t>());
  }
  if (!written) return nullptr;
  GST_BUFFER_PTS(buffer.get()) = timestamp_;
  GST_BUFFER_DURATION(buffer.get()) = duration_;
  return buffer;
}

GstSample* BackgroundSample::get(Engine& engine) {
  if (newer_) {
    try {
      if (const BufferPtr buffer = make(engine)) {
        sample_.reset(gst_sample_new(buffer.get(), caps_.get(), &segment_, nullptr));
        newer_ = false;
      }
    } catch (const std::exception& error) {
      GST_WARNING("no background picture: %s", error.what());
    }
    if (newer_) return nullptr;
  }
  return sample_ ? gst_sample_ref(sample_.get()) : nullptr;
}

}  // namespace qdmd
