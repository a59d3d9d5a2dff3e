#include "core/gram/gram.h"

#include <vector>

#include "core/gram/parallel.h"

namespace qdmd {

SlidingGram::SlidingGram(int capacity, int threads, const Kernel& kernel)
    : by_slot_(IntegerMatrix::Zero(kChannels * capacity, kChannels * capacity)),
      threads_(threads),
      kernel_(kernel) {}

void SlidingGram::add_newest(const Window& window, int count, int span) {
  const int size = window.size();
  if (span == 0) span = size;
  std::vector<const uint8_t*> planes;
  planes.reserve(static_cast<size_t>(span) * kChannels);
  for (int t = size - span; t < size; ++t)
    for (int c = 0; c < kChannels; ++c) planes.push_back(window.plane(window.slot(t), c));
  Eigen::Matrix<int64_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> products(
      kChannels * count, kChannels * span);
  const auto rows = static_cast<size_t>(kChannels * count);
  parallel_dot_products(kernel_, threads_, planes.data() + planes.size() - rows, rows,
                        planes.data(), planes.size(), window.plane_size(), products.data());
  for (int k = 0; k < count; ++k) {
    const int added = window.slot(size - count + k);
    for (int t = 0; t < span; ++t) {
      const int slot = window.slot(size - span + t);
      const auto block = products.block<kChannels, kChannels>(kChannels * k, kChannels * t);
      by_slot_.block<kChannels, kChannels>(kChannels * added, kChannels * slot) = block;
      by_slot_.block<kChannels, kChannels>(kChannels * slot, kChannels * added) = block.transpose();
    }
  }
}

IntegerMatrix SlidingGram::matrix(const Window& window) const {
  const int size = window.size();
  IntegerMatrix gram(kChannels * size, kChannels * size);
  for (int t = 0; t < size; ++t)
    for (int s = 0; s < size; ++s)
      gram.block<kChannels, kChannels>(kChannels * s, kChannels * t) =
          by_slot_.block<kChannels, kChannels>(kChannels * window.slot(s),
                                               kChannels * window.slot(t));
  return gram;
}

QuaternionMatrixd quaternion_gram(const IntegerMatrix& gram) {
  const Eigen::Index m = gram.rows() / kChannels;
  QuaternionMatrixd g(m, m);
  for (Eigen::Index t = 0; t < m; ++t)
    for (Eigen::Index s = 0; s < m; ++s) {
      const auto p = gram.block<kChannels, kChannels>(kChannels * s, kChannels * t);
      g.a(s, t) = {static_cast<double>(p(0, 0) + p(1, 1) + p(2, 2)),
                   static_cast<double>(p(2, 1) - p(1, 2))};
      g.b(s, t) = {static_cast<double>(p(0, 2) - p(2, 0)), static_cast<double>(p(1, 0) - p(0, 1))};
    }
  return g;
}

Eigen::MatrixXd channel_gram(const IntegerMatrix& gram, int channel) {
  const Eigen::Index m = gram.rows() / kChannels;
  Eigen::MatrixXd g(m, m);
  for (Eigen::Index t = 0; t < m; ++t)
    for (Eigen::Index s = 0; s < m; ++s)
      g(s, t) = static_cast<double>(gram(kChannels * s + channel, kChannels * t + channel));
  return g;
}

}  // namespace qdmd
