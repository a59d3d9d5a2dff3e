// SPDX-License-Identifier: LGPL-2.1-or-later
// Time per frame of the element and of what people take in its place, on the same frames, in turn:
// each iteration gives every peer its share of frames, so that a busy machine hits all alike.
#include <benchmark/benchmark.h>
#include <gst/check/gstharness.h>
#include <gst/gst.h>

#include <cstring>
#include <functional>
#include <memory>
#include <numeric>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/background_segm.hpp>
#include <string>
#include <vector>
#ifdef QDMD_HAVE_BGSEGM
#include <opencv2/bgsegm.hpp>
#endif

#include "tests/bench/camera.h"
#include "tests/bench/clock.h"

namespace {

using namespace qdmd::bench;

struct Case {
  int width, height, window;

  size_t pixels() const { return size_t(width) * size_t(height); }
  std::string name() const {
    return "frame/" + std::to_string(width) + "x" + std::to_string(height) +
           "/window:" + std::to_string(window);
  }
};

constexpr int kLiveWindow = 100, kLiveHop = 25;

// Frames as both kinds of peers take them, and again from the start. No window sees one twice,
// which would make its rank lower than that of a camera's.
struct Frames {
  Case size;
  std::vector<std::vector<uint8_t>> rgba;
  std::vector<cv::Mat> rgb;

  explicit Frames(const Case& size_) : size(size_) {
    const Camera camera(size.width, size.height, 4);
    for (int t = 0; t < std::max(size.window, kLiveWindow); ++t) {
      rgba.emplace_back(camera.frame_bytes());
      camera.render(t, rgba.back().data());
      rgb.emplace_back();
      cv::cvtColor(cv::Mat(size.height, size.width, CV_8UC4, rgba.back().data()), rgb.back(),
                   cv::COLOR_RGBA2RGB);
    }
  }
  size_t count() const { return rgba.size(); }
  // Reads from each page of the next `count` frames. A host may have taken back what nobody read
  // for some seconds, and whoever reads it first would pay for all peers.
  void bring_back(size_t first, size_t count_wanted) const {
    constexpr size_t kPage = 4096;
    unsigned sum = 0;
    for (size_t i = 0; i < std::min(count_wanted, count()); ++i) {
      const size_t t = (first + i) % count();
      for (size_t at = 0; at < rgba[t].size(); at += kPage) sum += rgba[t][at];
      const size_t bytes = rgb[t].total() * rgb[t].elemSize();
      for (size_t at = 0; at < bytes; at += kPage) sum += rgb[t].data[at];
    }
    benchmark::DoNotOptimize(sum);
  }
};

class Peer {
 public:
  // frames_at_once: what a share is a multiple of.
  Peer(std::string name, size_t frames_at_once, size_t warm_up)
      : name_(std::move(name)), frames_at_once_(frames_at_once), warm_up_(warm_up) {}
  virtual ~Peer() = default;

  const std::string& name() const { return name_; }
  size_t frames_at_once() const { return frames_at_once_; }
  size_t warm_up() const { return warm_up_; }
  // Takes the next `count` frames. False: not all of them came out again.
  virtual bool run(size_t count) = 0;
  // Before run(count), whose time counts: all memory is where it is while frames come one after
  // another.
  bool get_ready(const Frames& frames, size_t count) {
    frames.bring_back(taken_, 2 * count);
    return run(count);
  }

 protected:
  size_t taken_ = 0;  // frames

 private:
  std::string name_;
  size_t frames_at_once_, warm_up_;
};

// RGBA in, RGBA out. A frame is copied into a buffer from a pool, as a decoder would write it, for
// elements that work in place may do so; the same is done for `identity`, whose time is taken off.
class ElementPeer : public Peer {
 public:
  ElementPeer(std::string name, const std::string& description, const Frames& frames,
              size_t frames_at_once, size_t warm_up)
      : Peer(std::move(name), frames_at_once, warm_up),
        frames_(frames),
        harness_(gst_harness_new_parse(description.c_str())) {
    const std::string caps_text =
        "video/x-raw,format=RGBA,framerate=25/1,width=" + std::to_string(frames.size.width) +
        ",height=" + std::to_string(frames.size.height);
    gst_harness_set_src_caps_str(harness_, caps_text.c_str());
    gst_harness_set_drop_buffers(harness_, TRUE);
    gst_harness_play(harness_);
    pool_ = gst_buffer_pool_new();
    GstStructure* config = gst_buffer_pool_get_config(pool_);
    GstCaps* caps = gst_caps_from_string(caps_text.c_str());
    gst_buffer_pool_config_set_params(config, caps, guint(frames.rgba.front().size()), 2, 0);
    gst_caps_unref(caps);
    gst_buffer_pool_set_config(pool_, config);
    gst_buffer_pool_set_active(pool_, TRUE);
  }
  ~ElementPeer() override {
    gst_harness_teardown(harness_);
    gst_buffer_pool_set_active(pool_, FALSE);
    gst_object_unref(pool_);
  }

