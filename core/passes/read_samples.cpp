#include "core/passes/read_samples.h"

#include <algorithm>
#include <cstring>

#include "core/passes/bands.h"
#include "core/passes/chroma.h"

namespace qdmd {
namespace {

// Pixels first .. first + count - 1 of a plane of shared samples.
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

const uint8_t* read_low_samples(const SnapshotRange& snapshots, int index, int channel,
                                size_t first, size_t count, uint8_t* room) {
  return read_samples(snapshots.shape(), snapshots.low_plane(index, channel), channel, first, count,
                      room);
}

PlaneRows::PlaneRows(const KeptPicture& picture, uint8_t* room)
    : room_(room), shape_(picture.shape) {
  std::copy_n(picture.plane, kChannels, shared_);
  std::copy_n(picture.plane, kChannels, planes_);
  for (size_t c = 1; c < kChannels && shape_.is_shared(); ++c)
    planes_[c] = room + (c - 1) * shape_.pixels();
}

void PlaneRows::read(int first, int count) const {
  if (!shape_.is_shared()) return;
  const auto width = static_cast<size_t>(shape_.width);
  const auto samples = static_cast<size_t>(shape_.chroma_width());
  for (size_t c = 1; c < kChannels; ++c)
    for (int y = first; y < first + count; ++y) {
      const int shared = y / shape_.rows;
      uint8_t* const row = room_ + (c - 1) * shape_.pixels() + static_cast<size_t>(y) * width;
      // Rows that share samples are alike.
      if (y > first && (y - 1) / shape_.rows == shared)
        std::memcpy(row, row - width, width);
      else
        spread_samples(shared_[c] + static_cast<size_t>(shared) * samples, 1, 2, width, row);
    }
}

void PlaneRows::read_all(Pool* pool) const {
  if (!shape_.is_shared()) return;
  for_rows(pool, shape_.height, shape_.pixels(), [&](int first, int count) { read(first, count); });
}

void read_planes(const KeptPicture& picture, uint8_t* room, const uint8_t* planes[3], Pool* pool) {
  const PlaneRows rows(picture, room);
  rows.read_all(pool);
  for (int c = 0; c < kChannels; ++c) planes[c] = rows.plane(c);
}

void RowReader::read(int y, const uint8_t* rows[3]) {
  const ChromaShape& shape = picture_.shape;
  for (size_t c = 0; c < kChannels; ++c)
    rows[c] = picture_.plane[c] + static_cast<size_t>(y) * width_;
  if (!shape.is_shared()) return;
  const int shared = y / shape.rows;
  for (size_t c = 1; c < kChannels; ++c) {
    uint8_t* const row = room_ + (c - 1) * width_;
    if (shared != spread_)
      spread_samples(picture_.plane[c] +
                         static_cast<size_t>(shared) * static_cast<size_t>(shape.chroma_width()),
                     1, 2, width_, row);
    rows[c] = row;
  }
  spread_ = shared;
}

}  // namespace qdmd
