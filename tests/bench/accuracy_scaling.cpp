// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/bench/accuracy_scaling.h"

#include <cstring>
#include <memory>
#include <random>
#include <stdexcept>

#include "core/dmd/decompose.h"
#include "core/engine/engine.h"
#include "tests/bench/camera.h"
#include "tests/core/clips.h"
#include "tests/core/solver_names.h"

namespace qdmd::bench {
namespace {

constexpr int kGroup = 16;  // frames that the engine adds to the Gram matrix together

struct Size {
  int width, height;
};

// Points of one part that take turns. What a job needs is made when it first runs and shared.
class Sweep {
 public:
  explicit Sweep(Table* table) : table_(table) {}

  void add(const std::string& name, const std::string& method, const std::string& solver, int rank,
           int window, const Size& size, std::function<void()> work) {
    Point point{"scaling", "noise", name, method,     solver,     rank,
                1,         window,  1,    size.width, size.height};
    if (table_->has(point)) return;
    points_.push_back(point);
    jobs_.push_back({std::move(work), static_cast<double>(window)});
  }

  void run(int turns, double seconds) {
    const auto times = in_turn(jobs_, turns, seconds);
    for (size_t i = 0; i < points_.size(); ++i) {
      Values values;
      times[i].put(&values);
      table_->add(points_[i], values);
    }
  }

