// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/median_picture.h"

#include <algorithm>
#include <vector>

#include "core/passes/median_block.h"

namespace qdmd {

void median_picture(const Grid& grid, const StableFrames& stable,
                    const std::vector<LitPicture>& frames, Pool* pool, uint8_t* const background[3],
                    uint8_t* spread, const SampleRange& range, ReadAhead* ahead) {
  std::vector<MedianFrame> prepared(frames.size());
  for (size_t i = 0; i < frames.size(); ++i) {
    MedianFrame& at = prepared[i];
    at.is_shared = frames[i].shape.is_shared();
    for (size_t c = 0; c < kChannels; ++c)
      at.stride[c] =
          static_cast<size_t>(c > 0 && at.is_shared ? frames[i].shape.chroma_width() : grid.width);
    at.take_out({frames[i].gain, range});
  }
  // A row of cells a part.
  pool->run(static_cast<size_t>(grid.rows), [&](size_t part, size_t worker) {
    const int row = static_cast<int>(part);
    const int top = grid.top(row), bottom = grid.top(row + 1);
    if (ahead)
      ahead->read(worker, static_cast<size_t>(top) * static_cast<size_t>(grid.width),
                  static_cast<size_t>(bottom - top) * static_cast<size_t>(grid.width));
    for (int col = 0; col < grid.cols; ++col) {
      const auto shown =
          stable.of_cell[part * static_cast<size_t>(grid.cols) + static_cast<size_t>(col)];
      const size_t known = shown.size(), count = std::min<size_t>(known, kMedianFrames);
      const LitPicture* pictures[kMedianFrames];
      MedianFrame at[kMedianFrames];
      ChromaShape shape;
      for (size_t i = 0; i < count; ++i) {
        const auto frame = static_cast<size_t>(shown[(2 * i + 1) * known / (2 * count)]);
        pictures[i] = &frames[frame];
        at[i] = prepared[frame];
        if (at[i].is_shared) shape = pictures[i]->shape;
      }
      const int left = grid.left(col), right = grid.left(col + 1);
      const int most = std::min(kMedianBlock, right - left), tall = kMedianBlock / most;
      const auto stride = static_cast<size_t>(grid.width);
      for (int y = top; y < bottom; y += tall)
        for (int x = left; x < right; x += most) {
          const auto column = static_cast<size_t>(x), line = static_cast<size_t>(y);
          const auto columns = static_cast<size_t>(shape.columns),
                     rows = static_cast<size_t>(shape.rows);
          const MedianBlock block = {static_cast<size_t>(std::min(most, right - x)),
                                     static_cast<size_t>(std::min(tall, bottom - y)),
                                     columns,
                                     rows,
                                     column % columns,
                                     line % rows};
          const size_t first = line * stride + column;
          for (size_t i = 0; i < count; ++i)
            for (size_t c = 0; c < kChannels; ++c)
              at[i].first[c] =
                  pictures[i]->plane[c] + (c > 0 && at[i].is_shared
                                               ? line / rows * at[i].stride[c] + column / columns
                                               : first);
          uint8_t* const out[3] = {background[0] + first, background[1] + first,
                                   background[2] + first};
          median_block(block, at, count, stride, out, spread + first);
        }
    }
  });
}

}  // namespace qdmd
