// SPDX-License-Identifier: LGPL-2.1-or-later
// Clips: short videos of few pixels, as the tests of core need them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "core/gram/gram.h"

namespace qdmd::test {

// frames[t] holds three planes of `pixels` samples.
struct Clip {
  size_t pixels;
  std::vector<std::vector<uint8_t>> frames;

  Clip(size_t pixels_, size_t count)
      : pixels(pixels_), frames(count, std::vector<uint8_t>(3 * pixels_)) {}
  size_t size() const { return frames.size(); }
  uint8_t& at(size_t t, size_t c, size_t p) { return frames[t][c * pixels + p]; }
  uint8_t at(size_t t, size_t c, size_t p) const { return frames[t][c * pixels + p]; }
  // Rounds and clamps like a camera.
  void set(size_t t, size_t c, size_t p, double level) {
    at(t, c, p) = static_cast<uint8_t>(std::lround(std::clamp(level, 0.0, 255.0)));
  }
};

inline std::vector<uint8_t> random_picture(size_t pixels, std::mt19937& rng, int low = 0,
                                           int high = 255) {
  std::uniform_int_distribution<int> level(low, high);
  std::vector<uint8_t> picture(3 * pixels);
  for (auto& sample : picture) sample = static_cast<uint8_t>(level(rng));
  return picture;
}

inline Clip static_clip(const std::vector<uint8_t>& picture, size_t count) {
  Clip clip(picture.size() / 3, count);
  for (auto& frame : clip.frames) frame = picture;
  return clip;
}

inline Clip random_clip(size_t pixels, size_t count, std::mt19937& rng) {
  Clip clip(pixels, count);
  for (auto& frame : clip.frames) frame = random_picture(pixels, rng);
  return clip;
}

inline Clip noisy_clip(size_t pixels, size_t count, double sigma, std::mt19937& rng) {
  const auto picture = random_picture(pixels, rng, 40, 215);
  std::normal_distribution<double> noise(0, sigma);
  Clip clip(pixels, count);
  for (size_t t = 0; t < count; ++t)
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < pixels; ++p) clip.set(t, c, p, picture[c * pixels + p] + noise(rng));
  return clip;
}

inline void append_frame(Window& window, const std::vector<uint8_t>& frame) {
  const int slot = window.append();
  for (int c = 0; c < kChannels; ++c)
    std::copy_n(frame.data() + static_cast<size_t>(c) * window.pixels(), window.pixels(),
                window.plane(slot, c));
}

inline Window to_window(const Clip& clip) {
  Window window(static_cast<int>(clip.size()), clip.pixels);
  for (const auto& frame : clip.frames) append_frame(window, frame);
  return window;
}

// x = R i + G j + B k, one column a frame.
inline QuaternionMatrixd to_quaternions(const Clip& clip) {
  QuaternionMatrixd x(static_cast<Eigen::Index>(clip.pixels),
                      static_cast<Eigen::Index>(clip.size()));
  for (size_t t = 0; t < clip.size(); ++t)
    for (size_t p = 0; p < clip.pixels; ++p)
      x.set(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(t),
            Quaterniond(0.0, clip.at(t, 0, p), clip.at(t, 1, p), clip.at(t, 2, p)));
  return x;
}

inline IntegerMatrix gram_of(const Window& window) {
  Window again(window.capacity(), window.pixels());
  SlidingGram gram(window.capacity());
  for (int t = 0; t < window.size(); ++t) {
    const int slot = again.append();
    for (int c = 0; c < kChannels; ++c)
      std::copy_n(window.plane(window.slot(t), c), window.pixels(), again.plane(slot, c));
    gram.add_newest(again);
  }
  return gram.matrix(again);
}

inline QuaternionMatrixd quaternion_gram_of(const Clip& clip) {
  return quaternion_gram(gram_of(to_window(clip)));
}

// Brightens by `gain` a frame.
inline Clip drifting_clip(size_t pixels, size_t count, double gain, std::mt19937& rng) {
  const auto picture = random_picture(pixels, rng, 20, 200);
  Clip clip(pixels, count);
  for (size_t t = 0; t < count; ++t)
    for (size_t c = 0; c < 3; ++c)
      for (size_t p = 0; p < pixels; ++p)
        clip.set(t, c, p, picture[c * pixels + p] * (1 + gain * static_cast<double>(t)));
  return clip;
}

// A box of another colour crosses a noisy static picture.
inline Clip moving_box_clip(size_t pixels, size_t count, size_t box, std::mt19937& rng) {
  Clip clip = noisy_clip(pixels, count, 2, rng);
  for (size_t t = 0; t < count; ++t)
    for (size_t i = 0; i < box; ++i) {
      const size_t p = (t * pixels / count + i) % pixels;
      clip.at(t, 0, p) = 250;
      clip.at(t, 1, p) = static_cast<uint8_t>(10 + i);
      clip.at(t, 2, p) = 90;
    }
  return clip;
}

// Every pixel's colour turns about the grey axis by `angle` a frame, from its own phase.
inline Clip colour_rotating_clip(size_t pixels, size_t count, double angle, double sigma,
                                 std::mt19937& rng) {
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> noise(0, 1);
  Clip clip(pixels, count);
  for (size_t p = 0; p < pixels; ++p) {
    const double grey = 90 + 70 * unit(rng), chroma = 80 * unit(rng), phase = 2 * M_PI * unit(rng);
    for (size_t t = 0; t < count; ++t)
      for (size_t c = 0; c < 3; ++c)
        clip.set(t, c, p,
                 grey + sigma * noise(rng) +
                     chroma * std::cos(phase + angle * static_cast<double>(t) -
                                       2 * M_PI / 3 * static_cast<double>(c)));
  }
  return clip;
}

struct NamedClip {
  const char* name;
  Clip clip;
};

inline std::vector<NamedClip> clips() {
  std::mt19937 rng(71);
  std::vector<NamedClip> all;
  all.push_back({"noise 3", noisy_clip(40, 6, 3, rng)});
  all.push_back({"noise 8", noisy_clip(100, 15, 8, rng)});
  all.push_back({"noise 20", noisy_clip(200, 12, 20, rng)});
  all.push_back({"drift", drifting_clip(120, 8, 0.004, rng)});
  all.push_back({"drift, long", drifting_clip(200, 14, 0.004, rng)});
  all.push_back({"moving box", moving_box_clip(90, 9, 10, rng)});
  all.push_back({"moving large box", moving_box_clip(150, 13, 60, rng)});
  all.push_back({"colours turn", colour_rotating_clip(80, 10, 0.3, 0, rng)});
  all.push_back({"colours turn, noise", colour_rotating_clip(160, 11, 0.7, 4, rng)});
  all.push_back({"random", random_clip(60, 7, rng)});
  all.push_back({"random, tall", random_clip(200, 15, rng)});
  return all;
}

}  // namespace qdmd::test
