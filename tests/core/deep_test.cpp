// SPDX-License-Identifier: LGPL-2.1-or-later
// An engine for samples of more than 8 bits against a plain reference: whole samples, their inner
// products in integers, the decomposition, and sums in double.
#include <array>
#include <tuple>

#include "core/dmd/decompose.h"
#include "tests/core/engine_util.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 23, kHeight = 11, kFrames = 12;
constexpr size_t kPixels = size_t{kWidth} * kHeight;

// Whole samples of three channels and alpha, one plane after another.
using Frame = std::vector<int>;

// A ground with a texture, noise of about a level, and somebody who comes and goes.
std::vector<Frame> make_frames(int depth, std::mt19937& rng, double noise = 0.7,
                               bool mover = true) {
  std::vector<Frame> frames;
  std::normal_distribution<double> around(0, noise);
  const int unit = 1 << (depth - 8), most = 256 * unit - 1;
  for (int t = 0; t < kFrames; ++t) {
    Frame frame;
    for (int c = 0; c < 4; ++c)
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          double level = 40 + 30 * c + 2.37 * x + 1.13 * y + around(rng);
          const bool inside = mover && t > 3 && x >= t && x < t + 5 && y > 2 && y < 8;
          if (inside && c < 3) level = 230 - 60 * c + around(rng);
          frame.push_back(std::clamp(static_cast<int>(std::lround(level * unit)), 0, most));
        }
    frames.push_back(std::move(frame));
  }
  return frames;
}

// Words of a packed picture with alpha, or of one with a plane for each channel; at odd addresses.
struct DeepPicture {
  SampleBits bits;
  bool packed;
  std::vector<uint8_t> bytes;

  DeepPicture(SampleBits bits_, bool packed_)
      : bits(bits_), packed(packed_), bytes(size_t{1} + 4 * (2 * kPixels + kHeight * 5), 0xA5) {}
  template <typename Byte>
  BasicImageView<Byte> view() {
    BasicImageView<Byte> view;
    view.bits = bits;
    view.width = kWidth, view.height = kHeight;
    view.pixel_stride = packed ? 8 : 2;
    view.row_stride = kWidth * view.pixel_stride + 5;
    for (int c = 0; c < 4; ++c) {
      uint8_t* const first = bytes.data() + 1 + (packed ? 2 * c : c * kHeight * view.row_stride);
      (c < 3 ? view.channel[c] : view.alpha) = first;
    }
    return view;
  }
  uint8_t* at(int c, int x, int y) {
    auto in = view<uint8_t>();
    return (c < 3 ? in.channel[c] : in.alpha) + y * in.row_stride + x * in.pixel_stride;
  }
  void fill(const Frame& frame) {
    size_t i = 0;
    for (int c = 0; c < 4; ++c)
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const int word = frame[i++] << bits.shift;
          at(c, x, y)[0] = static_cast<uint8_t>(word & 255);
          at(c, x, y)[1] = static_cast<uint8_t>(word >> 8);
        }
  }
  Frame samples() {
    Frame frame;
    for (int c = 0; c < 4; ++c)
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const int word = at(c, x, y)[0] | at(c, x, y)[1] << 8;
          EXPECT_EQ(word & ((1 << bits.shift) - 1), 0);
          frame.push_back(word >> bits.shift);
        }
    return frame;
  }
};

// Outputs of each frame: background, foreground, mask, cut-out.
using Outputs = std::array<Frame, 4>;
constexpr Output kOutputs[] = {Output::background, Output::foreground, Output::mask,
                               Output::cutout};

std::vector<Outputs> run(const EngineOptions& options, SampleBits bits, bool packed,
                         const std::vector<Frame>& frames) {
  Engine engine;
  const Status status = engine.configure(options, kWidth, kHeight);
  EXPECT_TRUE(status.ok()) << status.message;
  DeepPicture picture(bits, packed);
  std::vector<Outputs> all;
  const auto take = [&] {
    while (engine.next()) {
      Outputs outputs;
      for (size_t i = 0; i < 4; ++i) {
        engine.next()->write(kOutputs[i], options.levels, picture.view<uint8_t>());
        outputs[i] = picture.samples();
      }
      engine.next()->skip();
      all.push_back(std::move(outputs));
    }
  };
  for (const Frame& frame : frames) {
    picture.fill(frame);
    EXPECT_TRUE(engine.push(picture.view<const uint8_t>()).ok());
    take();
  }
  EXPECT_TRUE(engine.drain().ok());
  take();
  return all;
}

