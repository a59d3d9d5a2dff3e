#include "core/foreground/picture.h"

#include <algorithm>
#include <cstring>

#include "core/foreground/deep_picture.h"
#include "core/passes/chroma.h"
#include "core/passes/planes.h"
#include "core/passes/soft_edge.h"

namespace qdmd {
namespace {

// Memory of one thread for a run of pixels of up to two rows.
struct Room {
  alignas(64) uint8_t shown[2][3][kMaxRun], level[3][kMaxRun], grey[kMaxRun], alpha[2][kMaxRun];
  alignas(64) uint8_t mean[3][kMaxRun], pairs[kMaxRun + 2];
};

// How the samples of a view lie in memory, as far as it matters who writes them.
class Shape {
 public:
  explicit Shape(const MutableImageView& out) : out_(out) {
    for (int c = 0; c < 3; ++c) at_[c] = out.spacing(c);
    is_grey_ = out.channel[1] == out.channel[0] && out.channel[2] == out.channel[0];
    if (out.is_even() && out.pixel_stride > 1) {
      kind_ = Kind::pixels;
      return;
    }
    const bool alike = !is_grey_ && at_[1].pixel_stride == at_[2].pixel_stride &&
                       at_[1].row_stride == at_[2].row_stride && at_[1].columns == at_[2].columns &&
                       at_[1].rows == at_[2].rows;
    const ptrdiff_t apart = alike ? out.channel[2] - out.channel[1] : 0;
    first_ = apart > 0 ? 1 : 2;
    if (at_[1].pixel_stride == 2 && (apart == 1 || apart == -1) && at_[0].pixel_stride == 1)
      kind_ = Kind::half_planar;
    const ptrdiff_t behind = out.channel[first_] - out.channel[0];
    if (at_[0].pixel_stride == 2 && at_[1].pixel_stride == 4 && at_[1].columns == 2 &&
        at_[1].rows == 1 && at_[1].row_stride == at_[0].row_stride && (apart == 2 || apart == -2) &&
        (behind == 1 || behind == -1)) {
      kind_ = Kind::pairs;
      luma_first_ = behind == 1;
    }
  }

  enum class Kind {
    pixels,       // a pixel's samples side by side, none shared
    planes,       // each channel by itself
    half_planar,  // channels 1 and 2 side by side
    pairs         // two samples of channel 0 between those of channels 1 and 2
  };
  Kind kind() const { return kind_; }
  // Of grey the last of three channels at one place is written, as if each were.
  bool has(int c) const { return c == 2 || !is_grey_; }
  // Of channels 1 and 2 the one that lies first.
  int first() const { return first_; }
  // Of pairs.
  bool luma_first() const { return luma_first_; }
  const Spacing& at(int c) const { return at_[c]; }
  bool is_shared(int c) const { return at_[c].columns > 1 || at_[c].rows > 1; }
  // A channel whose samples can be made where they belong.
  bool is_direct(int c) const {
    return has(c) && (kind_ == Kind::planes || (kind_ == Kind::half_planar && c == 0)) &&
           at_[c].pixel_stride == 1;
  }
  uint8_t* sample(int c, int y, size_t x) const {
    return out_.channel[c] + y / at_[c].rows * at_[c].row_stride +
           static_cast<ptrdiff_t>(x) / at_[c].columns * at_[c].pixel_stride;
  }

 private:
  const MutableImageView& out_;
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

class Writer {
 public:
  Writer(const OutputTask& task, const Levels& levels, const MutableImageView& out)
      : task_(task),
        levels_(levels),
        out_(out),
        shape_(out),
        has_alpha_(out.alpha && !out.alpha_is_padding) {
    const bool greys = task.output == Output::mask || task.output == Output::foreground;
    for (int c = 0; c < 3; ++c)
      is_constant_[c] = !shape_.has(c) || (greys && levels.black[c] == levels.white[c]);
    // Once for all rows, but for those that are made where they belong.
    for (int c = 0; c < 3; ++c)
      if (is_constant_[c] && !is_made_in_place(c))
        for (auto& row : room_.shown)
          std::memset(row[c], levels.black[c], std::min(kMaxRun, static_cast<size_t>(out.width)));
  }

