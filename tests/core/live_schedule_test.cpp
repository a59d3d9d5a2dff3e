// SPDX-License-Identifier: LGPL-2.1-or-later
// A solve whose work is spread over many frames: the same bits, later.
#include "core/engine/live_schedule.h"

#include <optional>

#include "tests/core/live_util.h"

namespace qdmd::test {
namespace {

// A LiveSchedule on its stage, with a plan that takes small frames for large.
struct Spread {
  EngineOptions options;
  size_t pixels;
  LivePlan plan;
  Clock clock;
  Pace pace{&clock};
  Workers workers;
  FrameStore frames;
  Background background;
  LiveSchedule live;

  Spread(const EngineOptions& options_, uint64_t frame_bytes, size_t pixels_, int threads)
      : options(options_),
        pixels(pixels_),
        plan(options.window_size, hop_of(options), frame_bytes),
        workers(threads),
        frames(options.window_size + plan.most_late_frames(), static_cast<int>(pixels), 1,
               {std::max(options.sample_step, 1), 0}),
        background(Learner::make(options, static_cast<int>(pixels), 1),
                   {&frames, options.window_size, Models::two_of_live, &workers.pool(), &clock}),
        live({&frames, &background, &workers, &pace, &clock}, plan) {}
  ~Spread() { live.flush(); }

