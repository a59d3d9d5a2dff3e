// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/colour_map.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/learn/robust/learning_steps.h"

namespace qdmd {
namespace {

using namespace steps::colour;

// Its samples may be at the end of their range, and say no more than "at least".
bool is_at_end(const float* const picture[kChannels], size_t cell) {
  return std::max({picture[0][cell], picture[1][cell], picture[2][cell]}) >=
         steps::light::kMeasured;
}

uint8_t rounded(float level, uint8_t least, uint8_t most) {
  return static_cast<uint8_t>(
      std::clamp(level + 0.5f, static_cast<float>(least), static_cast<float>(most)));
}

// The map of samples that is `map` of cells.
ColourMap of_samples(const ColourMap& map, const RgbColours& colours) {
  Eigen::Matrix3d to_cells, of_cells;
  Eigen::Vector3d offset, added;
  for (int c = 0; c < kChannels; ++c) {
    const auto row = static_cast<size_t>(c);
    for (int k = 0; k < kChannels; ++k) {
      to_cells(c, k) = static_cast<double>(colours.matrix()[row][static_cast<size_t>(k)]);
      of_cells(c, k) = static_cast<double>(map.row[row][static_cast<size_t>(k)]);
    }
    offset(c) = static_cast<double>(colours.offset()[row]);
    added(c) = static_cast<double>(map.row[row][kChannels]);
  }
  const Eigen::Matrix3d back = to_cells.inverse();
  const Eigen::Matrix3d all = back * of_cells * to_cells;
  const Eigen::Vector3d constant = back * (of_cells * offset + added - offset);
  ColourMap found;
  for (int c = 0; c < kChannels; ++c) {
    auto& row = found.row[static_cast<size_t>(c)];
    for (int k = 0; k < kChannels; ++k) row[static_cast<size_t>(k)] = static_cast<float>(all(c, k));
    row[kChannels] = static_cast<float>(constant(c));
  }
  return found;
}

}  // namespace

std::optional<ColourMap> find_colour_map(const float* const frame[kChannels],
                                         const float* const background[kChannels], size_t cells,
                                         const RgbColours& colours) {
  std::vector<float> away(cells, 0);
  ColourMap map = {};
  float limit = 0;
  for (int round = 0; round < kRounds; ++round) {
    // A ridge, so that a background of one colour has a map, too.
    Eigen::Matrix4d square = Eigen::Matrix4d::Identity();
    Eigen::Matrix<double, 4, kChannels> product = Eigen::Matrix<double, 4, kChannels>::Zero();
    for (size_t cell = 0; cell < cells; ++cell) {
      if (away[cell] > limit) continue;
      if (is_at_end(frame, cell) || is_at_end(background, cell)) continue;
      const Eigen::Vector4d from(static_cast<double>(background[0][cell]),
                                 static_cast<double>(background[1][cell]),
                                 static_cast<double>(background[2][cell]), 1);
      const Eigen::RowVector3d to(static_cast<double>(frame[0][cell]),
                                  static_cast<double>(frame[1][cell]),
                                  static_cast<double>(frame[2][cell]));
      square.noalias() += from * from.transpose();
      product.noalias() += from * to;
    }
    const Eigen::Matrix<double, 4, kChannels> found = square.ldlt().solve(product);
    if (!found.allFinite()) return std::nullopt;
    for (int c = 0; c < kChannels; ++c)
      for (int k = 0; k <= kChannels; ++k)
        map.row[static_cast<size_t>(c)][static_cast<size_t>(k)] = static_cast<float>(found(k, c));
    for (size_t cell = 0; cell < cells; ++cell) {
      const auto expected = map.of({background[0][cell], background[1][cell], background[2][cell]});
      away[cell] = 0;
      for (size_t c = 0; c < kChannels; ++c)
        away[cell] += std::abs(frame[c][cell] - std::min(expected[c], 255.0f));
    }
    std::vector<float> sorted = away;
    const auto at = sorted.begin() + static_cast<ptrdiff_t>(kFits * static_cast<double>(cells));
    std::nth_element(sorted.begin(), at, sorted.end());
    limit = *at;
  }
  if (limit >= kChannels * kExplained) return std::nullopt;
  return colours.converts() ? of_samples(map, colours) : map;
}

Colouring colouring_of(const float* const cells[kChannels], const float* const other[kChannels],
                       size_t count) {
  constexpr size_t kEach = 5;  // of so many cells one says enough
  double colour = 0, level = 0;
  size_t seen = 0;
  for (size_t cell = 0; cell < count; cell += kEach) {
    const float a = cells[0][cell], b = cells[1][cell], c = cells[2][cell];
    if (other && (is_at_end(cells, cell) || is_at_end(other, cell))) continue;
    colour += static_cast<double>(std::max({a, b, c}) - std::min({a, b, c}));
    level += static_cast<double>((a + b + c) / 3);
    ++seen;
  }
  if (seen < steps::light::kLeastRatios) return Colouring::little;
  if (colour < kNone * level) return Colouring::none;
  return colour > kSome * level ? Colouring::some : Colouring::little;
}

void recolour(const ColourMap& map, const SampleRange& range, size_t count,
              uint8_t* const level[kChannels]) {
  for (size_t p = 0; p < count; ++p) {
    const auto now = map.of({static_cast<float>(level[0][p]), static_cast<float>(level[1][p]),
                             static_cast<float>(level[2][p])});
    for (size_t c = 0; c < kChannels; ++c)
      level[c][p] = rounded(now[c], range.least[c], range.most[c]);
  }
}

void recolour(const ColourMap& map, const SampleRange& range, Learnt* learnt) {
  OwnedPicture& picture = learnt->picture;
  uint8_t* const level[kChannels] = {picture.level[0].data(), picture.level[1].data(),
                                     picture.level[2].data()};
  recolour(map, range, picture.level[0].size(), level);
  // The bits below are those of other levels: the middle of what they can be.
  for (auto& below : picture.below)
    for (uint8_t& bits : below) bits = static_cast<uint8_t>(1 << (picture.depth - 9));
  if (!learnt->earlier) return;
  LearntEarlier& earlier = *learnt->earlier;
  uint8_t* const known[kChannels] = {earlier.level[0].data(), earlier.level[1].data(),
                                     earlier.level[2].data()};
  recolour(map, range, earlier.level[0].size(), known);
  earlier.places.clear();
}

}  // namespace qdmd
