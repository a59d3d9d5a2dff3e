// SPDX-License-Identifier: LGPL-2.1-or-later
// Every allocation of an engine fails once: the caller gets std::bad_alloc or a Status, and the
// engine can be used again, loses no frame and no memory.
//
// Short: few cases; QDMD_LONG=1: every allocation, in each method, solver, mode and output, about
// half an hour. GTEST_TOTAL_SHARDS and GTEST_SHARD_INDEX share the cases out.
#include <array>
#include <cctype>
#include <csignal>
#include <new>
#include <optional>

#include "tests/core/allocator_trials.h"
#include "tests/core/engine_util.h"
#include "tests/core/solver_names.h"

namespace qdmd::test {
namespace {

using allocator::Failing;

enum class Alpha { none, constant, varying };

struct Case {
  Method method = Method::robust;
  Solver solver = Solver::gram;
  Mode mode = Mode::batch;
  Output output = Output::foreground;
  int threads = 1;
  Alpha alpha = Alpha::none;
};

constexpr int kWidth = 24, kHeight = 18, kSmallWidth = 20, kSmallHeight = 16;
constexpr int kWindow = 6, kHop = 2;

EngineOptions options_of(const Case& c) {
  EngineOptions options;
  options.method = c.method;
  options.dmd.solver = c.solver;
  options.mode = c.mode;
  options.window_size = kWindow;
  options.hop_size = kHop;
  options.threads = c.threads;
  // Windows are solved beside the frames that follow.
  if (c.mode == Mode::batch && c.threads > 1) options.frame_rate = 1e6;
  return options;
}

std::string describe(const Case& c) {
  const char* const methods[] = {"qdmd", "dmd", "robust"};
  const char* const outputs[] = {"background", "foreground", "mask", "cutout"};
  const char* const alphas[] = {"no alpha", "constant alpha", "varying alpha"};
  std::string name = methods[static_cast<int>(c.method)];
  if (c.method != Method::dmd) name += std::string("/") + name_of(c.solver);
  return name + (c.mode == Mode::live ? " live, " : " batch, ") +
         outputs[static_cast<int>(c.output)] + ", " + std::to_string(c.threads) + " threads, " +
         alphas[static_cast<int>(c.alpha)];
}

// A textured still picture under a light that changes, and a square that moves.
std::vector<PackedPicture> make_frames(Alpha alpha, int width, int height) {
  std::vector<PackedPicture> frames;
  for (int t = 0; t < 8; ++t) {
    frames.emplace_back(width, height, alpha == Alpha::none ? 3 : 4, alpha != Alpha::none);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const auto p = static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
        const bool moves = (x - 4 * t + 200) % width < 6 && y > 5 && y < 14;
        for (int k = 0; k < 3; ++k) {
          const int level = (60 + (7 * x + 3 * y + 11 * k) % 80) * (100 + 4 * (t % 4)) / 100;
          frames.back().at(static_cast<size_t>(k), p) =
              static_cast<uint8_t>(moves ? 240 - 60 * k : level);
        }
        if (alpha != Alpha::none)
          frames.back().at(3, p) =
              static_cast<uint8_t>(alpha == Alpha::varying ? 255 - x % 200 : 200);
      }
  }
  return frames;
}

// Frames of both sizes.
using FramePair = std::pair<std::vector<PackedPicture>, std::vector<PackedPicture>>;
const FramePair& frames_of(Alpha alpha) {
  static const auto make = [](Alpha a) {
    return FramePair(make_frames(a, kWidth, kHeight), make_frames(a, kSmallWidth, kSmallHeight));
  };
  static const std::array<FramePair, 3> frames = {make(Alpha::none), make(Alpha::constant),
                                                  make(Alpha::varying)};
  return frames[static_cast<size_t>(alpha)];
}

// What the owner of an engine knows of it. Calls to the engine go through here and are the only
// ones whose allocations are seen.
class Owner {
 public:
  template <typename Work>
  static auto call(Work work) {
    const allocator::SeenAgain again;
    return work();
  }

