// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/dmd/first_order.h"

#include <cmath>

namespace qdmd {
namespace {

using Index = Eigen::Index;
using Matrix = QuaternionMatrixd;
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

// So far does the moved mode go, over its size: more than half of the digits see the movement.
constexpr double kShown = 1e-6;
// So much of what drives the movement may be missing.
constexpr double kMissing = 0.05;
constexpr int kMostSteps = 12;

// rows x 1, elements of mean square size^2.
Matrix random_column(Index rows, double size, RepeatedRandom* random) {
  Matrix column(rows, 1);
  for (Index k = 0; k < rows; ++k) column.set(k, 0, (*random)(size));
  return column;
}

Matrix times(Matrix column, const Quaterniond& q) {
  column.scale_col(0, q);
  return column;
}

// x^H y of columns.
Quaterniond dot(const Matrix& x, const Matrix& y) {
  return (x.conjugate_transpose() * y).get(0, 0);
}

// Columns first .. first + rows(x) - 1 of r, times x, and their conjugate transpose times y:
// without copies of r, which are what this would cost most.
Matrix columns_times(const Matrix& r, Index first, const Matrix& x) {
  const auto a = r.a.middleCols(first, x.rows()), b = r.b.middleCols(first, x.rows());
  Matrix y(r.rows(), 1);
  y.a.noalias() = a * x.a;
  y.a.noalias() -= b * x.b.conjugate();
  y.b.noalias() = a * x.b;
  y.b.noalias() += b * x.a.conjugate();
  return y;
}
Matrix columns_adjoint_times(const Matrix& r, Index first, Index count, const Matrix& y) {
  const auto a = r.a.middleCols(first, count), b = r.b.middleCols(first, count);
  Matrix x(count, 1);
  x.a.noalias() = a.adjoint() * y.a;
  x.a.noalias() += b.transpose() * y.b.conjugate();
  x.b.noalias() = a.adjoint() * y.b;
  x.b.noalias() -= b.transpose() * y.a.conjugate();
  return x;
}

// What x_t has in (Y - X lambda) v, m x 1.
Matrix shares_of_residual(const Matrix& v, const Quaterniond& lambda) {
  const Index past = v.rows();
  Matrix shares(past + 1, 1);
  shares.a.bottomRows(past) = v.a;
  shares.b.bottomRows(past) = v.b;
  const Matrix before = times(v, lambda);
  shares.a.topRows(past) -= before.a;
  shares.b.topRows(past) -= before.b;
  return shares;
}

// How a mode's vector moves.
struct Step {
  Matrix dv;                   // m - 1 x 1
  Quaterniond dlambda;         // of v's own representative, beside what dv does to it
  double reach = 0, size = 1;  // as in FirstOrderMove, and |Q~|
};

// What a random push makes of a mode v with its eigenvalue: full rank.
class FullRank {
 public:
  FullRank(const SnapshotFactor<double>& factor, const Matrix& v, const Quaterniond& lambda)
      : r_(factor.r), v_(v), z_(r11(v)), lambda_(lambda) {
    // How long the last frame's part is that no other frame has.
    if (factor.r.rows() > v.rows())
      outside_ = factor.r.get(v.rows(), v.rows()).norm() * v.get(v.rows() - 1, 0).norm();
  }

  std::optional<Step> step(const Push& push, RepeatedRandom* random) const {
    const Index past = v_.rows();
    const double size = z_.norm();
    if (!(size > 0)) return std::nullopt;
    const Quaterniond unit = Quaterniond(1 / (size * size));
    const ScalarGrid<double> triangle(r_.block(0, 0, past, past));
    Step result;
    {
      auto column = internal::to_column(random_column(past, 1, random));
      solve_upper_in_place(triangle, column);
      result.size = h(internal::to_matrix(column)).norm();
    }
    const Matrix f = force(push, triangle, random);
    if (!(f.norm() > 0) || !std::isfinite(f.norm())) return std::nullopt;
    HessenbergQr<double> shifted(
        Matrix(r_.a.block(0, 1, past, past) - r_.a.topLeftCorner(past, past),
               r_.b.block(0, 1, past, past) - r_.b.topLeftCorner(past, past)));
    shifted.raise_pivots(std::max(2 * kEpsilon * r_.norm(), std::numeric_limits<double>::min()));
    const Quaterniond shift = lambda_ - Quaterniond(1.0);
    Matrix moved(past, 1);  // R11 dv
    for (int k = 0; k < kMostSteps; ++k) {
      result.dv = internal::to_matrix(shifted.solve(internal::to_column(times(moved, shift) - f)));
      moved = r11(result.dv);
      const Quaterniond along = unit * dot(z_, moved);
      result.dv -= times(v_, along);
      moved -= times(z_, along);
      if (k == 0) result.reach = std::sqrt(static_cast<double>(past)) * moved.norm() / f.norm();
      Matrix rest = h(result.dv) + f - times(moved, lambda_);
      result.dlambda = unit * dot(z_, rest);
      rest -= times(z_, result.dlambda);
      if (rest.norm() <= kMissing * f.norm()) return result;
    }
    return std::nullopt;
  }

