// SPDX-License-Identifier: LGPL-2.1-or-later
// Owners of GStreamer's objects, and what went wrong in a pipeline.
#pragma once

#include <gst/gst.h>

#include <memory>
#include <stdexcept>
#include <string>

namespace qdmd::archive {

// Functions of GStreamer's headers belong to each file that includes them: types do not name them.
struct Free {
  void operator()(GstBuffer* buffer) const { gst_buffer_unref(buffer); }
  void operator()(GstSample* sample) const { gst_sample_unref(sample); }
  void operator()(GstMessage* message) const { gst_message_unref(message); }
  void operator()(GstCaps* caps) const { gst_caps_unref(caps); }
  void operator()(GError* error) const { g_error_free(error); }
  void operator()(gchar* text) const { g_free(text); }
  void operator()(gpointer object) const { gst_object_unref(object); }
};

struct StopPipeline {
  void operator()(GstElement* pipeline) const {
    gst_element_set_state(pipeline, GST_STATE_NULL);
    gst_object_unref(pipeline);
  }
};
using PipelinePtr = std::unique_ptr<GstElement, StopPipeline>;
using ElementPtr = std::unique_ptr<GstElement, Free>;
using PadPtr = std::unique_ptr<GstPad, Free>;
using BufferPtr = std::unique_ptr<GstBuffer, Free>;
using SamplePtr = std::unique_ptr<GstSample, Free>;
using MessagePtr = std::unique_ptr<GstMessage, Free>;
using CharsPtr = std::unique_ptr<gchar, Free>;
using CapsPtr = std::unique_ptr<GstCaps, Free>;
using BusPtr = std::unique_ptr<GstBus, Free>;

// Throws std::runtime_error with what GStreamer says.
PipelinePtr make_pipeline(const std::string& description);
ElementPtr element_of(const PipelinePtr& pipeline, const char* name);
// Throws where the pipeline posted an error; waits no longer than `timeout` for one. True: it came
// to its end.
bool has_ended(const PipelinePtr& pipeline, GstClockTime timeout, const std::string& what);

}  // namespace qdmd::archive
