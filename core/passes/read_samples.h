// SPDX-License-Identifier: LGPL-2.1-or-later
// Frames in which pixels share samples, read as if each pixel had its own.
#pragma once

#include "core/parallel/pool.h"
#include "core/passes/sampling.h"
#include "core/planes/snapshot_range.h"

namespace qdmd {

// Samples of pixels first .. first + count - 1 in row order, of a channel of snapshot `index`:
// where they are, or, where pixels share them, in `room`, which has space for `count`. Of the
// samples' highest eight bits; and of all of them.
const uint8_t* read_samples(const SnapshotRange& snapshots, int index, int channel, size_t first,
                            size_t count, uint8_t* room);
Samples read_whole_samples(const SnapshotRange& snapshots, int index, int channel, size_t first,
                           size_t count, MutableSamples room);
// The whole sample of one pixel, in units of the lowest bit.
int read_sample(const SnapshotRange& snapshots, int index, int channel, size_t pixel);

// read_samples() of a plane by itself.
const uint8_t* read_samples(const ChromaShape& shape, const uint8_t* plane, int channel,
                            size_t first, size_t count, uint8_t* room);

// The planes of a picture. Where pixels share samples, those of channels 1 and 2 are made in
// `room`, which has room_for_planes() bytes; else it may be null. pool may be null.
void read_planes(const KeptPicture& picture, uint8_t* room, const uint8_t* planes[3],
                 Pool* pool = nullptr);
inline size_t room_for_planes(const ChromaShape& shape, int depth = 8) {
  return shape.is_shared()
             ? static_cast<size_t>(sample_bytes(depth)) * (kChannels - 1) * shape.pixels()
             : 0;
}
// Copies channel `channel` of a picture, a sample for each pixel.
void copy_plane(const KeptPicture& picture, int channel, size_t pixels, MutableSamples to);

// The planes of a picture, of which each row is made when a pass comes to it: it is still near
// then.
class PlaneRows {
 public:
  PlaneRows() = default;
  // room: as read_planes(), but for the picture's depth.
  PlaneRows(const KeptPicture& picture, uint8_t* room);

  const uint8_t* plane(int channel) const { return planes_[channel].high; }
  Samples samples(int channel) const { return planes_[channel]; }
  // Makes rows first .. first + count - 1, of picture.shape.height. Any threads may make different
  // rows.
  void read(int first, int count) const;
  void read_all(Pool* pool) const;

 private:
  Samples shared_[kChannels], planes_[kChannels];
  uint8_t* room_ = nullptr;
  ChromaShape shape_;
};

// Reads rows of a picture, one after another: the samples' highest eight bits.
class RowReader {
 public:
  // room: where pixels share samples, space for 2 x width; else it may be null.
  RowReader(const KeptPicture& picture, int width, uint8_t* room)
      : picture_(picture), width_(static_cast<size_t>(width)), room_(room) {}

  // Row y of the three channels. Good until the next call.
  void read(int y, const uint8_t* rows[3]);

 private:
  const KeptPicture& picture_;
  size_t width_;
  uint8_t* room_;
  int spread_ = -1;  // the row of shared samples that is in the room
};

// Every step-th pixel of every step-th row, from row `first` to before row `end`, of a picture that
// is `width` wide. to: of each channel, in row order. room: where pixels share samples, space for
// `width`; else it may be null.
void take_samples(const KeptPicture& picture, int width, const SampledRows& rows, uint8_t* room,
                  const MutableSamples to[3]);

// Where a sampled pixel's samples are in each row of a picture.
class SampleFinder {
 public:
  SampleFinder(const KeptPicture& picture, int width)
      : picture_(picture), width_(static_cast<size_t>(width)) {}

  void seek(int row) {
    const ChromaShape& shape = picture_.shape;
    row_[0] = picture_.plane(0) + static_cast<size_t>(row) * width_;
    for (int c = 1; c < kChannels; ++c)
      row_[c] =
          picture_.plane(c) + (shape.is_shared() ? static_cast<size_t>(row / shape.rows) *
                                                       static_cast<size_t>(shape.chroma_width())
                                                 : static_cast<size_t>(row) * width_);
  }
  const uint8_t* row(size_t c) const { return row_[c]; }
  size_t row_size(size_t c) const { return is_shared(c) ? (width_ + 1) / 2 : width_; }
  uint8_t at(size_t c, size_t col) const { return row_[c][is_shared(c) ? col / 2 : col]; }

 private:
  bool is_shared(size_t c) const { return c > 0 && picture_.shape.is_shared(); }

  const KeptPicture& picture_;
  size_t width_;
  const uint8_t* row_[kChannels] = {};
};

}  // namespace qdmd
