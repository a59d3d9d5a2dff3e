// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/model/learnt_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace qdmd {
namespace {

// Something that changes line ends, or takes the eighth bit, shows.
constexpr std::array<uint8_t, 8> kMagic = {0x89, 'Q', 'D', 'M', 'D', '\r', '\n', 0x1a};
constexpr size_t kChecksumBytes = 8;
constexpr uint32_t kHasLimits = 1, kHasEarlier = 2, kHasPlaces = 4;
constexpr size_t kPlaceBytes =
    2 * kChannels * sizeof(float) + 6 * sizeof(uint32_t) + 2 * sizeof(uint64_t) + 2;
// More than an engine takes.
constexpr uint64_t kMostPixels = uint64_t{1} << 36;

struct Header {
  uint32_t version = 0, width = 0, height = 0, colours = 0, sections = 0, rows = 0, cols = 0;
  uint32_t bits_below = 0;  // those of the picture below its highest eight
  double noise = 0;
  uint64_t bytes = 0;

  uint64_t pixels() const { return uint64_t{width} * height; }
  uint64_t cells() const { return uint64_t{rows} * cols; }
  // What it says that the file holds. Not before the numbers are known to be sane.
  uint64_t bytes_of_all() const {
    uint64_t planes = kChannels;
    if (sections & kHasLimits) planes += 1;
    if (sections & kHasEarlier) planes += kChannels + 1;
    if (bits_below > 0) planes += kChannels;
    const uint64_t of_cell =
        (has_looked() ? 3 : 2) * sizeof(float) + (sections & kHasPlaces ? kPlaceBytes : 0);
    return kLearntHeaderBytes + planes * pixels() + of_cell * cells() + kChecksumBytes;
  }
  bool has_looked() const { return version > 2; }
  uint32_t all_sections() const {
    return kHasLimits | kHasEarlier | (version > 2 && sections & kHasEarlier ? kHasPlaces : 0);
  }
};

class Writer {
 public:
  explicit Writer(size_t bytes) { bytes_.reserve(bytes); }

  template <typename Unsigned>
  void put(Unsigned value) {
    for (size_t i = 0; i < sizeof value; ++i)
      bytes_.push_back(static_cast<uint8_t>(value >> (8 * i)));
  }
  void put_plane(std::span<const uint8_t> plane) {
    bytes_.insert(bytes_.end(), plane.begin(), plane.end());
  }
  void put_numbers(std::span<const float> numbers) {
    for (float number : numbers) put(std::bit_cast<uint32_t>(number));
  }
  const std::vector<uint8_t>& bytes() const { return bytes_; }
  std::vector<uint8_t> take() { return std::move(bytes_); }

 private:
  std::vector<uint8_t> bytes_;
};

// Reads what is known to be there.
class Reader {
 public:
  explicit Reader(std::span<const uint8_t> bytes) : bytes_(bytes) {}

  template <typename Unsigned>
  Unsigned number() {
    Unsigned value = 0;
    for (size_t i = 0; i < sizeof value; ++i)
      value = static_cast<Unsigned>(value | static_cast<Unsigned>(bytes_[i]) << (8 * i));
    bytes_ = bytes_.subspan(sizeof value);
    return value;
  }
  std::vector<uint8_t> plane(size_t pixels) {
    std::vector<uint8_t> plane(bytes_.begin(),
                               bytes_.begin() + static_cast<std::ptrdiff_t>(pixels));
    bytes_ = bytes_.subspan(pixels);
    return plane;
  }
  void read_numbers(std::span<float> all) {
    for (float& one : all) one = std::bit_cast<float>(number<uint32_t>());
  }
  std::vector<float> numbers(size_t count) {
    std::vector<float> all(count);
    read_numbers(all);
    return all;
  }

