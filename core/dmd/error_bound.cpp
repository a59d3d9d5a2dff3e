#include "core/dmd/error_bound.h"

#include "core/dmd/estimator.h"

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

// Numbers between -1 and 1 that repeat from run to run, of mean square 1/3.
class Random {
 public:
  explicit Random(uint64_t seed) : state_(2 * seed + 1) {}
  // Every part of mean square `size`^2.
  Quaterniond operator()(double size) {
    const double w = next(), x = next(), y = next(), z = next();
    return Quaterniond(w, x, y, z) * (size * std::sqrt(3.0));
  }

 private:
  double next() {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return static_cast<double>(static_cast<int64_t>(state_) >> 11) * 0x1p-52;
  }
  uint64_t state_;
};

// Quaternions of mean square size^2.
QuaternionMatrixd random_matrix(Index rows, Index cols, double size, uint64_t seed) {
  Random random(seed);
  QuaternionMatrixd m(rows, cols);
  for (Index c = 0; c < cols; ++c)
    for (Index r = 0; r < rows; ++r) m.set(r, c, random(size / 2));
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
  void see(const BackgroundModes& modes, const BackgroundModes& moved) {
    const double change = std::abs(modes.summary.omega - moved.summary.omega);
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
  // Frames less their mean: what is common to all has the sum of the shares alone.
  QuaternionMatrixd around = r;
  const Eigen::VectorXcd mean_a = r.a.rowwise().mean(), mean_b = r.b.rowwise().mean();
  around.a.colwise() -= mean_a;
  around.b.colwise() -= mean_b;
  BackgroundDistance result;
  for (Index t : {Index{0}, m / 2, m - 1}) {
    const auto shares =
        shares_at(modes, static_cast<double>(t)) - shares_at(other, static_cast<double>(t));
    const double whole = (r * shares).norm();
    const double sum = std::hypot(std::abs(shares.a.sum()), std::abs(shares.b.sum()));
    double absolute = 0;
    for (Index s = 0; s < m; ++s) absolute += shares.get(s, 0).norm();
    // Three bounds of one pixel: of the whole picture's norm; of frames that are white at most; of
    // their mean, which is white at most, and the norm of what is around it.
    const double largest =
        std::min({whole, kWhite * absolute, kWhite * sum + (around * shares).norm()});
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
  if (modes.selection.dependent) return kInfinity;
  // Errors of m sums add up like random numbers: a few epsilon times the root of m. In a Gram
  // matrix of frames that are alike, all but the first product is small beside its elements.
  const double size = factor.squared ? 4 * kEpsilon
                                     : 4 * std::sqrt(static_cast<double>(m)) * kEpsilon *
                                           std::max(1.0, modes.selection.operator_size);
  BackgroundDistance moved_by;
  Movement movement;
  for (int direction = 1; direction <= (m < kManyFrames ? kDirections : 1); ++direction) {
    const auto seed = static_cast<uint64_t>(direction);
    SnapshotFactor<double> moved;
    if (factor.squared) {
      // G + dG.
      const double scale = gram.a.diagonal().real().maxCoeff();
      const auto half = random_matrix(m, m, size * scale * std::sqrt(0.5), seed);
      moved = factorize_gram(gram + half + half.conjugate_transpose());
    } else {
      // R + dR.
      moved = factor;
      moved.r += random_matrix(
          moved.r.rows(), m,
          size * longest_column(factor.r) / std::sqrt(static_cast<double>(moved.r.rows())), seed);
      if (moved.triangular) moved.r = qr(std::move(moved.r), false).r;
    }
    const auto other = solve_factor(moved, options);
    const auto distance = background_distance(factor.r, pixels, modes, other);
    moved_by.largest = std::max(moved_by.largest, distance.largest);
    moved_by.mean = std::max(moved_by.mean, distance.mean);
    movement.see(modes, other);
  }
  if (movement.may_choose_another(modes, kRoom)) return kInfinity;
  return std::max(moved_by.largest, kRoom * std::min(moved_by.largest, kPeak * moved_by.mean));
}

double sensitivity(const SolvedWindow& solved) {
  const auto& [gram, pixels, options, factor, modes] = solved;
  const Index m = gram.cols(), rank = factor.r.rows();
  if (modes.eigenvalues.size() == 0) return 0;
  double mean = 0;
  Movement movement;
  for (int direction = 1; direction <= (m < kManyFrames ? kDataDirections : 1); ++direction) {
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
  return movement.may_choose_another(modes, 1) ? kInfinity : mean;
}

}  // namespace qdmd
