// SPDX-License-Identifier: LGPL-2.1-or-later
// What goes wrong around an element: no threads, sinks that fail, clocks that jump, a process that
// is stopped, another element that fails. An error with a sentence or the same frames, nothing
// else.
#include <dlfcn.h>
#include <pthread.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <filesystem>

#include "tests/gst/element_test.h"

namespace {

std::atomic<bool> no_threads = false;
std::atomic<int> refused = 0;

}  // namespace

// In place of the C library's: the machine may have no more threads to give.
extern "C" __attribute__((visibility("default"))) int pthread_create(
    pthread_t* thread, const pthread_attr_t* attributes, void* (*work)(void*), void* argument) {
  if (no_threads) {
    ++refused;
    return EAGAIN;
  }
  static const auto real =
      reinterpret_cast<decltype(&pthread_create)>(dlsym(RTLD_NEXT, "pthread_create"));
  return real(thread, attributes, work, argument);
}

namespace qdmd::test {
namespace {

using Bytes = std::vector<std::vector<uint8_t>>;

Bytes bytes_of(const std::vector<BufferPtr>& buffers) {
  Bytes all;
  for (const auto& buffer : buffers) {
    GstMapInfo map;
    EXPECT_TRUE(gst_buffer_map(buffer.get(), &map, GST_MAP_READ));
    all.emplace_back(map.data, map.data + map.size);
    gst_buffer_unmap(buffer.get(), &map);
  }
  return all;
}

Bytes run(const std::string& launch, int frames) {
  Stream stream(launch, GST_VIDEO_FORMAT_RGB, 40, 24);
  stream.push_many(0, frames);
  return bytes_of(stream.take_to_end());
}

constexpr const char* kLaunches[] = {
    "qdmdbackground window-size=6 n-threads=4 output=foreground",
    "qdmdbackground mode=live window-size=6 hop-size=2 n-threads=4 output=mask",
    "qdmdbackground mode=live method=qdmd window-size=6 n-threads=0",
};

// The first error that an element posts on its bus; "" where there is none.
std::string error_on(GstBus* bus) {
  GstMessage* message = gst_bus_pop_filtered(bus, GST_MESSAGE_ERROR);
  if (!message) return "";
  GError* error = nullptr;
  gst_message_parse_error(message, &error, nullptr);
  const std::string text = error->message;
  g_error_free(error);
  gst_message_unref(message);
  return text;
}

void begin_segment(Stream* stream) {
  GstSegment segment;
  gst_segment_init(&segment, GST_FORMAT_TIME);
  ASSERT_TRUE(gst_harness_push_event(stream->harness(), gst_event_new_segment(&segment)));
}

TEST(Threads, ThatDoNotStartChangeNoPicture) {
  for (const char* launch : kLaunches) {
    const Bytes expected = run(launch, 20);
    ASSERT_EQ(20u, expected.size());
    refused = 0;
    no_threads = true;
    const Bytes found = run(launch, 20);
    no_threads = false;
    EXPECT_EQ(expected, found) << launch;
    EXPECT_GT(refused, 0) << launch;
  }
}

TEST(Downstream, ThatFailsIsPassedOnAndForgottenWithAFlush) {
  for (const char* launch : kLaunches)
    for (GstFlowReturn flow : {GST_FLOW_ERROR, GST_FLOW_EOS, GST_FLOW_NOT_LINKED}) {
      static GstFlowReturn answer;
      answer = flow;
      Stream stream(launch, GST_VIDEO_FORMAT_RGB, 40, 24);
      GstPad* sink = stream.harness()->sinkpad;
      gst_pad_set_chain_function(sink, [](GstPad*, GstObject*, GstBuffer* buffer) {
        gst_buffer_unref(buffer);
        return answer;
      });
      GstFlowReturn met = GST_FLOW_OK;
      for (int t = 0; t < 12 && met == GST_FLOW_OK; ++t) met = stream.push(t);
      EXPECT_EQ(flow, met) << launch;
      // It is asked again, and says so again.
      EXPECT_NE(GST_FLOW_OK, stream.push(12));
      answer = GST_FLOW_OK;
      ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_flush_start()));
      ASSERT_TRUE(gst_harness_push_event(stream.harness(), gst_event_new_flush_stop(TRUE)));
      begin_segment(&stream);
      for (int t = 13; t < 30; ++t) EXPECT_EQ(GST_FLOW_OK, stream.push(t)) << launch;
    }
}

