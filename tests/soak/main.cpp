// SPDX-License-Identifier: LGPL-2.1-or-later
// Runs the elements for long, and looks at what a process that runs for months would run out of:
// memory, file descriptors and threads stay as they are, and no frame is lost or changes places.
//
//   soak                  the short form: some seconds
//   soak --long           1 million frames of 160x120 live and as many in batch, 1,000 cycles of
//                         states, 1,000 changes of caps, 200 elements and 16 pipelines at once
#include <malloc.h>

#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <vector>

#include "tests/soak/feed.h"

namespace {

using qdmd::soak::fail;
using qdmd::soak::Feed;
namespace fs = std::filesystem;

struct Sizes {
  uint64_t frames;
  int cycles, changes, elements, pipelines, pipeline_frames;
};
constexpr Sizes kShort = {1500, 40, 60, 24, 6, 60};
constexpr Sizes kLong = {1000000, 1000, 1000, 200, 16, 2000};

constexpr const char* kKinds[] = {
    "qdmdbackground mode=live window-size=40 n-threads=2",
    "qdmdbackground mode=batch window-size=40 n-threads=1",
    "qdmdseparate mode=live window-size=20 n-threads=1",
};

// What the process has. Memory that is free again counts only where the system cannot have it back:
// how much of it the allocator keeps changes with the turns that threads take.
struct Held {
  long kilobytes = 0, files = 0, threads = 0;
};
Held held() {
  Held now;
  malloc_trim(0);
  std::ifstream pages("/proc/self/statm");
  long all = 0, resident = 0;
  pages >> all >> resident;
  now.kilobytes = resident * 4;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator("/proc/self/fd")) ++now.files;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator("/proc/self/task"))
    ++now.threads;
  return now;
}

// What is made on first use, and pages of which a part is free.
constexpr long kSlack = 8 * 1024;

// Rounds of the same work: what is taken for the first time is no growth.
constexpr int kRounds = 3;

void expect_flat(const char* what, const Held& before, const Held& after, long slack = kSlack,
                 long more_threads = 0) {
  std::printf(
      "%s: %ld kB, %ld files, %ld threads at first; %ld kB, %ld files, %ld threads at last\n", what,
      before.kilobytes, before.files, before.threads, after.kilobytes, after.files, after.threads);
  if (after.files > before.files) fail(std::string(what) + ": files stay open");
  if (after.threads > before.threads + more_threads) fail(std::string(what) + ": threads stay");
  if (after.kilobytes > before.kilobytes + slack) fail(std::string(what) + ": memory grows");
}

uint64_t counted(GstElement* element, const char* name) {
  GstStructure* stats = nullptr;
  g_object_get(element, "stats", &stats, nullptr);
  guint64 count = 0;
  gst_structure_get_uint64(stats, name, &count);
  gst_structure_free(stats);
  return count;
}

void many_frames(const char* launch, uint64_t frames) {
  Feed feed(launch);
  feed.set_state(GST_STATE_PLAYING);
  feed.begin(160, 120, false);
  Held first;
  for (uint64_t t = 0; t < frames; ++t) {
    feed.push();
    if (t == frames / 4) first = held();
  }
  const Held last = held();
  feed.eos();
  feed.check();
  if (counted(feed.element(), "frames-in") != frames ||
      counted(feed.element(), "frames-out") != frames)
    fail("the element has counted other frames");
  std::printf("%llu frames, sum of their numbers %llu: ", static_cast<unsigned long long>(feed.out),
              static_cast<unsigned long long>(feed.sum_out));
  expect_flat(launch, first, last);
}

// PLAYING, some frames, NULL; what waits is dropped every second time.
void state_cycles(int cycles) {
  for (const char* launch : kKinds) {
    Held first;
    Feed feed(launch);
    for (int i = 0; i < cycles; ++i) {
      feed.set_state(GST_STATE_PLAYING);
      feed.begin(32, 24, i % 2);
      for (int t = 0; t < 5; ++t) feed.push();
      if (i % 2) feed.eos();
      feed.set_state(i % 3 ? GST_STATE_NULL : GST_STATE_READY);
      // What was dropped never comes.
      feed.out = feed.in;
      feed.sum_out = feed.sum_in;
      if (i == cycles / 4) first = held();
    }
    expect_flat("state cycles", first, held());
  }
}

