// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/robust/light.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/learn/robust/learning_steps.h"
#include "core/passes/agreement.h"
#include "core/passes/median_rows.h"

namespace qdmd {
namespace {

using namespace steps::light;

float median(std::vector<float>* values) {
  const auto middle = values->begin() + static_cast<ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  return *middle;
}

float gray(const float* const planes[3], size_t cell) {
  return (planes[0][cell] + planes[1][cell] + planes[2][cell]) / 3;
}

// The brightest channel of a cell.
float brightest(const float* const planes[3], size_t cell) {
  return std::max({planes[0][cell], planes[1][cell], planes[2][cell]});
}

// Share of cells where frame / gain and reference agree, of those that no sample at the end of its
// range says too little of.
float agreement(const float* const frame[3], const float* const reference[3], size_t cells,
                const Gain& gain) {
  const Agreement found =
      find_agreement(frame, reference, cells, gain.data(), kAtEnd, kChannels * kAgree);
  // Where all is white, nothing is known.
  return found.seen < kLeastRatios
             ? 1
             : static_cast<float>(found.agree) / static_cast<float>(found.seen);
}

// The share of cells with samples at the end of their range.
float share_at_end(const float* const frame[3], size_t cells) {
  size_t found = 0;
  for (size_t cell = 0; cell < cells; ++cell) found += brightest(frame, cell) >= kAtEnd;
  return static_cast<float>(found) / static_cast<float>(cells);
}

// The ratio that most cells share: the mode of the ratios' logarithms, refined by medians near it.
Gain shared_gain(const float* const frame[3], const float* const reference[3], size_t cells,
                 LightScratch* scratch) {
  constexpr int kBins = 300;
  constexpr float kLowest = -3;
  std::array<int, kBins + 4> histogram{};
  auto& ratios = scratch->ratios;
  ratios.clear();
  const auto see = [&](float f, float r, size_t cell, float bright) {
    if (f <= kDark || r <= kDark || f >= bright || r >= bright) return;
    const float ratio = std::log(f / r);
    ratios.emplace_back(ratio, cell);
    const int bin = static_cast<int>((ratio - kLowest) / kBin);
    if (bin >= 0 && bin < kBins) ++histogram[static_cast<size_t>(bin) + 2];
  };
  // Where samples are at the end of their range, other channels of a cell still say something.
  const bool clips = share_at_end(frame, cells) > kEnds || share_at_end(reference, cells) > kEnds;
  for (size_t cell = 0; cell < cells; ++cell) {
    if (!clips) {
      see(gray(frame, cell), gray(reference, cell), cell, kBright);
      continue;
    }
    for (size_t c = 0; c < kChannels; ++c) see(frame[c][cell], reference[c][cell], cell, kMeasured);
  }
  if (ratios.size() < kLeastRatios) return kSameLight;
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
      if (std::abs(ratio - mode) < kNear && reference[c][cell] > kDark &&
          !(clips && std::max(frame[c][cell], reference[c][cell]) >= kMeasured))
        near.push_back(frame[c][cell] / reference[c][cell]);
    // A channel that is dark everywhere: the light of the others.
    gain[c] = near.empty() ? std::exp(mode) : std::max(median(&near), kLeastGain);
  }
  if (!clips) return gain;
  // Of some channels few cells are left: where no colour is clear, all channels say it together.
  near.clear();
  for (const auto& [ratio, cell] : ratios)
    if (std::abs(ratio - mode) < kNear) near.push_back(std::exp(ratio));
  if (near.empty()) return gain;
  const float all = std::max(median(&near), kLeastGain);
  const bool tinted = std::any_of(gain.begin(), gain.end(), [all](float of_channel) {
    return kOfColour * std::abs(std::log(of_channel / all)) > kStill;
  });
  return tinted ? gain : Gain{all, all, all};
}

// The planes of one picture of cells.
struct CellPlanes {
  const float* of[kChannels];

