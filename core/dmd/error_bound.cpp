#include "core/dmd/error_bound.h"

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
constexpr int kDirections = 3;
constexpr double kRoom = 10;
// Of half a level: two are typical of all.
constexpr int kDataDirections = 2;

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
  // Errors of m sums add up like random numbers: a few epsilon times the root of m.
  const double size = 4 * std::sqrt(static_cast<double>(m)) * kEpsilon;
  double largest = 0;
  Movement movement;
  for (int direction = 1; direction <= kDirections; ++direction) {
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
    const auto other = reduced_qdmd(moved, options);
    const double distance = background_distance(factor.r, pixels, modes, other).largest;
    if (!(distance <= largest)) largest = distance;
    movement.see(modes, other);
  }
  return movement.may_choose_another(modes, kRoom) ? kInfinity : kRoom * largest;
}

double sensitivity(const SolvedWindow& solved) {
  const auto& [gram, pixels, options, factor, modes] = solved;
  const Index m = gram.cols(), rank = factor.r.rows();
  if (modes.eigenvalues.size() == 0) return 0;
  double mean = 0;
  Movement movement;
  for (int direction = 1; direction <= kDataDirections; ++direction) {
    // Three channels, each of mean square 1/12: 1/4 for a pixel, and along any unit vector.
    auto r = factor.r + random_matrix(rank, m, 0.5, 100 + static_cast<uint64_t>(direction));
    SnapshotFactor<double> moved;
    const bool full = options.rank == 0 || options.rank >= m - 1;
    if (factor.triangular && full) {
      // And all that stands upright on the snapshots.
      auto g = r.conjugate_transpose() * r;
      g.a.diagonal().array() += std::max(0.0, pixels - static_cast<double>(rank)) / 4;
      moved = factorize_gram(g);
    } else {
      moved = factor;
      moved.triangular = false;
      moved.r = std::move(r);
    }
    const auto other = reduced_qdmd(moved, options);
    const double distance = background_distance(factor.r, pixels, modes, other).mean;
    if (!(distance <= mean)) mean = distance;
    movement.see(modes, other);
  }
  return movement.may_choose_another(modes, 1) ? kInfinity : mean;
}

}  // namespace qdmd
