// SPDX-License-Identifier: LGPL-2.1-or-later
// qdmd-evaluate: background pictures and masks of every method on data sets with truth.
#include <gst/gst.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <map>
#include <thread>

#include "tests/evaluation/classic_methods.h"
#include "tests/evaluation/engine_method.h"
#include "tests/evaluation/pipeline_method.h"
#include "tests/evaluation/runner.h"

namespace {

namespace fs = std::filesystem;
using namespace qdmd::evaluation;

// A number of frames that nobody has; keeps sums of two within size_t.
constexpr size_t kMost = size_t{1} << 30;

struct Options {
  std::string dataset, output_dir, resume, plugin = QDMD_PLUGIN;
  std::vector<std::string> sequences, methods, properties;
  Selection selection;
  std::string picture = "middle", format = "text";
  bool in_process = false;
  unsigned jobs = std::max(1u, std::thread::hardware_concurrency());
};

const std::map<std::string, ScoredPicture> kPictures{{"first", ScoredPicture::first},
                                                     {"middle", ScoredPicture::middle},
                                                     {"last", ScoredPicture::last},
                                                     {"median", ScoredPicture::median}};
const std::map<std::string, Format> kFormats{
    {"text", Format::text}, {"csv", Format::csv}, {"json", Format::json}};

void declare(CLI::App& app, Options& options) {
  app.add_option("--dataset", options.dataset,
                 "Folder of sequences in the layout of SBI, SBMnet or CDnet, or one sequence: "
                 "input/* are the frames in name order, gt/GT_* the true background")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("--sequences", options.sequences, "Only these, separated by commas")
      ->delimiter(',');
  app.add_option("--methods", options.methods, "Only these, separated by commas")->delimiter(',');
  app.add_option("--set", options.properties,
                 "A property of the element, name=value; again for more. Without window-size the "
                 "whole sequence is one window, up to 2048 frames; without n-threads each job has "
                 "its share of the cores")
      ->expected(1)
      ->take_all();
  app.add_option("--frames", options.selection.frames, "Frames at most (0: all)")
      ->check(CLI::Range(size_t{0}, kMost));
  app.add_option("--start", options.selection.start, "Frames to leave out at the start")
      ->check(CLI::Range(size_t{0}, kMost));
  app.add_option("--every", options.selection.every, "Take every S-th frame")
      ->check(CLI::Range(size_t{1}, kMost));
  app.add_option("--thin", options.selection.thin,
                 "Of the frames that are left, take so many at most, evenly spread (0: all)")
      ->check(CLI::Range(size_t{0}, kMost));
  app.add_flag("--reverse", options.selection.reverse, "The last frame comes first");
  app.add_option("--picture", options.picture,
                 "Which L(t) is scored: that of the first, middle (default) or last frame, or the "
                 "median over all. mog2 and knn are scored after the last frame, mean and median "
                 "have one picture")
      ->check(CLI::IsMember({"first", "middle", "last", "median"}));
  app.add_option("--format", options.format, "Of the table on standard output: text, csv or json")
      ->check(CLI::IsMember({"text", "csv", "json"}));
  app.add_option("--output-dir", options.output_dir,
                 "Write backgrounds as <sequence>_<method>.png and contact sheets as "
                 "<sequence>_sheet.png (error pictures are four times as bright)");
  app.add_option("--resume", options.resume,
                 "Folder of finished results: a run that was stopped goes on from there. Default: "
                 "results/ in the output folder; without either, nothing is kept");
  app.add_flag("--in-process", options.in_process,
               "Call the core in place of a pipeline with the element: the same pictures");
  app.add_option("--jobs", options.jobs,
                 "Jobs at a time (default: one a core). Take 1 where seconds matter")
      ->check(CLI::Range(1u, 256u));
  app.add_option("--plugin", options.plugin, "The plugin file")->check(CLI::ExistingFile);
}

// Methods that --methods names, in its order; all without it. Throws on unknown names.
Methods choose_methods(Methods all, const std::vector<std::string>& names) {
  if (names.empty()) return all;
  Methods chosen;
  for (const auto& name : names) {
    const auto is_it = [&](const auto& method) { return method && method->name() == name; };
    if (std::any_of(chosen.begin(), chosen.end(), is_it)) continue;
    const auto found = std::find_if(all.begin(), all.end(), is_it);
    if (found == all.end()) {
      std::string known;
      for (const auto& method : all)
        if (method) known += " " + method->name();
      throw std::invalid_argument("there is no method '" + name + "'; there are" + known);
    }
    chosen.push_back(std::move(*found));
  }
  return chosen;
}

// Sequences that --sequences names by their whole name or the last part of it, in its order.
std::vector<Sequence> choose_sequences(const std::vector<Sequence>& all,
                                       const std::vector<std::string>& names, Progress& progress) {
  if (names.empty()) return all;
  std::vector<Sequence> chosen;
  for (const auto& name : names) {
    bool found = false;
    for (const auto& sequence : all) {
      if (sequence.name != name && sequence.folder.filename() != name) continue;
      found = true;
      if (std::none_of(chosen.begin(), chosen.end(),
                       [&](const Sequence& other) { return other.folder == sequence.folder; }))
        chosen.push_back(sequence);
    }
    if (!found) progress.problem(name, "the data set has no such sequence");
  }
  return chosen;
}

Methods all_methods(const Options& options, const ElementOptions& element) {
  Methods all = options.in_process ? engine_methods(element) : pipeline_methods(element);
  for (auto& method : classic_methods()) all.push_back(std::move(method));
  return all;
}

// What results depend on besides the sequence's files.
std::string settings_of(const Options& options) {
  std::string text = fingerprint(options.plugin) + fingerprint(fs::canonical("/proc/self/exe"));
  text += options.in_process ? "in-process\n" : "pipeline\n";
  for (const auto& property : options.properties) text += property + "\n";
  return text + "picture " + options.picture + "\n";
}

int evaluate(const Options& options) {
  Progress progress;
  Plan plan;
  ElementOptions element;
  element.threads =
      std::clamp(std::thread::hardware_concurrency() / std::max(options.jobs, 1u), 1u, 256u);
  cv::setNumThreads(static_cast<int>(element.threads));
  for (const auto& text : options.properties) element.properties.push_back(parse_property(text));
  plan.methods = choose_methods(all_methods(options, element), options.methods);
  plan.selection = options.selection;
  plan.picture = kPictures.at(options.picture);
  plan.jobs = options.jobs;
  plan.settings = settings_of(options);
  plan.output_dir = options.output_dir;
  if (!plan.output_dir.empty()) fs::create_directories(plan.output_dir);
  if (!options.resume.empty())
    plan.store = Store(options.resume);
  else if (!plan.output_dir.empty())
    plan.store = Store(plan.output_dir / "results");

  const std::vector<Sequence> all = find_sequences(options.dataset);
  if (all.empty())
    progress.problem(options.dataset, "no sequences: no folder in it has a folder input/");
  for (const auto& sequence : choose_sequences(all, options.sequences, progress)) {
    for (const auto& problem : sequence.problems) progress.problem(sequence.name, problem);
    if (!sequence.frames.empty()) plan.sequences.push_back(sequence);
  }
  const std::vector<Row> rows = run(plan, progress);
  progress.end();
  write_table(rows, kFormats.at(options.format), std::cout);
  std::cout.flush();
  if (!std::cout)
    throw std::runtime_error("cannot write the table: make room where standard output goes");
  return progress.problems() == 0 ? 0 : 1;
}

}  // namespace

// Ends with 0; 1 where something could not be evaluated (the rest is); 2 where options are wrong.
int main(int argc, char** argv) {
  gst_init(nullptr, nullptr);
  Options options;
  CLI::App app(
      "Scores background methods on sequences with truth: average grey-level error, error pixels "
      "(shares, 0 to 1), similarity, and masks where the data set has them.");
  declare(app, options);
  app.footer([&options] {
    try {
      load_plugin(options.plugin);
      std::string text = "Methods:";
      for (const auto& method : all_methods(options, {})) text += " " + method->name();
      return text;
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
  });
  try {
    app.parse(argc, argv);
    options.plugin = fs::canonical(options.plugin).string();
    load_plugin(options.plugin);
    return evaluate(options);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "qdmd-evaluate: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "qdmd-evaluate: %s\n", error.what());
    return 1;
  }
}