  template <typename Pictures>
  CellPlanes(const Pictures& frames, int frame)
      : of{frames.plane(frame, 0), frames.plane(frame, 1), frames.plane(frame, 2)} {}
};

// before: the share that agrees in the same light.
Gain gain_over(const CellPlanes& frame, const CellPlanes& background, size_t cells, float before,
               LightScratch* scratch) {
  // What agrees needs no other light, and cannot gain enough.
  if (kGrowth * before + kShare >= 1) return kSameLight;
  const Gain gain = shared_gain(frame.of, background.of, cells, scratch);
  const float after = agreement(frame.of, background.of, cells, gain);
  return after > kGrowth * before + kShare ? gain : kSameLight;
}

Gain gain_over(const CellPlanes& frame, const CellPlanes& background, size_t cells,
               LightScratch* scratch) {
  return gain_over(frame, background, cells, agreement(frame.of, background.of, cells, kSameLight),
                   scratch);
}

float brightness(const Gain& gain) { return (gain[0] + gain[1] + gain[2]) / 3; }

// How far a light is from another one, a logarithm: of brightness, or of colours (white balance),
// which are measured less well.
float change(const Gain& gain, const Gain& from = kSameLight) {
  const float brighter = std::log(brightness(gain) / brightness(from));
  float most = std::abs(brighter);
  for (size_t c = 0; c < kChannels; ++c)
    most = std::max(most, kOfColour * std::abs(std::log(gain[c] / from[c]) - brighter));
  return most;
}

// 1 for small changes, with a soft edge.
Gain without_noise(const Gain& gain) {
  const float share = std::clamp(change(gain) / kStill - 1, 0.0f, 1.0f);
  if (share == 0) return kSameLight;
  Gain settled = gain;
  for (float& g : settled) g = std::exp(std::log(g) * share);
  return settled;
}

}  // namespace

Gain light_over(const GridFrames& frames, int frame, const GridFrames& background, int reference,
                LightScratch* scratch) {
  return without_noise(
      gain_over({frames, frame}, {background, reference}, frames.cells(), scratch));
}

Gain LightOfFrames::over(const GridFrames& frames, int frame, const GridFrames& background,
                         int reference) {
  const CellPlanes shown(frames, frame), of_background(background, reference);
  const size_t cells = frames.cells();
  const float before = agreement(shown.of, of_background.of, cells, kSameLight);
  if (before > agreed_ - kFollowed) {
    agreed_ = std::max(agreed_, before);
    return kSameLight;
  }
  const Gain gain = without_noise(gain_over(shown, of_background, cells, before, &scratch_));
  agreed_ = is_lit(gain) ? kUnknown : before;
  return gain;
}

Gain without_tint(const Gain& gain) {
  const float luma = luma_gain(gain);
  float most = 0;
  for (float of_channel : gain) most = std::max(most, std::abs(std::log(of_channel / luma)));
  const float share = std::clamp(kOfColour * most / kStill - 1, 0.0f, 1.0f);
  Gain found;
  for (size_t c = 0; c < kChannels; ++c) found[c] = luma * std::pow(gain[c] / luma, share);
  return found;
}

// True where a frame that is so many times as bright as another one has enough cells at the end of
// their range.
bool swings(float brighter, const float* const frame[3], size_t cells) {
  if (brighter <= kSwingsOfMany) return false;
  const float ends = share_at_end(frame, cells);
  return ends > kManyEnds || (ends > kEnds && brighter > kSwings);
}

bool at_end(const GridFrames& frames, int frame, const Gain& gain) {
  return swings(brightness(gain), CellPlanes(frames, frame).of, frames.cells());
}

Gain light_between(const GridFrames& frames, int frame, const GridFrames& background, int reference,
                   const Gain& before, const Gain& after) {
  if (change(after, before) < kStill) {
    Gain middle = before;
    for (size_t c = 0; c < kChannels; ++c) middle[c] = std::sqrt(before[c] * after[c]);
    return middle;
  }
  const CellPlanes of_frame(frames, frame), of_reference(background, reference);
  const size_t cells = frames.cells();
  return agreement(of_frame.of, of_reference.of, cells, before) >=
                 agreement(of_frame.of, of_reference.of, cells, after)
             ? before
             : after;
}

namespace {

// The numbers of the darkest frames, in time order.
std::vector<size_t> darkest(const std::vector<Gain>& gains) {
  std::vector<size_t> found(gains.size());
  std::iota(found.begin(), found.end(), size_t{0});
  std::stable_sort(found.begin(), found.end(),
                   [&](size_t a, size_t b) { return brightness(gains[a]) < brightness(gains[b]); });
  found.resize(most_darkest(found.size()));
  std::sort(found.begin(), found.end());
  return found;
}

bool changes(const Gain& gain) { return change(gain) > kStill; }

// Frames 0 .. count - 1 of some pictures, compared by the threads of a pool.
class FramesOfLight {
 public:
  FramesOfLight(const GridPictures& frames, int count, Pool* pool)
      : frames_(frames), count_(static_cast<size_t>(count)), pool_(pool), median_(cells(), 1) {
    for (size_t i = 0; i < (pool ? pool->threads() : 1); ++i) scratch_.emplace_back(cells());
  }

