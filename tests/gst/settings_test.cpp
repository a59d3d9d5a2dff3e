// SPDX-License-Identifier: LGPL-2.1-or-later
// Properties as they are read and set, the warnings of settings that change nothing or come too
// late, and stats.
#include <algorithm>
#include <fstream>
#include <string>

#include "tests/gst/element_test.h"

namespace qdmd::test {
namespace {

TEST(Properties, EveryOneIsReadBackAndDocumented) {
  GstElement* element = gst_element_factory_make("qdmdbackground", nullptr);
  gst_util_set_object_arg(G_OBJECT(element), "output", "cutout");
  gst_util_set_object_arg(G_OBJECT(element), "window-size", "33");
  gst_util_set_object_arg(G_OBJECT(element), "method", "dmd");
  gst_util_set_object_arg(G_OBJECT(element), "rank", "3");
  gst_util_set_object_arg(G_OBJECT(element), "omega-threshold", "0.25");
  gst_util_set_object_arg(G_OBJECT(element), "amplitude", "first-frame");
  gst_util_set_object_arg(G_OBJECT(element), "solver", "adjoint");
  gst_util_set_object_arg(G_OBJECT(element), "estimator", "optimized");
  gst_util_set_object_arg(G_OBJECT(element), "foreground-threshold", "12.5");
  gst_util_set_object_arg(G_OBJECT(element), "max-memory", "5000000000");
  gst_util_set_object_arg(G_OBJECT(element), "n-threads", "7");
  gint output, method, amplitude, solver, estimator, mode;
  guint window, rank, threads;
  gdouble omega, threshold;
  guint64 memory;
  g_object_get(element, "output", &output, "method", &method, "amplitude", &amplitude, "solver",
               &solver, "estimator", &estimator, "mode", &mode, "window-size", &window, "rank",
               &rank, "omega-threshold", &omega, "foreground-threshold", &threshold, "max-memory",
               &memory, "n-threads", &threads, nullptr);
  EXPECT_EQ(3, output);
  EXPECT_EQ(1, method);
  EXPECT_EQ(1, amplitude);
  EXPECT_EQ(3, solver);
  EXPECT_EQ(3, estimator);
  EXPECT_EQ(0, mode);
  EXPECT_EQ(33u, window);
  EXPECT_EQ(3u, rank);
  EXPECT_EQ(0.25, omega);
  EXPECT_EQ(12.5, threshold);
  EXPECT_EQ(5000000000u, memory);
  EXPECT_EQ(7u, threads);

  g_object_set(element, "object-messages", TRUE, "object-snapshots", TRUE, "object-min-size", 0.125,
               "object-appear-time", 0.5, "object-stop-time", 10.0, "object-gone-time", 2.5,
               "motion-end-time", 7.0, nullptr);
  gboolean messages, snapshots;
  gdouble size, appear, stop, gone, end;
  g_object_get(element, "object-messages", &messages, "object-snapshots", &snapshots,
               "object-min-size", &size, "object-appear-time", &appear, "object-stop-time", &stop,
               "object-gone-time", &gone, "motion-end-time", &end, nullptr);
  EXPECT_TRUE(messages && snapshots);
  EXPECT_EQ(0.125, size);
  EXPECT_EQ(0.5, appear);
  EXPECT_EQ(10, stop);
  EXPECT_EQ(2.5, gone);
  EXPECT_EQ(7, end);

  guint scale = 5;
  g_object_get(element, "mask-scale", &scale, nullptr);
  EXPECT_EQ(0u, scale);
  g_object_set(element, "mask-scale", 2u, nullptr);
  g_object_get(element, "mask-scale", &scale, nullptr);
  EXPECT_EQ(2u, scale);

  guint count = 0;
  GParamSpec** specs = g_object_class_list_properties(G_OBJECT_GET_CLASS(element), &count);
  for (guint i = 0; i < count; ++i) {
    if (specs[i]->owner_type != G_OBJECT_TYPE(element)) continue;
    EXPECT_GT(std::strlen(g_param_spec_get_blurb(specs[i])), 20u) << specs[i]->name;
    if (!(specs[i]->flags & G_PARAM_WRITABLE)) continue;
    EXPECT_TRUE(specs[i]->flags & (GST_PARAM_MUTABLE_READY | GST_PARAM_MUTABLE_PLAYING))
        << specs[i]->name;
  }
  g_free(specs);
  gst_object_unref(element);
}

// ---- The elements' documentation ----

// The first comment of a file in gst/, in one line.
std::string doc_block_of(const char* file) {
  std::ifstream in(std::string(QDMD_SOURCE "/gst/") + file);
  std::string block, line;
  while (std::getline(in, line) && line != " */") {
    block.append(line, std::min<size_t>(line.size(), 3));
    block.push_back(' ');
  }
  EXPECT_TRUE(in) << file << " does not begin with a comment";
  return block;
}

TEST(Documentation, SaysWhichMethodIsTheDefault) {
  for (const auto& [name, file] : {std::pair{"qdmdbackground", "gstqdmdbackground.cpp"},
                                   {"qdmdseparate", "gstqdmdseparate.cpp"}}) {
    GstElement* element = gst_element_factory_make(name, nullptr);
    const auto* spec =
        G_PARAM_SPEC_ENUM(g_object_class_find_property(G_OBJECT_GET_CLASS(element), "method"));
    const char* nick = g_enum_get_value(spec->enum_class, spec->default_value)->value_nick;
    std::string said = ":method `";
    said.append(nick).push_back('`');
    EXPECT_NE(doc_block_of(file).find(said), std::string::npos) << name << " lacks " << said;
    gst_object_unref(element);
  }
}

// ---- Settings that a method does not look at ----

// The element's warnings while it lives, each with what it says.
class Warnings {
 public:
  Warnings() {
    gst_debug_set_threshold_for_name("qdmdbackground", GST_LEVEL_WARNING);
    gst_debug_add_log_function(&note, &all_, nullptr);
  }
  ~Warnings() {
    gst_debug_remove_log_function_by_data(&all_);
    gst_debug_unset_threshold_for_name("qdmdbackground");
  }
  const std::vector<std::string>& all() const { return all_; }

