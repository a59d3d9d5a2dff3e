// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/foreground/picture.h"

#include <algorithm>
#include <cstring>

#include "core/passes/chroma.h"
#include "core/passes/digits.h"
#include "core/passes/planes.h"
#include "core/passes/residual.h"
#include "core/passes/soft_edge.h"

namespace qdmd {
namespace {

// Memory of one thread for a run of pixels of up to two rows. T: a sample.
template <typename T>
struct Room {
  alignas(64) T shown[2][3][kMaxRun], level[3][kMaxRun], own[kMaxRun], alpha[kMaxRun];
  alignas(64) T mean[3][kMaxRun], pairs[kMaxRun + 2];
  alignas(64) uint8_t grey[2][kMaxRun];
};

// How the samples of a view lie in memory, as far as it matters who writes them. size: bytes of a
// sample.
class Layout {
 public:
  Layout(const MutableImageView& out, ptrdiff_t size) : out_(out), size_(size) {
    for (int c = 0; c < 3; ++c) at_[c] = out.spacing(c);
    is_grey_ = out.channel[1] == out.channel[0] && out.channel[2] == out.channel[0];
    if (out.is_even() && out.pixel_stride > size) {
      kind_ = Kind::pixels;
      return;
    }
    const ptrdiff_t apart = !is_grey_ && at_[1] == at_[2] ? out.channel[2] - out.channel[1] : 0;
    first_ = apart > 0 ? 1 : 2;
    const bool neighbours = apart == size || apart == -size;
    if (at_[1].pixel_stride == 2 * size && neighbours && at_[0].pixel_stride == size)
      kind_ = Kind::half_planar;
    const ptrdiff_t behind = out.channel[first_] - out.channel[0];
    if (size == 1 && at_[0].pixel_stride == 2 && at_[1].pixel_stride == 4 && at_[1].columns == 2 &&
        at_[1].rows == 1 && at_[1].row_stride == at_[0].row_stride && (apart == 2 || apart == -2) &&
        (behind == 1 || behind == -1)) {
      kind_ = Kind::pairs;
      luma_first_ = behind == 1;
    }
  }

  enum class Kind {
    pixels,       // a pixel's samples side by side, none shared
    planes,       // each channel by itself, or in a way that is not known
    half_planar,  // channels 1 and 2 side by side
    pairs         // two samples of channel 0 between those of channels 1 and 2; of 8 bits
  };
  Kind kind() const { return kind_; }
  // False for grey channels at one place, of which the last one is written, as if each were.
  bool has(int c) const { return c == 2 || !is_grey_; }
  // The one of channels 1 and 2 that lies first.
  int first() const { return first_; }
  bool luma_first() const { return luma_first_; }  // pairs begin with a sample of channel 0
  const Spacing& at(int c) const { return at_[c]; }
  bool is_shared(int c) const { return at_[c].columns > 1 || at_[c].rows > 1; }
  // A channel whose samples can be made where they belong: bytes side by side.
  bool is_direct(int c) const {
    return size_ == 1 && has(c) &&
           (kind_ == Kind::planes || (kind_ == Kind::half_planar && c == 0)) &&
           at_[c].pixel_stride == 1;
  }
  uint8_t* sample(int c, int y, size_t x) const {
    return out_.channel[c] + y / at_[c].rows * at_[c].row_stride +
           static_cast<ptrdiff_t>(x) / at_[c].columns * at_[c].pixel_stride;
  }

 private:
  const MutableImageView& out_;
  ptrdiff_t size_;
  Spacing at_[3];
  Kind kind_ = Kind::planes;
  int first_ = 1;
  bool is_grey_ = false, luma_first_ = true;
};

// Pixels of one or two rows that share samples.
struct Block {
  int y;  // the first row
  int rows;
  size_t left, count;
};

// T: uint8_t for samples of 8 bits, uint16_t for deeper ones.
template <typename T>
class Writer {
 public:
  Writer(const OutputTask& task, const Levels& levels, const MutableImageView& out)
      : task_(task),
        out_(out),
        layout_(out, sizeof(T)),
        has_alpha_(out.alpha && !out.alpha_is_padding) {
    const int shift = out.bits.low();
    const bool greys = task.output == Output::mask || task.output == Output::foreground;
    for (int c = 0; c < 3; ++c) {
      const int white = levels.white[c] == 255 ? out.bits.most() : levels.white[c] << shift;
      black_[c] = static_cast<T>(levels.black[c] << shift);
      white_[c] = static_cast<T>(white);
      is_constant_[c] = !layout_.has(c) || (greys && black_[c] == white_[c]);
      // Once for all rows, but for those that are made where they belong.
      for (int r = 0; r < 2 && is_constant_[c] && !is_made_in_place(c); ++r)
        std::fill_n(room_.shown[r][c], kMaxRun, black_[c]);
    }
    if (out.alpha && (out.alpha_is_padding || !task.alpha))
      std::fill_n(room_.own, kMaxRun,
                  static_cast<T>(out.alpha_is_padding ? 255 : task.constant_alpha));
    if (sizeof(T) > 1 && layout_.kind() == Layout::Kind::pixels) find_order();
  }

