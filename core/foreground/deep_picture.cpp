#include "core/foreground/deep_picture.h"

#include <algorithm>
#include <cstring>

#include "core/foreground/picture.h"
#include "core/passes/digits.h"

namespace qdmd {
namespace {

// Memory of one thread for a run of pixels of up to two rows.
struct Room {
  alignas(64) uint16_t shown[2][3][kMaxRun], level[3][kMaxRun], own[kMaxRun], mean[2][kMaxRun],
      alpha[2][kMaxRun];
  alignas(64) uint8_t grey[kMaxRun];
};

// Pixels of one or two rows that share samples.
struct Block {
  int y;  // the first row
  int rows;
  size_t left, count;
};

class Writer {
 public:
  Writer(const OutputTask& task, const Levels& levels, const MutableImageView& out)
      : task_(task), out_(out), bits_(out.bits) {
    for (int c = 0; c < 3; ++c) {
      at_[c] = out.spacing(c);
      black_[c] = static_cast<uint16_t>(levels.black[c] << bits_.low());
      white_[c] = static_cast<uint16_t>(levels.white[c] == 255 ? bits_.most()
                                                               : levels.white[c] << bits_.low());
    }
    at_[3] = out.spacing(3);
    is_grey_ = out.channel[1] == out.channel[0] && out.channel[2] == out.channel[0];
    for (int c = 0; c < 3; ++c) {
      is_constant_[c] = task.output == Output::mask && has(c) && black_[c] == white_[c];
      for (int r = 0; is_constant_[c] && r < 2; ++r)
        std::fill_n(room_.shown[r][c], kMaxRun, black_[c]);
    }
    find_pairs();
    find_fours();
  }

  void write(const Block& block) {
    for (int r = 0; r < block.rows; ++r) {
      for (int c = 0; c < 3; ++c)
        if (has(c) && !is_constant_[c]) make_row(c, r, block);
      if (out_.alpha) make_alpha(r, block);
    }
    if (fours_) {
      put_pixels(block);
      return;
    }
    for (int c = 0; c < 3; ++c)
      if (has(c) && !(pairs_ && c > 0)) put_channel(c, block);
    if (pairs_) put_chroma(block);
    for (int r = 0; out_.alpha && r < block.rows; ++r)
      put_words(room_.alpha[r], bits_, block.count, sample(3, block.y + r, block.left),
                at_[3].pixel_stride);
  }

 private:
  // Of grey the last of three channels at one place is written.
  bool has(int c) const { return c == 2 || !is_grey_; }
  uint8_t* sample(int c, int y, size_t x) const {
    return (c < 3 ? out_.channel[c] : out_.alpha) + y / at_[c].rows * at_[c].row_stride +
           static_cast<ptrdiff_t>(x) / at_[c].columns * at_[c].pixel_stride;
  }
  size_t first_pixel(const Block& block, int r) const {
    return static_cast<size_t>(block.y + r) * static_cast<size_t>(out_.width) + block.left;
  }

  // Channels 1 and 2 side by side.
  void find_pairs() {
    const ptrdiff_t apart = is_grey_ ? 0 : out_.channel[2] - out_.channel[1];
    pairs_ = at_[1] == at_[2] && at_[1].pixel_stride == 4 && (apart == 2 || apart == -2);
    first_of_pair_ = apart > 0 ? 1 : 2;
  }
  // A pixel's samples side by side.
  void find_fours() {
    if (!out_.is_even() || out_.pixel_stride != 8 || !out_.alpha) return;
    const uint8_t* const channels[4] = {out_.channel[0], out_.channel[1], out_.channel[2],
                                        out_.alpha};
    const uint8_t* const first = *std::min_element(channels, channels + 4);
    bool all[4] = {};
    for (size_t c = 0; c < 4; ++c) {
      const ptrdiff_t place = (channels[c] - first) / 2;
      if (place > 3 || (channels[c] - first) % 2 != 0) return;
      all[place] = true;
      order_[place] = c;
    }
    fours_ = std::all_of(all, all + 4, [](bool is) { return is; });
  }

  // What the pixels of a row are in a channel.
  void make_row(int c, int r, const Block& block) {
    const size_t first = first_pixel(block, r), count = block.count;
    uint16_t* const to = room_.shown[r][c];
    const uint8_t* const mask = task_.mask ? task_.mask + first : nullptr;
    const auto own = [&] {
      join_digits(task_.x[c] + first, task_.low[c] + first, bits_.low(), count, room_.own);
      return room_.own;
    };
    switch (task_.output) {
      case Output::background:
        if (is_first(c)) find_level(r, block);
        std::copy_n(room_.level[c], count, to);
        break;
      case Output::foreground:
        if (is_first(c)) find_level(r, block);
        if (black_[c] == white_[c])
          std::fill_n(to, count, black_[c]);
        else
          residual_levels(own(), room_.level[c], black_[c], white_[c], count, to);
        break;
      case Output::mask: {
        const uint8_t* grey = mask;
        if (task_.shaded) {
          // At least grey where only light differs.
          for (size_t p = 0; p < count; ++p)
            room_.grey[p] = std::max(mask[p], static_cast<uint8_t>(task_.shaded[first + p] & 127));
          grey = room_.grey;
        }
        fit_levels(grey, black_[c], white_[c], count, to);
        break;
      }
      case Output::cutout: {
        const uint8_t* shown = mask;
        if (task_.soft && out_.alpha) {
          // Where alpha fades, colours do not: who composites multiplies them.
          for (size_t p = 0; p < count; ++p) room_.grey[p] = mask[p] ? 255 : 0;
          shown = room_.grey;
        }
        fade(own(), shown, black_[c], count, to);
        break;
      }
    }
  }