  Owner(const Case& c, Engine* engine)
      : case_(c),
        engine_(engine),
        frames_(frames_of(c.alpha).first),
        small_frames_(frames_of(c.alpha).second) {
    mask_.resize(frames_[0].pixels());
    residual_.resize(frames_[0].pixels());
  }

  void configure(bool small = false, int threads = 0) {
    small_ = small;
    EngineOptions options = options_of(case_);
    if (threads > 0) options.threads = threads;
    wishes_.threads = options.threads;
    const auto& frame = frames().front();
    take(call([&] { return engine_->configure(options, frame.width, frame.height); }));
    waiting_ = 0;
    time_ = 0;
  }
  void push(bool look = false) {
    const PackedPicture& frame = frames()[static_cast<size_t>(time_++) % frames().size()];
    const ImageView view = const_cast<PackedPicture&>(frame).in();
    const Status status = call([&] { return engine_->push(view, &wishes_); });
    if (status.ok()) ++waiting_;
    take(status);
    pop(look);
  }
  void push_many(int count, bool look = false) {
    for (int i = 0; i < count; ++i) push(look && i % 3 == 0);
  }
  void pop(bool look = false) {
    if (!engine_->next()) return;
    if (look) call([&] { engine_->next()->foreground(mask_.data(), residual_.data()); });
    PackedPicture out(frames()[0].width, frames()[0].height, frames()[0].bytes_per_pixel,
                      frames()[0].with_alpha);
    while (engine_->next()) {
      call([&] { engine_->next()->pop(case_.output, out.out()); });
      --waiting_;
      if (keep_) pictures.push_back(out.bytes);
    }
    if (!look) return;
    call([&] { engine_->write_background(out.out()); });
    if (keep_) pictures.push_back(out.bytes);
  }
  void drain() {
    take(call([&] { return engine_->drain(); }));
    pop();
  }
  void flush() {
    call([&] { engine_->flush(); });
    waiting_ = 0;
    time_ = 0;
  }
  void close() {
    call([&] { engine_->close(); });
    waiting_ = 0;
  }
  void set_freeze(bool freeze) { wishes_.freeze = freeze; }
  void set_threads(int threads) { wishes_.threads = threads; }
  // Pictures depend on time from now on, or no longer do.
  void set_time_budget(double seconds) {
    keep_ = seconds == 0;
    wishes_.time_budget = seconds;
  }

  // After all that succeeded, and after a failure.
  void check_pending(bool failed) {
    // What waits is lost with the call that failed.
    EXPECT_EQ(engine_->report().pending, failed ? 0 : waiting_);
  }
  // What is ready must be there, too, after a failure.
  void pop_what_is_ready() {
    PackedPicture out(frames()[0].width, frames()[0].height, frames()[0].bytes_per_pixel,
                      frames()[0].with_alpha);
    for (int most = 2 * kWindow; engine_->next() && most > 0; --most)
      call([&] { engine_->next()->pop(case_.output, out.out()); });
    EXPECT_FALSE(engine_->next());
  }

  std::vector<std::vector<uint8_t>> pictures;

 private:
  const std::vector<PackedPicture>& frames() const { return small_ ? small_frames_ : frames_; }

  // What a call to the engine refuses, it says for want of memory only where this is thrown.
  static void take(const Status& status) { EXPECT_TRUE(status.ok()) << status.message; }

