// SPDX-License-Identifier: LGPL-2.1-or-later
// Masks of people in recorded sequences whose camera has no colour, or loses it.
#include <map>
#include <opencv2/imgcodecs.hpp>

#include "tests/core/engine_util.h"
#include "tests/evaluation/evaluate_util.h"

namespace qdmd::test {
namespace {

int number_of(const fs::path& file) {
  std::string digits;
  for (const char c : file.stem().string())
    if (c >= '0' && c <= '9') digits += c;
  return std::stoi(digits);
}

std::map<int, fs::path> numbered(const fs::path& folder) {
  std::map<int, fs::path> files;
  for (const auto& file : fs::directory_iterator(folder)) files[number_of(file)] = file;
  return files;
}

// The frame without colour, times gain.
cv::Mat grey_of(const cv::Mat& frame, double gain) {
  cv::Mat grey(frame.size(), CV_8UC3);
  for (int y = 0; y < frame.rows; ++y)
    for (int x = 0; x < frame.cols; ++x) {
      const auto& bgr = frame.at<cv::Vec3b>(y, x);
      const double luma = gain * (0.114 * bgr[0] + 0.587 * bgr[1] + 0.299 * bgr[2]);
      grey.at<cv::Vec3b>(y, x) = cv::Vec3b::all(cv::saturate_cast<uint8_t>(luma));
    }
  return grey;
}

// F of the default's masks over all frames that have a true one, from frame `goes` on without
// colour and `gain` times as bright.
double f_without_colour(const fs::path& sequence, size_t goes, double gain) {
  const auto inputs = numbered(sequence / "input"), truths = numbered(sequence / "gt" / "masks");
  Engine engine;
  std::vector<int> numbers;
  size_t left = 0;
  double both = 0, sum = 0;
  int width = 0, height = 0;
  const auto take = [&] {
    for (; engine.next(); ++left) {
      PackedPicture mask(width, height);
      engine.next()->pop(Output::mask, mask.out());
      const auto file = truths.find(numbers[left]);
      if (file == truths.end()) continue;
      const cv::Mat truth = cv::imread(file->second.string(), cv::IMREAD_GRAYSCALE);
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
          const uint8_t label = truth.at<uint8_t>(y, x);
          if (label == 85 || label == 170) continue;
          const bool white = mask.at(0, static_cast<size_t>(y * width + x)) > 127;
          both += white && label == 255;
          sum += white + (label == 255);
        }
    }
  };
  for (const auto& [number, file] : inputs) {
    const cv::Mat frame = cv::imread(file.string());
    const cv::Mat shown = numbers.size() < goes ? frame : grey_of(frame, gain);
    if (numbers.empty()) {
      width = frame.cols, height = frame.rows;
      const Status status = engine.configure({}, width, height);
      EXPECT_TRUE(status.ok()) << status.message;
    }
    numbers.push_back(number);
    PackedPicture picture(width, height);
    for (size_t p = 0; p < picture.pixels(); ++p)
      for (size_t c = 0; c < 3; ++c) picture.at(c, p) = shown.data[3 * p + 2 - c];
    EXPECT_TRUE(engine.push(picture.in()).ok());
    take();
  }
  EXPECT_TRUE(engine.drain().ok());
  take();
  EXPECT_EQ(left, inputs.size());
  return sum > 0 ? 2 * both / sum : 0;
}

// QDMD_DATA is the folder with SBI and CDnet; without it these tests are skipped.
class Recorded : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("QDMD_DATA");
    if (!data || !*data) GTEST_SKIP() << "QDMD_DATA is not set";
    data_ = data;
  }
  fs::path data_;
};

// Somebody stands and reads: what rests of him for a moment has not left. Measured: 0.936.
TEST_F(Recorded, WhoStandsIsKeptWithoutColour) {
  EXPECT_GT(f_without_colour(data_ / "CDnet/office", 0, 1), 0.9);
}

// He stands there while the camera switches to infra-red, early and late in a window.
TEST_F(Recorded, WhoStandsIsKeptWhereColourGoes) {
  for (const size_t goes : {210, 225, 260, 290})
    EXPECT_GT(f_without_colour(data_ / "CDnet/office", goes, 1.15), 0.9) << goes;
}

// Two walk while the camera switches to infra-red. Measured: 0.899.
TEST_F(Recorded, MasksGoOnWhereColourGoes) {
  EXPECT_GT(f_without_colour(data_ / "SBI/HallAndMonitor", 148, 1.15), 0.85);
}

}  // namespace
}  // namespace qdmd::test
