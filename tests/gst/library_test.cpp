// The engine as a library: what it gives is what the element gives, and what OpenCV's users expect.
#include "core/library/opencv.h"

#include <gst/check/gstharness.h>
#include <gst/gst.h>
#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace {

using qdmd::library::BackgroundSubtractor;
using qdmd::library::Method;
using qdmd::library::Options;
using qdmd::library::Separator;
namespace scene = qdmd::scene;

// BGR pictures of a simulated street.
std::vector<cv::Mat> street(int width, int height, int count) {
  scene::SceneOptions options;
  options.width = width;
  options.height = height;
  scene::Scene source(options, "basic,noise=2");
  std::vector<cv::Mat> frames;
  for (int t = 0; t < count; ++t) {
    source.render(t, scene::kFrame);
    cv::Mat frame(height, width, CV_8UC3);
    const auto& samples = source.frame().samples;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        for (int c = 0; c < 3; ++c)
          frame.at<cv::Vec3b>(y, x)[2 - c] = samples[static_cast<size_t>(3 * (y * width + x) + c)];
    frames.push_back(frame);
  }
  return frames;
}

// The element's pictures of these frames: rows of 4 bytes' multiples.
std::vector<cv::Mat> of_element(const std::vector<cv::Mat>& frames, const std::string& settings) {
  const int width = frames[0].cols, height = frames[0].rows;
  GstHarness* harness = gst_harness_new_parse(("qdmdbackground mode=live " + settings).c_str());
  const std::string caps = "video/x-raw,format=BGR,framerate=25/1,width=" + std::to_string(width) +
                           ",height=" + std::to_string(height);
  gst_harness_set_src_caps_str(harness, caps.c_str());
  const size_t stride = (static_cast<size_t>(width) * 3 + 3) / 4 * 4;
  std::vector<cv::Mat> pictures;
  for (size_t t = 0; t < frames.size(); ++t) {
    GstBuffer* buffer =
        gst_buffer_new_allocate(nullptr, stride * static_cast<size_t>(height), nullptr);
    for (int y = 0; y < height; ++y)
      gst_buffer_fill(buffer, stride * static_cast<size_t>(y), frames[t].ptr(y),
                      static_cast<size_t>(width) * 3);
    GST_BUFFER_PTS(buffer) = gst_util_uint64_scale(t, GST_SECOND, 25);
    GST_BUFFER_DURATION(buffer) = GST_SECOND / 25;
    GstBuffer* out = gst_harness_push_and_pull(harness, buffer);
    EXPECT_NE(out, nullptr);
    if (out == nullptr) break;
    cv::Mat picture(height, width, CV_8UC3);
    for (int y = 0; y < height; ++y)
      gst_buffer_extract(out, stride * static_cast<size_t>(y), picture.ptr(y),
                         static_cast<size_t>(width) * 3);
    pictures.push_back(picture);
    gst_buffer_unref(out);
  }
  gst_harness_teardown(harness);
  return pictures;
}

bool equal(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF) == 0; }

TEST(Library, MasksAreThoseOfTheElement) {
  for (const auto& [method, name] : {std::pair{Method::robust, "robust"}, {Method::qdmd, "qdmd"}}) {
    const auto frames = street(161, 120, 70);
    const auto expected =
        of_element(frames, "output=mask window-size=40 method=" + std::string(name));
    ASSERT_EQ(expected.size(), frames.size());
    Options options;
    options.method = method;
    options.window_size = 40;
    // As in the place of one of OpenCV's.
    const cv::Ptr<cv::BackgroundSubtractor> subtractor =
        qdmd::library::create_background_subtractor(options);
    int foreground = 0;
    for (size_t t = 0; t < frames.size(); ++t) {
      cv::Mat mask, of_one;
      subtractor->apply(frames[t], mask);
      cv::extractChannel(expected[t], of_one, 1);
      ASSERT_EQ(mask.type(), CV_8UC1);
      ASSERT_TRUE(equal(mask, of_one)) << name << " frame " << t;
      foreground += cv::countNonZero(mask);
    }
    EXPECT_GT(foreground, 0);
  }
}

TEST(Library, BackgroundIsNearTheElements) {
  const auto frames = street(160, 120, 60);
  const auto expected = of_element(frames, "window-size=40");
  Options options;
  options.window_size = 40;
  BackgroundSubtractor subtractor(options);
  cv::Mat mask, background;
  subtractor.getBackgroundImage(background);
  EXPECT_TRUE(background.empty());
  for (const auto& frame : frames) subtractor.apply(frame, mask);
  subtractor.getBackgroundImage(background);
  ASSERT_EQ(background.size(), frames[0].size());
  // The picture is that of the frame with which the model came, L(t) that of the last one: what
  // one rounding and the light of a few frames make of it.
  EXPECT_LE(cv::norm(background, expected.back(), cv::NORM_L1) / (160 * 120 * 3), 1);
  EXPECT_GT(cv::norm(background, frames.back(), cv::NORM_INF), 50);
}

TEST(Library, PartsOfLargerPicturesAreSeen) {
  const auto frames = street(160, 120, 20);
  BackgroundSubtractor whole, part;
  for (const auto& frame : frames) {
    cv::Mat larger(140, 200, CV_8UC3, cv::Scalar(1, 2, 3)), mask, of_part;
    cv::Mat inside = larger(cv::Rect(11, 7, 160, 120));
    frame.copyTo(inside);
    whole.apply(frame, mask);
    part.apply(inside, of_part);
    ASSERT_TRUE(equal(mask, of_part));
  }
}

