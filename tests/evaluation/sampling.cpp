// SPDX-License-Identifier: LGPL-2.1-or-later
// How far sampled pixels move the background: the measurement behind sample-step=0.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <opencv2/core.hpp>

#include "core/engine/engine.h"
#include "tests/evaluation/clip.h"
#include "tests/evaluation/dataset.h"

namespace {

using namespace qdmd;
using namespace qdmd::evaluation;

// L(t) of each frame, the clip being one window.
std::vector<cv::Mat> backgrounds(const LabelledClip& clip, int rank, int sample_step) {
  EngineOptions options;
  options.method = Method::qdmd;
  options.window_size = static_cast<int>(clip.frames.size());
  options.dmd.rank = rank;
  options.sample_step = sample_step;
  options.max_memory = UINT64_MAX;
  Engine engine;
  const cv::Size size = clip.frames[0].size();
  Status status = engine.configure(options, size.width, size.height);
  for (const cv::Mat& frame : clip.frames)
    if (status.ok()) status = engine.push(view_of(frame));
  if (status.ok()) status = engine.drain();
  if (!status.ok()) throw std::runtime_error(status.message);
  std::vector<cv::Mat> result;
  while (engine.next()) {
    result.emplace_back(size, CV_8UC3);
    engine.next()->pop(Output::background, view_of(result.back()));
  }
  return result;
}

// The frame with the largest mean absolute difference of levels decides.
double distance(const std::vector<cv::Mat>& a, const std::vector<cv::Mat>& b) {
  double worst = 0;
  for (size_t t = 0; t < a.size(); ++t)
    worst =
        std::max(worst, cv::norm(a[t], b[t], cv::NORM_L1) / static_cast<double>(a[t].total() * 3));
  return worst;
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app(
      "Markdown table of the mean absolute difference in levels between the backgrounds with all "
      "pixels and with every k-th in x and y, in the frame where it is largest.");
  std::string dataset;
  std::vector<int> ranks = {1, 3}, steps = {2, 3, 4, 6, 8, 12, 16};
  size_t frames = 300;
  app.add_option("--dataset", dataset, "folder of sequences")->required();
  app.add_option("--ranks", ranks, "ranks; 0: full")->delimiter(',');
  app.add_option("--steps", steps, "sample steps")->delimiter(',');
  app.add_option("--frames", frames, "at most that many frames a sequence, evenly thinned");
  CLI11_PARSE(app, argc, argv);

  std::printf("| rank | sequence |");
  for (int step : steps) std::printf(" step %d |", step);
  std::printf("\n|---|---|");
  for (size_t k = 0; k < steps.size(); ++k) std::printf("---|");
  std::printf("\n");
  const auto sequences = find_sequences(dataset);
  std::vector<LabelledClip> clips;
  for (const Sequence& sequence : sequences)
    clips.push_back(
        read_clip(sequence, {0, (sequence.frames.size() + frames - 1) / frames, frames}));
  for (int rank : ranks) {
    const std::string name = rank == 0 ? "full" : std::to_string(rank);
    std::vector<double> worst(steps.size(), 0);
    for (size_t i = 0; i < clips.size(); ++i) {
      std::fprintf(stderr, "\rrank %s, %zu of %zu sequences ", name.c_str(), i + 1, clips.size());
      const auto whole = backgrounds(clips[i], rank, 1);
      std::printf("| %s | %s |", name.c_str(), sequences[i].name.c_str());
      for (size_t k = 0; k < steps.size(); ++k) {
        const double moved = distance(whole, backgrounds(clips[i], rank, steps[k]));
        worst[k] = std::max(worst[k], moved);
        std::printf(" %.3f |", moved);
      }
      std::printf("\n");
      std::fflush(stdout);
    }
    std::printf("| %s | **largest** |", name.c_str());
    for (double moved : worst) std::printf(" **%.3f** |", moved);
    std::printf("\n");
  }
  std::fprintf(stderr, "\n");
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
