// SPDX-License-Identifier: LGPL-2.1-or-later
// What each step of a mask costs: the decision with all steps and without each in turn, soft edges,
// and specks and regions beside OpenCV's connected components. One thread, and the time that it
// computed, because others may use the machine.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "core/foreground/decision.h"
#include "core/foreground/regions.h"
#include "core/foreground/soft_mask.h"
#include "core/passes/planes.h"
#include "tests/bench/camera.h"
#include "tests/bench/clock.h"

namespace {

using namespace qdmd;
using namespace qdmd::bench;

constexpr int kFrames = 24;

struct Size {
  int width, height;
  size_t pixels() const { return size_t(width) * size_t(height); }
  std::string name() const { return std::to_string(width) + "x" + std::to_string(height); }
};

// Frames with boxes on a tenth of their pixels, and their median, which has none.
struct Street {
  explicit Street(const Size& size_) : size(size_) {
    const Camera camera(size.width, size.height, 3);
    std::vector<uint8_t> packed(camera.frame_bytes());
    frames.resize(kFrames);
    for (int t = 0; t < kFrames; ++t) {
      camera.render(7 * t, packed.data());
      for (size_t c = 0; c < 3; ++c) {
        auto& plane = frames[size_t(t)].emplace_back(size.pixels());
        for (size_t p = 0; p < plane.size(); ++p) plane[p] = packed[3 * p + c];
      }
    }
    std::vector<uint8_t> background[3], seen(kFrames);
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < size.pixels(); ++p) {
        for (size_t t = 0; t < kFrames; ++t) seen[t] = frames[t][c][p];
        std::nth_element(seen.begin(), seen.begin() + kFrames / 2, seen.end());
        background[c].push_back(seen[kFrames / 2]);
      }
    model.make_room(size.pixels(), false);
    model.freeze_as({8, {background[0], background[1], background[2]}, {}}, nullptr, size.pixels());
    model.set_time(0);
    limits.assign(size.pixels(), 30);
  }

  Comparison frame(bool noisy) const {
    const auto& planes = frames[size_t(turn)];
    Comparison all = {{planes[0].data(), planes[1].data(), planes[2].data()}, &model, 18};
    if (noisy) all.threshold = 40, all.limits = limits.data();
    return all;
  }
  void next() { turn = (turn + 1) % kFrames; }

  Size size;
  std::vector<std::vector<std::vector<uint8_t>>> frames;
  BackgroundModel model;
  std::vector<uint8_t> limits;
  int turn = 0;
};

// Made once for all benchmarks of a size.
Street& street_of(const Size& size) {
  static std::unique_ptr<Street> street;
  if (!street || street->size.pixels() != size.pixels()) {
    street.reset();
    street = std::make_unique<Street>(size);
  }
  return *street;
}

// setup() gives what is measured; it returns the seconds that it took.
using Turn = std::function<double(Street&)>;
void add(const std::string& name, const Size& size, std::function<Turn(Street&)> setup) {
  benchmark::RegisterBenchmark((name + "/" + size.name()).c_str(),
                               [=](benchmark::State& state) {
                                 Street& street = street_of(size);
                                 const Turn turn = setup(street);
                                 std::vector<double> times;
                                 // Textures and noise are known.
                                 for (int t = 0; t < 2 * kFrames; ++t) turn(street), street.next();
                                 for (auto _ : state) {
                                   times.push_back(turn(street));
                                   state.SetIterationTime(times.back());
                                   street.next();
                                 }
                                 state.counters["ns/pixel"] =
                                     1e9 * median(times) / static_cast<double>(size.pixels());
                               })
      ->Unit(benchmark::kMicrosecond)
      ->UseManualTime();
}

template <typename Work>
double computed(Work&& work) {
  return seconds_of(work, CLOCK_THREAD_CPUTIME_ID);
}

std::shared_ptr<Decision> decision_of(const Street& street, const DecisionSteps& steps = {}) {
  return std::make_shared<Decision>(street.size.width, street.size.height, Colours::rgb, steps);
}

// ignored: or null.
void add_decision(const std::string& name, const Size& size, const DecisionSteps& steps,
                  bool noisy = false, std::shared_ptr<const IgnoredAreas> ignored = nullptr) {
  add("decide/" + name, size, [=](Street& made) -> Turn {
    return [=, decision = decision_of(made, steps)](Street& street) {
      Comparison frame = street.frame(noisy);
      frame.ignored = ignored.get();
      return computed([&] { decision->decide(frame, nullptr); });
    };
  });
}

void add_softness(int softness, const Size& size) {
  add("soft/" + std::to_string(softness), size, [=](Street& made) -> Turn {
    return [=, decision = decision_of(made),
            soft = std::make_shared<SoftMask>(size.width, size.height)](Street& street) {
      const Comparison frame = street.frame(false);
      decision->decide(frame, nullptr);
      const uint8_t* const x[3] = {frame.x[0].high, frame.x[1].high, frame.x[2].high};
      return computed([&] { soft->make(*decision, x, {softness, 18}, {}, nullptr); });
    };
  });
}

constexpr int kSpeck = 5000, kHole = 500;  // of the picture's pixels, as Decision has them

void take_out(Specks* specks, cv::Mat* mask) {
  specks->take_out(mask->data, 255, mask->total() / kSpeck, true);
  specks->take_out(mask->data, 0, mask->total() / kHole, false);
}

struct Labels {
  cv::Mat inverted, labels, stats, centroids;
  std::vector<uint8_t> colours;
};