TEST(Library, LearningRateZeroKeepsTheBackground) {
  const auto frames = street(80, 60, 60);
  BackgroundSubtractor subtractor;
  cv::Mat mask, before, after;
  for (int t = 0; t < 30; ++t) subtractor.apply(frames[static_cast<size_t>(t)], mask);
  subtractor.apply(frames[30], mask, 0);
  subtractor.getBackgroundImage(before);
  for (size_t t = 31; t < frames.size(); ++t)
    subtractor.apply(cv::Mat(60, 80, CV_8UC3, cv::Scalar::all(9)), mask, 0);
  subtractor.getBackgroundImage(after);
  EXPECT_TRUE(equal(before, after));
}

TEST(Library, AnotherSizeBeginsAnew) {
  BackgroundSubtractor subtractor;
  cv::Mat mask, background;
  subtractor.apply(cv::Mat(3, 5, CV_8UC3, cv::Scalar::all(7)), mask);
  EXPECT_EQ(mask.size(), cv::Size(5, 3));
  subtractor.apply(cv::Mat(1, 1, CV_8UC3, cv::Scalar::all(9)), mask);
  EXPECT_EQ(mask.size(), cv::Size(1, 1));
  subtractor.getBackgroundImage(background);
  ASSERT_EQ(background.size(), cv::Size(1, 1));
  EXPECT_EQ(background.at<cv::Vec3b>(0, 0), cv::Vec3b(9, 9, 9));
}

TEST(Library, RefusesWhatItCannotDo) {
  const auto with = [](auto change) {
    Options options;
    change(options);
    return options;
  };
  for (const Options& options :
       {with([](Options& o) { o.window_size = 1; }), with([](Options& o) { o.hop_size = 101; }),
        with([](Options& o) { o.threads = -1; }), with([](Options& o) { o.absorb_frames = -1; }),
        with(
            [](Options& o) { o.foreground_threshold = std::numeric_limits<double>::quiet_NaN(); })})
    EXPECT_THROW(Separator{options}, std::invalid_argument);
  Options small;
  small.max_memory = 16 << 20;
  BackgroundSubtractor subtractor(small);
  cv::Mat mask;
  EXPECT_THROW(subtractor.apply(cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(9)), mask),
               std::invalid_argument);
  EXPECT_THROW(subtractor.apply(cv::Mat(4, 6, CV_8UC1, cv::Scalar::all(9)), mask), cv::Exception);
  // What fits is taken afterwards.
  subtractor.apply(cv::Mat(4, 6, CV_8UC3, cv::Scalar::all(9)), mask);
  EXPECT_EQ(mask.size(), cv::Size(6, 4));
}

// A red square crosses, stands, and goes out.
TEST(Objects, AreToldOfAndFollowed) {
  Options options;
  options.window_size = 40;
  options.follow_objects = true;
  Separator separator(options);
  std::vector<qdmd::library::ObjectEvent> told;
  separator.on_event([&](const qdmd::library::ObjectEvent& event) { told.push_back(event); });
  int id = 0;
  cv::Mat mask(90, 120, CV_8UC1);
  for (int t = 0; t < 340; ++t) {
    cv::Mat frame(90, 120, CV_8UC3);
    const int left = 2 * (std::min(t, 150) - 120 + std::max(0, t - 230)) - 16;
    for (int y = 0; y < 90; ++y)
      for (int x = 0; x < 120; ++x) {
        const bool inside = x >= left && x < left + 16 && y >= 40 && y < 56;
        const auto grey = static_cast<uint8_t>(60 + (7 * x + 3 * y) % 80);
        frame.at<cv::Vec3b>(y, x) = inside ? cv::Vec3b(20, 20, 250) : cv::Vec3b(grey, grey, grey);
      }
    separator.apply(frame.data, {120, 90, static_cast<ptrdiff_t>(frame.step), true}, mask.data,
                    static_cast<ptrdiff_t>(mask.step));
    if (t != 210) continue;
    const auto objects = separator.objects();
    ASSERT_EQ(1u, objects.size());
    id = objects[0].id;
    EXPECT_EQ(left, objects[0].x);
    EXPECT_EQ(16, objects[0].width);
    EXPECT_NEAR(90 / 25.0, objects[0].age, 0.2);
    EXPECT_NEAR(60 / 25.0, objects[0].standing, 0.2);
    EXPECT_TRUE(objects[0].appeared);
  }
  using qdmd::library::Event;
  std::vector<Event> of_things;
  for (const auto& event : told) {
    if (event.event == Event::motion_begins || event.event == Event::motion_ends) continue;
    of_things.push_back(event.event);
    EXPECT_EQ(id, event.object.id);
    EXPECT_FALSE(event.cut_off);
  }
  EXPECT_EQ((std::vector{Event::appeared, Event::stopped, Event::moved_on, Event::gone}),
            of_things);
  told.clear();
  separator.end();
  EXPECT_TRUE(told.empty() || told[0].event == Event::motion_ends) << "nothing is there any more";
}

TEST(Objects, AreNotFollowedWithoutBeingAsked) {
  Separator separator;
  int told = 0;
  separator.on_event([&](const qdmd::library::ObjectEvent&) { ++told; });
  for (const cv::Mat& frame : street(160, 120, 60)) {
    cv::Mat mask(frame.size(), CV_8UC1);
    separator.apply(frame.data, {160, 120, static_cast<ptrdiff_t>(frame.step), true}, mask.data,
                    static_cast<ptrdiff_t>(mask.step));
  }
  EXPECT_EQ(0, told);
  EXPECT_TRUE(separator.objects().empty());
  Options options;
  options.frames_per_second = 0;
  EXPECT_THROW(Separator{options}, std::invalid_argument);
}

}  // namespace

int main(int argc, char** argv) {
  gst_init(&argc, &argv);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
