// SPDX-License-Identifier: LGPL-2.1-or-later
// Engines that have some rows of the same pictures each, and add their sums up, find the
// backgrounds of the whole pictures, to the last bit.
#include <gtest/gtest.h>

#include <barrier>
#include <cmath>
#include <random>
#include <thread>

#include "core/engine/engine.h"
#include "tests/core/engine_util.h"

namespace qdmd::test {
namespace {

// Numbers of several threads, added up.
class Adder {
 public:
  explicit Adder(size_t threads) : meeting_(static_cast<ptrdiff_t>(threads)), parts_(threads) {}

  void add(size_t thread, std::span<int64_t> values) {
    parts_[thread] = values;
    meeting_.arrive_and_wait();
    std::vector<int64_t> sums(values.size());
    for (const std::span<int64_t>& part : parts_)
      for (size_t i = 0; i < sums.size(); ++i) sums[i] += part[i];
    meeting_.arrive_and_wait();
    std::copy(sums.begin(), sums.end(), values.begin());
  }

 private:
  std::barrier<> meeting_;
  std::vector<std::span<int64_t>> parts_;
};

struct Case {
  int width, height, frames;
  EngineOptions options;
};

EngineOptions options_of(Method method, int window) {
  EngineOptions options;
  options.method = method;
  options.window_size = window;
  options.threads = 1;
  return options;
}

// Level of a noisy wall that a box crosses.
uint8_t level(const Case& c, int t, int x, int y, int channel) {
  const bool box = std::abs(y - t * 7 % c.height) < 9 && std::abs(x - t * 5 % c.width) < 12;
  const unsigned noise = static_cast<unsigned>(t * 7919 + x * 131 + y * 17 + channel) * 2654435761u;
  return static_cast<uint8_t>((box ? 30 + 90 * channel : 60 + (3 * x + 2 * y + 31 * channel) % 97) +
                              static_cast<int>(noise >> 29));
}

// Rows first .. end - 1 of a frame. Pixels that share a sample have that of the first one.
struct Rows {
  std::vector<uint8_t> channel[3];
  ImageView view;