  bool run(size_t count) override {
    const guint received = gst_harness_buffers_received(harness_);
    for (size_t i = 0; i < count; ++i, ++taken_) {
      GstBuffer* buffer = nullptr;
      if (gst_buffer_pool_acquire_buffer(pool_, &buffer, nullptr) != GST_FLOW_OK) return false;
      const std::vector<uint8_t>& frame = frames_.rgba[taken_ % frames_.count()];
      gst_buffer_fill(buffer, 0, frame.data(), frame.size());
      GST_BUFFER_PTS(buffer) = taken_ * 40 * GST_MSECOND;
      GST_BUFFER_DURATION(buffer) = 40 * GST_MSECOND;
      if (gst_harness_push(harness_, buffer) != GST_FLOW_OK) return false;
    }
    return gst_harness_buffers_received(harness_) - received == count;
  }

 private:
  const Frames& frames_;
  GstHarness* harness_;
  GstBufferPool* pool_;
};

// RGB frames that lie ready, masks out.
class SubtractorPeer : public Peer {
 public:
  SubtractorPeer(std::string name, cv::Ptr<cv::BackgroundSubtractor> subtractor,
                 const Frames& frames, size_t warm_up)
      : Peer(std::move(name), 1, warm_up), frames_(frames), subtractor_(std::move(subtractor)) {}

  bool run(size_t count) override {
    for (size_t i = 0; i < count; ++i)
      subtractor_->apply(frames_.rgb[taken_++ % frames_.count()], mask_);
    return !mask_.empty();
  }

 private:
  const Frames& frames_;
  cv::Ptr<cv::BackgroundSubtractor> subtractor_;
  cv::Mat mask_;
};

// The median of the window at every sample: the background that is easiest to write down.
class MedianPeer : public Peer {
 public:
  explicit MedianPeer(const Frames& frames)
      : Peer("median", size_t(frames.size.window), 0),
        frames_(frames),
        background_(frames.size.height, frames.size.width, CV_8UC3) {
    // Which of the two is faster depends on the window.
    const auto time = [&](bool by_histogram) {
      by_histogram_ = by_histogram;
      return seconds_of([&] { rows(0, std::min(8, background_.rows)); });
    };
    time(true);
    const double histogram = time(true), selection = time(false);
    by_histogram_ = histogram < selection;
  }

  bool run(size_t count) override {
    for (size_t done = 0; done < count; done += frames_.count())
      cv::parallel_for_(cv::Range(0, background_.rows),
                        [this](const cv::Range& range) { rows(range.start, range.end); });
    benchmark::DoNotOptimize(background_.data);
    return count % frames_at_once() == 0;
  }

 private:
  void rows(int begin, int end) {
    const size_t count = frames_at_once(), samples = size_t(background_.cols) * 3;
    // A run of samples of all frames stays in the first-level cache.
    constexpr size_t kRun = 64;
    std::vector<uint8_t> levels(kRun * count);
    for (int y = begin; y < end; ++y)
      for (size_t first = 0; first < samples; first += kRun) {
        const size_t run = std::min(kRun, samples - first);
        for (size_t t = 0; t < count; ++t) {
          const uint8_t* from = frames_.rgb[t].ptr(y) + first;
          for (size_t i = 0; i < run; ++i) levels[i * count + t] = from[i];
        }
        for (size_t i = 0; i < run; ++i)
          background_.ptr(y)[first + i] = median_of(levels.data() + i * count, count);
      }
  }

  uint8_t median_of(uint8_t* levels, size_t count) const {
    if (!by_histogram_) {
      std::nth_element(levels, levels + count / 2, levels + count);
      return levels[count / 2];
    }
    uint16_t histogram[256] = {};
    for (size_t t = 0; t < count; ++t) ++histogram[levels[t]];
    size_t below = 0, level = 0;
    while ((below += histogram[level]) <= count / 2) ++level;
    return static_cast<uint8_t>(level);
  }

