// SPDX-License-Identifier: LGPL-2.1-or-later
// Frames that are kept with chroma of its own size: what is read of them is what it was.
#include "core/engine/engine_options.h"
#include "core/frames/frame_store.h"
#include "core/learn/learner.h"
#include "core/passes/read_samples.h"
#include "tests/core/layouts.h"

namespace qdmd::test {
namespace {

std::mt19937 rng(2105);

// Checks layouts whose pixels share samples in one of the two ways that are kept.
template <typename Check>
void for_every_shared_layout(Check check) {
  for (const VideoLayout& layout : kVideoLayouts) {
    const ChannelAt& at = layout.at[1];
    if (at.columns != 2) continue;
    for (const auto& [width, height] : kVideoSizes) {
      SCOPED_TRACE(std::string(layout.name) + " " + std::to_string(width) + "x" +
                   std::to_string(height));
      check(layout, width, height, at);
      if (testing::Test::HasFatalFailure()) return;
    }
  }
}

TEST(SharedStore, HasAllThatBelongsToAFrame) {
  for_every_shared_layout([](const VideoLayout& layout, int width, int height,
                             const ChannelAt& at) {
    for (const auto& [step, along] : {std::pair{1, 0}, {2, 0}, {1, 4}}) {
      FrameStore shared(3, width, height, {step, along, at.columns, at.rows});
      FrameStore plain(3, width, height, {step, along});
      EXPECT_EQ(FrameStore::bytes(3, width, height, {step, along, at.columns, at.rows}),
                shared.bytes());
      for (int t = 0; t < 5; ++t) {
        VideoPicture frame(layout, width, height, 5);
        frame.fill_randomly(rng);
        ASSERT_TRUE(shared.append(frame.view<const uint8_t>()));
        ASSERT_TRUE(plain.append(frame.view<const uint8_t>()));
      }
      for (int t = 0; t < 3; ++t) {
        const int slot = shared.slot(t), other = plain.slot(t);
        std::vector<uint8_t> room(2 * plain.window().pixels());
        const uint8_t* planes[3];
        read_planes(shared.window().picture(slot), room.data(), planes);
        for (int c = 0; c < kChannels; ++c) {
          const size_t pixels = plain.window().pixels();
          ASSERT_TRUE(std::equal(planes[c], planes[c] + pixels, plain.window().plane(other, c)));
          ASSERT_TRUE(std::equal(shared.cells().plane(slot, c),
                                 shared.cells().plane(slot, c) + shared.cells().cells(),
                                 plain.cells().plane(other, c)));
          if (step > 1) {
            ASSERT_TRUE(std::equal(shared.samples().plane(slot, c),
                                   shared.samples().plane(slot, c) + shared.samples().pixels(),
                                   plain.samples().plane(other, c)));
          }
        }
        ASSERT_EQ(bool(shared.alpha(slot)), bool(plain.alpha(other)));
        if (shared.alpha(slot)) {
          ASSERT_TRUE(std::equal(shared.alpha(slot).high,
                                 shared.alpha(slot).high + plain.window().pixels(),
                                 plain.alpha(other).high));
        }
      }
    }
  });
}

TEST(SharedStore, RunsOfPixelsAreReadFromAnywhere) {
  for_every_shared_layout([](const VideoLayout& layout, int width, int height,
                             const ChannelAt& at) {
    FrameStore shared(1, width, height, {1, 0, at.columns, at.rows}), plain(1, width, height, {});
    VideoPicture frame(layout, width, height, 0);
    frame.fill_randomly(rng);
    ASSERT_TRUE(shared.append(frame.view<const uint8_t>()));
    ASSERT_TRUE(plain.append(frame.view<const uint8_t>()));
    const auto pixels = static_cast<size_t>(width * height);
    for (size_t first : {size_t{0}, pixels / 3, pixels / 2, pixels - 1})
      for (size_t count : {size_t{1}, pixels / 4, pixels - first}) {
        if (count == 0 || first + count > pixels) continue;
        BeforeTheEdge<uint8_t> room(count);
        for (int c = 0; c < kChannels; ++c) {
          const uint8_t* run = read_samples(shared.window(), 0, c, first, count, room.data());
          ASSERT_TRUE(std::equal(run, run + count, plain.window().plane(0, c) + first))
              << "channel " << c << ", " << count << " from " << first;
        }
      }
  });
}

// A learner on frames of its own store.
struct Learning {
  FrameStore frames;
  Pool pool;
  Clock clock;
  std::unique_ptr<Learner> learner;
  BackgroundModel model;