 private:
  // (dH - dR11 lambda) v: moves of the frames in their span, of X^H (Y - X lambda) v, and what the
  // eigenpair leaves.
  Matrix force(const Push& push, const ScalarGrid<double>& triangle, RepeatedRandom* random) const {
    const Index past = v_.rows();
    const Matrix shares = shares_of_residual(v_, lambda_);
    Matrix products =
        random_column(past, push.products * v_.norm() * std::hypot(1, lambda_.norm()), random);
    products += random_column(past, push.frames * outside_, random);
    products.a += push.common * shares.a.topRows(past);
    products.b += push.common * shares.b.topRows(past);
    auto column = internal::to_column(products);
    solve_upper_adjoint_in_place(triangle, column);
    const double left = push.residual * (1 + lambda_.norm()) * r_.norm() * v_.norm();
    return internal::to_matrix(column) +
           random_column(past,
                         push.frames * shares.norm() + left / std::sqrt(static_cast<double>(past)),
                         random);
  }

  // R11 x and H x.
  Matrix r11(const Matrix& x) const { return columns_times(r_, 0, x).block(0, 0, x.rows(), 1); }
  Matrix h(const Matrix& x) const { return columns_times(r_, 1, x).block(0, 0, x.rows(), 1); }

  const Matrix& r_;
  const Matrix& v_;
  Matrix z_;
  Quaterniond lambda_;
  double outside_ = 0;
};

// How modes of rank one move: they follow from the leading right singular vector w alone.
class RankOne {
 public:
  RankOne(const SnapshotFactor<double>& factor, Estimator estimator)
      : r_(factor.r), estimator_(estimator) {}

  std::optional<Step> step(const Matrix& w, const Push& push, RepeatedRandom* random) const {
    const Matrix z = past(w), y = next(w);
    const double length = w.norm(), size = z.norm(), after = y.norm();
    if (!(size > 0) || !(length > 0)) return std::nullopt;
    const bool both = estimator_ == Estimator::total;
    const double image = both ? std::hypot(size, after) : size;
    const double square = image * image / (length * length);
    // dK w: products that move, and frames that do, in the sum and in what it is multiplied by.
    const double rows = static_cast<double>(w.rows());
    Matrix g = random_column(w.rows(),
                             push.products * length * (both ? 1.5 : 1.0) + push.frames * image +
                                 push.residual * square * length / std::sqrt(rows),
                             random);
    g += past_adjoint(random_column(r_.rows(), push.frames * length, random));
    if (both) g += next_adjoint(random_column(r_.rows(), push.frames * length, random));
    const auto upright = [&](const Matrix& x) {
      return x - times(w, Quaterniond(1 / (length * length)) * dot(w, x));
    };
    g = upright(g);
    if (!std::isfinite(g.norm())) return std::nullopt;
    Step result;
    Matrix product(w.rows(), 1);  // K dw
    for (int k = 0; k < kMostSteps; ++k) {
      result.dv = times(g + product, Quaterniond(1 / square));
      const Matrix before = product;
      product = past_adjoint(past(result.dv));
      if (both) product += next_adjoint(next(result.dv));
      product = upright(product);
      if (!((product - before).norm() <= kMissing * g.norm())) continue;
      // A quotient of two products, whatever the vector.
      result.dlambda = (*random)(
          2 * (length * (push.products * length + push.frames * (size + after)) / (size * size) +
               push.residual));
      const Index inner = w.rows() - 1;
      result.dlambda += (dot(w.block(1, 0, inner, 1), w.block(0, 0, inner, 1)) -
                         lambda_of(w) * (length * length)) *
                        (push.common / (size * size));
      return result;
    }
    return std::nullopt;
  }

  // The eigenvalue of w's own representative.
  Quaterniond lambda_of(const Matrix& w) const {
    const Matrix z = past(w);
    const Quaterniond product = dot(z, next(w));
    if (estimator_ != Estimator::forward_backward) return product * (1 / z.squared_norm());
    return product.unit() * (next_adjoint(z).norm() / past_adjoint(z).norm());
  }

