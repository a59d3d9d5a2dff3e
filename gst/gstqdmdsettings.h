// What an application asks of qdmdbackground, as GObject properties.
#pragma once

#include <gst/gst.h>

#include "core/base/ignored_areas.h"
#include "core/engine/engine_options.h"
#include "core/foreground/decision.h"
#include "core/foreground/picture.h"

namespace qdmd {

inline EngineOptions with_stabilize(Stabilize stabilize) {
  EngineOptions options;
  options.stabilize = stabilize;
  return options;
}

struct Settings {
  Output output = Output::background;
  Shadows shadows = Shadows::background;
  bool freeze = false, post_messages = false, regions = false, stabilize_output = false;
  int regions_min_area = 0;  // pixels
  double time_budget = 0;    // milliseconds a frame; 0: no limit
  double absorb_time = 300;  // seconds; 0: never
  IgnoredAreas ignored;
  guint ignored_left_out = 0;  // rectangles that are none, or too many
  GQuark ignored_type = 0;     // of regions of interest that are ignored, too; 0: none
  EngineOptions engine = with_stabilize(Stabilize::translation);
  guint asked = 0;  // what somebody has set, a bit for each id
};

enum class WhichSettings { all, without_output };
// Installs one property for each setting; their ids are 1 .. kFirstFreeProperty - 1.
void install_settings(GObjectClass* klass, WhichSettings which);
inline constexpr guint kFirstFreeProperty = 29;
static_assert(kFirstFreeProperty <= 32, "Settings::asked has a bit for each");

// False where no setting has this id. The caller holds the lock that protects `settings`.
bool set_setting(Settings* settings, guint id, const GValue* value);
bool get_setting(const Settings& settings, guint id, GValue* value);

}  // namespace qdmd