  Rows(const Case& c, int t, int first, int end) {
    view.width = c.width;
    view.height = end - first;
    for (int k = 0; k < 3; ++k) {
      const int columns = k > 0 ? c.options.chroma_columns : 1,
                rows = k > 0 ? c.options.chroma_rows : 1;
      std::vector<uint8_t>& samples = channel[k];
      for (int y = first; y < end; y += rows)
        for (int x = 0; x < c.width; x += columns) samples.push_back(level(c, t, x, y, k));
      view.channel[k] = samples.data();
      view.own[k] = {1, (c.width + columns - 1) / columns, columns, rows};
    }
  }
};

struct Found {
  std::vector<uint8_t> backgrounds;  // of each frame, one after the other
  std::vector<double> said;          // of each solve
};

Found run(const Case& c, int first, int end, std::function<void(std::span<int64_t>)> add = {}) {
  EngineOptions options = c.options;
  options.first_row = first;
  options.add = std::move(add);
  Engine engine;
  const Status status = engine.configure(options, c.width, end - first);
  EXPECT_TRUE(status.ok()) << status.message;
  Found found;
  PackedPicture out(c.width, end - first);
  uint64_t solves = 0;
  const auto take = [&] {
    while (engine.next()) {
      engine.next()->write(Output::background, {}, out.out());
      engine.next()->skip();
      found.backgrounds.insert(found.backgrounds.end(), out.bytes.begin(), out.bytes.end());
      const EngineReport report = engine.report();
      if (std::exchange(solves, report.solves) == report.solves) continue;
      const DmdSummary& dmd = report.solve.dmd;
      for (double value : {dmd.lambda.real(), dmd.lambda.imag(), dmd.residual, dmd.condition,
                           dmd.rounding_bound, dmd.sensitivity, double(dmd.rank)})
        found.said.push_back(value);
    }
  };
  for (int t = 0; t < c.frames; ++t) {
    EXPECT_TRUE(engine.push(Rows(c, t, first, end).view).ok());
    take();
  }
  EXPECT_TRUE(engine.drain().ok());
  take();
  return found;
}

// tops: where parts begin, the first aside.
void expect_as_whole(const Case& c, const std::vector<int>& tops) {
  const Found whole = run(c, 0, c.height);
  Adder adder(tops.size() + 1);
  std::vector<Found> parts(tops.size() + 1);
  std::vector<std::thread> threads;
  for (size_t i = 0; i < parts.size(); ++i)
    threads.emplace_back([&, i] {
      parts[i] = run(c, i > 0 ? tops[i - 1] : 0, i < tops.size() ? tops[i] : c.height,
                     [&adder, i](std::span<int64_t> values) { adder.add(i, values); });
    });
  for (std::thread& thread : threads) thread.join();
  std::vector<uint8_t> joined;
  for (int t = 0; t < c.frames; ++t)
    for (const Found& part : parts) {
      const auto size = static_cast<ptrdiff_t>(part.backgrounds.size()) / c.frames;
      joined.insert(joined.end(), part.backgrounds.begin() + t * size,
                    part.backgrounds.begin() + (t + 1) * size);
    }
  EXPECT_TRUE(joined == whole.backgrounds);
  for (const Found& part : parts) EXPECT_EQ(part.said, whole.said);
}

TEST(AddedRows, OfQdmdAndDmd) {
  expect_as_whole({129, 125, 30, options_of(Method::qdmd, 12)}, {});
  expect_as_whole({129, 125, 30, options_of(Method::qdmd, 12)}, {1, 60, 62});
  expect_as_whole({130, 121, 25, options_of(Method::dmd, 11)}, {47, 80});
}

TEST(AddedRows, OfSampledPixelsAtLowRank) {
  EngineOptions options = options_of(Method::qdmd, 10);
  options.sample_step = 4;
  options.dmd.rank = 3;
  options.dmd.omega_threshold = 0.5;
  // A part of one row may have no sample.
  expect_as_whole({83, 79, 23, options}, {13, 14, 40});
}

TEST(AddedRows, CombinedDirectlyOfManyModes) {
  EngineOptions options = options_of(Method::qdmd, 8);
  options.dmd.omega_threshold = 4;
  expect_as_whole({61, 57, 17, options}, {14, 29, 43});
}

TEST(AddedRows, OfPixelsThatShareChroma) {
  for (Method method : {Method::qdmd, Method::dmd})
    for (int rows : {1, 2}) {
      EngineOptions options = options_of(method, 12);
      options.colours = Colours::yuv;
      options.chroma_columns = 2;
      options.chroma_rows = rows;
      expect_as_whole({129, 125, 30, options}, {2, 62});
      options.sample_step = 3;
      expect_as_whole({65, 43, 20, options}, {10, 20});
    }
}

TEST(AddedRows, WithAnotherEstimator) {
  EngineOptions options = options_of(Method::qdmd, 8);
  options.dmd.estimator = Estimator::optimized;
  expect_as_whole({61, 57, 17, options}, {20});
}

TEST(AddedRows, AreRefusedWhereTheyAreNotEnough) {
  const auto accepts = [](auto change) {
    EngineOptions options = options_of(Method::qdmd, 8);
    options.add = [](std::span<int64_t>) {};
    change(&options);
    Engine engine;
    return engine.configure(options, 64, 64).ok();
  };
  EXPECT_TRUE(accepts([](EngineOptions*) {}));
  EXPECT_FALSE(accepts([](EngineOptions* options) { options->method = Method::robust; }));
  EXPECT_FALSE(accepts([](EngineOptions* options) { options->dmd.solver = Solver::qr; }));
  EXPECT_FALSE(accepts([](EngineOptions* options) { options->dmd.solver = Solver::adjoint; }));
  EXPECT_FALSE(accepts([](EngineOptions* options) { options->mode = Mode::live; }));
  EXPECT_FALSE(
      accepts([](EngineOptions* options) { options->stabilize = Stabilize::translation; }));
  EXPECT_FALSE(accepts([](EngineOptions* options) {
    options->colours = Colours::yuv;
    options->chroma_columns = options->chroma_rows = 2;
    options->first_row = 1;
  }));
}

}  // namespace
}  // namespace qdmd::test