  bool is_first(int c) const { return c == (is_grey_ ? 2 : 0); }

  void find_level(int r, const Block& block) {
    uint16_t* const out[3] = {room_.level[0], room_.level[1], room_.level[2]};
    const auto y = static_cast<size_t>(block.y + r);
    if (!task_.level[0]) {
      task_.model->evaluate_deep(first_pixel(block, r), block.count, out);
      return;
    }
    const size_t first = y * task_.level_stride + block.left;
    for (int c = 0; c < 3; ++c)
      join_digits(task_.level[c] + first, task_.level_low[c] + first, bits_.low(), block.count,
                  out[c]);
  }

  void make_alpha(int r, const Block& block) {
    const size_t first = first_pixel(block, r);
    uint16_t* const to = room_.alpha[r];
    if (task_.alpha)
      join_digits(task_.alpha + first, task_.alpha_low + first, bits_.low(), block.count, to);
    else
      std::fill_n(
          to, block.count,
          static_cast<uint16_t>(task_.constant_alpha << bits_.low() | task_.constant_alpha_low));
    if (task_.output != Output::cutout) return;
    std::copy_n(to, block.count, room_.own);
    fade(room_.own, task_.mask + first, 0, block.count, to);
  }

  // The samples of channel c for row r of the block, or for both rows where they share them.
  const uint16_t* samples_of(int c, int r, const Block& block, uint16_t* room) const {
    const Spacing& at = at_[c];
    const uint16_t* const above = room_.shown[r][c];
    if (is_constant_[c]) return above;
    const uint16_t* const below = block.rows == 1 || at.rows == 1 ? nullptr : room_.shown[1][c];
    if (at.columns == 2) {
      mean_of_pairs(above, below, block.count, room);
      return room;
    }
    if (!below) return above;
    for (size_t p = 0; p < block.count; ++p)
      room[p] = static_cast<uint16_t>((above[p] + below[p] + 1) / 2);
    return room;
  }
  size_t width_of(int c, const Block& block) const {
    return at_[c].columns == 2 ? (block.count + 1) / 2 : block.count;
  }

  void put_channel(int c, const Block& block) {
    for (int r = 0; r < block.rows; r += at_[c].rows)
      put_words(samples_of(c, r, block, room_.mean[0]), bits_, width_of(c, block),
                sample(c, block.y + r, block.left), at_[c].pixel_stride);
  }

  void put_chroma(const Block& block) {
    const int one = first_of_pair_, other = 3 - one;
    for (int r = 0; r < block.rows; r += at_[1].rows) {
      const uint16_t* const both[2] = {samples_of(one, r, block, room_.mean[0]),
                                       samples_of(other, r, block, room_.mean[1])};
      put_pairs(both, bits_, width_of(1, block), sample(one, block.y + r, block.left));
    }
  }

  void put_pixels(const Block& block) {
    for (int r = 0; r < block.rows; ++r) {
      const uint16_t* const rows[4] = {room_.shown[r][0], room_.shown[r][1], room_.shown[r][2],
                                       room_.alpha[r]};
      const uint16_t* const ordered[4] = {rows[order_[0]], rows[order_[1]], rows[order_[2]],
                                          rows[order_[3]]};
      put_fours(ordered, bits_, block.count,
                sample(static_cast<int>(order_[0]), block.y + r, block.left));
    }
  }

  const OutputTask& task_;
  const MutableImageView& out_;
  SampleBits bits_;
  Spacing at_[4];
  uint16_t black_[3], white_[3];
  bool is_grey_ = false, pairs_ = false, fours_ = false;
  bool is_constant_[3] = {};  // the same in the whole picture: chroma of masks
  int first_of_pair_ = 1;
  size_t order_[4] = {};  // channels and alpha, as they lie
  Room room_;
};

}  // namespace

void write_deep_picture(const OutputTask& task, const Levels& levels, const MutableImageView& out,
                        int first_row, int row_count) {
  Writer writer(task, levels, out);
  const int together = rows_together(out), end = first_row + row_count;
  const auto width = static_cast<size_t>(out.width);
  for (int y = first_row; y < end; y += together)
    for (size_t left = 0; left < width; left += kMaxRun)
      writer.write({y, std::min(together, end - y), left, std::min(kMaxRun, width - left)});
}

}  // namespace qdmd
