// SPDX-License-Identifier: LGPL-2.1-or-later
// What accuracy costs in time: every knob on real sequences and simulated scenes, the solvers'
// errors against 50 digits, and how times grow. The measurement of docs/accuracy-vs-time.md.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <opencv2/core/utility.hpp>

#include "tests/bench/accuracy_budget.h"
#include "tests/bench/accuracy_error.h"
#include "tests/bench/accuracy_quality.h"
#include "tests/bench/accuracy_scaling.h"
#include "tests/evaluation/clip.h"
#include "tests/evaluation/dataset.h"

namespace {

using namespace qdmd::bench;
using qdmd::evaluation::Progress;
using qdmd::evaluation::Sequence;

constexpr size_t kMostFrames = 300;  // of a real sequence, evenly thinned

// One for each thing that is hard in a real scene.
constexpr const char* kScenes[] = {"basic", "intermittent-motion", "illumination-changes",
                                   "background-motion"};

void add_scenes(const QualityLimits& limits, Table* table, Progress* progress, Steps* steps) {
  if (limits.brief) {
    steps->push_back({"quality: basic", [=] {
                        measure_quality(simulated("basic", 96, 72, 24), limits, table, progress);
                      }});
    return;
  }
  for (const std::string scene : kScenes)
    steps->push_back({"quality: " + scene, [=] {
                        measure_quality(simulated(scene, 320, 240, 200), limits, table, progress);
                      }});
}

void add_real(const std::string& data, const QualityLimits& limits, Table* table,
              Progress* progress, Steps* steps) {
  for (const Sequence& sequence : qdmd::evaluation::find_sequences(data)) {
    if (sequence.truth.empty()) continue;
    steps->push_back({"quality: " + sequence.name, [=] {
                        qdmd::evaluation::Selection selection;
                        selection.thin = kMostFrames;
                        const auto clip = qdmd::evaluation::read_clip(sequence, selection);
                        for (const auto& problem : clip.problems)
                          progress->problem(sequence.name, problem);
                        if (!clip.truth.empty())
                          measure_quality(
                              {"real", sequence.folder.filename(), clip.frames, {clip.truth}},
                              limits, table, progress);
                      }});
  }
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app(
      "Measures time, numerical error, background quality and memory of every setting, on one "
      "thread, and writes them as CSV. Rows that the file has are not measured again.");
  std::string csv;
  std::vector<std::string> parts = {"budget", "error", "scaling", "quality"};
  QualityLimits limits;
  const char* data = std::getenv("QDMD_DATA");
  app.add_option("csv", csv, "file that is written, or continued")->required();
  app.add_option("--parts", parts, "what is measured")
      ->delimiter(',')
      ->check(CLI::IsMember({"budget", "error", "scaling", "quality"}));
  app.add_option("--turns", limits.turns, "times that everything is measured, for medians")
      ->check(CLI::Range(1, 100));
  app.add_option("--seconds", limits.seconds,
                 "processor time after which one setting is not repeated");
  app.add_flag("--short", limits.brief, "a minute: small scenes, whose numbers say little");
  CLI11_PARSE(app, argc, argv);
  if (limits.brief) limits.turns = 1;
  // The peers are OpenCV's; everything is measured on one thread.
  cv::setNumThreads(1);

  Table table(csv);
  Progress progress;
  Steps steps;
  const int more_turns = 2 * limits.turns + 1;
  for (const std::string& part : parts) {
    if (part == "budget") {
      add_budgets(limits.brief, &table, &steps);
    } else if (part == "error") {
      add_conditions(limits.brief, &table, &steps);
      add_hard_cases(limits.brief, &table, &steps);
      add_solvers(limits.brief, more_turns, limits.seconds, &table, &steps);
    } else if (part == "scaling") {
      add_scaling(limits.brief, more_turns, limits.seconds, &table, &steps);
    } else {
      add_scenes(limits, &table, &progress, &steps);
      if (data && !limits.brief) add_real(data, limits, &table, &progress, &steps);
      if (!data) progress.problem("QDMD_DATA", "not set: no real sequence is measured");
    }
  }
  progress.start(steps.size());
  for (const Step& step : steps) {
    step.work();
    progress.finish_job(step.what);
  }
  progress.end();
  std::fprintf(stderr, "%zu new rows in %s\n", table.added(), csv.c_str());
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