  // True where a model was published.
  bool push(const std::vector<uint8_t>& frame) {
    PackedPicture picture(static_cast<int>(pixels), 1);
    picture.fill(frame);
    const uint64_t solves = background.solves();
    EXPECT_TRUE(live.push(picture.in()));
    EXPECT_EQ(live.queue().pending, 1);
    EXPECT_EQ(live.queue().ready, 1);
    return background.solves() > solves;
  }
  // A break: the next frame begins a new window.
  void drain() { live.drain(); }
  std::vector<uint8_t> picture() {
    std::vector<uint8_t> out(3 * pixels);
    uint8_t* const rows[3] = {out.data(), out.data() + pixels, out.data() + 2 * pixels};
    live.show(frames.size() - 1);
    background.model().evaluate(0, pixels, rows);
    return out;
  }
};

// Frame numbers (from 1) of publication, each with the solve's last frame.
std::vector<std::pair<int, int>> publications(LivePlan plan, int first_solve, int frames) {
  plan.restart(first_solve);
  std::vector<std::pair<int, int>> all;
  for (int frame = 1; frame <= frames; ++frame) {
    const LivePlan::Step step = plan.next();
    if (!step.solve) continue;
    // The first one is waited for. Others: published with the frame after their last slice.
    const bool at_once = plan.at_once() || (first_solve == 1 && frame == 1);
    all.emplace_back(at_once ? frame : frame + step.gram_slices + step.build_slices, frame);
  }
  return all;
}

constexpr uint64_t kMega = uint64_t{1} << 20;

void expect_late_models(const Clip& clip, const EngineOptions& options, uint64_t frame_bytes,
                        int threads) {
  Spread spread(options, frame_bytes, clip.pixels, threads);
  const auto expected = publications(spread.plan, 1, static_cast<int>(clip.size()));
  size_t next = 0, first = 0;
  std::optional<FreshModel> model;
  for (size_t t = 0; t < clip.size(); ++t) {
    const int frame = static_cast<int>(t) + 1;
    const bool published = spread.push(clip.frames[t]);
    ASSERT_EQ(published, next < expected.size() && expected[next].first == frame)
        << "frame " << frame;
    if (published) {
      const auto end = static_cast<size_t>(expected[next++].second);
      const size_t size = std::min(end, static_cast<size_t>(options.window_size));
      first = end - size;
      const Clip part = part_of(clip, first, size);
      model.emplace(
          part, sampled(part, static_cast<int>(clip.pixels), 1, std::max(options.sample_step, 1)),
          options);
      ASSERT_EQ(spread.background.report().window_frames, static_cast<int>(size));
      ASSERT_EQ(spread.background.report().foreground.threshold, model->foreground.threshold);
      ASSERT_EQ(spread.background.report().dmd.lambda, model->summary.lambda);
    }
    ASSERT_EQ(spread.picture(), model->background(static_cast<double>(t - first)))
        << "frame " << frame;
  }
  EXPECT_GT(next, 3u);
}

TEST(LiveSchedule, SlicedSolvesGiveTheModelsOfWholeOnes) {
  std::mt19937 rng(321);
  const Clip clip = moving_box_clip(300, 90, 40, rng);
  for (const auto& [window, hop] :
       {std::pair{2, 1}, {5, 1}, {5, 5}, {12, 0}, {16, 4}, {17, 17}, {20, 3}, {32, 25}})
    for (uint64_t bytes : {kMega, 9 * kMega, 25 * kMega, 100 * kMega, uint64_t{1} << 40}) {
      SCOPED_TRACE("window " + std::to_string(window) + ", hop " + std::to_string(hop) + ", " +
                   std::to_string(bytes / kMega) + " MiB a frame");
      expect_late_models(clip, live_of(window, hop), bytes, 1);
      ASSERT_FALSE(HasFailure());
    }
}

TEST(LiveSchedule, ThreadsAndTheSideThreadChangeNoByte) {
  std::mt19937 rng(322);
  const Clip clip = moving_box_clip(1000, 60, 40, rng);
  // More than one thread: the side thread works, too.
  for (int threads : {1, 2, 3})
    for (const auto& [window, hop] : {std::pair{5, 1}, {17, 17}, {20, 6}}) {
      SCOPED_TRACE(std::to_string(threads) + " threads, window " + std::to_string(window));
      expect_late_models(clip, live_of(window, hop), 25 * kMega, threads);
      ASSERT_FALSE(HasFailure());
    }
}

TEST(LiveSchedule, SlicedSolvesOfSampledPixels) {
  std::mt19937 rng(323);
  const Clip clip = moving_box_clip(301, 60, 40, rng);
  for (int step : {2, 3, 7, 64}) {
    auto options = live_of(16, 5);
    options.sample_step = step;
    options.dmd.rank = 1;
    expect_late_models(clip, options, 25 * kMega, 2);
    ASSERT_FALSE(HasFailure()) << step;
  }
}

TEST(LiveSchedule, RestartWithAModelWaitsForAHop) {
  std::mt19937 rng(324);
  const Clip clip = moving_box_clip(100, 70, 20, rng);
  const auto options = live_of(12, 5);
  for (size_t before : {1, 6, 17, 18, 19, 20}) {
    Spread spread(options, 25 * kMega, clip.pixels, 2);
    for (size_t t = 0; t < before; ++t) spread.push(clip.frames[t]);
    // In the middle of whatever is under way.
    spread.drain();
    const auto expected = publications(spread.plan, hop_of(options), 30);
    size_t next = 0;
    for (int frame = 1; frame <= 30; ++frame) {
      const bool published = spread.push(clip.frames[static_cast<size_t>(frame + 30)]);
      ASSERT_EQ(published, next < expected.size() && expected[next].first == frame)
          << "frame " << frame << " after " << before;
      if (!published) continue;
      const auto end = static_cast<size_t>(expected[next++].second);
      const size_t size = std::min<size_t>(end, 12);
      FreshModel model(part_of(clip, 31 + end - size, size), options);
      ASSERT_EQ(spread.picture(),
                model.background(static_cast<double>(frame - 1) - static_cast<double>(end - size)));
    }
    EXPECT_GT(next, 1u);
  }
}

// ---- The Gram matrix of a window that slides ----

TEST(LiveGram, TenThousandSlidesInGroupsAndSlicesLeaveTheSameBits) {
  std::mt19937 rng(325);
  constexpr size_t kPixels = 333;
  struct Slide {
    int window, hop;
  };
  for (const Slide& slide : {Slide{5, 2}, {20, 0}, {18, 17}}) {
    LivePlan schedule(slide.window, slide.hop, 25 * kMega);
    Window window(slide.window + schedule.most_late_frames(), kPixels);
    Pool pool(2);
    SlidingGram gram(window.capacity(), &pool);
    std::optional<SnapshotRange> span;
    int group = 0, slices = 0, done = 0, compared = 0;
    const auto frames = static_cast<int>(10'000 + slide.window);
    for (int frame = 1; frame <= frames; ++frame) {
      append_frame(window, random_picture(kPixels, rng, 0, frame % 3 == 0 ? 255 : 254));
      const LivePlan::Step step = schedule.next();
      if (step.group > 0) {
        ASSERT_EQ(done, slices);
        group = step.group;
        slices = step.gram_slices;
        done = 0;
        span = SnapshotRange(window).newest(std::min({frame, slide.window, window.size()}));
      }
      if (done == slices) continue;
      const size_t size = window.plane_size() / 64;
      const auto start = [&](int index) {
        return index == slices
                   ? window.plane_size()
                   : size * static_cast<size_t>(index) / static_cast<size_t>(slices) * 64;
      };
      gram.add_slice(*span, group, start(done), start(done + 1) - start(done));
      if (++done < slices) continue;
      if (frame > 100 && frame < frames - 100 && frame % 97 != 0) continue;
      Window alone(span->size(), kPixels);
      for (int t = 0; t < span->size(); ++t) {
        const int slot = alone.append();
        for (int c = 0; c < kChannels; ++c)
          std::copy_n(span->plane(t, c), kPixels, alone.plane(slot, c));
      }
      ASSERT_EQ(gram.matrix(*span), gram_of(alone)) << "frame " << frame;
      ++compared;
    }
    EXPECT_GT(compared, 20);
  }
}

// ---- Large frames through the engine ----

// 13 frames of 1 M pixels are more than a slice: solves go on beside the frames.
struct Large {
  static constexpr int kWidth = 1024, kHeight = 1024;
  EngineOptions options = live_of(13, 4);
  Engine engine;
  PackedPicture picture{kWidth, kHeight, 3}, out{kWidth, kHeight, 3};

  explicit Large(int threads) {
    options.threads = threads;
    options.dmd.rank = 1;
    EXPECT_TRUE(engine.configure(options, kWidth, kHeight).ok());
    EXPECT_FALSE(LivePlan(13, 4, Window::bytes(1, kWidth * kHeight)).at_once());
  }
  void push(int t) {
    std::fill(picture.bytes.begin(), picture.bytes.end(), static_cast<uint8_t>(50 + t % 5));
    std::fill_n(picture.bytes.begin() + 20'000 * t, 60'000, uint8_t{200});
    EXPECT_TRUE(engine.push(picture.in()).ok());
    EXPECT_TRUE(engine.next());
  }
  const std::vector<uint8_t>& frame(int t, Output output) {
    push(t);
    engine.next()->pop(output, out.out());
    return out.bytes;
  }
};

TEST(EngineLargeLive, ThreadsChangeNoByte) {
  Large one(1), three(3);
  for (int t = 0; t < 30; ++t) {
    const Output output = t % 2 ? Output::background : Output::cutout;
    ASSERT_TRUE(one.frame(t, output) == three.frame(t, output)) << t;
    ASSERT_EQ(one.engine.report().solves, three.engine.report().solves) << t;
  }
  EXPECT_GT(one.engine.report().solves, 7u);
}

TEST(EngineLargeLive, AThresholdStaysThroughASolveThatIsUnderWay) {
  Large large(2);
  Wishes wishes = first_wishes(large.options);
  uint64_t solves = 0;
  for (int t = 0; t < 30; ++t) {
    large.push(t);
    EXPECT_EQ(large.engine.report().solve.foreground.threshold, t == 0 ? 18 : 100.0 + t - 1)
        << "frame " << t << ", " << large.engine.report().solves - solves << " new solves";
    solves = large.engine.report().solves;
    wishes.foreground_threshold = 100.0 + t;
    large.engine.next(&wishes)->pop(Output::mask, large.out.out());
    EXPECT_EQ(large.engine.report().solve.foreground.threshold, 100.0 + t);
  }
}

TEST(EngineLargeLive, EndsInTheMiddleOfASolve) {
  for (int frames = 14; frames < 22; ++frames) {
    Large large(2);
    for (int t = 0; t < frames; ++t) large.frame(t, Output::background);
    switch (frames % 4) {
      case 0:
        large.engine.flush();
        break;
      case 1:
        large.engine.close();
        EXPECT_FALSE(large.engine.configured());
        break;
      case 2:
        EXPECT_TRUE(large.engine.configure(live_of(3), 5, 5).ok());
        break;
      default:
        break;  // The destructor.
    }
  }
}

}  // namespace
}  // namespace qdmd::test
