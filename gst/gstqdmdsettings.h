// SPDX-License-Identifier: LGPL-2.1-or-later
// What an application asks of qdmdbackground, as GObject properties.
#pragma once

#include <gst/gst.h>

#include <bitset>

#include "core/engine/engine_options.h"
#include "core/engine/wishes.h"
#include "core/foreground/picture.h"
#include "core/objects/object.h"

namespace qdmd {

inline EngineOptions with_stabilize(Stabilize stabilize) {
  EngineOptions options;
  options.stabilize = stabilize;
  return options;
}

// Properties of these have ids below that.
inline constexpr guint kMostSettings = 128;

struct Settings {
  Output output = Output::background;
  bool post_messages = false, regions = false, object_messages = false, object_snapshots = false;
  int regions_min_area = 0;  // pixels
  int mask_scale = 0;        // EngineOptions::mask_scale; 0: chosen
  // Parts of the picture's height; seconds.
  double object_min_size = ObjectOptions().min_size;
  double object_appear_time = ObjectOptions().appear_seconds;
  double object_stop_time = ObjectOptions().stop_seconds;
  double object_gone_time = ObjectOptions().gone_seconds;
  double motion_end_time = ObjectOptions().grace_seconds;
  double time_budget = 0;      // milliseconds a frame; 0: no limit
  double absorb_time = 300;    // seconds; 0: never
  guint ignored_left_out = 0;  // rectangles that are none, or too many
  guint ignored_set = 0;       // how often they were set
  GQuark ignored_type = 0;     // of regions of interest that are ignored, too; 0: none
  EngineOptions engine = with_stabilize(Stabilize::translation);
  Wishes wishes;                     // what changes while playing
  std::bitset<kMostSettings> asked;  // what somebody has set, a bit for each id
};

enum class WhichSettings { all, without_output };
// Installs one property for each setting; their ids are from 1 on.
void install_settings(GObjectClass* klass, WhichSettings which);

// False where no setting has this id. The caller holds the lock that protects `settings`.
bool set_setting(Settings* settings, guint id, const GValue* value);
bool get_setting(const Settings& settings, guint id, GValue* value);

}  // namespace qdmd