// L of frames first .. first + count - 1 at time t, not rounded, in units of the depth. decompose:
// of what the products of `seen` say.
using Decompose = std::function<Decomposition(const SnapshotRange&, IntegerMatrix)>;
std::vector<double> plain_background(const std::vector<Frame>& frames, size_t first, size_t count,
                                     double t, int seen_shift, const Decompose& decompose) {
  const auto m = static_cast<Eigen::Index>(count);
  const auto sample = [&](Eigen::Index row, size_t p) {
    return frames[first + static_cast<size_t>(row / 3)][static_cast<size_t>(row % 3) * kPixels + p];
  };
  IntegerMatrix gram(3 * m, 3 * m);
  for (Eigen::Index r = 0; r < 3 * m; ++r)
    for (Eigen::Index s = 0; s < 3 * m; ++s) {
      gram(r, s) = 0;
      for (size_t p = 0; p < kPixels; ++p)
        gram(r, s) += int64_t{sample(r, p) >> seen_shift} * (sample(s, p) >> seen_shift);
    }
  Window window(static_cast<int>(count), kPixels);
  for (size_t i = 0; i < count; ++i) window.append();
  const TemporalModel model = decompose(window, gram).background;
  const Eigen::MatrixXd shares = model.weights(t) * model.basis();
  std::vector<double> level(3 * kPixels);
  for (size_t c = 0; c < 3; ++c)
    for (size_t p = 0; p < kPixels; ++p)
      for (Eigen::Index row = 0; row < 3 * m; ++row)
        level[c * kPixels + p] += shares(static_cast<Eigen::Index>(c), row) * sample(row, p);
  return level;
}

Decompose decomposition_of(const EngineOptions& options, int max_modes = 0) {
  return [options, max_modes](const SnapshotRange& snapshots, const IntegerMatrix& gram) {
    DmdOptions dmd = options.dmd;
    dmd.max_modes = max_modes;
    return options.method == Method::dmd ? decompose_channels(gram, dmd)
                                         : decompose(snapshots, gram, dmd);
  };
}

// All outputs of one frame within one unit of what they are by `level`; exactly where they do not
// depend on rounding.
void expect_outputs(const Outputs& seen, const Frame& frame, const std::vector<double>& level,
                    const Levels& levels, int depth) {
  const int most = (1 << depth) - 1;
  const auto is_white = [&](size_t p) { return seen[2][p] != levels.black[0] << (depth - 8); };
  for (size_t c = 0; c < 3; ++c) {
    const int black = levels.black[c] << (depth - 8);
    const int bright = levels.white[c] == 255 ? most : levels.white[c] << (depth - 8);
    for (size_t p = 0; p < kPixels; ++p) {
      const size_t i = c * kPixels + p;
      const double l = std::clamp(level[i], 0.0, static_cast<double>(most));
      ASSERT_NEAR(seen[0][i], l, 1) << "channel " << c << " pixel " << p;
      ASSERT_EQ(seen[1][i], std::min(black + std::abs(frame[i] - seen[0][i]), bright));
      ASSERT_EQ(seen[2][i], is_white(p) ? bright : black);
      ASSERT_EQ(seen[3][i], is_white(p) ? frame[i] : black);
    }
  }
  for (size_t p = 0; p < kPixels; ++p) {
    const size_t i = 3 * kPixels + p;
    for (size_t output = 0; output < 3; ++output) ASSERT_EQ(seen[output][i], frame[i]) << "alpha";
    ASSERT_EQ(seen[3][i], is_white(p) ? frame[i] : 0);
  }
}

EngineOptions options_of(int depth, Method method, int window) {
  EngineOptions options;
  options.method = method;
  options.depth = depth;
  options.window_size = window;
  options.foreground_threshold = 25;
  return options;
}