void caps_changes(int changes) {
  for (const char* launch : kKinds) {
    Held first;
    Feed feed(launch);
    feed.set_state(GST_STATE_PLAYING);
    for (int i = 0; i < changes; ++i) {
      feed.begin(8 + 8 * (i % 9), 8 + 6 * (i % 7), i % 2);
      for (int t = 0; t < 5; ++t) feed.push();
      if (i == changes / 4) first = held();
    }
    feed.eos();
    feed.check();
    expect_flat("changes of caps", first, held());
  }
}

void many_elements(int count) {
  Held first;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<std::unique_ptr<Feed>> feeds;
    for (int i = 0; i < count; ++i) {
      feeds.push_back(std::make_unique<Feed>(kKinds[i % 3]));
      feeds.back()->set_state(GST_STATE_PLAYING);
      feeds.back()->begin(32, 24, false);
    }
    for (int t = 0; t < 60; ++t)
      for (auto& feed : feeds) feed->push();
    for (auto& feed : feeds) {
      feed->eos();
      feed->check();
    }
    feeds.clear();
    if (round == 0) first = held();
  }
  expect_flat("many elements", first, held());
}

void run_pipelines(int count, int frames) {
  std::vector<GstElement*> pipelines;
  for (int i = 0; i < count; ++i) {
    const std::string launch = "videotestsrc pattern=ball num-buffers=" + std::to_string(frames) +
                               " ! video/x-raw,format=RGBA,width=64,height=48 ! " + kKinds[i % 2] +
                               " name=q ! fakesink";
    GstElement* pipeline = gst_parse_launch(launch.c_str(), nullptr);
    if (!pipeline) fail("no pipeline: " + launch);
    gst_element_set_state(pipeline, GST_STATE_PLAYING);
    pipelines.push_back(pipeline);
  }
  for (GstElement* pipeline : pipelines) {
    GstBus* bus = gst_element_get_bus(pipeline);
    GstMessage* message = gst_bus_timed_pop_filtered(
        bus, GST_CLOCK_TIME_NONE, GstMessageType(GST_MESSAGE_EOS | GST_MESSAGE_ERROR));
    if (GST_MESSAGE_TYPE(message) != GST_MESSAGE_EOS) fail("a pipeline ended with an error");
    gst_message_unref(message);
    gst_object_unref(bus);
    GstElement* element = gst_bin_get_by_name(GST_BIN(pipeline), "q");
    if (counted(element, "frames-out") != uint64_t(frames)) fail("a pipeline has lost frames");
    gst_object_unref(element);
    gst_element_set_state(pipeline, GST_STATE_NULL);
    gst_object_unref(pipeline);
  }
}

void many_pipelines(int count, int frames) {
  run_pipelines(count, frames);
  const Held first = held();
  for (int round = 1; round < kRounds; ++round) run_pipelines(count, frames);
  // Threads of GLib's pools come and go, and the allocator has an arena for each.
  expect_flat("many pipelines", first, held(), 8 * kSlack, 2 * count);
}

}  // namespace

int main(int argc, char** argv) {
  gst_init(&argc, &argv);
  const bool is_long = argc > 1 && std::strcmp(argv[1], "--long") == 0;
  if (argc > 1 && !is_long) {
    std::fprintf(stderr, "soak [--long]\n");
    return 2;
  }
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const Sizes& sizes = is_long ? kLong : kShort;
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  const auto timed = [&](const char* what, const auto& work) {
    const auto before = Clock::now();
    work();
    std::printf("== %s: %.1f s\n", what,
                std::chrono::duration<double>(Clock::now() - before).count());
  };
  timed("live", [&] { many_frames(kKinds[0], sizes.frames); });
  timed("batch", [&] { many_frames(kKinds[1], sizes.frames); });
  timed("state cycles", [&] { state_cycles(sizes.cycles); });
  timed("changes of caps", [&] { caps_changes(sizes.changes); });
  timed("elements", [&] { many_elements(sizes.elements); });
  timed("pipelines", [&] { many_pipelines(sizes.pipelines, sizes.pipeline_frames); });
  std::printf("passed in %.0f s\n", std::chrono::duration<double>(Clock::now() - start).count());
  return 0;
}
