// SPDX-License-Identifier: LGPL-2.1-or-later
// The time budget: what it chooses from what it measured. Times are made up: a slow machine changes
// nothing here.
#include "core/engine/time_budget.h"

#include <chrono>
#include <limits>

#include "tests/core/robust_util.h"

namespace qdmd::test {
namespace {

const std::vector<Effort> kFront = front_of_efforts({2, 4, 8, 16});

// Stretches of 10 frames on a machine on which a frame takes `frame` seconds, and a solve `once`,
// and `samples` for those at step 2.
struct Machine {
  TimeBudget budget;
  double frame = 0.001, once = 0.08, samples = 0.02;
  int solves = 0, stretches = 0, newest_age = 0, oldest_age = 0;
  double seconds = 0;

  explicit Machine(double allowed, const std::vector<Effort>& front = kFront) {
    budget.begin(front, 10);
    budget.set(allowed);
  }
  void run(int count, double noise = 0, uint32_t seed = 1) {
    std::mt19937 rng(seed);
    std::uniform_real_distribution<double> factor(1 - noise, 1 + noise);
    for (int i = 0; i < count; ++i) {
      const double f = factor(rng);
      SolveCost solve;
      if (budget.next()) {
        const Effort& effort = budget.effort();
        const double share = 4.0 / (effort.sample_step * effort.sample_step);
        solve = {once * f, samples * share * f};
        ++solves;
        newest_age = 0;
      }
      oldest_age = std::max(oldest_age, ++newest_age);
      const double all = 10 * frame * f + solve.sum();
      budget.add(10, all, solve);
      seconds += all;
      ++stretches;
    }
  }
  double predicted() const { return budget.predicted(budget.effort()); }
  void slow_down(double factor) {
    for (double* part : {&frame, &once, &samples}) *part *= factor;
  }
  // Seconds a frame of the next `count` stretches.
  double mean_of(int count, double noise = 0, uint32_t seed = 1) {
    const double before = seconds;
    run(count, noise, seed);
    return (seconds - before) / (10 * count);
  }
};

TEST(FrontOfEfforts, GivesUpSamplesThenSolves) {
  ASSERT_EQ(kFront.size(), 11u);
  EXPECT_EQ(kFront[0], (Effort{1, 2}));
  EXPECT_EQ(kFront[1], (Effort{1, 4}));
  EXPECT_EQ(kFront[2], (Effort{1, 8}));
  EXPECT_EQ(kFront[3], (Effort{1, 16}));
  EXPECT_EQ(kFront[4], (Effort{2, 16}));
  EXPECT_EQ(kFront.back(), (Effort{TimeBudget::kMostPeriod, 16}));
}

std::vector<int> steps_of(const LearnOptions& options, int width, int height) {
  return Learner::make(options, width, height)->sample_steps();
}

// The step that robust chooses leaves room for one that is twice as coarse.
TEST(SampleSteps, HaveACoarserOneThanTheDefault) {
  for (const auto& [width, height] :
       {std::pair{320, 240}, {768, 576}, {1280, 720}, {1920, 1080}, {640, 480}}) {
    const std::vector<int> steps = steps_of({}, width, height);
    ASSERT_GE(steps.size(), 2u) << width << "x" << height;
    EXPECT_EQ(steps[0], layout_of({}, width, height).sample_step);
    EXPECT_EQ(steps[1], 2 * steps[0]);
  }
}

TEST(SampleSteps, AreOneForSmallPicturesAndPlainMethods) {
  LearnOptions options;
  options.sample_step = 1;
  EXPECT_EQ(steps_of(options, 40, 40), std::vector<int>{1});
  EXPECT_EQ(steps_of(options, 1, 1), std::vector<int>{1});
  for (Method method : {Method::qdmd, Method::dmd}) {
    options.method = method;
    EXPECT_EQ(steps_of(options, 640, 480), std::vector<int>{1});
  }
}

TEST(TimeBudget, WithoutOneEveryStretchHasTheBest) {
  Machine machine(0);
  machine.run(50);
  EXPECT_EQ(machine.solves, 50);
  EXPECT_EQ(machine.budget.effort(), kFront[0]);
  EXPECT_NEAR(machine.predicted(), 0.011, 1e-12);
  // 0.08 + 0.02 / 16 for each solve at step 8.
  EXPECT_NEAR(machine.budget.predicted({2, 8}), 0.001 + 0.08125 / 20, 1e-12);
}

// A solve takes 0.01 a frame of its stretch, 0.0085, 0.0081 or 0.008; 0.001 are not to be had back.
TEST(TimeBudget, TakesTheBestThatFits) {
  for (const auto& [allowed, chosen] : {std::pair{0.02, Effort{1, 2}},
                                        {0.0165, Effort{1, 2}},
                                        {0.0155, Effort{1, 2}},
                                        {0.0108, Effort{1, 4}},
                                        {0.0093, Effort{1, 8}},
                                        {0.0053, Effort{2, 16}},
                                        {0.0048, Effort{3, 16}},
                                        {0.0018, Effort{12, 16}},
                                        {0.0005, Effort{16, 16}}}) {
    Machine machine(allowed);
    machine.run(400);
    EXPECT_EQ(machine.budget.effort(), chosen) << allowed;
    // What the first stretches took too much is paid back to the last second.
    if (allowed > 0.0016) {
      EXPECT_LE(machine.seconds / (10 * machine.stretches), allowed) << allowed;
    }
    // Before the first stretch nobody knows what a solve takes, and after it some wait.
    EXPECT_NEAR(machine.solves, 400.0 / chosen.period, 1);
    EXPECT_LE(machine.oldest_age, TimeBudget::kMostPeriod);
  }
}

// Sums of up to 640 stretches, whose times the model has met 160 times before: 0.75^160 of its
// first guess is left.
double rounding_of(double predicted) { return 640 * kEpsilon * predicted; }

TEST(TimeBudget, ThePredictionComesTrue) {
  for (const auto& [allowed, chosen] : {std::pair{0.0, kFront[0]},
                                        {0.0165, kFront[0]},
                                        {0.0155, kFront[0]},
                                        {0.0108, kFront[1]},
                                        {0.0093, kFront[2]},
                                        {0.0053, kFront[4]},
                                        {0.0048, kFront[5]},
                                        {0.0018, kFront[9]},
                                        {0.0005, kFront[10]}}) {
    Machine machine(allowed);
    machine.run(160);
    EXPECT_EQ(machine.budget.effort(), chosen) << allowed;
    // Whole periods of any effort.
    const double measured = machine.mean_of(480), predicted = machine.predicted();
    EXPECT_NEAR(measured, predicted, rounding_of(predicted)) << allowed;
    if (allowed > 0.0016) {
      EXPECT_LE(predicted, allowed);
    }
  }
}

// What one effort took says what others take, once it is known what a frame takes without a solve.
TEST(TimeBudget, TheModelForetellsOtherEfforts) {
  for (const double allowed : {0.0, 0.0093, 0.0048}) {
    Machine machine(allowed);
    machine.run(160);
    for (const Effort& other : kFront) {
      Machine fixed(0, {other});
      fixed.run(160);
      const double measured = fixed.mean_of(480);
      EXPECT_NEAR(machine.budget.predicted(other), measured, rounding_of(measured)) << allowed;
    }
  }
}

TEST(TimeBudget, MoreIsNeverWorse) {
  size_t last = kFront.size();
  for (double allowed = 0.0005; allowed < 0.04; allowed *= 1.07) {
    Machine machine(allowed);
    machine.run(100);
    const auto place = static_cast<size_t>(
        std::find(kFront.begin(), kFront.end(), machine.budget.effort()) - kFront.begin());
    EXPECT_LE(place, last);
    last = place;
  }
  EXPECT_EQ(last, 0u);
}

// Nothing is known of the first stretch. What it took too much is paid back by the next ones.
TEST(TimeBudget, TheFirstStretchIsPaidBack) {
  Machine machine(0.004);
  machine.run(1);
  EXPECT_GT(machine.seconds / 10, 2 * 0.004);
  machine.run(19);
  EXPECT_LE(machine.seconds / 200, 0.004);
}

// Measurements that waver by a tenth: the choice changes at the beginning, then hardly ever.
TEST(TimeBudget, DoesNotFlap) {
  for (double allowed : {0.0165, 0.0115, 0.0095, 0.0061, 0.0045, 0.0021})
    for (uint32_t seed = 1; seed <= 5; ++seed) {
      Machine machine(allowed);
      machine.run(20, 0.1, seed);
      int changes = 0;
      for (uint32_t i = 0; i < 300; ++i) {
        const Effort before = machine.budget.effort();
        machine.run(1, 0.1, seed * 1000 + i);
        changes += machine.budget.effort() != before;
      }
      EXPECT_LE(changes, 6) << allowed << " seed " << seed;
    }
}

TEST(TimeBudget, ALoadIsKnownAfterTwoStretches) {
  Machine machine(0.0055);
  machine.run(50);
  EXPECT_EQ(machine.budget.effort(), (Effort{2, 16}));
  // Everything takes twice as long: 0.002 + 0.016 / p must not exceed 0.0055.
  machine.slow_down(2);
  machine.run(2);
  EXPECT_GE(machine.budget.effort().period, 4);
  EXPECT_LE(machine.mean_of(40), 0.0055);
  EXPECT_NEAR(machine.budget.effort().period, 5, 1);
  machine.slow_down(0.5);
  machine.run(20);
  EXPECT_LE(machine.budget.effort().period, 3);
}

// Whatever a busy machine took before, it is not paid back for ever.
TEST(TimeBudget, AfterALongLoadSolvesComeBack) {
  Machine machine(0.0055);
  machine.run(20);
  machine.slow_down(50);
  machine.run(100);
  machine.slow_down(1 / 50.0);
  machine.run(50);
  const int before = machine.solves;
  machine.run(30);
  EXPECT_GE(machine.solves - before, 10);
}

// A slider, or a program that follows something, moves it all the time.
TEST(TimeBudget, ChangingItBuysNoSolves) {
  Machine machine(0.0018);
  machine.run(60);
  const int before = machine.solves;
  for (int i = 0; i < 60; ++i) {
    machine.budget.set(i % 2 ? 0.0018 : 0.00181);
    machine.run(1);
  }
  EXPECT_LE(machine.solves - before, 6);
}

TEST(TimeBudget, WhatIsNoNumberIsNoLimit) {
  Machine machine(std::numeric_limits<double>::quiet_NaN());
  machine.run(5);
  EXPECT_FALSE(machine.budget.limited());
  EXPECT_EQ(machine.solves, 5);
}

// After a break in time comes another scene; and a window that ended early is no measure.
TEST(TimeBudget, ABreakIsFollowedByASolveAndSpoilsNothing) {
  Machine machine(0.0055);
  machine.run(20);
  const double predicted = machine.predicted();
  machine.budget.next();
  machine.budget.add(1, 0.1, {0.1, 0});
  EXPECT_EQ(machine.predicted(), predicted);
  machine.budget.solve_next();
  EXPECT_TRUE(machine.budget.next());
}

TEST(TimeBudget, AnotherOneTakesEffectAtOnce) {
  Machine machine(0.0055);
  machine.run(10);
  machine.budget.set(0.0018);
  EXPECT_EQ(machine.budget.effort(), (Effort{12, 16}));
  machine.budget.set(0);
  const int before = machine.solves;
  machine.run(10);
  EXPECT_EQ(machine.solves - before, 10);
}

// In live mode hops are short while the window fills up.
TEST(TimeBudget, StretchesOfOtherLengthsAreOfTheSameSolve) {
  TimeBudget budget;
  budget.begin(kFront, 10);
  for (int frames : {1, 2, 4, 8, 10}) {
    EXPECT_TRUE(budget.next());
    budget.add(frames, 0.001 * frames + 0.1, {0.1, 0});
  }
  EXPECT_NEAR(budget.predicted(kFront[0]), 0.001 + 0.01, 1e-12);
}

// ---- In the engine ----

// Seconds that a frame takes beside the engine, which is told of them: a clock of the test's own.
// What the engine itself takes does not show beside them, however slow the machine is.
constexpr double kBeside = 1e6, kBesideEngine = 1e-3 * kBeside;

// Frames of real work.
class BudgetOfEngine : public testing::TestWithParam<std::tuple<Mode, Method>> {
 protected:
  static constexpr int kSide = 128, kFrames = 240;

