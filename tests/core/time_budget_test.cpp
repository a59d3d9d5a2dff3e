// The time budget: what it chooses from what it measured, and whether that comes true.
#include "core/background/time_budget.h"

#include <chrono>

#include "tests/core/robust_util.h"

namespace qdmd::test {
namespace {

// Stretches of 10 frames on a machine on which a frame takes `frame` seconds and a solve `solve`.
struct Machine {
  TimeBudget budget;
  double frame = 0.001, solve = 0.1;
  int solves = 0, stretches = 0;
  double seconds = 0;

  explicit Machine(double allowed) { budget.set(allowed); }
  void run(int count, double noise = 0, uint32_t seed = 1) {
    std::mt19937 rng(seed);
    std::uniform_real_distribution<double> factor(1 - noise, 1 + noise);
    for (int i = 0; i < count; ++i) {
      const bool solved = budget.next();
      const double f = factor(rng), of_solve = solved ? solve * f : 0;
      const double all = 10 * frame * f + of_solve;
      budget.add(10, all, of_solve);
      seconds += all;
      ++stretches;
      solves += solved;
    }
  }
  double mean() const { return seconds / (10 * stretches); }
};

TEST(TimeBudget, WithoutOneEveryStretchIsSolved) {
  Machine machine(0);
  machine.run(50);
  EXPECT_EQ(machine.solves, 50);
  EXPECT_EQ(machine.budget.period(), 1);
  EXPECT_NEAR(machine.budget.predicted(), 0.011, 1e-12);
}

// One solve in a stretch costs 0.01 a frame, one in p 0.01 / p; 0.001 are not to be had back.
TEST(TimeBudget, SolvesAsOftenAsItAllows) {
  for (const auto& [allowed, period] : {std::pair{0.02, 1},
                                        {0.0115, 1},
                                        {0.0061, 2},
                                        {0.0059, 3},
                                        {0.0036, 4},
                                        {0.00205, 10},
                                        {0.0005, 16}}) {
    Machine machine(allowed);
    machine.run(400);
    EXPECT_EQ(machine.budget.period(), period) << allowed;
    if (allowed > 0.0017) {
      EXPECT_LE(machine.mean(), 1.05 * allowed) << allowed;
    }
    EXPECT_NEAR(machine.solves, 400.0 / period, 3);
  }
}

TEST(TimeBudget, MoreIsNeverSolvedMoreSeldom) {
  int last = TimeBudget::kMostPeriod + 1;
  for (double allowed = 0.0005; allowed < 0.03; allowed *= 1.07) {
    Machine machine(allowed);
    machine.run(100);
    EXPECT_LE(machine.budget.period(), last);
    last = machine.budget.period();
  }
  EXPECT_EQ(last, 1);
}

// Measurements that waver by a tenth: the choice changes at the beginning, then hardly ever.
TEST(TimeBudget, DoesNotFlap) {
  for (double allowed : {0.0125, 0.0061, 0.0045, 0.0036, 0.0021})
    for (uint32_t seed = 1; seed <= 5; ++seed) {
      Machine machine(allowed);
      machine.run(20, 0.1, seed);
      int changes = 0;
      for (uint32_t i = 0; i < 300; ++i) {
        const int before = machine.budget.period();
        machine.run(1, 0.1, seed * 1000 + i);
        changes += machine.budget.period() != before;
      }
      EXPECT_LE(changes, 6) << allowed << " seed " << seed;
    }
}

TEST(TimeBudget, ALoadIsKnownAfterTwoStretches) {
  Machine machine(0.0061);
  machine.run(50);
  EXPECT_EQ(machine.budget.period(), 2);
  // Everything takes twice as long: 0.002 + 0.02 / p must not exceed 0.0061.
  machine.frame *= 2;
  machine.solve *= 2;
  machine.run(2);
  EXPECT_GE(machine.budget.period(), 4);
  machine.run(20);
  EXPECT_NEAR(machine.budget.period(), 5, 1);
  machine.frame /= 2;
  machine.solve /= 2;
  machine.run(40);
  EXPECT_LE(machine.budget.period(), 3);
}

TEST(TimeBudget, AnotherOneTakesEffectAtOnce) {
  Machine machine(0.0061);
  machine.run(10);
  machine.budget.set(0.00205);
  EXPECT_EQ(machine.budget.period(), 10);
  machine.budget.set(0);
  const int before = machine.solves;
  machine.run(10);
  EXPECT_EQ(machine.solves - before, 10);
}

// ---- In the engine ----

// Frames of real work: the cost model against the clock. Times are those of this machine at this
// moment, so they are compared with each other only.
class BudgetOfEngine : public testing::TestWithParam<std::tuple<Mode, Method>> {
 protected:
  static constexpr int kSide = 128, kFrames = 240;

