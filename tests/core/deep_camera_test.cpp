// SPDX-License-Identifier: LGPL-2.1-or-later
// What a camera that moves, or that comes back, shows in more than 8 bits: its backgrounds have all
// of them.
#include <cmath>
#include <random>

#include "tests/core/engine_util.h"

namespace qdmd::test {
namespace {

constexpr int kWidth = 160, kHeight = 120;

// A ramp that 8 bits do not tell, and in which a pose that is a twentieth of a pixel off is a
// hundredth of a level; on it blobs that poses and scenes are known by, other ones for each seed.
struct Ground {
  struct Blob {
    double x, y, level;
  };
  static constexpr double kReach = 11;  // of a blob, as far as it counts
  unsigned seed;
  std::vector<Blob> blobs;

  explicit Ground(unsigned of) : seed(of) {
    std::mt19937 rng(seed);
    for (int i = 0; i < 36; ++i) {
      const double x = static_cast<double>(rng() % kWidth),
                   y = static_cast<double>(rng() % kHeight);
      blobs.push_back({x, y, rng() % 2 == 0 ? 80.0 : -50.0});
    }
  }
  // As bright for all seeds.
  double ramp(int c, double x, double y) const {
    const double way = x / 8 + y / 16;
    return 85 + 20 * c + (seed % 2 == 1 ? way : kWidth / 8.0 + kHeight / 16.0 - way);
  }
  // 1 in its middle, less than 1e-4 at kReach.
  double blobs_at(double x, double y) const {
    double level = 0;
    for (const Blob& blob : blobs) {
      const double way = (x - blob.x) * (x - blob.x) + (y - blob.y) * (y - blob.y);
      if (way < kReach * kReach) level += blob.level * std::exp(-way / 13);
    }
    return level;
  }
};

struct Look {
  const Ground* ground;
  double x = 0, y = 0;  // pixel (0, 0) shows this place of it
};

// Mean and largest distance of backgrounds from the truth, in levels, where there are no blobs, of
// frames from `first` on. depth: of the camera, 8 is the highest bits of 10.
struct Error {
  double mean = 0, most = 0;
};
Error error_of(const std::vector<Look>& looks, EngineOptions options, int depth, size_t first) {
  options.depth = depth;
  Engine engine;
  const Status status = engine.configure(options, kWidth, kHeight);
  EXPECT_TRUE(status.ok()) << status.message;
  const ptrdiff_t bytes = depth > 8 ? 2 : 1;
  std::vector<uint8_t> picture(3 * size_t{kWidth} * kHeight * static_cast<size_t>(bytes));
  const auto fit = [&]<typename Byte>(BasicImageView<Byte> view) {
    view.bits = {depth, 0};
    view.width = kWidth, view.height = kHeight;
    view.pixel_stride = bytes, view.row_stride = kWidth * bytes;
    for (int c = 0; c < 3; ++c) view.channel[c] = picture.data() + c * kHeight * view.row_stride;
    return view;
  };
  std::mt19937 rng(91);
  std::normal_distribution<double> noise(0, 0.15);
  Error error;
  size_t shown = 0;
  double count = 0;
  const auto take = [&] {
    for (; engine.next(); ++shown) {
      engine.next()->pop(Output::background, fit(MutableImageView()));
      if (shown < first) continue;
      const Look& look = looks[shown];
      // What the frame's border shows may be no part of another frame.
      for (int c = 0; c < 3; ++c)
        for (int y = 8; y < kHeight - 8; ++y)
          for (int x = 8; x < kWidth - 8; ++x) {
            if (look.ground->blobs_at(x + look.x, y + look.y) != 0) continue;
            ++count;
            const uint8_t* const at = picture.data() + bytes * ((c * kHeight + y) * kWidth + x);
            const double seen = depth > 8 ? (at[0] | at[1] << 8) / 4.0 : at[0];
            const double way = std::abs(seen - look.ground->ramp(c, x + look.x, y + look.y));
            error.mean += way;
            error.most = std::max(error.most, way);
          }
    }
  };
  for (const Look& look : looks) {
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const double blobs = look.ground->blobs_at(x + look.x, y + look.y);
        for (int c = 0; c < 3; ++c) {
          uint8_t* const at = picture.data() + bytes * ((c * kHeight + y) * kWidth + x);
          const double level = look.ground->ramp(c, x + look.x, y + look.y) + blobs;
          const auto sample = static_cast<int>(std::lround(4 * (level + noise(rng))));
          if (depth > 8) {
            at[0] = static_cast<uint8_t>(sample & 255);
            at[1] = static_cast<uint8_t>(sample >> 8);
          } else {
            at[0] = static_cast<uint8_t>(sample >> 2);
          }
        }
      }
    EXPECT_TRUE(engine.push(fit(ImageView())).ok());
    take();
  }
  EXPECT_TRUE(engine.drain().ok());
  take();
  EXPECT_EQ(shown, looks.size());
  error.mean /= count;
  return error;
}

EngineOptions options_of(Method method, Mode mode) {
  EngineOptions options;
  options.method = method;
  options.mode = mode;
  options.window_size = 30;
  return options;
}

// With no other error, 8 bits that are cut are half a level off on average, the middle of what they
// may have been a quarter, and 10 bits that are rounded a sixteenth.
void expect_all_bits(const Error& narrow, const Error& deep) {
  EXPECT_GT(narrow.mean, 0.2);
  EXPECT_LT(deep.mean, 0.125);
  EXPECT_LT(deep.most, 0.75);
}

TEST(DeepCamera, ThatShakesHasBackgroundsOfAllBits) {
  std::mt19937 rng(92);
  std::uniform_real_distribution<double> shake(-2, 2);
  const Ground ground(1);
  std::vector<Look> looks;
  for (int t = 0; t < 75; ++t) looks.push_back({&ground, shake(rng), shake(rng)});
  for (const Method method : {Method::robust, Method::qdmd})
    for (const Mode mode : {Mode::batch, Mode::live}) {
      SCOPED_TRACE(static_cast<int>(method));
      EngineOptions options = options_of(method, mode);
      options.stabilize = Stabilize::translation;
      // Live has to know some frames first.
      const size_t first = mode == Mode::live ? 30 : 0;
      expect_all_bits(error_of(looks, options, 8, first), error_of(looks, options, 10, first));
    }
}

TEST(DeepCamera, ThatComesBackHasABackgroundOfAllBits) {
  const Ground one(1), two(2);
  std::vector<Look> looks;
  for (int t = 0; t < 136; ++t) looks.push_back({t < 70 || t >= 130 ? &one : &two});
  EngineOptions options = options_of(Method::robust, Mode::live);
  // With the second frame it is known again; the first solve is not before the eighth.
  expect_all_bits(error_of(looks, options, 8, 131), error_of(looks, options, 10, 131));
}

}  // namespace
}  // namespace qdmd::test