  Case case_;
  Engine* engine_;
  Wishes wishes_;  // of each frame that comes
  const std::vector<PackedPicture>&frames_, &small_frames_;
  std::vector<uint8_t> mask_, residual_;
  int waiting_ = 0, time_ = 0;
  bool small_ = false, keep_ = true;
};

// What an engine may meet, in parts that can fail by themselves.
struct Part {
  const char* name;
  void (*before)(Owner& owner, const Case& c);
  void (*work)(Owner& owner, const Case& c);
};

void window_and_half(Owner& owner, const Case&) { owner.push_many(kWindow + kWindow / 2, true); }

constexpr std::array kParts = {
    Part{"start", [](Owner&, const Case&) {},
         [](Owner& owner, const Case& c) {
           owner.configure();
           window_and_half(owner, c);
         }},
    Part{"drain and go on",
         [](Owner& owner, const Case& c) {
           owner.configure();
           window_and_half(owner, c);
         },
         [](Owner& owner, const Case& c) {
           owner.drain();
           window_and_half(owner, c);
           owner.drain();
         }},
    Part{"flush and go on",
         [](Owner& owner, const Case& c) {
           owner.configure();
           window_and_half(owner, c);
         },
         [](Owner& owner, const Case& c) {
           owner.flush();
           window_and_half(owner, c);
         }},
    Part{"freeze",
         [](Owner& owner, const Case& c) {
           owner.configure();
           window_and_half(owner, c);
         },
         [](Owner& owner, const Case& c) {
           owner.set_freeze(true);
           window_and_half(owner, c);
           owner.set_freeze(false);
           window_and_half(owner, c);
         }},
    Part{"threads",
         [](Owner& owner, const Case& c) {
           owner.configure();
           window_and_half(owner, c);
         },
         [](Owner& owner, const Case& c) {
           owner.set_threads(c.threads == 1 ? 3 : 1);
           window_and_half(owner, c);
           owner.set_threads(4);
           window_and_half(owner, c);
           owner.set_threads(c.threads);
           owner.push();
         }},
    // A budget that nothing meets, and then one that all meets.
    Part{"budget",
         [](Owner& owner, const Case& c) {
           owner.configure();
           window_and_half(owner, c);
         },
         [](Owner& owner, const Case&) {
           owner.set_time_budget(1e-9);
           owner.push_many(3 * kWindow);
           owner.set_time_budget(1e3);
           owner.push_many(3 * kWindow);
         }},
    Part{"another size",
         [](Owner& owner, const Case& c) {
           owner.configure();
           window_and_half(owner, c);
         },
         [](Owner& owner, const Case& c) {
           owner.configure(true);
           window_and_half(owner, c);
           owner.drain();
           owner.close();
         }},
};

// The pictures of an engine as it comes, or of one that failed.
std::vector<std::vector<uint8_t>> pictures_of(Owner& owner, const Case& c) {
  owner.pictures.clear();
  window_and_half(owner, c);
  owner.drain();
  return std::move(owner.pictures);
}

struct Trial {
  const Case& c;
  const Part& part;
  int64_t n;
  Failing failing;
};

std::string describe(const Trial& trial) {
  return describe(trial.c) + ", " + trial.part.name + trial_suffix(trial.n, trial.failing);
}

// Lets allocation n of the part's work fail; 0: none. Returns how many allocations it had, or none
// where one failed.
std::optional<int64_t> run(const Trial& trial, const std::vector<std::vector<uint8_t>>& right,
                           bool note_places = false) {
  const allocator::Unseen unseen;
  trial_name() = describe(trial);
  SCOPED_TRACE(trial_name());
  std::optional<int64_t> allocations;
  allocator::Seen seen;
  {
    Engine engine;
    Owner owner(trial.c, &engine);
    allocator::start();
    trial.part.before(owner, trial.c);
    const int64_t before = allocator::seen().allocations;
    if (note_places) allocator::note_places();
    if (trial.n > 0) allocator::fail(before + trial.n, trial.failing);
    bool failed = false;
    try {
      trial.part.work(owner, trial.c);
      // Nobody needs the result of what still goes on, but it may fail.
      if (trial.n % 2 == 0) owner.flush();
    } catch (const std::bad_alloc&) {
      failed = true;
    }
    seen = allocator::seen();
    // A thread that is not started, and a result that nobody waits for, are no failure.
    EXPECT_TRUE(!failed || seen.failed > 0);
    owner.check_pending(failed);
    if (!failed && seen.failed == 0) allocations = seen.allocations - before;
    // The stream's end needs no memory; nor does a new stream.
    const int64_t way = trial.n % 4;
    try {
      if (way == 0) owner.pop_what_is_ready();
    } catch (const std::bad_alloc&) {
      EXPECT_EQ(trial.failing, Failing::all);
    }
    try {
      if (trial.failing == Failing::all) owner.flush();
      if (way == 3) owner.close();
    } catch (const std::bad_alloc&) {
      ADD_FAILURE() << "flush() or close() needs memory";
      allocator::print_failed();
    }
    allocator::fail_no_more();
    owner.set_freeze(false);
    owner.set_time_budget(0);
    const bool is_small = std::string(trial.part.name) == "another size";
    if (way == 3 || is_small || !engine.configured()) {
      owner.configure(false, trial.c.threads);
    } else {
      owner.flush();
      owner.set_threads(trial.c.threads);
    }
    EXPECT_EQ(engine.report().pending, 0);
    EXPECT_FALSE(engine.next());
    EXPECT_EQ(pictures_of(owner, trial.c) == right, true) << "other pictures after a failure";
    owner.check_pending(false);
    const allocator::SeenAgain again;
    engine.close();
  }
  allocator::stop();
  seen = allocator::seen();
  EXPECT_EQ(seen.blocks, 0) << seen.bytes << " bytes are left";
  return allocations;
}

void check(const Case& c) {
  if (c.mode == Mode::batch) {
    EXPECT_EQ(layout_of(options_of(c), kWidth, kHeight).late_frames > 0, c.threads > 1);
  }
  const auto right = [&] {
    Engine engine;
    Owner owner(c, &engine);
    owner.configure();
    return pictures_of(owner, c);
  }();
  EXPECT_GE(right.size(), static_cast<size_t>(kWindow + kWindow / 2));
  for (const Part& part : kParts) {
    const auto all = run({c, part, 0, Failing::one}, right, true);
    ASSERT_TRUE(all.has_value());
    int64_t last = *all;
    // Eigen's SVD frees twice what it has where memory runs out in it. The solver sees first
    // whether there is enough; what comes after that allocation cannot be tried.
    if (c.solver == Solver::adjoint)
      if (const int64_t foreseen = allocator::first_of(350 * kSmallWidth * kSmallHeight))
        last = foreseen;
    // The outputs differ only in what they write.
    for (int64_t n : allocations_to_try(part.name, last))
      for (Failing failing : ways_to_fail(n, c.output == Output::mask)) {
        run({c, part, n, failing}, right);
        if (testing::Test::HasFailure()) return;
      }
  }
}

class OutOfMemory : public testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    for (int signal : {SIGABRT, SIGSEGV}) std::signal(signal, report_trial);
    // The C library keeps what it allocates for a thread when it ends.
    std::vector<std::thread> threads;
    for (int i = 0; i < 5; ++i)
      threads.emplace_back([] { std::this_thread::sleep_for(std::chrono::milliseconds(20)); });
    for (std::thread& thread : threads) thread.join();
  }
};