class Deep : public testing::TestWithParam<std::tuple<SampleBits, Method>> {
 protected:
  SampleBits bits() const { return std::get<0>(GetParam()); }
  Method method() const { return std::get<1>(GetParam()); }
};

TEST_P(Deep, BatchIsThePlainReference) {
  std::mt19937 rng(31);
  const auto frames = make_frames(bits().depth, rng);
  for (bool limited : {false, true})
    for (int rank : {0, 1, 3})
      for (double threshold : {0.0, 0.5})
        for (int step : {1, 2}) {
          SCOPED_TRACE(std::to_string(rank) + " " + std::to_string(threshold) + " " +
                       std::to_string(step));
          EngineOptions options = options_of(bits().depth, method(), kFrames);
          options.dmd.rank = rank;
          options.dmd.omega_threshold = threshold;
          // Every second pixel alone says how frames depend on each other: no reference here.
          options.sample_step = step;
          if (limited) options.levels = {{16, 16, 16}, {235, 235, 235}};
          const auto seen = run(options, bits(), limited, frames);
          ASSERT_EQ(seen.size(), size_t{kFrames});
          for (size_t t = 0; t < seen.size(); ++t) {
            std::vector<double> level;
            if (step == 1)
              level = plain_background(frames, 0, kFrames, static_cast<double>(t), 0,
                                       decomposition_of(options));
            else
              for (size_t i = 0; i < 3 * kPixels; ++i) level.push_back(seen[t][0][i]);
            expect_outputs(seen[t], frames[t], level, options.levels, bits().depth);
            if (testing::Test::HasFatalFailure()) return;
          }
        }
}

TEST_P(Deep, LiveIsThePlainReference) {
  std::mt19937 rng(32);
  const auto frames = make_frames(bits().depth, rng);
  EngineOptions options = options_of(bits().depth, method(), 6);
  options.mode = Mode::live;
  options.hop_size = 1;
  const auto seen = run(options, bits(), true, frames);
  ASSERT_EQ(seen.size(), size_t{kFrames});
  for (size_t t = 0; t < seen.size(); ++t) {
    const size_t count = std::min<size_t>(t + 1, 6);
    const auto level =
        plain_background(frames, t + 1 - count, count, static_cast<double>(count - 1), 0,
                         decomposition_of(options, BackgroundModel::most_modes(6)));
    expect_outputs(seen[t], frames[t], level, options.levels, bits().depth);
    if (testing::Test::HasFatalFailure()) return;
  }
}

TEST_P(Deep, SolversThatReadPixelsReadAllBits) {
  if (method() == Method::dmd) GTEST_SKIP() << "it has no solvers";
  std::mt19937 rng(33);
  const auto frames = make_frames(bits().depth, rng);
  EngineOptions options = options_of(bits().depth, method(), kFrames);
  for (Solver solver : {Solver::qr, Solver::adjoint, Solver::gram_extended}) {
    options.dmd.solver = solver;
    const auto seen = run(options, bits(), false, frames);
    EngineOptions by_products = options;
    by_products.dmd.solver = Solver::gram;
    const auto level = plain_background(frames, 0, kFrames, 3, 0, decomposition_of(by_products));
    expect_outputs(seen[3], frames[3], level, options.levels, bits().depth);
    if (testing::Test::HasFatalFailure()) return;
  }
}

