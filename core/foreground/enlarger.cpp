// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/foreground/enlarger.h"

#include <algorithm>

#include "core/passes/bands.h"
#include "core/passes/chroma.h"
#include "core/passes/enlarge.h"
#include "core/passes/residual.h"

namespace qdmd {

Enlarger::Enlarger(const Reduction& size, int depth) : size_(size), depth_(depth) {
  const auto make = [](size_t bytes) { return std::make_unique_for_overwrite<uint8_t[]>(bytes); };
  const auto sample = static_cast<size_t>(sample_bytes(depth));
  for (Memory* const plane : {&residual_, &padded_mask_, &means_})
    *plane = make(padded_width() * static_cast<size_t>(size.small_height()));
  mask_ = make(size.pixels());
  shaded_ = make(size.pixels());
  alpha_ = make(sample * size.pixels());
  frame_ = make(sample * kChannels * size.pixels());
  level_ = make(sample * kChannels * size.pixels());
  small_level_ = make(sample * kChannels * size.small_pixels());
}

uint64_t Enlarger::bytes(const Reduction& size, int depth) {
  const auto sample = static_cast<uint64_t>(sample_bytes(depth));
  return (2 + sample * (1 + 2 * kChannels)) * size.pixels() +
         sample * kChannels * size.small_pixels() +
         3 * (static_cast<uint64_t>(size.small_width()) + 2) *
             static_cast<uint64_t>(size.small_height());
}

void Enlarger::enlarge(OutputTask* task, Pool* pool) {
  // Pixels that one pixel stands for may be to both sides of an area's edge.
  const auto without_ignored = [this](uint8_t* mask) {
    ignored_.clear_rows(0, size_.height, size_.width, mask);
    return mask;
  };
  if (task->mask) {
    if (task->soft) {
      fade(task->mask, mask_.get(), pool);
    } else if (task->level[0]) {
      find_edges(*task, pool);
      std::fill_n(task->level, kChannels, Samples());
    } else {
      repeat(task->mask, mask_.get(), pool);
    }
    task->mask = without_ignored(mask_.get());
  }
  if (task->shaded) {
    repeat(task->shaded, shaded_.get(), pool);
    task->shaded = without_ignored(shaded_.get());
  }
  const auto width = static_cast<size_t>(size_.small_width());
  if (task->alpha)
    task->alpha =
        repeat(task->alpha, width, samples_in(alpha_.get(), size_.pixels(), depth_), pool);
  const Output output = task->output;
  if (output == Output::background || output == Output::foreground) {
    if (!task->level[0]) {
      const MutableSamples small[kChannels] = {plane(small_level_, 0, size_.small_pixels()),
                                               plane(small_level_, 1, size_.small_pixels()),
                                               plane(small_level_, 2, size_.small_pixels())};
      task->model->evaluate_all(size_.small_pixels(), small, pool);
      std::copy_n(small, kChannels, task->level);
      task->level_stride = width;
    }
    for (size_t c = 0; c < kChannels; ++c)
      task->level[c] =
          repeat(task->level[c], task->level_stride, plane(level_, c, size_.pixels()), pool);
    task->level_stride = static_cast<size_t>(size_.width);
  }
  if (output == Output::foreground || output == Output::cutout)
    for (size_t c = 0; c < kChannels; ++c)
      task->x[c] = repeat(task->x[c], width, plane(frame_, c, size_.pixels()), pool);
}

// Columns that are looked at together: most of a mask is black.
struct Enlarger::Block {
  size_t left, count;
};

template <typename Visit>
void Enlarger::for_blocks(Visit visit) const {
  constexpr size_t kColumns = 128;
  const auto width = static_cast<size_t>(size_.small_width());
  for (size_t left = 0; left < width; left += kColumns)
    visit(Block{left, std::min(kColumns, width - left)});
}

// True where the mask has something in the block or next to it.
bool Enlarger::is_near(const uint8_t* mask, int row, const Block& block) const {
  const auto width = static_cast<size_t>(size_.small_width());
  const size_t left = block.left > 0 ? block.left - 1 : 0,
               right = std::min(block.left + block.count + 1, width);
  const int last = std::min(row + 1, size_.small_height() - 1);
  for (int y = std::max(row - 1, 0); y <= last; ++y)
    if (!are_all(mask + static_cast<size_t>(y) * width + left, 0, right - left)) return true;
  return false;
}

void Enlarger::find_edges(const OutputTask& task, Pool* pool) {
  for_rows(pool, size_.small_height(), size_.small_pixels(), [&](int first, int rows) {
    for (int row = first; row < first + rows; ++row)
      for_blocks([&](const Block& block) {
        if (is_near(task.mask, row, block)) cut_residual(task, row, block);
      });
  });
  for_rows(pool, size_.small_height(), size_.pixels(), [&](int first, int rows) {
    for (int row = first; row < first + rows; ++row) find_edge(task.mask, row);
  });
}

// What is outside of the mask differs by nothing.
void Enlarger::cut_residual(const OutputTask& task, int row, const Block& block) {
  const auto width = static_cast<size_t>(size_.small_width());
  const size_t first = static_cast<size_t>(row) * width + block.left,
               of_level = static_cast<size_t>(row) * task.level_stride + block.left;
  const uint8_t *x[kChannels], *level[kChannels];
  for (int c = 0; c < kChannels; ++c) {
    x[c] = task.x[c].high + first;
    level[c] = task.level[c].high + of_level;
  }
  uint8_t* const planes[] = {padded(residual_, row), padded(padded_mask_, row)};
  uint8_t* const residual = planes[0] + block.left;
  residual_norm(x, level, block.count, residual);
  apply_mask(residual, task.mask + first, block.count, residual);
  std::copy_n(task.mask + first, block.count, planes[1] + block.left);
  // The border's pixels stand for those outside.
  for (uint8_t* const samples : planes) {
    if (block.left == 0) samples[-1] = samples[0];
    if (block.left + block.count == width) samples[width] = samples[width - 1];
  }
}

void Enlarger::find_edge(const uint8_t* mask, int row) {
  const auto scale = static_cast<size_t>(size_.scale), width = static_cast<size_t>(size_.width),
             small_width = static_cast<size_t>(size_.small_width());
  const int top = row * size_.scale, end = std::min(top + size_.scale, size_.height);
  const int rows[] = {std::max(row - 1, 0), row, std::min(row + 1, size_.small_height() - 1)};
  for_blocks([&](const Block& block) {
    const size_t left = scale * block.left, count = std::min(scale * block.count, width - left);
    const uint8_t* const own = mask + static_cast<size_t>(row) * small_width + block.left;
    uint8_t* const out = mask_.get() + static_cast<size_t>(top) * width + left;
    if (are_all(own, 0, block.count)) {
      for (int phase = 0; phase < end - top; ++phase)
        std::fill_n(out + static_cast<size_t>(phase) * width, count, uint8_t{0});
      return;
    }
    const uint8_t *residual[3], *masks[3];
    for (size_t r = 0; r < 3; ++r) {
      residual[r] = padded(residual_, rows[r]) + block.left;
      masks[r] = padded(padded_mask_, rows[r]) + block.left;
    }
    uint8_t* const means = padded(means_, row) + block.left;
    find_means(residual, masks, block.count, means);
    for (int phase = 0; phase < end - top; ++phase)
      edge_row(residual[1], residual[phase < size_.scale / 2 ? 0 : 2], means, own, block.count,
               size_.scale, phase, count, out + static_cast<size_t>(phase) * width);
  });
}

void Enlarger::fade(const uint8_t* mask, uint8_t* out, Pool* pool) const {
  const auto width = static_cast<size_t>(size_.width),
             count = static_cast<size_t>(size_.small_width());
  for_rows(pool, size_.height, size_.pixels(), [&](int first, int rows) {
    for (int y = first; y < first + rows; ++y) {
      const int row = y / size_.scale, phase = y % size_.scale;
      const int beside =
          std::clamp(phase < size_.scale / 2 ? row - 1 : row + 1, 0, size_.small_height() - 1);
      enlarge_row(mask + static_cast<size_t>(row) * count,
                  mask + static_cast<size_t>(beside) * count, count, size_.scale, phase, width,
                  out + static_cast<size_t>(y) * width);
    }
  });
}

void Enlarger::repeat(const uint8_t* samples, size_t stride, uint8_t* out, Pool* pool) const {
  const auto width = static_cast<size_t>(size_.width);
  for_rows(pool, size_.small_height(), size_.pixels(), [&](int first, int rows) {
    for (int row = first; row < first + rows; ++row) {
      const int top = row * size_.scale, end = std::min(top + size_.scale, size_.height);
      uint8_t* const to = out + static_cast<size_t>(top) * width;
      repeat_row(samples + static_cast<size_t>(row) * stride, size_.scale, width, to);
      for (int y = top + 1; y < end; ++y)
        std::copy_n(to, width, to + static_cast<size_t>(y - top) * width);
    }
  });
}

MutableSamples Enlarger::repeat(Samples samples, size_t stride, MutableSamples out,
                                Pool* pool) const {
  repeat(samples.high, stride, out.high, pool);
  if (!samples.low) return out.high;
  repeat(samples.low, stride, out.low, pool);
  return out;
}

}  // namespace qdmd
