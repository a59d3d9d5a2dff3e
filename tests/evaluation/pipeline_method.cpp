// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/evaluation/pipeline_method.h"

#include <gst/app/gstappsink.h>
#include <gst/app/gstappsrc.h>
#include <gst/video/video.h>

#include <cstring>
#include <functional>
#include <stdexcept>
#include <thread>

#include "tests/evaluation/background_taker.h"

namespace qdmd::evaluation {

namespace {

constexpr int kRate = 25;  // frames a second, for timestamps alone

// Calls act(data, stride) with the only plane of a packed picture.
template <typename Act>
void with_mapped(const GstVideoInfo& info, GstBuffer* buffer, GstMapFlags flags, Act act) {
  GstVideoFrame mapped;
  if (!gst_video_frame_map(&mapped, const_cast<GstVideoInfo*>(&info), buffer, flags))
    throw std::runtime_error("cannot map a buffer");
  act(static_cast<uint8_t*>(GST_VIDEO_FRAME_PLANE_DATA(&mapped, 0)),
      static_cast<size_t>(GST_VIDEO_FRAME_PLANE_STRIDE(&mapped, 0)));
  gst_video_frame_unmap(&mapped);
}

GstBuffer* buffer_of(const cv::Mat& frame, const GstVideoInfo& info, size_t t) {
  GstBuffer* buffer = gst_buffer_new_allocate(nullptr, info.size, nullptr);
  with_mapped(info, buffer, GST_MAP_WRITE, [&](uint8_t* data, size_t stride) {
    frame.copyTo(cv::Mat(frame.rows, frame.cols, CV_8UC3, data, stride));
  });
  GST_BUFFER_DURATION(buffer) = GST_SECOND / kRate;
  GST_BUFFER_PTS(buffer) = t * GST_BUFFER_DURATION(buffer);
  return buffer;
}

// A pipeline that ends with its life.
class Pipeline {
 public:
  Pipeline(GstElement* element, const GstVideoInfo& info)
      : pipeline_(GST_ELEMENT(gst_object_ref_sink(gst_pipeline_new(nullptr)))),
        source_(make("appsrc")),
        sink_(make("appsink")),
        bus_(gst_element_get_bus(pipeline_.get())) {
    GstCaps* caps = gst_video_info_to_caps(&info);
    g_object_set(source_, "caps", caps, "format", GST_FORMAT_TIME, "block", TRUE, nullptr);
    g_object_set(sink_, "caps", caps, "sync", FALSE, "max-buffers", 4, nullptr);
    gst_caps_unref(caps);
    gst_bin_add_many(GST_BIN(pipeline_.get()), source_, element, sink_, nullptr);
    if (!gst_element_link_many(source_, element, sink_, nullptr))
      throw std::runtime_error("cannot link the pipeline");
    gst_element_set_state(pipeline_.get(), GST_STATE_PLAYING);
  }
  ~Pipeline() { stop(); }
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  void stop() { gst_element_set_state(pipeline_.get(), GST_STATE_NULL); }

  // Blocks while the source is full; false where the pipeline does not want more.
  bool push(GstBuffer* buffer) {
    return gst_app_src_push_buffer(GST_APP_SRC(source_), buffer) == GST_FLOW_OK;
  }
  void end() { gst_app_src_end_of_stream(GST_APP_SRC(source_)); }

  // The next picture; null at the end. Throws what an element says of a failure.
  Ref<GstSample> pull() {
    for (;;) {
      Ref<GstSample> sample(gst_app_sink_try_pull_sample(GST_APP_SINK(sink_), 100 * GST_MSECOND));
      if (sample) return sample;
      throw_error();
      if (gst_app_sink_is_eos(GST_APP_SINK(sink_))) return nullptr;
    }
  }

 private:
  GstElement* make(const char* factory) {
    GstElement* element = gst_element_factory_make(factory, nullptr);
    if (!element) throw std::runtime_error(std::string("GStreamer has no ") + factory);
    return element;
  }
  void throw_error() {
    const Ref<GstMessage> message(gst_bus_timed_pop_filtered(bus_.get(), 0, GST_MESSAGE_ERROR));
    if (!message) return;
    GError* error = nullptr;
    gst_message_parse_error(message.get(), &error, nullptr);
    const std::string text = error->message;
    g_error_free(error);
    throw std::runtime_error(text);
  }

  const Ref<GstElement> pipeline_;
  GstElement* const source_;
  GstElement* const sink_;
  const Ref<GstBus> bus_;
};

// Runs `frames` through `element` (the caller's reference is used up) and calls see(picture) for
// every one that comes out.
void run_pipeline(Ref<GstElement> element, const std::vector<cv::Mat>& frames,
                  const std::function<void(const cv::Mat&)>& see) {
  GstVideoInfo info;
  gst_video_info_set_format(&info, GST_VIDEO_FORMAT_BGR, static_cast<guint>(frames[0].cols),
                            static_cast<guint>(frames[0].rows));
  info.fps_n = kRate;
  info.fps_d = 1;
  Pipeline pipeline(element.get(), info);
  std::exception_ptr failure;
  std::thread feeder([&] {
    try {
      for (size_t t = 0; t < frames.size(); ++t)
        if (!pipeline.push(buffer_of(frames[t], info, t))) return;
      pipeline.end();
    } catch (...) {
      failure = std::current_exception();
      pipeline.end();
    }
  });
  std::exception_ptr refusal;
  size_t count = 0;
  try {
    while (const Ref<GstSample> sample = pipeline.pull()) {
      with_mapped(info, gst_sample_get_buffer(sample.get()), GST_MAP_READ,
                  [&](uint8_t* data, size_t stride) {
                    see(cv::Mat(frames[0].rows, frames[0].cols, CV_8UC3, data, stride));
                  });
      ++count;
    }
  } catch (...) {
    refusal = std::current_exception();
  }
  pipeline.stop();  // lets a feeder go that waits
  feeder.join();
  if (refusal) std::rethrow_exception(refusal);
  if (failure) std::rethrow_exception(failure);
  if (count != frames.size())
    throw std::runtime_error(std::to_string(frames.size()) + " frames went in, " +
                             std::to_string(count) + " came out");
}

class PipelineMethod : public Method {
 public:
  PipelineMethod(const std::string& name, const ElementOptions& options)
      : Method(name), options_(options) {}

  Separation separate(const Task& task) const override {
    Separation result;
    BackgroundTaker backgrounds(task.picture, task.frames.size());
    const Stopwatch watch;
    run_pipeline(element("background", task), task.frames,
                 [&](const cv::Mat& picture) { backgrounds.take(picture); });
    result.seconds = watch.seconds();
    result.background = backgrounds.result();
    if (task.masks)
      run_pipeline(element("mask", task), task.frames, [&](const cv::Mat& picture) {
        cv::Mat mask;
        cv::extractChannel(picture, mask, 0);
        result.masks.push_back(mask);
      });
    return result;
  }

 private:
  Ref<GstElement> element(const char* output, const Task& task) const {
    Ref<GstElement> made = make_element();
    options_.apply(made.get(), name(), task.frames.size());
    gst_util_set_object_arg(G_OBJECT(made.get()), "output", output);
    return made;
  }

  const ElementOptions options_;
};

}  // namespace

Methods pipeline_methods(const ElementOptions& options) {
  Methods methods;
  for (const auto& name : element_methods())
    methods.push_back(std::make_unique<PipelineMethod>(name, options));
  return methods;
}

}  // namespace qdmd::evaluation