  // The gain of each frame by itself, over the median of all.
  std::vector<Gain> over_median() {
    std::vector<Gain> gains(count_, kSameLight);
    // The second reference is sharper where light changed.
    for (int round = 0; round < 2; ++round) {
      const CellPlanes reference(median(gains), 0);
      for_each(count_, [&](size_t t, size_t worker) {
        gains[t] = gain_over(planes(t), reference, cells(), &scratch_[worker]);
      });
      if (std::none_of(gains.begin(), gains.end(), is_lit)) break;
    }
    return gains;
  }

  // What changes from each frame to the next, added up: most of a picture is the same in both,
  // people included, even where no two frames far apart share much of the background. Leaves that
  // move before most of it share a ratio that says nothing.
  std::vector<Gain> followed() {
    std::vector<Gain> steps(count_, kSameLight);
    for_each(count_ - 1, [&](size_t t, size_t worker) {
      const Gain step = shared_gain(planes(t + 1).of, planes(t).of, cells(), &scratch_[worker]);
      if (agreement(planes(t + 1).of, planes(t).of, cells(), step) > kLeastFollowed)
        steps[t + 1] = step;
    });
    std::vector<Gain> gains(count_, kSameLight);
    for (size_t t = 1; t < count_; ++t)
      for (size_t c = 0; c < kChannels; ++c)
        gains[t][c] = std::max(kLeastGain, gains[t - 1][c] * steps[t][c]);
    return gains;
  }

  // The gain of each frame over their common background, once `gains` are about right: where that
  // makes fewer of its cells agree, its gain stays. A light that is far from it must explain as
  // much more as gain_over() asks.
  void sharpen(std::vector<Gain>* gains) {
    const CellPlanes reference(median(*gains), 0);
    for_each(count_, [&](size_t t, size_t worker) {
      Gain& gain = (*gains)[t];
      const Gain sharper = shared_gain(planes(t).of, reference.of, cells(), &scratch_[worker]);
      const float before = agreement(planes(t).of, reference.of, cells(), gain),
                  after = agreement(planes(t).of, reference.of, cells(), sharper);
      const bool is_far = change(sharper, gain) > std::log(kSwings);
      if (after > (is_far ? kGrowth * before + kShare : before)) gain = sharper;
    });
  }

  // The mean over the frames of the share of cells that agree with their median.
  float mean_agreement(const std::vector<Gain>& gains) {
    const CellPlanes reference(median(gains), 0);
    std::vector<float> agree(count_);
    for_each(count_, [&](size_t t, size_t) {
      agree[t] = agreement(planes(t).of, reference.of, cells(), gains[t]);
    });
    return std::accumulate(agree.begin(), agree.end(), 0.0f) / static_cast<float>(count_);
  }

  // Each cell's median over the frames (kMedianRows of them at most) in unit light.
  const GridFrames& median(const std::vector<Gain>& gains) {
    if (median_gains_ == gains) return median_;
    std::vector<size_t> all(count_);
    std::iota(all.begin(), all.end(), size_t{0});
    return median(gains, all);
  }
  // The same of these frames.
  const GridFrames& median(const std::vector<Gain>& gains, const std::vector<size_t>& of) {
    const size_t used = std::min<size_t>(of.size(), kMedianRows);
    constexpr size_t kTogether = 512;
    const size_t parts = (cells() + kTogether - 1) / kTogether;
    for_each(kChannels * parts, [&](size_t part, size_t) {
      const size_t c = part / parts, first = part % parts * kTogether;
      const float* rows[kMedianRows];
      float divisors[kMedianRows];
      for (size_t i = 0; i < used; ++i) {
        const size_t t = of[i * of.size() / used];
        rows[i] = planes(t).of[c] + first;
        divisors[i] = gains[t][c];
      }
      median_rows(rows, divisors, used, std::min(kTogether, cells() - first),
                  median_.plane(0, static_cast<int>(c)) + first);
    });
    median_gains_ = gains;
    return median_;
  }
  // darker: of the darkest frames.
  GridFrames take_median(const std::vector<Gain>& gains, bool darker) {
    if (darker)
      median(gains, darkest(gains));
    else
      median(gains);
    return std::move(median_);
  }