// Nothing is left out of a window without foreground in steady light: its background is Q-DMD of
// rank one, whose weights are those of the highest 8 bits.
TEST_P(Deep, RobustIsThePlainReferenceWhereNothingMoves) {
  std::mt19937 rng(34);
  const auto frames = make_frames(bits().depth, rng, 0.3, false);
  EngineOptions options = options_of(bits().depth, Method::robust, kFrames);
  options.sample_step = 1;
  for (Mode mode : {Mode::batch, Mode::live}) {
    options.mode = mode;
    options.hop_size = kFrames;
    const auto seen = run(options, bits(), true, frames);
    ASSERT_EQ(seen.size(), size_t{kFrames});
    EngineOptions plain = options;
    plain.method = Method::qdmd;
    plain.dmd.rank = 1;
    for (size_t t = 0; t < seen.size(); ++t) {
      if (mode == Mode::live) {
        // The first model of a live window is that of one frame, the only one.
        std::vector<double> level(frames[0].begin(), frames[0].begin() + 3 * kPixels);
        if (t == 0) expect_outputs(seen[t], frames[t], level, options.levels, bits().depth);
        continue;
      }
      const auto level = plain_background(frames, 0, kFrames, static_cast<double>(t),
                                          bits().depth - 8, decomposition_of(plain));
      expect_outputs(seen[t], frames[t], level, options.levels, bits().depth);
      if (testing::Test::HasFatalFailure()) return;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, Deep,
                         testing::Combine(testing::Values(SampleBits{10, 0}, SampleBits{10, 6},
                                                          SampleBits{12, 0}, SampleBits{16, 0}),
                                          testing::Values(Method::qdmd, Method::dmd)),
                         [](const auto& suite) {
                           const SampleBits bits = std::get<0>(suite.param);
                           return std::to_string(bits.depth) + "_" + std::to_string(bits.shift) +
                                  (std::get<1>(suite.param) == Method::qdmd ? "_qdmd" : "_dmd");
                         });

// Who comes and goes is in no background, whose low bits are those of the ground.
TEST(DeepRobust, FindsTheGroundBehindWhatMoves) {
  for (int depth : {10, 12, 16})
    for (Mode mode : {Mode::batch, Mode::live}) {
      std::mt19937 rng(35);
      const auto frames = make_frames(depth, rng, 0.4);
      EngineOptions options = options_of(depth, Method::robust, kFrames);
      options.mode = mode;
      const auto seen = run(options, {depth, 0}, true, frames);
      ASSERT_EQ(seen.size(), size_t{kFrames});
      double error = 0;
      for (size_t c = 0; c < 3; ++c)
        for (size_t p = 0; p < kPixels; ++p) {
          const auto x = static_cast<double>(p % kWidth), y = static_cast<double>(p / kWidth);
          const double truth = 40 + 30 * static_cast<double>(c) + 2.37 * x + 1.13 * y;
          error += std::abs(seen.back()[0][c * kPixels + p] / std::exp2(depth - 8) - truth);
        }
      // 12 frames with noise of 0.4 have a mean within 0.4 / sqrt(12) of it, 0.09 on average.
      EXPECT_LT(error / (3 * kPixels), 0.2) << depth;
    }
}

// ---- Masks ----

// Frames whose highest 8 bits are the same, or nearly, and thresholds above and below a level; with
// pictures so small that no pixel around another one has a say.
TEST(DeepMasks, AreDecidedOnWholeSamples) {
  for (int depth : {10, 12, 16})
    for (Mode mode : {Mode::batch, Mode::live})
      for (double threshold : {0.3, 1.0, 1.7, 2.0, 2.9, 18.0, 18.3}) {
        std::mt19937 rng(39);
        auto frames = make_frames(depth, rng, 0.2, false);
        const int unit = 1 << (depth - 8);
        // Somebody about as far from the ground as the threshold.
        std::uniform_real_distribution<double> around(0, 1.5 * threshold);
        for (size_t t = 4; t < frames.size(); t += 3)
          for (size_t i = 0; i < 3 * kPixels; ++i)
            if (i % kPixels % 3 == 0)
              frames[t][i] =
                  std::min(frames[t][i] + static_cast<int>(around(rng) * unit), 256 * unit - 1);
        EngineOptions options = options_of(depth, Method::robust, kFrames);
        options.mode = mode;
        options.foreground_threshold = threshold;
        options.shadows = Shadows::foreground;
        Engine engine;
        ASSERT_TRUE(engine.configure(options, kWidth, kHeight).ok());
        DeepPicture in({depth, 0}, true), background({depth, 0}, true), mask({depth, 0}, true);
        size_t popped = 0, differ = 0;
        const auto take = [&] {
          for (; engine.next(); engine.next()->skip()) {
            engine.next()->write(Output::background, options.levels, background.view<uint8_t>());
            engine.next()->write(Output::mask, options.levels, mask.view<uint8_t>());
            const Frame x = frames[popped++], l = background.samples(), seen = mask.samples();
            for (size_t p = 0; p < kPixels; ++p) {
              double squared = 0;
              for (size_t c = 0; c < 3; ++c) {
                const double distance = x[c * kPixels + p] - l[c * kPixels + p];
                squared += distance * distance;
              }
              const bool expected = std::sqrt(squared) > threshold * unit;
              ASSERT_EQ(seen[p] > 0, expected) << depth << " bits, " << threshold;
              differ += expected;
            }
          }
        };
        for (const Frame& frame : frames) {
          in.fill(frame);
          ASSERT_TRUE(engine.push(in.view<const uint8_t>()).ok());
          take();
        }
        ASSERT_TRUE(engine.drain().ok());
        take();
        ASSERT_EQ(popped, size_t{kFrames});
        EXPECT_GT(differ, kPixels / 20) << threshold;
        EXPECT_LT(differ, kFrames * kPixels * 3 / 4) << threshold;
      }
}

// A thermal camera that uses few of its bits: a hand that is a third of a level warmer.
TEST(DeepMasks, FindWhatHighBitsDoNotShow) {
  constexpr int kSide = 150, kLength = 12;
  EngineOptions options = options_of(16, Method::robust, kLength);
  options.colours = Colours::grey;
  options.foreground_threshold = 0.2;
  Engine engine;
  ASSERT_TRUE(engine.configure(options, kSide, kSide).ok());
  std::vector<uint16_t> words(kSide * kSide);
  BasicImageView<const uint8_t> in;
  in.width = in.height = kSide;
  in.bits = {16, 0};
  in.pixel_stride = 2, in.row_stride = 2 * kSide;
  for (auto& channel : in.channel) channel = reinterpret_cast<const uint8_t*>(words.data());
  const auto inside = [](int t, int x, int y) {
    return t >= 6 && t < 9 && x >= 50 && x < 90 && y >= 40 && y < 80;
  };
  std::mt19937 rng(40);
  std::normal_distribution<double> noise(0, 4);
  for (int t = 0; t < kLength; ++t) {
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x)
        words[static_cast<size_t>(y * kSide + x)] =
            static_cast<uint16_t>(0x1040 + std::lround(noise(rng)) + (inside(t, x, y) ? 85 : 0));
    ASSERT_TRUE(engine.push(in).ok());
  }
  ASSERT_TRUE(engine.drain().ok());
  for (int t = 0; t < kLength; ++t) {
    ASSERT_TRUE(engine.next());
    const uint8_t* const mask = engine.next()->mask();
    int wrong = 0;
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) wrong += (mask[y * kSide + x] != 0) != inside(t, x, y);
    EXPECT_EQ(wrong, 0) << t;
    engine.next()->skip();
  }
}

