// SPDX-License-Identifier: LGPL-2.1-or-later
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
using qdmd::library::Layout;
using qdmd::library::Method;
using qdmd::library::Options;
using qdmd::library::Output;
using qdmd::library::Pixels;
using qdmd::library::Region;
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
std::vector<cv::Mat> of_element(const std::vector<cv::Mat>& frames, const std::string& settings,
                                const std::string& format = "BGR") {
  const int width = frames[0].cols, height = frames[0].rows;
  GstHarness* harness = gst_harness_new_parse(("qdmdbackground " + settings).c_str());
  const std::string caps = "video/x-raw,format=" + format +
                           ",framerate=25/1,width=" + std::to_string(width) +
                           ",height=" + std::to_string(height);
  gst_harness_set_src_caps_str(harness, caps.c_str());
  const size_t row = static_cast<size_t>(width) * frames[0].elemSize(), stride = (row + 3) / 4 * 4;
  for (size_t t = 0; t < frames.size(); ++t) {
    GstBuffer* buffer =
        gst_buffer_new_allocate(nullptr, stride * static_cast<size_t>(height), nullptr);
    for (int y = 0; y < height; ++y)
      gst_buffer_fill(buffer, stride * static_cast<size_t>(y), frames[t].ptr(y), row);
    GST_BUFFER_PTS(buffer) = gst_util_uint64_scale(t, GST_SECOND, 25);
    GST_BUFFER_DURATION(buffer) = GST_SECOND / 25;
    EXPECT_EQ(gst_harness_push(harness, buffer), GST_FLOW_OK);
  }
  gst_harness_push_event(harness, gst_event_new_eos());
  std::vector<cv::Mat> pictures;
  while (GstBuffer* out = gst_harness_try_pull(harness)) {
    cv::Mat picture(height, width, frames[0].type());
    for (int y = 0; y < height; ++y)
      gst_buffer_extract(out, stride * static_cast<size_t>(y), picture.ptr(y), row);
    pictures.push_back(picture);
    gst_buffer_unref(out);
  }
  gst_harness_teardown(harness);
  return pictures;
}

cv::Mat channel_of(const cv::Mat& picture, int channel) {
  cv::Mat one;
  cv::extractChannel(picture, one, channel);
  return one;
}

Layout layout_of(const cv::Mat& picture) {
  return {picture.cols, picture.rows, static_cast<ptrdiff_t>(picture.step),
          picture.channels() == 1 ? Pixels::grey : Pixels::bgr, picture.depth() == CV_16U ? 16 : 8};
}

bool equal(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF) == 0; }

TEST(Library, MasksAreThoseOfTheElement) {
  for (const auto& [method, name] : {std::pair{Method::robust, "robust"}, {Method::qdmd, "qdmd"}}) {
    const auto frames = street(161, 120, 70);
    const auto expected =
        of_element(frames, "mode=live output=mask window-size=40 method=" + std::string(name));
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
  const auto expected = of_element(frames, "mode=live window-size=40");
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
  for (const cv::Mat& frame :
       {cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(9)), cv::Mat(4, 6, CV_8UC4, cv::Scalar::all(9)),
        cv::Mat(4, 6, CV_64FC1, cv::Scalar::all(9)), cv::Mat()})
    EXPECT_THROW(subtractor.apply(frame, mask), cv::Exception);
  EXPECT_THROW(BackgroundSubtractor(with([](Options& o) { o.window_size = 1; })), cv::Exception);
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
    separator.apply(frame.data, layout_of(frame), mask.data, static_cast<ptrdiff_t>(mask.step));
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
    separator.apply(frame.data, layout_of(frame), mask.data, static_cast<ptrdiff_t>(mask.step));
  }
  EXPECT_EQ(0, told);
  EXPECT_TRUE(separator.objects().empty());
  Options options;
  options.frame_rate = 0;
  EXPECT_THROW(Separator{options}, std::invalid_argument);
}

