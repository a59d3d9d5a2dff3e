// SPDX-License-Identifier: LGPL-2.1-or-later
// What was learnt, given to another engine.
#include "core/model/learnt_file.h"

#include <cstdlib>
#include <iterator>
#include <utility>

#include "core/passes/grid.h"
#include "tests/core/live_util.h"

namespace qdmd::test {
namespace {

// An engine for pictures of width x height, fed from planes.
struct Box {
  int width, height;
  Engine engine;
  Wishes wishes;  // of each frame that comes

  Box(int width_, int height_, const EngineOptions& options)
      : width(width_), height(height_), wishes(first_wishes(options)) {
    const Status status = engine.configure(options, width, height);
    EXPECT_TRUE(status.ok()) << status.message;
  }
  std::vector<std::vector<uint8_t>> push(const std::vector<uint8_t>& planes,
                                         Output output = Output::background) {
    PackedPicture picture(width, height);
    picture.fill(planes);
    EXPECT_TRUE(engine.push(picture.in(), &wishes).ok());
    return pop(output);
  }
  std::vector<std::vector<uint8_t>> pop(Output output = Output::background) {
    std::vector<std::vector<uint8_t>> all;
    while (engine.next()) {
      PackedPicture out(width, height);
      engine.next()->pop(output, out.out());
      all.push_back(out.planes());
    }
    return all;
  }
  std::vector<uint8_t> background() {
    PackedPicture out(width, height);
    EXPECT_TRUE(engine.write_background(out.out()));
    return out.planes();
  }
  Learnt learnt() {
    Learnt learnt;
    EXPECT_TRUE(engine.learnt(&learnt));
    return learnt;
  }
};

std::vector<uint8_t> planes_of(const Learnt& learnt) {
  std::vector<uint8_t> planes;
  for (const auto& level : learnt.picture.level)
    planes.insert(planes.end(), level.begin(), level.end());
  return planes;
}

// A still picture with a bright block that walks, or stays at `at`.
constexpr int kWidth = 64, kHeight = 48;
std::vector<uint8_t> scene(int at, int light = 100) {
  std::vector<uint8_t> planes;
  for (int c = 0; c < 3; ++c)
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const bool block = x >= at && x < at + 10 && y >= 16 && y < 34;
        const int level = block ? 230 - 60 * c : 60 + (7 * x + 3 * y + 31 * c) % 60;
        planes.push_back(static_cast<uint8_t>(level * light / 100));
      }
  return planes;
}
std::vector<uint8_t> walking(int t) { return scene((3 * t) % 80 - 12); }
std::vector<uint8_t> empty_scene() { return scene(-100); }

EngineOptions options_of(Mode mode, Method method, int window = 30) {
  EngineOptions options;
  options.mode = mode;
  options.method = method;
  options.window_size = window;
  options.threads = 2;
  return options;
}

// What an engine learns from the scene.
Learnt learnt_by(const EngineOptions& options, int frames = 60) {
  Box box(kWidth, kHeight, options);
  for (int t = 0; t < frames; ++t) box.push(walking(t));
  return box.learnt();
}

double mean_distance(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
  return sum / static_cast<double>(a.size());
}

// One level.
Learnt plain(int width, int height) {
  Learnt learnt;
  learnt.width = width;
  learnt.height = height;
  for (auto& level : learnt.picture.level) level.assign(static_cast<size_t>(width * height), 77);
  return learnt;
}

TEST(Learnt, NothingIsKnownBeforeTheFirstSolve) {
  Learnt learnt = plain(5, 3);
  Engine none;
  EXPECT_FALSE(none.learnt(&learnt));
  EXPECT_EQ(Status::Code::not_configured, none.learn_from(learnt).code);
  Box box(kWidth, kHeight, options_of(Mode::batch, Method::robust));
  for (int t = 0; t < 20; ++t) box.push(walking(t));
  EXPECT_FALSE(box.engine.learnt(&learnt));
  EXPECT_EQ(pack(learnt), pack(plain(5, 3)));
}

TEST(Learnt, AnotherSizeIsRefusedAndChangesNothing) {
  Box box(kWidth, kHeight, options_of(Mode::live, Method::robust));
  for (int t = 0; t < 40; ++t) box.push(walking(t));
  const auto before = pack(box.learnt());
  const Status status = box.engine.learn_from(plain(5, 3));
  EXPECT_EQ(Status::Code::invalid_options, status.code);
  EXPECT_NE(std::string::npos, status.message.find("5x3")) << status.message;
  EXPECT_NE(std::string::npos, status.message.find("64x48")) << status.message;
  EXPECT_EQ(before, pack(box.learnt()));
}

TEST(Learnt, SavedAndLoadedIsTheSameFile) {
  for (Method method : {Method::robust, Method::qdmd, Method::dmd})
    for (Mode mode : {Mode::live, Mode::batch}) {
      const auto options = options_of(mode, method);
      Box first(kWidth, kHeight, options);
      for (int t = 0; t < 60; ++t) first.push(walking(t));
      const Learnt learnt = first.learnt();
      EXPECT_EQ(first.background(), planes_of(learnt));
      EXPECT_EQ(method == Method::robust, learnt.earlier.has_value());
      EXPECT_EQ(method == Method::robust, !learnt.limits.empty());
      if (learnt.earlier) {
        EXPECT_EQ(learnt.earlier->places.size(), learnt.earlier->weight.size());
      }
      Learnt read;
      ASSERT_TRUE(unpack(pack(learnt), &read).ok());
      Box second(kWidth, kHeight, options);
      ASSERT_TRUE(second.engine.learn_from(read).ok());
      EXPECT_EQ(pack(learnt), pack(second.learnt()));
      EXPECT_EQ(planes_of(learnt), second.background());
      EXPECT_EQ(0u, second.engine.report().solves);
      EXPECT_EQ(first.engine.report().solve.foreground.threshold,
                second.engine.report().solve.foreground.threshold);
    }
}

TEST(Learnt, LiveHasItsBackgroundWithTheFirstFrame) {
  for (Method method : {Method::robust, Method::qdmd}) {
    const auto options = options_of(Mode::live, method);
    const Learnt learnt = learnt_by(options);
    Box box(kWidth, kHeight, options);
    ASSERT_TRUE(box.engine.learn_from(learnt).ok());
    // A segment comes before the first frame.
    ASSERT_TRUE(box.engine.drain().ok());
    // Somebody stands there from the start.
    const auto pictures = box.push(scene(20));
    ASSERT_EQ(1u, pictures.size());
    EXPECT_EQ(planes_of(learnt), pictures[0]);
    EXPECT_EQ(0u, box.engine.report().solves);
    const auto mask = box.push(scene(20), Output::mask)[0];
    EXPECT_EQ(255, mask[static_cast<size_t>(25 * kWidth + 25)]);
    // Q-DMD's picture has traces of who walked.
    if (method == Method::robust) {
      EXPECT_EQ(0, mask[static_cast<size_t>(25 * kWidth + 45)]);
    }
    for (int t = 0; t < 40; ++t) box.push(walking(t));
    EXPECT_GT(box.engine.report().solves, 0u);
    EXPECT_LT(mean_distance(box.background(), empty_scene()), 4);
  }
}

TEST(Learnt, LiveFollowsTheLight) {
  const auto options = options_of(Mode::live, Method::robust);
  const Learnt learnt = learnt_by(options);
  Box box(kWidth, kHeight, options);
  ASSERT_TRUE(box.engine.learn_from(learnt).ok());
  const auto dim = box.push(scene(20, 60));
  EXPECT_LT(mean_distance(dim[0], scene(-100, 60)), 2);
  EXPECT_EQ(planes_of(learnt), box.background()) << "what is saved has its own light";
}

TEST(Learnt, WhileLiveLosesNoFrame) {
  const auto options = options_of(Mode::live, Method::robust);
  const Learnt learnt = learnt_by(options);
  Box box(kWidth, kHeight, options);
  size_t frames = 0;
  for (int t = 0; t < 200; ++t) {
    PackedPicture picture(kWidth, kHeight);
    picture.fill(scene(20));
    ASSERT_TRUE(box.engine.push(picture.in()).ok());
    // Between a frame and its picture, too.
    if (t == 90 || t == 95 || t == 163) {
      ASSERT_TRUE(box.engine.learn_from(learnt).ok());
      EXPECT_EQ(planes_of(learnt), box.background());
    }
    const auto out = box.pop();
    frames += out.size();
    if (t == 90 || t == 91) {
      EXPECT_EQ(planes_of(learnt), out[0]) << t;
    }
  }
  EXPECT_EQ(200u, frames);
}

TEST(Learnt, BatchIsToldOfIt) {
  const auto options = options_of(Mode::batch, Method::robust);
  const Learnt learnt = learnt_by(options);
  const auto standing = [](int t) { return scene(t < 18 ? 20 : 70); };
  const auto window = [&](Box& box) {
    std::vector<std::vector<uint8_t>> all;
    for (int t = 0; t < 30; ++t)
      for (auto& picture : box.push(standing(t))) all.push_back(std::move(picture));
    EXPECT_TRUE(box.engine.drain().ok());
    for (auto& picture : box.pop()) all.push_back(std::move(picture));
    return all;
  };
  Box told(kWidth, kHeight, options), alone(kWidth, kHeight, options);
  ASSERT_TRUE(told.engine.learn_from(learnt).ok());
  EXPECT_EQ(planes_of(learnt), told.background());
  const auto with = window(told), without = window(alone);
  ASSERT_EQ(30u, with.size());
  ASSERT_EQ(30u, without.size());
  EXPECT_EQ(1u, told.engine.report().solves);
  EXPECT_LT(mean_distance(with[5], empty_scene()), 2);
  // What is confirmed weighs more than what one window saw.
  const auto weight = [](Box& box) { return box.learnt().earlier.value().weight.front(); };
  EXPECT_GE(weight(told), weight(alone) + learnt.earlier->weight.front());
  EXPECT_GT(learnt.earlier->weight.front(), 10);
}

// A version of this may have another grid: what it knew is not lost.
TEST(Learnt, OfAnotherGridIsToldCellByCell) {
  const auto options = options_of(Mode::batch, Method::robust);
  Learnt learnt = learnt_by(options);
  ASSERT_TRUE(learnt.earlier);
  for (int part : {2, 3, 5}) {
    Learnt coarse = learnt;
    auto& grid = coarse.earlier.value();
    const auto fine = learnt.earlier.value();
    grid.rows = (fine.rows + part - 1) / part;
    grid.cols = (fine.cols + part - 1) / part;
    grid.weight.clear();
    grid.limit.clear();
    grid.looked.clear();
    grid.places.clear();
    for (int cell = 0; cell < grid.rows * grid.cols; ++cell) {
      grid.weight.push_back(static_cast<float>(cell));
      grid.limit.push_back(static_cast<float>(2 * cell));
      grid.looked.push_back(static_cast<float>(3 * cell));
      LearntPlace& place = grid.places.emplace_back();
      place.since = static_cast<uint32_t>(cell);
    }
    Box told(kWidth, kHeight, options);
    ASSERT_TRUE(told.engine.learn_from(coarse).ok());
    const Learnt known = told.learnt();
    ASSERT_TRUE(known.earlier);
    ASSERT_EQ(known.earlier->rows, fine.rows);
    ASSERT_EQ(known.earlier->cols, fine.cols);
    for (int row = 0; row < fine.rows; ++row)
      for (int col = 0; col < fine.cols; ++col) {
        // The cell at the middle of this one.
        const int its_row = (2 * row + 1) * grid.rows / (2 * fine.rows),
                  its_col = (2 * col + 1) * grid.cols / (2 * fine.cols);
        const auto cell = static_cast<size_t>(row * fine.cols + col);
        const auto its = static_cast<float>(its_row * grid.cols + its_col);
        ASSERT_EQ(known.earlier->weight[cell], its) << row << ' ' << col;
        ASSERT_EQ(known.earlier->limit[cell], 2 * its) << row << ' ' << col;
        ASSERT_EQ(known.earlier->looked[cell], 3 * its) << row << ' ' << col;
        ASSERT_EQ(known.earlier->places[cell].since, static_cast<uint32_t>(its));
      }
  }
}

TEST(Learnt, FrozenFromTheStartNothingIsSolved) {
  for (Mode mode : {Mode::live, Mode::batch})
    for (Method method : {Method::robust, Method::qdmd}) {
      const auto options = options_of(mode, method);
      const Learnt learnt = learnt_by(options);
      Box box(kWidth, kHeight, options);
      box.wishes.freeze = true;
      ASSERT_TRUE(box.engine.learn_from(learnt).ok());
      size_t frames = 0;
      const auto see = [&](const std::vector<std::vector<uint8_t>>& pictures) {
        for (const auto& picture : pictures) {
          EXPECT_EQ(planes_of(learnt), picture) << frames;
          ++frames;
        }
      };
      for (int t = 0; t < 70; ++t) see(box.push(scene(20)));
      ASSERT_TRUE(box.engine.drain().ok());
      see(box.pop());
      EXPECT_EQ(70u, frames);
      EXPECT_EQ(0u, box.engine.report().solves);
      box.wishes.freeze = false;
      for (int t = 0; t < 70; ++t) box.push(walking(t));
      EXPECT_GT(box.engine.report().solves, 0u);
    }
}

// Windows that had begun by then keep the background that they have.
TEST(Learnt, WhileABatchIsFrozenTheNextWindowHasIt) {
  for (double rate : {0.0, 1e9})
    for (int at : {5, 29, 30, 31, 44, 59, 60, 61}) {
      SCOPED_TRACE(std::to_string(at) + " frames, then the load, at " + std::to_string(rate));
      auto options = options_of(Mode::batch, Method::robust);
      const Learnt learnt = plain(kWidth, kHeight);
      options.frame_rate = rate;
      Box box(kWidth, kHeight, options);
      std::vector<std::vector<uint8_t>> pictures;
      const auto see = [&](std::vector<std::vector<uint8_t>> more) {
        std::move(more.begin(), more.end(), std::back_inserter(pictures));
      };
      for (int t = 0; t < 130; ++t) {
        if (t == 30) box.wishes.freeze = true;
        if (t == at) {
          ASSERT_TRUE(box.engine.learn_from(learnt).ok());
        }
        see(box.push(walking(t)));
      }
      ASSERT_TRUE(box.engine.drain().ok());
      see(box.pop());
      ASSERT_EQ(130u, pictures.size());
      const int from = (at + 29) / 30 * 30;
      for (int t = 30; t < 130; ++t)
        ASSERT_EQ(t >= from, pictures[static_cast<size_t>(t)] == planes_of(learnt)) << t;
      EXPECT_EQ(1u, box.engine.report().solves);
    }
}

// Without a freeze, what was learnt is told to windows, and none shows it, now or later.
TEST(Learnt, WhileABatchIsSolvedNoWindowShowsIt) {
  auto options = options_of(Mode::batch, Method::qdmd);
  options.frame_rate = 1e9;
  const Learnt learnt = plain(kWidth, kHeight);
  Box box(kWidth, kHeight, options);
  for (int t = 0; t < 250; ++t) {
    if (t == 44) {
      ASSERT_TRUE(box.engine.learn_from(learnt).ok());
    }
    if (t == 90) box.wishes.freeze = true;
    for (const auto& picture : box.push(walking(t))) ASSERT_NE(planes_of(learnt), picture) << t;
  }
}

TEST(Learnt, WhileABatchWaitsEveryFrameLeaves) {
  const auto options = options_of(Mode::batch, Method::robust);
  const Learnt learnt = learnt_by(options);
  for (int at : {0, 1, 15, 29, 30, 31, 44, 59, 60}) {
    Box box(kWidth, kHeight, options);
    size_t frames = 0;
    for (int t = 0; t < 75; ++t) {
      if (t == at) {
        ASSERT_TRUE(box.engine.learn_from(learnt).ok());
      }
      if (t == at && at < 30) {
        EXPECT_EQ(planes_of(learnt), box.background());
      }
      for (const auto& picture : box.push(walking(t))) {
        ++frames;
        EXPECT_LT(mean_distance(picture, empty_scene()), 4) << at << " " << t;
      }
    }
    ASSERT_TRUE(box.engine.drain().ok());
    frames += box.pop().size();
    EXPECT_EQ(75u, frames) << at;
    EXPECT_EQ(3u, box.engine.report().solves) << at;
  }
}

TEST(Learnt, FlushForgetsIt) {
  for (Mode mode : {Mode::live, Mode::batch}) {
    const auto options = options_of(mode, Method::robust);
    Box box(kWidth, kHeight, options);
    ASSERT_TRUE(box.engine.learn_from(learnt_by(options)).ok());
    box.engine.flush();
    Learnt learnt;
    EXPECT_FALSE(box.engine.learnt(&learnt));
  }
}

// What one method saved, another takes: the picture, and no more than it can use.
TEST(Learnt, MethodsExchangeFiles) {
  const Learnt robust = learnt_by(options_of(Mode::live, Method::robust));
  const Learnt plain = learnt_by(options_of(Mode::live, Method::qdmd));
  Box first(kWidth, kHeight, options_of(Mode::live, Method::qdmd));
  ASSERT_TRUE(first.engine.learn_from(robust).ok());
  EXPECT_EQ(planes_of(robust), first.push(scene(20))[0]);
  EXPECT_FALSE(first.learnt().earlier.has_value());
  Box second(kWidth, kHeight, options_of(Mode::live, Method::robust));
  ASSERT_TRUE(second.engine.learn_from(plain).ok());
  EXPECT_LT(mean_distance(planes_of(plain), second.push(scene(20))[0]), 4);
  EXPECT_FALSE(second.learnt().earlier.has_value());
}

}  // namespace
}  // namespace qdmd::test
