// SPDX-License-Identifier: LGPL-2.1-or-later
// scene_sequence.sh: frames after a real encoder, in step with the truth of the scene before it.
#include <gst/gst.h>

#include <cmath>

#include "core/scene/scene.h"
#include "tests/evaluation/evaluate_util.h"

namespace qdmd::test {
namespace {

constexpr int kFrames = 61;
constexpr const char* kScene = "shadow,mirror,noise=1";

// 0: it worked.
int write_scene(const Folder& folder, const std::string& rate, const std::string& scene = kScene) {
  const std::string line = std::string(std::getenv("QDMD_SCENE_SEQUENCE")) + " " + folder.string() +
                           " " + scene + " " + rate + " " + std::to_string(kFrames);
  return std::system(line.c_str());
}

size_t files_in(const fs::path& folder) {
  return static_cast<size_t>(
      std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

cv::Mat picture_of(const scene::Picture& rgb) {
  cv::Mat picture(rgb.height, rgb.width, CV_8UC3);
  for (size_t i = 0; i < rgb.samples.size(); ++i)
    picture.data[i - i % 3 + 2 - i % 3] = rgb.samples[i];
  return picture;
}

double difference(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_L1) / static_cast<double>(3 * a.total());
}

TEST(SceneSequence, FramesAreEncodedAndInStepWithTheTruthOfTheScene) {
  const Folder folder, whole;
  ASSERT_EQ(write_scene(folder, "60"), 0);
  ASSERT_EQ(write_scene(whole, "0"), 0);
  for (const char* part : {"input", "groundtruth"})
    ASSERT_EQ(files_in(folder / part), size_t{kFrames});

  scene::Scene scene(scene::SceneOptions{}, kScene);
  std::vector<cv::Mat> frames;
  for (int k = 0; k < kFrames; ++k) {
    scene.render(k, scene::kFrame | scene::kLabels | scene::kTruth);
    frames.push_back(picture_of(scene.frame()));
    const cv::Mat labels =
        cv::imread((folder / "groundtruth" / numbered("gt", k + 1)).string(), cv::IMREAD_GRAYSCALE);
    ASSERT_EQ(labels.total(), scene.labels().samples.size());
    ASSERT_TRUE(
        std::equal(labels.begin<uint8_t>(), labels.end<uint8_t>(), scene.labels().samples.begin()))
        << k;
    if (k != kFrames / 2) continue;
    const cv::Mat background = cv::imread((folder / "gt/GT_background.png").string());
    EXPECT_EQ(difference(background, picture_of(scene.background())), 0);
  }
  double lost = 0;
  cv::Scalar shift;
  for (int k = 0; k < kFrames; ++k) {
    const auto input = [&](const Folder& from) {
      return cv::imread((from / "input" / numbered("in", k + 1)).string());
    };
    const cv::Mat coded = input(folder), &frame = frames[static_cast<size_t>(k)];
    ASSERT_EQ(difference(input(whole), frame), 0) << k;
    ASSERT_EQ(coded.size(), frame.size());
    const double own = difference(coded, frame);
    lost += own / kFrames;
    shift += (cv::mean(coded) - cv::mean(frame)) * (1.0 / kFrames);
    // The mover is in view by then, and goes on by a pixel or two in each frame.
    for (int other = k - 4; k >= 15 && other <= k + 4 && other < kFrames; other += 8) {
      ASSERT_LT(own, difference(coded, frames[static_cast<size_t>(other)])) << k << ' ' << other;
    }
  }
  // Measured 4.4, and 1.7 with bits in plenty: I420 has a quarter of the colours.
  EXPECT_GT(lost, 2.5);
  EXPECT_LT(lost, 8);
  // Nothing becomes darker or of another colour as a whole: measured 1.2 at most, and 4.6 where
  // videoconvert takes its quick way.
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(shift[c], 0, 1.6) << c;
}

TEST(SceneSequence, IsScored) {
  const Folder folder;
  ASSERT_EQ(write_scene(folder, "100", "basic"), 0);
  const Result result =
      evaluate({"--dataset", folder.string(), "--methods", "mog2,median", "--format", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto table = result.json();
  ASSERT_EQ(table.size(), 2u);
  for (const auto& row : table) {
    EXPECT_EQ(row.at("frames"), kFrames);
    EXPECT_LT(row.at("AGE").get<double>(), 10) << row;
  }
  EXPECT_GT(table[0].at("F").get<double>(), 0.3) << table;
}

TEST(SceneSequence, ASceneThatEndsBeforeHasItsOwnMiddle) {
  const Folder folder;
  ASSERT_EQ(write_scene(folder, "100", "length=5,fade=1:duration=0.2"), 0);
  ASSERT_EQ(files_in(folder / "input"), 5u);
  scene::Scene scene(scene::SceneOptions{}, "length=5,fade=1:duration=0.2");
  scene.render(2, scene::kTruth);
  EXPECT_EQ(difference(cv::imread((folder / "gt/GT_background.png").string()),
                       picture_of(scene.background())),
            0);
}

}  // namespace
}  // namespace qdmd::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  gst_init(&argc, &argv);
  for (const char* name : {"x264enc", "pngenc"}) {
    GstElementFactory* factory = gst_element_factory_find(name);
    if (!factory) {
      std::printf("there is no %s\n", name);
      return 77;
    }
    gst_object_unref(factory);
  }
  GstCaps* caps = gst_caps_from_string("video/x-h264");
  GList* all =
      gst_element_factory_list_get_elements(GST_ELEMENT_FACTORY_TYPE_DECODER, GST_RANK_MARGINAL);
  GList* decoders = gst_element_factory_list_filter(all, caps, GST_PAD_SINK, FALSE);
  const bool decoded = decoders != nullptr;
  gst_plugin_feature_list_free(decoders);
  gst_plugin_feature_list_free(all);
  gst_caps_unref(caps);
  if (!decoded) {
    std::printf("nothing decodes H.264\n");
    return 77;
  }
  return RUN_ALL_TESTS();
}
