// SPDX-License-Identifier: LGPL-2.1-or-later
// Every allocation of the element fails once: the application gets RESOURCE/NO_SPACE_LEFT or all
// its frames, and the element can be used again. What GLib and GStreamer allocate does not fail:
// GLib ends the process where there is no memory.
//
// Short: the first of each place in the code; QDMD_LONG=1: every one.
// GTEST_TOTAL_SHARDS and GTEST_SHARD_INDEX share the cases out.
#include <array>
#include <cctype>
#include <csignal>
#include <cstdio>
#include <exception>

#include "tests/core/allocator_trials.h"
#include "tests/gst/element_test.h"

namespace qdmd::test {
namespace {

using allocator::Failing;

constexpr int kWindow = 6, kWidth = 24, kHeight = 18, kSmallWidth = 20, kSmallHeight = 16;

struct Case {
  const char* properties;
  GstVideoFormat format;
  const char* output;
  int threads;
};

std::string launch_of(const Case& c) {
  return std::string("qdmdbackground window-size=6 hop-size=2 regions=true ") + c.properties +
         " output=" + c.output + " n-threads=" + std::to_string(c.threads);
}

std::string describe(const Case& c) {
  return launch_of(c) + " " + gst_video_format_to_string(c.format);
}

// What an application has of an element. Only what the element allocates in these calls, and in
// threads of its own, is seen.
class Application {
 public:
  explicit Application(const Case& c)
      : case_(c), stream_(launch_of(c), c.format, kWidth, kHeight), bus_(gst_bus_new()) {
    element_ = gst_harness_find_element(stream_.harness(), "qdmdbackground");
    gst_element_set_bus(element_, bus_);
    gst_video_info_set_format(&small_info_, c.format, kSmallWidth, kSmallHeight);
    small_info_.fps_n = 25;
    small_info_.fps_d = 1;
    for (int t = 0; t < 8; ++t) {
      frames_.push_back(make_bytes(stream_.info(), t));
      small_frames_.push_back(make_bytes(small_info_, t));
    }
  }
  ~Application() {
    gst_element_set_bus(element_, nullptr);
    gst_object_unref(bus_);
    gst_object_unref(element_);
  }
  Application(const Application&) = delete;
  Application& operator=(const Application&) = delete;

  // False, here and below: an error came. What comes after it is left out.
  bool push_many(int count) {
    for (int i = 0; i < count && good_; ++i) {
      const auto& frames = small_ ? small_frames_ : frames_;
      GstBuffer* buffer = gst_buffer_copy(frames[static_cast<size_t>(time_) % frames.size()].get());
      stream_.stamp(buffer, time_++);
      GstFlowReturn flow = GST_FLOW_OK;
      see([&] { flow = gst_harness_push(stream_.harness(), buffer); });
      ++pushed_;
      take();
      good_ = flow == GST_FLOW_OK && !has_error();
      EXPECT_TRUE(flow == GST_FLOW_OK || has_error()) << gst_flow_get_name(flow);
    }
    return good_;
  }
  bool push_event(GstEvent* event) {
    bool done = false;
    see([&] { done = gst_harness_push_event(stream_.harness(), event); });
    take();
    good_ = good_ && !has_error();
    EXPECT_TRUE(done || has_error());
    return good_;
  }
  bool set_caps(bool small) {
    small_ = small;
    GstCaps* caps = gst_video_info_to_caps(small ? &small_info_ : &stream_.info());
    const bool done = push_event(gst_event_new_caps(caps));
    gst_caps_unref(caps);
    return done;
  }
  bool end() { return push_event(gst_event_new_eos()); }
  bool flush() {
    GstSegment segment;
    gst_segment_init(&segment, GST_FORMAT_TIME);
    push_event(gst_event_new_flush_start());
    push_event(gst_event_new_flush_stop(TRUE));
    take();
    // These are gone.
    pushed_ = 0;
    out.clear();
    time_ = 0;
    return push_event(gst_event_new_segment(&segment));
  }
  void restart() {
    EXPECT_NE(GST_STATE_CHANGE_FAILURE, gst_element_set_state(element_, GST_STATE_READY));
    EXPECT_NE(GST_STATE_CHANGE_FAILURE, gst_element_set_state(element_, GST_STATE_PLAYING));
    take();
    out.clear();
    pushed_ = 0;
    time_ = 0;
    GstSegment segment;
    gst_segment_init(&segment, GST_FORMAT_TIME);
    push_event(gst_event_new_stream_start("again"));
    set_caps(false);
    push_event(gst_event_new_segment(&segment));
  }
  template <typename... Values>
  void set(const char* name, Values... values) {
    see([&] { g_object_set(element_, name, values..., nullptr); });
  }
  void read() {
    GstStructure* stats = nullptr;
    GstSample* background = nullptr;
    see([&] { g_object_get(element_, "stats", &stats, "background", &background, nullptr); });
    gst_structure_free(stats);
    if (background) gst_sample_unref(background);
  }