  struct Outcome {
    uint64_t solves = 0;
    EngineReport report;               // at the end
    std::vector<SolveReport> reports;  // of each solve
    double seconds = 0;                // in all of push() and pop()
    Clock::Spent spent;
    std::vector<std::vector<uint8_t>> pictures;
  };
  // allowed: seconds for each frame; 0: no limit.
  static Outcome run(double allowed, int iterations = 1, int count = kFrames,
                     Method method = std::get<1>(GetParam())) {
    EngineOptions options;
    options.iterations = iterations;
    options.mode = std::get<0>(GetParam());
    options.method = method;
    options.window_size = 20;
    options.hop_size = 20;
    options.threads = 1;
    Engine engine;
    EXPECT_TRUE(engine.configure(options, kSide, kSide).ok());
    Wishes wishes = first_wishes(options);
    wishes.time_budget = allowed;
    std::mt19937 rng(7);
    std::vector<PackedPicture> frames;
    for (int k = 0; k < 12; ++k) {
      frames.emplace_back(kSide, kSide);
      std::vector<uint8_t> planes(size_t{3} * kSide * kSide);
      for (auto& sample : planes) sample = static_cast<uint8_t>(100 + rng() % 9);
      frames.back().fill(planes);
    }
    Outcome outcome;
    PackedPicture out(kSide, kSide);
    const auto timed = [&](const auto& work) {
      const auto start = std::chrono::steady_clock::now();
      work();
      outcome.seconds +=
          std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    const auto take = [&] {
      while (engine.next()) {
        timed([&] { engine.next()->pop(Output::background, out.out()); });
        outcome.pictures.push_back(out.planes());
      }
    };
    for (int t = 0; t < count; ++t) {
      timed([&] {
        EXPECT_TRUE(engine.push(frames[static_cast<size_t>(t * 5 % 12)].in(), &wishes).ok());
      });
      take();
      EXPECT_EQ(engine.report().pending, std::min(t + 1, engine.report().delay));
      engine.clock().charge(Clock::frames, kBeside);
      if (engine.report().solves > outcome.reports.size())
        outcome.reports.push_back(engine.report().solve);
    }
    timed([&] { EXPECT_TRUE(engine.drain().ok()); });
    take();
    outcome.solves = engine.report().solves;
    outcome.report = engine.report();
    outcome.spent = engine.clock().spent();
    return outcome;
  }
};

TEST_P(BudgetOfEngine, WhatFramesTakeBesideTheEngineCounts) {
  const EngineReport report = run(0).report;
  EXPECT_NEAR(report.costs.predicted(report.effort), kBeside, kBesideEngine);
  EXPECT_EQ(report.effort.period, 1);
  // A frame takes it with a solve and without.
  EXPECT_NEAR(report.costs.predicted({TimeBudget::kMostPeriod, 1}), kBeside, kBesideEngine);
}

// So little that a single frame forbids the next solves.
TEST_P(BudgetOfEngine, WhereNothingFitsSolvesAreRareAndNoFrameIsLost) {
  // In live mode a solve says what solves take only when the window is full.
  constexpr int kCount = 360;
  const Outcome free = run(0, 1, kCount), limited = run(1e-3 * kBeside, 1, kCount);
  // It leaves out no solves by itself.
  const uint64_t stretches = run(0, 1, kCount, Method::qdmd).solves;
  EXPECT_EQ(free.pictures.size(), static_cast<size_t>(kCount));
  EXPECT_EQ(limited.pictures.size(), static_cast<size_t>(kCount)) << "no frame is lost";
  EXPECT_EQ(limited.report.effort.period, TimeBudget::kMostPeriod);
  EXPECT_EQ(limited.solves, 1 + (stretches - 1) / TimeBudget::kMostPeriod);
}

TEST_P(BudgetOfEngine, WithRoomForEverythingNothingChanges) {
  const Outcome free = run(0), wide = run(2 * kBeside);
  EXPECT_EQ(wide.report.effort.period, 1);
  EXPECT_EQ(free.solves, wide.solves);
  EXPECT_EQ(free.pictures, wide.pictures);
}

// On one thread they lie within push() and pop(), one after another, on the same clock.
TEST_P(BudgetOfEngine, PartsOfACostAreNoMoreThanTheWhole) {
  const bool robust = std::get<1>(GetParam()) == Method::robust;
  for (int iterations : {1, 3}) {
    const Outcome outcome = run(0, iterations);
    EXPECT_EQ(outcome.reports.size(), outcome.solves);
    double sum = 0;
    for (const SolveReport& report : outcome.reports) {
      EXPECT_GT(report.solve_time, 0);
      sum += report.solve_time;
    }
    const Clock::Spent& spent = outcome.spent;
    EXPECT_GT(spent.of(Clock::solving), 0);
    // Each method has one of them.
    EXPECT_EQ(spent.of(Clock::samples) > 0, robust);
    EXPECT_EQ(spent.of(Clock::products) > 0, !robust);
    EXPECT_LE(sum, spent.of_solves() + rounding_of(spent.of_solves()));
    EXPECT_LE(spent.all() - kFrames * kBeside, outcome.seconds + rounding_of(spent.all()));
  }
}

INSTANTIATE_TEST_SUITE_P(Modes, BudgetOfEngine,
                         testing::Combine(testing::Values(Mode::batch, Mode::live),
                                          testing::Values(Method::robust, Method::qdmd)));

// An engine for pictures of a scene that changes in nothing but its light.
struct Separator {
  static constexpr int kSide = 64, kSamples = 3 * kSide * kSide;
  Engine engine;
  Wishes wishes;
  PackedPicture frame{kSide, kSide}, out{kSide, kSide};

