// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/gram/shared_chroma.h"

#include <algorithm>

#include "core/gram/block_sums.h"

namespace qdmd {
namespace {

// Chroma samples that are worked on at once, in whole rows: all that belongs to them, of all
// snapshots, stays in the second-level cache.
constexpr size_t kRun = 1024;

size_t most_products(int rows, int cols) {
  return 4 * static_cast<size_t>(rows) * static_cast<size_t>(cols);
}

std::unique_ptr<int64_t[]> make_products(int rows, int cols) {
  return std::make_unique_for_overwrite<int64_t[]>(most_products(rows, cols));
}

size_t run_of(const ChromaShape& shape) {
  return std::max(kRun, static_cast<size_t>(shape.chroma_width()));
}

}  // namespace

// A call of add().
struct SharedChromaProducts::Part {
  size_t rows, cols;
  int first, count;

  // Element of a product of one plane of each row snapshot with one of each column's; `of_row` and
  // `of_col` planes a snapshot were multiplied.
  template <typename Weight>
  void scatter(const int64_t* products, size_t of_row, size_t of_col, size_t row_channel,
               size_t col_channel, int64_t* sums, Weight weight) const {
    for (size_t j = 0; j < cols; ++j)
      for (size_t d = 0; d < of_col; ++d)
        for (size_t i = 0; i < rows; ++i)
          for (size_t c = 0; c < of_row; ++c)
            sums[(kChannels * j + col_channel + (col_channel > 0 ? d : 0)) * kChannels * rows +
                 kChannels * i + row_channel + (row_channel > 0 ? c : 0)] +=
                weight(c, d) * products[(of_col * j + d) * of_row * rows + of_row * i + c];
  }
};

SharedChromaProducts::SharedChromaProducts(const ChromaShape& shape, const Kernel& kernel, int rows,
                                           int cols)
    : shape_(shape),
      kernel_(kernel),
      run_(run_of(shape)),
      luma_products_(make_products(rows, cols)),
      chroma_products_(make_products(rows, cols)),
      mixed_(make_products(rows, cols)),
      mirrored_(make_products(rows, cols)),
      digits_(std::make_unique_for_overwrite<uint8_t[]>(2 * run_ * static_cast<size_t>(cols))) {
  const auto snapshots = static_cast<size_t>(cols);
  luma_.reserve(snapshots);
  chroma_.reserve(2 * snapshots);
  here_.reserve(2 * snapshots);
  for (size_t plane = 0; plane < 2 * snapshots; ++plane)
    digit_planes_.push_back(digits_.get() + plane * run_);
}

uint64_t SharedChromaProducts::bytes(const ChromaShape& shape, int rows, int cols) {
  return 4 * most_products(rows, cols) * sizeof(int64_t) +
         static_cast<uint64_t>(cols) * (2 * run_of(shape) + 7 * sizeof(uint8_t*));
}

void SharedChromaProducts::clear(const Part& part, const Products& products) {
  std::fill_n(products.get(), 4 * part.rows * part.cols, int64_t{0});
}

void SharedChromaProducts::add(const uint8_t* const* planes, int rows, int cols, int first,
                               int count, int64_t* sums) {
  const Part part = {static_cast<size_t>(rows), static_cast<size_t>(cols), first, count};
  luma_.clear();
  chroma_.clear();
  for (size_t j = 0; j < part.cols; ++j) {
    luma_.push_back(planes[kChannels * j]);
    chroma_.push_back(planes[kChannels * j + 1]);
    chroma_.push_back(planes[kChannels * j + 2]);
  }
  for (const Products* products : {&luma_products_, &chroma_products_, &mixed_, &mirrored_})
    clear(part, *products);
  const int step = static_cast<int>(run_) / shape_.chroma_width();
  for (int row = first; row < first + count; row += step)
    multiply(part, row, std::min(step, first + count - row));
  part.scatter(luma_products_.get(), 1, 1, 0, 0, sums, [](size_t, size_t) { return 1; });
  const int whole = shape_.columns * shape_.rows;
  part.scatter(chroma_products_.get(), 2, 2, 1, 1, sums, [=](size_t, size_t) { return whole; });
  // What it counts: the high digit and the low one.
  part.scatter(mixed_.get(), 2, 2, 1, 0, sums,
               [](size_t, size_t digit) { return digit == 0 ? 4 : 1; });
  part.scatter(mirrored_.get(), 2, 2, 0, 1, sums,
               [](size_t digit, size_t) { return digit == 0 ? 4 : 1; });
  add_edges(part, sums);
}

// All products of some rows of chroma.
void SharedChromaProducts::multiply(const Part& part, int first, int count) {
  const size_t width = static_cast<size_t>(shape_.width),
               samples = static_cast<size_t>(shape_.chroma_width());
  const int top = first * shape_.rows, bottom = std::min(top + count * shape_.rows, shape_.height);
  const size_t others = part.cols - part.rows, length = static_cast<size_t>(count) * samples;
  kernel_.add_dot_products(luma_.data() + others, part.rows, luma_.data(), part.cols,
                           static_cast<size_t>(top) * width,
                           static_cast<size_t>(bottom - top) * width, luma_products_.get());
  here_.clear();
  for (const uint8_t* plane : chroma_)
    here_.push_back(plane + static_cast<size_t>(first) * samples);
  kernel_.add_dot_products(here_.data() + 2 * others, 2 * part.rows, here_.data(), 2 * part.cols, 0,
                           length, chroma_products_.get());
  for (size_t j = 0; j < part.cols; ++j)
    for (int y = top; y < bottom; y += shape_.rows) {
      const uint8_t* above = luma_[j] + static_cast<size_t>(y) * width;
      const bool two = shape_.rows == 2 && y + 1 < shape_.height;
      const size_t at = static_cast<size_t>((y - top) / shape_.rows) * samples;
      block_sums(above, two ? above + width : nullptr, width, digits_.get() + 2 * j * run_ + at,
                 digits_.get() + (2 * j + 1) * run_ + at);
    }
  kernel_.add_dot_products(here_.data() + 2 * others, 2 * part.rows, digit_planes_.data(),
                           2 * part.cols, 0, length, mixed_.get());
  kernel_.add_dot_products(digit_planes_.data() + 2 * others, 2 * part.rows, here_.data(),
                           2 * part.cols, 0, length, mirrored_.get());
}

// Takes off what fewer pixels share at the last column and row of odd sizes.
void SharedChromaProducts::add_edges(const Part& part, int64_t* sums) {
  const auto samples = static_cast<size_t>(shape_.chroma_width());
  const bool odd_width = shape_.width % shape_.columns != 0;
  const bool odd_row =
      shape_.height % shape_.rows != 0 && part.first + part.count == shape_.chroma_height();
  const auto scatter = [&](int64_t weight) {
    part.scatter(chroma_products_.get(), 2, 2, 1, 1, sums, [=](size_t, size_t) { return weight; });
  };
  // The samples of a column, side by side.
  const auto add_column = [&](int first, int count) {
    for (size_t plane = 0; plane < 2 * part.cols; ++plane) {
      uint8_t* to = digits_.get() + plane * run_;
      for (int row = first; row < first + count; ++row)
        *to++ = chroma_[plane][static_cast<size_t>(row + 1) * samples - 1];
    }
    kernel_.add_dot_products(digit_planes_.data() + 2 * (part.cols - part.rows), 2 * part.rows,
                             digit_planes_.data(), 2 * part.cols, 0, static_cast<size_t>(count),
                             chroma_products_.get());
  };
  if (odd_width) {
    clear(part, chroma_products_);
    for (int row = part.first, end = part.first + part.count; row < end;) {
      const int count = std::min(end - row, static_cast<int>(run_));
      add_column(row, count);
      row += count;
    }
    scatter(-shape_.rows);
  }
  if (!odd_row) return;
  const int last = shape_.chroma_height() - 1;
  clear(part, chroma_products_);
  kernel_.add_dot_products(chroma_.data() + 2 * (part.cols - part.rows), 2 * part.rows,
                           chroma_.data(), 2 * part.cols, static_cast<size_t>(last) * samples,
                           samples, chroma_products_.get());
  scatter(-shape_.columns);
  if (!odd_width) return;
  // Both were taken off the corner, which is one pixel's.
  clear(part, chroma_products_);
  add_column(last, 1);
  scatter(1 - shape_.columns * shape_.rows + shape_.columns + shape_.rows);
}

}  // namespace qdmd