 private:
  std::span<const uint8_t> bytes_;
};

uint64_t checksum(std::span<const uint8_t> bytes) {
  uint64_t hash = 0xcbf29ce484222325;
  for (uint8_t byte : bytes) hash = (hash ^ byte) * 0x100000001b3;
  return hash;
}

Status bad(std::string message) { return {Status::Code::bad_file, std::move(message)}; }

Status damaged(const std::string& what) {
  return bad("it is damaged (" + what + "): save it again, or take another copy.");
}

// Reads the header of a file of so many bytes in all.
Status read_header(std::span<const uint8_t> bytes, uint64_t all, Header* header) {
  if (bytes.empty()) return bad("it is empty: save it again, or take another copy.");
  const size_t seen = std::min(bytes.size(), kMagic.size());
  if (!std::equal(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(seen), kMagic.begin()))
    return bad("it is no file that qdmdbackground has saved: check the name.");
  if (bytes.size() < kLearntHeaderBytes) return damaged("it ends too early");
  Reader reader(bytes.subspan(kMagic.size()));
  Header h;
  for (uint32_t* number :
       {&h.version, &h.width, &h.height, &h.colours, &h.sections, &h.rows, &h.cols, &h.bits_below})
    *number = reader.number<uint32_t>();
  h.noise = std::bit_cast<double>(reader.number<uint64_t>());
  h.bytes = reader.number<uint64_t>();
  if (h.version < 1 || h.version > kLearntVersion)
    return bad("it has version " + std::to_string(h.version) +
               " of the format, and this qdmdbackground reads versions 1 to " +
               std::to_string(kLearntVersion) +
               ": save it again with this one, or load it with the one that saved it.");
  constexpr uint32_t kMost = std::numeric_limits<int32_t>::max();
  const uint32_t most_below = h.version == 1 ? 0 : 8;
  // Cells are no smaller than pixels.
  const bool grid = h.sections & kHasEarlier
                        ? h.rows > 0 && h.cols > 0 && h.rows <= h.height && h.cols <= h.width
                        : h.rows == 0 && h.cols == 0;
  const bool sane = h.width > 0 && h.height > 0 && h.width <= kMost && h.height <= kMost &&
                    h.pixels() <= kMostPixels &&
                    h.colours <= static_cast<uint32_t>(Colours::grey) &&
                    (h.sections & ~h.all_sections()) == 0 && grid && h.bits_below <= most_below &&
                    std::isfinite(h.noise) && h.noise >= 0;
  if (!sane || h.bytes != h.bytes_of_all()) return damaged("its first bytes make no sense");
  if (h.bytes != all)
    return damaged("it has " + std::to_string(all) + " bytes in place of " +
                   std::to_string(h.bytes));
  *header = h;
  return {};
}

bool are_weights(std::span<const float> numbers) {
  return std::all_of(numbers.begin(), numbers.end(),
                     [](float number) { return std::isfinite(number) && number >= 0; });
}

void put_place(const LearntPlace& place, Writer* writer) {
  writer->put_numbers(place.look);
  writer->put_numbers(place.before);
  for (uint32_t time : {place.since, place.before_since, place.before_until, place.judged_since,
                        place.left, place.absorbed_since})
    writer->put(time);
  for (uint64_t passed : place.passed) writer->put(passed);
  for (uint8_t number : {place.judgement, place.is_absorbed_news}) writer->put(number);
}

// False where it makes no sense.
bool read_place(Reader* reader, LearntPlace* place) {
  reader->read_numbers(place->look);
  reader->read_numbers(place->before);
  for (uint32_t* time : {&place->since, &place->before_since, &place->before_until,
                         &place->judged_since, &place->left, &place->absorbed_since})
    *time = reader->number<uint32_t>();
  for (uint64_t& passed : place->passed) passed = reader->number<uint64_t>();
  for (uint8_t* number : {&place->judgement, &place->is_absorbed_news})
    *number = reader->number<uint8_t>();
  return are_weights(place->look) && are_weights(place->before) &&
         place->judgement <= LearntPlace::kLeft && place->is_absorbed_news <= 1;
}

Status read_earlier(const Header& header, Reader* reader, LearntEarlier* earlier) {
  const auto pixels = static_cast<size_t>(header.pixels());
  const auto cells = static_cast<size_t>(header.cells());
  for (auto& level : earlier->level) level = reader->plane(pixels);
  earlier->spread = reader->plane(pixels);
  earlier->rows = static_cast<int>(header.rows);
  earlier->cols = static_cast<int>(header.cols);
  earlier->weight = reader->numbers(cells);
  earlier->limit = reader->numbers(cells);
  if (header.has_looked())
    earlier->looked = reader->numbers(cells);
  else
    earlier->looked.assign(cells,
                           *std::max_element(earlier->weight.begin(), earlier->weight.end()));
  bool sane =
      are_weights(earlier->weight) && are_weights(earlier->limit) && are_weights(earlier->looked);
  earlier->places.resize(header.sections & kHasPlaces ? cells : 0);
  for (LearntPlace& place : earlier->places) sane = read_place(reader, &place) && sane;
  return sane ? Status() : damaged("it has numbers that are none");
}

}  // namespace