 private:
  Table* table_;
  std::vector<Point> points_;
  std::vector<Job> jobs_;
};

std::shared_ptr<Window> random_window(int frames, const Size& size) {
  const auto pixels = static_cast<size_t>(size.width) * static_cast<size_t>(size.height);
  auto window = std::make_shared<Window>(frames, pixels);
  std::mt19937_64 rng(7);
  for (int t = 0; t < frames; ++t) {
    const int slot = window->append();
    for (int c = 0; c < kChannels; ++c)
      for (size_t p = 0; p < pixels; p += 8) {
        const uint64_t samples = rng();
        std::memcpy(window->plane(slot, c) + p, &samples, std::min<size_t>(8, pixels - p));
      }
  }
  return window;
}

void multiply(const Window& window, SlidingGram* gram) {
  for (int first = 0; first < window.size(); first += kGroup) {
    const int end = std::min(first + kGroup, window.size());
    gram->add_slice({window, 0, end}, end - first, 0, window.plane_size());
  }
}

void add_gram(Sweep* sweep, int frames, const Size& size) {
  const auto window = random_window(frames, size);
  const auto gram = std::make_shared<SlidingGram>(frames);
  sweep->add("Gram", "qdmd", "gram", 0, frames, size, [=] { multiply(*window, gram.get()); });
}

struct SmallProblem {
  Window window;
  IntegerMatrix gram;
};

// A still picture with noise: full rank, as a camera's.
std::shared_ptr<SmallProblem> small_problem(int frames, const Size& size) {
  std::mt19937 rng(static_cast<unsigned>(frames));
  const auto clip = test::noisy_clip(static_cast<size_t>(size.width * size.height),
                                     static_cast<size_t>(frames), 3, rng);
  auto problem = std::make_shared<SmallProblem>();
  problem->window = test::to_window(clip);
  SlidingGram gram(frames);
  multiply(problem->window, &gram);
  problem->gram = gram.matrix(problem->window);
  return problem;
}

void add_solve(Sweep* sweep, const std::shared_ptr<SmallProblem>& problem, const Size& size,
               Solver solver, int rank) {
  DmdOptions options;
  options.solver = solver;
  options.rank = rank;
  sweep->add("solve", "qdmd", test::name_of(solver), rank, problem->window.size(), size,
             [=] { decompose(problem->window, problem->gram, options); });
}

// The engine as a whole, with its defaults but for `method`: frames in, backgrounds out.
void add_engine(Sweep* sweep, Method method, int frames, const Size& size) {
  // Frames repeat, or those of the largest size would fill the memory. Pixels of noise make no two
  // of a window equal.
  constexpr int kDifferent = 12;
  struct Source {
    std::vector<std::vector<uint8_t>> frames;
    std::vector<uint8_t> picture;
  };
  auto source = std::make_shared<Source>();
  const Camera camera(size.width, size.height, 4);
  source->frames.assign(kDifferent, std::vector<uint8_t>(camera.frame_bytes()));
  for (int t = 0; t < kDifferent; ++t) camera.render(t, source->frames[size_t(t)].data());
  source->picture.resize(camera.frame_bytes());
  const auto view = [size](auto* rgba, auto result) {
    for (int c = 0; c < 3; ++c) result.channel[c] = rgba + c;
    result.alpha = rgba + 3;
    result.width = size.width, result.height = size.height;
    result.pixel_stride = 4, result.row_stride = 4 * ptrdiff_t{size.width};
    return result;
  };
  const auto work = [=] {
    EngineOptions options;
    options.method = method;
    options.window_size = frames;
    options.threads = 1;
    options.max_memory = UINT64_MAX;
    Engine engine;
    const auto check = [](const Status& status) {
      if (!status.ok()) throw std::runtime_error(status.message);
    };
    check(engine.configure(options, size.width, size.height));
    std::mt19937 rng(3);
    for (int t = 0; t < frames; ++t) {
      auto& frame = source->frames[size_t(t % kDifferent)];
      for (int i = 0; i < 64; ++i) frame[rng() % frame.size() & ~size_t{3}] ^= 1;
      check(engine.push(view(static_cast<const uint8_t*>(frame.data()), ImageView())));
    }
    check(engine.drain());
    while (engine.next())
      engine.next()->pop(Output::background, view(source->picture.data(), MutableImageView()));
  };
  sweep->add("engine", method == Method::robust ? "robust" : "qdmd", "gram", 0, frames, size, work);
}

}  // namespace

void add_scaling(bool brief, int turns, double seconds, Table* table, Steps* steps) {
  const std::vector<Size> sizes =
      brief ? std::vector<Size>{{80, 60}, {160, 120}}
            : std::vector<Size>{{160, 120}, {320, 240}, {640, 480}, {1280, 720}, {1920, 1080}};
  const int fixed_window = brief ? 20 : 60;
  const auto windows = [brief](std::vector<int> all) {
    std::erase_if(all, [=](int window) { return brief && window > 50; });
    return all;
  };
  const auto add = [=](const std::string& what, auto fill) {
    steps->push_back({"scaling: " + what, [=] {
                        Sweep sweep(table);
                        fill(&sweep);
                        sweep.run(turns, seconds);
                      }});
  };

  for (Method method : {Method::robust, Method::qdmd}) {
    const std::string name = method == Method::robust ? "robust" : "qdmd";
    add(name + ", pixels", [=](Sweep* sweep) {
      for (const Size& size : sizes) add_engine(sweep, method, fixed_window, size);
    });
    add(name + ", window", [=](Sweep* sweep) {
      for (int window : windows({25, 50, 100, 200, 300}))
        add_engine(sweep, method, window, {320, 240});
    });
  }
  add("Gram matrix, pixels", [=](Sweep* sweep) {
    for (const Size& size : sizes) add_gram(sweep, fixed_window, size);
  });
  add("Gram matrix, window", [=](Sweep* sweep) {
    for (int window : windows({25, 50, 100, 150, 200, 300, 400, 600}))
      add_gram(sweep, window, {160, 120});
  });
  add("small problem, window", [=](Sweep* sweep) {
    constexpr Size kTiny = {48, 36};  // more pixels than frames
    for (int window : windows({25, 50, 100, 200, 400, 800, 1200})) {
      const auto problem = small_problem(window, kTiny);
      add_solve(sweep, problem, kTiny, Solver::gram, 0);
      if (window > 400) continue;
      for (int rank : {1, 3}) add_solve(sweep, problem, kTiny, Solver::gram, rank);
      for (int rank : {0, 1}) add_solve(sweep, problem, kTiny, Solver::automatic, rank);
      add_solve(sweep, problem, kTiny, Solver::gram_extended, 0);
      if (window <= 200) add_solve(sweep, problem, kTiny, Solver::qr, 0);
    }
  });
}

}  // namespace qdmd::bench
