// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/region_contours.h"

#include <algorithm>
#include <cmath>

#include "core/learn/robust/contour.h"
#include "core/passes/read_samples.h"

namespace qdmd {
namespace {

// Pixels differ by more than so many levels, sum of the channels.
const float kDiffer = kChannels * kLooksDiffer;
using steps::contours::kApart;

// Where a pixel is.
enum Place : uint8_t { same, in_region, beside };

// The cells of a region with a margin of two cells, and which of them are in it or next to it.
struct Box {
  int top, left, rows, cols;  // cells
  int first_row, first_col;   // pixels
  size_t width, height;
  std::vector<uint8_t> near;

  Box(const Grid& grid, const std::vector<int>& region) {
    constexpr int kMargin = 2;
    int bottom = 0, right = 0;
    top = grid.rows, left = grid.cols;
    for (int cell : region) {
      const int row = cell / grid.cols, col = cell % grid.cols;
      top = std::min(top, row), bottom = std::max(bottom, row);
      left = std::min(left, col), right = std::max(right, col);
    }
    top = std::max(0, top - kMargin), bottom = std::min(grid.rows - 1, bottom + kMargin);
    left = std::max(0, left - kMargin), right = std::min(grid.cols - 1, right + kMargin);
    rows = bottom - top + 1, cols = right - left + 1;
    first_row = grid.top(top), first_col = grid.left(left);
    width = static_cast<size_t>(grid.left(right + 1) - first_col);
    height = static_cast<size_t>(grid.top(bottom + 1) - first_row);
    near.resize(static_cast<size_t>(rows) * static_cast<size_t>(cols));
    for (int cell : region) {
      const int row = cell / grid.cols - top, col = cell % grid.cols - left;
      for (int y = std::max(0, row - 1); y <= std::min(rows - 1, row + 1); ++y)
        for (int x = std::max(0, col - 1); x <= std::min(cols - 1, col + 1); ++x)
          near[static_cast<size_t>(y * cols + x)] = 1;
    }
  }
};

// Both pictures in unit light, and where each pixel is.
struct Pixels {
  std::vector<float> look[kChannels], background[kChannels];
  std::vector<uint8_t> place;
  std::vector<uint32_t> inside;  // pixels in the region

  Pixels(const Grid& grid, const Box& box, const ContourPictures& from) {
    const size_t count = box.width * box.height;
    for (auto* planes : {look, background})
      for (size_t c = 0; c < kChannels; ++c) planes[c].resize(count);
    place.resize(count, same);
    for (size_t y = 0; y < box.height; ++y) read_row(grid, box, from, y);
    for (int row = 0; row < box.rows; ++row)
      for (int col = 0; col < box.cols; ++col) find_places(grid, box, row, col);
  }

 private:
  void read_row(const Grid& grid, const Box& box, const ContourPictures& from, size_t y) {
    for (size_t x = 0; x < box.width; x += kMaxRun) {
      const size_t run = std::min(kMaxRun, box.width - x), to = y * box.width + x;
      const size_t first =
          (static_cast<size_t>(box.first_row) + y) * static_cast<size_t>(grid.width) +
          static_cast<size_t>(box.first_col) + x;
      // The highest eight bits say enough; models of deep frames write the bits below, too.
      uint8_t level[kChannels][kMaxRun], below[kChannels][kMaxRun], room[kMaxRun];
      const bool deep = from.frames.depth() > 8;
      const auto samples_of = [&](int c) {
        return MutableSamples(level[c], deep ? below[c] : nullptr);
      };
      const MutableSamples out[3] = {samples_of(0), samples_of(1), samples_of(2)};
      from.model->evaluate(first, run, out);
      for (size_t c = 0; c < kChannels; ++c) {
        const uint8_t* const samples =
            read_samples(from.frames, from.at, static_cast<int>(c), first, run, room);
        const float of_look = from.light.back(c).offset,
                    of_background = from.model_light.back(c).offset;
        for (size_t i = 0; i < run; ++i) {
          look[c][to + i] = static_cast<float>(samples[i]) / from.light.gain[c] + of_look;
          background[c][to + i] =
              static_cast<float>(level[c][i]) / from.model_light.gain[c] + of_background;
        }
      }
      for (auto* planes : {look, background}) {
        float* const row[kChannels] = {planes[0].data() + to, planes[1].data() + to,
                                       planes[2].data() + to};
        from.colours.convert(run, row);
      }
    }
  }

  void find_places(const Grid& grid, const Box& box, int row, int col) {
    const bool near = box.near[static_cast<size_t>(row * box.cols + col)] != 0;
    for (int y = grid.top(box.top + row); y < grid.top(box.top + row + 1); ++y)
      for (int x = grid.left(box.left + col); x < grid.left(box.left + col + 1); ++x) {
        const size_t p = static_cast<size_t>(y - box.first_row) * box.width +
                         static_cast<size_t>(x - box.first_col);
        float apart = 0;
        for (size_t c = 0; c < kChannels; ++c) apart += std::abs(look[c][p] - background[c][p]);
        if (apart <= kDiffer) continue;
        place[p] = near ? in_region : beside;
        if (near) inside.push_back(static_cast<uint32_t>(p));
      }
  }
};

}  // namespace

RegionContours contours_of(const Grid& grid, const std::vector<int>& region,
                           const ContourPictures& pictures) {
  RegionContours result;
  if (region.empty()) return result;
  const Box box(grid, region);
  const Pixels pixels(grid, box, pictures);
  double of_look = 0, of_background = 0;
  const auto edge = [](const std::vector<float>* planes, size_t a, size_t b) {
    float sum = 0;
    for (size_t c = 0; c < kChannels; ++c) sum += std::abs(planes[c][a] - planes[c][b]);
    return static_cast<double>(std::min(sum / kChannels, steps::contours::kMostEdge));
  };
  const auto compare = [&](size_t a, size_t b) {
    if (pixels.place[b] == in_region) return;
    if (pixels.place[b] == beside) {
      ++result.open;
      return;
    }
    of_look += edge(pixels.look, a, b);
    of_background += edge(pixels.background, a, b);
    ++result.pairs;
  };
  for (const uint32_t p : pixels.inside) {
    const size_t x = p % box.width, y = p / box.width;
    if (x + kApart < box.width) compare(p, p + kApart);
    if (y + kApart < box.height) compare(p, p + kApart * box.width);
    if (x >= kApart) compare(p, p - kApart);
    if (y >= kApart) compare(p, p - kApart * box.width);
  }
  if (result.pairs == 0) return result;
  result.look = static_cast<float>(of_look / static_cast<double>(result.pairs));
  result.background = static_cast<float>(of_background / static_cast<double>(result.pairs));
  return result;
}

}  // namespace qdmd
