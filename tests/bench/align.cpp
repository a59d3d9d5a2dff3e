// SPDX-License-Identifier: LGPL-2.1-or-later
// What it costs to follow a camera: its motion, beside OpenCV's estimates, and pictures moved.
#include <benchmark/benchmark.h>

#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <string>
#include <vector>

#include "core/align/motion.h"
#include "core/align/resampler.h"
#include "core/scene/scene.h"

namespace {

using qdmd::Pose;
using Grey = std::vector<uint8_t>;

struct Size {
  int width, height;
};
constexpr Size kSizes[] = {{320, 240}, {768, 576}, {1920, 1080}};

// The green samples of frames of a scene.
std::vector<Grey> frames_of(const std::string& text, Size size, int count) {
  qdmd::scene::SceneOptions options;
  options.width = size.width;
  options.height = size.height;
  qdmd::scene::Scene scene(options, text);
  std::vector<Grey> frames;
  for (int t = 0; t < count; ++t) {
    scene.render(t, qdmd::scene::kFrame);
    Grey& grey =
        frames.emplace_back(static_cast<size_t>(size.width) * static_cast<size_t>(size.height));
    for (size_t i = 0; i < grey.size(); ++i) grey[i] = scene.frame().samples[3 * i + 1];
  }
  return frames;
}

constexpr int kFrames = 8;

void find(benchmark::State& state, Size size, const char* scene, bool turns) {
  const std::vector<Grey> frames = frames_of(scene, size, kFrames);
  qdmd::MotionFinder finder(size.width, size.height);
  finder.take_reference(frames[0].data(), {});
  Pose before;
  size_t t = 0;
  for (auto _ : state) {
    before = finder.find(frames[t].data(), before, Pose(), turns).pose;
    t = (t + 1) % kFrames;
  }
  benchmark::DoNotOptimize(before);
}

void take_reference(benchmark::State& state, Size size) {
  const std::vector<Grey> frames = frames_of("basic", size, 1);
  qdmd::MotionFinder finder(size.width, size.height);
  for (auto _ : state) finder.take_reference(frames[0].data(), {});
}

void move(benchmark::State& state, Size size, const Pose& pose) {
  const std::vector<Grey> frames = frames_of("basic", size, 1);
  Grey out(frames[0].size());
  qdmd::Resampler resampler;
  resampler.prepare(nullptr);
  const qdmd::Affine place = affine(pose, qdmd::middle_of(size.width, size.height));
  for (auto _ : state)
    resampler.run(frames[0].data(), 8, place, out.data(), size.width, size.height, nullptr);
  benchmark::DoNotOptimize(out.data());
}

cv::Mat matrix(const Grey& grey, Size size) {
  return cv::Mat(size.height, size.width, CV_8U, const_cast<uint8_t*>(grey.data()));
}

// OpenCV's, on pictures of at most 320 pixels.
void phase_correlate(benchmark::State& state, Size size) {
  const std::vector<Grey> frames = frames_of("basic,jitter=2", size, 2);
  cv::Mat small[2], window;
  const double share = 320.0 / size.width;
  for (auto _ : state) {
    for (size_t i = 0; i < 2; ++i) {
      cv::resize(matrix(frames[i], size), small[i], {}, share, share, cv::INTER_AREA);
      small[i].convertTo(small[i], CV_32F);
    }
    if (window.empty()) cv::createHanningWindow(window, small[0].size(), CV_32F);
    benchmark::DoNotOptimize(cv::phaseCorrelate(small[0], small[1], window));
  }
}

void ecc(benchmark::State& state, Size size, int motion) {
  const std::vector<Grey> frames = frames_of("basic,jitter=2", size, 2);
  const double share = 320.0 / size.width;
  for (auto _ : state) {
    cv::Mat small[2], warp = cv::Mat::eye(2, 3, CV_32F);
    for (size_t i = 0; i < 2; ++i)
      cv::resize(matrix(frames[i], size), small[i], {}, share, share, cv::INTER_AREA);
    benchmark::DoNotOptimize(cv::findTransformECC(
        small[0], small[1], warp, motion,
        cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 1e-3)));
  }
}

void warp_affine(benchmark::State& state, Size size) {
  const std::vector<Grey> frames = frames_of("basic", size, 1);
  cv::Mat out;
  const cv::Mat warp = (cv::Mat_<double>(2, 3) << 1, 0, 2.3, 0, 1, -1.6);
  for (auto _ : state)
    cv::warpAffine(matrix(frames[0], size), out, warp, {size.width, size.height},
                   cv::INTER_CUBIC | cv::WARP_INVERSE_MAP);
}

}  // namespace

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  for (const Size size : kSizes) {
    std::string at(1, '/');
    at.append(std::to_string(size.width)).append("x").append(std::to_string(size.height));
    const auto add = [&](const std::string& name, auto run) {
      benchmark::RegisterBenchmark((name + at).c_str(), run)->Unit(benchmark::kMicrosecond);
    };
    add("find/still", [=](auto& s) { find(s, size, "basic", false); });
    add("find/still_crowd", [=](auto& s) { find(s, size, "basic,bootstrap", false); });
    add("find/shaking", [=](auto& s) { find(s, size, "basic,jitter=2", false); });
    add("find/turning", [=](auto& s) { find(s, size, "basic,jitter=2:rotation=1", true); });
    add("take_reference", [=](auto& s) { take_reference(s, size); });
    add("move/shift", [=](auto& s) { move(s, size, {2.3, -1.6, 0, 1}); });
    add("move/turn", [=](auto& s) { move(s, size, {2.3, -1.6, 0.02, 1}); });
    add("opencv/warpAffine", [=](auto& s) { warp_affine(s, size); });
    add("opencv/phaseCorrelate", [=](auto& s) { phase_correlate(s, size); });
    add("opencv/ecc_translation", [=](auto& s) { ecc(s, size, cv::MOTION_TRANSLATION); });
    add("opencv/ecc_euclidean", [=](auto& s) { ecc(s, size, cv::MOTION_EUCLIDEAN); });
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
