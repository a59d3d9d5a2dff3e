// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/dmd/error_bound.h"

#include "core/dmd/estimator.h"
#include "core/dmd/first_order.h"

#include <cmath>
#include <cstdint>

namespace qdmd {
namespace {

using Index = Eigen::Index;
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
// |x| of a white pixel.
constexpr double kWhite = 255 * 1.7320508075688772;

// Random directions whose movement is looked at, and the room for those that are not (Kenney and
// Laub 1994: the chance that k directions all show less than 1 / room of the largest falls with
// room^k).
constexpr int kDirections = 3, kDataDirections = 2;
// A direction in the space of many frames is many directions.
constexpr Index kManyFrames = 50;
constexpr double kRoom = 30;
// An error that many frames' rounding makes is spread over the picture: no pixel has more than so
// many times the mean. One that is not spread out has less room, that of `largest` itself.
constexpr double kPeak = 6;

// Quaternions of mean square size^2.
QuaternionMatrixd random_matrix(Index rows, Index cols, double size, uint64_t seed) {
  RepeatedRandom random(seed);
  QuaternionMatrixd m(rows, cols);
  for (Index c = 0; c < cols; ++c)
    for (Index r = 0; r < rows; ++r) m.set(r, c, random(size));
  return m;
}

// size times a random unitary matrix, first `rows` rows, with columns that are orthogonal like the
// noise of different frames: r^H times it costs no more than reflections do. m x m, from the left
// times r^H for r of as many rows.
QuaternionMatrixd turned(const QuaternionMatrixd& r, double size, uint64_t seed) {
  QuaternionMatrixd result = r.conjugate_transpose();
  for (uint64_t k = 0; k < 3; ++k)
    apply_right(make_reflector(random_matrix(r.rows(), 1, 1, 7 * seed + k)), result, 0,
                result.rows(), 0);
  return result.scale_cols(Eigen::VectorXd::Constant(result.cols(), size));
}

double longest_column(const QuaternionMatrixd& r) {
  return std::sqrt((r.a.colwise().squaredNorm() + r.b.colwise().squaredNorm()).maxCoeff());
}

// The movement of a mode's |omega| and of its distance to the next one's.
struct Movement {
  double omega = 0, margin = 0;
  // `times` what was asked for.
  void see(const BackgroundModes& modes, const BackgroundModes& moved, double times = 1) {
    const double change = std::abs(modes.summary.omega - moved.summary.omega) / times;
    if (!(change <= omega)) omega = change;
    // Where neither is a bound only; infinite margins have no next mode.
    if (modes.selection.exact && moved.selection.exact &&
        modes.selection.margin != moved.selection.margin)
      margin = std::max(margin, std::abs(modes.selection.margin - moved.selection.margin));
  }
  // Whether such a movement may choose another mode.
  bool may_choose_another(const BackgroundModes& modes, double room) const {
    if (modes.selection.margin == kInfinity) return false;
    return !(modes.selection.margin > room * (2 * omega + margin));
  }
};

// The root of the mean square of what rounding moves in a factor's or Gram matrix's elements:
// errors of m sums add up like random numbers, a few epsilon times the root of m. In a Gram matrix
// of frames that are alike, all but the first product is small beside its elements.
Push rounding_push(const SolvedWindow& solved) {
  const auto& [gram, pixels, options, factor, modes] = solved;
  const auto m = static_cast<double>(gram.cols());
  Push push;
  if (factor.squared)
    push.products = 4 * kEpsilon * gram.a.diagonal().real().maxCoeff();
  else
    push.frames = 4 * std::sqrt(m) * kEpsilon * std::max(1.0, modes.selection.operator_size) *
                  longest_column(factor.r) / std::sqrt(static_cast<double>(factor.r.rows()));
  push.residual = std::max(modes.summary.residual, kEpsilon);
  return push;
}

int directions(Index frames, int few) { return frames < kManyFrames ? few : 1; }

// The largest of the directions, and room for those that nobody tried.
double with_room(const BackgroundDistance& moved) {
  return std::max(moved.largest, kRoom * std::min(moved.largest, kPeak * moved.mean));
}

// rounding_bound() from derivatives alone. Empty where these do not tell, or too little.
std::optional<double> first_order_bound(const SolvedWindow& solved) {
  // What is larger may be more than a derivative can say.
  constexpr double kSmall = 1e-4, kSureLevels = 1e-2;
  const auto& [gram, pixels, options, factor, modes] = solved;
  const Index m = gram.cols();
  const Push push = rounding_push(solved);
  BackgroundDistance moved_by;
  Movement movement;
  for (int direction = 1; direction <= directions(m, kDirections); ++direction) {
    const auto move =
        first_order_move(factor, options, modes, push, static_cast<uint64_t>(direction));
    if (!move || !(kRoom * move->relative < kSmall)) return std::nullopt;
    if (modes.selection.margin < kInfinity) {
      // Another mode comes near the origin only if Q~ moves by more than 1 / reach.
      const double condition = modes.summary.condition, root = std::sqrt(static_cast<double>(m));
      const double moves = kRoom * 4 * kEpsilon * root * (1 + move->operator_size) * condition *
                           (factor.squared ? condition : 1);
      if (!(moves * move->reach < 0.25) || !(moves < modes.selection.margin / 4))
        return std::nullopt;
    }
    const auto distance = background_distance(factor.r, pixels, modes, move->modes);
    moved_by.largest = std::max(moved_by.largest, distance.largest / move->times);
    moved_by.mean = std::max(moved_by.mean, distance.mean / move->times);
    movement.see(modes, move->modes, move->times);
  }
  const double bound = with_room(moved_by);
  if (movement.may_choose_another(modes, kRoom) || !(bound < kSureLevels)) return std::nullopt;
  return bound;
}

// The part of the frames' own movement in L(t), and that of the modes.
double with_own_movement(const BackgroundModes& modes, double moved) {
  const Index m = modes.combination.rows();
  double largest = 0;
  for (Index t : {Index{0}, m / 2, m - 1})
    largest = std::max(largest, shares_at(modes, static_cast<double>(t)).norm());
  // Half a level at random has the mean square 1/12.
  return std::hypot(moved, largest / std::sqrt(12.0));
}

// sensitivity() from derivatives alone, as above.
std::optional<double> first_order_sensitivity(const SolvedWindow& solved) {
  constexpr double kSmall = 0.1;
  const auto& [gram, pixels, options, factor, modes] = solved;
  const Index m = gram.cols();
  Push push;
  push.frames = 0.5;
  push.common = std::max(pixels, static_cast<double>(factor.r.rows())) / 4;
  double mean = 0;
  Movement movement;
  for (int direction = 1; direction <= directions(m, kDataDirections); ++direction) {
    const auto move =
        first_order_move(factor, options, modes, push, 100 + static_cast<uint64_t>(direction));
    if (!move || !(move->relative < kSmall)) return std::nullopt;
    mean = std::max(mean,
                    background_distance(factor.r, pixels, modes, move->modes).mean / move->times);
    movement.see(modes, move->modes, move->times);
  }
  if (movement.may_choose_another(modes, 1)) return std::nullopt;
  return with_own_movement(modes, mean);
}

// True where an eigenvalue that is zero but for rounding may be background: what its logarithm is,
// and its mode's amplitude, other digits would decide. Of a Jordan block, rounding leaves the root
// of epsilon.
bool rounding_may_be_background(const SolvedWindow& solved) {
  const auto size = solved.modes.eigenvalues.cwiseAbs().eval();
  const double zero = std::sqrt(std::numeric_limits<double>::epsilon()) * size.maxCoeff();
  return size.minCoeff() <= zero && solved.options.omega_threshold >= -std::log(zero);
}

}  // namespace

QuaternionMatrixd shares_at(const BackgroundModes& modes, double t) {
  QuaternionMatrixd shares(modes.combination.rows(), 1);
  for (Index p = 0; p < modes.eigenvalues.size(); ++p) {
    auto mode = modes.combination.col(p);
    const auto growth = power<double>(modes.eigenvalues(p), t - modes.reference_times(p));
    mode.scale_col(0, Quaterniond(growth) * modes.amplitudes.get(p, 0));
    shares += mode;
  }
  return shares;
}

BackgroundDistance background_distance(const QuaternionMatrixd& r, double pixels,
                                       const BackgroundModes& modes, const BackgroundModes& other) {
  const Index m = modes.combination.rows();
  const QuaternionMatrixd mean_frame(r.a.rowwise().mean(), r.b.rowwise().mean());
  BackgroundDistance result;
  for (Index t : {Index{0}, m / 2, m - 1}) {
    const auto shares =
        shares_at(modes, static_cast<double>(t)) - shares_at(other, static_cast<double>(t));
    const auto picture = r * shares;
    const double whole = picture.norm();
    const Quaterniond total(shares.a.sum(), shares.b.sum());
    // Frames less their mean: what is common to all has the sum of the shares alone.
    auto common = mean_frame;
    common.scale_col(0, total);
    const double sum = total.norm(), around = (picture - common).norm();
    double absolute = 0;
    for (Index s = 0; s < m; ++s) absolute += shares.get(s, 0).norm();
    // Three bounds of one pixel: of the whole picture's norm; of frames that are white at most; of
    // their mean, which is white at most, and the norm of what is around it.
    const double largest = std::min({whole, kWhite * absolute, kWhite * sum + around});
    if (!(largest <= result.largest)) result.largest = largest;
    const double mean = whole / std::sqrt(3 * pixels);
    if (!(mean <= result.mean)) result.mean = mean;
  }
  if (!(result.largest <= std::numeric_limits<double>::max())) result.largest = kInfinity;
  if (!(result.mean <= std::numeric_limits<double>::max())) result.mean = kInfinity;
  return result;
}

double rounding_bound(const SolvedWindow& solved) {
  const auto& [gram, pixels, options, factor, modes] = solved;
  const Index m = gram.cols();
  if (modes.eigenvalues.size() == 0) return 0;
  // Where the tolerance would be met by other digits, nobody knows.
  if (modes.selection.dependent || rounding_may_be_background(solved)) return kInfinity;
  if (const auto bound = first_order_bound(solved)) return *bound;
  const Push push = rounding_push(solved);
  BackgroundDistance moved_by;
  Movement movement;
  for (int direction = 1; direction <= directions(m, kDirections); ++direction) {
    const auto seed = static_cast<uint64_t>(direction);
    SnapshotFactor<double> moved;
    if (factor.squared) {
      // G + dG.
      const auto half = random_matrix(m, m, push.products * std::sqrt(0.5), seed);
      moved = factorize_gram(gram + half + half.conjugate_transpose());
    } else {
      // R + dR.
      moved = factor;
      moved.r += random_matrix(moved.r.rows(), m, push.frames, seed);
      if (moved.triangular) moved.r = qr(std::move(moved.r), false).r;
    }
    const auto other = solve_factor(moved, options);
    const auto distance = background_distance(factor.r, pixels, modes, other);
    moved_by.largest = std::max(moved_by.largest, distance.largest);
    moved_by.mean = std::max(moved_by.mean, distance.mean);
    movement.see(modes, other);
  }
  if (movement.may_choose_another(modes, kRoom)) return kInfinity;
  return with_room(moved_by);
}

double sensitivity(const SolvedWindow& solved) {
  const auto& [gram, pixels, options, factor, modes] = solved;
  const Index m = gram.cols(), rank = factor.r.rows();
  if (modes.eigenvalues.size() == 0) return 0;
  if (const auto moved = first_order_sensitivity(solved)) return *moved;
  double mean = 0;
  Movement movement;
  for (int direction = 1; direction <= directions(m, kDataDirections); ++direction) {
    // Three channels, each of mean square 1/12: 1/4 for a pixel, and along any unit vector.
    const uint64_t seed = 100 + static_cast<uint64_t>(direction);
    SnapshotFactor<double> moved;
    const bool full = options.rank == 0 || options.rank >= m - 1;
    if (factor.triangular && full) {
      // And all that stands upright on the snapshots.
      const double around = std::sqrt(static_cast<double>(rank)) / 2;
      auto square = factor.r;
      if (rank < m) {
        square = QuaternionMatrixd(m, m);
        square.a.topRows(rank) = factor.r.a;
        square.b.topRows(rank) = factor.r.b;
      }
      const auto product = turned(square, around, seed);
      auto g = gram + product + product.conjugate_transpose();
      g.a.diagonal().array() += std::max(pixels, static_cast<double>(rank)) / 4;
      moved = factorize_gram(g);
    } else {
      moved = factor;
      moved.triangular = false;
      moved.r += random_matrix(rank, m, 0.5, seed);
    }
    const auto other = solve_factor(moved, options);
    const double distance = background_distance(factor.r, pixels, modes, other).mean;
    if (!(distance <= mean)) mean = distance;
    movement.see(modes, other);
  }
  return movement.may_choose_another(modes, 1) ? kInfinity : with_own_movement(modes, mean);
}

}  // namespace qdmd
