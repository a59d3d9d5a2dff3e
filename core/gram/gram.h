// The exact Gram matrix of a window, and the quaternion and per-channel matrices inside it.
#pragma once

#include <Eigen/Core>

#include "core/gram/kernel.h"
#include "core/gram/window.h"
#include "core/quaternion/matrix.h"

namespace qdmd {

// 3m x 3m inner products of the window's planes; row 3 t + c is channel c of snapshot t.
using IntegerMatrix = Eigen::Matrix<int64_t, Eigen::Dynamic, Eigen::Dynamic>;

// Keeps the Gram matrix of a ring of snapshots. Integers only: adding and dropping snapshots for
// ever gives the same bits as computing afresh.
class SlidingGram {
 public:
  SlidingGram() = default;
  // Up to `threads` (at least 1) threads compute; their number does not change the bits.
  explicit SlidingGram(int capacity, int threads = 1, const Kernel& kernel = kernels().front());

  // Computes the inner products of the newest `count` snapshots of `window` with the newest `span`
  // (count <= span; 0: all), 9 span products per pixel and snapshot. Several at once read the
  // window from memory once. Elements of matrix() are valid for pairs that met in such a call.
  void add_newest(const Window& window, int count = 1, int span = 0);

  // The matrix in time order, 3 size x 3 size.
  IntegerMatrix matrix(const Window& window) const;

 private:
  IntegerMatrix by_slot_;
  int threads_ = 1;
  Kernel kernel_ = kernels().front();
};

// G_st = x_s^H x_t, m x m, from the identity conj(x) y = x . y - x cross y for pure quaternions.
// Every element is an integer below 2^53 for windows of less than 2^36 pixels, hence exact.
QuaternionMatrixd quaternion_gram(const IntegerMatrix& gram);

// The m x m Gram matrix of one channel alone (0 R, 1 G, 2 B), exact as above.
Eigen::MatrixXd channel_gram(const IntegerMatrix& gram, int channel);

}  // namespace qdmd
