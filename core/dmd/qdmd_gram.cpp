// SPDX-License-Identifier: LGPL-2.1-or-later
#include <utility>

#include "core/dmd/estimator.h"
#include "core/dmd/qdmd.h"
#include "core/dmd/reduced_qdmd.h"
#include "core/quaternion/double_double.h"

namespace qdmd {
namespace {

template <typename To, typename From>
QuaternionMatrix<To> cast(const QuaternionMatrix<From>& m) {
  const auto convert = [](const std::complex<From>& c) {
    return std::complex<To>(static_cast<To>(c.real()), static_cast<To>(c.imag()));
  };
  return {m.a.unaryExpr(convert), m.b.unaryExpr(convert)};
}

}  // namespace

SnapshotFactor<double> factorize_gram_extended(const QuaternionMatrixd& g) {
  const auto extended = factorize_gram(cast<DoubleDouble>(g));
  SnapshotFactor<double> factor;
  factor.r = cast<double>(extended.r);
  factor.triangular = extended.triangular;
  factor.tolerance = gram_tolerance(g.rows());
  return factor;
}

template QuaternionModes<double> reduced_qdmd(const SnapshotFactor<double>&, const DmdOptions&);
namespace internal {
template std::optional<QuaternionModes<double>> modes_from_schur_form(
    const Projection<double>&, const SnapshotFactor<double>&, const DmdOptions&,
    const QuaternionMatrix<double>*);
template PastSpectrum<double> past_spectrum(const SnapshotFactor<double>&, Eigen::Index);
}  // namespace internal

BackgroundModes qdmd_from_gram(QuaternionMatrixd g, const DmdOptions& options) {
  if (options.solver == Solver::gram_extended)
    return solve_factor(factorize_gram_extended(g), options);
  const auto factor = factorize_gram(g);
  g = {};
  return solve_factor(factor, options);
}

}  // namespace qdmd