  // True where samples are at the end of their range while light changes.
  bool clips(const std::vector<Gain>& gains) {
    const auto [least, most] = std::minmax_element(
        gains.begin(), gains.end(),
        [](const Gain& a, const Gain& b) { return brightness(a) < brightness(b); });
    return swings(brightness(*most) / brightness(*least),
                  planes(static_cast<size_t>(most - gains.begin())).of, cells());
  }

 private:
  size_t cells() const { return frames_.cells(); }
  CellPlanes planes(size_t t) const { return {frames_, static_cast<int>(t)}; }
  template <typename Work>
  void for_each(size_t count, const Work& work) {
    if (pool_) {
      pool_->run(count, work);
    } else {
      for (size_t i = 0; i < count; ++i) work(i, size_t{0});
    }
  }

  const GridPictures& frames_;
  size_t count_;
  Pool* pool_;
  std::vector<LightScratch> scratch_;  // of the threads
  GridFrames median_;
  std::vector<Gain> median_gains_;  // with which it was made
};

// Makes gains those over the light of the darker frames.
void darken(std::vector<Gain>* gains) {
  std::vector<Gain> sorted = *gains;
  std::sort(sorted.begin(), sorted.end(),
            [](const Gain& a, const Gain& b) { return brightness(a) < brightness(b); });
  const float usual = brightness(sorted[sorted.size() / 2]);
  auto at = static_cast<size_t>(kDarker * static_cast<float>(sorted.size()));
  while (at < sorted.size() / 2 && brightness(sorted[at]) < kDarkest * usual) ++at;
  const Gain unit = sorted[at];
  for (Gain& gain : *gains)
    for (size_t c = 0; c < kChannels; ++c) gain[c] /= unit[c];
}

}  // namespace

WindowLight light_of(const GridPictures& frames, int count, Pool* pool, GridFrames* median) {
  FramesOfLight all(frames, count, pool);
  if (count < 2) {
    std::vector<Gain> same(static_cast<size_t>(count), kSameLight);
    if (median) *median = all.take_median(same, false);
    return {same, false};
  }
  std::vector<Gain> gains = all.over_median();
  const float agree = all.mean_agreement(gains);
  // Where nearly all agrees, nothing is left to be followed.
  if (agree < kAllAgree) {
    std::vector<Gain> followed = all.followed();
    if (std::any_of(followed.begin(), followed.end(), changes)) {
      all.sharpen(&followed);
      const float better = all.mean_agreement(followed);
      if (better > std::max(kLeastFollowed, agree + kFollowed)) gains = std::move(followed);
    }
  }
  const bool lit = std::any_of(gains.begin(), gains.end(), is_lit);
  const bool clips = lit && all.clips(gains);
  if (clips)
    darken(&gains);
  else if (lit)
    settle_light(&gains);
  if (median) *median = all.take_median(gains, clips);
  return {gains, clips};
}

uint64_t light_of_bytes(const Grid& grid, int threads) {
  return GridFrames::bytes(grid, 1) +
         static_cast<uint64_t>(threads) * LightScratch::bytes(grid.cells());
}

void settle_light(std::vector<Gain>* gains) {
  Gain main = kSameLight;
  std::vector<float> levels;
  for (size_t c = 0; c < kChannels; ++c) {
    levels.clear();
    for (const Gain& gain : *gains) levels.push_back(gain[c]);
    main[c] = median(&levels);
  }
  std::vector<size_t> near;
  for (size_t t = 0; t < gains->size(); ++t)
    if (change((*gains)[t], main) < kStill) near.push_back(t);
  if (2 * near.size() < gains->size()) return;
  Gain common = kSameLight;
  for (size_t c = 0; c < kChannels; ++c) {
    levels.clear();
    for (size_t t : near) levels.push_back((*gains)[t][c]);
    common[c] = median(&levels);
  }
  for (Gain& gain : *gains) {
    for (size_t c = 0; c < kChannels; ++c) gain[c] /= common[c];
    gain = without_noise(gain);
  }
}

}  // namespace qdmd