// ---- A ramp ----

// 512 shades of half a level.
TEST(DeepRamp, IsKnownBetterThan8BitsCanTell) {
  constexpr int kLong = 512, kDepth = 10;
  for (Method method : {Method::qdmd, Method::dmd, Method::robust}) {
    double worst[2] = {}, mean[2] = {};
    for (int depth : {8, kDepth}) {
      std::mt19937 rng(36);
      // Below one level of 8 bits, and above one of 10.
      std::normal_distribution<double> noise(0, 0.15);
      EngineOptions options = options_of(depth, method, 20);
      Engine engine;
      ASSERT_TRUE(engine.configure(options, kLong, 2).ok());
      std::vector<uint8_t> bytes(size_t{kLong} * 2 * 2);
      BasicImageView<uint8_t> view;
      view.width = kLong, view.height = 2;
      view.bits = {depth, 0};
      view.pixel_stride = depth > 8 ? 2 : 1;
      view.row_stride = kLong * view.pixel_stride;
      for (auto& channel : view.channel) channel = bytes.data();
      const auto each = [&](const auto& see) {
        for (int y = 0; y < 2; ++y)
          for (int x = 0; x < kLong; ++x) {
            uint8_t* at = bytes.data() + y * view.row_stride + x * view.pixel_stride;
            see(at, 60 + x / 8.0);
          }
      };
      for (int t = 0; t < 20; ++t) {
        each([&](uint8_t* at, double level) {
          // As a camera of 10 bits sees it; 8 bits are its highest.
          const auto sample = static_cast<int>(std::lround(4 * (level + noise(rng))));
          if (depth == 8) {
            *at = static_cast<uint8_t>(sample >> 2);
          } else {
            at[0] = static_cast<uint8_t>(sample & 255);
            at[1] = static_cast<uint8_t>(sample >> 8);
          }
        });
        BasicImageView<const uint8_t> in;
        in.width = view.width, in.height = view.height, in.bits = view.bits;
        in.pixel_stride = view.pixel_stride, in.row_stride = view.row_stride;
        for (auto& channel : in.channel) channel = bytes.data();
        ASSERT_TRUE(engine.push(in).ok());
      }
      ASSERT_TRUE(engine.drain().ok());
      ASSERT_TRUE(engine.next());
      engine.next()->pop(Output::background, view);
      const size_t which = depth == 8 ? 0 : 1;
      each([&](const uint8_t* at, double level) {
        const double seen = depth == 8 ? *at : (at[0] | at[1] << 8) / 4.0;
        worst[which] = std::max(worst[which], std::abs(seen - level));
        mean[which] += std::abs(seen - level) / (2 * kLong);
      });
    }
    EXPECT_LT(worst[1], 0.5);
    EXPECT_GT(worst[0], 0.5);
    EXPECT_LT(mean[1], 0.1);
    EXPECT_GT(mean[0], 0.25);
  }
}

