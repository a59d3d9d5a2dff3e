// What all decompositions share: choosing the background modes and fitting their amplitudes.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/dmd/options.h"
#include "core/quaternion/matrix.h"

namespace qdmd {

// The background part of a quaternion decomposition of m snapshots, P modes:
// L(t) = sum_p X combination_p lambda_p^(t - reference_time_p) amplitude_p, X = [x_1 .. x_m].
struct BackgroundModes {
  Eigen::VectorXcd eigenvalues;     // P, imaginary parts >= 0
  QuaternionMatrixd combination;    // m x P
  QuaternionMatrixd amplitudes;     // P x 1
  Eigen::VectorXd reference_times;  // P, frames
  DmdSummary summary;
};

// |omega| = |ln lambda| in rad/frame; infinity for lambda = 0.
double omega_magnitude(std::complex<double> lambda);

// Indices of the background modes, nearest to the origin first: all with |omega| <= threshold, or
// the nearest one where none is (or threshold is 0). Equal distances keep their order. Empty only
// for no eigenvalues.
std::vector<Eigen::Index> select_background(const Eigen::VectorXcd& eigenvalues, double threshold);

// The frame at which lambda^(t - reference) is one for amplitudes that are fitted to m snapshots:
// the last one for growing modes, so that no power exceeds one inside the window.
double fit_reference_time(std::complex<double> lambda, Eigen::Index snapshots);

// Rounding's relative error in the eigenvalues of an exact m x m Gram matrix: eigenvalues below
// this times the largest count as zero, that is singular values below its square root.
double gram_tolerance(Eigen::Index size);

// Amplitudes b (P x 1) that minimize sum_t |x_t - sum_p phi_p lambda_p^(t - reference_p) b_p|^2.
// phi_phi = Phi^H Phi (P x P), phi_x = Phi^H [x_1 .. x_m] (P x m). Dependent modes share the
// minimum-norm solution.
QuaternionMatrixd fit_window_amplitudes(const Eigen::VectorXcd& eigenvalues,
                                        const Eigen::VectorXd& reference_times,
                                        const QuaternionMatrixd& phi_phi,
                                        const QuaternionMatrixd& phi_x);

// Sets reference times and window amplitudes of `modes` for its eigenvalues. phi: k x P, x: k x m,
// pixels or columns with the pixels' inner products.
void fit_to_window(BackgroundModes* modes, const QuaternionMatrixd& phi,
                   const QuaternionMatrixd& x);

// Fills in the summary's facts about the first of `modes`, whose right eigenvector of q_tilde is
// `vector` (rank x 1).
void describe_nearest(BackgroundModes* modes, const QuaternionMatrixd& q_tilde,
                      const QuaternionMatrixd& vector);

// b = Phi^+ x_1 (the paper), minimum-norm least squares on the complex adjoint. phi: k x r, x: k x
// 1.
QuaternionMatrixd first_frame_amplitudes(const QuaternionMatrixd& phi, const QuaternionMatrixd& x);

}  // namespace qdmd
