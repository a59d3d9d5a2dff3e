// SPDX-License-Identifier: LGPL-2.1-or-later
// The enumerations of qdmdbackground's properties, with the texts that gst-inspect shows.
#pragma once

#include <gst/gst.h>

#include "core/learn/method.h"

// Values of `output`, `shadows`, `mode`, `method`, `amplitude` and `solver` are those of the core's
// enumerations.
GType gst_qdmd_background_output_get_type();
GType gst_qdmd_background_shadows_get_type();
GType gst_qdmd_background_stabilize_get_type();
GType gst_qdmd_background_method_get_type();
GType gst_qdmd_background_amplitude_get_type();
GType gst_qdmd_background_solver_get_type();
GType gst_qdmd_background_estimator_get_type();
GType gst_qdmd_background_mode_get_type();

namespace qdmd {

// As users write it.
const char* method_name(Method method);

}  // namespace qdmd
