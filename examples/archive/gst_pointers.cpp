// SPDX-License-Identifier: LGPL-2.1-or-later
#include "examples/archive/gst_pointers.h"

namespace qdmd::archive {
namespace {

using ErrorPtr = std::unique_ptr<GError, Free>;

}  // namespace

PipelinePtr make_pipeline(const std::string& description) {
  GError* error = nullptr;
  PipelinePtr pipeline(gst_parse_launch(description.c_str(), &error));
  const ErrorPtr owner(error);
  if (error) throw std::runtime_error(error->message);
  return pipeline;
}

ElementPtr element_of(const PipelinePtr& pipeline, const char* name) {
  return ElementPtr(gst_bin_get_by_name(GST_BIN(pipeline.get()), name));
}

bool has_ended(const PipelinePtr& pipeline, GstClockTime timeout, const std::string& what) {
  const BusPtr bus(gst_element_get_bus(pipeline.get()));
  const MessagePtr message(gst_bus_timed_pop_filtered(
      bus.get(), timeout, GstMessageType(GST_MESSAGE_ERROR | GST_MESSAGE_EOS)));
  if (!message) return false;
  if (GST_MESSAGE_TYPE(message.get()) == GST_MESSAGE_EOS) return true;
  GError* error = nullptr;
  gst_message_parse_error(message.get(), &error, nullptr);
  const ErrorPtr owner(error);
  throw std::runtime_error(what + ": " + error->message);
}

}  // namespace qdmd::archive