TEST(Upstream, MayGoOnAfterTheEnd) {
  for (const char* launch : kLaunches) {
    Stream stream(launch, GST_VIDEO_FORMAT_RGB, 40, 24);
    stream.push_many(0, 9);
    ASSERT_TRUE(stream.eos());
    EXPECT_EQ(9u, stream.take_all().size());
    EXPECT_EQ(GST_FLOW_EOS, stream.push(9));
    gst_harness_push_event(stream.harness(), gst_event_new_gap(0, kFrame));
    gst_harness_push_event(stream.harness(), gst_event_new_eos());
    EXPECT_TRUE(stream.take_all().empty());
    // Another stream.
    gst_harness_push_event(stream.harness(), gst_event_new_stream_start("another"));
    stream.set_caps(GST_VIDEO_FORMAT_RGB, 40, 24);
    begin_segment(&stream);
    stream.push_many(0, 9);
    EXPECT_EQ(9u, stream.take_to_end().size()) << launch;
  }
}

TEST(Clocks, ThatJumpLoseNoFrame) {
  for (const char* launch : kLaunches) {
    Stream stream(launch, GST_VIDEO_FORMAT_RGB, 40, 24);
    gst_harness_use_testclock(stream.harness());
    GstClockTime now = 0;
    size_t frames = 0;
    for (const GstClockTime jump : std::initializer_list<GstClockTime>{
             GstClockTime{0}, GstClockTime{3600} * GST_SECOND, GstClockTime{1}, kFrame,
             GstClockTime{100000} * 3600 * GST_SECOND}) {
      now += jump;
      ASSERT_TRUE(gst_harness_set_time(stream.harness(), now));
      for (int t = 0; t < 8; ++t, ++frames)
        EXPECT_EQ(GST_FLOW_OK, stream.push(static_cast<int>(frames)));
    }
    EXPECT_EQ(frames, stream.take_to_end().size()) << launch;
    // What a solve seemed to take says nothing of latency.
    EXPECT_LE(gst_harness_query_latency(stream.harness()), 20 * kFrame) << launch;
  }
}

TEST(Elements, ThatFailLeaveOthersAlone) {
  for (const char* launch : kLaunches) {
    const Bytes expected = run(launch, 16);
    Stream sound(launch, GST_VIDEO_FORMAT_RGB, 40, 24);
    Stream failing(std::string(launch) + " name=bad", GST_VIDEO_FORMAT_RGB, 40, 24);
    GstElement* bad = gst_harness_find_element(failing.harness(), "qdmdbackground");
    GstBus* bus = gst_bus_new();
    gst_element_set_bus(bad, bus);
    Bytes found;
    for (int t = 0; t < 16; ++t) {
      EXPECT_EQ(GST_FLOW_OK, sound.push(t));
      BufferPtr frame = failing.make_frame(t, paint_mover);
      if (t >= 5) gst_buffer_set_size(frame.get(), 7);
      EXPECT_EQ(t < 5 ? GST_FLOW_OK : GST_FLOW_ERROR,
                gst_harness_push(failing.harness(), frame.release()));
    }
    EXPECT_NE("", error_on(bus));
    gst_element_set_bus(bad, nullptr);
    gst_object_unref(bus);
    gst_object_unref(bad);
    EXPECT_EQ(expected, bytes_of(sound.take_to_end())) << launch;
  }
}

TEST(Processes, ThatAreStoppedGoOn) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "gst-launch-1.0 is without the sanitizer that the plugin needs";
#endif
  const std::string file =
      std::filesystem::temp_directory_path() / ("qdmd-stopped-" + std::to_string(getpid()));
  const std::string location = "location=" + file;
  const pid_t child = fork();
  if (child == 0) {
    execlp("gst-launch-1.0", "gst-launch-1.0", "-q", "videotestsrc", "is-live=true",
           "num-buffers=60", "!", "video/x-raw,format=RGB,width=32,height=24,framerate=60/1", "!",
           "qdmdbackground", "window-size=10", "!", "filesink", location.c_str(), nullptr);
    _exit(127);
  }
  for (int times = 0; times < 3; ++times) {
    usleep(150000);
    kill(child, SIGSTOP);
    usleep(300000);
    kill(child, SIGCONT);
  }
  int status = 0;
  ASSERT_EQ(child, waitpid(child, &status, 0));
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(0, WEXITSTATUS(status));
  std::error_code none;
  // A live source that was away leaves frames out, and those that it made are all there.
  const auto bytes = std::filesystem::file_size(file, none);
  EXPECT_GT(bytes, 0u);
  EXPECT_EQ(0u, bytes % (32 * 24 * 3));
  std::filesystem::remove(file, none);
}

}  // namespace
}  // namespace qdmd::test
