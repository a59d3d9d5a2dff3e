// SPDX-License-Identifier: LGPL-2.1-or-later
// Pictures on a coarse grid, against the slow and obvious way.
#include "core/passes/grid.h"

#include "tests/core/simd_targets.h"
#include "tests/core/test_util.h"

namespace qdmd::test {
namespace {

// The mean over a cell's pixels, of which pixel (x, y) has the level at(x, y). Sums of integers are
// exact.
template <typename At>
float mean_of(const Grid& grid, int row, int col, At at) {
  double sum = 0;
  int count = 0;
  for (int y = grid.top(row); y < grid.top(row + 1); ++y)
    for (int x = grid.left(col); x < grid.left(col + 1); ++x, ++count) sum += at(x, y);
  return static_cast<float>(sum / count);
}

// Bright ones, so that sums are as large as can be.
void fill(BeforeTheEdge<uint8_t>* samples, bool bright, std::mt19937* rng) {
  for (uint8_t& sample : *samples)
    sample = static_cast<uint8_t>(bright ? 255 - (*rng)() % 9 : (*rng)());
}

// Thin pictures have cells of more rows than 16 bits can sum, and more columns than are summed
// together.
constexpr std::pair<int, int> kSizes[] = {{1, 1},     {2, 5},      {47, 90},   {97, 73},
                                          {352, 240}, {3, 200000}, {200000, 3}};

TEST(Cells, CoverThePictureWithoutOverlap) {
  for (int width : {1, 2, 47, 48, 71, 72, 73, 352, 1920})
    for (int height : {1, 3, 48, 71, 240, 1080}) {
      const Grid grid(width, height);
      ASSERT_GE(grid.rows, 1);
      ASSERT_GE(grid.cols, 1);
      EXPECT_EQ(grid.top(0), 0);
      EXPECT_EQ(grid.left(0), 0);
      EXPECT_EQ(grid.top(grid.rows), height);
      EXPECT_EQ(grid.left(grid.cols), width);
      for (int row = 0; row < grid.rows; ++row) EXPECT_LT(grid.top(row), grid.top(row + 1));
      for (int col = 0; col < grid.cols; ++col) EXPECT_LT(grid.left(col), grid.left(col + 1));
    }
}

TEST(Cells, AreFewInThinPictures) {
  for (int length : {100, 1000, 100000, 1 << 30})
    for (int width : {1, 3, 50}) {
      EXPECT_LE(Grid(length, width).cols, 2 * kMostCellsAlong);
      EXPECT_LE(Grid(width, length).rows, 2 * kMostCellsAlong);
    }
}

TEST(Cells, MeansAreThoseOfTheirPixels) {
  for (const auto& [width, height] : kSizes)
    on_every_target([&, width = width, height = height] {
      std::mt19937 rng(5);
      const Grid grid(width, height);
      BeforeTheEdge<uint8_t> plane(static_cast<size_t>(width * height));
      fill(&plane, height > 90, &rng);
      std::vector<float> means(grid.cells(), -1);
      cell_means(grid, plane.data(), means.data());
      for (int row = 0; row < grid.rows; ++row)
        for (int col = 0; col < grid.cols; ++col)
          ASSERT_EQ(means[static_cast<size_t>(row * grid.cols + col)],
                    mean_of(grid, row, col, [&](int x, int y) {
                      return plane[static_cast<size_t>(y * width + x)];
                    }));
    });
}

TEST(Cells, MeansOfSharedSamplesAreThoseOfTheirPixels) {
  Pool pool(3);
  for (const auto& [width, height] : kSizes)
    for (int rows : {1, 2})
      // Cells that begin and end inside of a sample, too; and of single pixels.
      for (int cells_along : {kCellsAlong, 7, 1000})
        on_every_target([&, width = width, height = height] {
          std::mt19937 rng(6);
          const Grid grid(width, height, cells_along);
          const ChromaShape shape = {width, height, 2, rows};
          BeforeTheEdge<uint8_t> brightness(shape.pixels()), first(shape.samples()),
              second(shape.samples());
          for (auto* plane : {&brightness, &first, &second}) fill(plane, height > 90, &rng);
          const uint8_t* const planes[] = {brightness.data(), first.data(), second.data()};
          GridFrames cells(grid, 2);
          find_cells(grid, KeptPicture(planes, shape), &cells, 1, &pool);
          for (int c = 0; c < kChannels; ++c)
            for (int row = 0; row < grid.rows; ++row)
              for (int col = 0; col < grid.cols; ++col)
                ASSERT_EQ(cells.plane(1, c)[row * grid.cols + col],
                          mean_of(grid, row, col,
                                  [&, c = c](int x, int y) {
                                    return c == 0
                                               ? planes[0][y * width + x]
                                               : planes[c][y / rows * shape.chroma_width() + x / 2];
                                  }))
                    << width << " x " << height << ", channel " << c << ", cell " << row << ' '
                    << col;
        });
}

// Cells that are wider than what is summed together; of samples that pixels share, too, where edges
// of cells part such pixels.
TEST(Cells, MayBeWiderThanWhatIsSummedTogether) {
  for (int width : {1500000, 3000001}) {
    std::mt19937 rng(7);
    const Grid grid(width, 1);
    ASSERT_GT(grid.left(1), width > 2000000 ? 4096 : 2048);
    const ChromaShape shape = {width, 1, 2, 1};
    BeforeTheEdge<uint8_t> brightness(shape.pixels()), chroma(shape.samples());
    for (auto* plane : {&brightness, &chroma})
      for (uint8_t& sample : *plane) sample = static_cast<uint8_t>(rng() % 256);
    const uint8_t* const planes[] = {brightness.data(), chroma.data(), chroma.data()};
    GridFrames cells(grid, 1);
    find_cells(grid, KeptPicture(planes, shape), &cells, 0, nullptr);
    for (int col = 0; col < grid.cols; ++col) {
      ASSERT_EQ(cells.plane(0, 0)[col],
                mean_of(grid, 0, col, [&](int x, int) { return planes[0][x]; }));
      ASSERT_EQ(cells.plane(0, 1)[col],
                mean_of(grid, 0, col, [&](int x, int) { return planes[1][x / 2]; }));
    }
  }
}

}  // namespace
}  // namespace qdmd::test
