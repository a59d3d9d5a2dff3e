// SPDX-License-Identifier: LGPL-2.1-or-later
// What an engine promises to take (EngineLayout, max-memory) is what it takes.
//
//   QDMD_LONG=1          all cases: minutes
//   QDMD_SHOW_MEMORY=1   a table of all cases
//   QDMD_SHOW_SITES=20   of each case the code that holds most bytes when most are held, to
//   standard
//                        error; addr2line -fiCe tells names
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <tuple>

#include "tests/core/allocator.h"
#include "tests/core/engine_util.h"
#include "tests/core/solver_names.h"

namespace qdmd::test {
namespace {

enum class Alpha { none, constant, varying };

struct Case {
  Method method = Method::robust;
  Solver solver = Solver::gram;
  Mode mode = Mode::batch;
  Alpha alpha = Alpha::none;
  int width = 320, height = 240, window = 100, threads = 1;
  double rate = 0;  // frames per second: known, some come while a window is solved
  int softness = 0;
  int depth = 8;
  bool shared = false;  // 4:2:0
  int scale = 1;        // of masks
};

EngineOptions options_of(const Case& c) {
  EngineOptions options;
  options.method = c.method;
  options.dmd.solver = c.solver;
  options.mode = c.mode;
  options.window_size = c.window;
  options.threads = c.threads;
  options.frame_rate = c.rate;
  options.mask_softness = c.softness;
  options.depth = c.depth;
  options.mask_scale = c.scale;
  if (c.shared) {
    options.colours = Colours::yuv;
    options.chroma_columns = options.chroma_rows = 2;
  }
  return options;
}

std::string describe(const Case& c) {
  const char* const methods[] = {"qdmd", "dmd", "robust"};
  const char* const alphas[] = {"no alpha", "constant alpha", "varying alpha"};
  std::string name = methods[static_cast<int>(c.method)];
  if (c.method == Method::qdmd) name += std::string("/") + name_of(c.solver);
  return name + (c.mode == Mode::live ? " live " : " batch ") + std::to_string(c.width) + "x" +
         std::to_string(c.height) + " window " + std::to_string(c.window) + ", " +
         std::to_string(c.threads) + " threads, " + alphas[static_cast<int>(c.alpha)] +
         (c.rate > 0 ? ", solved beside" : "") + (c.softness > 0 ? ", soft" : "") +
         (c.depth > 8 ? ", " + std::to_string(c.depth) + " bits" : "") +
         (c.shared ? ", 4:2:0" : "") +
         (c.scale > 1 ? ", masks of 1/" + std::to_string(c.scale) : "");
}

// The picture in samples of `depth` bits, whose low bits are noise.
PackedPicture deepened(const PackedPicture& from, int depth) {
  PackedPicture to(from.width, from.height, 2 * from.bytes_per_pixel);
  std::minstd_rand random(7);
  for (size_t i = 0; i < from.bytes.size(); ++i) {
    const auto sample =
        static_cast<unsigned>(from.bytes[i]) << (depth - 8) | (random() >> 8) % (1u << (depth - 8));
    to.bytes[2 * i] = static_cast<uint8_t>(sample & 255);
    to.bytes[2 * i + 1] = static_cast<uint8_t>(sample >> 8);
  }
  return to;
}
// The first samples of the picture, which has `depth` bits, as planes of 4:2:0.
ImageView shared_view(const PackedPicture& picture, int depth) {
  ImageView view;
  view.width = picture.width;
  view.height = picture.height;
  view.bits = {depth, 0};
  const ptrdiff_t size = depth > 8 ? 2 : 1, along = size * ((picture.width + 1) / 2),
                  down = (picture.height + 1) / 2;
  view.channel[0] = picture.bytes.data();
  view.channel[1] = view.channel[0] + size * picture.width * picture.height;
  view.channel[2] = view.channel[1] + along * down;
  view.own[0] = {size, size * picture.width, 1, 1};
  view.own[1] = view.own[2] = {size, along, 2, 2};
  return view;
}
template <typename Byte>
BasicImageView<Byte> deep_view(PackedPicture& picture, const Case& c) {
  auto view = picture.view<Byte>();
  for (int channel = 0; channel < 3; ++channel)
    view.channel[channel] = picture.bytes.data() + 2 * channel;
  if (c.alpha != Alpha::none) view.alpha = picture.bytes.data() + 6;
  view.bits = {c.depth, 0};
  return view;
}

// A light that goes up and down, something that moves, and noise, which makes the frames linearly
// independent: all that a solve may need memory for.
void paint(int t, Alpha alpha, PackedPicture* picture) {
  std::minstd_rand random(static_cast<unsigned>(t) + 1);
  for (int y = 0; y < picture->height; ++y)
    for (int x = 0; x < picture->width; ++x) {
      const auto p =
          static_cast<size_t>(y) * static_cast<size_t>(picture->width) + static_cast<size_t>(x);
      const bool moves = x / 8 == t % (picture->width / 8) && y / 8 == 2;
      for (size_t c = 0; c < 3; ++c) {
        const int level = 60 + (7 * x + 3 * y + 11 * static_cast<int>(c)) % 80 + t % 5 +
                          static_cast<int>(random() >> 8) % 3;
        picture->at(c, p) = static_cast<uint8_t>(moves ? 230 : level);
      }
      if (alpha != Alpha::none)
        picture->at(3, p) = static_cast<uint8_t>(alpha == Alpha::varying ? x % 200 : 200);
    }
}

// Another scene: bars, where there are columns else.
void turn(PackedPicture* picture) {
  for (size_t p = 0; p < picture->pixels(); ++p) {
    const size_t y = p / static_cast<size_t>(picture->width);
    for (size_t c = 0; c < 3; ++c)
      picture->at(c, p) = static_cast<uint8_t>(40 + 160 * (y / 8 % 2) + picture->at(c, p) / 16);
  }
}

// From configure() to the end: two windows, a bit of a third, its end, most of another one, and
// what else can be asked. Returns the bytes that the engine says it takes.
double run(const Case& c) {
  const allocator::Unseen unseen;
  PackedPicture picture(c.width, c.height, c.alpha == Alpha::none ? 3 : 4, c.alpha != Alpha::none);
  const auto pixels = picture.pixels();
  std::vector<uint8_t> mask(pixels), residual(pixels);
  PackedPicture deep = deepened(picture, c.depth);
  const auto see = [](auto work) {
    const allocator::SeenAgain again;
    work();
  };
  Engine engine;
  Status status;
  see([&] { status = engine.configure(options_of(c), c.width, c.height); });
  EXPECT_TRUE(status.ok()) << status.message;
  const auto pop = [&] {
    if (!engine.next()) return;
    see([&] { engine.next()->foreground(mask.data(), residual.data()); });
    while (engine.next()) see([&] { engine.next()->pop(Output::mask, picture.out()); });
    see([&] { engine.write_background(picture.out()); });
    if (c.depth > 8) see([&] { engine.write_background(deep_view<uint8_t>(deep, c)); });
  };
  const auto stream = [&](int frames, int others) {
    for (int t = 0; t < (others > 0 ? c.window + others : 0) + frames; ++t) {
      paint(t, c.alpha, &picture);
      if (t >= c.window && t < c.window + others) turn(&picture);
      if (c.depth > 8) deep = deepened(picture, c.depth);
      if (c.shared) {
        const PackedPicture& samples = c.depth > 8 ? deep : picture;
        see([&] { status = engine.push(shared_view(samples, c.depth)); });
      } else if (c.depth > 8) {
        see([&] { status = engine.push(deep_view<const uint8_t>(deep, c)); });
      } else {
        see([&] { status = engine.push(picture.in()); });
      }
      EXPECT_TRUE(status.ok()) << status.message;
      pop();
    }
    see([&] { status = engine.drain(); });
    EXPECT_TRUE(status.ok()) << status.message;
    pop();
  };
  // Live keeps what it knew of a scene while the camera shows another one.
  const bool knows_scenes = c.method == Method::robust && c.mode == Mode::live;
  const int others = knows_scenes ? std::max(12, c.window / 2) : 0;
  // And long enough for a solve after it is back, where live leaves out some.
  stream((others > 0 ? 3 : 2) * c.window + c.window / 5 + 2, others);
  // A window that is not full looks at most of its frames, beside those that are remembered.
  stream(c.window - 1, 0);
  const auto promised = static_cast<double>(engine.report().bytes);
  see([&] { engine.close(); });
  return promised;
}

bool asked_for(const char* name) { return std::getenv(name) != nullptr; }

struct Bytes {
  double promised, peak;
};
Bytes bytes_of(const Case& c) {
  // The list of kernels is made once for the process.
  kernels();
  allocator::start();
  const double promised = run(c);
  allocator::stop();
  const auto seen = allocator::seen();
  EXPECT_EQ(seen.blocks, 0) << "of " << seen.bytes << " bytes are left";
  if (asked_for("QDMD_SHOW_SITES")) {
    allocator::start();
    allocator::note_sites(static_cast<int64_t>(0.995 * static_cast<double>(seen.peak)));
    run(c);
    allocator::stop();
    std::fprintf(stderr, "== %s: %ld bytes\n", describe(c).c_str(), static_cast<long>(seen.peak));
    allocator::print_sites(std::atoi(std::getenv("QDMD_SHOW_SITES")));
  }
  return {promised, static_cast<double>(seen.peak)};
}

void check(const Case& c) {
  SCOPED_TRACE(describe(c));
  const auto [promised, peak] = bytes_of(c);
  const double ratio = peak / promised;
  if (asked_for("QDMD_SHOW_MEMORY"))
    std::printf("%-64s %11.0f %11.0f %6.3f\n", describe(c).c_str(), promised, peak, ratio);
  // The channels' modes may be complex, which takes four times the pictures of real ones.
  // Live windows that fill up again are solved every hop, not just before they are full.
  const double least = c.method == Method::dmd                              ? 0.4
                       : c.method == Method::robust && c.mode == Mode::live ? 0.95
                                                                            : 0.98;
  EXPECT_LE(ratio, 1.02) << promised << " promised, " << peak << " taken";
  EXPECT_GE(ratio, least) << promised << " promised, " << peak << " taken";
}

struct Size {
  int width, height, window;
};

// In short, three of the sizes say most.
std::vector<Size> chosen(std::vector<Size> sizes) {
  if (!asked_for("QDMD_LONG")) sizes.resize(std::min<size_t>(3, sizes.size()));
  return sizes;
}

void check_all(Method method, Solver solver, const std::vector<Size>& sizes) {
  if (!allocator::sees_all()) GTEST_SKIP();
  for (const Size& size : chosen(sizes))
    for (Mode mode : {Mode::batch, Mode::live})
      for (Alpha alpha : {Alpha::none, Alpha::constant, Alpha::varying})
        for (int threads : {1, 2, 4}) {
          // In short: one thread without alpha, and most of both.
          if (!asked_for("QDMD_LONG") && (alpha == Alpha::constant || threads == 2 ||
                                          (threads == 1) != (alpha == Alpha::none)))
            continue;
          check({method, solver, mode, alpha, size.width, size.height, size.window, threads});
        }
}

TEST(Memory, OfTheDefault) {
  check_all(Method::robust, Solver::gram,
            {{320, 240, 100}, {64, 48, 50}, {640, 480, 12}, {100, 80, 30}, {200, 150, 60}});
}

// Windows that are solved while frames come: they keep more frames, and two models.
TEST(Memory, OfTheDefaultSolvedBeside) {
  if (!allocator::sees_all()) GTEST_SKIP();
  for (const Size& size :
       chosen({{320, 240, 100}, {64, 48, 50}, {640, 480, 12}, {100, 80, 30}, {200, 150, 60}}))
    for (Alpha alpha : {Alpha::none, Alpha::constant, Alpha::varying})
      for (int threads : {1, 2, 4})
        for (double rate : {100.0, 1e4}) {
          if (!asked_for("QDMD_LONG") && (alpha == Alpha::constant || threads == 2 ||
                                          (threads == 1) != (alpha == Alpha::none)))
            continue;
          Case c{Method::robust, Solver::gram, Mode::batch, alpha,
                 size.width,     size.height,  size.window, threads};
          c.rate = rate;
          if (layout_of(options_of(c), c.width, c.height).late_frames == 0) {
            EXPECT_LT(rate, 1e4) << describe(c);
            continue;
          }
          check(c);
        }
}

TEST(Memory, OfMoreThan8Bits) {
  if (!allocator::sees_all()) GTEST_SKIP();
  for (Method method : {Method::robust, Method::qdmd, Method::dmd})
    for (Mode mode : {Mode::batch, Mode::live})
      for (Alpha alpha : {Alpha::none, Alpha::varying}) {
        Case c;
        c.method = method, c.mode = mode, c.alpha = alpha;
        c.width = 200, c.height = 150, c.window = 60, c.threads = 2;
        c.depth = alpha == Alpha::none ? 10 : 16;
        check(c);
      }
}

TEST(Memory, OfSharedChroma) {
  if (!allocator::sees_all()) GTEST_SKIP();
  for (Method method : {Method::robust, Method::qdmd, Method::dmd})
    for (Mode mode : {Mode::batch, Mode::live})
      for (const auto& [threads, depth] : {std::pair{1, 8}, {3, 8}, {2, 10}}) {
        Case c;
        c.method = method, c.mode = mode, c.threads = threads, c.depth = depth;
        c.width = 201, c.height = 151, c.window = 60;
        c.shared = true;
        check(c);
      }
}

TEST(Memory, OfMasksOfASmallerPicture) {
  if (!allocator::sees_all()) GTEST_SKIP();
  for (Mode mode : {Mode::batch, Mode::live})
    for (const auto& [scale, alpha, depth] :
         {std::tuple{2, Alpha::none, 8}, {2, Alpha::varying, 8}, {4, Alpha::varying, 10}}) {
      Case c;
      c.mode = mode, c.scale = scale, c.alpha = alpha, c.depth = depth;
      c.width = 401, c.height = 299, c.window = 60, c.threads = 2;
      check(c);
    }
}

TEST(Memory, OfSoftMasks) {
  if (!allocator::sees_all()) GTEST_SKIP();
  for (Mode mode : {Mode::batch, Mode::live}) {
    Case c;
    c.mode = mode;
    c.width = 640, c.height = 480, c.window = 12;
    c.softness = 3;
    check(c);
  }
}

// Soft masks that are asked for late count from then on.
TEST(Memory, OfSoftMasksCountsOnceThereAreAny) {
  Engine engine;
  Case c;
  c.window = 2;
  ASSERT_TRUE(engine.configure(options_of(c), c.width, c.height).ok());
  const uint64_t before = engine.report().bytes;
  PackedPicture picture(c.width, c.height, 3);
  for (int t = 0; t < 2; ++t) {
    paint(t, Alpha::none, &picture);
    ASSERT_TRUE(engine.push(picture.in()).ok());
  }
  ASSERT_TRUE(engine.drain().ok());
  Wishes wishes;
  wishes.mask_softness = 2;
  LeavingFrame* const frame = engine.next(&wishes);
  EXPECT_EQ(engine.report().bytes, before);
  frame->pop(Output::mask, picture.out());
  const uint64_t after = engine.report().bytes;
  EXPECT_EQ(after - before, SoftMask::bytes(c.width, c.height));
  c.softness = 2;
  EXPECT_EQ(layout_of(options_of(c), c.width, c.height).bytes, after);
  c.softness = kMostSoftness + 1;
  EXPECT_FALSE(check_options(options_of(c), c.width, c.height).ok());
}

TEST(Memory, OfQdmd) {
  for (Solver solver : {Solver::gram, Solver::gram_extended})
    check_all(Method::qdmd, solver,
              {{320, 240, 100},
               {64, 48, 16},
               {160, 120, 200},
               {64, 48, 50},
               {640, 480, 12},
               {100, 80, 30},
               {200, 150, 60},
               {40, 30, 120}});
}

TEST(Memory, OfQdmdFromPixels) {
  check_all(Method::qdmd, Solver::qr,
            {{64, 48, 50}, {160, 120, 12}, {160, 120, 100}, {100, 80, 30}, {200, 150, 60}});
  check_all(Method::qdmd, Solver::adjoint, {{48, 32, 10}, {32, 24, 16}});
}

TEST(Memory, OfDmd) {
  check_all(Method::dmd, Solver::gram,
            {{320, 240, 100}, {64, 48, 50}, {640, 480, 12}, {100, 80, 30}, {200, 150, 60}});
}

}  // namespace
}  // namespace qdmd::test
