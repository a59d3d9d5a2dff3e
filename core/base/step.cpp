// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/base/step.h"

#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

namespace qdmd {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  std::fprintf(stderr, "QDMD_STEPS: %s\n", what.c_str());
  std::_Exit(1);
}

struct Steps {
  struct Value {
    double value;
    bool is_read;
  };
  std::map<std::string, Value, std::less<>> all;

  Steps() {
    const char* const set = std::getenv("QDMD_STEPS");
    std::string text = set ? set : "";
    while (!text.empty()) {
      const std::string one = text.substr(0, text.find(','));
      text.erase(0, one.size() + 1);
      const size_t equals = one.find('=');
      if (equals == std::string::npos) refuse("there is no '=' in " + one);
      char* end = nullptr;
      const double value = std::strtod(one.c_str() + equals + 1, &end);
      if (end == one.c_str() + equals + 1 || *end != 0) refuse("there is no number in " + one);
      all[one.substr(0, equals)] = {value, false};
    }
  }
};

// Other files read steps before they get to main().
Steps& steps() {
  static Steps steps;
  return steps;
}

}  // namespace

double adjusted(const char* name, double value) {
  const auto found = steps().all.find(std::string_view(name));
  if (found == steps().all.end()) return value;
  found->second.is_read = true;
  return found->second.value;
}

void check_steps() {
  for (const auto& [name, value] : steps().all)
    if (!value.is_read) refuse("there is no step " + name);
}

}  // namespace qdmd