// A red square on grey comes in at frame 120, and stands from frame 150 on.
cv::Mat square(int t) {
  cv::Mat frame(90, 120, CV_8UC3);
  for (int y = 0; y < 90; ++y)
    for (int x = 0; x < 120; ++x)
      frame.at<cv::Vec3b>(y, x) = cv::Vec3b::all(static_cast<uint8_t>(60 + (7 * x + 3 * y) % 80));
  const int left = 2 * (std::min(t, 150) - 120) - 16;
  frame(cv::Rect(left, 40, 16, 16) & cv::Rect(0, 0, 120, 90)).setTo(cv::Scalar(20, 20, 250));
  return frame;
}

// Frames leave with pictures and without, at once and later.
TEST(Objects, AreFollowedInEachWayThatFramesLeave) {
  using qdmd::library::Event;
  for (const bool batch : {false, true})
    for (const int pictures : {0, 1, 3}) {
      Options options;
      options.window_size = 40;
      options.follow_objects = true;
      if (batch) options.mode = qdmd::library::Mode::batch;
      Separator separator(options);
      std::vector<std::pair<Event, uint64_t>> told;
      std::vector<uint64_t> cut_off;
      separator.on_event([&](const qdmd::library::ObjectEvent& event) {
        if (event.object.id == 0) return;
        told.emplace_back(event.event, event.frame);
        if (event.cut_off) cut_off.push_back(event.frame);
      });
      size_t left = 0;
      const auto take = [&] {
        for (; separator.ready(); separator.skip(), ++left) {
          cv::Mat picture(90, 120, CV_8UC3);
          for (int k = 0; k < pictures; ++k)
            separator.write(Output::background, layout_of(picture), picture.data);
        }
      };
      for (int t = 0; t < 240; ++t) {
        const cv::Mat frame = square(t);
        separator.push(frame.data, layout_of(frame));
        take();
      }
      separator.drain();
      take();
      EXPECT_EQ(left, 240u);
      ASSERT_EQ(told.size(), 2u) << batch << pictures;
      EXPECT_EQ(told[0].first, Event::appeared);
      EXPECT_NEAR(static_cast<double>(told[0].second), 126, 8);
      EXPECT_EQ(told[1].first, Event::stopped);
      EXPECT_NEAR(static_cast<double>(told[1].second), 200, 8);
      ASSERT_EQ(separator.objects().size(), 1u);
      EXPECT_TRUE(cut_off.empty());
      // Each of these ends what is there, once.
      const cv::Mat small(45, 60, CV_8UC3, cv::Scalar::all(90));
      if (pictures == 0) separator.end();
      if (pictures == 1) separator.reset();
      if (pictures == 3) separator.push(small.data, layout_of(small));
      EXPECT_EQ(cut_off, (std::vector<uint64_t>{240})) << batch << pictures;
      EXPECT_TRUE(separator.objects().empty());
      separator.end();
      EXPECT_EQ(cut_off.size(), 1u);
    }
}

// Nothing that was refused is seen in a background, and nothing is forgotten.
TEST(Library, ARefusedFrameLeavesTheBackground) {
  Options small;
  small.max_memory = 16 << 20;
  BackgroundSubtractor subtractor(small);
  cv::Mat mask, background(480, 640, CV_8UC3, cv::Scalar::all(77));
  const cv::Mat big(480, 640, CV_8UC3, cv::Scalar::all(9));
  EXPECT_THROW(subtractor.apply(big, mask), cv::Exception);
  EXPECT_TRUE(mask.empty());
  subtractor.getBackgroundImage(background);
  EXPECT_TRUE(background.empty());
  const auto frames = street(48, 36, 12);
  for (size_t t = 0; t < 10; ++t) subtractor.apply(frames[t], mask);
  BackgroundSubtractor other(small);
  cv::Mat of_other;
  for (size_t t = 0; t < 10; ++t) other.apply(frames[t], of_other);
  EXPECT_THROW(subtractor.apply(big, mask), cv::Exception);
  EXPECT_THROW(subtractor.apply(frames[10], cv::noArray()), cv::Exception);
  other.apply(frames[10], of_other);
  subtractor.apply(frames[11], mask);
  other.apply(frames[11], of_other);
  EXPECT_TRUE(equal(mask, of_other));
  subtractor.getBackgroundImage(mask);
  other.getBackgroundImage(of_other);
  EXPECT_TRUE(equal(mask, of_other));
}

