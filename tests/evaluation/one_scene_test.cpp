// SPDX-License-Identifier: LGPL-2.1-or-later
// Real sequences of one scene: nothing that happens in front of it is taken for another one.
#include <gtest/gtest.h>

#include <cstdlib>

#include "core/engine/engine.h"
#include "tests/evaluation/clip.h"
#include "tests/evaluation/dataset.h"

namespace qdmd::test {
namespace {

using namespace qdmd::evaluation;

// QDMD_DATA is the folder with SBI, SBMnet and CDnet; without it the test is skipped.
TEST(OneScene, IsOneInAllSequences) {
  const char* data = std::getenv("QDMD_DATA");
  if (!data || !*data) GTEST_SKIP() << "QDMD_DATA is not set";
  size_t sequences = 0;
  for (const Sequence& sequence : find_sequences(data)) {
    ++sequences;
    Selection selection;
    selection.frames = 400;
    const LabelledClip clip = read_clip(sequence, selection);
    for (Mode mode : {Mode::batch, Mode::live}) {
      Engine engine;
      EngineOptions options;
      options.mode = mode;
      ASSERT_TRUE(engine.configure(options, clip.frames[0].cols, clip.frames[0].rows).ok());
      cv::Mat picture(clip.frames[0].size(), CV_8UC3);
      for (const cv::Mat& frame : clip.frames) {
        ASSERT_TRUE(engine.push(view_of(frame)).ok());
        while (engine.next()) engine.next()->pop(Output::background, view_of(picture));
      }
      EXPECT_EQ(engine.report().scenes, 0u)
          << sequence.name << (mode == Mode::live ? " live" : " batch");
    }
  }
  EXPECT_GT(sequences, 0u);
}

}  // namespace
}  // namespace qdmd::test
