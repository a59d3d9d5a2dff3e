// SPDX-License-Identifier: LGPL-2.1-or-later
// The light in which a window's start looks at what it compares.
#include <algorithm>
#include <array>
#include <vector>

#include "core/learn/robust/window_solve.h"

namespace qdmd {

// Frames that something disturbs have the light of those before them; black ones are the scene in
// no light.
void WindowSolve::carry_gains() {
  if (shown_.empty()) return;
  size_t at = 0;
  for (size_t t = 0; t < gains_.size(); ++t) {
    while (at + 1 < shown_.size() && static_cast<size_t>(shown_[at + 1]) <= t) ++at;
    const auto from = static_cast<size_t>(shown_[at]);
    if (from != t && is_black(window_->snapshots.slot(static_cast<int>(t))))
      gains_[t].fill(steps::light::kLeastGain);
    else
      gains_[t] = gains_[from];
  }
}

// The gain of the earlier picture over these frames' median.
Gain WindowSolve::light_of_earlier(const EarlierWindow& earlier, const GridFrames& here) const {
  LightScratch scratch(context_.grid.cells());
  return context_.of_format(light_over(earlier.cells(), 0, here, 0, &scratch));
}

// True where the brighter one of the earlier picture and these frames' median has samples at the
// end of their range.
bool WindowSolve::has_ends(const EarlierWindow& earlier, const Gain& of_earlier,
                           const GridFrames& here) const {
  const Gain brighter = {1 / of_earlier[0], 1 / of_earlier[1], 1 / of_earlier[2]};
  return at_end(here, 0, brighter) || at_end(earlier.cells(), 0, of_earlier);
}

// A darker picture of earlier windows knows more than samples at the end of their range: unit
// light becomes its light, and `here` is what it shows where these frames say only "at least".
// gain: its light, over `here`.
void WindowSolve::take_unit_of(const GridFrames& earlier, const Gain& gain, GridFrames* here) {
  const size_t cells = context_.grid.cells();
  const bool darker = gain[0] < 1 && gain[1] < 1 && gain[2] < 1;
  for (size_t c = 0; c < kChannels; ++c) {
    const float unit = darker ? std::max(gain[c], steps::light::kDarkest) : 1;
    for (Gain& of_frame : gains_) of_frame[c] /= unit;
    float darkest = shown_.empty() ? gains_[0][c] : gains_[static_cast<size_t>(shown_[0])][c];
    for (const int t : shown_) darkest = std::min(darkest, gains_[static_cast<size_t>(t)][c]);
    float* const levels = here->plane(0, static_cast<int>(c));
    const float* const known = earlier.plane(0, static_cast<int>(c));
    for (size_t cell = 0; cell < cells; ++cell) {
      levels[cell] *= unit;
      const bool at_end = levels[cell] * darkest >= steps::light::kNearEnd;
      if (at_end) levels[cell] = std::max(levels[cell], known[cell] * unit / gain[c]);
    }
  }
}

// Writes a frame's cells in unit light, as far as `median` says what clipped samples hide.
void WindowSolve::unclip(const float* shown, const GridFrames& median, const Gain& gain,
                         float* out) const {
  const size_t cells = context_.grid.cells();
  for (size_t cell = 0; cell < cells; ++cell) {
    const auto found = unclipped(
        {shown[cell], shown[cells + cell], shown[2 * cells + cell]},
        {median.plane(0, 0)[cell], median.plane(0, 1)[cell], median.plane(0, 2)[cell]}, gain);
    for (size_t c = 0; c < kChannels; ++c) out[c * cells + cell] = found[c] / gain[c];
  }
}

// Frames in which a cell's samples may be at the end of their range say nothing of its
// background. Where all that show it are such, darker ones that may show the same say it;
// else the darkest do. chosen: the looks in unit light.
void WindowSolve::prefer_darker(const Looks& looks, const GridPictures& chosen) {
  using steps::light::kAtEnd, steps::light::kNearEnd;
  const size_t cells = context_.grid.cells();
  std::vector<std::pair<float, uint16_t>> shown, darker;
  std::vector<uint8_t> keeps(looks.pictures.size()), shows;
  const auto level = [&](size_t frame, size_t cell) -> std::array<float, kChannels> {
    const float* const of = looks.cells[frame];
    return {of[cell], of[cells + cell], of[2 * cells + cell]};
  };
  // What most dark frames show.
  const auto shows_median = [&](size_t frame, size_t cell) {
    float apart = 0;
    for (int c = 0; c < kChannels; ++c)
      apart +=
          std::abs(chosen.plane(static_cast<int>(frame), c)[cell] - looks.median.plane(0, c)[cell]);
    return apart < kChannels * steps::light::kNearMedian;
  };
  // With what is cut off.
  const auto brightest = [&](size_t frame, size_t cell) {
    const auto of = level(frame, cell);
    float most = std::max({of[0], of[1], of[2]});
    if (!shows_median(frame, cell)) return most;
    for (int c = 0; c < kChannels; ++c)
      most = std::max(most, looks.median.plane(0, c)[cell] *
                                looks.pictures[frame].gain[static_cast<size_t>(c)]);
    return most;
  };
  // What frame `dark` shows could be what frame `bright` does, too.
  const auto explains = [&](size_t dark, size_t bright, size_t cell) {
    const int at = static_cast<int>(dark);
    return shows_median(dark, cell) &&
           may_show(
               level(bright, cell),
               {chosen.plane(at, 0)[cell], chosen.plane(at, 1)[cell], chosen.plane(at, 2)[cell]},
               looks.pictures[bright].gain);
  };
  for (size_t cell = 0; cell < stable_.of_cell.size(); ++cell) {
    shown.clear();
    for (const uint16_t frame : stable_.of_cell[cell])
      shown.emplace_back(brightest(frame, cell), frame);
    std::sort(shown.begin(), shown.end());
    std::fill(keeps.begin(), keeps.end(), uint8_t{0});
    if (shown.empty() || shown.back().first < kAtEnd) continue;
    if (shown.front().first >= kNearEnd) {
      darker.clear();
      for (size_t frame = 0; frame < keeps.size(); ++frame)
        if (brightest(frame, cell) < shown.front().first &&
            explains(frame, shown.front().second, cell))
          darker.emplace_back(brightest(frame, cell), static_cast<uint16_t>(frame));
      std::sort(darker.begin(), darker.end());
      if (!darker.empty()) shown.swap(darker);
    }
    const bool any = shown.front().first < kNearEnd;
    if (!any) {
      for (auto& [key, frame] : shown) key = luma_gain(looks.pictures[frame].gain);
      std::sort(shown.begin(), shown.end());
    }
    // What is darker says more, if only by some percent.
    const float most = any ? kNearEnd : shown.front().first * (1 + steps::light::kStill);
    const size_t count = any ? shown.size() : most_darkest(shown.size());
    for (size_t i = 0; i < count; ++i) keeps[shown[i].second] = shown[i].first < most;
    // All of them have shown it.
    shows = keeps;
    for (const uint16_t frame : stable_.of_cell[cell]) shows[frame] = 1;
    stable_.of_cell.take(cell, [&](size_t frame) { return frame < shows.size() && shows[frame]; });
    stable_.of_cell.choose(cell, [&](size_t frame) { return keeps[frame] != 0; });
  }
}

void WindowSolve::find_curves(Looks* looks) const {
  const GridFrames& here = looks->median;
  const float* const unit[kChannels] = {here.plane(0, 0), here.plane(0, 1), here.plane(0, 2)};
  looks->curves.resize(looks->pictures.size());
  for (size_t i = 0; i < looks->curves.size(); ++i)
    if (is_lit(looks->pictures[i].gain))
      looks->curves[i] = LightCurve::between(looks->cells[i], looks->pictures[i].gain, unit,
                                             context_.grid.cells(), context_.one_gain());
}

// A place keeps those of its looks that a curve carries into unit light, or the others:
// those that are more. A median of both is in neither.
void WindowSolve::choose_curves(const Looks& looks) {
  const auto is_bent = [&](uint16_t look) { return !looks.curves[look].none(); };
  std::vector<uint8_t> keeps(looks.curves.size());
  for (size_t cell = 0; cell < stable_.of_cell.size(); ++cell) {
    const auto chosen = stable_.of_cell[cell];
    const auto bent = std::count_if(chosen.begin(), chosen.end(), is_bent);
    if (bent == 0 || bent == std::ssize(chosen)) continue;
    std::fill(keeps.begin(), keeps.end(), uint8_t{0});
    const bool most = 2 * bent > std::ssize(chosen);
    for (const uint16_t look : chosen) keeps[look] = is_bent(look) == most;
    stable_.of_cell.choose(cell, [&](uint16_t look) { return keeps[look] != 0; });
  }
}

// Adds to the background of each place what the curves of its looks say.
void WindowSolve::follow_curves(const Looks& looks) {
  for (size_t cell = 0; cell < stable_.of_cell.size(); ++cell) {
    LightCurve mean;
    for (const uint16_t look : stable_.of_cell[cell]) mean.add(looks.curves[look]);
    if (mean.none()) continue;
    mean.divide(stable_.of_cell[cell].size());
    bend(cell, mean);
  }
}

// Of Y, U and V, Y has the curve.
void WindowSolve::bend(size_t cell, const LightCurve& curve) {
  const Grid& grid = context_.grid;
  const int row = static_cast<int>(cell) / grid.cols, col = static_cast<int>(cell) % grid.cols;
  const Levels& levels = context_.options.levels;
  for (size_t c = 0; c < (context_.one_gain() ? 1 : kChannels); ++c) {
    const auto black = static_cast<float>(levels.black[c]),
               unit = static_cast<float>(levels.white[c] - levels.black[c]) / 255;
    for (int y = grid.top(row); y < grid.top(row + 1); ++y) {
      uint8_t* const samples =
          reference_.level[c].data() + static_cast<size_t>(y) * static_cast<size_t>(grid.width);
      for (int x = grid.left(col); x < grid.left(col + 1); ++x) {
        const float level = (static_cast<float>(samples[x]) - black) / unit;
        const float bent = black + unit * (level + curve.at(c, level));
        samples[x] = static_cast<uint8_t>(std::clamp(bent + 0.5f, 0.0f, 255.0f));
      }
    }
  }
}

}  // namespace qdmd
