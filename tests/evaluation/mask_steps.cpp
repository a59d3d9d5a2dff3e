// SPDX-License-Identifier: LGPL-2.1-or-later
// What each step of a mask brings, beside OpenCV's masks: the measurement of
// docs/notebook/masks.md.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/background_segm.hpp>
#ifdef QDMD_HAVE_BGSEGM
#include <opencv2/bgsegm.hpp>
#endif

#include "core/engine/engine.h"
#include "tests/evaluation/clip.h"
#include "tests/evaluation/dataset.h"

namespace {

using namespace qdmd;
using namespace qdmd::evaluation;

// Takes a mask of each frame, in order.
using See = std::function<void(const cv::Mat& mask)>;

struct Variant {
  std::string name;
  std::function<void(const LabelledClip& clip, const See& see)> run;
};

// The element's defaults but for mode, steps and shadows, frame by frame.
void run_engine(const LabelledClip& clip, Mode mode, const DecisionSteps& steps, Shadows shadows,
                const See& see) {
  EngineOptions options;
  options.stabilize = Stabilize::translation;
  options.mode = mode;
  options.steps = steps;
  options.shadows = shadows;
  Engine engine;
  const cv::Size size = clip.frames[0].size();
  if (const Status status = engine.configure(options, size.width, size.height); !status.ok())
    throw std::runtime_error(status.message);
  cv::Mat picture(size, CV_8UC3), mask;
  const auto take = [&] {
    while (engine.next()) {
      engine.next()->pop(Output::mask, view_of(picture));
      cv::extractChannel(picture, mask, 0);
      see(mask);
    }
  };
  for (const cv::Mat& frame : clip.frames) {
    if (const Status status = engine.push(view_of(frame)); !status.ok())
      throw std::runtime_error(status.message);
    take();
  }
  engine.drain();
  take();
}

// No step but the first.
DecisionSteps alone() {
  return {false, false, false, false, false, false, false, false, false, false};
}

std::vector<Variant> variants() {
  std::vector<Variant> all;
  const auto add = [&](const std::string& name, Mode mode, const DecisionSteps& steps,
                       Shadows shadows) {
    all.push_back({name, [=](const LabelledClip& clip, const See& see) {
                     run_engine(clip, mode, steps, shadows, see);
                   }});
  };
  for (auto [name, mode] : {std::pair{"default", Mode::batch}, {"mode=live", Mode::live}}) {
    const std::string of = name;
    add(of, mode, {}, Shadows::background);
    const std::pair<const char*, bool DecisionSteps::*> steps[] = {
        {"means in much noise", &DecisionSteps::smooth},
        {"noise of each pixel", &DecisionSteps::noise},
        {"moving textures", &DecisionSteps::texture},
        {"light", &DecisionSteps::light},
        {"vote, specks and holes", &DecisionSteps::vote},
        {"specks and holes", &DecisionSteps::specks},
        {"hard shadows", &DecisionSteps::hard},
        {"flat things", &DecisionSteps::flat},
        {"edges", &DecisionSteps::edges},
        {"overlays", &DecisionSteps::overlays}};
    for (const auto& [step, member] : steps) {
      DecisionSteps without;
      without.*member = false;
      add(of + " without " + step, mode, without, Shadows::background);
    }
    add(of + ", shadows=foreground", mode, {}, Shadows::foreground);
    add(of + ", each pixel by itself", mode, alone(), Shadows::foreground);
  }
  const auto peer = [&](const std::string& name, auto make) {
    for (bool smooth : {false, true})
      all.push_back(
          {name + (smooth ? ", 9 x 9 median" : ""), [=](const LabelledClip& clip, const See& see) {
             const cv::Ptr<cv::BackgroundSubtractor> model = make();
             cv::Mat mask;
             for (const cv::Mat& frame : clip.frames) {
               model->apply(frame, mask);
               cv::threshold(mask, mask, 254, 255, cv::THRESH_BINARY);
               if (smooth) cv::medianBlur(mask, mask, 9);
               see(mask);
             }
           }});
  };
  peer("OpenCV MOG2", [] { return cv::createBackgroundSubtractorMOG2(); });
  peer("OpenCV KNN", [] { return cv::createBackgroundSubtractorKNN(); });
#ifdef QDMD_HAVE_BGSEGM
  peer("OpenCV CNT", [] { return cv::bgsegm::createBackgroundSubtractorCNT(); });
#endif
  return all;
}

double score(const LabelledClip& clip, const Variant& variant) {
  MaskCounts counts;
  size_t frame = 0;
  variant.run(clip, [&](const cv::Mat& mask) { clip.score(frame++, mask.data, &counts); });
  return counts.f_measure().value_or(1);
}

// Frames, masks without steps, and masks of the default, side by side.
void write_sheet(const LabelledClip& clip, const std::vector<size_t>& shown,
                 const std::string& file) {
  std::vector<std::vector<cv::Mat>> columns(2);
  for (size_t i = 0; i < 2; ++i)
    run_engine(clip, Mode::batch, i == 0 ? alone() : DecisionSteps(),
               i == 0 ? Shadows::foreground : Shadows::background,
               [&](const cv::Mat& mask) { columns[i].push_back(mask.clone()); });
  std::vector<cv::Mat> rows;
  for (size_t t : shown) {
    if (t >= clip.frames.size()) continue;
    std::vector<cv::Mat> row = {clip.frames[t]};
    for (const auto& column : columns) {
      cv::Mat colour;
      cv::cvtColor(column[t], colour, cv::COLOR_GRAY2BGR);
      row.push_back(colour);
    }
    rows.emplace_back();
    cv::hconcat(row, rows.back());
  }
  if (rows.empty()) throw std::runtime_error("the sheet has no frames");
  cv::Mat sheet;
  cv::vconcat(rows, sheet);
  if (!cv::imwrite(file, sheet)) throw std::runtime_error("cannot write " + file);
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app(
      "Markdown table: F of masks at the element's defaults on each sequence that has them, with "
      "one step left out, and of OpenCV's; CDnet's rules.");
  std::vector<std::string> datasets, only;
  std::string sheet;
  std::vector<size_t> shown = {50};
  bool plain = false;
  app.add_option("--dataset", datasets, "folder of sequences; again for more")->required();
  app.add_option("--only", only, "variants whose names begin so")->delimiter(',');
  app.add_flag("--plain", plain, "only what is as it is");
  app.add_option(
      "--sheet", sheet,
      "no table: writes frames, masks of pixels by themselves and the default's masks of "
      "the first sequence to this file");
  app.add_option("--shown", shown, "frames of the sheet, counted from 0")->delimiter(',');
  CLI11_PARSE(app, argc, argv);

  std::vector<Sequence> sequences;
  for (const std::string& dataset : datasets)
    for (Sequence& sequence : find_sequences(dataset))
      if (!sheet.empty() || !sequence.masks.empty()) sequences.push_back(std::move(sequence));
  if (sequences.empty()) throw std::runtime_error("there is no sequence with masks");
  if (!sheet.empty()) {
    write_sheet(read_clip(sequences[0], {}), shown, sheet);
    return 0;
  }

  std::vector<Variant> chosen;
  for (const Variant& variant : variants()) {
    const bool as_it_is = variant.name.find(" without ") == std::string::npos &&
                          variant.name.find(',') == std::string::npos;
    const bool asked =
        only.empty() || std::any_of(only.begin(), only.end(), [&](const std::string& start) {
          return variant.name.starts_with(start);
        });
    if (asked && (as_it_is || !plain)) chosen.push_back(variant);
  }
  std::vector<std::vector<double>> scores(chosen.size());
  for (size_t s = 0; s < sequences.size(); ++s) {
    const LabelledClip clip = read_scored_clip(sequences[s]);
    for (size_t v = 0; v < chosen.size(); ++v) {
      std::fprintf(stderr, "\r%zu of %zu sequences, %-50s", s + 1, sequences.size(),
                   chosen[v].name.c_str());
      scores[v].push_back(score(clip, chosen[v]));
    }
  }
  std::fprintf(stderr, "\n");

  std::printf("| F |");
  for (const Sequence& sequence : sequences)
    std::printf(" %s |", sequence.folder.filename().c_str());
  std::printf(" **mean** |\n|---|---|");
  for (size_t s = 0; s < sequences.size(); ++s) std::printf("---|");
  std::printf("\n");
  for (size_t v = 0; v < chosen.size(); ++v) {
    double sum = 0;
    std::printf("| %s |", chosen[v].name.c_str());
    for (double f : scores[v]) {
      std::printf(" %.3f |", f);
      sum += f;
    }
    std::printf(" **%.3f** |\n", sum / static_cast<double>(sequences.size()));
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
