// SPDX-License-Identifier: LGPL-2.1-or-later
// Prints the reference of scenes for docs/scenes.md, from the descriptions that the parser uses.
#include <cstdio>

#include "core/scene/description.h"

namespace {

using namespace qdmd::scene;

// A row's first cell: name, what is to be seen, and the picture of it.
void begin_row(const char* name, const char* text) {
  std::printf("| **`%s`**<br>%s.<br>![%s](images/scenes/%s.jpg) | ", name, text, name, name);
}

void print_effect(const EffectInfo& info) {
  begin_row(info.name, info.description);
  const char* between = "";
  for (const Parameter& parameter : info.parameters) {
    std::printf("%s`%s` %g %s (%g to %g%s): %s", between, parameter.name, parameter.standard,
                parameter.unit, parameter.minimum, parameter.maximum,
                parameter.whole ? ", whole" : "", parameter.description);
    between = "<br>";
  }
  std::printf(" |\n");
}

}  // namespace

int main() {
  std::printf("## Presets\n\n| preset | its effects |\n|---|---|\n");
  for (const Preset& preset : presets()) {
    begin_row(preset.name, preset.intent);
    std::printf("%s |\n",
                *preset.effects ? (std::string("`") + preset.effects + "`").c_str() : "none");
  }
  std::printf(
      "\n## Effects\n\n| effect | parameter, default, unit (range): meaning |\n|---|---|\n");
  for (const EffectInfo* info : effects()) print_effect(*info);
  return 0;
}