TEST(Library, GreyFramesAreThoseOfTheElement) {
  std::vector<cv::Mat> frames;
  for (const cv::Mat& frame : street(161, 120, 40)) frames.push_back(channel_of(frame, 1));
  const auto expected = of_element(frames, "mode=live output=mask window-size=20", "GRAY8");
  ASSERT_EQ(expected.size(), frames.size());
  Options options;
  options.window_size = 20;
  BackgroundSubtractor subtractor(options);
  cv::Mat mask;
  for (size_t t = 0; t < frames.size(); ++t) {
    subtractor.apply(frames[t], mask);
    ASSERT_TRUE(equal(mask, expected[t])) << t;
  }
  EXPECT_GT(cv::countNonZero(mask), 0);
  subtractor.getBackgroundImage(mask);
  EXPECT_EQ(mask.type(), CV_8UC1);
}

TEST(Library, FloatFramesAreThoseOfWholeLevels) {
  const auto frames = street(80, 60, 40);
  for (const bool grey : {false, true}) {
    BackgroundSubtractor whole, real;
    cv::Mat of_whole, of_real;
    for (const cv::Mat& frame : frames) {
      const cv::Mat levels = grey ? channel_of(frame, 1) : frame;
      cv::Mat numbers;
      levels.convertTo(numbers, CV_32F, 1, 0.4);
      whole.apply(levels, of_whole);
      real.apply(numbers, of_real);
      ASSERT_TRUE(equal(of_whole, of_real));
    }
    EXPECT_GT(cv::countNonZero(of_whole), 0);
    whole.getBackgroundImage(of_whole);
    real.getBackgroundImage(of_real);
    ASSERT_EQ(of_real.type(), grey ? CV_32FC1 : CV_32FC3);
    of_real.convertTo(of_real, CV_8U);
    EXPECT_TRUE(equal(of_whole, of_real));
  }
}

TEST(Library, FramesOf16BitsAreThoseOfTheElement) {
  std::vector<cv::Mat> frames;
  for (const cv::Mat& frame : street(80, 60, 30)) {
    frames.push_back(channel_of(frame, 1));
    frames.back().convertTo(frames.back(), CV_16U, 256, 77);
  }
  const auto expected = of_element(frames, "mode=live window-size=20 output=mask", "GRAY16_LE");
  ASSERT_EQ(expected.size(), frames.size());
  Options options;
  options.window_size = 20;
  BackgroundSubtractor subtractor(options);
  cv::Mat mask, background;
  for (size_t t = 0; t < frames.size(); ++t) {
    subtractor.apply(frames[t], mask);
    ASSERT_TRUE(equal(mask > 0, expected[t] > 0)) << t;
  }
  EXPECT_GT(cv::countNonZero(mask), 0);
  subtractor.getBackgroundImage(background);
  ASSERT_EQ(background.type(), CV_16UC1);
  double most = 0;
  cv::minMaxLoc(background, nullptr, &most);
  EXPECT_GT(most, 256);
}

TEST(Library, LearningRateOneBeginsAnew) {
  const auto frames = street(80, 60, 40);
  for (const double rate : {1.0, 2.0}) {
    BackgroundSubtractor subtractor, fresh;
    cv::Mat mask, of_fresh;
    for (size_t t = 0; t < 20; ++t) subtractor.apply(frames[t], mask);
    const cv::Mat other = cv::Scalar::all(255) - frames[20];
    subtractor.apply(other, mask, rate);
    fresh.apply(other, of_fresh);
    subtractor.getBackgroundImage(mask);
    EXPECT_TRUE(equal(mask, other));
    for (size_t t = 20; t < frames.size(); ++t) {
      subtractor.apply(frames[t], mask);
      fresh.apply(frames[t], of_fresh);
      ASSERT_TRUE(equal(mask, of_fresh)) << t;
    }
  }
}