  Separator(Mode mode, int window, int hop = 0, int threads = 1) {
    EngineOptions options;
    options.mode = mode;
    options.window_size = window;
    options.hop_size = hop;
    options.threads = threads;
    EXPECT_TRUE(engine.configure(options, kSide, kSide).ok());
    wishes = first_wishes(options);
  }
  static double level(int sample, double light) { return (80 + sample % 97) * light; }
  void push(double light) {
    std::vector<uint8_t> planes;
    for (int i = 0; i < kSamples; ++i)
      planes.push_back(static_cast<uint8_t>(std::lround(level(i, light))));
    frame.fill(planes);
    EXPECT_TRUE(engine.push(frame.in(), &wishes).ok());
  }
  // How far the next background is from the scene in that light, in levels on average.
  double pop(double light) {
    engine.next()->pop(Output::background, out.out());
    const std::vector<uint8_t> seen = out.planes();
    double sum = 0;
    for (int i = 0; i < kSamples; ++i)
      sum += std::abs(seen[static_cast<size_t>(i)] - level(i, light));
    return sum / kSamples;
  }
};

// What a live frame takes without a solve is not shared among the frames of a period.
TEST(BudgetOfLive, KnowsWhatFramesTakeWithoutSolves) {
  for (int threads : {1, 2}) {
    Separator separator(Mode::live, 20, 20, threads);
    for (int t = 0; t < 100; ++t) {
      separator.push(1);
      separator.pop(1);
      separator.engine.clock().charge(Clock::frames, kBeside);
    }
    const CostModel costs = separator.engine.report().costs;
    for (const Effort& effort : {Effort{1, 1}, Effort{TimeBudget::kMostPeriod, 1}})
      EXPECT_NEAR(costs.predicted(effort), kBeside, kBesideEngine);
  }
}

// The first windows say that the light rises. A background that is kept follows the light as it
// is; it does not go on to rise.
TEST(BudgetOfLive, ABackgroundThatIsKeptFollowsTheLight) {
  constexpr int kWindow = 20;
  Separator separator(Mode::live, kWindow);
  for (int t = 0; t < 15 * kWindow; ++t) {
    // From now on a solve is rare.
    if (t == 3 * kWindow) separator.wishes.time_budget = 1e-9;
    const double light = 0.6 + 0.4 * std::min(1.0, t / (3.0 * kWindow));
    separator.push(light);
    const double error = separator.pop(light);
    if (t >= 3 * kWindow) {
      EXPECT_LE(error, 2) << "frame " << t;
    }
  }
}

// Who lets go of a frozen background has another one at once, in the light that there is.
TEST(BudgetOfBatch, AfterFreezeTheFirstWindowIsSolved) {
  constexpr int kWindow = 10;
  const auto light = [](int frame) { return std::max(0.6, 1 - 0.04 * frame); };
  Separator separator(Mode::batch, kWindow);
  separator.wishes.time_budget = 1e-9;
  int popped = 0;
  const auto take = [&] {
    for (; separator.engine.next(); ++popped) {
      const double error = separator.pop(light(popped));
      // From there on the light does not change.
      if (popped >= 3 * kWindow) {
        EXPECT_LE(error, 1.5) << "frame " << popped;
      }
    }
  };
  for (int t = 0; t < 8 * kWindow; ++t) {
    separator.wishes.freeze = t >= kWindow && t < 3 * kWindow;
    separator.push(light(t));
    take();
    EXPECT_EQ(popped, std::max(0, t + 2 - kWindow));
  }
  EXPECT_TRUE(separator.engine.drain().ok());
  take();
  EXPECT_EQ(popped, 8 * kWindow);
  EXPECT_EQ(separator.engine.report().solves, 2u);
}

// A budget that nothing fits leaves the background of the first window; the light is followed all
// the same.
TEST(BudgetOfBatch, ABackgroundThatIsKeptFollowsTheLight) {
  constexpr int kWindow = 10;
  const auto light = [](int frame) { return frame < kWindow ? 1 : 1 - frame / 100.0; };
  Separator separator(Mode::batch, kWindow);
  separator.wishes.time_budget = 1e-9;
  int popped = 0;
  const auto take = [&] {
    // Both roundings, and the gain's.
    for (; separator.engine.next(); ++popped)
      EXPECT_LE(separator.pop(light(popped)), 1.5) << "frame " << popped;
  };
  for (int t = 0; t < 4 * kWindow; ++t) {
    separator.push(light(t));
    take();
    EXPECT_EQ(popped, std::max(0, t + 2 - kWindow));
  }
  EXPECT_TRUE(separator.engine.drain().ok());
  take();
  EXPECT_EQ(popped, 4 * kWindow);
  EXPECT_EQ(separator.engine.report().solves, 1u);
}

}  // namespace
}  // namespace qdmd::test
