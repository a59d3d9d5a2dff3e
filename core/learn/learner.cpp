// SPDX-License-Identifier: LGPL-2.1-or-later
#include "core/learn/learner.h"

#include "core/learn/gram_learner.h"
#include "core/learn/robust/robust_learner.h"

namespace qdmd {

std::unique_ptr<Learner> Learner::make(const LearnOptions& options, int width, int height) {
  const RobustParameters parameters;  // That reads its steps.
  check_steps();
  if (options.method == Method::robust)
    return std::make_unique<RobustLearner>(options, width, height, parameters);
  return std::make_unique<GramLearner>(options, width, height);
}

std::span<const char* const> options_without_effect(Method method) {
  static constexpr const char* kOfQdmd[] = {"iterations", "absorb-time"};
  static constexpr const char* kOfDmd[] = {"iterations", "solver", "estimator", "spectrum",
                                           "absorb-time"};
  // What the paper fits to the first frame depends on what stood there.
  static constexpr const char* kOfRobust[] = {"amplitude"};
  switch (method) {
    case Method::qdmd:
      return kOfQdmd;
    case Method::dmd:
      return kOfDmd;
    case Method::robust:
      break;
  }
  return kOfRobust;
}

}  // namespace qdmd
