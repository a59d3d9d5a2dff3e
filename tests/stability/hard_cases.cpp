// SPDX-License-Identifier: LGPL-2.1-or-later
#include "tests/stability/hard_cases.h"

#include "tests/core/clips.h"

namespace qdmd::stability {
namespace {

using test::Clip;
using Levels = std::vector<uint8_t>;
using Rng = std::mt19937;

constexpr size_t kPixels = 48;

// A random generator is made afresh for each case: one case more changes no other.
Levels picture(unsigned seed, int low = 20, int high = 220, size_t pixels = kPixels) {
  Rng rng(seed);
  return test::random_picture(pixels, rng, low, high);
}

Clip noisy(unsigned seed, size_t count, double sigma = 3, size_t pixels = kPixels) {
  Rng rng(seed);
  return test::noisy_clip(pixels, count, sigma, rng);
}

Clip of_frames(const std::vector<Levels>& frames) {
  Clip clip(frames.front().size() / 3, 0);
  clip.frames = frames;
  return clip;
}

// frames[order[t]] at time t.
Clip reordered(const Clip& clip, const std::vector<size_t>& order) {
  Clip result(clip.pixels, 0);
  for (size_t t : order) result.frames.push_back(clip.frames[t]);
  return result;
}

Clip with_black_frame(size_t black) {
  Clip clip = noisy(31, 11);
  clip.frames[black].assign(clip.frames[black].size(), 0);
  return clip;
}

// Frame t is lit where pixel % period == t % period.
Clip disjoint(size_t period, size_t count) {
  Clip clip(kPixels, count);
  for (size_t t = 0; t < count; ++t)
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = t % period; p < kPixels; p += period) clip.at(t, c, p) = 200;
  return clip;
}

Clip mover() {
  Clip clip = test::static_clip(picture(19), 10);
  for (size_t t = 0; t < clip.size(); ++t)
    for (size_t p = 4 * t; p < 4 * t + 6; ++p) {
      clip.at(t, 0, p) = 250;
      clip.at(t, 1, p) = 10;
      clip.at(t, 2, p) = 30;
    }
  return clip;
}

Clip grey() {
  Clip clip = noisy(16, 9);
  for (auto& frame : clip.frames)
    for (size_t p = 0; p < kPixels; ++p) frame[p] = frame[kPixels + p] = frame[2 * kPixels + p];
  return clip;
}

Clip green_only() {
  Clip clip = noisy(17, 9);
  for (auto& frame : clip.frames)
    for (size_t p = 0; p < kPixels; ++p) frame[p] = frame[2 * kPixels + p] = 0;
  return clip;
}

// levels(t) times a picture, rounded.
Clip light(unsigned seed, size_t count, const std::function<double(size_t)>& levels,
           double sigma = 0) {
  const Levels base = picture(seed, 20, 220);
  Rng rng(seed);
  std::normal_distribution<double> noise(0, 1);
  Clip clip(kPixels, count);
  for (size_t t = 0; t < count; ++t)
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < kPixels; ++p)
        clip.set(t, c, p, base[c * kPixels + p] * levels(t) + sigma * noise(rng));
  return clip;
}

Clip exact_fade() {
  const Levels base = picture(23, 0, 3);
  Clip clip(kPixels, 7);
  for (size_t t = 0; t < 7; ++t)
    for (size_t i = 0; i < base.size(); ++i)
      clip.frames[t][i] = static_cast<uint8_t>(base[i] << (6 - t));
  return clip;
}

// x_t = A + t D: lambda = 1 twice with one eigenvector.
Clip ramp() {
  const Levels base = picture(36, 20, 120), slope = picture(37, 0, 15);
  Clip clip(kPixels, 8);
  for (size_t t = 0; t < 8; ++t)
    for (size_t i = 0; i < base.size(); ++i)
      clip.frames[t][i] = static_cast<uint8_t>(base[i] + t * slope[i]);
  return clip;
}

// Every pixel's channels change places: (R, G, B) -> (B, R, G), a turn of the colour about the grey
// axis by 120 degrees, exact in integers.
Clip turning(size_t count, size_t pixels, bool random) {
  Clip clip(pixels, count);
  const Levels start = random ? picture(41, 10, 240, pixels) : Levels{200, 0, 0};
  for (size_t t = 0; t < count; ++t)
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < pixels; ++p) clip.at(t, (c + t) % 3, p) = start[c * pixels + p];
  return clip;
}

Window blinking() {
  const size_t pixels = size_t{3840} * 2160;
  const size_t count = 8;
  Window window(static_cast<int>(count), pixels);
  for (size_t t = 0; t < count; ++t) {
    const int slot = window.append();
    for (int c = 0; c < kChannels; ++c) std::fill_n(window.plane(slot, c), pixels, uint8_t{255});
    if (t == 3) window.plane(slot, 1)[pixels / 2] = 254;
  }
  return window;
}

