// SPDX-License-Identifier: LGPL-2.1-or-later
// One stretch of a recording through the element, into files.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "examples/archive/outputs.h"
#include "examples/archive/plan.h"

namespace qdmd::archive {

struct SeparationOptions {
  std::vector<std::string> recordings;
  std::vector<Wanted> wanted;
  std::map<std::string, std::string> properties;  // of the element
  int window = 0;
  double rate = 25;
  std::string encoder;
};

// Writes the parts of stretch `index` of the plan, and the pictures of its windows, and returns how
// many frames they have. at_work: called now and then, with the frames that were written so far.
// Throws std::runtime_error with a sentence for the user.
int64_t separate(const SeparationOptions& options, const Plan& plan, size_t index,
                 const std::function<void(int64_t)>& at_work);

}  // namespace qdmd::archive