 private:
  Matrix past(const Matrix& x) const { return columns_times(r_, 0, x); }
  Matrix next(const Matrix& x) const { return columns_times(r_, 1, x); }
  Matrix past_adjoint(const Matrix& y) const {
    return columns_adjoint_times(r_, 0, r_.cols() - 1, y);
  }
  Matrix next_adjoint(const Matrix& y) const {
    return columns_adjoint_times(r_, 1, r_.cols() - 1, y);
  }

  const Matrix& r_;
  Estimator estimator_;
};

// The amplitude of the moved mode in the moved window.
void fit_moved(const Matrix& r, const Push& push, double so_often, RepeatedRandom* random,
               BackgroundModes* modes) {
  const Matrix phi = r * modes->combination;
  const double size = phi.norm(), length = modes->combination.norm();
  const double longest =
      std::sqrt((r.a.colwise().squaredNorm() + r.b.colwise().squaredNorm()).maxCoeff());
  const auto phi_h = phi.conjugate_transpose();
  Matrix phi_phi = phi_h * phi, phi_x = phi_h * r;
  phi_phi.a(0, 0) +=
      so_often * (push.common * length * length +
                  (*random)(push.products * length * length + 2 * push.frames * size * length).w);
  const double moved = push.products * length + push.frames * (size + length * longest);
  for (Index t = 0; t < r.cols(); ++t)
    phi_x.set(
        0, t,
        phi_x.get(0, t) +
            ((*random)(moved) + modes->combination.get(t, 0).conj() * push.common) * so_often);
  modes->reference_times(0) = fit_reference_time(modes->eigenvalues(0), r.cols());
  modes->amplitudes =
      fit_window_amplitudes<double>(modes->eigenvalues, modes->reference_times, phi_phi, phi_x);
}

}  // namespace

std::optional<FirstOrderMove> first_order_move(const SnapshotFactor<double>& factor,
                                               const DmdOptions& options,
                                               const BackgroundModes& modes, const Push& push,
                                               uint64_t seed) {
  const Index m = factor.r.cols(), past = m - 1;
  if (m < 3 || modes.eigenvalues.size() != 1 || factor.r.rows() == 0 ||
      options.amplitude != Amplitude::window || !modes.summary.converged)
    return std::nullopt;
  const Quaterniond lambda(modes.eigenvalues(0));
  const bool one = modes.summary.rank == 1 && options.estimator != Estimator::optimized;
  const bool full =
      modes.summary.rank == past && factor.triangular && options.estimator == Estimator::exact;
  // Powers of a mode that is gone after some frames move as no derivative says.
  if (!(one || full) || !(lambda.norm() > 0.5)) return std::nullopt;

  const Matrix v = modes.combination.block(1, 0, past, 1);
  const double length = v.norm();
  RepeatedRandom random(seed);
  const RankOne rank_one(factor, options.estimator);
  const auto step =
      one ? rank_one.step(v, push, &random) : FullRank(factor, v, lambda).step(push, &random);
  if (!step || !(length > 0)) return std::nullopt;

  FirstOrderMove result;
  result.modes = modes;
  result.reach = step->reach;
  result.operator_size = step->size;
  const double image = columns_times(factor.r, 0, step->dv).norm(),
               before = columns_times(factor.r, 0, v).norm();
  double relative = std::max(image / before, one ? step->dv.norm() / length : 0.0);
  Quaterniond moved;
  Matrix vector;
  for (int pass = 0; pass < 2; ++pass) {
    if (!std::isfinite(relative)) return std::nullopt;
    result.times = relative > 0 ? kShown / relative : 1;
    vector = v + times(step->dv, Quaterniond(result.times));
    moved = (one ? rank_one.lambda_of(vector) : lambda) + step->dlambda * result.times;
    // Over the whole window.
    relative = std::max(relative, (moved - lambda).norm() * static_cast<double>(m) /
                                      (lambda.norm() * result.times));
  }
  result.relative = relative;
  result.modes.eigenvalues(0) = {moved.w, moved.vector_norm()};
  result.modes.combination = Matrix(m, 1);
  internal::set_combination(&result.modes, 0, times(vector, standardizing_rotation(moved)));
  fit_moved(factor.r, push, result.times, &random, &result.modes);
  result.modes.summary.omega = omega_magnitude(result.modes.eigenvalues(0));
  if (!result.modes.combination.all_finite() || !result.modes.amplitudes.all_finite())
    return std::nullopt;
  return result;
}

}  // namespace qdmd