  Learning(const EngineOptions& options, int width, int height, const FrameContents& contents,
           int threads)
      : frames(options.window_size, width, height, contents),
        pool(threads),
        learner(Learner::make(options, width, height)) {
    learner->begin({&frames, options.window_size, Models::one, &pool, &clock});
  }
  // Frames that came since the last call: in so many slices.
  void add(int count, int slices) {
    for (int i = 0; i < slices; ++i) learner->add(frames.window(), count, {i, slices});
  }
  void solve(int slices) {
    learner->decompose(frames.window());
    for (int i = 0; i < slices; ++i) learner->build({i, slices}, &model);
  }
  std::vector<uint8_t> levels(double t) {
    model.set_time(t);
    const size_t pixels = frames.window().pixels();
    std::vector<uint8_t> all(kChannels * pixels);
    for (size_t first = 0; first < pixels; first += kMaxRun) {
      uint8_t* const out[3] = {all.data() + first, all.data() + pixels + first,
                               all.data() + 2 * pixels + first};
      model.evaluate(first, std::min(kMaxRun, pixels - first), out);
    }
    return all;
  }
};

TEST(SharedStore, LearnersFindTheSameBackground) {
  const VideoLayout& layout = kVideoLayouts[0];
  for (const auto& [width, height] : {std::pair{1, 1}, {5, 3}, {67, 43}, {130, 64}})
    for (Method method : {Method::qdmd, Method::dmd})
      for (int step : {1, 3})
        for (int slices : {1, 7}) {
          SCOPED_TRACE(std::to_string(width) + "x" + std::to_string(height) + ", step " +
                       std::to_string(step) + ", " + std::to_string(slices) + " slices, method " +
                       std::to_string(static_cast<int>(method)));
          EngineOptions options;
          options.method = method;
          options.window_size = 20;
          options.sample_step = step;
          Learning shared(options, width, height, {step, 0, 2, 2}, 2),
              plain(options, width, height, {step, 0}, 1);
          VideoPicture frame(layout, width, height, 0);
          frame.fill_randomly(rng);
          for (int t = 0; t < 20; ++t) {
            // A picture with some noise.
            for (int y = 0; y < height; ++y)
              for (int x = 0; x < width; ++x)
                for (int c = 0; c < kChannels; ++c)
                  if (rng() % 8 == 0) frame.sample(c, x, y) = static_cast<uint8_t>(rng() >> 9);
            ASSERT_TRUE(shared.frames.append(frame.view<const uint8_t>()));
            ASSERT_TRUE(plain.frames.append(frame.view<const uint8_t>()));
            if (t % 5 == 4) shared.add(5, slices), plain.add(5, 1);
          }
          shared.solve(slices);
          plain.solve(1);
          EXPECT_EQ(shared.learner->facts().dmd.lambda, plain.learner->facts().dmd.lambda);
          EXPECT_EQ(shared.learner->facts().dmd.residual, plain.learner->facts().dmd.residual);
          for (double t : {0.0, 7.0, 19.0}) ASSERT_EQ(shared.levels(t), plain.levels(t)) << t;
        }
}

// What moves has its own samples from then on, and so have all other frames.
TEST(SharedStore, FramesThatMoveGetTheirOwnSamples) {
  constexpr int kWidth = 67, kHeight = 43;
  const VideoLayout& layout = kVideoLayouts[0];
  const FrameContents contents = {1, 4, 2, 2};
  const uint64_t bytes = FrameStore::bytes(3, kWidth, kHeight, contents);
  FrameStore shared(3, kWidth, kHeight, contents), plain(3, kWidth, kHeight, {1, 4}),
      narrow(3, kWidth, kHeight, contents, bytes);
  const auto append = [&] {
    VideoPicture frame(layout, kWidth, kHeight, 0);
    frame.fill_randomly(rng);
    for (FrameStore* store : {&shared, &plain, &narrow})
      ASSERT_TRUE(store->append(frame.view<const uint8_t>()));
  };
  // The ring begins anywhere.
  for (int t = 0; t < 4; ++t) append();
  Pool pool(1);
  Resampler resampler;
  Pose pose;
  pose.x = 2.5;
  for (int index : {0, 2}) {
    ASSERT_TRUE(shared.steady(index, pose, &resampler, &pool));
    ASSERT_TRUE(plain.steady(index, pose, &resampler, &pool));
  }
  append();
  EXPECT_FALSE(shared.shares_samples());
  for (int t = 0; t < 3; ++t) {
    const int slot = shared.slot(t);
    ASSERT_EQ(slot, plain.slot(t));
    EXPECT_EQ(shared.pose(slot).x, plain.pose(slot).x);
    for (int c = 0; c < kChannels; ++c) {
      const size_t pixels = plain.window().pixels(), cells = plain.cells().cells();
      const uint8_t* const plane = shared.window().plane(slot, c);
      EXPECT_TRUE(std::equal(plane, plane + pixels, plain.window().plane(slot, c)));
      const float* const means = shared.cells().plane(slot, c);
      EXPECT_TRUE(std::equal(means, means + cells, plain.cells().plane(slot, c)));
    }
  }
  // No room: nothing is done.
  EXPECT_FALSE(narrow.steady(0, pose, &resampler, &pool));
  EXPECT_TRUE(narrow.shares_samples());
  EXPECT_EQ(narrow.bytes(), bytes);
}

TEST(SharedStore, TakesHalfOfTheMemory) {
  const auto bytes = [](const FrameContents& contents) {
    return static_cast<double>(FrameStore::bytes(100, 1920, 1080, contents));
  };
  EXPECT_LT(bytes({1, 0, 2, 2}), 0.501 * bytes({}));
  EXPECT_LT(bytes({1, 0, 2, 1}), 0.668 * bytes({}));
}

}  // namespace
}  // namespace qdmd::test
