// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/bench/accuracy_quality.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>

#include "core/engine/engine.h"
#include "core/metrics/picture_scores.h"
#include "core/scene/scene.h"
#include "tests/bench/accuracy_segmentation.h"
#include "tests/core/solver_names.h"
#include "tests/evaluation/classic_methods.h"
#include "tests/evaluation/clip.h"

namespace qdmd::bench {
namespace {

using evaluation::view_of;

// Frames whose backgrounds are looked at, evenly spread with both ends.
constexpr size_t kSpread = 16;
// A window that has every clip in it.
constexpr int kWhole = 300;

struct Setting {
  Method method = Method::robust;
  Solver solver = Solver::automatic;
  int rank = 0, step = 0, window = kWhole, iterations = 1;
};

std::vector<Setting> settings(bool brief) {
  std::vector<Setting> all;
  const auto robust = [&](int window, int rank, int step, int iterations) {
    all.push_back({Method::robust, Solver::automatic, rank, step, window, iterations});
  };
  const auto qdmd = [&](Solver solver, int window, int rank, int step) {
    all.push_back({Method::qdmd, solver, rank, step, window, 1});
  };
  if (brief) {
    robust(kWhole, 0, 0, 1);
    qdmd(Solver::automatic, kWhole, 0, 1);
    qdmd(Solver::automatic, kWhole, 0, 4);
    qdmd(Solver::qr, 10, 1, 1);
    return all;
  }
  // What matters for the front; sample-step 0 is the default.
  for (int window : {25, 50, 100, 200, kWhole})
    for (int iterations : {1, 2})
      for (int step : {0, 8}) robust(window, 0, step, iterations);
  // One thing at a time around the defaults, in one window.
  robust(kWhole, 0, 0, 4);
  for (int rank : {2, 3}) robust(kWhole, rank, 0, 1);
  for (int step : {1, 2, 16}) robust(kWhole, 0, step, 1);
  for (int rank : {1, 3, 0})
    for (int step : {1, 2, 4, 8, 16}) qdmd(Solver::automatic, kWhole, rank, step);
  for (int window : {25, 50, 100})
    for (int rank : {1, 0}) qdmd(Solver::automatic, window, rank, 1);
  for (int window : {25, 100})
    for (Solver solver : {Solver::gram, Solver::gram_extended})
      for (int rank : {1, 0}) qdmd(solver, window, rank, 1);
  // A QR factorization of more frames takes minutes.
  for (int rank : {1, 0}) qdmd(Solver::qr, 25, rank, 1);
  for (int rank : {1, 0}) all.push_back({Method::dmd, Solver::automatic, rank, 1, kWhole, 1});
  return all;
}

const char* name_of(Method method) {
  switch (method) {
    case Method::qdmd:
      return "qdmd";
    case Method::dmd:
      return "dmd";
    case Method::robust:
      break;
  }
  return "robust";
}

using Pictures = std::map<size_t, cv::Mat>;  // by frame

std::vector<size_t> spread_frames(size_t count) {
  std::vector<size_t> frames;
  const size_t spread = std::min(kSpread, count);
  for (size_t i = 0; i < spread; ++i)
    frames.push_back(spread > 1 ? i * (count - 1) / (spread - 1) : 0);
  return frames;
}

// One truth is that of one light: where it does not vary, backgrounds are scored in the middle of
// each window, as in docs/notebook/robust.md, because those of other times may rightly have another
// light.
std::vector<size_t> scored_frames(const TrueClip& clip, int window) {
  const size_t count = clip.frames.size();
  if (clip.truths.size() > 1) return spread_frames(count);
  const size_t size = std::min(static_cast<size_t>(window), count);
  std::vector<size_t> frames;
  for (size_t first = 0; first + size <= count; first += size)
    frames.push_back(first + (size - 1) / 2);
  return frames;
}

EngineOptions engine_options(const Setting& setting, size_t frames) {
  EngineOptions options;
  options.method = setting.method;
  options.dmd.solver = setting.solver;
  options.dmd.rank = setting.rank;
  options.sample_step = setting.step;
  options.window_size = std::min(setting.window, static_cast<int>(frames));
  options.iterations = setting.iterations;
  options.max_memory = UINT64_MAX;
  options.threads = 1;
  return options;
}

void require(const Status& status) {
  if (!status.ok()) throw std::runtime_error(status.message);
}

// The clip through the engine; `keep`, where there is one, gets the backgrounds that are looked at.
void separate(const Setting& setting, const TrueClip& clip, Pictures* keep) {
  const cv::Size size = clip.frames[0].size();
  std::set<size_t> wanted;
  if (keep) {
    for (size_t frame : spread_frames(clip.frames.size())) wanted.insert(frame);
    for (size_t frame : scored_frames(clip, setting.window)) wanted.insert(frame);
  }
  Engine engine;
  require(engine.configure(engine_options(setting, clip.frames.size()), size.width, size.height));
  cv::Mat picture(size, CV_8UC3);
  size_t popped = 0;
  const auto take = [&] {
    for (; engine.next(); ++popped) {
      engine.next()->pop(Output::background, view_of(picture));
      if (wanted.contains(popped)) keep->emplace(popped, picture.clone());
    }
  };
  for (const cv::Mat& frame : clip.frames) {
    require(engine.push(view_of(frame)));
    take();
  }
  require(engine.drain());
  take();
}

void score(const TrueClip& clip, const Pictures& pictures, int window, Values* values) {
  const auto truth_of = [&](size_t frame) {
    return view_of(clip.truths.size() > 1 ? clip.truths[frame] : clip.truths[0]);
  };
  const auto found_in = [&](size_t frame) { return view_of(pictures.at(frame)); };
  const std::vector<size_t> frames = scored_frames(clip, window);
  const auto count = static_cast<double>(frames.size());
  double age = 0, noise = 0, colour = 0, worst = 0;
  for (size_t frame : frames) {
    const auto found = luma(found_in(frame)), truth = luma(truth_of(frame));
    age += average_grey_error(found, truth) / count;
    noise += psnr(found, truth) / count;
    colour += colour_quality(found_in(frame), truth_of(frame)) / count;
  }
  for (size_t frame : spread_frames(clip.frames.size()))
    worst = std::max(worst, average_grey_error(luma(found_in(frame)), luma(truth_of(frame))));
  (*values)["age"] = age;
  (*values)["age_worst"] = worst;
  (*values)["psnr"] = noise;
  (*values)["cqm"] = colour;
}

// Mean absolute difference of levels, in the frame where it is largest.
double distance(const Pictures& a, const Pictures& b) {
  double worst = 0;
  for (const auto& [frame, picture] : a)
    worst = std::max(worst, cv::norm(picture, b.at(frame), cv::NORM_L1) /
                                static_cast<double>(picture.total() * 3));
  return worst;
}

// One row in the making.
struct Entry {
  Point point;
  Values values;
  std::function<Pictures()> pictures;
  std::function<void()> work;
  std::optional<Setting> setting;
};

Entry entry_of(const TrueClip& clip, const Setting& setting) {
  const cv::Size size = clip.frames[0].size();
  Entry entry;
  entry.point = {"quality",
                 clip.scenes,
                 clip.name,
                 name_of(setting.method),
                 test::name_of(setting.solver),
                 setting.rank,
                 setting.step,
                 setting.window,
                 setting.iterations,
                 size.width,
                 size.height};
  entry.setting = setting;
  entry.values["layout_mb"] =
      static_cast<double>(
          EnginePlan(engine_options(setting, clip.frames.size()), size.width, size.height)
              .layout()
              .bytes) /
      (1 << 20);
  entry.pictures = [&clip, setting] {
    Pictures pictures;
    separate(setting, clip, &pictures);
    return pictures;
  };
  entry.work = [&clip, setting] { separate(setting, clip, nullptr); };
  return entry;
}

Entry entry_of(const TrueClip& clip, const evaluation::Method* peer) {
  const cv::Size size = clip.frames[0].size();
  Entry entry;
  entry.point = {"quality", clip.scenes, clip.name, peer->name(), "-",        0,
                 1,         kWhole,      1,         size.width,   size.height};
  // One background for all frames.
  entry.pictures = [&clip, peer] {
    const cv::Mat background = peer->separate({clip.frames}).background;
    Pictures pictures;
    for (size_t frame : spread_frames(clip.frames.size())) pictures[frame] = background;
    for (size_t frame : scored_frames(clip, kWhole)) pictures[frame] = background;
    return pictures;
  };
  entry.work = [&clip, peer] { peer->separate({clip.frames}); };
  return entry;
}

}  // namespace

TrueClip simulated(const std::string& scene, int width, int height, int frames) {
  TrueClip clip{"scene", scene, {}, {}};
  scene::SceneOptions options;
  options.width = width, options.height = height;
  scene::Scene source(options, scene);
  const auto bgr = [](const scene::Picture& picture) {
    cv::Mat result;
    cv::cvtColor(cv::Mat(picture.height, picture.width, CV_8UC3,
                         const_cast<uint8_t*>(picture.samples.data())),
                 result, cv::COLOR_RGB2BGR);
    return result;
  };
  for (int t = 0; t < frames; ++t) {
    source.render(t, scene::kFrame | scene::kTruth);
    clip.frames.push_back(bgr(source.frame()));
    clip.truths.push_back(bgr(source.background()));
  }
  return clip;
}

void measure_quality(const TrueClip& clip, const QualityLimits& limits, Table* table,
                     evaluation::Progress* progress) {
  const evaluation::Methods peers = evaluation::classic_methods();
  std::vector<Entry> entries;
  for (const Setting& setting : settings(limits.brief)) entries.push_back(entry_of(clip, setting));
  for (const auto& peer : peers) entries.push_back(entry_of(clip, peer.get()));
  if (auto work = segmentation_of(clip.frames)) {
    Entry entry = entry_of(clip, peers.front().get());
    entry.point.method = "segmentation";
    entry.work = work;
    entry.pictures = [work] {
      work();
      return Pictures();
    };
    entries.push_back(entry);
  } else {
    progress->problem("segmentation", "GStreamer has no such element here: it is left out");
  }
  std::erase_if(entries, [&](const Entry& entry) { return table->has(entry.point); });

  // What sampling moves is seen beside all pixels of the same rank.
  std::map<int, Pictures> whole;
  for (Entry& entry : entries) {
    Pictures pictures;
    try {
      entry.values["peak_mb"] = peak_megabytes([&] { pictures = entry.pictures(); });
    } catch (const std::runtime_error& error) {
      progress->problem(clip.name, entry.point.method + ": " + error.what());
      entry.work = nullptr;
      continue;
    }
    if (pictures.empty()) continue;
    score(clip, pictures, entry.point.window, &entry.values);
    if (!entry.setting || entry.setting->method != Method::qdmd ||
        entry.setting->solver != Solver::automatic || entry.setting->window != kWhole)
      continue;
    Setting all = *entry.setting;
    all.step = 1;
    auto& reference = whole[all.rank];
    if (entry.setting->step == 1) reference = pictures;
    if (reference.empty()) separate(all, clip, &reference);
    entry.values["moved"] = distance(reference, pictures);
  }
  std::erase_if(entries, [](const Entry& entry) { return !entry.work; });

  std::vector<Job> jobs;
  for (const Entry& entry : entries)
    jobs.push_back({entry.work, static_cast<double>(clip.frames.size())});
  const auto times = in_turn(jobs, limits.turns, limits.seconds);
  for (size_t i = 0; i < entries.size(); ++i) {
    times[i].put(&entries[i].values);
    table->add(entries[i].point, entries[i].values);
  }
}

}  // namespace qdmd::bench
