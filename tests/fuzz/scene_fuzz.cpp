// SPDX-License-Identifier: LGPL-2.1-or-later
// Fuzz target: a scene's text is read, or refused with a sentence; what is read is drawn.
// cases/scene has each preset and effect to begin with: after 17 bytes that ask for a drawing comes
// its name.
#include <cmath>
#include <stdexcept>
#include <vector>

#include "core/scene/description.h"
#include "core/scene/scene.h"
#include "tests/fuzz/bytes.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace qdmd;

// A frame near the beginning, and one from anywhere.
void draw(const std::string& text, fuzz::Bytes choice) {
  scene::SceneOptions options;
  options.width = choice.from(1, 24);
  options.height = choice.from(1, 24);
  options.frames_per_second = choice.any_double();
  options.seed = choice.word();
  scene::Scene scene(options, text);
  QDMD_DEMAND(scene.length() >= 0);
  const int64_t far = int64_t{choice.word()} << choice.below(9);
  for (const int64_t index : {int64_t{choice.below(4)}, far}) {
    scene.render(index, scene::kFrame | scene::kTruth | scene::kLabels | scene::kBoxes);
    QDMD_DEMAND(std::isfinite(scene.shift_x()) && std::isfinite(scene.shift_y()) &&
                std::isfinite(scene.turn()));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  fuzz::Bytes bytes(data, size);
  // Most of the time would be spent with frames.
  const bool drawn = bytes.once_in(16);
  fuzz::Bytes choice = bytes;
  for (int i = 0; drawn && i < 16; ++i) bytes.byte();
  const std::string text = bytes.rest();
  try {
    const auto effects = scene::parse_scene(text);
    for (const auto& effect : effects) {
      QDMD_DEMAND(effect.info);
      for (double value : effect.values) QDMD_DEMAND(std::isfinite(value));
    }
    if (drawn) draw(text, choice);
  } catch (const std::invalid_argument& refused) {
    QDMD_DEMAND(refused.what()[0] != 0);
  }
  return 0;
}
