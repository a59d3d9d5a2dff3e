// SPDX-License-Identifier: LGPL-2.1-or-later
// The core without GStreamer's data flow: faster, the same pictures.
#pragma once

#include "tests/evaluation/element.h"
#include "tests/evaluation/method.h"

namespace qdmd::evaluation {

// One method for each value of the element's property `method`. An element that never plays reads
// the properties, so that values and defaults are its own. Throws std::invalid_argument where a
// property is set that the engine does not have.
Methods engine_methods(const ElementOptions& options);

}  // namespace qdmd::evaluation
