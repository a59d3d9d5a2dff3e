// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/passes/read_samples.h"

#include <algorithm>
#include <cstring>

#include "core/passes/bands.h"
#include "core/passes/chroma.h"

namespace qdmd {
namespace {

// Reads pixels first .. first + count - 1 of a plane of shared samples.
void spread_pixels(const ChromaShape& shape, const uint8_t* plane, size_t first, size_t count,
                   uint8_t* to) {
  const auto width = static_cast<size_t>(shape.width);
  const auto samples = static_cast<size_t>(shape.chroma_width());
  while (count > 0) {
    const size_t y = first / width, x = first % width, part = std::min(count, width - x);
    const uint8_t* from = plane + y / static_cast<size_t>(shape.rows) * samples + x / 2;
    // The second pixel of a pair.
    if (const size_t odd = x % 2; odd == 1) {
      *to = *from;
      spread_samples(from + 1, 1, 2, part - 1, to + 1);
    } else {
      spread_samples(from, 1, 2, part, to);
    }
    first += part, count -= part, to += part;
  }
}

}  // namespace

const uint8_t* read_samples(const ChromaShape& shape, const uint8_t* plane, int channel,
                            size_t first, size_t count, uint8_t* room) {
  if (channel == 0 || !shape.is_shared()) return plane + first;
  spread_pixels(shape, plane, first, count, room);
  return room;
}

const uint8_t* read_samples(const SnapshotRange& snapshots, int index, int channel, size_t first,
                            size_t count, uint8_t* room) {
  return read_samples(snapshots.shape(), snapshots.plane(index, channel), channel, first, count,
                      room);
}

Samples read_whole_samples(const SnapshotRange& snapshots, int index, int channel, size_t first,
                           size_t count, MutableSamples room) {
  const Samples plane = snapshots.samples(index, channel);
  const auto read = [&](const uint8_t* digits, uint8_t* to) {
    return digits ? read_samples(snapshots.shape(), digits, channel, first, count, to) : nullptr;
  };
  return {read(plane.high, room.high), read(plane.low, room.low)};
}

int read_sample(const SnapshotRange& snapshots, int index, int channel, size_t pixel) {
  uint8_t high, low;
  return sample_at(read_whole_samples(snapshots, index, channel, pixel, 1, {&high, &low}), 0,
                   snapshots.depth());
}

void copy_plane(const KeptPicture& picture, int channel, size_t pixels, MutableSamples to) {
  const auto copy = [&](const uint8_t* from, uint8_t* plane) {
    if (!from) return;
    const uint8_t* const read = read_samples(picture.shape, from, channel, 0, pixels, plane);
    if (read != plane) std::copy_n(read, pixels, plane);
  };
  copy(picture.samples[channel].high, to.high);
  copy(picture.samples[channel].low, to.low);
}

PlaneRows::PlaneRows(const KeptPicture& picture, uint8_t* room)
    : room_(room), shape_(picture.shape) {
  std::copy_n(picture.samples, kChannels, shared_);
  std::copy_n(picture.samples, kChannels, planes_);
  for (size_t c = 1; c < kChannels && shape_.is_shared(); ++c) {
    uint8_t* const own = room + (c - 1) * shape_.pixels();
    planes_[c] = {own, shared_[c].low ? own + room_for_planes(shape_) : nullptr};
  }
}

void PlaneRows::read(int first, int count) const {
  if (!shape_.is_shared()) return;
  const auto width = static_cast<size_t>(shape_.width);
  const auto samples = static_cast<size_t>(shape_.chroma_width());
  const auto spread = [&](const uint8_t* plane, uint8_t* to) {
    for (int y = first; y < first + count; ++y) {
      const int shared = y / shape_.rows;
      uint8_t* const row = to + static_cast<size_t>(y) * width;
      // Rows that share samples are alike.
      if (y > first && (y - 1) / shape_.rows == shared)
        std::memcpy(row, row - width, width);
      else
        spread_samples(plane + static_cast<size_t>(shared) * samples, 1, 2, width, row);
    }
  };
  for (size_t c = 1; c < kChannels; ++c) {
    uint8_t* const own = room_ + (c - 1) * shape_.pixels();
    spread(shared_[c].high, own);
    if (shared_[c].low) spread(shared_[c].low, own + room_for_planes(shape_));
  }
}

void PlaneRows::read_all(Pool* pool) const {
  if (!shape_.is_shared()) return;
  for_rows(pool, shape_.height, shape_.pixels(), [&](int first, int count) { read(first, count); });
}

void read_planes(const KeptPicture& picture, uint8_t* room, const uint8_t* planes[3], Pool* pool) {
  const uint8_t* const high[] = {picture.plane(0), picture.plane(1), picture.plane(2)};
  const PlaneRows rows(KeptPicture(high, picture.shape), room);
  rows.read_all(pool);
  for (int c = 0; c < kChannels; ++c) planes[c] = rows.plane(c);
}

void RowReader::read(int y, const uint8_t* rows[3]) {
  const ChromaShape& shape = picture_.shape;
  for (size_t c = 0; c < kChannels; ++c)
    rows[c] = picture_.plane(static_cast<int>(c)) + static_cast<size_t>(y) * width_;
  if (!shape.is_shared()) return;
  const int shared = y / shape.rows;
  for (size_t c = 1; c < kChannels; ++c) {
    uint8_t* const row = room_ + (c - 1) * width_;
    if (shared != spread_)
      spread_samples(picture_.plane(static_cast<int>(c)) +
                         static_cast<size_t>(shared) * static_cast<size_t>(shape.chroma_width()),
                     1, 2, width_, row);
    rows[c] = row;
  }
  spread_ = shared;
}

void take_samples(const KeptPicture& picture, int width, const SampledRows& rows, uint8_t* room,
                  const MutableSamples to[3]) {
  const auto all = static_cast<size_t>(width);
  const size_t along = sample_count(width, rows.step);
  const auto take = [&](const uint8_t* plane, int channel, uint8_t* out) {
    for (int y = rows.first; y < rows.end; y += rows.step, out += along)
      take_samples(
          read_samples(picture.shape, plane, channel, static_cast<size_t>(y) * all, all, room),
          width, 1, rows.step, out);
  };
  for (int c = 0; c < kChannels; ++c) {
    take(picture.samples[c].high, c, to[c].high);
    if (picture.samples[c].low) take(picture.samples[c].low, c, to[c].low);
  }
}

}  // namespace qdmd