TEST(Library, TheFirstMaskIsEmpty) {
  BackgroundSubtractor subtractor;
  cv::Mat mask;
  subtractor.apply(street(80, 60, 1)[0], mask);
  EXPECT_EQ(cv::countNonZero(mask), 0);
}

TEST(Library, KnownForegroundIsForegroundAndNotLearnt) {
  const auto frames = street(80, 60, 60);
  const cv::Rect place(10, 20, 30, 20);
  cv::Mat known(60, 80, CV_8UC1, cv::Scalar::all(0)), mask, background;
  known(place).setTo(1);
  Options options;
  options.absorb_frames = 5;
  BackgroundSubtractor subtractor(options), plain(options);
  for (size_t t = 0; t < 30; ++t) {
    subtractor.apply(frames[t], mask);
    plain.apply(frames[t], mask);
  }
  for (size_t t = 30; t < 60; ++t) {
    cv::Mat frame = frames[t].clone();
    frame(place).setTo(cv::Scalar(250, 10, 250));
    subtractor.apply(frame, known, mask);
    EXPECT_EQ(cv::countNonZero(mask(place)), place.area());
    plain.apply(frame, cv::noArray(), mask);
  }
  const cv::Scalar thing(250, 10, 250);
  const auto distance = [&](BackgroundSubtractor& of) {
    of.getBackgroundImage(background);
    return cv::norm(background(place), cv::Mat(place.size(), CV_8UC3, thing), cv::NORM_L1) /
           (3 * place.area());
  };
  EXPECT_GT(distance(subtractor), 50);
  EXPECT_LT(distance(plain), 5);  // what it is like where it is learnt
  EXPECT_THROW(subtractor.apply(frames[0], cv::Mat(3, 3, CV_8UC1, cv::Scalar::all(0)), mask),
               cv::Exception);
}