  void write(const Block& block) {
    const bool packed = layout_.kind() == Layout::Kind::pixels;
    for (int r = 0; r < block.rows; ++r) {
      make_row(r, block);
      const T* const alpha = out_.alpha ? make_alpha(first_pixel(block, r), block.count) : nullptr;
      if (packed)
        put_pixels(r, block, alpha);
      else if (has_alpha_)
        put_alpha(alpha, block.y + r, block);
    }
    if (!packed) put_channels(block);
  }

 private:
  static constexpr bool kDeep = sizeof(T) > 1;

  bool is_made_in_place(int c) const { return layout_.is_direct(c) && !layout_.is_shared(c); }
  size_t first_pixel(const Block& block, int r) const {
    return static_cast<size_t>(block.y + r) * static_cast<size_t>(out_.width) + block.left;
  }

  // Samples as numbers: where they are, or in `room`.
  const T* read(Samples samples, size_t count, T* room) const {
    if constexpr (kDeep) {
      join_digits(samples, out_.bits.depth, count, room);
      return room;
    } else {
      return samples.high;
    }
  }

  // L of a row of the block. It is computed into `room` unless the task has it.
  void find_level(int r, const Block& block, T* const room[3], const T* out[3]) const {
    const size_t first = static_cast<size_t>(block.y + r) * task_.level_stride + block.left;
    for (int c = 0; c < 3; ++c)
      out[c] = task_.level[0] ? read(task_.level[c] + first, block.count, room[c]) : room[c];
    if (task_.level[0]) return;
    if constexpr (kDeep)
      task_.model->evaluate_deep(first_pixel(block, r), block.count, room);
    else
      task_.model->evaluate(first_pixel(block, r), block.count, room);
  }

  // What the pixels of a row are: shown_[r][c] are their samples, made in the room or in the
  // picture, or where they lie already.
  void make_row(int r, const Block& block) {
    const size_t first = first_pixel(block, r), count = block.count;
    const T** const shown = shown_[r];
    const uint8_t* const mask = task_.mask ? task_.mask + first : nullptr;
    const auto own = [&](int c) { return read(task_.x[c] + first, count, room_.mean[0]); };
    T* to[3];
    for (int c = 0; c < 3; ++c) {
      to[c] = room_.shown[r][c];
      if constexpr (!kDeep)
        if (is_made_in_place(c)) to[c] = layout_.sample(c, block.y + r, block.left);
      shown[c] = to[c];
      if (is_constant_[c] && is_made_in_place(c)) std::fill_n(to[c], count, black_[c]);
    }
    switch (task_.output) {
      case Output::background:
        find_level(r, block, to, shown);
        break;
      case Output::foreground: {
        T* const room[3] = {room_.level[0], room_.level[1], room_.level[2]};
        const T* level[3];
        find_level(r, block, room, level);
        for (int c = 0; c < 3; ++c)
          if (!is_constant_[c]) make_residual(c, first, level[c], count, to[c]);
        break;
      }
      case Output::mask: {
        const uint8_t* grey = mask;
        if (task_.shaded) {
          // At least grey where only light differs.
          for (size_t p = 0; p < count; ++p)
            room_.grey[r][p] =
                std::max(mask[p], static_cast<uint8_t>(task_.shaded[first + p] & 127));
          grey = room_.grey[r];
        }
        for (int c = 0; c < 3; ++c)
          if (!is_constant_[c]) shown[c] = fit(c, grey, count, to[c]);
        break;
      }
      case Output::cutout: {
        const uint8_t* kept = mask;
        if (task_.soft && has_alpha_) {
          // Where alpha fades, colours do not: who composites multiplies them.
          for (size_t p = 0; p < count; ++p) room_.grey[r][p] = mask[p] ? 255 : 0;
          kept = room_.grey[r];
        }
        for (int c = 0; c < 3; ++c)
          if (layout_.has(c)) cut(own(c), kept, black_[c], task_.soft && !has_alpha_, count, to[c]);
        break;
      }
    }
  }