std::vector<HardCase> make_cases() {
  std::vector<HardCase> all;
  const auto add = [&](const char* name, const char* hard, std::function<Clip()> clip) {
    all.push_back({name, hard, [clip] { return test::to_window(clip()); }});
  };
  const std::vector<size_t> twice = {0, 0, 1, 1, 2, 2, 3, 3, 4, 4};
  const std::vector<size_t> blocks = {0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3};
  const std::vector<size_t> ping_pong = {0, 1, 2, 3, 4, 5, 4, 3, 2, 1, 0};

  add("easy", "nothing: noise 3 on a still picture", [] { return noisy(11, 9); });
  add("static", "rank one", [] { return test::static_clip(picture(12), 9); });
  add("black", "rank zero: no mode exists", [] { return Clip(kPixels, 6); });
  add("white", "rank one at the largest level",
      [] { return test::static_clip(Levels(3 * kPixels, 255), 6); });
  all.push_back({"one pixel blinks",
                 "one level at one of 8.3 million pixels: singular values 3e-7 apart", blinking,
                 true});
  add("frames twice", "half the rank", [twice] { return reordered(noisy(14, 5), twice); });
  add("three equal blocks", "a third of the rank, eigenvalues on the unit circle",
      [blocks] { return reordered(noisy(15, 4), blocks); });
  add("grey", "R = G = B: real geometry, every non-real eigenvalue twice", grey);
  add("one channel", "commuting pixels: every non-real eigenvalue twice", green_only);
  add("noiseless mover", "exact zeros and ones in most of the geometry", mover);
  add("light halved", "two levels of one picture, rank two but for rounding",
      [] { return light(21, 10, [](size_t t) { return t < 5 ? 1.0 : 0.5; }); });
  add("light halved, noise", "the nearest mode is a compromise", [] {
    return light(
        22, 10, [](size_t t) { return t < 5 ? 1.0 : 0.5; }, 3);
  });
  add("exponential fade, exact", "rank one, lambda = 1/2", exact_fade);
  add("exponential fade, rounded", "full rank from rounding alone",
      [] { return light(24, 9, [](size_t t) { return std::pow(0.8, static_cast<double>(t)); }); });
  add("alternating", "eigenvalues 1 and -1", [] {
    const Levels a = picture(25), b = picture(26);
    return of_frames({a, b, a, b, a, b, a, b});
  });
  add("black first frame", "the snapshot that first-frame amplitudes trust is zero",
      [] { return with_black_frame(0); });
  add("black middle frame", "a zero column inside the window", [] { return with_black_frame(5); });
  add("black last frame", "a zero column at the end", [] { return with_black_frame(10); });
  add("ping-pong", "time backwards: eigenvalues lambda and 1 / lambda are equally near",
      [ping_pong] { return reordered(noisy(33, 6), ping_pong); });
  add("eigenvalues repeated", "a cycle of four pictures: i twice", [] { return disjoint(4, 9); });
  add("singular values repeated", "orthogonal frames of one length: all equal",
      [] { return disjoint(8, 16); });
  all[all.size() - 1].repeats = all[all.size() - 2].repeats = true;
  add("nilpotent", "no frame returns: eigenvalue 0 in one Jordan block",
      [] { return disjoint(8, 8); });
  add("Jordan pair", "a linear ramp: lambda = 1 is defective", ramp);
  add("eigenvalue 0", "a flash in the first frame only", [] {
    Clip clip = test::static_clip(picture(38, 20, 100), 8);
    clip.frames[0] = picture(39, 100, 250);
    return clip;
  });
  add("black but the first", "X is not zero, Y is: lambda = 0 alone", [] {
    Clip clip(kPixels, 6);
    clip.frames[0] = picture(40);
    return clip;
  });
  add("colour turns", "lambda = exp(2 pi i / 3) beside 1",
      [] { return turning(9, kPixels, true); });
  add("one pixel turns", "the only eigenvalue is imaginary", [] { return turning(8, 1, false); });
  add("m = 2", "the decomposition is one quaternion", [] { return noisy(43, 2); });
  add("m = 1", "no pair of frames", [] { return noisy(44, 1); });
  add("n < m", "5 pixels, 11 frames", [] { return noisy(45, 11, 20, 5); });
  add("small blink", "one level of one pixel in every second frame: pivots of epsilon's powers",
      [] {
        Clip clip = test::static_clip(picture(2, 40, 215), 24);
        for (size_t t = 1; t < clip.size(); t += 2) ++clip.at(t, 0, kPixels / 2);
        return clip;
      });
  add("1024 frames", "a long window of 6 pixels", [] { return noisy(46, 1024, 8, 6); });
  return all;
}

}  // namespace

const std::vector<HardCase>& hard_cases() {
  static const std::vector<HardCase> cases = make_cases();
  return cases;
}

}  // namespace qdmd::stability
