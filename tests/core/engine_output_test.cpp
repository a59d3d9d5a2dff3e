// SPDX-License-Identifier: LGPL-2.1-or-later
// What the engine writes: the four outputs, any memory layout, alpha.
#include "tests/core/engine_util.h"

namespace qdmd::test {
namespace {

// ---- The four outputs ----

// One solve of the same clip for each output.
struct Outputs {
  std::vector<std::vector<uint8_t>> background, foreground, mask, cutout;
  double threshold = 0;

  Outputs(const Clip& clip, const EngineOptions& options) {
    Strip b(clip.pixels, options), f(clip.pixels, options), m(clip.pixels, options),
        c(clip.pixels, options);
    background = b.run(clip, Output::background);
    foreground = f.run(clip, Output::foreground);
    mask = m.run(clip, Output::mask);
    cutout = c.run(clip, Output::cutout);
    threshold = m.engine.report().solve.foreground.threshold;
  }
};

TEST(EngineOutput, FollowsItsDefinition) {
  std::mt19937 rng(120);
  const Clip clip = moving_box_clip(300, 12, 40, rng);
  for (double fixed : {0.0, 25.0, 3.0}) {
    auto options = with_pixels_alone(window_of(12));
    options.dmd.rank = 1;
    options.foreground_threshold = fixed;
    const Outputs out(clip, options);
    if (fixed > 0) {
      EXPECT_EQ(out.threshold, fixed);
    }
    size_t white = 0;
    for (size_t t = 0; t < clip.size(); ++t)
      for (size_t p = 0; p < clip.pixels; ++p) {
        int squared = 0;
        for (size_t c = 0; c < 3; ++c) {
          const size_t i = c * clip.pixels + p;
          const int difference = clip.frames[t][i] - out.background[t][i];
          squared += difference * difference;
          ASSERT_EQ(out.foreground[t][i], std::abs(difference));
        }
        const bool is_foreground = squared > out.threshold * out.threshold;
        if (is_foreground) ++white;
        for (size_t c = 0; c < 3; ++c) {
          const size_t i = c * clip.pixels + p;
          ASSERT_EQ(out.mask[t][i], is_foreground ? 255 : 0);
          ASSERT_EQ(out.cutout[t][i], is_foreground ? clip.frames[t][i] : 0);
        }
      }
    EXPECT_GT(white, 0u);
    EXPECT_LT(white, clip.size() * clip.pixels);
  }
}

// Whatever is asked for first, and however often.
TEST(EngineOutput, PicturesOfOneFrameShareWhatIsComputed) {
  std::mt19937 rng(123);
  const Clip clip = moving_box_clip(300, 12, 40, rng);
  for (int rank : {1, 0})
    for (int softness : {0, 2}) {
      auto options = window_of(8);
      options.dmd.rank = rank;
      options.mask_softness = softness;
      const Outputs alone(clip, options);
      const std::vector<std::vector<uint8_t>>* const expected[] = {
          &alone.background, &alone.foreground, &alone.mask, &alone.cutout};
      constexpr Output kOutputs[] = {Output::background, Output::foreground, Output::mask,
                                     Output::cutout};
      Strip strip(clip.pixels, options);
      size_t frame = 0;
      const auto take = [&] {
        for (; strip.engine.next(); ++frame) {
          for (size_t k = 0; k < 6; ++k) {
            const size_t which = (k + frame) % 4;
            // Packed, in rows with gaps or without, and each channel by itself.
            PackedPicture packed(strip.width, 1, 3 + static_cast<int>(k % 2));
            strip.engine.next()->write(kOutputs[which], Levels(), packed.out());
            ASSERT_EQ((*expected[which])[frame], packed.planes()) << which << " of " << frame;
            std::vector<uint8_t> planes(3 * clip.pixels);
            MutableImageView view;
            view.width = strip.width;
            view.height = 1;
            view.pixel_stride = 1;
            view.row_stride = strip.width;
            for (size_t c = 0; c < 3; ++c) view.channel[c] = planes.data() + c * clip.pixels;
            strip.engine.next()->write(kOutputs[which], Levels(), view);
            ASSERT_EQ((*expected[which])[frame], planes) << which << " of " << frame;
          }
          strip.engine.next()->skip();
        }
      };
      for (const auto& picture : clip.frames) {
        ASSERT_TRUE(strip.push(picture).ok());
        take();
      }
      ASSERT_TRUE(strip.engine.drain().ok());
      take();
      EXPECT_EQ(clip.size(), frame);
    }
}

TEST(EngineOutput, ThresholdTakesEffectAtOnce) {
  std::mt19937 rng(121);
  const Clip clip = moving_box_clip(300, 6, 40, rng);
  auto options = window_of(6);
  options.dmd.rank = 1;
  Strip strip(clip.pixels, options);
  for (const auto& frame : clip.frames) strip.push(frame);
  strip.engine.drain();
  const auto white = [&] {
    const auto mask = strip.pop(Output::mask);
    return std::count(mask.begin(), mask.end(), uint8_t{255});
  };
  const double automatic = strip.engine.report().solve.foreground.threshold;
  const auto by_noise = white();
  strip.wishes.foreground_threshold = 500;
  ASSERT_TRUE(strip.engine.next(&strip.wishes));
  EXPECT_EQ(strip.engine.report().solve.foreground.threshold, 500);
  EXPECT_EQ(white(), 0) << "no distance is above 442";
  strip.wishes.foreground_threshold = 0.5;
  const auto all = white();
  EXPECT_GT(all, by_noise);
  strip.wishes.foreground_threshold = 0;
  ASSERT_TRUE(strip.engine.next(&strip.wishes));
  EXPECT_EQ(strip.engine.report().solve.foreground.threshold, automatic);
  EXPECT_LT(white(), all);
  strip.wishes.foreground_threshold = 500;
  strip.pop_all(Output::mask);
  for (const auto& frame : clip.frames) strip.push(frame);
  EXPECT_EQ(white(), 0) << "and stays for the next window";
  EXPECT_FALSE(strip.engine.next());
  strip.engine.drain();
  for (size_t t = 1; t < clip.size(); ++t) EXPECT_EQ(white(), 0) << t;
}

// ---- Layouts and alpha ----

TEST(EngineLayout, PaddingIsNeitherReadNorWritten) {
  const int width = 7, height = 5;
  std::mt19937 rng(122);
  const auto still = random_picture(35, rng);
  for (auto output : {Output::background, Output::foreground, Output::mask, Output::cutout}) {
    Engine engine;
    auto options = window_of(3);
    options.foreground_threshold = 0.5;
    ASSERT_TRUE(engine.configure(options, width, height).ok());
    // RGBx without an alpha view, RGB, and RGBA, every one with another row padding.
    PackedPicture rgbx(width, height, 4, false, 12), rgb(width, height, 3, false, 3),
        rgba(width, height, 4, true, 5);
    for (auto* picture : {&rgbx, &rgb, &rgba}) {
      picture->fill(still);
      ASSERT_TRUE(engine.push(picture->in()).ok());
    }
    ASSERT_TRUE(engine.drain().ok());
    for (auto [bytes_per_pixel, with_alpha, padding] :
         {std::tuple(4, false, 12), std::tuple(3, false, 3), std::tuple(4, true, 5)}) {
      PackedPicture out(width, height, bytes_per_pixel, with_alpha, padding);
      engine.next()->pop(output, out.out());
      EXPECT_EQ(out.planes(), output == Output::background ? still : std::vector<uint8_t>(105, 0));
      for (int row = 0; row < height; ++row)
        for (ptrdiff_t i = 0; i < out.row_stride; ++i) {
          const bool in_row = i < width * bytes_per_pixel;
          const bool alpha_byte = bytes_per_pixel == 4 && i % 4 == 3;
          if (!in_row || (alpha_byte && !with_alpha)) {
            ASSERT_EQ(out.bytes[static_cast<size_t>(row * out.row_stride + i)], kUntouched);
          }
        }
    }
  }
}

TEST(EngineLayout, PlanarAndBottomUp) {
  const int width = 4, height = 3;
  std::mt19937 rng(123);
  const auto still = random_picture(12, rng);
  Engine engine;
  ASSERT_TRUE(engine.configure(window_of(2), width, height).ok());
  ImageView planar;
  for (int c = 0; c < 3; ++c) planar.channel[c] = still.data() + 12 * c;
  planar.width = width, planar.height = height, planar.pixel_stride = 1, planar.row_stride = width;
  engine.push(planar);
  engine.push(planar);
  std::vector<uint8_t> bytes(36);
  MutableImageView flipped;
  for (int c = 0; c < 3; ++c) flipped.channel[c] = bytes.data() + 12 * c + 8;
  flipped.width = width, flipped.height = height, flipped.pixel_stride = 1;
  flipped.row_stride = -width;
  engine.next()->pop(Output::background, flipped);
  for (size_t c = 0; c < 3; ++c)
    for (size_t p = 0; p < 12; ++p)
      EXPECT_EQ(bytes[12 * c + (2 - p / 4) * 4 + p % 4], still[12 * c + p]);
}

// Frame t has alpha 10 t + 1 everywhere, or a ramp from there where `varies`.
uint8_t alpha_of(int t, size_t pixel, bool varies) {
  return static_cast<uint8_t>(10 * t + 1 + (varies ? static_cast<int>(pixel) : 0));
}

TEST(EngineAlpha, PassesThroughWithItsOwnFrame) {
  const int width = 6, height = 4, count = 5;
  std::mt19937 rng(124);
  for (auto output : {Output::background, Output::foreground, Output::mask}) {
    Engine engine;
    ASSERT_TRUE(engine.configure(window_of(3), width, height).ok());
    int popped = 0;
    const auto take = [&] {
      while (engine.next()) {
        PackedPicture out(width, height, 4, true, 2);
        engine.next()->pop(output, out.out());
        for (size_t p = 0; p < out.pixels(); ++p)
          ASSERT_EQ(out.at(3, p), alpha_of(popped, p, popped % 2 == 1)) << popped;
        ++popped;
      }
    };
    // Five frames over windows of three: slots change between constant and varying.
    for (int t = 0; t < count; ++t) {
      PackedPicture in(width, height, 4, true);
      in.fill(random_picture(24, rng));
      for (size_t p = 0; p < in.pixels(); ++p) in.at(3, p) = alpha_of(t, p, t % 2 == 1);
      ASSERT_TRUE(engine.push(in.in()).ok());
      take();
    }
    engine.drain();
    take();
    EXPECT_EQ(popped, count);
  }
}

TEST(EngineAlpha, PaddingIsOpaque) {
  std::mt19937 rng(125);
  for (auto output : {Output::background, Output::foreground, Output::mask, Output::cutout}) {
    Engine engine;
    ASSERT_TRUE(engine.configure(window_of(2), 3, 3).ok());
    PackedPicture padded(3, 3, 4, true), plain(3, 3, 3);
    padded.fill(random_picture(9, rng));
    plain.fill(random_picture(9, rng));
    auto in = padded.in();
    in.alpha_is_padding = true;
    engine.push(in);
    engine.push(plain.in());
    PackedPicture out(3, 3, 4, true);
    auto view = out.out();
    view.alpha_is_padding = true;
    ASSERT_TRUE(engine.next());
    engine.next()->pop(output, view);
    for (size_t p = 0; p < 9; ++p) EXPECT_EQ(out.at(3, p), 255);
    if (output == Output::cutout) continue;
    // A frame without alpha is opaque in an output that has it.
    ASSERT_TRUE(engine.drain().ok());
    out = PackedPicture(3, 3, 4, true);
    engine.next()->pop(output, out.out());
    for (size_t p = 0; p < 9; ++p) EXPECT_EQ(out.at(3, p), 255);
  }
}

TEST(EngineAlpha, OfAnEarlierFrameInTheSlotIsForgotten) {
  std::mt19937 rng(128);
  Engine engine;
  ASSERT_TRUE(engine.configure(window_of(2), 3, 3).ok());
  PackedPicture with_alpha(3, 3, 4, true), plain(3, 3, 3);
  with_alpha.fill(random_picture(9, rng));
  plain.fill(random_picture(9, rng));
  for (size_t p = 0; p < 9; ++p) with_alpha.at(3, p) = alpha_of(0, p, true);
  // A window of each: the frames leave in the order in which they came.
  int popped = 0;
  const auto take = [&] {
    while (engine.next()) {
      PackedPicture out(3, 3, 4, true);
      engine.next()->pop(Output::background, out.out());
      for (size_t p = 0; p < 9; ++p)
        EXPECT_EQ(out.at(3, p), popped >= 2 ? 255 : alpha_of(0, p, true)) << popped;
      ++popped;
    }
  };
  for (auto* picture : {&with_alpha, &plain})
    for (int t = 0; t < 2; ++t) {
      ASSERT_TRUE(engine.push(picture->in()).ok());
      take();
    }
  EXPECT_EQ(popped, 3);
  ASSERT_TRUE(engine.drain().ok());
  take();
  EXPECT_EQ(popped, 4);
}

TEST(EngineAlpha, InputPaddingIsNotTakenForAlpha) {
  Engine engine;
  ASSERT_TRUE(engine.configure(window_of(2), 3, 3).ok());
  PackedPicture padded(3, 3, 4, true);  // 0xA5 in all bytes
  auto in = padded.in();
  in.alpha_is_padding = true;
  engine.push(in);
  engine.push(in);
  PackedPicture out(3, 3, 4, true);
  engine.next()->pop(Output::background, out.out());
  for (size_t p = 0; p < 9; ++p) EXPECT_EQ(out.at(3, p), 255);
}

TEST(EngineAlpha, CutoutIsTransparentOutsideTheMask) {
  std::mt19937 rng(126);
  const size_t pixels = 200, count = 8;
  const Clip clip = moving_box_clip(pixels, count, 30, rng);
  auto options = window_of(static_cast<int>(count));
  options.dmd.rank = 1;
  options.foreground_threshold = 40;
  const Outputs reference(clip, options);
  for (bool varies : {false, true}) {
    Engine engine;
    ASSERT_TRUE(engine.configure(options, static_cast<int>(pixels), 1).ok());
    for (size_t t = 0; t < count; ++t) {
      PackedPicture in(static_cast<int>(pixels), 1, 4, true);
      in.fill(clip.frames[t]);
      for (size_t p = 0; p < pixels; ++p)
        in.at(3, p) = static_cast<uint8_t>(varies ? 20 + p : 77 + t);
      ASSERT_TRUE(engine.push(in.in()).ok());
    }
    ASSERT_TRUE(engine.drain().ok());
    for (size_t t = 0; t < count; ++t) {
      ASSERT_TRUE(engine.next());
      PackedPicture out(static_cast<int>(pixels), 1, 4, true);
      engine.next()->pop(Output::cutout, out.out());
      EXPECT_EQ(out.planes(), reference.cutout[t]);
      for (size_t p = 0; p < pixels; ++p) {
        const auto own = static_cast<uint8_t>(varies ? 20 + p : 77 + t);
        ASSERT_EQ(out.at(3, p), reference.mask[t][p] ? own : 0);
      }
    }
  }
}

// ---- The next frame's foreground, the newest background ----

TEST(EngineOutput, ForegroundIsThatOfTheNextFrame) {
  std::mt19937 rng(130);
  const Clip clip = moving_box_clip(700, 12, 40, rng);
  for (Method method : {Method::qdmd, Method::robust})
    for (double fixed : {0.0, 30.0}) {
      auto options = window_of(12);
      options.method = method;
      options.foreground_threshold = fixed;
      const Outputs out(clip, options);
      Strip strip(clip.pixels, options);
      for (const auto& frame : clip.frames) ASSERT_TRUE(strip.push(frame).ok());
      ASSERT_TRUE(strip.engine.drain().ok());
      for (size_t t = 0; t < clip.size(); ++t) {
        ASSERT_TRUE(strip.engine.next());
        std::vector<uint8_t> mask(clip.pixels), residual(clip.pixels);
        strip.engine.next()->foreground(mask.data(), residual.data());
        for (size_t p = 0; p < clip.pixels; ++p) {
          double squared = 0;
          for (size_t c = 0; c < 3; ++c)
            squared += std::pow(out.foreground[t][c * clip.pixels + p], 2);
          ASSERT_EQ(mask[p], out.mask[t][p]);
          ASSERT_EQ(residual[p], static_cast<int>(std::min(255.0, std::sqrt(squared))));
        }
        PackedPicture picture(static_cast<int>(clip.pixels), 1);
        strip.engine.next()->pop(Output::mask, picture.out());
      }
    }
}

TEST(EngineOutput, WriteBackgroundIsThatOfTheNewestFrame) {
  std::mt19937 rng(131);
  const Clip clip = moving_box_clip(300, 12, 40, rng);
  for (Mode mode : {Mode::batch, Mode::live}) {
    auto options = window_of(12);
    options.mode = mode;
    const int width = static_cast<int>(clip.pixels);
    Engine engine;
    PackedPicture newest(width, 1), last(width, 1);
    EXPECT_FALSE(engine.write_background(newest.out()));
    ASSERT_TRUE(engine.configure(options, width, 1).ok());
    EXPECT_FALSE(engine.write_background(newest.out()));
    for (const auto& frame : clip.frames) {
      PackedPicture picture(width, 1);
      picture.fill(frame);
      ASSERT_TRUE(engine.push(picture.in()).ok());
      // Batch: the window is full now, and its last frame is the newest.
      const bool there = engine.write_background(newest.out());
      EXPECT_EQ(there, engine.report().solves > 0);
      while (engine.next()) engine.next()->pop(Output::background, last.out());
    }
    if (mode == Mode::batch) {
      ASSERT_EQ(engine.report().pending, 11);
      // The frames that wait have this background; asked for before each, it stays.
      EXPECT_NE(newest.planes(), last.planes());
      ASSERT_TRUE(engine.drain().ok());
      while (engine.next()) {
        PackedPicture again(width, 1);
        EXPECT_TRUE(engine.write_background(again.out()));
        EXPECT_EQ(newest.planes(), again.planes());
        engine.next()->pop(Output::background, last.out());
      }
    }
    EXPECT_EQ(newest.planes(), last.planes());
    engine.flush();
    EXPECT_FALSE(engine.write_background(newest.out()));
  }
}

TEST(EngineOutput, ThreadsChangeNothingWhileFramesCome) {
  std::mt19937 rng(132);
  const Clip clip = moving_box_clip(3000, 60, 40, rng);
  for (Mode mode : {Mode::batch, Mode::live}) {
    auto options = window_of(12);
    options.mode = mode;
    Strip steady(clip.pixels, options), changing(clip.pixels, options);
    for (size_t t = 0; t < clip.size(); ++t) {
      changing.wishes.threads = static_cast<int>(t % 5);
      ASSERT_TRUE(steady.push(clip.frames[t]).ok());
      ASSERT_TRUE(changing.push(clip.frames[t]).ok());
      ASSERT_EQ(steady.pop_all(Output::background), changing.pop_all(Output::background)) << t;
    }
    ASSERT_TRUE(steady.engine.drain().ok());
    ASSERT_TRUE(changing.engine.drain().ok());
    ASSERT_EQ(steady.pop_all(Output::background), changing.pop_all(Output::background));
  }
}

}  // namespace
}  // namespace qdmd::test
