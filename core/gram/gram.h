// SPDX-License-Identifier: LGPL-2.1-or-later
// The exact Gram matrix of a window, and the quaternion and per-channel matrices inside it.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/gram/kernel.h"
#include "core/gram/shared_chroma.h"
#include "core/parallel/pool.h"
#include "core/planes/snapshot_range.h"
#include "core/quaternion/matrix.h"

namespace qdmd {

// 3m x 3m inner products of the window's planes; row 3 t + c is channel c of snapshot t.
using IntegerMatrix = Eigen::Matrix<int64_t, Eigen::Dynamic, Eigen::Dynamic>;

// Keeps the Gram matrix of a ring of snapshots. Integers only: adding and dropping snapshots for
// ever gives the same bits as computing afresh. Not thread safe.
class SlidingGram {
 public:
  SlidingGram() = default;
  // The threads of `pool` (null: the caller's alone) compute; their number does not change the
  // bits. The pool outlives this. All memory is taken here, but for what threads that join the pool
  // later need: throws std::bad_alloc.
  explicit SlidingGram(int capacity, Pool* pool = nullptr,
                       const Kernel& kernel = kernels().front());
  // For snapshots like these planes. If their chroma has shared samples: for add_rows(), of 8 bits.
  // If samples have more bits, matrix() has the inner products of the whole samples, in units of
  // their lowest bit. Products of high and low digits are kept apart: four times the products and
  // the memory.
  SlidingGram(int capacity, const ChromaShape& shape, int depth, Pool* pool = nullptr,
              const Kernel& kernel = kernels().front());
  // The bytes that this takes with a pool of so many threads.
  static uint64_t bytes(int capacity, int threads, const ChromaShape& shape = {}, int depth = 8);

  // Computes the inner products of the newest `count` snapshots of `window` with the newest `span`
  // (count <= span; 0: all), at most 9 span products per pixel and snapshot. Several at once read
  // the window from memory once. Elements of matrix() are valid for pairs that met in such a call.
  void add_newest(const Window& window, int count = 1, int span = 0);

  // The inner products of the newest `count` snapshots of `span` with all of it, as far as pixels
  // [first, first + length) of the planes contribute, of plane_size() pixels at most. The slice
  // that begins at pixel 0 comes first and forgets the group's old products; the others follow in
  // any order and size. The group's elements of matrix() are valid once its slices have covered
  // every pixel once. Between slices, other frames may be appended.
  void add_slice(const SnapshotRange& span, int count, size_t first, size_t length);
  // add_slice() for snapshots of the shape, as far as the pixels of chroma rows first .. first +
  // count - 1 contribute: the products of all pixels, as if chroma had been spread to them.
  void add_rows(const SnapshotRange& span, int frames, int first, int count);

  // The matrix in time order, 3 size x 3 size.
  IntegerMatrix matrix(const SnapshotRange& snapshots) const;
  // Of pictures of which others have the other rows: add makes numbers those of all, added up.
  using Add = std::function<void(std::span<int64_t>)>;
  IntegerMatrix matrix(const SnapshotRange& snapshots, const Add& add) const;

 private:
  size_t threads() const { return pool_ ? pool_->threads() : 1; }
  // The planes of a snapshot.
  int planes_of_each() const { return sample_bytes(depth_) * kChannels; }
  using Block = Eigen::Matrix<int64_t, kChannels, kChannels>;
  Block joined(int row_slot, int col_slot) const;
  void make_room();
  void list_planes(const SnapshotRange& span);
  // Sums of a thread for a call with so many rows and columns, zeros the first time.
  int64_t* sums_of(size_t thread, int row_snapshots, int col_snapshots);
  void multiply(int row_snapshots, int col_snapshots, size_t first, size_t length);
  void multiply_rows(int row_snapshots, int col_snapshots, int first, int count);
  void store(const SnapshotRange& span, int start, int end, bool fresh);

  // Row k s + c has the products of slot s's plane c, of k = planes_of_each(), with the planes of
  // its time and before. Planes are the channels, then their low digits.
  IntegerMatrix by_slot_;
  int depth_ = 8;
  Pool* pool_ = nullptr;
  Kernel kernel_ = kernels().front();
  std::vector<const uint8_t*> planes_;  // of a call's span, in time order
  // For each thread, its sums of a call, row after row in each column. Not touched by threads that
  // do nothing.
  std::unique_ptr<int64_t[]> sums_;
  std::vector<uint8_t> has_sums_;  // whether a thread took part
  size_t sums_size_ = 0;           // elements, of one thread
  ChromaShape shape_;
  std::vector<SharedChromaProducts> shared_;  // one for each thread
};

// G_st = x_s^H x_t, m x m, from the identity conj(x) y = x . y - x cross y for pure quaternions.
// Every element is an integer below 2^53 for windows of less than 2^36 pixels, hence exact.
QuaternionMatrixd quaternion_gram(const IntegerMatrix& gram);

// How many of the first `count` snapshots are different from each other and not black: their rank
// is at most that. Frames that come twice, and pictures that stand still, are told exactly.
int distinct_snapshots(const IntegerMatrix& gram, int count);

// The m x m Gram matrix of one channel alone (0 R, 1 G, 2 B), exact as above.
Eigen::MatrixXd channel_gram(const IntegerMatrix& gram, int channel);

}  // namespace qdmd
