// SPDX-License-Identifier: LGPL-2.1-or-later
// A window's frames with all that belongs to them: planes, samples, cells, alpha.
#include "core/frames/frame_store.h"

#include <deque>

#include "core/passes/sampling.h"
#include "tests/core/engine_util.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 37, kHeight = 23;

PackedPicture random_frame(std::mt19937& rng, bool with_alpha, int constant_alpha = -1) {
  PackedPicture picture(kWidth, kHeight, with_alpha ? 4 : 3, with_alpha, 5);
  for (uint8_t& byte : picture.bytes) byte = static_cast<uint8_t>(rng() >> 7);
  if (constant_alpha >= 0)
    for (size_t p = 0; p < picture.pixels(); ++p)
      picture.at(3, p) = static_cast<uint8_t>(constant_alpha);
  return picture;
}

// Everything that the store says of a frame, by its definition.
void expect_frame(const FrameStore& store, int index, PackedPicture& picture, int step) {
  const int slot = store.slot(index);
  const auto at = [&](size_t c, int x, int y) {
    return picture.at(c, static_cast<size_t>(y) * kWidth + static_cast<size_t>(x));
  };
  for (int c = 0; c < kChannels; ++c) {
    const uint8_t* plane = store.window().plane(slot, c);
    const uint8_t* sample = store.samples().plane(slot, c);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        ASSERT_EQ(*plane++, at(static_cast<size_t>(c), x, y));
        if (x % step == 0 && y % step == 0) {
          ASSERT_EQ(*sample++, at(static_cast<size_t>(c), x, y));
        }
      }
    const Grid& grid = store.grid();
    for (int row = 0; row < grid.rows; ++row)
      for (int col = 0; col < grid.cols; ++col) {
        int sum = 0, count = 0;
        for (int y = grid.top(row); y < grid.top(row + 1); ++y)
          for (int x = grid.left(col); x < grid.left(col + 1); ++x, ++count)
            sum += at(static_cast<size_t>(c), x, y);
        // One division, one rounding to float.
        ASSERT_EQ(store.cells().plane(slot, c)[row * grid.cols + col],
                  static_cast<float>(static_cast<double>(sum) / count));
      }
  }
}

TEST(FrameStore, HasAllThatBelongsToTheNewestFrames) {
  std::mt19937 rng(401);
  for (int step : {1, 3, 64})
    for (int along : {0, 1, 7, 23}) {
      FrameStore store(4, kWidth, kHeight, {step, along});
      std::deque<PackedPicture> held;
      for (int t = 0; t < 11; ++t) {
        held.push_back(random_frame(rng, false));
        if (held.size() > 4) held.pop_front();
        ASSERT_TRUE(store.append(held.back().in()));
        ASSERT_EQ(store.frames_taken(), static_cast<uint64_t>(t) + 1);
        ASSERT_EQ(static_cast<size_t>(store.size()), held.size());
        for (int i = 0; i < store.size(); ++i)
          expect_frame(store, i, held[static_cast<size_t>(i)], step);
        if (t != 6) continue;
        store.clear();
        held.clear();
      }
    }
}

TEST(FrameStore, KeepsAlphaOnceItVaries) {
  std::mt19937 rng(402);
  FrameStore store(3, kWidth, kHeight, {});
  const uint64_t without = store.bytes();
  EXPECT_EQ(without, FrameStore::bytes(3, kWidth, kHeight, {}));
  EXPECT_EQ(store.bytes_with_alpha(), without + 3 * kWidth * kHeight);
  PackedPicture constant = random_frame(rng, true, 77);
  ASSERT_TRUE(store.append(constant.in()));
  EXPECT_FALSE(store.alpha(store.slot(0)));
  EXPECT_EQ(store.constant_alpha(store.slot(0)), 77);
  EXPECT_EQ(store.bytes(), without);
  PackedPicture varying = random_frame(rng, true);
  ASSERT_TRUE(store.append(varying.in()));
  EXPECT_EQ(store.bytes(), store.bytes_with_alpha());
  EXPECT_FALSE(store.alpha(store.slot(0)));
  for (size_t p = 0; p < varying.pixels(); ++p)
    ASSERT_EQ(store.alpha(store.slot(1)).high[p], varying.at(3, p));
  // A slot that varied and is constant again.
  for (int t = 0; t < 3; ++t) ASSERT_TRUE(store.append(constant.in()));
  EXPECT_FALSE(store.alpha(store.slot(1)));
  EXPECT_EQ(store.constant_alpha(store.slot(1)), 77);
}

TEST(FrameStore, RefusesAlphaForWhichThereIsNoRoom) {
  std::mt19937 rng(403);
  const uint64_t needed = FrameStore::bytes(3, kWidth, kHeight, {}) + 3 * kWidth * kHeight;
  PackedPicture constant = random_frame(rng, true, 255), varying = random_frame(rng, true);
  for (uint64_t most : {needed - 1, needed}) {
    FrameStore store(3, kWidth, kHeight, {}, most);
    EXPECT_TRUE(store.append(constant.in()));
    EXPECT_EQ(store.append(varying.in()), most == needed);
  }
}

// Words of 12 bits in a packed frame with alpha, the low ones in random bits.
struct DeepFrame {
  static constexpr SampleBits kBits = {12, 2};
  std::vector<uint8_t> bytes;

