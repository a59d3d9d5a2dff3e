#include "core/gram/shared_chroma.h"

#include <algorithm>

#include "core/gram/block_sums.h"

namespace qdmd {
namespace {

// Chroma samples whose digits of luma are made at once: those of all snapshots stay in the
// second-level cache.
constexpr size_t kRun = 1024;

size_t most_products(int rows, int cols) {
  return 4 * static_cast<size_t>(rows) * static_cast<size_t>(cols);
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
      products_(std::make_unique_for_overwrite<int64_t[]>(most_products(rows, cols))),
      mixed_(std::make_unique_for_overwrite<int64_t[]>(most_products(rows, cols))),
      mirrored_(std::make_unique_for_overwrite<int64_t[]>(most_products(rows, cols))),
      digits_(std::make_unique_for_overwrite<uint8_t[]>(2 * kRun * static_cast<size_t>(cols))) {
  const auto snapshots = static_cast<size_t>(cols);
  luma_.reserve(snapshots);
  chroma_.reserve(2 * snapshots);
  run_.reserve(2 * snapshots);
  for (size_t plane = 0; plane < 2 * snapshots; ++plane)
    digit_planes_.push_back(digits_.get() + plane * kRun);
}

uint64_t SharedChromaProducts::bytes(int rows, int cols) {
  return 3 * most_products(rows, cols) * sizeof(int64_t) +
         static_cast<uint64_t>(cols) * (2 * kRun + 7 * sizeof(uint8_t*));
}

void SharedChromaProducts::clear(const Part& part, const Products& products) const {
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
  const auto one = [](size_t, size_t) { return int64_t{1}; };
  const auto width = static_cast<size_t>(shape_.width);
  const int top = first * shape_.rows,
            bottom = std::min((first + count) * shape_.rows, shape_.height);
  clear(part, products_);
  kernel_.add_dot_products(luma_.data() + part.cols - part.rows, part.rows, luma_.data(), part.cols,
                           static_cast<size_t>(top) * width,
                           static_cast<size_t>(bottom - top) * width, products_.get());
  part.scatter(products_.get(), 1, 1, 0, 0, sums, one);

  const auto samples = static_cast<size_t>(shape_.chroma_width());
  clear(part, products_);
  kernel_.add_dot_products(chroma_.data() + 2 * (part.cols - part.rows), 2 * part.rows,
                           chroma_.data(), 2 * part.cols, static_cast<size_t>(first) * samples,
                           static_cast<size_t>(count) * samples, products_.get());
  const int64_t whole = shape_.columns * shape_.rows;
  part.scatter(products_.get(), 2, 2, 1, 1, sums, [=](size_t, size_t) { return whole; });
  add_edges(part, sums);
  add_mixed(part, sums);
}

// Takes off what fewer pixels share at the last column and row of odd sizes.
void SharedChromaProducts::add_edges(const Part& part, int64_t* sums) {
  const auto samples = static_cast<size_t>(shape_.chroma_width());
  const bool odd_width = shape_.width % shape_.columns != 0;
  const bool odd_row =
      shape_.height % shape_.rows != 0 && part.first + part.count == shape_.chroma_height();
  const auto scatter = [&](int64_t weight) {
    part.scatter(products_.get(), 2, 2, 1, 1, sums, [=](size_t, size_t) { return weight; });
  };
  // The samples of a column, side by side.
  const auto add_column = [&](int first, int count) {
    for (size_t plane = 0; plane < 2 * part.cols; ++plane) {
      uint8_t* to = digits_.get() + plane * kRun;
      for (int row = first; row < first + count; ++row)
        *to++ = chroma_[plane][static_cast<size_t>(row + 1) * samples - 1];
    }
    kernel_.add_dot_products(digit_planes_.data() + 2 * (part.cols - part.rows), 2 * part.rows,
                             digit_planes_.data(), 2 * part.cols, 0, static_cast<size_t>(count),
                             products_.get());
  };
  if (odd_width) {
    clear(part, products_);
    for (int row = part.first, end = part.first + part.count; row < end;) {
      const int count = std::min(end - row, static_cast<int>(kRun));
      add_column(row, count);
      row += count;
    }
    scatter(-shape_.rows);
  }
  if (!odd_row) return;
  const int last = shape_.chroma_height() - 1;
  clear(part, products_);
  kernel_.add_dot_products(chroma_.data() + 2 * (part.cols - part.rows), 2 * part.rows,
                           chroma_.data(), 2 * part.cols, static_cast<size_t>(last) * samples,
                           samples, products_.get());
  scatter(-shape_.columns);
  if (!odd_width) return;
  // Both were taken off the corner, which is one pixel's.
  clear(part, products_);
  add_column(last, 1);
  scatter(1 - shape_.columns * shape_.rows + shape_.columns + shape_.rows);
}

// The digits of chroma samples first .. first + count - 1.
void SharedChromaProducts::digits_of(const uint8_t* luma, size_t first, size_t count, uint8_t* high,
                                     uint8_t* low) const {
  const auto samples = static_cast<size_t>(shape_.chroma_width());
  const auto width = static_cast<size_t>(shape_.width);
  while (count > 0) {
    const size_t row = first / samples, left = first % samples;
    const size_t part = std::min(count, samples - left);
    const size_t y = row * static_cast<size_t>(shape_.rows);
    const uint8_t* above = luma + y * width + 2 * left;
    const bool two = shape_.rows == 2 && y + 1 < static_cast<size_t>(shape_.height);
    block_sums(above, two ? above + width : nullptr, std::min(2 * part, width - 2 * left), high,
               low);
    first += part, count -= part, high += part, low += part;
  }
}

void SharedChromaProducts::add_mixed(const Part& part, int64_t* sums) {
  clear(part, mixed_);
  clear(part, mirrored_);
  const auto samples = static_cast<size_t>(shape_.chroma_width());
  const size_t begin = static_cast<size_t>(part.first) * samples;
  const size_t end = begin + static_cast<size_t>(part.count) * samples;
  const size_t others = 2 * (part.cols - part.rows);
  for (size_t first = begin; first < end; first += kRun) {
    const size_t count = std::min(kRun, end - first);
    run_.clear();
    for (const uint8_t* plane : chroma_) run_.push_back(plane + first);
    for (size_t j = 0; j < part.cols; ++j)
      digits_of(luma_[j], first, count, digits_.get() + 2 * j * kRun,
                digits_.get() + (2 * j + 1) * kRun);
    kernel_.add_dot_products(run_.data() + others, 2 * part.rows, digit_planes_.data(),
                             2 * part.cols, 0, count, mixed_.get());
    kernel_.add_dot_products(digit_planes_.data() + others, 2 * part.rows, run_.data(),
                             2 * part.cols, 0, count, mirrored_.get());
  }
  // Of the high digit and the low one.
  part.scatter(mixed_.get(), 2, 2, 1, 0, sums,
               [](size_t, size_t digit) { return digit == 0 ? int64_t{4} : int64_t{1}; });
  part.scatter(mirrored_.get(), 2, 2, 0, 1, sums,
               [](size_t digit, size_t) { return digit == 0 ? int64_t{4} : int64_t{1}; });
}

}  // namespace qdmd
