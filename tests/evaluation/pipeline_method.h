// SPDX-License-Identifier: LGPL-2.1-or-later
// The element as users get it: appsrc ! qdmdbackground ! appsink.
#pragma once

#include "tests/evaluation/element.h"
#include "tests/evaluation/method.h"

namespace qdmd::evaluation {

// One method for each value of the property `method`. Masks are a second run with output=mask,
// which `seconds` does not count.
Methods pipeline_methods(const ElementOptions& options);

}  // namespace qdmd::evaluation