  // |x - L| between black and white.
  void make_residual(int c, size_t first, const T* level, size_t count, T* to) {
    const T* const x = read(task_.x[c] + first, count, room_.mean[0]);
    if constexpr (!kDeep)
      if (is_full(c)) return absolute_residual(x, level, count, to);
    residual_levels(x, level, black_[c], white_[c], count, to);
  }

  // A mask between black and white.
  const T* fit(int c, const uint8_t* grey, size_t count, T* to) const {
    if constexpr (!kDeep)
      if (is_full(c)) return grey;
    fit_levels(grey, black_[c], white_[c], count, to);
    return to;
  }

  // What the mask leaves of x; soft: it may be in between.
  static void cut(const T* x, const uint8_t* mask, T black, bool soft, size_t count, T* to) {
    if constexpr (!kDeep)
      if (!soft && black == 0) return apply_mask(x, mask, count, to);
    fade(x, mask, black, count, to);
  }

  bool is_full(int c) const { return black_[c] == 0 && white_[c] == 255; }

  const T* make_alpha(size_t first, size_t count) {
    // room_.own has the alpha that all samples have.
    const bool varies = task_.alpha && !out_.alpha_is_padding;
    const T* const own = varies ? read(task_.alpha + first, count, room_.own) : room_.own;
    if (task_.output != Output::cutout || !has_alpha_) return own;
    cut(own, task_.mask + first, 0, task_.soft, count, room_.alpha);
    return room_.alpha;
  }

  void put_alpha(const T* alpha, int y, const Block& block) const {
    const Spacing at = out_.spacing(3);
    put(alpha, block.count,
        out_.alpha + y * at.row_stride + static_cast<ptrdiff_t>(block.left) * at.pixel_stride,
        at.pixel_stride);
  }

  void put(const T* samples, size_t count, uint8_t* to, ptrdiff_t stride) const {
    if constexpr (kDeep)
      put_words(samples, out_.bits, count, to, stride);
    else if (stride == 1)
      std::memcpy(to, samples, count);
    else
      for (size_t p = 0; p < count; ++p) to[static_cast<ptrdiff_t>(p) * stride] = samples[p];
  }
  void put_side_by_side(const T* first, const T* second, size_t count, uint8_t* to) const {
    if constexpr (kDeep) {
      const T* const both[2] = {first, second};
      put_pairs(both, out_.bits, count, to);
    } else {
      interleave(first, second, count, to);
    }
  }

  // In which order four samples of a pixel lie side by side.
  void find_order() {
    if (out_.pixel_stride != 4 * ptrdiff_t{sizeof(T)} || !out_.alpha) return;
    const uint8_t* const channels[4] = {out_.channel[0], out_.channel[1], out_.channel[2],
                                        out_.alpha};
    const uint8_t* const first = *std::min_element(channels, channels + 4);
    bool all[4] = {};
    for (int c = 0; c < 4; ++c) {
      const ptrdiff_t place = (channels[c] - first) / ptrdiff_t{sizeof(T)};
      if (place > 3 || (channels[c] - first) % ptrdiff_t{sizeof(T)} != 0) return;
      all[place] = true;
      order_[place] = c;
    }
    is_ordered_ = std::all_of(all, all + 4, [](bool is) { return is; });
  }

  void put_pixels(int r, const Block& block, const T* alpha) {
    const int y = block.y + r;
    if constexpr (!kDeep) {
      join_channels(shown_[r], alpha, block.count, out_, y, static_cast<int>(block.left));
    } else if (is_ordered_) {
      const T* const rows[4] = {shown_[r][0], shown_[r][1], shown_[r][2], alpha};
      const T* const ordered[4] = {rows[order_[0]], rows[order_[1]], rows[order_[2]],
                                   rows[order_[3]]};
      uint8_t* const to = order_[0] < 3
                              ? layout_.sample(order_[0], y, block.left)
                              : out_.alpha + y * out_.row_stride +
                                    static_cast<ptrdiff_t>(block.left) * out_.pixel_stride;
      put_fours(ordered, out_.bits, block.count, to);
    } else {
      for (int c = 0; c < 3; ++c)
        if (layout_.has(c))
          put(shown_[r][c], block.count, layout_.sample(c, y, block.left), out_.pixel_stride);
      if (alpha) put_alpha(alpha, y, block);
    }
  }

