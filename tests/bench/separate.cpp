// SPDX-License-Identifier: LGPL-2.1-or-later
// Time per frame of qdmdseparate with one to four pads, beside one qdmdbackground, and beside two
// of them behind a tee, in turn: each iteration gives every peer its share of frames.
#include <benchmark/benchmark.h>
#include <gst/gst.h>

#include <memory>
#include <string>
#include <vector>

#include "tests/bench/camera.h"
#include "tests/bench/clock.h"

namespace {

using namespace qdmd::bench;

struct Case {
  int width, height, window;
  const char* mode;

  std::string name() const {
    return "outputs/" + std::to_string(width) + "x" + std::to_string(height) +
           "/window:" + std::to_string(window) + "/" + mode;
  }
};

// What a share of frames is a multiple of in mode=live, so that each has as many solves.
constexpr int kHop = 25;

struct Frames {
  Case size;
  std::vector<std::vector<uint8_t>> rgba;

  explicit Frames(const Case& size_) : size(size_) {
    const Camera camera(size.width, size.height, 4);
    for (int t = 0; t < size.window; ++t) {
      rgba.emplace_back(camera.frame_bytes());
      camera.render(t, rgba.back().data());
    }
  }
};

// One or more elements, which are given each frame one after the other, by the same thread, as a
// tee would. What comes out is dropped.
class Peer {
 public:
  struct Element {
    std::string launch;
    std::vector<std::string> pads;
  };

