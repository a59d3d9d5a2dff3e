// What all parts of the robust learner know: its options, and where it works.
#pragma once

#include "core/learn/learner.h"
#include "core/learn/robust/learning_steps.h"
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

  // What is kept of each frame.
  FrameContents contents() const {
    FrameContents contents = {1, parameters.cells_along, 1, 1, options.depth};
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
