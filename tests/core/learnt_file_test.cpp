// SPDX-License-Identifier: LGPL-2.1-or-later
// What was learnt, as bytes and back, damaged and whole.
#include "core/model/learnt_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <limits>

#include "tests/core/learnt_version_2.h"

namespace qdmd::test {
namespace {

// Other numbers for each.
LearntPlace place(uint32_t n) {
  LearntPlace place;
  const auto level = [&](uint32_t k) {
    return static_cast<float>(n) + 0.25f * static_cast<float>(k);
  };
  for (uint32_t c = 0; c < 3; ++c) place.look[c] = level(c), place.before[c] = level(3 + c);
  uint32_t time = 1000 * n;
  for (uint32_t* at : {&place.since, &place.before_since, &place.before_until, &place.judged_since,
                       &place.left, &place.absorbed_since})
    *at = time += 7;
  place.passed[0] = 0x8123456789abcdef + n;
  place.passed[1] = 0xfedcba9876543210 - n;
  if (n % 2) place.left = LearntPlace::kNever;
  place.judgement = static_cast<uint8_t>(n % 3);
  place.is_absorbed_news = static_cast<uint8_t>(n % 2);
  return place;
}

// places: with those, too, where there is an earlier window.
Learnt small(bool limits, bool earlier, int low_bits = 0, bool places = true) {
  Learnt learnt;
  learnt.width = 5;
  learnt.height = 3;
  learnt.colours = Colours::yuv;
  learnt.noise = 1.25;
  uint8_t next = 3;
  const auto plane = [&] {
    std::vector<uint8_t> levels(15);
    for (uint8_t& level : levels) level = next = static_cast<uint8_t>(7 * next + 1);
    return levels;
  };
  for (auto& level : learnt.picture.level) level = plane();
  if (limits) learnt.limits = plane();
  if (earlier) {
    auto& e = learnt.earlier.emplace();
    for (auto& level : e.level) level = plane();
    e.spread = plane();
    e.rows = 2;
    e.cols = 3;
    e.weight = {0, 1.5f, 2, 3e6f, 4, 0.001f};
    e.limit = {6, 7, 8, 9, 10, 11};
    e.looked = {12, 13, 1e7f, 0, 14, 15};
    for (uint32_t n = 0; n < 6 && places; ++n) e.places.push_back(place(n));
  }
  learnt.picture.depth = 8 + low_bits;
  for (auto& below : learnt.picture.below) {
    if (low_bits == 0) continue;
    below = plane();
    for (uint8_t& digit : below) digit = static_cast<uint8_t>(digit >> (8 - low_bits));
  }
  return learnt;
}

// What is learnt on a grid as fine as a picture's.
Learnt large() {
  Learnt learnt = small(true, true);
  learnt.width = 64;
  learnt.height = 48;
  auto fill = [next = 0u](auto* numbers) mutable {
    numbers->resize(64 * 48);
    for (auto& number : *numbers)
      number = static_cast<uint8_t>((next = 1664525 * next + 1013904223) >> 24);
  };
  auto& earlier = learnt.earlier.value();
  for (auto* levels : {&learnt.picture.level, &earlier.level})
    for (auto& level : *levels) fill(&level);
  fill(&learnt.limits);
  fill(&earlier.spread);
  earlier.rows = 48;
  earlier.cols = 64;
  fill(&earlier.weight);
  fill(&earlier.limit);
  fill(&earlier.looked);
  earlier.places.clear();
  for (uint32_t n = 0; n < 64 * 48; ++n) earlier.places.push_back(place(n));
  return learnt;
}

void expect_equal(const LearntPlace& a, const LearntPlace& b) {
  for (int c = 0; c < 3; ++c) {
    EXPECT_EQ(a.look[c], b.look[c]);
    EXPECT_EQ(a.before[c], b.before[c]);
  }
  EXPECT_EQ(a.since, b.since);
  EXPECT_EQ(a.before_since, b.before_since);
  EXPECT_EQ(a.before_until, b.before_until);
  EXPECT_EQ(a.judged_since, b.judged_since);
  EXPECT_EQ(a.left, b.left);
  EXPECT_EQ(a.absorbed_since, b.absorbed_since);
  for (int word = 0; word < 2; ++word) EXPECT_EQ(a.passed[word], b.passed[word]);
  EXPECT_EQ(a.judgement, b.judgement);
  EXPECT_EQ(a.is_absorbed_news, b.is_absorbed_news);
}

void expect_equal(const Learnt& a, const Learnt& b) {
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.colours, b.colours);
  for (size_t c = 0; c < 3; ++c) EXPECT_EQ(a.picture.level[c], b.picture.level[c]);
  EXPECT_EQ(a.picture.depth, b.picture.depth);
  for (size_t c = 0; c < 3; ++c) EXPECT_EQ(a.picture.below[c], b.picture.below[c]);
  EXPECT_EQ(a.limits, b.limits);
  EXPECT_EQ(a.noise, b.noise);
  ASSERT_EQ(a.earlier.has_value(), b.earlier.has_value());
  if (!a.earlier) return;
  for (size_t c = 0; c < 3; ++c) EXPECT_EQ(a.earlier->level[c], b.earlier->level[c]);
  EXPECT_EQ(a.earlier->spread, b.earlier->spread);
  EXPECT_EQ(a.earlier->rows, b.earlier->rows);
  EXPECT_EQ(a.earlier->cols, b.earlier->cols);
  EXPECT_EQ(a.earlier->weight, b.earlier->weight);
  EXPECT_EQ(a.earlier->limit, b.earlier->limit);
  EXPECT_EQ(a.earlier->looked, b.earlier->looked);
  ASSERT_EQ(a.earlier->places.size(), b.earlier->places.size());
  for (size_t i = 0; i < a.earlier->places.size(); ++i)
    expect_equal(a.earlier->places[i], b.earlier->places[i]);
}

Status unpack_it(const std::vector<uint8_t>& bytes) {
  const Learnt before = small(true, true);
  Learnt read = before;
  const Status status = unpack(bytes, &read);
  if (!status.ok()) expect_equal(before, read);
  return status;
}

// With a checksum that fits.
void sign(std::vector<uint8_t>* bytes) {
  uint64_t hash = 0xcbf29ce484222325;
  for (size_t i = 0; i + 8 < bytes->size(); ++i) hash = (hash ^ (*bytes)[i]) * 0x100000001b3;
  for (size_t i = 0; i < 8; ++i)
    (*bytes)[bytes->size() - 8 + i] = static_cast<uint8_t>(hash >> (8 * i));
}

TEST(LearntFile, RoundTrip) {
  for (bool limits : {false, true})
    for (bool earlier : {false, true})
      for (int kind = 0; kind < 6; ++kind) {
        const Learnt learnt = small(limits, earlier, kind % 3 * 4, kind < 3);
        const auto bytes = pack(learnt);
        const auto header = std::span(bytes).first(kLearntHeaderBytes);
        EXPECT_TRUE(check_header(header, bytes.size()).ok());
        EXPECT_FALSE(check_header(header, bytes.size() + 1).ok());
        Learnt read;
        const Status status = unpack(bytes, &read);
        ASSERT_TRUE(status.ok()) << status.message;
        expect_equal(learnt, read);
        EXPECT_EQ(bytes, pack(read));
      }
}

// What earlier versions have saved is read: all of it, and nothing else is known.
TEST(LearntFile, TheVersionsBeforeAreRead) {
  for (const uint8_t version : std::initializer_list<uint8_t>{2, 1}) {
    std::vector<uint8_t> bytes(kLearntVersion2.begin(), kLearntVersion2.end());
    ASSERT_EQ(bytes[8], 2);
    bytes[8] = version;
    sign(&bytes);
    Learnt read;
    const Status status = unpack(bytes, &read);
    ASSERT_TRUE(status.ok()) << status.message;
    EXPECT_EQ(8, read.width);
    EXPECT_EQ(6, read.height);
    EXPECT_EQ(8, read.picture.depth);
    const auto part = [&](size_t first) {
      return std::vector<uint8_t>(bytes.begin() + 56 + static_cast<ptrdiff_t>(48 * first),
                                  bytes.begin() + 56 + static_cast<ptrdiff_t>(48 * first + 48));
    };
    for (size_t c = 0; c < 3; ++c) EXPECT_EQ(part(c), read.picture.level[c]);
    EXPECT_EQ(part(3), read.limits);
    ASSERT_TRUE(read.earlier);
    const LearntEarlier& earlier = *read.earlier;
    for (size_t c = 0; c < 3; ++c) EXPECT_EQ(part(4 + c), earlier.level[c]);
    EXPECT_EQ(part(7), earlier.spread);
    EXPECT_EQ(6, earlier.rows);
    EXPECT_EQ(8, earlier.cols);
    ASSERT_EQ(48u, earlier.weight.size());
    ASSERT_EQ(48u, earlier.limit.size());
    // As often as where most frames showed it.
    const float most = *std::max_element(earlier.weight.begin(), earlier.weight.end());
    EXPECT_GT(most, 5);
    EXPECT_EQ(std::vector<float>(48, most), earlier.looked);
    EXPECT_TRUE(earlier.places.empty());
    // It is written in the version of today.
    Learnt again;
    ASSERT_TRUE(unpack(pack(read), &again).ok());
    expect_equal(read, again);
  }
}

// They had less than what their header says in the version of today.
TEST(LearntFile, AnEarlierVersionHasNothingOfALaterOne) {
  for (const uint8_t version : std::initializer_list<uint8_t>{1, 2}) {
    auto bytes = pack(small(true, true));
    bytes[8] = version;
    sign(&bytes);
    EXPECT_FALSE(unpack_it(bytes).ok());
    std::vector<uint8_t> old(kLearntVersion2.begin(), kLearntVersion2.end());
    old[8] = version;
    old[24] = 7;
    sign(&old);
    EXPECT_FALSE(unpack_it(old).ok());
    old[24] = 3;
    old[36] = 2;
    sign(&old);
    EXPECT_FALSE(unpack_it(old).ok());
  }
}

TEST(LearntFile, DigitsThatAreTooLargeAreSeen) {
  Learnt learnt = small(false, false, 2);
  EXPECT_TRUE(unpack_it(pack(learnt)).ok());
  learnt.picture.below[1][7] = 4;
  EXPECT_FALSE(unpack_it(pack(learnt)).ok());
}

TEST(LearntFile, TheBytesAreTheseOnEveryMachine) {
  const auto bytes = pack(small(false, false));
  const std::vector<uint8_t> header = {
      0x89, 'Q', 'D', 'M', 'D', '\r', '\n', 0x1a, 3,    0,    0,   0, 5, 0, 0, 0, 3, 0, 0,
      0,    1,   0,   0,   0,   0,    0,    0,    0,    0,    0,   0, 0, 0, 0, 0, 0, 0, 0,
      0,    0,   0,   0,   0,   0,    0,    0,    0xf4, 0x3f, 109, 0, 0, 0, 0, 0, 0, 0};
  ASSERT_EQ(kLearntHeaderBytes, header.size());
  ASSERT_EQ(109u, bytes.size());
  EXPECT_EQ(header, std::vector<uint8_t>(bytes.begin(), bytes.begin() + 56));
}

TEST(LearntFile, EveryDamageIsSeen) {
  for (bool sections : {false, true}) {
    const auto whole = pack(small(sections, sections, sections ? 2 : 0));
    for (size_t at = 0; at < whole.size(); ++at)
      for (int bit = 0; bit < 8; ++bit) {
        auto bytes = whole;
        bytes[at] = static_cast<uint8_t>(bytes[at] ^ (1 << bit));
        const Status status = unpack_it(bytes);
        ASSERT_FALSE(status.ok()) << at;
        ASSERT_EQ(Status::Code::bad_file, status.code);
        ASSERT_NE(std::string::npos, status.message.find(':')) << status.message;
      }
    for (size_t size = 0; size < whole.size(); ++size)
      ASSERT_FALSE(unpack_it({whole.begin(), whole.begin() + static_cast<ptrdiff_t>(size)}).ok())
          << size;
    auto longer = whole;
    longer.push_back(0);
    EXPECT_FALSE(unpack_it(longer).ok());
  }
}

// A file of a picture of a usual size is damaged in a sample of its bytes, in all of them with
// QDMD_LONG.
TEST(LearntFile, DamageInALargeFileIsSeen) {
  const auto whole = pack(large());
  const size_t step = std::getenv("QDMD_LONG") ? 1 : 97;
  auto bytes = whole;
  for (size_t at = 0; at < whole.size(); at += step) {
    bytes[at] ^= 0x10;
    ASSERT_FALSE(unpack_it(bytes).ok()) << at;
    bytes[at] = whole[at];
    if (step > 1 || at % 97 == 0) {
      ASSERT_FALSE(unpack_it({whole.begin(), whole.begin() + static_cast<ptrdiff_t>(at)}).ok())
          << at;
    }
  }
  EXPECT_TRUE(unpack_it(bytes).ok());
}

// Somebody may write a file whose checksum is right.
TEST(LearntFile, NumbersThatMakeNoSenseAreRefusedBeforeMemoryIsTaken) {
  const auto whole = pack(small(true, true));
  constexpr size_t kWeights = 56 + 15 * 8, kPlaces = kWeights + 3 * 4 * 6;
  const auto with = [&](size_t at, auto number) {
    auto bytes = whole;
    for (size_t i = 0; i < sizeof number; ++i)
      bytes[at + i] = static_cast<uint8_t>(number >> (8 * i));
    sign(&bytes);
    return unpack_it(bytes);
  };
  ASSERT_TRUE(with(12, uint32_t{5}).ok());
  for (uint32_t number : {0u, 1u, 4u, 6u, 15u, 0x7fffffffu, 0x80000000u, 0xffffffffu}) {
    EXPECT_FALSE(with(12, number).ok()) << number;
    EXPECT_FALSE(with(16, number).ok()) << number;
    EXPECT_FALSE(with(32, number).ok()) << number;
    EXPECT_FALSE(with(48, uint64_t{number} << 16).ok()) << number;
    if (number != 0) {
      EXPECT_FALSE(with(36, number).ok()) << number;
    }
  }
  EXPECT_TRUE(with(20, uint32_t{2}).ok());
  EXPECT_FALSE(with(20, uint32_t{3}).ok());
  for (uint32_t sections : {0u, 1u, 2u, 3u, 4u, 5u, 6u, 15u}) EXPECT_FALSE(with(24, sections).ok());
  for (double noise :
       {-1.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
    EXPECT_FALSE(with(40, std::bit_cast<uint64_t>(noise)).ok()) << noise;
  for (float number :
       {-1.0f, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()})
    for (size_t at :
         {kWeights, kWeights + 4 * 6 + 4, kWeights + 8 * 6 + 20, kPlaces, kPlaces + 66 * 5 + 12})
      EXPECT_FALSE(with(at, std::bit_cast<uint32_t>(number)).ok()) << number << " at " << at;
  for (size_t place : {0, 5}) {
    EXPECT_TRUE(with(kPlaces + 66 * place + 64, uint8_t{2}).ok());
    EXPECT_FALSE(with(kPlaces + 66 * place + 64, uint8_t{3}).ok());
    EXPECT_FALSE(with(kPlaces + 66 * place + 65, uint8_t{2}).ok());
  }
  // A picture that no memory holds, in a file that says so rightly.
  auto bytes = whole;
  for (size_t at : {12u, 16u}) bytes[at] = bytes[at + 1] = 0xff, bytes[at + 2] = 3;
  sign(&bytes);
  EXPECT_FALSE(unpack_it(bytes).ok());
}

TEST(LearntFile, SaysWhatIsWrong) {
  const auto whole = pack(small(true, true));
  const auto message = [](const std::vector<uint8_t>& bytes) { return unpack_it(bytes).message; };
  EXPECT_NE(std::string::npos, message({}).find("empty"));
  EXPECT_NE(std::string::npos, message({'G', 'I', 'F', '8'}).find("no file that qdmdbackground"));
  auto newer = whole;
  newer[8] = 9;
  EXPECT_NE(std::string::npos, message(newer).find("version 9"));
  EXPECT_NE(std::string::npos, message(newer).find("save it again with this one"));
  auto shorter = whole;
  shorter.pop_back();
  EXPECT_NE(std::string::npos, message(shorter).find("bytes in place of")) << message(shorter);
  auto other = whole;
  other[70] ^= 1;
  EXPECT_NE(std::string::npos, message(other).find("checksum"));
}

}  // namespace
}  // namespace qdmd::test