TEST(Library, WhatIsWrittenIsRead) {
  const auto frames = street(80, 60, 60);
  Options options;
  options.window_size = 30;
  options.foreground_threshold = 40.5;
  options.max_memory = uint64_t{5} << 30;
  options.shadows = qdmd::library::Shadows::marked;
  options.ignore = {{1, 2, 3, 4}};
  const cv::Ptr<BackgroundSubtractor> subtractor = cv::makePtr<BackgroundSubtractor>(options);
  const auto written = [](const cv::Algorithm& of) {
    cv::FileStorage file(".yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
    file << "it"
         << "{";
    of.write(file);
    file << "}";
    return file.releaseAndGetString();
  };
  const auto read = [](const std::string& text, cv::Algorithm* to) {
    const cv::FileStorage file(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    to->read(file["it"]);
  };
  cv::Mat mask, before, after;
  for (const cv::Mat& frame : frames) subtractor->apply(frame, mask);
  const std::string text = written(*subtractor);
  BackgroundSubtractor other;
  read(text, &other);
  subtractor->getBackgroundImage(before);
  other.getBackgroundImage(after);
  ASSERT_FALSE(after.empty());
  EXPECT_TRUE(equal(before, after));
  EXPECT_EQ(written(other), text);
  // It knows the street, and what stands in it now.
  cv::Mat changed = frames.back().clone();
  changed(cv::Rect(20, 20, 30, 30)).setTo(cv::Scalar(250, 10, 250));
  other.apply(changed, mask);
  EXPECT_GT(cv::countNonZero(mask(cv::Rect(20, 20, 30, 30))), 800);
  // An empty one has no background.
  BackgroundSubtractor fresh, empty;
  read(written(fresh), &empty);
  empty.getBackgroundImage(after);
  EXPECT_TRUE(after.empty());
  // What is not of this class, or damaged, changes nothing.
  for (const std::string& wrong : {std::string("%YAML:1.0\n---\nit:\n  name: other\n"),
                                   "%YAML:1.0\n---\nit:\n  name: " + other.getDefaultName() +
                                       "\n  learnt: !!opencv-matrix\n    rows: 1\n    cols: 3\n"
                                       "    dt: u\n    data: [ 1, 2, 3 ]\n"})
    EXPECT_THROW(read(wrong, subtractor), cv::Exception);
  subtractor->getBackgroundImage(after);
  EXPECT_TRUE(equal(before, after));
}

// ---- Without OpenCV's interface -----------------------------------------------------------------

TEST(Separator, EachPictureIsTheElements) {
  const auto frames = street(161, 120, 45);
  Options options;
  options.window_size = 20;
  options.shadows = qdmd::library::Shadows::marked;
  options.mask_softness = 3;
  options.ignore = {{0, 0, 40, 120}, {150, 100, 50, 50}};
  const std::string settings =
      " window-size=20 shadows=marked mask-softness=3 "
      "ignore=\"<<0,0,40,120>,<150,100,50,50>>\" ";
  const std::pair<Output, std::string> outputs[] = {{Output::background, "background"},
                                                    {Output::foreground, "foreground"},
                                                    {Output::mask, "mask"},
                                                    {Output::cutout, "cutout"}};
  for (const bool batch : {false, true}) {
    options.mode = batch ? qdmd::library::Mode::batch : qdmd::library::Mode::live;
    for (const auto& [output, name] : outputs) {
      const auto expected = of_element(
          frames, (batch ? "mode=batch output=" : "mode=live output=") + name + settings);
      ASSERT_EQ(expected.size(), frames.size());
      Separator separator(options);
      size_t left = 0;
      const auto take = [&] {
        for (; separator.ready(); separator.skip(), ++left) {
          cv::Mat picture(120, 161, CV_8UC3, cv::Scalar::all(77));
          separator.write(output, layout_of(picture), picture.data);
          ASSERT_TRUE(equal(picture, expected[left])) << name << " " << batch << " frame " << left;
        }
      };
      for (const cv::Mat& frame : frames) {
        separator.push(frame.data, layout_of(frame));
        take();
      }
      separator.drain();
      take();
      EXPECT_EQ(left, frames.size());
    }
  }
}

TEST(Separator, MaskScaleIsTheElements) {
  const auto frames = street(161, 120, 30);
  Options options;
  options.window_size = 20;
  options.mask_scale = 2;
  const auto expected = of_element(frames, "mode=live output=mask window-size=20 mask-scale=2 ");
  ASSERT_EQ(expected.size(), frames.size());
  Separator separator(options);
  cv::Mat mask(120, 161, CV_8UC1), grey;
  for (size_t t = 0; t < frames.size(); ++t) {
    separator.apply(frames[t].data, layout_of(frames[t]), mask.data, 161);
    cv::extractChannel(expected[t], grey, 0);
    ASSERT_TRUE(equal(mask, grey)) << t;
  }
  // What was learnt has fewer pixels, and goes on with frames of this size.
  const auto bytes = separator.save();
  Separator next(options);
  next.load(bytes.data(), bytes.size());
  next.apply(frames[29].data, layout_of(frames[29]), mask.data, 161);
  cv::Mat before(120, 161, CV_8UC3), after = before.clone();
  ASSERT_TRUE(separator.background(layout_of(before), before.data));
  ASSERT_TRUE(next.background(layout_of(after), after.data));
  EXPECT_LT(cv::norm(before, after, cv::NORM_L1), 161 * 120 * 3);
  options.mask_scale = 1;
  Separator whole(options);
  whole.load(bytes.data(), bytes.size());
  EXPECT_THROW(whole.apply(frames[29].data, layout_of(frames[29]), mask.data, 161),
               std::invalid_argument);
  options.mask_scale = 3;
  EXPECT_THROW(Separator{options}, std::invalid_argument);
}

// Who asks for masks alone has those of large frames from fewer pixels.
TEST(Separator, MaskScaleIsChosenByTheFirstCall) {
  constexpr int kWidth = 2000, kHeight = 1251;
  cv::Mat frame(kHeight, kWidth, CV_8UC1), mask = frame.clone(), background = frame.clone();
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      frame.at<uint8_t>(y, x) = static_cast<uint8_t>(60 + (37 * x + 11 * y) % 97);
  Options options;
  options.window_size = 2;
  for (const bool masks_alone : {true, false}) {
    Separator separator(options);
    for (int t = 0; t < 3; ++t) {
      if (masks_alone) {
        separator.apply(frame.data, layout_of(frame), mask.data, kWidth);
      } else {
        separator.push(frame.data, layout_of(frame));
        separator.skip();
      }
    }
    ASSERT_TRUE(separator.background(layout_of(background), background.data));
    EXPECT_EQ(equal(background, frame), !masks_alone);
  }
}

TEST(Separator, RegionsAreAroundWhatMoves) {
  Separator separator;
  cv::Mat frame(120, 160, CV_8UC3, cv::Scalar::all(100));
  std::vector<Region> regions;
  for (int t = 0; t < 30; ++t) {
    cv::Mat now = frame.clone();
    if (t >= 20) now(cv::Rect(30 + t, 40, 24, 18)).setTo(cv::Scalar(10, 250, 10));
    separator.push(now.data, layout_of(now));
    ASSERT_TRUE(separator.ready());
    regions = separator.regions();
    EXPECT_EQ(regions.size(), t >= 20 ? 1u : 0u) << t;
    EXPECT_TRUE(separator.regions(5000).empty());
    separator.skip();
  }
  ASSERT_EQ(regions.size(), 1u);
  EXPECT_NEAR(regions[0].x, 59, 2);
  EXPECT_NEAR(regions[0].y, 40, 2);
  EXPECT_NEAR(regions[0].width, 24, 4);
  EXPECT_NEAR(regions[0].height, 18, 4);
  EXPECT_GT(regions[0].mean_residual, 100);
}

TEST(Separator, IgnoreHoldsFromTheNextFrame) {
  Separator separator;
  const cv::Mat still(60, 80, CV_8UC3, cv::Scalar::all(100));
  cv::Mat moved = still.clone(), mask(60, 80, CV_8UC1);
  moved(cv::Rect(20, 20, 20, 20)).setTo(cv::Scalar(10, 250, 10));
  for (int t = 0; t < 20; ++t) separator.apply(still.data, layout_of(still), mask.data, 80);
  separator.apply(moved.data, layout_of(moved), mask.data, 80);
  EXPECT_GT(cv::countNonZero(mask), 300);
  separator.ignore({{10, 10, 40, 40}});
  separator.apply(moved.data, layout_of(moved), mask.data, 80);
  EXPECT_EQ(cv::countNonZero(mask), 0);
}

TEST(Separator, SavesAndLoads) {
  const std::string file = testing::TempDir() + "library_test.qdmd";
  const auto frames = street(80, 60, 50);
  Separator separator;
  EXPECT_TRUE(separator.save().empty());
  EXPECT_THROW(separator.save(file), std::invalid_argument);
  EXPECT_THROW(separator.load(testing::TempDir() + "not there"), std::runtime_error);
  cv::Mat mask(60, 80, CV_8UC1), before(60, 80, CV_8UC3), after(60, 80, CV_8UC3);
  for (const cv::Mat& frame : frames) separator.apply(frame.data, layout_of(frame), mask.data, 80);
  separator.save(file);
  ASSERT_TRUE(separator.background(layout_of(before), before.data));
  // Before the first frame, and while frames come.
  Separator fresh, running;
  running.apply(cv::Mat(60, 80, CV_8UC3, cv::Scalar::all(9)).data, layout_of(before), mask.data,
                80);
  for (Separator* other : {&fresh, &running}) {
    other->load(file);
    ASSERT_TRUE(other->background(layout_of(after), after.data));
    EXPECT_TRUE(equal(before, after));
  }
  // Frames of another size have another background: said once.
  const cv::Mat small(30, 40, CV_8UC3, cv::Scalar::all(50));
  EXPECT_THROW(fresh.apply(small.data, layout_of(small), mask.data, 80), std::invalid_argument);
  fresh.apply(small.data, layout_of(small), mask.data, 80);
  EXPECT_THROW(fresh.load(file), std::invalid_argument);
  // The element takes it, and has it from the first frame on.
  const auto element =
      of_element({frames.back(), frames.back()}, "mode=live window-size=100 load-location=" + file);
  ASSERT_EQ(element.size(), 2u);
  EXPECT_LE(cv::norm(element[0], before, cv::NORM_L1) / (80 * 60 * 3), 1.5);
  EXPECT_GT(cv::norm(element[0], frames.back(), cv::NORM_INF), 50);
  std::remove(file.c_str());
}

TEST(Separator, RefusesLayoutsThatHoldNoPicture) {
  Separator separator;
  std::vector<uint8_t> picture(3 * 8 * 6), mask(8 * 6);
  const Layout good = {8, 6, 24, Pixels::rgb, 8};
  const auto with = [&](auto change) {
    Layout layout = good;
    change(layout);
    return layout;
  };
  for (const Layout& bad :
       {with([](Layout& l) { l.row_bytes = 23; }), with([](Layout& l) { l.row_bytes = -23; }),
        with([](Layout& l) { l.row_bytes = 0; }), with([](Layout& l) { l.depth = 16; }),
        with([](Layout& l) { l.pixels = Pixels::rgba; }), with([](Layout& l) { l.width = 0; }),
        with([](Layout& l) { l.height = -1; }), with([](Layout& l) { l.depth = 7; })}) {
    EXPECT_THROW(separator.push(picture.data(), bad), std::invalid_argument);
    EXPECT_THROW(separator.background(bad, picture.data()), std::invalid_argument);
  }
  EXPECT_THROW(separator.push(nullptr, good), std::invalid_argument);
  EXPECT_THROW(separator.apply(picture.data(), good, mask.data(), 7), std::invalid_argument);
  EXPECT_THROW(separator.skip(), std::invalid_argument);
  EXPECT_THROW(separator.regions(), std::invalid_argument);
  EXPECT_FALSE(separator.ready());
  // Bottom up: the first row is the last one in memory.
  separator.apply(picture.data() + 5 * 24, with([](Layout& l) { l.row_bytes = -24; }),
                  mask.data() + 5 * 8, -8);
  // Also where there is no next row.
  EXPECT_THROW(separator.apply(picture.data(), {8, 1, 23, Pixels::rgb, 8}, mask.data(), 8),
               std::invalid_argument);
  separator.push(picture.data(), good);
  EXPECT_THROW(separator.push(picture.data(), good), std::invalid_argument);
  EXPECT_THROW(separator.write(Output::background, {8, 6, 8, Pixels::grey, 8}, picture.data()),
               std::invalid_argument);
  EXPECT_THROW(separator.write(Output::mask, {7, 6, 8, Pixels::grey, 8}, picture.data()),
               std::invalid_argument);
  Options options;
  options.mode = qdmd::library::Mode::batch;
  Separator batch(options);
  EXPECT_THROW(batch.apply(picture.data(), good, mask.data(), 8), std::invalid_argument);
  options.ignore = {{1, 1, 0, 5}};
  EXPECT_THROW(Separator{options}, std::invalid_argument);
}

}  // namespace

int main(int argc, char** argv) {
  gst_init(&argc, &argv);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
