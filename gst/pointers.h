// GStreamer's objects with an owner.
#pragma once

#include <gst/gst.h>

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

namespace qdmd {

struct UnrefBuffer {
  void operator()(GstBuffer* buffer) const { gst_buffer_unref(buffer); }
};
using BufferPtr = std::unique_ptr<GstBuffer, UnrefBuffer>;

struct UnrefSample {
  void operator()(GstSample* sample) const { gst_sample_unref(sample); }
};
using SamplePtr = std::unique_ptr<GstSample, UnrefSample>;

struct UnrefCaps {
  void operator()(GstCaps* caps) const { gst_caps_unref(caps); }
};
using CapsPtr = std::unique_ptr<GstCaps, UnrefCaps>;

struct UnrefClock {
  void operator()(GstClock* clock) const { gst_object_unref(clock); }
};
using ClockPtr = std::unique_ptr<GstClock, UnrefClock>;

struct FreeChars {
  void operator()(gchar* chars) const { g_free(chars); }
};
using CharsPtr = std::unique_ptr<gchar, FreeChars>;

// Buffers in the order in which they came: a ring.
class BufferQueue {
 public:
  bool empty() const { return size_ == 0; }
  size_t size() const { return size_; }
  // 0: the oldest.
  GstBuffer* at(size_t index) const { return ring_[(first_ + index) % ring_.size()].get(); }
  // Room for `count` buffers in all. Throws std::bad_alloc, as push() does beyond that.
  void reserve(size_t count) {
    if (count <= ring_.size()) return;
    std::vector<BufferPtr> ring(count);
    for (size_t i = 0; i < size_; ++i) ring[i] = std::move(ring_[(first_ + i) % ring_.size()]);
    ring_ = std::move(ring);
    first_ = 0;
  }
  void push(BufferPtr buffer) {
    if (size_ == ring_.size()) reserve(2 * size_ + 1);
    ring_[(first_ + size_++) % ring_.size()] = std::move(buffer);
  }
  BufferPtr pop() {
    BufferPtr buffer = std::move(ring_[first_]);
    first_ = (first_ + 1) % ring_.size();
    --size_;
    return buffer;
  }
  void clear() {
    while (!empty()) pop();
  }

 private:
  std::vector<BufferPtr> ring_;
  size_t first_ = 0, size_ = 0;
};

}  // namespace qdmd