  Peer(std::string name, const std::vector<Element>& elements, const Frames& frames)
      : name_(std::move(name)), frames_(frames) {
    const std::string caps_text =
        "video/x-raw,format=RGBA,framerate=25/1,width=" + std::to_string(frames.size.width) +
        ",height=" + std::to_string(frames.size.height);
    GstCaps* caps = gst_caps_from_string(caps_text.c_str());
    for (const Element& its : elements) start(its, caps);
    pool_ = gst_buffer_pool_new();
    GstStructure* config = gst_buffer_pool_get_config(pool_);
    gst_buffer_pool_config_set_params(config, caps, guint(frames.rgba.front().size()), 2, 0);
    gst_caps_unref(caps);
    gst_buffer_pool_set_config(pool_, config);
    gst_buffer_pool_set_active(pool_, TRUE);
  }
  ~Peer() {
    for (GstElement* element : elements_) {
      gst_element_set_state(element, GST_STATE_NULL);
      gst_object_unref(element);
    }
    for (GstPad* pad : pads_) gst_object_unref(pad);
    gst_buffer_pool_set_active(pool_, FALSE);
    gst_object_unref(pool_);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  const std::string& name() const { return name_; }
  // Takes the next `count` frames. False: some were refused, or are missing behind a pad.
  bool run(size_t count) {
    const size_t before = received_;
    for (size_t i = 0; i < count; ++i, ++pushed_) {
      GstBuffer* buffer = nullptr;
      if (gst_buffer_pool_acquire_buffer(pool_, &buffer, nullptr) != GST_FLOW_OK) return false;
      const std::vector<uint8_t>& frame = frames_.rgba[pushed_ % frames_.rgba.size()];
      gst_buffer_fill(buffer, 0, frame.data(), frame.size());
      GST_BUFFER_PTS(buffer) = pushed_ * 40 * GST_MSECOND;
      GST_BUFFER_DURATION(buffer) = 40 * GST_MSECOND;
      bool taken = true;
      for (GstPad* feed : feeds_)
        taken = gst_pad_push(feed, gst_buffer_ref(buffer)) == GST_FLOW_OK && taken;
      gst_buffer_unref(buffer);
      if (!taken) return false;
    }
    return received_ - before == count * outputs_;
  }

 private:
  void start(const Element& its, GstCaps* caps) {
    GstElement* element = gst_parse_launch(its.launch.c_str(), nullptr);
    elements_.push_back(GST_ELEMENT(gst_object_ref_sink(element)));
    GstPad* feed = own(gst_pad_new("feed", GST_PAD_SRC));
    feeds_.push_back(feed);
    link(feed, own_static(element, "sink"));
    for (const std::string& name : its.pads) {
      GstPad* source = own_static(element, name.c_str());
      if (!source) {
        source = gst_element_request_pad_simple(element, name.c_str());
        pads_.push_back(source);
      }
      GstPad* sink = own(gst_pad_new("sink", GST_PAD_SINK));
      gst_pad_set_element_private(sink, &received_);
      gst_pad_set_chain_function(sink, [](GstPad* pad, GstObject*, GstBuffer* buffer) {
        ++*static_cast<size_t*>(gst_pad_get_element_private(pad));
        gst_buffer_unref(buffer);
        return GST_FLOW_OK;
      });
      link(source, sink);
      ++outputs_;
    }
    gst_element_set_state(element, GST_STATE_PLAYING);
    GstSegment segment;
    gst_segment_init(&segment, GST_FORMAT_TIME);
    gst_pad_push_event(feed, gst_event_new_stream_start("camera"));
    gst_pad_push_event(feed, gst_event_new_caps(caps));
    gst_pad_push_event(feed, gst_event_new_segment(&segment));
  }
  GstPad* own(GstPad* pad) {
    pads_.push_back(GST_PAD(gst_object_ref_sink(pad)));
    gst_pad_set_active(pad, TRUE);
    return pad;
  }
  GstPad* own_static(GstElement* element, const char* name) {
    GstPad* pad = gst_element_get_static_pad(element, name);
    if (pad) pads_.push_back(pad);
    return pad;
  }
  static void link(GstPad* source, GstPad* sink) {
    gst_pad_link_full(source, sink, GST_PAD_LINK_CHECK_NOTHING);
  }

  std::string name_;
  const Frames& frames_;
  std::vector<GstElement*> elements_;
  std::vector<GstPad*> feeds_, pads_;
  GstBufferPool* pool_;
  size_t pushed_ = 0, received_ = 0, outputs_ = 0;
};

std::vector<std::unique_ptr<Peer>> peers_of(const Frames& frames) {
  const std::string options = " window-size=" + std::to_string(frames.size.window) +
                              " hop-size=" + std::to_string(kHop) + " mode=" + frames.size.mode;
  const std::string background = "qdmdbackground" + options + " output=",
                    separate = "qdmdseparate" + options;
  std::vector<std::unique_ptr<Peer>> peers;
  const auto peer = [&](const char* name, const std::vector<Peer::Element>& elements) {
    peers.push_back(std::make_unique<Peer>(name, elements, frames));
  };
  peer("one_background", {{background + "background", {"src"}}});
  peer("one_mask", {{background + "mask", {"src"}}});
  peer("background", {{separate, {"background"}}});
  peer("mask", {{separate, {"mask"}}});
  peer("background_mask", {{separate, {"background", "mask"}}});
  peer("background_foreground", {{separate, {"background", "foreground"}}});
  peer("mask_cutout", {{separate, {"mask", "cutout"}}});
  peer("all", {{separate, {"background", "foreground", "mask", "cutout"}}});
  peer("two_elements", {{background + "background", {"src"}}, {background + "mask", {"src"}}});
  return peers;
}

void time_per_frame(benchmark::State& state, const Case& size) {
  const Frames frames(size);
  const auto peers = peers_of(frames);
  const bool live = std::string(size.mode) == "live";
  const auto window = static_cast<size_t>(size.window);
  // Full windows, or hops, so that each share has as many solves.
  const size_t share = live ? 2 * kHop : window;
  for (const auto& peer : peers) peer->run(2 * window + window / 2);

  std::vector<std::vector<double>> times(peers.size()), cpu_times(peers.size());
  for (auto _ : state)
    for (size_t i = 0; i < peers.size(); ++i) {
      bool complete = false;
      const double cpu = cpu_seconds();
      const double took = seconds_of([&] { complete = peers[i]->run(share); });
      if (!complete) {
        state.SkipWithError((peers[i]->name() + " lost frames").c_str());
        return;
      }
      times[i].push_back(1e3 * took / double(share));
      cpu_times[i].push_back(1e3 * (cpu_seconds() - cpu) / double(share));
    }
  for (size_t i = 0; i < peers.size(); ++i) {
    state.counters["ms/" + peers[i]->name()] = median(times[i]);
    state.counters["cpu/" + peers[i]->name()] = median(cpu_times[i]);
  }
}

constexpr Case kCases[] = {
    {160, 120, 25, "batch"},  {160, 120, 25, "live"},  // the short form
    {320, 240, 100, "batch"}, {320, 240, 100, "live"},   {768, 576, 100, "batch"},
    {768, 576, 100, "live"},  {1920, 1080, 50, "batch"}, {1920, 1080, 50, "live"},
};

}  // namespace

int main(int argc, char** argv) {
  gst_init(&argc, &argv);
  GError* error = nullptr;
  if (!gst_plugin_load_file(QDMD_PLUGIN, &error)) {
    g_printerr("%s: %s\n", QDMD_PLUGIN, error->message);
    return 1;
  }
  // Iterations are turns: --benchmark_min_time changes nothing here.
  const int turns = turns_asked_for();
  for (const Case& size : kCases)
    benchmark::RegisterBenchmark(size.name().c_str(),
                                 [size](benchmark::State& state) { time_per_frame(state, size); })
        ->Iterations(turns)
        ->Unit(benchmark::kMillisecond);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