  struct Outcome {
    uint64_t solves = 0;
    double predicted = 0, measured = 0;  // seconds a frame; the latter of the second half
    int period = 0;
    std::vector<std::vector<uint8_t>> pictures;
  };
  // seconds: allowed for each frame; 0: no limit.
  static Outcome run(double seconds, int threads = 1) {
    EngineOptions options;
    options.mode = std::get<0>(GetParam());
    options.dmd.method = std::get<1>(GetParam());
    options.window_size = 20;
    options.hop_size = 20;
    options.threads = threads;
    Engine engine;
    EXPECT_TRUE(engine.configure(options, kSide, kSide).ok());
    engine.set_time_budget(seconds);
    std::mt19937 rng(7);
    std::vector<Picture> frames;
    for (int k = 0; k < 12; ++k) {
      frames.emplace_back(kSide, kSide);
      std::vector<uint8_t> planes(size_t{3} * kSide * kSide);
      for (auto& sample : planes) sample = static_cast<uint8_t>(100 + rng() % 9);
      frames.back().fill(planes);
    }
    Outcome outcome;
    Picture out(kSide, kSide);
    double total = 0;
    for (int t = 0; t < kFrames; ++t) {
      const auto start = std::chrono::steady_clock::now();
      EXPECT_TRUE(engine.push(frames[static_cast<size_t>(t * 5 % 12)].in()).ok());
      int ready = 0;
      for (; engine.ready(); ++ready) {
        engine.pop(Output::background, out.out());
        outcome.pictures.push_back({});
      }
      if (t >= kFrames / 2)
        total += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      if (ready > 0) outcome.pictures.back() = out.planes();
    }
    outcome.measured = total / (kFrames - kFrames / 2);
    outcome.solves = engine.solves();
    outcome.predicted = engine.time_budget().predicted();
    outcome.period = engine.time_budget().period();
    return outcome;
  }
};

TEST_P(BudgetOfEngine, ThePredictionComesTrueWithinHalfAsMuch) {
  // The machine may be disturbed: one of three tries must do.
  double worst = 0;
  for (int attempt = 0; attempt < 3; ++attempt) {
    const Outcome free = run(0);
    const Outcome limited = run(0.6 * free.measured);
    EXPECT_EQ(free.pictures.size(), static_cast<size_t>(kFrames));
    EXPECT_EQ(limited.pictures.size(), static_cast<size_t>(kFrames)) << "no frame is lost";
    EXPECT_EQ(free.period, 1);
    worst = 0;
    for (const Outcome& outcome : {free, limited})
      worst = std::max(
          {worst, outcome.predicted / outcome.measured, outcome.measured / outcome.predicted});
    if (worst < 1.5 && limited.period > 1 && limited.solves < free.solves) return;
  }
  FAIL() << "off by a factor of " << worst;
}

TEST_P(BudgetOfEngine, WithRoomForEverythingNothingChanges) {
  const Outcome free = run(0), wide = run(3600);
  EXPECT_EQ(free.solves, wide.solves);
  EXPECT_EQ(free.pictures, wide.pictures);
}

INSTANTIATE_TEST_SUITE_P(Modes, BudgetOfEngine,
                         testing::Combine(testing::Values(Mode::batch, Mode::live),
                                          testing::Values(Method::robust, Method::qdmd)));

}  // namespace
}  // namespace qdmd::test