std::vector<uint8_t> pack(const Learnt& learnt) {
  Header header;
  header.version = kLearntVersion;
  header.width = static_cast<uint32_t>(learnt.width);
  header.height = static_cast<uint32_t>(learnt.height);
  header.bits_below = static_cast<uint32_t>(bits_below(learnt.picture.depth));
  if (!learnt.limits.empty()) header.sections |= kHasLimits;
  if (learnt.earlier) {
    header.sections |= kHasEarlier;
    header.rows = static_cast<uint32_t>(learnt.earlier->rows);
    header.cols = static_cast<uint32_t>(learnt.earlier->cols);
    if (!learnt.earlier->places.empty()) header.sections |= kHasPlaces;
  }
  const uint64_t bytes = header.bytes_of_all();
  Writer writer(bytes);
  writer.put_plane(kMagic);
  for (uint32_t number :
       {header.version, header.width, header.height, static_cast<uint32_t>(learnt.colours),
        header.sections, header.rows, header.cols, header.bits_below})
    writer.put(number);
  writer.put(std::bit_cast<uint64_t>(learnt.noise));
  writer.put(bytes);
  for (const auto& level : learnt.picture.level) writer.put_plane(level);
  writer.put_plane(learnt.limits);
  if (learnt.earlier) {
    for (const auto& level : learnt.earlier->level) writer.put_plane(level);
    writer.put_plane(learnt.earlier->spread);
    writer.put_numbers(learnt.earlier->weight);
    writer.put_numbers(learnt.earlier->limit);
    writer.put_numbers(learnt.earlier->looked);
    for (const LearntPlace& place : learnt.earlier->places) put_place(place, &writer);
  }
  for (const auto& below : learnt.picture.below) writer.put_plane(below);
  writer.put(checksum(writer.bytes()));
  return writer.take();
}

Status check_header(std::span<const uint8_t> header, uint64_t bytes) {
  Header h;
  return read_header(header, bytes, &h);
}

Status unpack(std::span<const uint8_t> bytes, Learnt* learnt) {
  Header header;
  if (Status status = read_header(bytes, bytes.size(), &header); !status.ok()) return status;
  const auto checked = bytes.first(bytes.size() - kChecksumBytes);
  if (Reader(bytes.last(kChecksumBytes)).number<uint64_t>() != checksum(checked))
    return damaged("its checksum is wrong");
  Reader reader(checked.subspan(kLearntHeaderBytes));
  const auto pixels = static_cast<size_t>(header.pixels());
  Learnt read;
  read.width = static_cast<int>(header.width);
  read.height = static_cast<int>(header.height);
  read.colours = static_cast<Colours>(header.colours);
  read.noise = header.noise;
  for (auto& level : read.picture.level) level = reader.plane(pixels);
  if (header.sections & kHasLimits) read.limits = reader.plane(pixels);
  if (header.sections & kHasEarlier)
    if (Status status = read_earlier(header, &reader, &read.earlier.emplace()); !status.ok())
      return status;
  read.picture.depth = 8 + static_cast<int>(header.bits_below);
  for (auto& below : read.picture.below) {
    below = reader.plane(header.bits_below > 0 ? pixels : 0);
    const auto fits = [&](uint8_t bits) { return bits >> header.bits_below == 0; };
    if (!std::all_of(below.begin(), below.end(), fits))
      return damaged("it has more bits in a sample than it says");
  }
  *learnt = std::move(read);
  return {};
}

}  // namespace qdmd
