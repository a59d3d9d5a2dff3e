// SPDX-License-Identifier: LGPL-2.1-or-later
// The templates of this folder in double, but for svd.h, compiled once: Eigen's templates in them
// take seconds in each file that uses them.
#include "core/quaternion/factorize.h"
#include "core/quaternion/hermitian.h"
#include "core/quaternion/schur.h"

namespace qdmd {

template QuaternionMatrixd product_of(const QuaternionMatrixd&, const QuaternionMatrixd&);
template Reflector<double> make_reflector(QuaternionMatrixd);
template void apply_left(const Reflector<double>&, QuaternionMatrixd&, Eigen::Index, Eigen::Index,
                         Eigen::Index);
template void apply_right(const Reflector<double>&, QuaternionMatrixd&, Eigen::Index, Eigen::Index,
                          Eigen::Index);
template HermitianEigen<double> hermitian_eigen(QuaternionMatrixd);
template QuaternionMatrixd reduce_to_hessenberg(QuaternionMatrixd&);
template QrFactors<double> qr(QuaternionMatrixd, bool);
template Cholesky<double> cholesky(const QuaternionMatrixd&, double);
template Cholesky<double> pivoted_cholesky(const QuaternionMatrixd&, double);
template QuaternionMatrixd solve_upper(const QuaternionMatrixd&, QuaternionMatrixd);
template double condition_estimate(const ScalarGrid<double>&);
template SchurForm<double> schur(QuaternionMatrixd);
template QuaternionMatrixd triangular_eigenvector(const QuaternionMatrixd&, Eigen::Index);
template QuaternionMatrixd triangular_left_eigenvector(const QuaternionMatrixd&, Eigen::Index);

}  // namespace qdmd
