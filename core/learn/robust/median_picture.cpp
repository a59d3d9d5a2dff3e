#include "core/learn/robust/median_picture.h"

#include <algorithm>

#include "core/passes/median_block.h"

namespace qdmd {

void median_picture(const Grid& grid, const StableFrames& stable,
                    const std::vector<LitPicture>& frames, Pool* pool, uint8_t* const background[3],
                    uint8_t* spread) {
  median_picture(grid, Band(grid.height), stable, frames, pool, background, spread);
}

void median_picture(const Grid& grid, const Band& band, const StableFrames& stable,
                    const std::vector<LitPicture>& frames, Pool* pool, uint8_t* const background[3],
                    uint8_t* spread) {
  // A row of cells a part.
  pool->run(static_cast<size_t>(grid.rows), [&](size_t part) {
    const int row = static_cast<int>(part);
    // Of the rows that are kept.
    const int top = std::max(grid.top(row) - band.first(), 0),
              bottom = std::min(grid.top(row + 1) - band.first(), band.rows());
    if (top >= bottom) return;
    for (int col = 0; col < grid.cols; ++col) {
      const auto shown =
          stable.of_cell[part * static_cast<size_t>(grid.cols) + static_cast<size_t>(col)];
      const size_t known = shown.size(), count = std::min<size_t>(known, kMedianFrames);
      const uint8_t* planes[kChannels * kMedianFrames];
      float inverse[kChannels * kMedianFrames];
      for (size_t i = 0; i < count; ++i) {
        const LitPicture& frame =
            frames[static_cast<size_t>(shown[(2 * i + 1) * known / (2 * count)])];
        for (size_t c = 0; c < kChannels; ++c) {
          planes[kChannels * i + c] = frame.plane[c];
          inverse[kChannels * i + c] = 1 / frame.gain[c];
        }
      }
      const int left = grid.left(col), right = grid.left(col + 1);
      const int width = std::min(kMedianBlock, right - left), height = kMedianBlock / width;
      for (int y = top; y < bottom; y += height)
        for (int x = left; x < right; x += width) {
          const auto first =
              static_cast<size_t>(y) * static_cast<size_t>(grid.width) + static_cast<size_t>(x);
          const uint8_t* rows[kChannels * kMedianFrames];
          for (size_t i = 0; i < kChannels * count; ++i) rows[i] = planes[i] + first;
          uint8_t* const out[3] = {background[0] + first, background[1] + first,
                                   background[2] + first};
          median_block(rows, inverse, count, static_cast<size_t>(std::min(width, right - x)),
                       static_cast<size_t>(std::min(height, bottom - y)),
                       static_cast<size_t>(grid.width), out, spread + first);
        }
    }
  });
}

}  // namespace qdmd