// ---- Degenerate input ----

TEST(DeepEngine, OnePixelAndDarkFramesAreOrdinary) {
  for (Method method : {Method::qdmd, Method::dmd, Method::robust})
    for (Mode mode : {Mode::batch, Mode::live})
      for (int sample : {0, 2, 1023}) {
        EngineOptions options = options_of(10, method, 4);
        options.mode = mode;
        Engine engine;
        ASSERT_TRUE(engine.configure(options, 1, 1).ok());
        uint8_t bytes[2] = {};
        ImageView in;
        in.width = in.height = 1;
        in.pixel_stride = in.row_stride = 2;
        in.bits = {10, 0};
        for (auto& channel : in.channel) channel = bytes;
        MutableImageView out;
        out.width = out.height = 1;
        out.pixel_stride = out.row_stride = 2;
        out.bits = {10, 0};
        for (auto& channel : out.channel) channel = bytes;
        int popped = 0;
        const auto take = [&] {
          for (; engine.next(); ++popped) {
            engine.next()->pop(Output::background, out);
            EXPECT_EQ(bytes[0] | bytes[1] << 8, sample) << static_cast<int>(method);
          }
        };
        for (int t = 0; t < 7; ++t) {
          bytes[0] = static_cast<uint8_t>(sample & 255),
          bytes[1] = static_cast<uint8_t>(sample >> 8);
          ASSERT_TRUE(engine.push(in).ok());
          take();
        }
        ASSERT_TRUE(engine.drain().ok());
        take();
        EXPECT_EQ(popped, 7);
      }
}