  void write(const Block& block) {
    const bool packed = shape_.kind() == Shape::Kind::pixels;
    for (int r = 0; r < block.rows; ++r) {
      const int y = block.y + r;
      for (int c = 0; c < 3; ++c)
        rows_[r][c] = is_made_in_place(c) ? shape_.sample(c, y, block.left) : room_.shown[r][c];
      make_row(r, block);
      const uint8_t* alpha =
          out_.alpha ? make_alpha(r, first_pixel(block, r), block.count) : nullptr;
      if (packed)
        join_channels(rows_[r], alpha, block.count, out_, y, static_cast<int>(block.left));
      else if (has_alpha_)
        put_alpha(alpha, y, block);
    }
    if (!packed) put_channels(block);
  }

 private:
  bool is_made_in_place(int c) const { return shape_.is_direct(c) && !shape_.is_shared(c); }
  size_t first_pixel(const Block& block, int r) const {
    return static_cast<size_t>(block.y + r) * static_cast<size_t>(out_.width) + block.left;
  }

  // What the pixels of a row are.
  void make_row(int r, const Block& block) {
    const size_t first = first_pixel(block, r), count = block.count;
    uint8_t* const* const to = rows_[r];
    const uint8_t* const mask = task_.mask ? task_.mask + first : nullptr;
    for (int c = 0; c < 3; ++c)
      if (is_constant_[c] && is_made_in_place(c)) std::memset(to[c], levels_.black[c], count);
    switch (task_.output) {
      case Output::background: {
        const uint8_t* level[3];
        find_level(r, block, to, level);
        for (int c = 0; c < 3; ++c)
          if (level[c] != to[c] && shape_.has(c)) std::memcpy(to[c], level[c], count);
        break;
      }
      case Output::foreground: {
        uint8_t* const room[3] = {room_.level[0], room_.level[1], room_.level[2]};
        const uint8_t* level[3];
        find_level(r, block, room, level);
        for (int c = 0; c < 3; ++c)
          if (!is_constant_[c])
            residual_levels(task_.x[c] + first, level[c], levels_.black[c], levels_.white[c], count,
                            to[c]);
        break;
      }
      case Output::mask: {
        const uint8_t* grey = mask;
        if (task_.shaded) {
          // At least grey where only light differs.
          for (size_t p = 0; p < count; ++p)
            room_.grey[p] = std::max(mask[p], static_cast<uint8_t>(task_.shaded[first + p] & 127));
          grey = room_.grey;
        }
        for (int c = 0; c < 3; ++c)
          if (!is_constant_[c]) fit_levels(grey, levels_.black[c], levels_.white[c], count, to[c]);
        break;
      }
      case Output::cutout: {
        const uint8_t* shown = mask;
        if (task_.soft && has_alpha_) {
          // Where alpha fades, colours do not: who composites multiplies them.
          for (size_t p = 0; p < count; ++p) room_.grey[p] = mask[p] ? 255 : 0;
          shown = room_.grey;
        }
        for (int c = 0; c < 3; ++c)
          if (shape_.has(c)) fade(task_.x[c] + first, shown, levels_.black[c], count, to[c]);
        break;
      }
    }
  }

  void find_level(int r, const Block& block, uint8_t* const room[3], const uint8_t* out[3]) const {
    task_.find_level(static_cast<size_t>(block.y + r), block.left, block.count,
                     static_cast<size_t>(out_.width), room, out);
  }

  const uint8_t* make_alpha(int r, size_t first, size_t count) {
    const uint8_t* alpha = task_.alpha ? task_.alpha + first : room_.alpha[r];
    if (out_.alpha_is_padding || !task_.alpha) {
      std::memset(room_.alpha[r], out_.alpha_is_padding ? 255 : task_.constant_alpha, count);
      alpha = room_.alpha[r];
    }
    if (task_.output != Output::cutout || !has_alpha_) return alpha;
    fade(alpha, task_.mask + first, 0, count, room_.level[0]);
    return room_.level[0];
  }

  void put_alpha(const uint8_t* alpha, int y, const Block& block) const {
    const Spacing at = out_.spacing(3);
    put(alpha, block.count,
        out_.alpha + y * at.row_stride + static_cast<ptrdiff_t>(block.left) * at.pixel_stride,
        at.pixel_stride);
  }

  static void put(const uint8_t* samples, size_t count, uint8_t* to, ptrdiff_t stride) {
    if (stride == 1)
      std::memcpy(to, samples, count);
    else
      for (size_t p = 0; p < count; ++p) to[static_cast<ptrdiff_t>(p) * stride] = samples[p];
  }

