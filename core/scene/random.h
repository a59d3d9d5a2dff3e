// SPDX-License-Identifier: LGPL-2.1-or-later
// Random numbers that a seed, a name and a number decide, whatever else has been drawn.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace qdmd::scene {

// What one stream was used for; for tests that compare the draws of two scenes.
struct DrawRecord {
  std::string name;
  int64_t number;
  uint64_t first_state;
  uint64_t draws;

  bool operator==(const DrawRecord&) const = default;
};

// SplitMix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number generators", 2014): the
// state is a counter, so that the streams of different keys never have to wait for each other.
class Stream {
 public:
  Stream(uint64_t seed, std::string_view name, int64_t number, std::vector<DrawRecord>* log);
  ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  uint64_t next() { return mix(state_ += kStep); }
  // In [0, 1).
  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  // In 0 .. count - 1, count > 0.
  int index(int count) { return static_cast<int>(uniform() * count); }

  static uint64_t mix(uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }

 private:
  static constexpr uint64_t kStep = 0x9e3779b97f4a7c15u;

  uint64_t state_;
  std::vector<DrawRecord>* log_;
  std::string_view name_;
  int64_t number_;
  uint64_t first_state_;
};

// The streams of one name under one seed: one for each frame, and kSetup for what is drawn once.
// The name must outlive the source and its streams.
class StreamSource {
 public:
  static constexpr int64_t kSetup = -1;

  StreamSource(uint64_t seed, std::string_view name, std::vector<DrawRecord>* log = nullptr)
      : seed_(seed), name_(name), log_(log) {}

  Stream at(int64_t number) const { return Stream(seed_, name_, number, log_); }
  // Logs nothing: for objects whose draws depend on which of them are in view.
  Stream unlogged(int64_t number) const { return Stream(seed_, name_, number, nullptr); }

 private:
  uint64_t seed_;
  std::string_view name_;
  std::vector<DrawRecord>* log_;
};

// Quantiles of the standard normal distribution at (i + 1/2) / size, i = 0 .. size - 1, scaled to a
// variance of 1: a uniform index draws a normal number. With 65536 of them it ends at 4.3.
std::vector<float> normal_quantiles(int size);

}  // namespace qdmd::scene
