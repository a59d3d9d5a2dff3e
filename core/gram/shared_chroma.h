// SPDX-License-Identifier: LGPL-2.1-or-later
// Inner products of frames whose chroma samples are shared by pixels, without spreading them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/channels.h"
#include "core/gram/kernel.h"
#include "core/planes/chroma_shape.h"

namespace qdmd {

// With w_k pixels that share chroma sample k, and Y'_k the sum of their luma,
//   sum over pixels of U U = sum over samples of w_k U_k U_k, and of Y U = sum of Y'_k U_k.
// w_k is the same but at the edges of odd sizes; Y'_k is 4 times one 8-bit digit plus another. So
// all products are of 8-bit planes, exact, and they are fewer than half of those of spread planes.
// One object for each thread.
class SharedChromaProducts {
 public:
  // For up to `rows` snapshots with up to `cols` of them.
  SharedChromaProducts(const ChromaShape& shape, const Kernel& kernel, int rows, int cols);
  static uint64_t bytes(const ChromaShape& shape, int rows, int cols);

  // Adds what the pixels of chroma rows first .. first + count - 1 contribute to the inner products
  // of the last `rows` of `cols` snapshots with all of them: sums[(3 j + d) 3 rows + 3 i + c] of
  // row i's channel c and column j's channel d. planes: three for each column.
  void add(const uint8_t* const* planes, int rows, int cols, int first, int count, int64_t* sums);

 private:
  struct Part;
  using Products = std::unique_ptr<int64_t[]>;

  void multiply(const Part& part, int first, int count);
  void add_edges(const Part& part, int64_t* sums);
  static void clear(const Part& part, const Products& products);

  ChromaShape shape_;
  Kernel kernel_;
  size_t run_;  // chroma samples that are worked on at once, at most
  // Products of luma, of chroma, and of chroma with the digits of luma both ways round.
  Products luma_products_, chroma_products_, mixed_, mirrored_;
  std::unique_ptr<uint8_t[]> digits_;
  std::vector<const uint8_t*> luma_, chroma_, here_, digit_planes_;
};

}  // namespace qdmd