 private:
  static void note(GstDebugCategory* category, GstDebugLevel level, const gchar*, const gchar*,
                   gint, GObject*, GstDebugMessage* message, gpointer data) {
    if (level == GST_LEVEL_WARNING &&
        std::string(gst_debug_category_get_name(category)) == "qdmdbackground")
      static_cast<std::vector<std::string>*>(data)->push_back(gst_debug_message_get(message));
  }
  std::vector<std::string> all_;
};

std::vector<std::string> warnings_of(const std::string& properties) {
  const Warnings warnings;
  Stream stream("qdmdbackground window-size=4 " + properties, GST_VIDEO_FORMAT_RGB, 16, 12);
  stream.push_many(0, 6);
  // New caps are no reason to say it again.
  stream.set_caps(GST_VIDEO_FORMAT_RGB, 18, 12);
  stream.push_many(6, 2);
  return warnings.all();
}

TEST(Settings, WithoutEffectAreWarnedOfOnce) {
  struct Case {
    const char *properties, *method, *name;
  };
  for (const Case& c : {Case{"amplitude=first-frame", "robust", "amplitude"},
                        {"method=qdmd iterations=3", "qdmd", "iterations"},
                        {"method=dmd solver=qr", "dmd", "solver"}}) {
    const auto warnings = warnings_of(c.properties);
    ASSERT_EQ(1u, warnings.size()) << c.properties;
    for (const char* word : {c.method, c.name})
      EXPECT_NE(std::string::npos, warnings[0].find(word)) << warnings[0];
  }
}

TEST(Settings, ThatCountAreNotWarnedOf) {
  for (const char* properties :
       {"", "solver=qr rank=2 iterations=2 omega-threshold=0.1 sample-step=2",
        "method=qdmd amplitude=first-frame solver=gram-extended",
        "method=dmd amplitude=first-frame"})
    EXPECT_TRUE(warnings_of(properties).empty()) << properties;
}

// What is not looked at changes no picture.
TEST(Settings, WithoutEffectHaveNone) {
  const auto pictures_of = [](const std::string& properties) {
    Stream stream("qdmdbackground window-size=6 " + properties, GST_VIDEO_FORMAT_RGB, 40, 24);
    stream.push_many(0, 8);
    stream.eos();
    std::vector<uint8_t> bytes;
    for (const BufferPtr& buffer : stream.take_all()) {
      GstMapInfo map;
      EXPECT_TRUE(gst_buffer_map(buffer.get(), &map, GST_MAP_READ));
      bytes.insert(bytes.end(), map.data, map.data + map.size);
      gst_buffer_unmap(buffer.get(), &map);
    }
    return bytes;
  };
  EXPECT_EQ(pictures_of(""), pictures_of("amplitude=first-frame"));
  EXPECT_EQ(pictures_of("method=qdmd"), pictures_of("method=qdmd iterations=4"));
  EXPECT_EQ(pictures_of("method=dmd"), pictures_of("method=dmd solver=qr iterations=2"));
}

TEST(Settings, ThatWaitForTheNextStartAreWarnedOfWhilePlaying) {
  Stream stream("qdmdbackground window-size=5", GST_VIDEO_FORMAT_RGB, 16, 16);
  GstElement* element = gst_harness_find_element(stream.harness(), "qdmdbackground");
  GstBus* bus = gst_bus_new();
  gst_element_set_bus(element, bus);
  const auto warning_of = [&](const char* name, const char* value) {
    gst_util_set_object_arg(G_OBJECT(element), name, value);
    return next_text(bus, GST_MESSAGE_WARNING);
  };
  const char* const waiting[][2] = {
      {"window-size", "9"}, {"mode", "live"}, {"hop-size", "3"},           {"method", "qdmd"},
      {"rank", "2"},        {"solver", "qr"}, {"max-memory", "1000000000"}};
  for (GstState state : {GST_STATE_PLAYING, GST_STATE_PAUSED}) {
    ASSERT_NE(GST_STATE_CHANGE_FAILURE, gst_element_set_state(element, GST_STATE_READY));
    for (const auto& [name, value] : waiting) {
      // Not where it takes effect.
      EXPECT_EQ("", warning_of(name, value)) << name;
      GParamSpec* spec = g_object_class_find_property(G_OBJECT_GET_CLASS(element), name);
      EXPECT_TRUE(spec->flags & GST_PARAM_MUTABLE_READY) << name;
      GValue before = G_VALUE_INIT;
      g_value_init(&before, spec->value_type);
      g_param_value_set_default(spec, &before);
      g_object_set_property(G_OBJECT(element), name, &before);
      g_value_unset(&before);
    }
    ASSERT_NE(GST_STATE_CHANGE_FAILURE, gst_element_set_state(element, state));
    EXPECT_EQ("", next_text(bus, GST_MESSAGE_WARNING));
    for (const auto& [name, value] : waiting) {
      const std::string text = warning_of(name, value);
      EXPECT_NE(std::string::npos, text.find(name)) << name << ": " << text;
      EXPECT_EQ("", next_text(bus, GST_MESSAGE_WARNING)) << name << ": one is enough";
      EXPECT_EQ("", warning_of(name, value)) << name << " is that already";
    }
    for (const auto& [name, value] : {std::pair{"output", "mask"},
                                      {"n-threads", "2"},
                                      {"freeze", "true"},
                                      {"foreground-threshold", "20"}})
      EXPECT_EQ("", warning_of(name, value)) << name;
    for (const auto& [name, value] : {std::pair{"output", "background"},
                                      {"n-threads", "0"},
                                      {"freeze", "false"},
                                      {"foreground-threshold", "0"}})
      EXPECT_EQ("", warning_of(name, value)) << name;
  }
  ASSERT_NE(GST_STATE_CHANGE_FAILURE, gst_element_set_state(element, GST_STATE_NULL));
  EXPECT_EQ("", warning_of("window-size", "33"));
  gst_element_set_bus(element, nullptr);
  gst_object_unref(bus);
  gst_object_unref(element);
}

TEST(Stats, CountSolvesOverAChangeOfCaps) {
  Stream stream("qdmdbackground window-size=5", GST_VIDEO_FORMAT_RGB, 40, 24);
  GstElement* element = gst_harness_find_element(stream.harness(), "qdmdbackground");
  const auto solves = [&] {
    GstStructure* stats = nullptr;
    g_object_get(element, "stats", &stats, nullptr);
    guint64 count = 99;
    EXPECT_TRUE(gst_structure_get_uint64(stats, "solves", &count));
    gst_structure_free(stats);
    return count;
  };
  stream.push_many(0, 4);
  EXPECT_EQ(0u, solves());
  stream.push_many(4, 8);
  EXPECT_EQ(2u, solves()) << "each with its first frame that leaves";
  stream.set_caps(GST_VIDEO_FORMAT_RGB, 24, 16);
  EXPECT_EQ(3u, solves()) << "the rest is sent";
  stream.push_many(12, 4);
  EXPECT_EQ(3u, solves());
  stream.push_many(16, 1);
  EXPECT_EQ(4u, solves());
  stream.set_caps(GST_VIDEO_FORMAT_BGRA, 24, 16);
  stream.push_many(17, 1);
  ASSERT_TRUE(stream.eos());
  EXPECT_EQ(5u, solves());
  EXPECT_EQ(18u, stream.take_all().size());
  gst_object_unref(element);
}

TEST(Stats, CountFramesAndSolves) {
  Stream stream("qdmdbackground window-size=5", GST_VIDEO_FORMAT_RGB, 40, 24);
  stream.push_many(0, 12);
  ASSERT_TRUE(stream.eos());
  stream.take_all();
  GstElement* element = gst_harness_find_element(stream.harness(), "qdmdbackground");
  GstStructure* stats = nullptr;
  g_object_get(element, "stats", &stats, nullptr);
  guint64 in = 0, out = 0, solves = 0;
  EXPECT_TRUE(gst_structure_get(stats, "frames-in", G_TYPE_UINT64, &in, "frames-out", G_TYPE_UINT64,
                                &out, "solves", G_TYPE_UINT64, &solves, nullptr));
  EXPECT_EQ(12u, in);
  EXPECT_EQ(12u, out);
  EXPECT_EQ(3u, solves);
  gst_structure_free(stats);
  gst_object_unref(element);
}

}  // namespace
}  // namespace qdmd::test