// What specks.cpp does, with OpenCV.
void take_out(Labels* all, cv::Mat* mask) {
  const auto one = [&](const cv::Mat& from, uint8_t colour, size_t least, int connectivity) {
    const int count = cv::connectedComponentsWithStats(from, all->labels, all->stats,
                                                       all->centroids, connectivity, CV_32S);
    all->colours.assign(static_cast<size_t>(count), colour);
    all->colours[0] = static_cast<uint8_t>(~colour);
    for (int part = 1; part < count; ++part)
      if (static_cast<size_t>(all->stats.at<int>(part, cv::CC_STAT_AREA)) < least)
        all->colours[static_cast<size_t>(part)] = static_cast<uint8_t>(~colour);
    for (int y = 0; y < mask->rows; ++y) {
      const int* label = all->labels.ptr<int>(y);
      uint8_t* to = mask->ptr<uint8_t>(y);
      for (int x = 0; x < mask->cols; ++x) to[x] = all->colours[static_cast<size_t>(label[x])];
    }
  };
  one(*mask, 255, mask->total() / kSpeck, 8);
  cv::bitwise_not(*mask, all->inverted);
  one(all->inverted, 0, mask->total() / kHole, 4);
}

// Adds masks after the vote; many: with a speck of 4 x 4 pixels in every 1600 pixels, too.
template <typename Finder>
void add_specks(const std::string& name, const Size& size, bool many,
                std::function<std::shared_ptr<Finder>()> make) {
  add("specks/" + name, size, [=](Street& made) -> Turn {
    DecisionSteps steps;
    steps.specks = false;
    return [=, decision = decision_of(made, steps), finder = make()](Street& street) {
      decision->decide(street.frame(false), nullptr);
      cv::Mat mask(size.height, size.width, CV_8UC1);
      std::copy_n(decision->mask(), size.pixels(), mask.data);
      for (int y = 10; many && y + 4 < size.height; y += 40)
        for (int x = (y * 7) % 30; x + 4 < size.width; x += 40) {
          cv::Mat speck = mask(cv::Rect(x, y, 4, 4));
          cv::bitwise_not(speck, speck);
        }
      return computed([&] { take_out(finder.get(), &mask); });
    };
  });
}

// What regions() looks at, and what OpenCV takes for the parts alone: foreground that grows by a
// 1/120 of the short side, and its labels.
struct GrownLabels {
  cv::Mat square, joined, labels;
};

size_t count_regions(RegionFinder* finder, const cv::Mat& mask, const uint8_t* residual) {
  return finder->find(mask.data, residual, mask.cols, mask.rows, 0).size();
}

size_t count_regions(GrownLabels* all, const cv::Mat& mask, const uint8_t*) {
  if (all->square.empty()) {
    const int side = 2 * std::max(1, int(std::lround(std::min(mask.cols, mask.rows) / 120.0))) + 1;
    all->square = cv::getStructuringElement(cv::MORPH_RECT, {side, side});
  }
  cv::dilate(mask, all->joined, all->square);
  return size_t(cv::connectedComponents(all->joined, all->labels, 8, CV_32S));
}

template <typename Finder>
void add_regions(const std::string& name, const Size& size) {
  add("regions/" + name, size, [=](Street& made) -> Turn {
    return [=, decision = decision_of(made), finder = std::make_shared<Finder>(),
            residual = std::vector<uint8_t>(size.pixels(), 40)](Street& street) {
      decision->decide(street.frame(false), nullptr);
      const cv::Mat mask(size.height, size.width, CV_8UC1, const_cast<uint8_t*>(decision->mask()));
      return computed(
          [&] { benchmark::DoNotOptimize(count_regions(finder.get(), mask, residual.data())); });
    };
  });
}

void add_all(const Size& size) {
  add_decision("all", size, {});
  const std::pair<const char*, bool DecisionSteps::*> steps[] = {
      {"noise", &DecisionSteps::noise},       {"texture", &DecisionSteps::texture},
      {"light", &DecisionSteps::light},       {"vote", &DecisionSteps::vote},
      {"specks", &DecisionSteps::specks},     {"hard", &DecisionSteps::hard},
      {"flat", &DecisionSteps::flat},         {"edges", &DecisionSteps::edges},
      {"overlays", &DecisionSteps::overlays},
  };
  for (const auto& [name, step] : steps) {
    DecisionSteps without;
    without.*step = false;
    add_decision(std::string("without_") + name, size, without);
  }
  add_decision("alone", size,
               {false, false, false, false, false, false, false, false, false, false});
  const auto half = std::make_shared<IgnoredAreas>();
  half->add({0, 0, size.width, size.height / 2});
  add_decision("half_ignored", size, {}, false, half);
  DecisionSteps rough;
  rough.smooth = false;
  add_decision("noisy", size, {}, true);
  add_decision("noisy_without_smooth", size, rough, true);
  for (int softness : {1, 2, 4, 8, kMostSoftness}) add_softness(softness, size);
  for (bool many : {false, true}) {
    const std::string masks = many ? "many" : "few";
    add_specks<Specks>("ours/" + masks, size, many,
                       [=] { return std::make_shared<Specks>(size.width, size.height); });
    add_specks<Labels>("opencv/" + masks, size, many, [] { return std::make_shared<Labels>(); });
  }
  add_regions<RegionFinder>("ours", size);
  add_regions<GrownLabels>("opencv", size);
}

}  // namespace

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  for (const Size& size : {Size{320, 240}, Size{768, 576}, Size{1920, 1080}}) add_all(size);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