  // Errors so far; each must be one of memory.
  bool has_error() {
    while (GstMessage* message = gst_bus_pop_filtered(bus_, GST_MESSAGE_ERROR)) {
      GError* error = nullptr;
      gst_message_parse_error(message, &error, nullptr);
      EXPECT_TRUE(g_error_matches(error, GST_RESOURCE_ERROR, GST_RESOURCE_ERROR_NO_SPACE_LEFT))
          << error->message;
      ++errors_;
      g_error_free(error);
      gst_message_unref(message);
    }
    return errors_ > 0;
  }
  void forget_errors() {
    has_error();
    errors_ = 0;
    good_ = true;
  }
  int pushed() const { return pushed_; }
  bool small() const { return small_; }

  std::vector<std::vector<uint8_t>> out;

 private:
  template <typename Work>
  static void see(Work work) {
    const allocator::SeenAgain again;
    work();
  }
  void take() {
    for (const BufferPtr& buffer : stream_.take_all()) {
      out.emplace_back(gst_buffer_get_size(buffer.get()));
      gst_buffer_extract(buffer.get(), 0, out.back().data(), out.back().size());
    }
  }

  Case case_;
  Stream stream_;
  GstElement* element_;
  GstBus* bus_;
  std::vector<BufferPtr> frames_, small_frames_;
  GstVideoInfo small_info_;
  int pushed_ = 0, time_ = 0, errors_ = 0;
  bool small_ = false, good_ = true;
};

struct Part {
  const char* name;
  bool after_window;
  void (*work)(Application& app, const Case& c);
};

bool window_and_half(Application& app) { return app.push_many(kWindow + kWindow / 2); }

constexpr std::array kParts = {
    Part{"start and end", false,
         [](Application& app, const Case&) {
           window_and_half(app);
           app.read();
           app.end();
         }},
    Part{"flush", true,
         [](Application& app, const Case&) {
           if (!app.flush() || !window_and_half(app)) return;
           app.read();
           app.end();
         }},
    Part{"caps", true,
         [](Application& app, const Case&) {
           if (!app.set_caps(true) || !window_and_half(app)) return;
           app.read();
           app.end();
         }},
    Part{"properties", true,
         [](Application& app, const Case& c) {
           app.set("freeze", TRUE);
           if (!window_and_half(app)) return;
           app.set("freeze", FALSE, "n-threads", c.threads == 1 ? 3u : 1u);
           if (!window_and_half(app)) return;
           app.set("time-budget", 1e-6);
           if (!app.push_many(2 * kWindow)) return;
           app.set("time-budget", 1e6);
           if (!app.push_many(2 * kWindow)) return;
           app.set("time-budget", 0.0, "n-threads", unsigned(c.threads));
           app.end();
         }},
};

std::vector<std::vector<uint8_t>> pictures_of(Application& app) {
  window_and_half(app);
  app.end();
  EXPECT_FALSE(app.has_error());
  return std::move(app.out);
}

struct Trial {
  const Case& c;
  const Part& part;
  int64_t n;
  Failing failing;
};

// How many allocations the part's work had; fewer than n: none failed.
int64_t run(const Trial& trial, const std::vector<std::vector<uint8_t>>& right,
            bool note_places = false) {
  const allocator::Unseen unseen;
  trial_name() = describe(trial.c) + ", " + trial.part.name + trial_suffix(trial.n, trial.failing);
  SCOPED_TRACE(trial_name());
  allocator::start();
  int64_t allocations = 0;
  {
    Application app(trial.c);
    if (trial.part.after_window) window_and_half(app);
    const int64_t before = allocator::seen().allocations;
    if (note_places) allocator::note_places();
    if (trial.n > 0) allocator::fail(before + trial.n, trial.failing);
    try {
      trial.part.work(app, trial.c);
    } catch (const std::exception& error) {
      // Locks of GStreamer's are still held: nothing can go on.
      std::fprintf(stderr, "an exception left the element: %s\n", error.what());
      std::abort();
    }
    const auto seen = allocator::seen();
    allocations = seen.allocations - before;
    allocator::fail_no_more();
    const bool failed = app.has_error();
    EXPECT_TRUE(!failed || seen.failed > 0);
    EXPECT_TRUE(failed || app.out.size() == static_cast<size_t>(app.pushed()))
        << app.out.size() << " of " << app.pushed() << " frames came out";
    app.forget_errors();
    app.set("freeze", FALSE, "time-budget", 0.0, "n-threads", unsigned(trial.c.threads));
    if (trial.n % 2 == 0 || app.small())
      app.restart();
    else
      app.flush();
    EXPECT_EQ(pictures_of(app) == right, true) << "other pictures after a failure";
  }
  allocator::stop();
  const auto seen = allocator::seen();
  EXPECT_EQ(seen.blocks, 0) << seen.bytes << " bytes are left";
  return allocations;
}

void check(const Case& c) {
  const auto right = [&] {
    Application app(c);
    return pictures_of(app);
  }();
  EXPECT_EQ(right.size(), static_cast<size_t>(kWindow + kWindow / 2));
  for (const Part& part : kParts) {
    const int64_t all = run({c, part, 0, Failing::one}, right, true);
    for (int64_t n : allocations_to_try(part.name, all))
      for (Failing failing : ways_to_fail(n, std::string(c.output) == "mask")) {
        run({c, part, n, failing}, right);
        if (testing::Test::HasFailure()) return;
      }
  }
}

// The element's code must be there to be told from others'.
void look_at_the_element() {
  GstElement* element = gst_element_factory_make("qdmdbackground", nullptr);
  ASSERT_NE(nullptr, element);
  gst_object_unref(element);
  ASSERT_TRUE(allocator::see_only("libgstqdmd.so"));
  for (int signal : {SIGABRT, SIGSEGV, SIGTRAP}) std::signal(signal, report_trial);
}

class OutOfMemory : public testing::TestWithParam<Case> {
 protected:
  void SetUp() override { look_at_the_element(); }
};

constexpr std::array kFormats = {GST_VIDEO_FORMAT_RGB, GST_VIDEO_FORMAT_RGBA, GST_VIDEO_FORMAT_I420,
                                 GST_VIDEO_FORMAT_GRAY8};
constexpr std::array kOutputs = {"background", "foreground", "mask", "cutout"};

// Each output with each method and mode, and each format with each output.
std::vector<Case> cases() {
  std::vector<Case> all;
  size_t turn = 0;
  for (const char* properties :
       {"mode=batch", "mode=live", "mode=batch method=qdmd", "mode=live method=qdmd",
        "mode=batch method=dmd", "mode=live method=dmd"}) {
    for (size_t k = 0; k < kFormats.size(); ++k)
      all.push_back({properties, kFormats[k], kOutputs[(k + turn) % 4], k % 2 == 0 ? 3 : 1});
    ++turn;
  }
  return all;
}

TEST_P(OutOfMemory, LeavesAnElementThatCanGoOn) { check(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Element, OutOfMemory, testing::ValuesIn(cases()),
                         [](const auto& instance) {
                           std::string name =
                               std::string(instance.param.properties) + " " + instance.param.output;
                           for (char& c : name)
                             if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
                           return name + "_" + gst_video_format_to_string(instance.param.format);
                         });

TEST(OutOfMemoryOfANewElement, LeavesNothing) {
  look_at_the_element();
  for (int64_t n = 1;; ++n) {
    allocator::start();
    allocator::fail(n, Failing::one);
    trial_name() = "a new element, allocation " + std::to_string(n);
    GstElement* element = gst_element_factory_make("qdmdbackground", nullptr);
    allocator::stop();
    if (element) gst_object_unref(element);
    EXPECT_EQ(allocator::seen().blocks, 0);
    if (allocator::seen().failed == 0) break;
  }
}

}  // namespace
}  // namespace qdmd::test