// Short: each output, alpha and number of threads somewhere.
std::vector<Case> cases() {
  std::vector<Case> all;
  const auto add = [&all](Method method, Solver solver) {
    for (Mode mode : {Mode::batch, Mode::live})
      for (int k = 0; k < (kLongTrials ? 4 : 1); ++k) {
        const auto i = kLongTrials ? k : static_cast<int>(all.size());
        all.push_back({method, solver, mode, static_cast<Output>(i % 4), i % 2 == 0 ? 1 : 3,
                       static_cast<Alpha>((i + 2) % 3)});
      }
  };
  add(Method::robust, Solver::gram);
  for (Solver solver : {Solver::gram, Solver::gram_extended, Solver::qr, Solver::adjoint})
    add(Method::qdmd, solver);
  add(Method::dmd, Solver::gram);
  if (!kLongTrials)
    for (Method method : {Method::robust, Method::qdmd})
      all.push_back({method, Solver::gram, Mode::batch, Output::mask, 3, Alpha::varying});
  return all;
}

TEST_P(OutOfMemory, LeavesAnEngineThatCanGoOn) { check(GetParam()); }

std::string test_name(const testing::TestParamInfo<Case>& info) {
  std::string name = describe(info.param);
  for (size_t i = 0; i < name.size(); ++i) {
    if (name[i] == ',') name.erase(i, 1);
    if (!std::isalnum(static_cast<unsigned char>(name[i]))) name[i] = '_';
  }
  return name;
}

INSTANTIATE_TEST_SUITE_P(Engine, OutOfMemory, testing::ValuesIn(cases()), test_name);

}  // namespace
}  // namespace qdmd::test
