// SPDX-License-Identifier: LGPL-2.1-or-later
// Masks that are found in a smaller picture: how frames become small and pictures large, against
// plain references, and an engine that does both against one that is given small frames.
#include <algorithm>
#include <cmath>
#include <memory>
#include <tuple>

#include "core/foreground/enlarger.h"
#include "core/frames/frame_reducer.h"
#include "core/passes/enlarge.h"
#include "tests/core/engine_util.h"
#include "tests/core/layouts.h"
#include "tests/core/simd_targets.h"

namespace qdmd::test {
namespace {

// Samples in row order.
struct Plane {
  int width, height;
  std::vector<int> samples;

  int at(int x, int y) const {
    return samples[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
  }
  int near(int x, int y) const {
    return at(std::clamp(x, 0, width - 1), std::clamp(y, 0, height - 1));
  }
};

// Halves in both directions; what there is no other of counts twice.
Plane halved(const Plane& plane) {
  Plane half = {(plane.width + 1) / 2, (plane.height + 1) / 2, {}};
  for (int y = 0; y < half.height; ++y)
    for (int x = 0; x < half.width; ++x) {
      int sum = 0;
      for (int i = 0; i < 4; ++i) sum += plane.near(2 * x + i % 2, 2 * y + i / 2);
      half.samples.push_back((sum + 2) / 4);
    }
  return half;
}
Plane reduced(const Plane& plane, int scale) {
  return scale == 2 ? halved(plane) : halved(halved(plane));
}

int sample_of(const ImageView& view, int c, int x, int y) {
  const Spacing at = view.spacing(c);
  const uint8_t* const from = (c < 3 ? view.channel[c] : view.alpha) + y / at.rows * at.row_stride +
                              x / at.columns * at.pixel_stride;
  if (!view.bits.is_deep()) return *from;
  return (from[0] | from[1] << 8) >> view.bits.shift & view.bits.most();
}
// A channel's own samples.
Plane plane_of(const ImageView& view, int c) {
  const Spacing at = view.spacing(c);
  Plane plane = {(view.width - 1) / at.columns + 1, (view.height - 1) / at.rows + 1, {}};
  for (int y = 0; y < plane.height; ++y)
    for (int x = 0; x < plane.width; ++x)
      plane.samples.push_back(sample_of(view, c, x * at.columns, y * at.rows));
  return plane;
}

TEST(Reduced, FramesAreMeansInEveryLayout) {
  std::mt19937 rng(65);
  Pool pool(3);
  on_every_target([&] {
    for (const VideoLayout& layout : kVideoLayouts)
      for (const auto& [width, height] : {std::pair{1, 1}, {2, 3}, {67, 5}, {2051, 7}, {262, 130}})
        for (int scale : {2, 4})
          for (const SampleBits bits : {SampleBits{8, 0}, SampleBits{10, 6}, SampleBits{16, 0}}) {
            SCOPED_TRACE(std::string(layout.name) + " " + std::to_string(width) + "x" +
                         std::to_string(height) + " / " + std::to_string(scale) + ", " +
                         std::to_string(bits.depth) + " bits");
            VideoPicture picture(bits.is_deep() ? of_words(layout) : layout, width, height, 3,
                                 bits);
            picture.fill_randomly(rng);
            const ImageView frame = picture.view<const uint8_t>();
            const Reduction size = {width, height, scale};
            FrameReducer reducer(size, bits.depth);
            const ImageView small = reducer.reduce(frame, height > 100 ? &pool : nullptr);
            ASSERT_EQ(small.width, size.small_width());
            ASSERT_EQ(small.height, size.small_height());
            ASSERT_EQ(small.bits.depth, bits.depth);
            ASSERT_EQ(small.alpha != nullptr, frame.alpha != nullptr);
            for (int c = 0; c < (frame.alpha ? 4 : 3); ++c) {
              ASSERT_EQ(small.spacing(c).columns, frame.spacing(c).columns);
              ASSERT_EQ(small.spacing(c).rows, frame.spacing(c).rows);
              const Plane expected = reduced(plane_of(frame, c), scale);
              const Plane got = plane_of(small, c);
              ASSERT_EQ(got.width, expected.width);
              ASSERT_EQ(got.height, expected.height);
              ASSERT_EQ(got.samples, expected.samples) << "channel " << c;
            }
          }
  });
}

TEST(Reduced, PaddingIsNotReduced) {
  PackedPicture picture(6, 4, 4, true);
  ImageView frame = picture.in();
  frame.alpha_is_padding = true;
  FrameReducer reducer({6, 4, 2}, 8);
  EXPECT_EQ(reducer.reduce(frame, nullptr).alpha, nullptr);
}

// What lies between the middles of samples at pixel (x, y) of the larger picture, times
// (2 scale)^2.
int between(const Plane& plane, int scale, int x, int y) {
  const auto shares = [scale](int at, int* other) {
    const int off = 2 * (at % scale) + 1 - scale;
    *other = at / scale + (off < 0 ? -1 : 1);
    return std::abs(off);
  };
  int other_x = 0, other_y = 0;
  const int along = shares(x, &other_x), down = shares(y, &other_y), all = 2 * scale;
  const int own_x = x / scale, own_y = y / scale;
  return (all - along) * (all - down) * plane.at(own_x, own_y) +
         along * (all - down) * plane.near(other_x, own_y) +
         (all - along) * down * plane.near(own_x, other_y) +
         along * down * plane.near(other_x, other_y);
}
int bilinear(const Plane& plane, int scale, int x, int y) {
  return (between(plane, scale, x, y) + 2 * scale * scale) / (4 * scale * scale);
}

// Of nine pixels, so many of which are set.
int mean_at_edge(int sum, int white) {
  return white == 9 || white == 0 ? 0 : (2 * sum + white) / (2 * white);
}

// The mask where the edge is half-way up, from residuals of all pixels.
Plane with_edges(const Plane& mask, Plane residual, int scale, int width, int height) {
  for (size_t p = 0; p < mask.samples.size(); ++p)
    if (mask.samples[p] == 0) residual.samples[p] = 0;
  Plane out = {width, height, {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int col = x / scale, row = y / scale;
      int sum = 0, white = 0;
      for (int i = 0; i < 9; ++i) {
        sum += residual.near(col + i % 3 - 1, row + i / 3 - 1);
        white += mask.near(col + i % 3 - 1, row + i / 3 - 1) != 0;
      }
      const bool kept =
          16 * between(residual, scale, x, y) >= 9 * 4 * scale * scale * mean_at_edge(sum, white);
      out.samples.push_back(kept ? mask.at(col, row) : 0);
    }
  return out;
}

std::vector<uint8_t> bytes_of(const Plane& plane) {
  return {plane.samples.begin(), plane.samples.end()};
}

TEST(Reduced, RowsAreEnlarged) {
  std::mt19937 rng(66);
  on_every_target([&] {
    for (const int count : {1, 2, 3, 17, 64, 511, 512, 513, 1100})
      for (int scale : {2, 4})
        for (int cut : {0, 1}) {
          const int width = count * scale - cut;
          Plane plane = {count, 3, {}}, mask = plane;
          for (int i = 0; i < 3 * count; ++i) {
            plane.samples.push_back(static_cast<int>(rng() >> 8) % 256);
            mask.samples.push_back((rng() >> 8) % 5 > 1 ? 255 : 0);
          }
          const auto row = [&](const Plane& from, int y) {
            auto bytes = std::make_unique<BeforeTheEdge<uint8_t>>(static_cast<size_t>(count));
            for (int x = 0; x < count; ++x)
              (*bytes)[static_cast<size_t>(x)] = static_cast<uint8_t>(from.at(x, y));
            return bytes;
          };
          const auto above = row(plane, 0), own = row(plane, 1), below = row(plane, 2);
          const auto white = row(mask, 1);
          BeforeTheEdge<uint8_t> out(static_cast<size_t>(width));
          const auto size = static_cast<size_t>(count);
          repeat_row(own->data(), scale, out.size(), out.data());
          for (int x = 0; x < width; ++x)
            ASSERT_EQ(out[static_cast<size_t>(x)], plane.at(x / scale, 1)) << x;
          for (int phase = 0; phase < scale; ++phase) {
            const uint8_t* const beside = (phase < scale / 2 ? above : below)->data();
            enlarge_row(own->data(), beside, size, scale, phase, out.size(), out.data());
            for (int x = 0; x < width; ++x)
              ASSERT_EQ(out[static_cast<size_t>(x)], bilinear(plane, scale, x, scale + phase))
                  << x << " of " << width << ", phase " << phase;
            const auto means = row(plane, 2);
            // With the border's samples, which stand for those outside.
            const auto padded = [size](const uint8_t* from) {
              std::vector<uint8_t> all(from, from + size);
              all.insert(all.begin(), from[0]);
              all.push_back(from[size - 1]);
              return all;
            };
            const std::vector<uint8_t> its = padded(own->data()), others = padded(beside);
            edge_row(its.data() + 1, others.data() + 1, means->data(), white->data(), size, scale,
                     phase, out.size(), out.data());
            for (int x = 0; x < width; ++x) {
              const bool high = 16 * between(plane, scale, x, scale + phase) >=
                                9 * 4 * scale * scale * plane.at(x / scale, 2);
              ASSERT_EQ(out[static_cast<size_t>(x)], high ? mask.at(x / scale, 1) : 0)
                  << x << " of " << width << ", phase " << phase;
            }
          }
        }
  });
}

TEST(Reduced, MeansAreOfNine) {
  std::mt19937 rng(67);
  on_every_target([&] {
    for (const int count : {1, 2, 31, 64, 200}) {
      std::vector<std::vector<uint8_t>> residual(3), mask(3);
      for (int r = 0; r < 3; ++r)
        for (int x = 0; x < count + 2; ++x) {
          const bool white = (rng() >> 8) % 20 > 0;
          residual[static_cast<size_t>(r)].push_back(static_cast<uint8_t>(white ? rng() >> 8 : 0));
          mask[static_cast<size_t>(r)].push_back(white ? 255 : 0);
        }
      const uint8_t* const rows[] = {residual[0].data() + 1, residual[1].data() + 1,
                                     residual[2].data() + 1};
      const uint8_t* const masks[] = {mask[0].data() + 1, mask[1].data() + 1, mask[2].data() + 1};
      BeforeTheEdge<uint8_t> out(static_cast<size_t>(count));
      find_means(rows, masks, out.size(), out.data());
      for (int x = 0; x < count; ++x) {
        int sum = 0, white = 0;
        for (int i = 0; i < 9; ++i) {
          sum += rows[i / 3][x + i % 3 - 1];
          white += masks[i / 3][x + i % 3 - 1] != 0;
        }
        ASSERT_EQ(out[static_cast<size_t>(x)], mean_at_edge(sum, white)) << x << " of " << count;
      }
    }
  });
}

TEST(Reduced, ChosenByTheSize) {
  EXPECT_EQ(Reduction::automatic_scale(1, 1), 1);
  EXPECT_EQ(Reduction::automatic_scale(1920, 1080), 1);
  EXPECT_EQ(Reduction::automatic_scale(2500, 1000), 1);
  EXPECT_EQ(Reduction::automatic_scale(2501, 1000), 2);
  EXPECT_EQ(Reduction::automatic_scale(2560, 1440), 2);
  EXPECT_EQ(Reduction::automatic_scale(3840, 2160), 2);
  EXPECT_EQ(Reduction::automatic_scale(3841, 2161), 2);
  EXPECT_EQ(Reduction::automatic_scale(7680, 4320), 4);
  EXPECT_EQ(Reduction::automatic_scale(1 << 24, 1 << 24), 4);
}

// A street of bars, noise, and boxes that go through it, sharp to a pixel: the second one where
// masks are looked at in other blocks.
void paint(int t, PackedPicture* picture) {
  std::minstd_rand random(static_cast<unsigned>(t) + 1);
  for (int y = 0; y < picture->height; ++y)
    for (int x = 0; x < picture->width; ++x) {
      const auto p =
          static_cast<size_t>(y) * static_cast<size_t>(picture->width) + static_cast<size_t>(x);
      const int left = 3 * t + (x >= 200 ? 200 : 0);
      const bool inside = x >= left && x < left + 23 && y >= 21 && y < 52;
      for (size_t c = 0; c < 3; ++c) {
        const int ground = 60 + 40 * (x / 16 % 2) + 11 * static_cast<int>(c) + y / 4;
        const int noise = static_cast<int>(random() >> 8) % 5;
        picture->at(c, p) =
            static_cast<uint8_t>((inside ? 220 - 20 * static_cast<int>(c) : ground) + noise);
      }
      if (picture->with_alpha) picture->at(3, p) = static_cast<uint8_t>(x + y);
    }
}

struct Kind {
  Mode mode;
  Method method;
  int scale, width, height;
};

EngineOptions options_of(const Kind& kind, int scale) {
  EngineOptions options;
  options.mode = kind.mode;
  options.method = kind.method;
  options.window_size = 16;
  options.mask_scale = scale;
  // Pictures that are reduced have other edges.
  options.steps.edges = false;
  return options;
}

// All that leaves of a stream: what `look` does with each frame.
template <typename Look>
void stream(Engine* engine, int frames, PackedPicture* picture, FrameReducer* reducer,
            const Wishes* wishes, Look look) {
  const auto leave = [&] {
    while (LeavingFrame* const frame = engine->next(wishes)) {
      look(frame);
      frame->skip();
    }
  };
  for (int t = 0; t < frames; ++t) {
    paint(t, picture);
    const ImageView frame = picture->in();
    const Status status = engine->push(reducer ? reducer->reduce(frame, nullptr) : frame, wishes);
    ASSERT_TRUE(status.ok()) << status.message;
    leave();
  }
  ASSERT_TRUE(engine->drain().ok());
  leave();
}

class ReducedEngine : public testing::TestWithParam<Kind> {};

// What the engine makes of large frames is what one makes of small ones, enlarged.
TEST_P(ReducedEngine, IsThatOfSmallFrames) {
  const Kind& kind = GetParam();
  const Reduction size = {kind.width, kind.height, kind.scale};
  const int small_width = size.small_width(), small_height = size.small_height();
  constexpr int kFrames = 40;
  struct Left {
    Plane mask, residual;
    std::vector<uint8_t> pictures[4], frame;
  };
  std::vector<Left> expected;
  const auto plane = [](const std::vector<uint8_t>& bytes, int width, int height) {
    return Plane{width, height, {bytes.begin(), bytes.end()}};
  };
  const Output outputs[] = {Output::mask, Output::background, Output::foreground, Output::cutout};
  {
    Engine engine;
    ASSERT_TRUE(engine.configure(options_of(kind, 1), small_width, small_height).ok());
    FrameReducer reducer(size, 8);
    PackedPicture picture(kind.width, kind.height, 4, true),
        out(small_width, small_height, 4, true);
    std::vector<uint8_t> mask(size.small_pixels()), residual(size.small_pixels());
    stream(&engine, kFrames, &picture, &reducer, nullptr, [&](LeavingFrame* frame) {
      Left left;
      frame->foreground(mask.data(), residual.data());
      left.mask = plane(mask, small_width, small_height);
      left.residual = plane(residual, small_width, small_height);
      for (size_t i = 0; i < 4; ++i) {
        frame->write(outputs[i], Levels(), out.out());
        left.pictures[i] = out.bytes;
      }
      frame->write_frame(Levels(), out.out());
      left.frame = out.bytes;
      expected.push_back(std::move(left));
    });
  }
  Engine engine;
  ASSERT_TRUE(engine.configure(options_of(kind, kind.scale), kind.width, kind.height).ok());
  PackedPicture picture(kind.width, kind.height, 4, true), out(kind.width, kind.height, 4, true);
  std::vector<uint8_t> mask(size.pixels()), residual(size.pixels());
  size_t next = 0, white = 0;
  const auto repeated = [&](const std::vector<uint8_t>& small) {
    std::vector<uint8_t> large;
    for (int y = 0; y < kind.height; ++y)
      for (int x = 0; x < kind.width; ++x) {
        const size_t p = static_cast<size_t>(y / kind.scale * small_width + x / kind.scale);
        large.insert(large.end(), small.begin() + static_cast<ptrdiff_t>(4 * p),
                     small.begin() + static_cast<ptrdiff_t>(4 * p + 4));
      }
    return large;
  };
  stream(&engine, kFrames, &picture, nullptr, nullptr, [&](LeavingFrame* frame) {
    const Left& left = expected[next];
    const std::vector<uint8_t> edges =
        bytes_of(with_edges(left.mask, left.residual, kind.scale, kind.width, kind.height));
    frame->foreground(mask.data(), residual.data());
    ASSERT_EQ(mask, edges) << next;
    ASSERT_TRUE(std::equal(edges.begin(), edges.end(), frame->mask()));
    for (int y = 0; y < kind.height; ++y)
      for (int x = 0; x < kind.width; ++x)
        ASSERT_EQ(residual[static_cast<size_t>(y * kind.width + x)],
                  left.residual.at(x / kind.scale, y / kind.scale));
    frame->write(Output::mask, Levels(), out.out());
    for (size_t p = 0; p < edges.size(); ++p) ASSERT_EQ(out.at(1, p), edges[p]);
    for (size_t i : {size_t{1}, size_t{2}}) {
      frame->write(outputs[i], Levels(), out.out());
      ASSERT_EQ(out.bytes, repeated(left.pictures[i])) << next << " output " << i;
    }
    frame->write_frame(Levels(), out.out());
    ASSERT_EQ(out.bytes, repeated(left.frame)) << next;
    frame->write(Output::cutout, Levels(), out.out());
    const std::vector<uint8_t> frames = repeated(left.frame);
    for (size_t p = 0; p < edges.size(); ++p)
      for (size_t c = 0; c < 4; ++c)
        ASSERT_EQ(out.at(c, p), edges[p] ? frames[4 * p + c] : 0) << next;
    for (const uint8_t sample : edges) white += sample != 0;
    ++next;
  });
  EXPECT_EQ(next, static_cast<size_t>(kFrames));
  EXPECT_GT(white, 0u);
}

INSTANTIATE_TEST_SUITE_P(Kinds, ReducedEngine,
                         testing::Values(Kind{Mode::batch, Method::robust, 2, 192, 96},
                                         Kind{Mode::live, Method::robust, 2, 193, 97},
                                         Kind{Mode::live, Method::robust, 2, 601, 67},
                                         Kind{Mode::batch, Method::robust, 4, 1101, 70},
                                         Kind{Mode::batch, Method::qdmd, 2, 161, 80},
                                         Kind{Mode::live, Method::qdmd, 2, 160, 81},
                                         Kind{Mode::batch, Method::dmd, 4, 195, 98},
                                         Kind{Mode::live, Method::robust, 4, 194, 99}));

constexpr Kind kLive = {Mode::live, Method::robust, 2, 193, 97};

// Edges follow the frame's own pixels: as near to the truth as twice as many would be.
TEST(Reduced, EdgesLieBetweenThePixels) {
  size_t wrong[2] = {}, white = 0;
  for (int scale : {1, 2}) {
    Engine engine;
    ASSERT_TRUE(engine.configure(options_of(kLive, scale), kLive.width, kLive.height).ok());
    PackedPicture picture(kLive.width, kLive.height);
    int t = 0;
    stream(&engine, 40, &picture, nullptr, nullptr, [&](LeavingFrame* frame) {
      const uint8_t* const mask = frame->mask();
      for (int y = 0; t >= 20 && y < kLive.height; ++y)
        for (int x = 0; x < kLive.width; ++x) {
          const bool inside = x >= 3 * t && x < 3 * t + 23 && y >= 21 && y < 52;
          wrong[scale - 1] += (mask[y * kLive.width + x] != 0) != inside;
          white += scale == 1 && inside;
        }
      ++t;
    });
  }
  // Repeated pixels would have about a fifth of the box too many: two rows and columns of it.
  EXPECT_LT(wrong[1], wrong[0] + white / 25) << wrong[0] << " of " << white;
}

TEST(Reduced, WhatIsIgnoredIsBlackToThePixel) {
  Wishes wishes;
  const Rectangle area = {71, 31, 21, 11}, beyond = {-3, -5, 10, 9};
  ASSERT_TRUE(wishes.ignored.add(area));
  ASSERT_TRUE(wishes.ignored.add(beyond));
  Engine engine;
  ASSERT_TRUE(engine.configure(options_of(kLive, 2), kLive.width, kLive.height).ok());
  PackedPicture picture(kLive.width, kLive.height);
  size_t around = 0;
  for (const int softness : {0, 3}) {
    wishes.mask_softness = softness;
    stream(&engine, 40, &picture, nullptr, &wishes, [&](LeavingFrame* frame) {
      PackedPicture out(kLive.width, kLive.height);
      frame->write(Output::mask, Levels(), out.out());
      for (int y = 0; y < kLive.height; ++y)
        for (int x = 0; x < kLive.width; ++x) {
          const uint8_t sample = out.at(0, static_cast<size_t>(y * kLive.width + x));
          ASSERT_TRUE(sample == 0 || !wishes.ignored.has(x, y)) << x << "," << y;
          // At most the pixels that share one with the area are lost.
          const bool near = x >= area.x - 3 && x < area.x + area.width + 3 && y >= area.y - 3 &&
                            y < area.y + area.height + 3;
          around += near && sample != 0;
        }
    });
  }
  EXPECT_GT(around, 100u);
}

TEST(Reduced, AreasHaveAllPixelsThatTheyTouch) {
  IgnoredAreas areas;
  ASSERT_TRUE(areas.add({-7, 3, 9, 1}));
  ASSERT_TRUE(areas.add({5, -8, 1, 4}));
  ASSERT_TRUE(areas.add({2147483640, -2147483647, 2147483647, 2147483647}));
  for (int scale : {2, 4}) {
    const IgnoredAreas small = areas.reduced(scale);
    ASSERT_EQ(small.size(), areas.size());
    for (int y = -5; y < 5; ++y)
      for (int x = -5; x < 5; ++x) {
        bool any = false;
        for (int i = 0; i < scale * scale; ++i)
          any |= areas.has(x * scale + i % scale, y * scale + i / scale);
        EXPECT_EQ(small.has(x, y), any) << x << "," << y;
      }
  }
}

// A soft mask fades over as many pixels of the frame.
TEST(Reduced, SoftMasksFadeEvenly) {
  Engine engine, small;
  EngineOptions options = options_of(kLive, 2);
  options.mask_softness = 3;
  ASSERT_TRUE(engine.configure(options, kLive.width, kLive.height).ok());
  const Reduction size = {kLive.width, kLive.height, 2};
  options.mask_scale = 1;
  options.mask_softness = 2;
  ASSERT_TRUE(small.configure(options, size.small_width(), size.small_height()).ok());
  PackedPicture picture(kLive.width, kLive.height);
  std::vector<Plane> expected;
  FrameReducer reducer(size, 8);
  stream(&small, 30, &picture, &reducer, nullptr, [&](LeavingFrame* frame) {
    PackedPicture out(size.small_width(), size.small_height());
    frame->write(Output::mask, Levels(), out.out());
    Plane plane = {out.width, out.height, {}};
    for (size_t p = 0; p < out.pixels(); ++p) plane.samples.push_back(out.at(0, p));
    expected.push_back(plane);
  });
  size_t next = 0, grey = 0;
  stream(&engine, 30, &picture, nullptr, nullptr, [&](LeavingFrame* frame) {
    PackedPicture out(kLive.width, kLive.height);
    frame->write(Output::mask, Levels(), out.out());
    for (int y = 0; y < kLive.height; ++y)
      for (int x = 0; x < kLive.width; ++x) {
        const uint8_t sample = out.at(0, static_cast<size_t>(y * kLive.width + x));
        ASSERT_EQ(sample, bilinear(expected[next], 2, x, y)) << next << ": " << x << "," << y;
        grey += sample > 0 && sample < 255;
      }
    ++next;
  });
  EXPECT_GT(grey, 100u);
}

TEST(Reduced, WhatIsLearntSaysItsSize) {
  Engine engine, next;
  ASSERT_TRUE(engine.configure(options_of(kLive, 2), kLive.width, kLive.height).ok());
  PackedPicture picture(kLive.width, kLive.height), before(kLive.width, kLive.height),
      after(kLive.width, kLive.height);
  stream(&engine, 20, &picture, nullptr, nullptr, [](LeavingFrame*) {});
  Learnt learnt;
  ASSERT_TRUE(engine.learnt(&learnt));
  EXPECT_EQ(learnt.width, 97);
  EXPECT_EQ(learnt.height, 49);
  ASSERT_TRUE(engine.write_background(before.out()));
  ASSERT_TRUE(next.configure(options_of(kLive, 2), kLive.width, kLive.height).ok());
  ASSERT_TRUE(next.learn_from(learnt).ok());
  ASSERT_TRUE(next.write_background(after.out()));
  EXPECT_EQ(before.bytes, after.bytes);
  // Of another scale it is that of other video.
  ASSERT_TRUE(next.configure(options_of(kLive, 1), kLive.width, kLive.height).ok());
  EXPECT_FALSE(next.learn_from(learnt).ok());
  ASSERT_TRUE(engine.configure(options_of(kLive, 4), kLive.width, kLive.height).ok());
  const Status refused = engine.learn_from(learnt);
  EXPECT_FALSE(refused.ok());
  for (const char* word : {"97x49", "193x97", "49x25", "mask-scale"})
    EXPECT_NE(refused.message.find(word), std::string::npos) << refused.message;
}

TEST(Reduced, OtherScalesAreRefused) {
  for (int scale : {-1, 0, 3, 5, 8}) {
    const Status status = check_options(options_of(kLive, scale), 64, 48);
    EXPECT_FALSE(status.ok()) << scale;
    EXPECT_NE(status.message.find("mask-scale"), std::string::npos) << status.message;
  }
  EngineOptions options = options_of(kLive, 2);
  options.max_memory = 1000;
  const Status status = check_options(options, 192, 97);
  for (const char* word : {"192x97", "96x49", "mask-scale=2"})
    EXPECT_NE(status.message.find(word), std::string::npos) << status.message;
}

// A quarter of the pixels is a quarter of the memory, but for a few pictures.
TEST(Reduced, TakesAQuarterOfTheMemory) {
  EngineOptions options;
  options.colours = Colours::yuv;
  options.chroma_columns = options.chroma_rows = 2;
  options.frame_rate = 25;
  const auto whole = static_cast<double>(layout_of(options, 3840, 2160).bytes);
  options.mask_scale = 2;
  const auto reduced = static_cast<double>(layout_of(options, 3840, 2160).bytes);
  EXPECT_LT(reduced, 0.32 * whole);
  EXPECT_EQ(layout_of(options, 3840, 2160).delay, [&] {
    options.mask_scale = 1;
    return layout_of(options, 1920, 1080).delay;
  }());
}

}  // namespace
}  // namespace qdmd::test