// What is saved has all bits. Where the video has more, the middle of what they may have been is
// the best guess; video of 8 bits has the highest ones, as its frames do, other video rounds.
TEST(DeepEngine, GoesOnWithASavedBackground) {
  std::mt19937 rng(37);
  const auto frames = make_frames(12, rng, 0.4);
  const EngineOptions options = options_of(12, Method::robust, kFrames);
  DeepPicture picture({12, 0}, true);
  Engine first, second;
  Learnt learnt;
  ASSERT_TRUE(first.configure(options, kWidth, kHeight).ok());
  for (const Frame& frame : frames) {
    picture.fill(frame);
    ASSERT_TRUE(first.push(picture.view<const uint8_t>()).ok());
  }
  ASSERT_TRUE(first.learnt(&learnt));
  ASSERT_TRUE(first.write_background(picture.view<uint8_t>()));
  const Frame known = picture.samples();
  ASSERT_TRUE(second.configure(options, kWidth, kHeight).ok());
  ASSERT_TRUE(second.learn_from(learnt).ok());
  ASSERT_TRUE(second.write_background(picture.view<uint8_t>()));
  const Frame loaded = picture.samples();
  for (size_t i = 0; i < 3 * kPixels; ++i) ASSERT_EQ(loaded[i], known[i]);
  for (int depth : {8, 10, 16}) {
    Engine other;
    DeepPicture deep({depth, 0}, true);
    ASSERT_TRUE(other.configure(options_of(depth, Method::robust, kFrames), kWidth, kHeight).ok());
    ASSERT_TRUE(other.learn_from(learnt).ok());
    std::vector<uint8_t> bytes(4 * kPixels);
    BasicImageView<uint8_t> out = deep.view<uint8_t>();
    if (depth == 8) {
      out.pixel_stride = 4, out.row_stride = 4 * kWidth;
      for (size_t c = 0; c < 3; ++c) out.channel[c] = bytes.data() + c;
      out.alpha = nullptr;
    }
    ASSERT_TRUE(other.write_background(out));
    const Frame shown = depth > 8 ? deep.samples() : Frame();
    for (size_t i = 0; i < 3 * kPixels; ++i) {
      if (depth == 8)
        ASSERT_EQ(bytes[4 * (i % kPixels) + i / kPixels], known[i] >> 4) << i;
      else if (depth == 10)
        ASSERT_NEAR(shown[i], known[i] / 4.0, 0.5) << i;
      else
        ASSERT_EQ(shown[i], 16 * known[i] + 8) << i;
    }
  }
}

TEST(DeepEngine, RefusesFramesOfAnotherDepth) {
  Engine engine;
  EngineOptions options = options_of(10, Method::qdmd, 4);
  ASSERT_TRUE(engine.configure(options, kWidth, kHeight).ok());
  EXPECT_FALSE(engine.push(DeepPicture({12, 0}, true).view<const uint8_t>()).ok());
  EXPECT_FALSE(engine.push(DeepPicture({8, 0}, true).view<const uint8_t>()).ok());
  EXPECT_TRUE(engine.push(DeepPicture({10, 6}, true).view<const uint8_t>()).ok());
  for (int depth : {7, 17, 0}) {
    options.depth = depth;
    EXPECT_FALSE(engine.configure(options, kWidth, kHeight).ok()) << depth;
  }
}

// ---- What is told of a solve ----

// Samples whose low bits are zero are those of 8 bits: what is told in levels is the same.
TEST(DeepSpectrum, IsInLevels) {
  for (int depth : {10, 12, 16}) {
    std::mt19937 rng(37);
    const auto narrow = make_frames(8, rng);
    SolveReport of_depth[2];
    for (bool deep : {false, true}) {
      EngineOptions options = options_of(deep ? depth : 8, Method::qdmd, kFrames);
      options.dmd.spectrum = true;
      Engine engine;
      ASSERT_TRUE(engine.configure(options, kWidth, kHeight).ok());
      for (Frame frame : narrow) {
        DeepPicture picture({deep ? depth : 8, 0}, true);
        if (deep)
          for (int& sample : frame) sample <<= depth - 8;
        picture.fill(frame);
        BasicImageView<const uint8_t> in = picture.view<const uint8_t>();
        ASSERT_TRUE(engine.push(in).ok());
      }
      ASSERT_TRUE(engine.drain().ok());
      of_depth[deep] = engine.report().solve;
    }
    const auto& a = of_depth[0].dmd.spectrum;
    const auto& b = of_depth[1].dmd.spectrum;
    ASSERT_TRUE(a && b);
    ASSERT_EQ(a->size(), size_t{kFrames - 1});
    ASSERT_EQ(a->size(), b->size());
    // Both have one Gram matrix but for a power of two.
    for (size_t k = 0; k < a->size(); ++k) {
      EXPECT_EQ((*a)[k].lambda, (*b)[k].lambda);
      EXPECT_EQ((*a)[k].background, (*b)[k].background);
      EXPECT_DOUBLE_EQ((*a)[k].amplitude, (*b)[k].amplitude);
    }
  }
}

}  // namespace
}  // namespace qdmd::test
