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

// Buffers in the order in which they came. Its memory is used again once it was empty, as it is
// after each window and each live frame.
class BufferQueue {
 public:
  bool empty() const { return first_ == buffers_.size(); }
  size_t size() const { return buffers_.size() - first_; }
  GstBuffer* front() const { return buffers_[first_].get(); }
  GstBuffer* back() const { return buffers_.back().get(); }
  // Room for `count` buffers. Throws std::bad_alloc, as push() does beyond that.
  void reserve(size_t count) { buffers_.reserve(count); }
  void push(BufferPtr buffer) { buffers_.push_back(std::move(buffer)); }
  BufferPtr pop() {
    BufferPtr buffer = std::move(buffers_[first_++]);
    if (empty()) clear();
    return buffer;
  }
  void clear() {
    buffers_.clear();
    first_ = 0;
  }

 private:
  std::vector<BufferPtr> buffers_;
  size_t first_ = 0;
};

}  // namespace qdmd