  // The samples of channel c for row r of the block, or for both rows where they share them.
  const uint8_t* samples_of(int c, int r, const Block& block) {
    const Spacing& at = shape_.at(c);
    const bool one = block.rows == 1 || at.rows == 1;
    // The mean of equal samples is this sample.
    if (is_constant_[c] || !shape_.is_shared(c)) return rows_[r][c];
    uint8_t* const to =
        shape_.is_direct(c) ? shape_.sample(c, block.y + r, block.left) : room_.mean[c];
    if (at.columns == 2)
      mean_of_pairs(rows_[r][c], one ? nullptr : rows_[1][c], block.count, to);
    else if (one)
      std::memcpy(to, rows_[r][c], block.count);
    else
      for (size_t p = 0; p < block.count; ++p)
        to[p] = static_cast<uint8_t>((rows_[0][c][p] + rows_[1][c][p] + 1) / 2);
    return to;
  }

  // Of how many samples a channel consists in the block's width.
  size_t width_of(int c, const Block& block) const {
    return shape_.at(c).columns == 2 ? (block.count + 1) / 2 : block.count;
  }

  void put_channels(const Block& block) {
    switch (shape_.kind()) {
      case Shape::Kind::half_planar: {
        const int step = shape_.at(1).rows, one = shape_.first(), other = 3 - one;
        for (int r = 0; r < block.rows; r += step)
          interleave(samples_of(one, r, block), samples_of(other, r, block), width_of(1, block),
                     shape_.sample(one, block.y + r, block.left));
        break;
      }
      case Shape::Kind::pairs:
        for (int r = 0; r < block.rows; ++r) put_pairs(r, block);
        break;
      default:
        for (int c = 0; c < 3; ++c)
          for (int r = 0; shape_.has(c) && r < block.rows; r += shape_.at(c).rows) {
            const uint8_t* samples = samples_of(c, r, block);
            uint8_t* to = shape_.sample(c, block.y + r, block.left);
            if (samples != to) put(samples, width_of(c, block), to, shape_.at(c).pixel_stride);
          }
        break;
    }
  }

  // Luma between the samples of a row of chroma, or chroma between those of luma.
  void put_pairs(int r, const Block& block) {
    const int one = shape_.first(), other = 3 - one;
    const size_t chroma = width_of(1, block);
    interleave(samples_of(one, r, block), samples_of(other, r, block), chroma, room_.pairs);
    const uint8_t* const luma = rows_[r][0];
    uint8_t* const to = std::min(shape_.sample(0, block.y + r, block.left),
                                 shape_.sample(one, block.y + r, block.left));
    const bool luma_first = shape_.luma_first();
    interleave(luma_first ? luma : room_.pairs, luma_first ? room_.pairs : luma, block.count, to);
    // The last pixel of an odd row has both samples of chroma.
    if (block.count % 2 == 1)
      *(shape_.sample(other, block.y + r, block.left) + 4 * (chroma - 1)) =
          room_.pairs[2 * chroma - 1];
  }

  const OutputTask& task_;
  const Levels& levels_;
  const MutableImageView& out_;
  Shape shape_;
  bool has_alpha_;
  bool is_constant_[3];
  Room room_;
  uint8_t* rows_[2][3];
};

}  // namespace

int rows_together(const MutableImageView& view) {
  int rows = 1;
  for (int c = 0; c < 3; ++c) rows = std::max(rows, view.spacing(c).rows);
  return rows;
}

void write_picture(const OutputTask& task, const Levels& levels, const MutableImageView& out,
                   int first_row, int row_count) {
  if (out.bits.is_deep()) {
    write_deep_picture(task, levels, out, first_row, row_count);
    return;
  }
  // It takes rows without gaps for one.
  if (out.is_even() && out.channel[1] != out.channel[0] && levels.is_full()) {
    write_output(task, out, first_row, row_count);
    return;
  }
  Writer writer(task, levels, out);
  const int together = rows_together(out), end = first_row + row_count;
  const auto width = static_cast<size_t>(out.width);
  for (int y = first_row; y < end; y += together)
    for (size_t left = 0; left < width; left += kMaxRun)
      writer.write({y, std::min(together, end - y), left, std::min(kMaxRun, width - left)});
}

}  // namespace qdmd
