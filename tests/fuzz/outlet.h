// SPDX-License-Identifier: LGPL-2.1-or-later
// A sink behind one source pad of an element that is fuzzed: it demands that what arrives are whole
// frames of the caps before them, in order.
#pragma once

#include <gst/gst.h>
#include <gst/video/video.h>

namespace qdmd::fuzz {

class Outlet {
 public:
  Outlet() = default;
  Outlet(const Outlet&) = delete;
  Outlet& operator=(const Outlet&) = delete;

  // Owns `source` from now on; a requested one is released in the end. `pushed` is how many frames
  // went in so far: none that arrives has a later number.
  void connect(GstPad* source, const gint64* pushed);
  void disconnect();
  bool connected() const { return source_; }

  // After READY no frame may come before new caps.
  void forget_caps() { has_caps_ = false; }
  void answer_with(GstFlowReturn flow) { flow_ = flow; }
  // Owns `caps`; null: any. With a pool, or without one. Upstream is told.
  void take_only(GstCaps* caps, bool pool);
  // What downstream sends and asks.
  void push_event(GstEvent* event) { gst_pad_push_event(sink_, event); }
  void ask(GstQuery* query) { gst_pad_peer_query(sink_, query); }

 private:
  static Outlet* of(GstPad* pad);
  static GstFlowReturn take(GstPad* pad, GstObject*, GstBuffer* buffer);
  static gboolean hear(GstPad* pad, GstObject*, GstEvent* event);
  static gboolean answer(GstPad* pad, GstObject* parent, GstQuery* query);

  GstPad *source_ = nullptr, *sink_ = nullptr;
  const gint64* pushed_ = nullptr;
  GstFlowReturn flow_ = GST_FLOW_OK;
  GstCaps* taken_ = nullptr;
  bool has_caps_ = false, pool_ = false;
  GstVideoInfo info_ = {};
  gint64 last_ = -1;  // number of the last frame
};

}  // namespace qdmd::fuzz