  const Frames& frames_;
  cv::Mat background_;
  bool by_histogram_ = true;
};

std::vector<std::unique_ptr<Peer>> peers_of(const Frames& frames) {
  const auto window = static_cast<size_t>(frames.size.window);
  const std::string robust = "qdmdbackground output=mask window-size=";
  const std::string qdmd = "qdmdbackground output=mask method=qdmd window-size=";
  std::vector<std::unique_ptr<Peer>> peers;
  const auto element = [&](const char* name, const std::string& description, size_t at_once,
                           size_t warm_up) {
    peers.push_back(std::make_unique<ElementPeer>(name, description, frames, at_once, warm_up));
  };
  const auto subtractor = [&](const char* name, cv::Ptr<cv::BackgroundSubtractor> made) {
    peers.push_back(std::make_unique<SubtractorPeer>(name, std::move(made), frames,
                                                     std::min<size_t>(window, 30)));
  };
  element("identity", "identity", 1, 2);
  // A share has one solve, which begins in its middle and has ended where it ends.
  const size_t batch_warm_up = 2 * window + window / 2;
  element("robust", robust + std::to_string(window), window, batch_warm_up);
  const std::string live =
      std::to_string(kLiveWindow) + " mode=live hop-size=" + std::to_string(kLiveHop);
  element("robust_live", robust + live, kLiveHop, kLiveWindow + kLiveHop);
  element("qdmd", qdmd + std::to_string(window), window, batch_warm_up);
  element("qdmd_rank_1", qdmd + std::to_string(window) + " rank=1", window, batch_warm_up);
  element("qdmd_live", qdmd + live, kLiveHop, kLiveWindow + kLiveHop);
  element("segmentation", "segmentation method=mog2 test-mode=true", 1,
          std::min<size_t>(window, 30));
  subtractor("mog2", cv::createBackgroundSubtractorMOG2());
  subtractor("knn", cv::createBackgroundSubtractorKNN());
#ifdef QDMD_HAVE_BGSEGM
  subtractor("cnt", cv::bgsegm::createBackgroundSubtractorCNT());
#endif
  peers.push_back(std::make_unique<MedianPeer>(frames));
  return peers;
}

// Frames of a peer's share: enough for its time to be told, few enough for many turns.
size_t share_of(const Peer& peer, const Case& size) {
  constexpr size_t kPixels = 8'000'000;
  const size_t frames = std::max<size_t>(10, kPixels / size.pixels());
  const size_t most = std::min(frames, size_t(size.window));
  return (most + peer.frames_at_once() - 1) / peer.frames_at_once() * peer.frames_at_once();
}

void time_per_frame(benchmark::State& state, const Case& size) {
  const Frames frames(size);
  const auto peers = peers_of(frames);
  for (const auto& peer : peers) peer->run(peer->warm_up());

  std::vector<std::vector<double>> times(peers.size()), cpu_times(peers.size());
  size_t taken = 0;
  for (auto _ : state)
    for (size_t i = 0; i < peers.size(); ++i) {
      const size_t share = share_of(*peers[i], size);
      bool complete = peers[i]->get_ready(frames, share);
      const double cpu = cpu_seconds();
      const double took = seconds_of([&] { complete &= peers[i]->run(share); });
      if (!complete) {
        state.SkipWithError((peers[i]->name() + " lost frames").c_str());
        return;
      }
      times[i].push_back(1e3 * took / double(share));
      cpu_times[i].push_back(1e3 * (cpu_seconds() - cpu) / double(share));
      taken += share;
    }

  const auto index_of = [&](const char* name) {
    size_t i = 0;
    while (peers[i]->name() != name) ++i;
    return i;
  };
  const size_t identity = index_of("identity"), segmentation = index_of("segmentation");
  // It is taken in every turn, because turns differ more than peers within one. What buffers and
  // pads cost is no part of an element's work; OpenCV's classes have none.
  const auto net = [&](size_t i) {
    std::vector<double> result = times[i];
    if (dynamic_cast<const ElementPeer*>(peers[i].get()))
      for (size_t k = 0; k < result.size(); ++k) result[k] -= times[identity][k];
    return result;
  };
  const std::vector<double> reference = net(segmentation);
  for (size_t i = 0; i < peers.size(); ++i) {
    const std::string& name = peers[i]->name();
    state.counters["ms/" + name] = median(times[i]);
    state.counters["cpu/" + name] = median(cpu_times[i]);
    if (i == identity) continue;
    const std::vector<double> own = net(i);
    std::vector<double> ratios;
    for (size_t k = 0; k < own.size(); ++k) ratios.push_back(reference[k] / own[k]);
    state.counters["net/" + name] = median(own);
    // How many times as fast as segmentation.
    state.counters["times/" + name] = median(ratios);
  }
  state.SetItemsProcessed(static_cast<int64_t>(taken));
}

constexpr Case kCases[] = {
    {160, 120, 25},                                       // the short form
    {320, 240, 200}, {768, 576, 200},  {1920, 1080, 60},  // what the project promises
    {320, 240, 25},  {320, 240, 50},   {320, 240, 100},   {320, 240, 400},
    {640, 480, 100}, {1280, 720, 100}, {1920, 1080, 100},
};

}  // namespace

int main(int argc, char** argv) {
  gst_init(&argc, &argv);
  GError* error = nullptr;
  if (!gst_plugin_load_file(QDMD_PLUGIN, &error)) {
    g_printerr("%s: %s\n", QDMD_PLUGIN, error->message);
    return 1;
  }
  for (const char* needed : {"identity", "segmentation"})
    if (!gst_registry_check_feature_version(gst_registry_get(), needed, 1, 0, 0)) {
      g_printerr("There is no element %s: tests/install-dependencies.sh test installs it.\n",
                 needed);
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
