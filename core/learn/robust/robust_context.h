// SPDX-License-Identifier: LGPL-2.1-or-later
// What all parts of the robust learner know: its options, and where it works.
#pragma once

#include "core/learn/learner.h"
#include "core/learn/robust/learning_steps.h"
#include "core/learn/robust/light.h"
#include "core/passes/grid.h"
#include "core/passes/mask.h"
#include "core/passes/sampling.h"

namespace qdmd {

struct RobustContext {
  LearnOptions options;
  RobustParameters parameters;
  Grid grid;
  int finest_step = 1, step = 1;
  LearnerRoom room = {};
  RgbColours rgb = {options.colours, options.levels};

  // What is kept of each frame.
  FrameContents contents() const {
    FrameContents contents = {1, parameters.cells_along, 1, 1, options.depth, 0, rgb};
    if (options.keeps_shared()) {
      contents.chroma_columns = options.chroma_columns;
      contents.chroma_rows = options.chroma_rows;
    }
    return contents;
  }
  // The shape of kept frames.
  ChromaShape shape() const {
    const FrameContents of = contents();
    return {grid.width, grid.height, of.chroma_columns, of.chroma_rows};
  }
  // Of Y, U and V one gain is refined, that of luma.
  bool one_gain() const { return options.colours == Colours::yuv; }
  // Light as samples can show it: colours of Y, U and V that change little are those of noise.
  Gain of_format(const Gain& gain) const { return one_gain() ? without_tint(gain) : gain; }
  // What light may make of samples.
  SampleRange range() const { return rgb.range(options.levels); }
  // Samples from here on may be at the end of their range. Chroma has no such end: black.
  int end_of_range(size_t channel) const {
    const Levels& of = options.levels;
    const auto range = static_cast<float>(of.white[channel] - of.black[channel]);
    return of.black[channel] + static_cast<int>(range * steps::light::kBright / 255);
  }
  // The cells of a picture's planes.
  void find_cells(const uint8_t* const plane[kChannels], GridFrames* cells, int frame) const {
    for (int c = 0; c < kChannels; ++c) cell_means(grid, plane[c], cells->plane(frame, c));
    rgb.convert(cells->cells(), cells->channels(frame).data());
  }
  size_t pixels() const {
    return static_cast<size_t>(grid.width) * static_cast<size_t>(grid.height);
  }
  size_t samples_at(int of_step) const { return sample_count(grid.width, grid.height, of_step); }
  SampledRows sampled_rows() const { return {0, grid.height, step}; }
  // Windows that know nothing of each other are given nothing of each other.
  bool follows(Models models) const {
    return models == Models::two_of_live || parameters.earlier_share > 0;
  }
};

}  // namespace qdmd
