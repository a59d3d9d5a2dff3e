#include "core/learn/robust/median_picture.h"

#include <algorithm>

#include "core/passes/median_block.h"
#include "core/passes/read_samples.h"

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
      const LitPicture* pictures[kMedianFrames];
      float inverse[kChannels * kMedianFrames];
      for (size_t i = 0; i < count; ++i) {
        const LitPicture& frame =
            frames[static_cast<size_t>(shown[(2 * i + 1) * known / (2 * count)])];
        pictures[i] = &frame;
        for (size_t c = 0; c < kChannels; ++c) inverse[kChannels * i + c] = 1 / frame.gain[c];
      }
      const int left = grid.left(col), right = grid.left(col + 1);
      const int most = std::min(kMedianBlock, right - left), tall = kMedianBlock / most;
      const auto stride = static_cast<size_t>(grid.width);
      for (int y = top; y < bottom; y += tall)
        for (int x = left; x < right; x += most) {
          const size_t first = static_cast<size_t>(y) * stride + static_cast<size_t>(x);
          const auto width = static_cast<size_t>(std::min(most, right - x)),
                     height = static_cast<size_t>(std::min(tall, bottom - y));
          const uint8_t* rows[kChannels * kMedianFrames];
          size_t strides[kChannels * kMedianFrames];
          uint8_t room[kChannels * kMedianFrames][kMedianBlock];
          for (size_t i = 0; i < count; ++i)
            for (size_t c = 0; c < kChannels; ++c) {
              const size_t k = kChannels * i + c;
              const LitPicture& frame = *pictures[i];
              const bool own = c == 0 || !frame.shape.is_shared();
              rows[k] = own ? frame.plane[c] + first : room[k];
              strides[k] = own ? stride : width;
              for (size_t line = 0; !own && line < height; ++line)
                read_samples(frame.shape, frame.plane[c], static_cast<int>(c),
                             first + line * stride, width, room[k] + line * width);
            }
          uint8_t* const out[3] = {background[0] + first, background[1] + first,
                                   background[2] + first};
          median_block(rows, strides, inverse, count, width, height, stride, out, spread + first);
        }
    }
  });
}

}  // namespace qdmd
