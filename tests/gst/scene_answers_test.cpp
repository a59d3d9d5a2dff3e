// SPDX-License-Identifier: LGPL-2.1-or-later
// What qdmdscenesrc answers when it is asked: properties, queries, messages.
#include <gst/gst.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <memory>
#include <string>

namespace {

struct Unref {
  void operator()(void* object) const { gst_object_unref(object); }
};
using Element = std::unique_ptr<GstElement, Unref>;

Element pipeline_of(const std::string& text) {
  GError* error = nullptr;
  Element pipeline(gst_parse_launch(text.c_str(), &error));
  EXPECT_EQ(error, nullptr) << error->message;
  return pipeline;
}

void pause(const Element& pipeline) {
  gst_element_set_state(pipeline.get(), GST_STATE_PAUSED);
  EXPECT_EQ(gst_element_get_state(pipeline.get(), nullptr, nullptr, 60 * GST_SECOND),
            GST_STATE_CHANGE_SUCCESS);
}

constexpr const char* kCaps =
    " ! video/x-raw,format=RGB,width=96,height=64,framerate=25/1 ! fakesink sync=false";

TEST(SceneAnswers, PropertiesAreThoseThatWereSet) {
  const Element source(
      GST_ELEMENT(gst_object_ref_sink(gst_element_factory_make("qdmdscenesrc", nullptr))));
  gst_util_set_object_arg(G_OBJECT(source.get()), "truth", "mask");
  g_object_set(source.get(), "scene", "storm", "effects", "noise=3", "seed", G_MAXUINT64, "is-live",
               TRUE, "post-messages", TRUE, nullptr);
  gchar *scene = nullptr, *effects = nullptr;
  guint64 seed = 0;
  gboolean live = FALSE, posts = FALSE;
  g_object_get(source.get(), "scene", &scene, "effects", &effects, "seed", &seed, "is-live", &live,
               "post-messages", &posts, nullptr);
  EXPECT_STREQ(scene, "storm");
  EXPECT_STREQ(effects, "noise=3");
  EXPECT_EQ(seed, G_MAXUINT64);
  EXPECT_TRUE(live);
  EXPECT_TRUE(posts);
  g_free(scene);
  g_free(effects);

  GValue truth = G_VALUE_INIT;
  g_object_get_property(G_OBJECT(source.get()), "truth", &truth);
  EXPECT_STREQ(g_enum_get_value(G_ENUM_CLASS(g_type_class_peek(G_VALUE_TYPE(&truth))),
                                g_value_get_enum(&truth))
                   ->value_nick,
               "mask");
  g_value_unset(&truth);
}

// One for each frame, in its time, and only if it is asked for.
TEST(SceneAnswers, AMessageSaysWhereTheCameraLooks) {
  for (const bool asked : {true, false}) {
    const Element pipeline =
        pipeline_of("qdmdscenesrc scene=jitter=2 num-buffers=20 post-messages=" +
                    std::string(asked ? "true" : "false") + kCaps);
    ASSERT_TRUE(pipeline);
    gst_element_set_state(pipeline.get(), GST_STATE_PLAYING);
    GstBus* bus = gst_element_get_bus(pipeline.get());
    guint64 count = 0, moved = 0;
    bool ended = false;
    while (!ended) {
      GstMessage* message = gst_bus_timed_pop_filtered(
          bus, 60 * GST_SECOND,
          GstMessageType(GST_MESSAGE_ELEMENT | GST_MESSAGE_EOS | GST_MESSAGE_ERROR));
      EXPECT_NE(message, nullptr) << "no end after a minute";
      ended = !message || GST_MESSAGE_TYPE(message) != GST_MESSAGE_ELEMENT;
      const GstStructure* structure = message ? gst_message_get_structure(message) : nullptr;
      if (!ended && gst_structure_has_name(structure, "qdmdscenesrc-camera")) {
        guint64 timestamp = 0;
        double x = 99, y = 99, angle = 99;
        EXPECT_TRUE(gst_structure_get(structure, "timestamp", G_TYPE_UINT64, &timestamp, "camera-x",
                                      G_TYPE_DOUBLE, &x, "camera-y", G_TYPE_DOUBLE, &y,
                                      "camera-angle", G_TYPE_DOUBLE, &angle, nullptr));
        EXPECT_EQ(timestamp, count * GST_SECOND / 25);
        // The camera shakes by about two pixels and does not turn.
        EXPECT_LT(std::hypot(x, y), 16);
        EXPECT_EQ(angle, 0);
        moved += x != 0 || y != 0;
        ++count;
      }
      if (message) gst_message_unref(message);
    }
    EXPECT_EQ(count, asked ? 20u : 0u);
    if (asked) {
      EXPECT_GE(moved, 10u);
    }
    gst_element_set_state(pipeline.get(), GST_STATE_NULL);
    gst_object_unref(bus);
  }
}

TEST(SceneAnswers, FramesAreConvertedToTime) {
  const Element pipeline = pipeline_of("qdmdscenesrc name=source" + std::string(kCaps));
  ASSERT_TRUE(pipeline);
  pause(pipeline);
  const Element source(gst_bin_get_by_name(GST_BIN(pipeline.get()), "source"));
  gint64 converted = 0;
  EXPECT_TRUE(
      gst_element_query_convert(source.get(), GST_FORMAT_DEFAULT, 50, GST_FORMAT_TIME, &converted));
  EXPECT_EQ(converted, gint64(2 * GST_SECOND));
  EXPECT_TRUE(gst_element_query_convert(source.get(), GST_FORMAT_TIME, gint64(GST_SECOND),
                                        GST_FORMAT_DEFAULT, &converted));
  EXPECT_EQ(converted, 25);
  gst_element_set_state(pipeline.get(), GST_STATE_NULL);
}

// Asks the source itself, or the pipeline, whose sink passes it on.
gboolean seek_backwards(GstElement* element, GstSeekType stop_type, GstClockTime stop) {
  return gst_element_seek(element, -1, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH, GST_SEEK_TYPE_SET, 0,
                          stop_type, gint64(stop));
}

// A scene without a length has no end, and a seek backwards from it is refused before anything is
// flushed: after a flush, frames would lack their segment.
TEST(SceneAnswers, BackwardsFromNoEndIsRefused) {
  const Element pipeline = pipeline_of("qdmdscenesrc name=source" + std::string(kCaps));
  ASSERT_TRUE(pipeline);
  pause(pipeline);
  const Element source(gst_bin_get_by_name(GST_BIN(pipeline.get()), "source"));
  const std::unique_ptr<GstPad, Unref> pad(gst_element_get_static_pad(source.get(), "src"));
  std::atomic<int> flushes = 0;
  const auto count = [](GstPad*, GstPadProbeInfo* info, gpointer data) {
    if (GST_EVENT_TYPE(GST_PAD_PROBE_INFO_EVENT(info)) == GST_EVENT_FLUSH_START)
      ++*static_cast<std::atomic<int>*>(data);
    return GST_PAD_PROBE_OK;
  };
  gst_pad_add_probe(pad.get(), GST_PAD_PROBE_TYPE_EVENT_FLUSH, count, &flushes, nullptr);
  for (GstElement* asked : {pipeline.get(), source.get()}) {
    EXPECT_FALSE(seek_backwards(asked, GST_SEEK_TYPE_NONE, GST_CLOCK_TIME_NONE));
    EXPECT_FALSE(seek_backwards(asked, GST_SEEK_TYPE_SET, GST_CLOCK_TIME_NONE));
    EXPECT_FALSE(seek_backwards(asked, GST_SEEK_TYPE_END, 0));
    EXPECT_FALSE(gst_element_seek(asked, 1, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH, GST_SEEK_TYPE_END,
                                  -gint64(GST_SECOND), GST_SEEK_TYPE_NONE, -1));
  }
  EXPECT_EQ(flushes, 0);
  // What programs send that mean no stop.
  EXPECT_TRUE(gst_element_seek(pipeline.get(), 1, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH,
                               GST_SEEK_TYPE_SET, gint64(GST_SECOND), GST_SEEK_TYPE_END, 0));
  EXPECT_EQ(flushes, 1);
  flushes = 0;
  EXPECT_TRUE(seek_backwards(pipeline.get(), GST_SEEK_TYPE_SET, GST_SECOND));
  EXPECT_EQ(flushes, 1);
  gst_element_set_state(pipeline.get(), GST_STATE_NULL);
}

// Before the frame rate is known, nothing can be counted from the end.
TEST(SceneAnswers, FromTheEndOfWhatIsNotKnownIsRefused) {
  const Element pipeline =
      pipeline_of("qdmdscenesrc name=source scene=length=9" + std::string(kCaps));
  ASSERT_TRUE(pipeline);
  const Element source(gst_bin_get_by_name(GST_BIN(pipeline.get()), "source"));
  gst_element_set_state(pipeline.get(), GST_STATE_READY);
  const auto seek = [&source](GstSeekType start_type, gint64 start) {
    return gst_element_seek(source.get(), 1, GST_FORMAT_TIME, GST_SEEK_FLAG_FLUSH, start_type,
                            start, GST_SEEK_TYPE_NONE, -1);
  };
  EXPECT_FALSE(seek(GST_SEEK_TYPE_END, -gint64(GST_SECOND)));
  EXPECT_TRUE(seek(GST_SEEK_TYPE_SET, 0));
  gst_element_set_state(pipeline.get(), GST_STATE_NULL);
}

// The stop that an earlier seek gave is an end.
TEST(SceneAnswers, BackwardsFromTheLastStopIsTaken) {
  const Element pipeline = pipeline_of("qdmdscenesrc name=source" + std::string(kCaps));
  ASSERT_TRUE(pipeline);
  pause(pipeline);
  EXPECT_TRUE(seek_backwards(pipeline.get(), GST_SEEK_TYPE_SET, GST_SECOND));
  EXPECT_TRUE(seek_backwards(pipeline.get(), GST_SEEK_TYPE_NONE, GST_CLOCK_TIME_NONE));
  gst_element_set_state(pipeline.get(), GST_STATE_NULL);
}

}  // namespace
