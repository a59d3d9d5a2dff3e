// SPDX-License-Identifier: LGPL-2.1-or-later
// What each setting and each constant of robust Q-DMD brings: the measurement of
// docs/notebook/robust.md.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <functional>

#include "core/learn/robust/robust_learner.h"
#include "core/metrics/picture_scores.h"
#include "core/passes/combine.h"
#include "tests/evaluation/clip.h"
#include "tests/evaluation/dataset.h"

namespace {

using namespace qdmd;
using namespace qdmd::evaluation;

struct Setting {
  RobustParameters parameters;
  int iterations = LearnOptions().iterations, rank = 0, window = 300;
  int step = 0;  // 0: chosen
};

struct Variant {
  std::string name;
  Setting setting;
};

// All but one thing as it is.
std::vector<Variant> variants() {
  std::vector<Variant> all = {{"as it is", {}}};
  const auto vary = [&](const char* name, auto member, const std::vector<int>& values) {
    for (int value : values) {
      Variant variant{std::string(name) + " " + std::to_string(value), {}};
      std::invoke(member, variant.setting) = value;
      all.push_back(variant);
    }
  };
  const auto inner = [](int RobustParameters::*member) {
    return [member](Setting& setting) -> int& { return setting.parameters.*member; };
  };
  vary("iterations", &Setting::iterations, {1, 2, 3, 4});
  vary("rank", &Setting::rank, {2, 3});
  vary("sample-step", &Setting::step, {1, 4, 8});
  vary("window-size", &Setting::window, {200, 100, 50, 25});
  for (int size : {100, 50, 25}) {
    Variant variant{"window-size " + std::to_string(size) + ", each alone", {}};
    variant.setting.window = size;
    variant.setting.parameters.earlier_share = 0;
    all.push_back(variant);
  }
  vary("start frames", inner(&RobustParameters::start_frames), {40, 80, 300});
  vary("cells along the short side", inner(&RobustParameters::cells_along), {24, 96});
  vary("least threshold", inner(&RobustParameters::least_threshold), {12, 18, 34});
  vary("threshold in spreads", inner(&RobustParameters::spreads), {2, 3, 6});
  return all;
}

struct Outcome {
  double age = 0;      // mean over the windows, of L at each one's middle frame
  double seconds = 0;  // of the solves
};

// L at the middle frame of the window.
cv::Mat middle_of(BackgroundModel* model, int frames, cv::Size size) {
  cv::Mat picture(size, CV_8UC3);
  model->set_time((frames - 1) / 2);
  const size_t pixels = picture.total();
  std::vector<uint8_t> planes(3 * pixels);
  for (size_t first = 0; first < pixels; first += kMaxRun) {
    uint8_t* const out[3] = {planes.data() + first, planes.data() + pixels + first,
                             planes.data() + 2 * pixels + first};
    model->evaluate(first, std::min(kMaxRun, pixels - first), out);
  }
  for (size_t p = 0; p < pixels; ++p)
    for (size_t c = 0; c < 3; ++c) picture.data[3 * p + 2 - c] = planes[c * pixels + p];
  return picture;
}

Outcome measure(const LabelledClip& clip, const Setting& setting, Pool* pool) {
  const cv::Size size = clip.frames[0].size();
  const auto truth = luma(view_of(clip.truth));
  LearnOptions options;
  options.dmd.rank = setting.rank;
  options.iterations = setting.iterations;
  options.sample_step = setting.step;
  const int count = static_cast<int>(clip.frames.size());
  const int capacity = std::min(count, setting.window), windows = count / capacity;
  Outcome outcome;
  Clock clock;
  RobustLearner learner(options, size.width, size.height, setting.parameters);
  FrameStore frames(capacity, size.width, size.height, learner.contents());
  learner.begin({&frames, capacity, Models::one, pool, &clock});
  for (int w = 0; w < windows; ++w) {
    const auto start = std::chrono::steady_clock::now();
    frames.clear();
    for (int t = 0; t < capacity; ++t)
      frames.append(view_of(clip.frames[static_cast<size_t>(w * capacity + t)]));
    BackgroundModel model;
    learner.decompose(frames.window());
    learner.build({}, &model);
    learner.publish();
    outcome.seconds +=
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const cv::Mat picture = middle_of(&model, capacity, size);
    outcome.age += average_grey_error(luma(view_of(picture)), truth) / windows;
  }
  return outcome;
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app(
      "Markdown table: AGE of robust Q-DMD on each sequence with one setting or constant changed, "
      "and the seconds of one thread.");
  std::string dataset;
  size_t frames = 300;
  std::vector<std::string> only;
  app.add_option("--dataset", dataset, "folder of sequences with truth")->required();
  app.add_option("--frames", frames, "at most that many frames a sequence, evenly thinned");
  app.add_option("--only", only, "variants whose names begin so")->delimiter(',');
  CLI11_PARSE(app, argc, argv);

  std::vector<Variant> chosen;
  for (const Variant& variant : variants())
    if (only.empty() || std::any_of(only.begin(), only.end(), [&](const std::string& start) {
          return variant.name.starts_with(start);
        }))
      chosen.push_back(variant);
  std::vector<Sequence> sequences;
  for (Sequence& sequence : find_sequences(dataset))
    if (!sequence.truth.empty()) sequences.push_back(std::move(sequence));

  Pool pool(1);
  std::vector<std::vector<Outcome>> outcomes(chosen.size());
  evaluation::Selection selection;
  selection.thin = frames;
  for (size_t s = 0; s < sequences.size(); ++s) {
    const LabelledClip clip = read_clip(sequences[s], selection);
    for (size_t v = 0; v < chosen.size(); ++v) {
      std::fprintf(stderr, "\r%zu of %zu sequences, %-34s", s + 1, sequences.size(),
                   chosen[v].name.c_str());
      outcomes[v].push_back(measure(clip, chosen[v].setting, &pool));
    }
  }
  std::fprintf(stderr, "\n");

  std::printf("| AGE |");
  for (const Sequence& sequence : sequences)
    std::printf(" %s |", sequence.folder.filename().c_str());
  std::printf(" **mean** | seconds |\n|---|---|---|");
  for (size_t s = 0; s < sequences.size(); ++s) std::printf("---|");
  std::printf("\n");
  for (size_t v = 0; v < chosen.size(); ++v) {
    double sum = 0, seconds = 0;
    std::printf("| %s |", chosen[v].name.c_str());
    for (const Outcome& outcome : outcomes[v]) {
      std::printf(" %.2f |", outcome.age);
      sum += outcome.age;
      seconds += outcome.seconds;
    }
    std::printf(" **%.2f** | %.1f |\n", sum / static_cast<double>(sequences.size()), seconds);
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
