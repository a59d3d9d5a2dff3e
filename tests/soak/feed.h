// SPDX-License-Identifier: LGPL-2.1-or-later
// One element that is fed by hand; frames carry their number in their alpha, which it lets through.
#pragma once

#include <gst/gst.h>
#include <gst/video/video.h>

#include <cstdint>
#include <string>

namespace qdmd::soak {

// What must not happen: says so and ends the process.
[[noreturn]] void fail(const std::string& what);

class Feed {
 public:
  // `launch`: one element with its properties, which has a pad `src`, or is given one.
  explicit Feed(const std::string& launch);
  ~Feed();
  Feed(const Feed&) = delete;
  Feed& operator=(const Feed&) = delete;

  GstElement* element() const { return element_; }
  // The next frames have this size; `fourth` says where alpha is: RGBA or ARGB.
  void begin(int width, int height, bool alpha_first);
  // A frame of a scene that changes every 1000 frames, with its number.
  void push();
  void eos();
  void set_state(GstState state);

  // Numbers that went in and came out so far, and their sums.
  uint64_t in = 0, out = 0, sum_in = 0, sum_out = 0;
  // All that went in has come out.
  void check() const;

 private:
  static GstFlowReturn take(GstPad* pad, GstObject* parent, GstBuffer* buffer);
  static gboolean hear(GstPad* pad, GstObject* parent, GstEvent* event);

  GstElement* element_;
  GstPad *source_, *sink_, *from_;
  bool requested_ = false;
  GstVideoInfo info_ = {}, info_out_ = {};
};

}  // namespace qdmd::soak
