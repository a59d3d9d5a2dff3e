// SPDX-License-Identifier: LGPL-2.1-or-later
// Frames that wait in an element, and the events that came between them.
#pragma once

#include <gst/gst.h>

#include <algorithm>
#include <cstddef>
#include <list>
#include <new>
#include <utility>
#include <vector>

#include "gst/pointers.h"

namespace qdmd {

// Frames in the order in which they came, as buffers: a ring. An event that comes while frames wait
// is held until those before it have left.
class WaitingFrames {
 public:
  bool empty() const { return size_ == 0; }
  size_t size() const { return size_; }
  // 0: the oldest.
  GstBuffer* at(size_t index) const { return ring_[(first_ + index) % ring_.size()].get(); }
  // Room for `count` frames in all. Throws std::bad_alloc, as push() does beyond that.
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
    ++popped_;
    return buffer;
  }
  // Events that are held go on when asked for.
  void clear() {
    while (!empty()) pop();
  }

  // Takes an event that comes behind the newest frame. False: no frame waits, or there is no memory
  // to hold it: it is still the caller's.
  bool hold(GstEvent* event) {
    if (empty()) return false;
    try {
      events_.push_back({popped_ + size_, nullptr});
    } catch (const std::bad_alloc&) {
      return false;
    }
    events_.back().event.reset(event);
    return true;
  }
  bool holds(const GstEvent* event) const {
    return std::any_of(events_.begin(), events_.end(),
                       [event](const Held& held) { return held.event.get() == event; });
  }
  // The oldest event before which no frame waits; null: there is none.
  EventPtr next_event() {
    if (events_.empty() || events_.front().after > popped_) return nullptr;
    EventPtr event = std::move(events_.front().event);
    events_.pop_front();
    return event;
  }

 private:
  struct Held {
    guint64 after;  // frames of the stream
    EventPtr event;
  };

  std::vector<BufferPtr> ring_;
  size_t first_ = 0, size_ = 0;
  guint64 popped_ = 0;
  // In the order in which they came. Nobody who makes one of these expects that it takes memory.
  std::list<Held> events_;
};

}  // namespace qdmd
