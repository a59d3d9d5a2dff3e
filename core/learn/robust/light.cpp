#include "core/learn/robust/light.h"

#include <algorithm>
#include <cmath>

#include "core/passes/median_rows.h"

namespace qdmd {
namespace {

// Levels: cells that differ by less agree.
constexpr float kAgree = 4;
// Cells too dark or too bright have no ratio.
constexpr float kDark = 8, kBright = 250;
// A gain must make this many times as many cells agree, and this share of all cells besides.
constexpr float kGrowth = 1.3f, kShare = 0.1f;
// Frames are divided by gains.
constexpr float kLeastGain = 0.01f;
// Relative change of light that needs no following: less is a part of the noise.
constexpr float kStill = 0.03f;
// Light that is followed from frame to frame must make so many of the cells agree, and so many
// more.
constexpr float kLeastFollowed = 0.25f, kFollowed = 0.05f, kAllAgree = 0.9f;

float median(std::vector<float>* values) {
  const auto middle = values->begin() + static_cast<ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  return *middle;
}

float gray(const float* const planes[3], size_t cell) {
  return (planes[0][cell] + planes[1][cell] + planes[2][cell]) / 3;
}

// Share of cells where frame / gain and reference agree.
float agreement(const float* const frame[3], const float* const reference[3], size_t cells,
                const Gain& gain) {
  size_t agree = 0;
  for (size_t cell = 0; cell < cells; ++cell) {
    float difference = 0;
    for (size_t c = 0; c < kChannels; ++c)
      difference += std::abs(frame[c][cell] / gain[c] - reference[c][cell]);
    if (difference < 3 * kAgree) ++agree;
  }
  return static_cast<float>(agree) / static_cast<float>(cells);
}

// The ratio that most cells share: the mode of the ratios' logarithms, refined by medians near it.
Gain shared_gain(const float* const frame[3], const float* const reference[3], size_t cells,
                 LightScratch* scratch) {
  constexpr int kBins = 300;
  constexpr float kBin = 0.02f, kLowest = -3, kNear = 0.05f;
  std::array<int, kBins + 4> histogram{};
  auto& ratios = scratch->ratios;
  ratios.clear();
  for (size_t cell = 0; cell < cells; ++cell) {
    const float f = gray(frame, cell), r = gray(reference, cell);
    if (f <= kDark || r <= kDark || f >= kBright || r >= kBright) continue;
    const float ratio = std::log(f / r);
    ratios.emplace_back(ratio, cell);
    const int bin = static_cast<int>((ratio - kLowest) / kBin);
    if (bin >= 0 && bin < kBins) ++histogram[static_cast<size_t>(bin) + 2];
  }
  if (ratios.size() < 16) return kSameLight;
  int best = 0, most = -1;
  for (int bin = 0; bin < kBins; ++bin) {
    const int* at = histogram.data() + bin + 2;
    const int smooth = at[-2] + 2 * at[-1] + 3 * at[0] + 2 * at[1] + at[2];
    if (smooth > most) most = smooth, best = bin;
  }
  const float mode = kLowest + (static_cast<float>(best) + 0.5f) * kBin;
  Gain gain = kSameLight;
  auto& near = scratch->near;
  for (size_t c = 0; c < kChannels; ++c) {
    near.clear();
    for (const auto& [ratio, cell] : ratios)
      if (std::abs(ratio - mode) < kNear && reference[c][cell] > kDark)
        near.push_back(frame[c][cell] / reference[c][cell]);
    // A channel that is dark everywhere: the light of the others.
    gain[c] = near.empty() ? std::exp(mode) : std::max(median(&near), kLeastGain);
  }
  return gain;
}

Gain gain_over(const GridFrames& frames, int t, const GridFrames& references, int reference,
               LightScratch* scratch) {
  const float* const frame[3] = {frames.plane(t, 0), frames.plane(t, 1), frames.plane(t, 2)};
  const float* const background[3] = {references.plane(reference, 0),
                                      references.plane(reference, 1),
                                      references.plane(reference, 2)};
  const float before = agreement(frame, background, frames.cells(), kSameLight);
  // What agrees needs no other light, and cannot gain enough.
  if (kGrowth * before + kShare >= 1) return kSameLight;
  const Gain gain = shared_gain(frame, background, frames.cells(), scratch);
  const float after = agreement(frame, background, frames.cells(), gain);
  return after > kGrowth * before + kShare ? gain : kSameLight;
}

float brightness(const Gain& gain) { return (gain[0] + gain[1] + gain[2]) / 3; }

// 1 for small changes, with a soft edge.
Gain without_noise(const Gain& gain) {
  const float share = std::clamp(std::abs(std::log(brightness(gain))) / kStill - 1, 0.0f, 1.0f);
  if (share == 0) return kSameLight;
  Gain settled = gain;
  for (float& g : settled) g = std::exp(std::log(g) * share);
  return settled;
}

}  // namespace

GridFrames median_frame(const GridFrames& frames, int count, const std::vector<Gain>& gains) {
  const int used = std::min(count, kMedianRows);
  GridFrames result(frames.cells(), 1);
  for (int c = 0; c < kChannels; ++c) {
    const float* planes[kMedianRows];
    float divisors[kMedianRows];
    for (int i = 0; i < used; ++i) {
      const int t = static_cast<int>(int64_t{i} * count / used);
      planes[i] = frames.plane(t, c);
      divisors[i] = gains[static_cast<size_t>(t)][static_cast<size_t>(c)];
    }
    median_rows(planes, divisors, static_cast<size_t>(used), frames.cells(), result.plane(0, c));
  }
  return result;
}

Gain light_over(const GridFrames& frames, int frame, const GridFrames& background, int reference,
                LightScratch* scratch) {
  return without_noise(gain_over(frames, frame, background, reference, scratch));
}

Gain light_between(const GridFrames& frames, int frame, const GridFrames& background, int reference,
                   const Gain& before, const Gain& after) {
  if (std::abs(std::log(brightness(after) / brightness(before))) < kStill) {
    Gain middle = before;
    for (size_t c = 0; c < kChannels; ++c) middle[c] = std::sqrt(before[c] * after[c]);
    return middle;
  }
  const float* const of_frame[3] = {frames.plane(frame, 0), frames.plane(frame, 1),
                                    frames.plane(frame, 2)};
  const float* const of_reference[3] = {background.plane(reference, 0),
                                        background.plane(reference, 1),
                                        background.plane(reference, 2)};
  const size_t cells = frames.cells();
  return agreement(of_frame, of_reference, cells, before) >=
                 agreement(of_frame, of_reference, cells, after)
             ? before
             : after;
}

namespace {

bool changes(const Gain& gain) { return std::abs(std::log(brightness(gain))) > kStill; }

// The mean over frames 0 .. count - 1 of the share of cells that agree with `reference`.
float mean_agreement(const GridFrames& frames, int count, const std::vector<Gain>& gains,
                     const GridFrames& reference) {
  const float* const of_reference[3] = {reference.plane(0, 0), reference.plane(0, 1),
                                        reference.plane(0, 2)};
  float sum = 0;
  for (int t = 0; t < count; ++t) {
    const float* const of_frame[3] = {frames.plane(t, 0), frames.plane(t, 1), frames.plane(t, 2)};
    sum += agreement(of_frame, of_reference, frames.cells(), gains[static_cast<size_t>(t)]);
  }
  return sum / static_cast<float>(count);
}

// The gain of each frame over their common background, once `gains` are about right: where that
// makes fewer of its cells agree, its gain stays.
void sharpen(const GridFrames& frames, int count, LightScratch* scratch, std::vector<Gain>* gains) {
  const GridFrames reference = median_frame(frames, count, *gains);
  const float* const of_reference[3] = {reference.plane(0, 0), reference.plane(0, 1),
                                        reference.plane(0, 2)};
  for (int t = 0; t < count; ++t) {
    const float* const of_frame[3] = {frames.plane(t, 0), frames.plane(t, 1), frames.plane(t, 2)};
    Gain& gain = (*gains)[static_cast<size_t>(t)];
    const Gain sharper = shared_gain(of_frame, of_reference, frames.cells(), scratch);
    if (agreement(of_frame, of_reference, frames.cells(), sharper) >
        agreement(of_frame, of_reference, frames.cells(), gain))
      gain = sharper;
  }
}

// What changes from each frame to the next, added up: most of a picture is the same in both, people
// included, even where no two frames far apart share much of the background.
std::vector<Gain> followed_light(const GridFrames& frames, int count, LightScratch* scratch) {
  std::vector<Gain> gains(static_cast<size_t>(count), kSameLight);
  for (int t = 1; t < count; ++t) {
    const float* const now[3] = {frames.plane(t, 0), frames.plane(t, 1), frames.plane(t, 2)};
    const float* const before[3] = {frames.plane(t - 1, 0), frames.plane(t - 1, 1),
                                    frames.plane(t - 1, 2)};
    const Gain step = shared_gain(now, before, frames.cells(), scratch);
    for (size_t c = 0; c < kChannels; ++c)
      gains[static_cast<size_t>(t)][c] =
          std::max(kLeastGain, gains[static_cast<size_t>(t) - 1][c] * step[c]);
  }
  return gains;
}

// Of each frame by itself, over the median of all.
std::vector<Gain> light_over_median(const GridFrames& frames, int count, LightScratch* scratch) {
  std::vector<Gain> gains(static_cast<size_t>(count), kSameLight);
  // The second reference is sharper where light changed.
  for (int round = 0; round < 2; ++round) {
    const GridFrames reference = median_frame(frames, count, gains);
    for (int t = 0; t < count; ++t)
      gains[static_cast<size_t>(t)] = gain_over(frames, t, reference, 0, scratch);
    if (std::none_of(gains.begin(), gains.end(), is_lit)) break;
  }
  return gains;
}

}  // namespace

std::vector<Gain> light_of(const GridFrames& frames, int count) {
  if (count < 2) return std::vector<Gain>(static_cast<size_t>(count), kSameLight);
  LightScratch scratch(frames.cells());
  std::vector<Gain> gains = light_over_median(frames, count, &scratch);
  const float agree = mean_agreement(frames, count, gains, median_frame(frames, count, gains));
  // Where nearly all agrees, nothing is left to be followed.
  if (agree < kAllAgree) {
    std::vector<Gain> followed = followed_light(frames, count, &scratch);
    if (std::any_of(followed.begin(), followed.end(), changes)) {
      sharpen(frames, count, &scratch, &followed);
      const float better =
          mean_agreement(frames, count, followed, median_frame(frames, count, followed));
      if (better > std::max(kLeastFollowed, agree + kFollowed)) gains = std::move(followed);
    }
  }
  if (std::any_of(gains.begin(), gains.end(), is_lit)) settle_light(&gains);
  return gains;
}

void settle_light(std::vector<Gain>* gains) {
  std::vector<float> logs;
  for (const Gain& gain : *gains) logs.push_back(std::log(brightness(gain)));
  std::vector<float> sorted = logs;
  const float main = median(&sorted);
  std::vector<size_t> near;
  for (size_t t = 0; t < logs.size(); ++t)
    if (std::abs(logs[t] - main) < kStill) near.push_back(t);
  if (2 * near.size() < logs.size()) return;
  Gain common = kSameLight;
  for (size_t c = 0; c < kChannels; ++c) {
    std::vector<float> levels;
    for (size_t t : near) levels.push_back((*gains)[t][c]);
    common[c] = median(&levels);
  }
  for (Gain& gain : *gains) {
    for (size_t c = 0; c < kChannels; ++c) gain[c] /= common[c];
    gain = without_noise(gain);
  }
}

}  // namespace qdmd
