// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/dmd/modes.h"

namespace qdmd {

template QuaternionMatrixd fit_window_amplitudes(const ComplexVector<double>&,
                                                 const Eigen::VectorXd&, const QuaternionMatrixd&,
                                                 const QuaternionMatrixd&, bool*);
template QuaternionMatrixd least_squares(const QuaternionMatrixd&, const QuaternionMatrixd&, bool*);

}  // namespace qdmd
