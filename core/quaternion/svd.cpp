// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/quaternion/svd.h"

namespace qdmd {

template DenseSvd<Eigen::MatrixXcd> dense_svd(const Eigen::MatrixXcd&);
template Svd<double> svd(QuaternionMatrixd);

}  // namespace qdmd
