#include "core/frames/frame_store.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <limits>
#include <utility>

#include "core/passes/bands.h"
#include "core/passes/chroma.h"
#include "core/passes/digits.h"
#include "core/passes/planes.h"
#include "core/passes/read_samples.h"
#include "core/passes/sampling.h"

namespace qdmd {
namespace {

size_t pixels_of(int width, int height) {
  return static_cast<size_t>(width) * static_cast<size_t>(height);
}

ChromaShape shape_of(int width, int height, const FrameContents& contents) {
  return {width, height, contents.chroma_columns, contents.chroma_rows};
}

// Samples of a channel, of the own rows.
size_t samples_of(const Band& band, int width, int step) {
  return static_cast<size_t>(band.samples(step)) * sample_count(width, step);
}

// Samples of chroma that are spread to pixels at a time; of deep ones two digits of a row.
size_t spread_size(int width, const FrameContents& contents) {
  if (contents.low_bits == 0 && contents.chroma_columns == 1) return 0;
  return 2 * static_cast<size_t>(width);
}

// What the alpha samples of `frame` are if all are equal: its first one, 255 where it has none.
uint8_t first_alpha(const ImageView& frame) {
  return frame.alpha && !frame.alpha_is_padding ? *frame.alpha : uint8_t{255};
}

// Rows first .. end - 1 of `width` samples of a channel, which pixels share as in the plane.
void copy_rows(const ImageView& frame, int channel, int first, int end, int width, uint8_t* plane) {
  const Spacing at = frame.spacing(channel);
  for (int y = first; y < end; ++y)
    spread_samples(frame.channel[channel] + y * at.row_stride, at.pixel_stride, 1,
                   static_cast<size_t>(width), plane + ptrdiff_t{y} * width);
}

}  // namespace

FrameStore::FrameStore(int capacity, int width, const Band& band, const FrameContents& contents,
                       uint64_t most_bytes)
    : band_(band),
      width_(width),
      height_(band.rows()),
      sample_step_(contents.sample_step),
      low_bits_(contents.low_bits),
      most_bytes_(most_bytes),
      planes_(contents.chroma_columns > 1 ? Window(capacity, shape_of(width, height_, contents))
                                          : Window(capacity, pixels_of(width, height_))),
      spread_(spread_size(width, contents)),
      constant_alpha_(static_cast<size_t>(capacity), 255),
      varies_(static_cast<size_t>(capacity), 0),
      poses_(static_cast<size_t>(capacity)) {
  if (low_bits_ > 0) {
    low_ = planes_.shape().is_shared() ? PlaneSlots(capacity, planes_.shape())
                                       : PlaneSlots(capacity, pixels_of(width, height_));
    if (sample_step_ > 1)
      low_samples_ = PlaneSlots(capacity, samples_of(band, width, sample_step_));
    constant_alpha_low_.resize(static_cast<size_t>(capacity), 255);
  }
  if (sample_step_ > 1) samples_ = PlaneSlots(capacity, samples_of(band, width, sample_step_));
  if (contents.cells_along > 0) {
    grid_ = Grid(width, band.height(), contents.cells_along);
    cells_ = GridFrames(grid_, capacity);
    if (!band.is_whole()) to_share_.resize(static_cast<size_t>(capacity), 0);
  }
}

uint64_t FrameStore::bytes(int capacity, int width, const Band& band,
                           const FrameContents& contents) {
  const int height = band.rows();
  uint64_t bytes = PlaneSlots::bytes(capacity, shape_of(width, height, contents));
  uint64_t beside =
      (2 + sizeof(Pose)) * static_cast<uint64_t>(capacity) + spread_size(width, contents);
  const bool deep = contents.low_bits > 0;
  if (contents.sample_step > 1)
    beside +=
        (deep ? 2 : 1) * PlaneSlots::bytes(capacity, samples_of(band, width, contents.sample_step));
  if (contents.cells_along > 0)
    beside += GridFrames::bytes(Grid(width, band.height(), contents.cells_along), capacity);
  if (deep) {
    beside += static_cast<uint64_t>(capacity);
    if (__builtin_add_overflow(bytes, bytes, &bytes)) return std::numeric_limits<uint64_t>::max();
  }
  if (__builtin_add_overflow(bytes, beside, &bytes)) return std::numeric_limits<uint64_t>::max();
  return bytes;
}

uint64_t FrameStore::bytes() const {
  return planes_.bytes() + low_.bytes() + samples_.bytes() + low_samples_.bytes() + cells_.bytes() +
         (alpha_ ? alpha_bytes() : 0) + spread_.size() + constant_alpha_.size() +
         constant_alpha_low_.size() + varies_.size() + untouched_.bytes() + untouched_low_.bytes() +
         poses_.size() * sizeof(Pose);
}

bool FrameStore::append(const ImageView& frame, Pool* pool) {
  const int slot = planes_.append(pool);
  ++frames_taken_;
  poses_[static_cast<size_t>(slot)] = {};
  if (low_bits_ > 0) {
    low_.take_pages(slot, pool);
    low_.pad(slot);
    take_deep_planes(slot, frame);
    if (!take_deep_alpha(slot, frame)) return false;
    take_contents(slot, pool);
    return true;
  }
  const uint8_t alpha = first_alpha(frame);
  const bool constant = take_planes(slot, frame, alpha, pool);
  varies_[static_cast<size_t>(slot)] = !constant;
  constant_alpha_[static_cast<size_t>(slot)] = alpha;
  if (!constant && !keep_alpha(slot, frame)) return false;
  take_contents(slot, pool);
  return true;
}

// What is made of the planes.
void FrameStore::take_contents(int slot, Pool* pool) {
  const KeptPicture picture = planes_.picture(slot);
  if (sample_step_ > 1) {
    take_every_step(picture, slot, &samples_);
    if (low_bits_ > 0) take_every_step(low_.picture(slot), slot, &low_samples_);
  }
  if (cells_.cells() == 0) return;
  find_own_cells(grid_, band_, picture, &cells_, slot, pool);
  if (band_.is_whole()) return;
  to_share_[static_cast<size_t>(slot)] = 1;
  any_to_share_ = true;
}

void FrameStore::take_every_step(const KeptPicture& picture, int slot, PlaneSlots* samples) {
  samples->pad(slot);
  const int top = band_.first_sample(sample_step_) - band_.first(),
            end = band_.own_end() - band_.first();
  RowReader reader(picture, width_, spread_.data());
  const size_t along = sample_count(width_, sample_step_);
  uint8_t* to[] = {samples->plane(slot, 0), samples->plane(slot, 1), samples->plane(slot, 2)};
  for (int y = top; y < end; y += sample_step_) {
    const uint8_t* rows[kChannels];
    reader.read(y, rows);
    for (int c = 0; c < kChannels; to[c++] += along)
      take_samples(rows[c], width_, 1, sample_step_, to[c]);
  }
}

const GridFrames& FrameStore::cells() const {
  if (!any_to_share_) return cells_;
  for (size_t slot = 0; slot < to_share_.size(); ++slot)
    if (std::exchange(to_share_[slot], 0))
      share_cells(grid_, band_, &cells_, static_cast<int>(slot));
  any_to_share_ = false;
  return cells_;
}

bool FrameStore::unshare(uint64_t beside) {
  const bool deep = low_bits_ > 0;
  const uint64_t more = beside + (deep ? 2 : 1) * PlaneSlots::bytes(capacity(), planes_.pixels());
  if (more > most_bytes_ || bytes() > most_bytes_ - more) return false;
  most_bytes_ -= beside;
  Window window = planes_.unshared();
  PlaneSlots low;
  if (deep) low = PlaneSlots(capacity(), planes_.pixels());
  std::vector<uint8_t> room(room_for_planes(planes_.shape()));
  const auto spread = [&](const KeptPicture& picture, int slot, PlaneSlots* to) {
    const uint8_t* planes[3];
    read_planes(picture, room.data(), planes);
    to->pad(slot);
    for (int c = 0; c < kChannels; ++c) std::copy_n(planes[c], to->pixels(), to->plane(slot, c));
  };
  for (int i = 0; i < planes_.size(); ++i) {
    spread(planes_.picture(slot(i)), slot(i), &window);
    if (deep) spread(low_.picture(slot(i)), slot(i), &low);
  }
  planes_ = std::move(window);
  if (deep) low_ = std::move(low);
  return true;
}

bool FrameStore::steady(int index, const Pose& pose, Resampler* resampler, Pool* pool,
                        uint64_t beside) {
  if (shares_samples() && !unshare(beside)) return false;
  if (untouched_.capacity() == 0) {
    const uint64_t more = (low_bits_ > 0 ? 2 : 1) * PlaneSlots::bytes(capacity(), planes_.pixels());
    if (more > most_bytes_ || bytes() > most_bytes_ - more) return false;
    if (low_bits_ > 0) untouched_low_ = PlaneSlots(capacity(), planes_.pixels());
    untouched_ = PlaneSlots(capacity(), planes_.pixels());
  }
  const int slot = this->slot(index), before = index > 0 ? this->slot(index - 1) : slot;
  const bool was_moved = !this->pose(slot).is_rest();
  resampler->prepare(pool);
  const Affine place = affine(inverse(pose), middle_of(width_, height_));
  const size_t pixels = planes_.pixels();
  for (int c = 0; c < kChannels; ++c) {
    const auto begin_as_before = [&](PlaneSlots* frames, PlaneSlots* untouched) {
      uint8_t *const plane = frames->plane(slot, c), *const own = untouched->plane(slot, c);
      if (!was_moved) std::copy_n(plane, pixels, own);
      std::copy_n(before != slot ? frames->plane(before, c) : own, pixels, plane);
    };
    const bool deep = low_bits_ > 0;
    begin_as_before(&planes_, &untouched_);
    if (deep) begin_as_before(&low_, &untouched_low_);
    resampler->run_deep(untouched_.plane(slot, c), deep ? untouched_low_.plane(slot, c) : nullptr,
                        low_bits_, place, planes_.plane(slot, c),
                        deep ? low_.plane(slot, c) : nullptr, width_, height_, pool);
  }
  poses_[static_cast<size_t>(slot)] = pose;
  take_contents(slot, pool);
  return true;
}

// True: every alpha sample is `alpha`.
bool FrameStore::take_planes(int slot, const ImageView& frame, uint8_t alpha, Pool* pool) {
  const ChromaShape& shape = planes_.shape();
  uint8_t* const planes[3] = {planes_.plane(slot, 0), planes_.plane(slot, 1),
                              planes_.plane(slot, 2)};
  std::atomic<bool> constant{true};
  if (!shape.is_shared()) {
    for_rows(pool, height_, planes_.pixels(), [&](int first, int count) {
      if (!split_channels(frame, first, count, alpha, planes)) constant = false;
    });
    return constant;
  }
  for_rows(pool, shape.chroma_height(), planes_.pixels(), [&](int first, int count) {
    const int top = first * shape.rows, end = std::min(top + count * shape.rows, height_);
    copy_rows(frame, 0, top, end, width_, planes[0]);
    for (int c = 1; c < kChannels; ++c)
      copy_rows(frame, c, first, first + count, shape.chroma_width(), planes[c]);
    if (!is_constant_alpha(frame, top, end - top, alpha)) constant = false;
  });
  return constant;
}

// Where the planes do not keep shared samples once, each for all pixels that share it.
void FrameStore::take_deep_planes(int slot, const ImageView& frame) {
  const auto width = static_cast<size_t>(width_);
  const ChromaShape& shape = planes_.shape();
  for (int c = 0; c < kChannels; ++c) {
    uint8_t *high = planes_.plane(slot, c), *low = low_.plane(slot, c);
    if (c > 0 && frame.channel[c] == frame.channel[0]) {
      std::memcpy(high, planes_.plane(slot, 0), planes_.pixels());
      std::memcpy(low, low_.plane(slot, 0), planes_.pixels());
      continue;
    }
    const Spacing at = frame.spacing(c);
    const size_t samples =
        (width + static_cast<size_t>(at.columns) - 1) / static_cast<size_t>(at.columns);
    if (c > 0 && shape.is_shared()) {
      for (int y = 0; y < shape.chroma_height(); ++y, high += samples, low += samples)
        split_digits(frame.channel[c] + y * at.row_stride, at.pixel_stride, frame.bits, samples,
                     high, low);
      continue;
    }
    for (int y = 0; y < height_; ++y, high += width, low += width) {
      const uint8_t* const from = frame.channel[c] + y / at.rows * at.row_stride;
      if (y % at.rows != 0) {
        std::memcpy(high, high - width, width);
        std::memcpy(low, low - width, width);
      } else if (at.columns == 1) {
        split_digits(from, at.pixel_stride, frame.bits, width, high, low);
      } else {
        uint8_t* const room = spread_.data();
        split_digits(from, at.pixel_stride, frame.bits, samples, room, room + width);
        spread_samples(room, 1, at.columns, width, high);
        spread_samples(room + width, 1, at.columns, width, low);
      }
    }
  }
}

// False: no room for alpha that varies.
bool FrameStore::take_deep_alpha(int slot, const ImageView& frame) {
  const auto s = static_cast<size_t>(slot), width = static_cast<size_t>(width_);
  constant_alpha_[s] = 255;
  constant_alpha_low_[s] = static_cast<uint8_t>((1 << low_bits_) - 1);
  varies_[s] = false;
  if (!frame.alpha) return true;
  const Spacing at = frame.spacing(3);
  split_digits(frame.alpha, at.pixel_stride, frame.bits, 1, &constant_alpha_[s],
               &constant_alpha_low_[s]);
  uint8_t *const high = spread_.data(), *const low = high + width;
  for (int y = 0; y < height_ && !varies_[s]; ++y) {
    split_digits(frame.alpha + y * at.row_stride, at.pixel_stride, frame.bits, width, high, low);
    varies_[s] =
        !are_all(high, constant_alpha_[s], width) || !are_all(low, constant_alpha_low_[s], width);
  }
  if (!varies_[s]) return true;
  if (!make_alpha()) return false;
  uint8_t* to = alpha_of(slot);
  const size_t digits = static_cast<size_t>(capacity()) * planes_.pixels();
  for (int y = 0; y < height_; ++y, to += width)
    split_digits(frame.alpha + y * at.row_stride, at.pixel_stride, frame.bits, width, to,
                 to + digits);
  return true;
}

bool FrameStore::make_alpha() {
  if (alpha_) return true;
  if (bytes_with_alpha() > most_bytes_) return false;
  // Without touching it.
  alpha_ = std::make_unique_for_overwrite<uint8_t[]>(alpha_bytes());
  return true;
}

bool FrameStore::keep_alpha(int slot, const ImageView& frame) {
  if (!make_alpha()) return false;
  uint8_t* to = alpha_of(slot);
  const Spacing at = frame.spacing(3);
  for (int row = 0; row < height_; ++row, to += width_)
    spread_samples(frame.alpha + row * at.row_stride, at.pixel_stride, 1,
                   static_cast<size_t>(width_), to);
  return true;
}

const uint8_t* FrameStore::alpha(int slot) const {
  return varies_[static_cast<size_t>(slot)] ? alpha_of(slot) : nullptr;
}

const uint8_t* FrameStore::alpha_low(int slot) const {
  const uint8_t* const high = alpha(slot);
  return high ? high + static_cast<size_t>(capacity()) * planes_.pixels() : nullptr;
}

}  // namespace qdmd
