// SPDX-License-Identifier: LGPL-2.1-or-later
// What other constants of a decision would give: the plateaus of docs/notebook/masks.md.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <functional>
#include <memory>
#include <thread>

#include "core/engine/engine.h"
#include "core/passes/planes.h"
#include "tests/evaluation/clip.h"
#include "tests/evaluation/dataset.h"

namespace {

using namespace qdmd;
using namespace qdmd::evaluation;

// Multiplies a constant.
struct Constant {
  const char* name;
  std::function<void(DecisionConstants& constants, double factor)> scale;
};

std::vector<Constant> constants() {
  const auto of = [](double DecisionConstants::*member) {
    return [=](DecisionConstants& all, double factor) { all.*member *= factor; };
  };
  const auto of_light = [](float LightRange::*member) {
    return [=](DecisionConstants& all, double factor) {
      all.light.*member *= static_cast<float>(factor);
    };
  };
  const auto of_hard = [](double HardShadowConstants::*member) {
    return [=](DecisionConstants& all, double factor) { all.hard.*member *= factor; };
  };
  using All = DecisionConstants;
  using Hard = HardShadowConstants;
  return {
      {"mean_distances", of(&All::mean_distances)},
      {"noise_samples", of(&All::noise_samples)},
      {"weight_of_moments", of(&All::weight_of_moments)},
      {"most_of_moments", of(&All::most_of_moments)},
      {"near_foreground", of(&All::near_foreground)},
      {"noisy", of(&All::noisy)},
      {"least_of_means", of(&All::least_of_means)},
      {"least_alone", of(&All::least_alone)},
      {"nearer", of(&All::nearer)},
      {"texture_cells", of(&All::texture_cells)},
      {"differing", of(&All::differing)},
      {"explained", of(&All::explained)},
      {"restless", of(&All::restless)},
      {"always", of(&All::always)},
      {"suddenly", of(&All::suddenly)},
      {"average_frames", of(&All::average_frames)},
      {"recent_frames", of(&All::recent_frames)},
      {"forget_frames", of(&All::forget_frames)},
      {"first_frames", of(&All::first_frames)},
      {"means_of_textures", of(&All::means_of_textures)},
      {"texture_samples", of(&All::texture_samples)},
      {"flat", of(&All::flat)},
      {"same_brightness", of(&All::same_brightness)},
      {"least_flat", of(&All::least_flat)},
      {"text_changes", of(&All::text_changes)},
      {"text_rests", of(&All::text_rests)},
      {"text_share", of(&All::text_share)},
      {"most_text", of(&All::most_text)},
      {"least_foreground", of(&All::least_foreground)},
      {"least_hole", of(&All::least_hole)},
      {"light.darkest", of_light(&LightRange::darkest)},
      {"light.brightest - 1",
       [](All& all, double factor) {
         all.light.brightest = 1 + (all.light.brightest - 1) * static_cast<float>(factor);
       }},
      {"light.alone", of_light(&LightRange::alone)},
      {"light.around", of_light(&LightRange::around)},
      {"light.least_rest", of_light(&LightRange::least_rest)},
      {"light.of_level", of_light(&LightRange::of_level)},
      {"edges.half", [](DecisionConstants& all, double factor) { all.edges.half *= factor; }},
      {"edges.rest", [](DecisionConstants& all, double factor) { all.edges.rest *= factor; }},
      {"hard.dark", of_hard(&Hard::dark)},
      {"hard.step", of_hard(&Hard::step)},
      {"hard.noise", of_hard(&Hard::noise)},
      {"hard.least_blocks", of_hard(&Hard::least_blocks)},
      {"hard.most_spread", of_hard(&Hard::most_spread)},
      {"hard.clipped_share", of_hard(&Hard::clipped_share)},
      {"hard.redder", of_hard(&Hard::redder)},
      {"hard.bluer", of_hard(&Hard::bluer)},
      {"hard.redder_bound", of_hard(&Hard::redder_bound)},
      {"hard.bluer_bound", of_hard(&Hard::bluer_bound)},
      {"hard.edge", of_hard(&Hard::edge)},
      {"hard.slope_of_ratio", of_hard(&Hard::slope_of_ratio)},
      {"hard.slope_of_region", of_hard(&Hard::slope_of_region)},
      {"hard.trust", of_hard(&Hard::trust)},
      {"hard.least_trust", of_hard(&Hard::least_trust)},
      {"hard.least_known", of_hard(&Hard::least_known)},
      {"hard.noise_of_pair", of_hard(&Hard::noise_of_pair)},
      {"hard.teaching", of_hard(&Hard::teaching)},
      {"hard.follows", of_hard(&Hard::follows)},
      {"hard.width", of_hard(&Hard::width)},
      {"hard.half_life", of_hard(&Hard::half_life)},
      {"hard.most_moving", of_hard(&Hard::most_moving)},
  };
}

// One frame of a stream as its decision sees it.
struct Seen {
  std::vector<uint8_t> x[kChannels], level[kChannels], limits;
  double threshold = 0;
};

// Goes through a clip with the engine's defaults, and shows what its decisions would be about: a
// batch's first window every fourth frame, as a rehearsal, then all frames.
void watch(const LabelledClip& clip,
           const std::function<void(const Seen& seen, bool rehearsal)>& see) {
  Engine engine;
  EngineOptions options;
  const cv::Size size = clip.frames[0].size();
  const auto must = [](const Status& status) {
    if (!status.ok()) throw std::runtime_error(status.message);
  };
  must(engine.configure(options, size.width, size.height));
  Wishes wishes = first_wishes(options);
  wishes.masks_expected = false;
  cv::Mat picture(size, CV_8UC3);
  const auto split = [&](const cv::Mat& from, std::vector<uint8_t>(&to)[kChannels]) {
    uint8_t* out[kChannels];
    for (int c = 0; c < kChannels; ++c) {
      to[c].resize(from.total());
      out[c] = to[c].data();
    }
    split_channels(view_of(from), 0, size.height, 255, out);
  };
  size_t popped = 0;
  std::vector<Seen> first_window;
  const auto take = [&] {
    Learnt learnt;
    if (engine.next() && !engine.learnt(&learnt)) throw std::runtime_error("nothing is learnt");
    std::vector<Seen> window;
    while (engine.next()) {
      engine.next()->pop(Output::background, view_of(picture));
      Seen seen;
      split(clip.frames[popped++], seen.x);
      split(picture, seen.level);
      seen.limits = learnt.limits;
      seen.threshold = automatic_threshold(learnt.noise);
      window.push_back(std::move(seen));
    }
    if (!window.empty() && popped == window.size())
      for (size_t t = 0; t < window.size(); t += 4) see(window[t], true);
    for (const Seen& seen : window) see(seen, false);
  };
  for (const cv::Mat& frame : clip.frames) {
    must(engine.push(view_of(frame), &wishes));
    take();
  }
  must(engine.drain());
  take();
}

// F of each set of constants.
std::vector<double> scores(const LabelledClip& clip, const std::vector<DecisionConstants>& sets,
                           Pool* pool) {
  const cv::Size size = clip.frames[0].size();
  const auto pixels = clip.frames[0].total();
  std::vector<std::unique_ptr<Decision>> decisions;
  for (const DecisionConstants& set : sets) {
    DecisionSteps steps;
    steps.constants = set;
    decisions.push_back(std::make_unique<Decision>(size.width, size.height, Colours::rgb, steps));
  }
  std::vector<MaskCounts> counts(sets.size());
  BackgroundModel model;
  model.make_room(pixels, true);
  size_t frame = 0;
  watch(clip, [&](const Seen& seen, bool rehearsal) {
    model.freeze_as({8, {seen.level[0], seen.level[1], seen.level[2]}, {}}, &seen.limits, pixels);
    model.set_time(0);
    const auto decide = [&](size_t i) {
      decisions[i]->decide({{seen.x[0].data(), seen.x[1].data(), seen.x[2].data()},
                            &model,
                            seen.threshold,
                            model.limits()},
                           nullptr);
      if (!rehearsal) clip.score(frame, decisions[i]->mask(), &counts[i]);
    };
    // Labels that are none throw here.
    decide(0);
    pool->run(sets.size() - 1, [&](size_t part) { decide(part + 1); });
    frame += !rehearsal;
  });
  std::vector<double> all;
  for (const MaskCounts& of : counts) all.push_back(of.f_measure().value_or(1));
  return all;
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app(
      "Markdown table: mean F of masks over the sequences that have them, at the element's "
      "defaults but for one constant of the decision; CDnet's rules.");
  std::vector<std::string> datasets;
  std::vector<double> factors = {0.7, 1.4};
  app.add_option("--dataset", datasets, "folder of sequences; again for more")->required();
  app.add_option("--factors", factors, "what constants are multiplied by")->delimiter(',');
  std::string only;
  app.add_option("--only", only, "constants whose names begin so");
  CLI11_PARSE(app, argc, argv);

  // The first set is what the element has.
  std::vector<DecisionConstants> sets(1);
  std::vector<Constant> all = constants();
  std::erase_if(
      all, [&](const Constant& constant) { return !std::string(constant.name).starts_with(only); });
  for (const Constant& constant : all)
    for (double factor : factors) {
      sets.emplace_back();
      constant.scale(sets.back(), factor);
    }
  std::vector<double> sums(sets.size());
  int count = 0;
  Pool pool(static_cast<int>(std::max(1u, std::thread::hardware_concurrency())));
  for (const std::string& dataset : datasets)
    for (const Sequence& sequence : find_sequences(dataset)) {
      if (sequence.masks.empty()) continue;
      std::fprintf(stderr, "\r%-60s", sequence.name.c_str());
      const auto found = scores(read_scored_clip(sequence), sets, &pool);
      for (size_t i = 0; i < sets.size(); ++i) sums[i] += found[i];
      ++count;
    }
  std::fprintf(stderr, "\n");
  if (count == 0) throw std::runtime_error("there is no sequence with masks");

  std::printf("| constant | x 1 |");
  for (double factor : factors) std::printf(" x %g |", factor);
  std::printf("\n|---|---|");
  for (size_t i = 0; i < factors.size(); ++i) std::printf("---|");
  std::printf("\n");
  size_t set = 1;
  for (const Constant& constant : all) {
    std::printf("| %s | %.3f |", constant.name, sums[0] / count);
    for (size_t i = 0; i < factors.size(); ++i) std::printf(" %.3f |", sums[set++] / count);
    std::printf("\n");
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
