// SPDX-License-Identifier: LGPL-2.1-or-later
// A camera that moves, as users see it: properties, messages, stats.
#include <gst/gst.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

namespace qdmd::test {
namespace {

struct Looks {
  double x, y, angle;
};
struct Heard {
  std::map<guint64, Looks> truth, found;  // by timestamp
  int moved_scenes = 0, warnings = 0;
  Looks last{};  // of `stats`
};

// Runs `qdmdscenesrc ! qdmdbackground name=q` to its end.
Heard run(const std::string& scene, const std::string& properties, int frames,
          const std::string& caps = "format=RGB,width=160,height=120") {
  Heard heard;
  const std::string text = "qdmdscenesrc post-messages=true num-buffers=" + std::to_string(frames) +
                           " scene=" + scene + " ! video/x-raw," + caps +
                           ",framerate=25/1 ! qdmdbackground name=q window-size=30 " + properties +
                           " ! fakesink sync=false";
  GError* error = nullptr;
  GstElement* pipeline = gst_parse_launch(text.c_str(), &error);
  EXPECT_EQ(error, nullptr) << text;
  g_clear_error(&error);
  GstBus* bus = gst_element_get_bus(pipeline);
  gst_element_set_state(pipeline, GST_STATE_PLAYING);
  for (bool ended = false; !ended;) {
    GstMessage* message = gst_bus_timed_pop(bus, 60 * GST_SECOND);
    if (!message) {
      ADD_FAILURE() << "nothing happens: " << text;
      break;
    }
    switch (GST_MESSAGE_TYPE(message)) {
      case GST_MESSAGE_ERROR:
        ADD_FAILURE() << "error: " << text;
        [[fallthrough]];
      case GST_MESSAGE_EOS:
        ended = true;
        break;
      case GST_MESSAGE_WARNING:
        ++heard.warnings;
        break;
      case GST_MESSAGE_ELEMENT: {
        const GstStructure* s = gst_message_get_structure(message);
        guint64 time = 0;
        gst_structure_get_uint64(s, "timestamp", &time);
        Looks looks{};
        gst_structure_get(s, "camera-x", G_TYPE_DOUBLE, &looks.x, "camera-y", G_TYPE_DOUBLE,
                          &looks.y, "camera-angle", G_TYPE_DOUBLE, &looks.angle, nullptr);
        if (gst_structure_has_name(s, "qdmdscenesrc-camera")) heard.truth[time] = looks;
        if (gst_structure_has_name(s, "qdmdbackground-camera")) heard.found[time] = looks;
        gboolean moved = FALSE;
        if (gst_structure_has_name(s, "qdmdbackground-scene") &&
            gst_structure_get_boolean(s, "camera-moved", &moved) && moved)
          ++heard.moved_scenes;
        break;
      }
      default:
        break;
    }
    gst_message_unref(message);
  }
  GstElement* element = gst_bin_get_by_name(GST_BIN(pipeline), "q");
  GstStructure* stats = nullptr;
  g_object_get(element, "stats", &stats, nullptr);
  EXPECT_TRUE(gst_structure_get(stats, "camera-x", G_TYPE_DOUBLE, &heard.last.x, "camera-y",
                                G_TYPE_DOUBLE, &heard.last.y, "camera-angle", G_TYPE_DOUBLE,
                                &heard.last.angle, nullptr));
  gst_structure_free(stats);
  gst_object_unref(element);
  gst_element_set_state(pipeline, GST_STATE_NULL);
  gst_object_unref(bus);
  gst_object_unref(pipeline);
  return heard;
}

// The share of the frames whose shift is within a tenth of a pixel of the truth, but for where the
// canvas is.
double near_truth(const Heard& heard) {
  std::vector<double> x, y;
  for (const auto& [time, looks] : heard.found) {
    x.push_back(looks.x - heard.truth.at(time).x);
    y.push_back(looks.y - heard.truth.at(time).y);
  }
  const auto middle = [](std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
    return values[values.size() / 2];
  };
  if (x.empty()) return 0;
  const double middle_x = middle(x), middle_y = middle(y);
  size_t near = 0;
  for (size_t i = 0; i < x.size(); ++i)
    near += std::hypot(x[i] - middle_x, y[i] - middle_y) < 0.1 ? 1 : 0;
  return static_cast<double>(near) / static_cast<double>(x.size());
}

TEST(Stabilize, MessagesAreTheTruth) {
  for (const char* caps : {"format=RGB,width=160,height=120", "format=I420,width=161,height=119",
                           "format=NV12,width=160,height=120", "format=GRAY8,width=160,height=120",
                           "format=BGRA,width=160,height=120", "format=YUY2,width=160,height=120"})
    for (const char* mode : {"batch", "live"}) {
      const Heard heard =
          run("basic,jitter=2", std::string("post-messages=true mode=") + mode, 90, caps);
      EXPECT_EQ(heard.truth.size(), 90u);
      // Frames at rest say nothing.
      EXPECT_GT(heard.found.size(), 75u) << caps << mode;
      EXPECT_GT(near_truth(heard), 0.95) << caps << mode;
      EXPECT_GT(std::hypot(heard.last.x, heard.last.y), 0) << caps << mode;
    }
}

TEST(Stabilize, TurnsAreTold) {
  const Heard heard = run("basic,jitter=1:rotation=1", "post-messages=true stabilize=similarity",
                          60, "format=RGB,width=320,height=240");
  double most = 0;
  std::vector<double> errors;
  for (const auto& [time, looks] : heard.found) {
    errors.push_back(looks.angle - heard.truth.at(time).angle);
    most = std::max(most, std::abs(looks.angle));
  }
  ASSERT_GT(errors.size(), 40u);
  std::sort(errors.begin(), errors.end());
  EXPECT_GT(most, 0.5);
  EXPECT_LT(errors[errors.size() * 19 / 20] - errors[errors.size() / 20], 0.1);
}

TEST(Stabilize, WhoStandsStillSaysNothing) {
  const Heard still = run("basic,bootstrap", "post-messages=true", 60);
  EXPECT_EQ(still.found.size(), 0u);
  EXPECT_EQ(std::hypot(still.last.x, still.last.y), 0);
  // Neither does who is not asked.
  EXPECT_EQ(run("basic,jitter=3", "", 60).found.size(), 0u);
  const Heard off = run("basic,jitter=3", "post-messages=true stabilize=off", 60);
  EXPECT_EQ(off.found.size(), 0u);
  EXPECT_EQ(off.last.x, 0);
}

TEST(Stabilize, ACameraThatGoesOnIsSaidSo) {
  EXPECT_GE(run("noise,jitter=0:drift=20:way=400", "mode=live", 150).moved_scenes, 1);
  EXPECT_EQ(run("basic,jitter=2", "mode=live", 100).moved_scenes, 0);
}

TEST(Stabilize, WithoutRoomThereIsOneWarning) {
  // Enough for the window, not for two.
  EXPECT_EQ(run("basic,jitter=3", "max-memory=10500000 n-threads=2 output=mask", 60).warnings, 1);
  EXPECT_EQ(run("basic,jitter=3", "output=mask", 60).warnings, 0);
}

TEST(Stabilize, EveryOutputComesSteadyOrNot) {
  for (const char* output : {"background", "foreground", "mask", "cutout"})
    for (const char* steady : {"true", "false"})
      for (const char* form : {"RGB", "ARGB", "I420", "YUY2", "P010_10LE", "I420_10LE"})
        run("basic,jitter=2",
            std::string(
                "regions=true mask-softness=3 shadows=marked stabilize=similarity output=") +
                output + " stabilize-output=" + steady,
            40, std::string("format=") + form + ",width=97,height=61");
}

}  // namespace
}  // namespace qdmd::test