  // The samples of channel c for row r of the block, or for both rows where they share them.
  const T* samples_of(int c, int r, const Block& block) {
    const Spacing& at = layout_.at(c);
    const T* const above = shown_[r][c];
    // The mean of equal samples is this sample.
    if (is_constant_[c] || !layout_.is_shared(c)) return above;
    const T* const below = block.rows == 1 || at.rows == 1 ? nullptr : shown_[1][c];
    if (at.columns == 1 && !below) return above;
    T* to = room_.mean[c];
    if constexpr (!kDeep)
      if (layout_.is_direct(c)) to = layout_.sample(c, block.y + r, block.left);
    if (at.columns == 2)
      mean_of_pairs(above, below, block.count, to);
    else
      for (size_t p = 0; p < block.count; ++p)
        to[p] = static_cast<T>((above[p] + below[p] + 1) / 2);
    return to;
  }

  // How many samples a channel has in the block's width.
  size_t width_of(int c, const Block& block) const {
    return layout_.at(c).columns == 2 ? (block.count + 1) / 2 : block.count;
  }

  void put_channel(int c, const Block& block) {
    for (int r = 0; layout_.has(c) && r < block.rows; r += layout_.at(c).rows) {
      const T* const samples = samples_of(c, r, block);
      uint8_t* const to = layout_.sample(c, block.y + r, block.left);
      if (static_cast<const void*>(samples) != to)
        put(samples, width_of(c, block), to, layout_.at(c).pixel_stride);
    }
  }

  void put_channels(const Block& block) {
    if (layout_.kind() == Layout::Kind::planes) {
      for (int c = 0; c < 3; ++c) put_channel(c, block);
    } else if (layout_.kind() == Layout::Kind::half_planar) {
      const int one = layout_.first(), other = 3 - one;
      put_channel(0, block);
      for (int r = 0; r < block.rows; r += layout_.at(1).rows)
        put_side_by_side(samples_of(one, r, block), samples_of(other, r, block), width_of(1, block),
                         layout_.sample(one, block.y + r, block.left));
    } else if constexpr (!kDeep) {
      for (int r = 0; r < block.rows; ++r) put_luma_and_chroma(r, block);
    }
  }

  // Luma between the samples of a row of chroma, or chroma between those of luma.
  void put_luma_and_chroma(int r, const Block& block) requires(!kDeep) {
    const int one = layout_.first(), other = 3 - one;
    const size_t chroma = width_of(1, block);
    interleave(samples_of(one, r, block), samples_of(other, r, block), chroma, room_.pairs);
    const uint8_t* const luma = shown_[r][0];
    uint8_t* const to = std::min(layout_.sample(0, block.y + r, block.left),
                                 layout_.sample(one, block.y + r, block.left));
    const bool luma_first = layout_.luma_first();
    interleave(luma_first ? luma : room_.pairs, luma_first ? room_.pairs : luma, block.count, to);
    // The last pixel of an odd row has both samples of chroma.
    if (block.count % 2 == 1)
      *(layout_.sample(other, block.y + r, block.left) + 4 * (chroma - 1)) =
          room_.pairs[2 * chroma - 1];
  }

  const OutputTask& task_;
  const MutableImageView& out_;
  Layout layout_;
  bool has_alpha_;
  T black_[3], white_[3];
  bool is_constant_[3];
  bool is_ordered_ = false;  // four samples of a pixel lie side by side, these channels and alpha:
  int order_[4] = {};
  Room<T> room_;
  const T* shown_[2][3];
};

template <typename T>
void write_rows(const OutputTask& task, const Levels& levels, const MutableImageView& out,
                int first_row, int row_count) {
  Writer<T> writer(task, levels, out);
  const auto width = static_cast<size_t>(out.width);
  // Rows without gaps are one long row.
  if (out.is_even() && !task.level[0] && out.row_stride == out.pixel_stride * out.width) {
    const size_t all = width * static_cast<size_t>(row_count);
    for (size_t left = 0; left < all; left += kMaxRun)
      writer.write({first_row, 1, left, std::min(kMaxRun, all - left)});
    return;
  }
  const int together = rows_together(out), end = first_row + row_count;
  for (int y = first_row; y < end; y += together)
    for (size_t left = 0; left < width; left += kMaxRun)
      writer.write({y, std::min(together, end - y), left, std::min(kMaxRun, width - left)});
}

}  // namespace

int rows_together(const MutableImageView& view) {
  int rows = 1;
  for (int c = 0; c < 3; ++c) rows = std::max(rows, view.spacing(c).rows);
  return rows;
}

void write_picture(const OutputTask& task, const Levels& levels, const MutableImageView& out,
                   int first_row, int row_count) {
  if (out.bits.is_deep())
    write_rows<uint16_t>(task, levels, out, first_row, row_count);
  else
    write_rows<uint8_t>(task, levels, out, first_row, row_count);
}

}  // namespace qdmd
