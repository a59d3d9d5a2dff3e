// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/gram/gram.h"

#include <algorithm>
#include <functional>
#include <span>

namespace qdmd {
namespace {

// Snapshots that are rows of one product: their planes fill the kernels' register tiles, and the
// sums stay small for any number of snapshots added at once.
constexpr int kRowSnapshots = 16;

// Parts start at multiples of a cache line, as planes do.
constexpr size_t kUnit = 64;

// Waking a thread costs as much as some million products.
constexpr uint64_t kProductsPerPart = 4'000'000;

// Pixels that amortise the sums of a part, and parts per thread: where another program takes a core
// for a while, the other threads do more of them.
constexpr size_t kPixelsPerPart = 16384;
constexpr size_t kPartsPerThread = 8;

size_t part_count(size_t threads, uint64_t pairs, size_t length) {
  if (threads == 1) return 1;
  const uint64_t by_pixels =
      std::clamp<uint64_t>(length / kPixelsPerPart, threads, threads * kPartsPerThread);
  // Below 2^62: at most 6144 rows and columns of 2^36 pixels.
  const uint64_t most = std::min<uint64_t>(length / kUnit, pairs * length / kProductsPerPart);
  return static_cast<size_t>(std::clamp<uint64_t>(most, 1, by_pixels));
}

// Elements of one thread's sums of a call.
size_t sums_size(int capacity, int planes) {
  return static_cast<size_t>(planes * std::min(kRowSnapshots, capacity)) *
         static_cast<size_t>(planes * capacity);
}

}  // namespace

uint64_t SlidingGram::bytes(int capacity, int threads, const ChromaShape& shape, int depth) {
  const int planes = kChannels * sample_bytes(depth);
  const auto cols = static_cast<uint64_t>(planes * capacity);
  const uint64_t of_thread =
      sums_size(capacity, planes) * sizeof(int64_t) +
      (shape.is_shared()
           ? SharedChromaProducts::bytes(shape, std::min(kRowSnapshots, capacity), capacity)
           : 0);
  return cols * cols * sizeof(int64_t) + cols * sizeof(uint8_t*) +
         of_thread * static_cast<uint64_t>(threads);
}

SlidingGram::SlidingGram(int capacity, Pool* pool, const Kernel& kernel)
    : SlidingGram(capacity, {}, 8, pool, kernel) {}

SlidingGram::SlidingGram(int capacity, const ChromaShape& shape, int depth, Pool* pool,
                         const Kernel& kernel)
    : depth_(depth), pool_(pool), kernel_(kernel), has_sums_(threads()), shape_(shape) {
  const int cols = planes_of_each() * capacity;
  by_slot_ = IntegerMatrix::Zero(cols, cols);
  planes_.reserve(static_cast<size_t>(cols));
  sums_size_ = sums_size(capacity, planes_of_each());
  // Without touching it.
  sums_ = std::make_unique_for_overwrite<int64_t[]>(sums_size_ * has_sums_.size());
  for (size_t i = 0; shape.is_shared() && i < threads(); ++i)
    shared_.emplace_back(shape, kernel, std::min(kRowSnapshots, capacity), capacity);
}

void SlidingGram::add_newest(const Window& window, int count, int span) {
  const SnapshotRange all(window);
  add_slice(span == 0 ? all : all.newest(span), count, 0, window.plane_size());
}

// After Pool::resize() there may be more of them.
void SlidingGram::make_room() {
  if (threads() <= has_sums_.size()) return;
  sums_ = std::make_unique_for_overwrite<int64_t[]>(sums_size_ * threads());
  has_sums_.assign(threads(), 0);
  const int capacity = static_cast<int>(by_slot_.rows() / planes_of_each());
  while (shape_.is_shared() && shared_.size() < threads())
    shared_.emplace_back(shape_, kernel_, std::min(kRowSnapshots, capacity), capacity);
}

void SlidingGram::list_planes(const SnapshotRange& span) {
  planes_.clear();
  for (int t = 0; t < span.size(); ++t) {
    for (int c = 0; c < kChannels; ++c) planes_.push_back(span.plane(t, c));
    for (int c = 0; depth_ > 8 && c < kChannels; ++c) planes_.push_back(span.samples(t, c).low);
  }
}

void SlidingGram::add_slice(const SnapshotRange& span, int count, size_t first, size_t length) {
  make_room();
  list_planes(span);
  // Each snapshot needs those up to itself only: what comes after is the mirror image.
  for (int start = span.size() - count; start < span.size(); start += kRowSnapshots) {
    const int end = std::min(start + kRowSnapshots, span.size());
    multiply(end - start, end, first, length);
    store(span, start, end, first == 0);
  }
}

void SlidingGram::add_rows(const SnapshotRange& span, int frames, int first, int count) {
  make_room();
  list_planes(span);
  for (int start = span.size() - frames; start < span.size(); start += kRowSnapshots) {
    const int end = std::min(start + kRowSnapshots, span.size());
    multiply_rows(end - start, end, first, count);
    store(span, start, end, first == 0);
  }
}

int64_t* SlidingGram::sums_of(size_t thread, int row_snapshots, int col_snapshots) {
  int64_t* sums = sums_.get() + thread * sums_size_;
  if (!has_sums_[thread])
    std::fill_n(sums,
                static_cast<size_t>(planes_of_each() * row_snapshots) *
                    static_cast<size_t>(planes_of_each() * col_snapshots),
                int64_t{0});
  has_sums_[thread] = true;
  return sums;
}

// Leaves the sums of the threads that took part.
void SlidingGram::multiply_rows(int row_snapshots, int col_snapshots, int first, int count) {
  std::fill(has_sums_.begin(), has_sums_.end(), uint8_t{0});
  const size_t pixels = static_cast<size_t>(count) * static_cast<size_t>(shape_.rows) *
                        static_cast<size_t>(shape_.width);
  const uint64_t pairs = uint64_t{kChannels * kChannels} * static_cast<uint64_t>(row_snapshots) *
                         static_cast<uint64_t>(col_snapshots);
  const size_t parts = std::min(part_count(threads(), pairs, pixels),
                                std::max<size_t>(1, static_cast<size_t>(count)));
  const auto boundary = [&](size_t part) {
    return first + static_cast<int>(int64_t{count} * static_cast<int64_t>(part) /
                                    static_cast<int64_t>(parts));
  };
  const auto add = [&](size_t part, size_t thread) {
    shared_[thread].add(planes_.data(), row_snapshots, col_snapshots, boundary(part),
                        boundary(part + 1) - boundary(part),
                        sums_of(thread, row_snapshots, col_snapshots));
  };
  if (parts == 1)
    add(0, 0);
  else
    pool_->run(parts, add);
}

// Leaves the sums of the threads that took part.
void SlidingGram::multiply(int row_snapshots, int col_snapshots, size_t first, size_t length) {
  const auto row_count = static_cast<size_t>(planes_of_each() * row_snapshots);
  const auto col_count = static_cast<size_t>(planes_of_each() * col_snapshots);
  const auto add = [&](size_t start, size_t end, size_t thread) {
    int64_t* sums = sums_of(thread, row_snapshots, col_snapshots);
    kernel_.add_dot_products(planes_.data() + col_count - row_count, row_count, planes_.data(),
                             col_count, start, end - start, sums);
  };
  std::fill(has_sums_.begin(), has_sums_.end(), uint8_t{0});
  const size_t parts = part_count(threads(), uint64_t{row_count} * col_count, length);
  if (parts == 1) {
    add(first, first + length, 0);
    return;
  }
  const auto boundary = [&](size_t part) {
    if (part == 0) return first;
    if (part == parts) return first + length;
    return (first + length / kUnit * part / parts * kUnit) / kUnit * kUnit;
  };
  pool_->run(parts,
             [&](size_t part, size_t thread) { add(boundary(part), boundary(part + 1), thread); });
}

// Snapshots start .. end - 1 of `span` were the rows, those up to end the columns.
void SlidingGram::store(const SnapshotRange& span, int start, int end, bool fresh) {
  const int planes = planes_of_each();
  const Eigen::Index row_count = planes * (end - start);
  for (size_t thread = 0; thread < has_sums_.size(); ++thread) {
    if (!has_sums_[thread]) continue;
    const int64_t* sums = sums_.get() + thread * sums_size_;
    for (int t = 0; t < end; ++t)
      for (int c = 0; c < planes; ++c, sums += row_count) {
        auto column = by_slot_.col(planes * span.slot(t) + c);
        for (int row = start; row < end; ++row) {
          auto products = column.segment(planes * span.slot(row), planes);
          const Eigen::Map<const Eigen::Matrix<int64_t, Eigen::Dynamic, 1>> sum(
              sums + planes * (row - start), planes);
          if (fresh)
            products = sum;
          else
            products += sum;
        }
      }
    fresh = false;
  }
}

// The products of the whole samples of two slots, 3 x 3.
SlidingGram::Block SlidingGram::joined(int row_slot, int col_slot) const {
  const int planes = planes_of_each();
  const auto of = [&](int row_digit, int col_digit) {
    return by_slot_.block<kChannels, kChannels>(planes * row_slot + kChannels * row_digit,
                                                planes * col_slot + kChannels * col_digit);
  };
  if (depth_ == 8) return of(0, 0);
  const int64_t unit = int64_t{1} << bits_below(depth_);
  return of(0, 0) * (unit * unit) + (of(0, 1) + of(1, 0)) * unit + of(1, 1);
}

IntegerMatrix SlidingGram::matrix(const SnapshotRange& snapshots) const {
  const int size = snapshots.size();
  IntegerMatrix gram(kChannels * size, kChannels * size);
  for (int t = 0; t < size; ++t)
    for (int s = 0; s <= t; ++s) {
      const Block block = joined(snapshots.slot(t), snapshots.slot(s));
      gram.block<kChannels, kChannels>(kChannels * t, kChannels * s) = block;
      gram.block<kChannels, kChannels>(kChannels * s, kChannels * t) = block.transpose();
    }
  return gram;
}

IntegerMatrix SlidingGram::matrix(const SnapshotRange& snapshots, const Add& add) const {
  IntegerMatrix gram = matrix(snapshots);
  // What lies above the diagonal is the mirror image. A snapshot at a time: there is no second
  // matrix.
  const Eigen::Index size = gram.cols();
  std::vector<int64_t> values(static_cast<size_t>(kChannels * size));
  for (Eigen::Index t = 0; t < size; t += kChannels) {
    const Eigen::Index below = size - t;
    const auto block = std::span(values).first(static_cast<size_t>(kChannels * below));
    Eigen::Map<IntegerMatrix> sums(block.data(), below, kChannels);
    sums = gram.block(t, t, below, kChannels);
    add(block);
    gram.block(t, t, below, kChannels) = sums;
    gram.block(t, t, kChannels, below) = sums.transpose();
  }
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

int distinct_snapshots(const IntegerMatrix& gram, int count) {
  const auto product = [&](int s, int t) {
    return gram.block<kChannels, kChannels>(kChannels * s, kChannels * t).trace();
  };
  int distinct = 0;
  for (int t = 0; t < count; ++t) {
    const int64_t square = product(t, t);
    bool is_new = square > 0;
    // |x - y|^2 = 0.
    for (int s = 0; s < t && is_new; ++s)
      is_new = product(s, s) != square || product(s, t) != square;
    distinct += is_new;
  }
  return distinct;
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