  DeepFrame(std::mt19937& rng, bool alpha_varies) : bytes(size_t{8} * kWidth * kHeight) {
    for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(rng() >> 7);
    for (size_t p = 0; !alpha_varies && p < bytes.size() / 8; ++p)
      bytes[8 * p + 6] = 0x54, bytes[8 * p + 7] = 0x12;
  }
  ImageView view() const {
    ImageView view;
    for (int c = 0; c < 3; ++c) view.channel[c] = bytes.data() + 2 * c;
    view.alpha = bytes.data() + 6;
    view.bits = kBits;
    view.width = kWidth, view.height = kHeight;
    view.pixel_stride = 8, view.row_stride = 8 * kWidth;
    return view;
  }
  int sample(int c, size_t p) const {
    const size_t at = 8 * p + 2 * static_cast<size_t>(c);
    return (bytes[at] | bytes[at + 1] << 8) >> kBits.shift & kBits.most();
  }
};

TEST(DeepFrameStore, HasBothDigitsOfEverything) {
  std::mt19937 rng(405);
  for (int step : {1, 3}) {
    const FrameContents contents = {step, 0, 1, 1, DeepFrame::kBits.depth};
    FrameStore store(3, kWidth, kHeight, contents);
    EXPECT_EQ(store.bytes(), FrameStore::bytes(3, kWidth, kHeight, contents));
    std::deque<DeepFrame> held;
    for (int t = 0; t < 8; ++t) {
      const bool varies = t % 3 == 1;
      held.emplace_back(rng, varies);
      if (held.size() > 3) held.pop_front();
      ASSERT_TRUE(store.append(held.back().view()));
      const SnapshotRange whole = store.window(), samples = whole.in(store.samples());
      for (int i = 0; i < store.size(); ++i) {
        const DeepFrame& frame = held[static_cast<size_t>(i)];
        size_t sample = 0;
        for (int y = 0; y < kHeight; ++y)
          for (int x = 0; x < kWidth; ++x) {
            const auto p = static_cast<size_t>(y * kWidth + x);
            for (int c = 0; c < kChannels; ++c) {
              ASSERT_EQ(whole.sample(i, c, p), frame.sample(c, p));
              if (x % step == 0 && y % step == 0) {
                ASSERT_EQ(samples.sample(i, c, sample), frame.sample(c, p));
              }
            }
            if (x % step == 0 && y % step == 0) ++sample;
          }
      }
      const int slot = store.window().newest_slot();
      ASSERT_EQ(bool(store.alpha(slot)), varies);
      for (size_t p = 0; varies && p < size_t{kWidth} * kHeight; ++p)
        ASSERT_EQ(sample_at(store.alpha(slot), p, 12), held.back().sample(3, p));
      if (!varies) {
        EXPECT_EQ(store.constant_alpha(slot), 0x1254 >> 2);
      }
    }
  }
}

// What came keeps all bits, and so has what is moved: by whole pixels it is the same samples, and
// outside of the frame those of the frame before. At rest again it is as it came.
TEST(DeepFrameStore, KeepsWhatCameOfFramesThatAreMoved) {
  std::mt19937 rng(406);
  const FrameContents contents = {1, 0, 1, 1, DeepFrame::kBits.depth};
  FrameStore store(2, kWidth, kHeight, contents);
  const DeepFrame frame(rng, false);
  const DeepFrame before(rng, false);
  ASSERT_TRUE(store.append(before.view()));
  ASSERT_TRUE(store.append(frame.view()));
  Pool pool(1);
  Resampler resampler;
  Pose pose;
  pose.x = 3;
  ASSERT_TRUE(store.steady(1, pose, &resampler, &pool));
  const int slot = store.slot(1);
  const SnapshotRange moved = store.window();
  for (int c = 0; c < kChannels; ++c)
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const auto p = static_cast<size_t>(y * kWidth + x);
        ASSERT_EQ(sample_at(store.untouched(slot, c), p, 12), frame.sample(c, p));
        ASSERT_EQ(moved.sample(1, c, p), x < 3 ? before.sample(c, p) : frame.sample(c, p - 3));
      }
  ASSERT_TRUE(store.steady(1, Pose(), &resampler, &pool));
  const SnapshotRange whole = store.window();
  for (int c = 0; c < kChannels; ++c)
    for (size_t p = 0; p < size_t{kWidth} * kHeight; ++p)
      ASSERT_EQ(whole.sample(1, c, p), frame.sample(c, p));
}

// The engine counts it, too, and says what to change.
TEST(EngineMemory, OfAlphaThatVaries) {
  std::mt19937 rng(404);
  EngineOptions options;
  options.window_size = 5;
  const uint64_t without = layout_of(options, kWidth, kHeight).bytes,
                 with = without + 5 * kWidth * kHeight;
  PackedPicture constant = random_frame(rng, true, 255), varying = random_frame(rng, true);
  for (uint64_t most : {without, with - 1, with}) {
    options.max_memory = most;
    Engine engine;
    ASSERT_TRUE(engine.configure(options, kWidth, kHeight).ok());
    EXPECT_EQ(engine.report().bytes, without);
    ASSERT_TRUE(engine.push(constant.in()).ok());
    const Status status = engine.push(varying.in());
    EXPECT_EQ(status.ok(), most == with) << status.message;
    if (status.ok()) {
      EXPECT_EQ(engine.report().bytes, with);
      continue;
    }
    EXPECT_EQ(status.code, Status::Code::too_much_memory);
    for (const std::string& word : {std::string("window-size"), std::string("max-memory"),
                                    std::to_string(with), std::to_string(most)})
      EXPECT_NE(status.message.find(word), std::string::npos) << word << " in " << status.message;
    // Nothing is left, and it goes on.
    EXPECT_EQ(engine.report().pending, 0);
    EXPECT_TRUE(engine.push(constant.in()).ok());
  }
}

}  // namespace
}  // namespace qdmd::test
