// SPDX-License-Identifier: LGPL-2.1-or-later
// The small problem after the Gram matrix: time against the number of frames, part by part and
// solver by solver. Names and the argument m go into docs/notebook/numerics.md.
#include <benchmark/benchmark.h>

#include <map>

#include "core/dmd/channel_dmd.h"
#include "core/dmd/decompose.h"
#include "core/dmd/reduced_qdmd.h"
#include "core/quaternion/double_double.h"
#include "tests/core/clips.h"

namespace {

using namespace qdmd;

// A still picture with noise 3, full rank while m <= pixels: what a camera gives.
const Window& window_of(int frames) {
  static std::map<int, Window> windows;
  const auto known = windows.find(frames);
  if (known != windows.end()) return known->second;
  std::mt19937 rng(static_cast<unsigned>(frames));
  const auto clip = test::noisy_clip(40 * 30, static_cast<size_t>(frames), 3, rng);
  return windows.emplace(frames, test::to_window(clip)).first->second;
}

const IntegerMatrix& gram_of(int frames) {
  static std::map<int, IntegerMatrix> grams;
  const auto known = grams.find(frames);
  if (known != grams.end()) return known->second;
  return grams.emplace(frames, test::gram_of(window_of(frames))).first->second;
}

QuaternionMatrixd quaternion_gram_of(const benchmark::State& state) {
  return quaternion_gram(gram_of(static_cast<int>(state.range(0))));
}

// Q~ as a dense matrix without structure.
QuaternionMatrixd operator_of(const benchmark::State& state) {
  const auto r = cholesky(quaternion_gram_of(state), 0.0).r;
  const Eigen::Index past = r.cols() - 1;
  const auto inverse = solve_upper(r.block(0, 0, past, past), QuaternionMatrixd::identity(past));
  const auto turn = qr(r.block(0, 1, past, past)).q;
  return turn.conjugate_transpose() * (r.block(0, 1, past, past) * inverse) * turn;
}

void expect(benchmark::State& state, bool good) {
  if (!good) state.SkipWithError("the result is not finite");
}

void cholesky_double(benchmark::State& state) {
  const auto g = quaternion_gram_of(state);
  for (auto _ : state) {
    const auto factor = cholesky(g, gram_tolerance(g.rows()));
    expect(state, factor.complete() && factor.r.all_finite());
  }
}

void cholesky_double_double(benchmark::State& state) {
  const auto g = quaternion_gram_of(state);
  const auto widen = [](const std::complex<double>& c) {
    return std::complex<DoubleDouble>(c.real(), c.imag());
  };
  const QuaternionMatrix<DoubleDouble> wide(g.a.unaryExpr(widen), g.b.unaryExpr(widen));
  for (auto _ : state) {
    const auto factor = cholesky(wide, gram_tolerance<DoubleDouble>(g.rows()));
    expect(state, factor.complete());
  }
}

void pencil_nearest_mode(benchmark::State& state) {
  const auto r = cholesky(quaternion_gram_of(state), 0.0).r;
  const Eigen::Index past = r.cols() - 1;
  const auto h = r.block(0, 1, past, past), r11 = r.block(0, 0, past, past);
  for (auto _ : state) expect(state, Pencil<double>(h, r11).nearest().has_value());
}

void pencil_both_vectors(benchmark::State& state) {
  const auto r = cholesky(quaternion_gram_of(state), 0.0).r;
  const Eigen::Index past = r.cols() - 1;
  const auto h = r.block(0, 1, past, past), r11 = r.block(0, 0, past, past);
  for (auto _ : state) {
    const Pencil<double> pencil(h, r11);
    const auto pair = pencil.nearest();
    expect(state, pair && pencil.left_vector(pair->value));
  }
}

void hermitian_eigenproblem(benchmark::State& state) {
  const auto g = quaternion_gram_of(state);
  for (auto _ : state) expect(state, hermitian_eigen(g).vectors.all_finite());
}

void singular_values(benchmark::State& state) {
  const auto r = cholesky(quaternion_gram_of(state), 0.0).r;
  for (auto _ : state) expect(state, svd(r).u.all_finite());
}

void schur_form(benchmark::State& state) {
  const auto a = operator_of(state);
  for (auto _ : state) {
    const auto form = schur(a);
    expect(state, form.converged && form.t.all_finite());
  }
}

// channels: each by itself, with exact DMD.
void solve(benchmark::State& state, const DmdOptions& options, bool channels = false) {
  const int frames = static_cast<int>(state.range(0));
  const Window& window = window_of(frames);
  const IntegerMatrix& gram = gram_of(frames);
  for (auto _ : state) {
    const Decomposition result =
        channels ? decompose_channels(gram, options) : decompose(window, gram, options);
    expect(state, result.summary.background_modes > 0 && result.background.basis().allFinite());
  }
}

DmdOptions options(Solver solver, int rank = 0, Amplitude amplitude = Amplitude::window) {
  DmdOptions result;
  result.solver = solver;
  result.rank = rank;
  result.amplitude = amplitude;
  return result;
}

DmdOptions every_mode() {
  DmdOptions result;
  result.omega_threshold = 1e9;
  return result;
}

void frames(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgName("m")->Arg(25)->Arg(50)->Arg(100)->Arg(200)->Arg(300)->Unit(
      benchmark::kMillisecond);
}
// 100 frames of the complex adjoint take seconds.
void few_frames(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgName("m")->Arg(25)->Arg(50)->Unit(benchmark::kMillisecond);
}

// The default first, then its parts and the other solvers.
void solve_gram(benchmark::State& s) { solve(s, options(Solver::gram)); }
void solve_auto(benchmark::State& s) { solve(s, options(Solver::automatic)); }
BENCHMARK(solve_gram)->Apply(frames);
BENCHMARK(solve_auto)->Apply(frames);

BENCHMARK(cholesky_double)->Apply(frames);
BENCHMARK(cholesky_double_double)->Apply(frames);
BENCHMARK(pencil_nearest_mode)->Apply(frames);
BENCHMARK(pencil_both_vectors)->Apply(frames);
BENCHMARK(hermitian_eigenproblem)->Apply(frames);
BENCHMARK(singular_values)->Apply(frames);
BENCHMARK(schur_form)->Apply(frames);

DmdOptions estimated(Estimator estimator, int rank) {
  DmdOptions result = options(Solver::automatic, rank);
  result.estimator = estimator;
  return result;
}
void solve_forward_backward(benchmark::State& s) {
  solve(s, estimated(Estimator::forward_backward, 1));
}
void solve_total(benchmark::State& s) { solve(s, estimated(Estimator::total, 1)); }
void solve_optimized(benchmark::State& s) { solve(s, estimated(Estimator::optimized, 0)); }
void solve_optimized_rank_1(benchmark::State& s) { solve(s, estimated(Estimator::optimized, 1)); }

void solve_gram_first_frame(benchmark::State& s) {
  solve(s, options(Solver::gram, 0, Amplitude::first_frame));
}
void solve_gram_rank_1(benchmark::State& s) { solve(s, options(Solver::gram, 1)); }
void solve_auto_rank_1(benchmark::State& s) { solve(s, options(Solver::automatic, 1)); }
void solve_gram_rank_3(benchmark::State& s) { solve(s, options(Solver::gram, 3)); }
void solve_gram_every_mode(benchmark::State& s) { solve(s, every_mode()); }
void solve_gram_extended(benchmark::State& s) { solve(s, options(Solver::gram_extended)); }
void solve_gram_extended_rank_3(benchmark::State& s) {
  solve(s, options(Solver::gram_extended, 3));
}
void solve_qr(benchmark::State& s) { solve(s, options(Solver::qr)); }
void solve_adjoint(benchmark::State& s) { solve(s, options(Solver::adjoint)); }
void solve_dmd(benchmark::State& s) { solve(s, options(Solver::gram), true); }

BENCHMARK(solve_forward_backward)->Apply(frames);
BENCHMARK(solve_total)->Apply(frames);
BENCHMARK(solve_optimized)->Apply(frames);
BENCHMARK(solve_optimized_rank_1)->Apply(frames);
BENCHMARK(solve_gram_first_frame)->Apply(frames);
BENCHMARK(solve_gram_rank_1)->Apply(frames);
BENCHMARK(solve_auto_rank_1)->Apply(frames);
BENCHMARK(solve_gram_rank_3)->Apply(frames);
BENCHMARK(solve_gram_every_mode)->Apply(frames);
BENCHMARK(solve_gram_extended)->Apply(frames);
BENCHMARK(solve_gram_extended_rank_3)->Apply(frames);
BENCHMARK(solve_qr)->Apply(frames);
BENCHMARK(solve_adjoint)->Apply(few_frames);
BENCHMARK(solve_dmd)->Apply(frames);

}  // namespace

BENCHMARK_MAIN();
