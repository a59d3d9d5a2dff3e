#include "core/gram/parallel.h"

#include <algorithm>
#include <functional>
#include <system_error>
#include <thread>
#include <vector>

namespace qdmd {
namespace {

// Parts start at multiples of a cache line, as planes do.
constexpr size_t kUnit = 64;

// Starting a thread costs as much as some hundred thousand products.
constexpr uint64_t kProductsPerThread = 1'000'000;

// Sums that a thread holds at a time, 2 MiB: without a limit each would need as much memory as the
// whole Gram matrix where a stream's end adds a long window at once.
constexpr size_t kSumsPerThread = size_t{1} << 18;

// What one thread computes.
struct Part {
  std::vector<const uint8_t*> rows, cols;
  size_t length;
  std::vector<int64_t> sums;
};

size_t part_count(int threads, size_t row_count, size_t col_count, size_t length) {
  // Below 2^62: at most 6144 rows and columns of 2^36 pixels.
  const uint64_t products = uint64_t{row_count} * col_count * length;
  const uint64_t most = std::min<uint64_t>(length / kUnit, products / kProductsPerThread);
  return static_cast<size_t>(std::clamp<uint64_t>(most, 1, static_cast<uint64_t>(threads)));
}

void split_pixels(const Kernel& kernel, size_t part_count, const uint8_t* const* rows,
                  size_t row_count, const uint8_t* const* cols, size_t col_count, size_t length,
                  int64_t* out) {
  // All memory is taken before the first thread starts: threads cannot throw.
  std::vector<Part> parts(part_count);
  for (size_t k = 0; k < part_count; ++k) {
    const size_t units = length / kUnit;
    const size_t start = units * k / part_count * kUnit;
    const size_t end = k + 1 < part_count ? units * (k + 1) / part_count * kUnit : length;
    Part& part = parts[k];
    part.length = end - start;
    part.sums.resize(row_count * col_count);
    for (size_t i = 0; i < row_count; ++i) part.rows.push_back(rows[i] + start);
    for (size_t j = 0; j < col_count; ++j) part.cols.push_back(cols[j] + start);
  }
  const auto run = [&](Part& part) noexcept {
    kernel.dot_products(part.rows.data(), row_count, part.cols.data(), col_count, part.length,
                        part.sums.data());
  };
  {
    std::vector<std::jthread> threads;
    threads.reserve(part_count);
    size_t next = 1;
    try {
      for (; next < part_count; ++next)
        threads.emplace_back([&run, &part = parts[next]] { run(part); });
    } catch (const std::system_error&) {
      // The system gives no more threads: this one does their parts.
    }
    run(parts[0]);
    for (; next < part_count; ++next) run(parts[next]);
  }
  std::copy(parts[0].sums.begin(), parts[0].sums.end(), out);
  for (size_t k = 1; k < part_count; ++k)
    std::transform(parts[k].sums.begin(), parts[k].sums.end(), out, out, std::plus<>());
}

}  // namespace

void parallel_dot_products(const Kernel& kernel, int threads, const uint8_t* const* rows,
                           size_t row_count, const uint8_t* const* cols, size_t col_count,
                           size_t length, int64_t* out) {
  const size_t parts = part_count(threads, row_count, col_count, length);
  if (parts == 1) {
    kernel.dot_products(rows, row_count, cols, col_count, length, out);
    return;
  }
  const size_t rows_at_once = std::max<size_t>(1, kSumsPerThread / col_count);
  for (size_t i = 0; i < row_count; i += rows_at_once)
    split_pixels(kernel, parts, rows + i, std::min(rows_at_once, row_count - i), cols, col_count,
                 length, out + i * col_count);
}

}  // namespace qdmd
