// SPDX-License-Identifier: LGPL-2.1-or-later
// Freeze: the background stays the picture that it was, and nothing is solved.
#include "tests/core/live_util.h"

namespace qdmd::test {
namespace {

using Pictures = std::vector<std::vector<uint8_t>>;

std::vector<uint8_t> push_pop(Strip& strip, const std::vector<uint8_t>& frame,
                              Output output = Output::background) {
  EXPECT_TRUE(strip.push(frame).ok());
  return strip.pop(output);
}

// Pictures that differ at most where a sum is at a half: frozen pictures begin without it.
void expect_nearly_equal(const std::vector<uint8_t>& a, const std::vector<uint8_t>& b) {
  size_t differ = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    ASSERT_LE(std::abs(a[i] - b[i]), 1);
    differ += a[i] != b[i];
  }
  EXPECT_LE(differ, 1 + a.size() / 1000);
}

// ---- Live ----

TEST(FreezeLive, ThePictureStaysAndNothingIsSolved) {
  std::mt19937 rng(331);
  for (const auto& [rank, omega] : {std::pair{0, 0.0}, {1, 0.0}, {0, 1e9}}) {
    const Clip clip = moving_box_clip(200, 60, 30, rng);
    auto options = with_pixels_alone(live_of(24, 5));
    options.dmd.rank = rank;
    options.dmd.omega_threshold = omega;
    Strip strip(200, options);
    std::vector<uint8_t> last;
    for (size_t t = 0; t < 28; ++t) last = push_pop(strip, clip.frames[t]);
    const uint64_t solves = strip.engine.report().solves;
    strip.wishes.freeze = true;
    std::vector<uint8_t> frozen;
    for (size_t t = 28; t < 50; ++t) {
      const auto picture = push_pop(strip, clip.frames[t]);
      if (t == 28) frozen = picture;
      ASSERT_EQ(picture, frozen) << t;
    }
    expect_nearly_equal(frozen, last);
    EXPECT_EQ(strip.engine.report().solves, solves);
    // Other outputs use the same background and the threshold of its solve.
    const double threshold = strip.engine.report().solve.foreground.threshold;
    for (Output output : kOutputs)
      EXPECT_EQ(push_pop(strip, clip.frames[50], output),
                picture_of(clip.frames[50], frozen, output, threshold));
    EXPECT_EQ(strip.engine.report().solves, solves);
  }
}

TEST(FreezeLive, LearnsAgainFromTheNextFrameOn) {
  std::mt19937 rng(332);
  const Clip clip = moving_box_clip(100, 60, 20, rng);
  const auto options = live_of(10, 4);
  Strip strip(100, options);
  for (size_t t = 0; t < 20; ++t) push_pop(strip, clip.frames[t]);
  strip.wishes.freeze = true;
  std::vector<uint8_t> frozen;
  for (size_t t = 20; t < 27; ++t) frozen = push_pop(strip, clip.frames[t]);
  strip.wishes.freeze = false;
  const uint64_t solves = strip.engine.report().solves;
  for (size_t t = 27; t < 30; ++t) EXPECT_EQ(push_pop(strip, clip.frames[t]), frozen) << t;
  EXPECT_EQ(strip.engine.report().solves, solves);
  FreshModel model(part_of(clip, 27, 4), options);
  EXPECT_EQ(push_pop(strip, clip.frames[30]), model.background(3));
  EXPECT_EQ(strip.engine.report().solves, solves + 1);
  EXPECT_EQ(strip.engine.report().solve.window_frames, 4);
}

TEST(FreezeLive, BeforeThereIsAModelTheFirstFrameIsIt) {
  std::mt19937 rng(333);
  const Clip clip = random_clip(50, 20, rng);
  Strip strip(50, live_of(6));
  strip.wishes.freeze = true;
  for (const auto& frame : clip.frames) ASSERT_EQ(push_pop(strip, frame), clip.frames[0]);
  EXPECT_EQ(strip.engine.report().solves, 1u);
  // flush() forgets the model, not the wish.
  strip.engine.flush();
  for (size_t t = 5; t < 20; ++t) ASSERT_EQ(push_pop(strip, clip.frames[t]), clip.frames[5]);
}

TEST(FreezeLive, DrainAndFreezeTogether) {
  std::mt19937 rng(334);
  const Clip clip = moving_box_clip(80, 60, 20, rng);
  const auto options = live_of(8, 3);
  for (bool drain_first : {false, true}) {
    Strip strip(80, options);
    for (size_t t = 0; t < 15; ++t) push_pop(strip, clip.frames[t]);
    if (drain_first) strip.engine.drain();
    strip.wishes.freeze = true;
    const auto frozen = push_pop(strip, clip.frames[15]);
    strip.engine.drain();
    for (size_t t = 16; t < 20; ++t) EXPECT_EQ(push_pop(strip, clip.frames[t]), frozen);
    strip.engine.drain();
    strip.wishes.freeze = false;
    for (size_t t = 20; t < 22; ++t) EXPECT_EQ(push_pop(strip, clip.frames[t]), frozen);
    FreshModel model(part_of(clip, 20, 3), options);
    EXPECT_EQ(push_pop(strip, clip.frames[22]), model.background(2));
  }
}

TEST(FreezeLive, OnAndOffBetweenTwoFramesChangesNothing) {
  std::mt19937 rng(335);
  const Clip clip = moving_box_clip(80, 30, 20, rng);
  Strip strip(80, live_of(8, 3)), undisturbed(80, live_of(8, 3));
  for (const auto& frame : clip.frames) {
    strip.wishes.freeze = true;
    strip.wishes.freeze = false;
    EXPECT_EQ(push_pop(strip, frame), push_pop(undisturbed, frame));
  }
}

TEST(FreezeLive, EveryOtherFrameIsStillOnePictureEach) {
  std::mt19937 rng(336);
  const Clip clip = moving_box_clip(80, 50, 20, rng);
  Strip strip(80, live_of(8, 2));
  for (size_t t = 0; t < clip.size(); ++t) {
    strip.wishes.freeze = t % 2 == 0;
    EXPECT_TRUE(strip.push(clip.frames[t]).ok());
    EXPECT_EQ(strip.pop_all(Output::background).size(), 1u);
  }
}

// ---- Batch ----

void take(Strip* strip, Pictures* out) {
  for (auto& picture : strip->pop_all(Output::background)) out->push_back(std::move(picture));
}

TEST(FreezeBatch, FromTheNextWindowOn) {
  std::mt19937 rng(341);
  // An infinite threshold takes all modes: too many for pictures, L(t) combines frames.
  for (double omega : {0.0, kInfinity})
    for (size_t asked_at : {0, 3, 9}) {
      const Clip clip = moving_box_clip(150, 50, 20, rng);
      auto options = window_of(10);
      options.dmd.omega_threshold = omega;
      Strip strip(150, options), undisturbed(150, options);
      const auto learned = undisturbed.run(clip, Output::background);
      Pictures out;
      for (size_t t = 0; t < clip.size(); ++t) {
        if (t == 10 + asked_at) strip.wishes.freeze = true;
        if (t == 34) strip.wishes.freeze = false;
        ASSERT_TRUE(strip.push(clip.frames[t]).ok());
        take(&strip, &out);
        ASSERT_EQ(out.size(), t < 9 ? 0 : t - 8);
        // A window's first frame leaves with the window's last: from then on a solve counts.
        if (t == 39 || t == 48) {
          EXPECT_EQ(strip.engine.report().solves, asked_at == 0 ? 1u : 2u);
        }
      }
      EXPECT_EQ(strip.engine.report().solves, asked_at == 0 ? 2u : 3u);
      strip.engine.drain();
      take(&strip, &out);
      ASSERT_EQ(out.size(), clip.size());
      // Asked for in the middle of a window: that one is solved to its end.
      const size_t begin = asked_at == 0 ? 10 : 20;
      for (size_t t = 0; t < begin; ++t) EXPECT_EQ(out[t], learned[t]) << t;
      expect_nearly_equal(out[begin], out[begin - 1]);
      // Released in the middle of a window: that one is still frozen.
      for (size_t t = begin; t < 40; ++t) ASSERT_EQ(out[t], out[begin]) << t;
      for (size_t t = 40; t < 50; ++t) EXPECT_EQ(out[t], learned[t]) << t;
      EXPECT_EQ(strip.engine.report().solves, asked_at == 0 ? 2u : 3u);
    }
}

TEST(FreezeBatch, BeforeThereIsAModelOneIsMade) {
  std::mt19937 rng(342);
  const Clip clip = moving_box_clip(100, 24, 20, rng);
  Strip strip(100, window_of(8)), undisturbed(100, window_of(8));
  strip.wishes.freeze = true;
  const auto out = strip.run(clip, Output::background);
  const auto learned = undisturbed.run(clip, Output::background);
  ASSERT_EQ(out.size(), 24u);
  for (size_t t = 0; t < 8; ++t) EXPECT_EQ(out[t], learned[t]);
  for (size_t t = 8; t < 24; ++t) EXPECT_EQ(out[t], out[8]);
  EXPECT_EQ(strip.engine.report().solves, 1u);
}

TEST(FreezeBatch, DrainGivesTheRemainderAgainstTheFrozenPicture) {
  std::mt19937 rng(343);
  const Clip clip = moving_box_clip(100, 24, 20, rng);
  for (size_t rest : {1, 5, 7}) {
    Strip strip(100, window_of(8)), undisturbed(100, window_of(8));
    const auto learned = undisturbed.run(part_of(clip, 0, 8), Output::background);
    Pictures out;
    for (size_t t = 0; t < 8 + rest; ++t) {
      strip.wishes.freeze = t >= 8;
      ASSERT_TRUE(strip.push(clip.frames[t]).ok());
      take(&strip, &out);
    }
    ASSERT_EQ(out.size(), 1 + rest);
    EXPECT_EQ(strip.engine.report().pending, 7);
    strip.engine.drain();
    take(&strip, &out);
    ASSERT_EQ(out.size(), 8 + rest);
    for (size_t t = 0; t < 8; ++t) EXPECT_EQ(out[t], learned[t]) << t;
    const auto frozen = out[8];
    expect_nearly_equal(frozen, out[7]);
    for (size_t t = 8; t < 8 + rest; ++t) EXPECT_EQ(out[t], frozen) << t;
    EXPECT_EQ(strip.engine.report().solves, 1u);
    // Time is broken; it is still frozen.
    out.clear();
    for (size_t t = 10; t < 18; ++t) {
      ASSERT_TRUE(strip.push(clip.frames[t]).ok());
      take(&strip, &out);
      EXPECT_EQ(out.size(), t < 17 ? 0u : 1u);
    }
    strip.engine.drain();
    take(&strip, &out);
    ASSERT_EQ(out.size(), 8u);
    for (const auto& picture : out) EXPECT_EQ(picture, frozen);
    EXPECT_EQ(strip.engine.report().solves, 1u);
    // And learns from its own frames alone.
    strip.wishes.freeze = false;
    Strip fresh(100, window_of(8));
    for (size_t t = 4; t < 9; ++t) strip.push(clip.frames[t]), fresh.push(clip.frames[t]);
    strip.engine.drain(), fresh.engine.drain();
    EXPECT_EQ(strip.pop_all(Output::background), fresh.pop_all(Output::background));
  }
}

TEST(FreezeBatch, LongWindowsWhoseGroupsRunBeside) {
  std::mt19937 rng(344);
  const Clip clip = moving_box_clip(100, 160, 20, rng);
  for (int threads : {1, 3}) {
    auto options = window_of(40);
    options.threads = threads;
    Strip strip(100, options), undisturbed(100, options);
    const auto learned = undisturbed.run(clip, Output::background);
    Pictures out;
    for (size_t t = 0; t < 160; ++t) {
      strip.wishes.freeze = t >= 50 && t < 90;
      strip.push(clip.frames[t]);
      take(&strip, &out);
      ASSERT_EQ(out.size(), t < 39 ? 0 : t - 38);
    }
    strip.engine.drain();
    take(&strip, &out);
    ASSERT_EQ(out.size(), 160u);
    for (size_t t = 0; t < 160; ++t) {
      if (t < 80 || t >= 120) {
        EXPECT_EQ(out[t], learned[t]) << t;
      } else {
        EXPECT_EQ(out[t], out[80]) << t;
      }
    }
  }
}

TEST(FreezeBatch, FlushForgetsTheFrozenPicture) {
  std::mt19937 rng(345);
  const Clip clip = moving_box_clip(60, 20, 20, rng);
  Strip strip(60, window_of(5)), fresh(60, window_of(5));
  for (size_t t = 0; t < 5; ++t) strip.push(random_picture(60, rng));
  strip.pop_all(Output::background);
  strip.wishes.freeze = true;
  strip.push(random_picture(60, rng));
  strip.engine.flush();
  strip.wishes.freeze = false;
  EXPECT_EQ(strip.run(clip, Output::background), fresh.run(clip, Output::background));
}

}  // namespace
}  // namespace qdmd::test
