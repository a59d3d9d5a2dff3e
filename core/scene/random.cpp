// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/scene/random.h"

#include <cmath>
#include <numbers>

namespace qdmd::scene {
namespace {

// FNV-1a.
uint64_t hash(std::string_view text) {
  uint64_t value = 0xcbf29ce484222325u;
  for (const char c : text) value = (value ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return value;
}

uint64_t key(uint64_t seed, std::string_view name, int64_t number) {
  return Stream::mix(Stream::mix(Stream::mix(seed) ^ hash(name)) + static_cast<uint64_t>(number));
}

}  // namespace

Stream::Stream(uint64_t seed, std::string_view name, int64_t number, std::vector<DrawRecord>* log)
    : state_(key(seed, name, number)),
      log_(log),
      name_(name),
      number_(number),
      first_state_(state_) {}

Stream::~Stream() {
  if (!log_) return;
  // The step is odd: its inverse modulo 2^64 (Newton) turns the way of the counter into a number.
  uint64_t inverse = kStep;
  for (int i = 0; i < 6; ++i) inverse *= 2 - kStep * inverse;
  log_->push_back({std::string(name_), number_, first_state_, (state_ - first_state_) * inverse});
}

std::vector<float> normal_quantiles(int size) {
  std::vector<double> half(static_cast<size_t>((size + 1) / 2));
  const double root_two_pi = std::sqrt(2 * std::numbers::pi);
  double z = 0, squares = 0;
  // From the middle outwards each quantile is a good start for Newton's method at the next.
  for (size_t i = 0; i < half.size(); ++i) {
    const double upper_tail =
        0.5 - (static_cast<double>(i) + (size % 2 ? 0.0 : 0.5)) / static_cast<double>(size);
    for (int step = 0; step < 8; ++step)
      z += (0.5 * std::erfc(z / std::numbers::sqrt2) - upper_tail) * root_two_pi *
           std::exp(z * z / 2);
    half[i] = z;
    squares += z * z * (size % 2 && i == 0 ? 1 : 2);
  }
  const double scale = squares > 0 ? std::sqrt(size / squares) : 0;
  std::vector<float> quantiles(static_cast<size_t>(size));
  for (size_t i = 0; i < half.size(); ++i) {
    const size_t above = static_cast<size_t>(size / 2) + i;
    quantiles[above] = static_cast<float>(half[i] * scale);
    quantiles[static_cast<size_t>(size) - 1 - above] = -quantiles[above];
  }
  return quantiles;
}

}  // namespace qdmd::scene
