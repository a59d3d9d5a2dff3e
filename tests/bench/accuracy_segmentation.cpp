// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/bench/accuracy_segmentation.h"

#include <gst/check/gstharness.h>

#include <memory>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>

namespace qdmd::bench {

std::function<void()> segmentation_of(const std::vector<cv::Mat>& frames) {
  gst_init(nullptr, nullptr);
  GstElementFactory* const factory = gst_element_factory_find("segmentation");
  if (!factory) return nullptr;
  gst_object_unref(factory);
  // Conversion is not the element's work.
  auto rgba = std::make_shared<std::vector<cv::Mat>>(frames.size());
  for (size_t t = 0; t < frames.size(); ++t)
    cv::cvtColor(frames[t], (*rgba)[t], cv::COLOR_BGR2RGBA);
  return [rgba] {
    const cv::Size size = rgba->front().size();
    const std::unique_ptr<GstHarness, void (*)(GstHarness*)> harness(
        gst_harness_new_parse("segmentation method=mog2 test-mode=true"), gst_harness_teardown);
    gst_harness_set_src_caps_str(
        harness.get(), ("video/x-raw,format=RGBA,framerate=25/1,width=" +
                        std::to_string(size.width) + ",height=" + std::to_string(size.height))
                           .c_str());
    gst_harness_set_drop_buffers(harness.get(), TRUE);
    gst_harness_play(harness.get());
    GstClockTime time = 0;
    for (const cv::Mat& frame : *rgba) {
      const gsize bytes = frame.total() * frame.elemSize();
      GstBuffer* const buffer = gst_buffer_new_allocate(nullptr, bytes, nullptr);
      gst_buffer_fill(buffer, 0, frame.data, bytes);
      GST_BUFFER_PTS(buffer) = time;
      GST_BUFFER_DURATION(buffer) = 40 * GST_MSECOND;
      time += 40 * GST_MSECOND;
      if (gst_harness_push(harness.get(), buffer) != GST_FLOW_OK)
        throw std::runtime_error("segmentation refuses a frame");
    }
    if (gst_harness_buffers_received(harness.get()) != rgba->size())
      throw std::runtime_error("segmentation has lost frames");
  };
}

}  // namespace qdmd::bench
