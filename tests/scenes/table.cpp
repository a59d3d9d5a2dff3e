// Prints the reference of scenes for docs/scenes.md, from the descriptions that the parser uses.
#include <cstdio>

#include "core/scene/description.h"

namespace {

using namespace qdmd::scene;

void print_picture(const char* name) { std::printf("\n![%s](images/scenes/%s.jpg)\n", name, name); }

void print_effect(const EffectInfo& info) {
  std::printf("\n### %s\n\n%s.\n\n", info.name, info.description);
  std::printf("| parameter | unit | default | range | meaning |\n|---|---|---|---|---|\n");
  for (const Parameter& parameter : info.parameters)
    std::printf("| `%s` | %s | %g | %g to %g%s | %s |\n", parameter.name, parameter.unit,
                parameter.standard, parameter.minimum, parameter.maximum,
                parameter.whole ? ", whole" : "", parameter.description);
  print_picture(info.name);
}

}  // namespace

int main() {
  std::printf("## Presets\n");
  for (const Preset& preset : presets()) {
    std::printf("\n### %s\n\n%s. Effects: %s.\n", preset.name, preset.intent,
                *preset.effects ? (std::string("`") + preset.effects + "`").c_str() : "none");
    print_picture(preset.name);
  }
  std::printf("\n## Effects\n");
  for (const EffectInfo* info : effects()) print_effect(*info);
  return 0;
}
