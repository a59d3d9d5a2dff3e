// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gst/gstqdmdsettings.h"

#include <cstring>
#include <iterator>

#include "core/passes/soft_edge.h"
#include "gst/gstqdmdareas.h"
#include "gst/gstqdmdenums.h"

namespace qdmd {
namespace {

constexpr auto kAtStart =
    GParamFlags(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_READY);
constexpr auto kAnyTime =
    GParamFlags(G_PARAM_READWRITE | G_PARAM_STATIC_STRINGS | GST_PARAM_MUTABLE_PLAYING);
constexpr auto kControllable = GParamFlags(kAnyTime | GST_PARAM_CONTROLLABLE);

struct Property {
  GParamSpec* (*spec)(const Settings& defaults);
  void (*set)(Settings& settings, const GValue* value);
  void (*get)(const Settings& settings, GValue* value);
};

// Access to one member, given as an lvalue in terms of `s`.
#define QDMD_ENUM(member)                                                               \
  [](Settings& s, const GValue* v) { member = decltype(member)(g_value_get_enum(v)); }, \
      [](const Settings& s, GValue* v) { g_value_set_enum(v, gint(member)); }
#define QDMD_UINT(member)                                                  \
  [](Settings& s, const GValue* v) { member = int(g_value_get_uint(v)); }, \
      [](const Settings& s, GValue* v) { g_value_set_uint(v, guint(member)); }
#define QDMD_BOOLEAN(member)                                             \
  [](Settings& s, const GValue* v) { member = g_value_get_boolean(v); }, \
      [](const Settings& s, GValue* v) { g_value_set_boolean(v, member); }
#define QDMD_DOUBLE(member)                                             \
  [](Settings& s, const GValue* v) { member = g_value_get_double(v); }, \
      [](const Settings& s, GValue* v) { g_value_set_double(v, member); }

const Property kProperties[] = {
    {[](const Settings& d) {
       return g_param_spec_enum("output", "Output", "What is sent on in place of each frame",
                                gst_qdmd_background_output_get_type(), gint(d.output),
                                kControllable);
     },
     QDMD_ENUM(s.output)},
    {[](const Settings& d) {
       return g_param_spec_enum("mode", "Mode", "When a model is computed and for which frames",
                                gst_qdmd_background_mode_get_type(), gint(d.engine.mode), kAtStart);
     },
     QDMD_ENUM(s.engine.mode)},
    {[](const Settings& d) {
       return g_param_spec_uint("window-size", "Window size",
                                "Frames that are decomposed together. More frames separate slow "
                                "movers better. They cost memory (3 bytes per pixel and frame, 1.5 "
                                "in 4:2:0), time and, in mode=batch, latency",
                                guint(EngineOptions::kMinWindow), guint(EngineOptions::kMaxWindow),
                                guint(d.engine.window_size), kAtStart);
     },
     QDMD_UINT(s.engine.window_size)},
    {[](const Settings& d) {
       return g_param_spec_uint(
           "hop-size", "Hop size",
           "Frames between solves in mode=live, at most window-size (0: a quarter of it). While "
           "the background does not change, method=robust leaves out up to three of four solves",
           0, guint(EngineOptions::kMaxWindow), guint(d.engine.hop_size), kAtStart);
     },
     QDMD_UINT(s.engine.hop_size)},
    {[](const Settings& d) {
       return g_param_spec_enum("method", "Method", "How a window is decomposed",
                                gst_qdmd_background_method_get_type(), gint(d.engine.method),
                                kAtStart);
     },
     QDMD_ENUM(s.engine.method)},
    {[](const Settings& d) {
       return g_param_spec_uint("rank", "Rank",
                                "Singular values that the decomposition keeps (0: all for qdmd and "
                                "dmd, 1 for robust)",
                                0, guint(EngineOptions::kMaxWindow), guint(d.engine.dmd.rank),
                                kAtStart);
     },
     QDMD_UINT(s.engine.dmd.rank)},
    {[](const Settings& d) {
       return g_param_spec_double("omega-threshold", "Omega threshold",
                                  "Modes whose frequency and growth, abs(omega) in rad/frame, are "
                                  "at most this are background (0: only the one nearest zero)",
                                  0, G_MAXDOUBLE, d.engine.dmd.omega_threshold, kAtStart);
     },
     QDMD_DOUBLE(s.engine.dmd.omega_threshold)},
    {[](const Settings& d) {
       return g_param_spec_enum(
           "amplitude", "Amplitude",
           "Which frames decide how strong the background mode is (not used by method=robust: "
           "always all of them)",
           gst_qdmd_background_amplitude_get_type(), gint(d.engine.dmd.amplitude), kAtStart);
     },
     QDMD_ENUM(s.engine.dmd.amplitude)},
    {[](const Settings& d) {
       return g_param_spec_enum(
           "solver", "Solver",
           "How the decomposition of method=qdmd and robust is computed. All give the same picture "
           "at "
           "another cost. If a solver finds no result, a more careful one takes over (not used by "
           "method=dmd)",
           gst_qdmd_background_solver_get_type(), gint(d.engine.dmd.solver), kAtStart);
     },
     QDMD_ENUM(s.engine.dmd.solver)},
    {[](const Settings& d) {
       return g_param_spec_enum(
           "estimator", "Estimator",
           "How eigenvalues are estimated from frames with noise (not used by method=dmd). "
           "forward-backward and total take rank=0 for 1, since at full rank they change nothing",
           gst_qdmd_background_estimator_get_type(), gint(d.engine.dmd.estimator), kAtStart);
     },
     QDMD_ENUM(s.engine.dmd.estimator)},
    {[](const Settings& d) {
       return g_param_spec_boolean(
           "spectrum", "Spectrum",
           "Messages and stats have all eigenvalues of a solve, their amplitudes and which are "
           "background. It costs a decomposition with all modes (not used by method=dmd)",
           d.engine.dmd.spectrum, kAtStart);
     },
     QDMD_BOOLEAN(s.engine.dmd.spectrum)},
    {[](const Settings& d) {
       return g_param_spec_uint(
           "sample-step", "Sample step",
           "The decomposition sees every k-th pixel in x and y, and the output stays full size (0: "
           "all pixels for qdmd and dmd, about 60 along the short side for robust)",
           0, guint(EngineOptions::kMaxSampleStep), guint(d.engine.sample_step), kAtStart);
     },
     QDMD_UINT(s.engine.sample_step)},
    {[](const Settings& d) {
       return g_param_spec_uint("iterations", "Iterations",
                                "How often method=robust takes out the foreground and decomposes "
                                "what is left (not used by qdmd and dmd)",
                                1, guint(EngineOptions::kMaxIterations), guint(d.engine.iterations),
                                kAtStart);
     },
     QDMD_UINT(s.engine.iterations)},
    {[](const Settings& d) {
       return g_param_spec_double(
           "foreground-threshold", "Foreground threshold",
           "A pixel is foreground if it is farther than this from the background: the length of "
           "the RGB difference in grey levels. 0: from the noise of the window, for robust of each "
           "pixel, at least 18",
           0, 442, d.wishes.foreground_threshold, kControllable);
     },
     QDMD_DOUBLE(s.wishes.foreground_threshold)},
    {[](const Settings& d) {
       return g_param_spec_uint64(
           "max-memory", "Maximum memory",
           "Most bytes that the window and its models may take. If they need "
           "more, the element stops with an error that names the size needed",
           0, G_MAXUINT64, d.engine.max_memory, kAtStart);
     },
     [](Settings& s, const GValue* v) { s.engine.max_memory = g_value_get_uint64(v); },
     [](const Settings& s, GValue* v) { g_value_set_uint64(v, s.engine.max_memory); }},
    {[](const Settings&) {
       return g_param_spec_string(
           "window-on-disk", "Window on disk",
           "A folder: the frames of the window lie in a file there, which has no name and goes "
           "when the element stops, and do not count against max-memory (empty: in memory). For "
           "windows that are larger than the machine's memory",
           nullptr, kAtStart);
     },
     [](Settings& s, const GValue* v) {
       const gchar* folder = g_value_get_string(v);
       s.engine.window_on_disk = folder ? folder : "";
     },
     [](const Settings& s, GValue* v) {
       g_value_set_string(
           v, s.engine.window_on_disk.empty() ? nullptr : s.engine.window_on_disk.c_str());
     }},
    {[](const Settings& d) {
       return g_param_spec_uint("n-threads", "Number of threads",
                                "Threads that work on a window (0: one for each core); the "
                                "pictures are the same for any number",
                                0, guint(EngineOptions::kMaxThreads), guint(d.wishes.threads),
                                kAnyTime);
     },
     QDMD_UINT(s.wishes.threads)},
    {[](const Settings& d) {
       return g_param_spec_boolean("freeze", "Freeze",
                                   "Keep the background as it is and do not solve. If there is no "
                                   "model yet, one is made first (mode=batch: from the next window "
                                   "on)",
                                   d.wishes.freeze, kControllable);
     },
     QDMD_BOOLEAN(s.wishes.freeze)},
    {[](const Settings& d) {
       return g_param_spec_boolean("post-messages", "Post messages",
                                   "Post an element message `qdmdbackground` for each solve",
                                   d.post_messages, kAnyTime);
     },
     QDMD_BOOLEAN(s.post_messages)},
    {[](const Settings& d) {
       return g_param_spec_boolean("regions", "Regions",
                                   "Attach a GstVideoRegionOfInterestMeta of type `foreground` to "
                                   "each output buffer for each region of foreground; its id is "
                                   "the same from frame to frame",
                                   d.regions, kAnyTime);
     },
     QDMD_BOOLEAN(s.regions)},
    {[](const Settings& d) {
       return g_param_spec_uint("regions-min-area", "Least area of regions",
                                "Pixels of foreground that a region has at least (0: 1/2000 of "
                                "the picture, at least 4)",
                                0, G_MAXINT, guint(d.regions_min_area), kAnyTime);
     },
     QDMD_UINT(s.regions_min_area)},
    {[](const Settings& d) {
       return g_param_spec_double(
           "time-budget", "Time budget",
           "Milliseconds that a frame may take on average (0: no limit). If more would be needed, "
           "the element solves more rarely, and method=robust looks at fewer samples",
           0, 1e6, d.time_budget, kAnyTime);
     },
     QDMD_DOUBLE(s.time_budget)},
    {[](const Settings& d) {
       return g_param_spec_double(
           "absorb-time", "Time to absorb",
           "If something comes and stands still, it is foreground for so many seconds and then "
           "becomes background (0: it never does). If it leaves, that is noticed at once (not used "
           "by "
           "method=qdmd and dmd)",
           0, 1e6, d.absorb_time, kAnyTime);
     },
     QDMD_DOUBLE(s.absorb_time)},
    {[](const Settings& d) {
       return g_param_spec_enum(
           "shadows", "Shadows", "What shadows, and mirror images on floors, are in masks",
           gst_qdmd_background_shadows_get_type(), gint(d.wishes.shadows), kControllable);
     },
     QDMD_ENUM(s.wishes.shadows)},
    {[](const Settings& d) {
       return g_param_spec_uint("mask-softness", "Softness of masks",
                                "Over how many pixels to either side the edge of a mask fades, in "
                                "output=mask and cutout (0: hard). Soft edges follow the picture "
                                "and are steady from frame to frame. Regions use the hard mask",
                                0, guint(kMostSoftness), guint(d.wishes.mask_softness),
                                kControllable);
     },
     QDMD_UINT(s.wishes.mask_softness)},
    {[](const Settings&) {
       return areas_spec("ignore", "Ignore",
                         "Rectangles `<<x,y,width,height>,...>` in pixels, 64 at most, in which "
                         "nothing is foreground and masks learn nothing. What reaches beyond the "
                         "picture is cut off, and rectangles without a pixel are left out",
                         kAnyTime);
     },
     [](Settings& s, const GValue* v) {
       s.wishes.ignored = {};
       s.ignored_left_out = add_areas_of(v, &s.wishes.ignored);
       ++s.ignored_set;
     },
     [](const Settings& s, GValue* v) { areas_to(s.wishes.ignored, v); }},
    {[](const Settings&) {
       return g_param_spec_string(
           "ignore-roi-type", "Ignore regions of interest",
           "Type of GstVideoRegionOfInterestMeta on a frame's buffer that is "
           "ignored like `ignore`, in that frame (empty: none)",
           nullptr, kAnyTime);
     },
     [](Settings& s, const GValue* v) {
       const gchar* type = g_value_get_string(v);
       s.ignored_type = type && *type ? g_quark_from_string(type) : 0;
     },
     [](const Settings& s, GValue* v) {
       g_value_set_static_string(v, g_quark_to_string(s.ignored_type));
     }},
    {[](const Settings& d) {
       return g_param_spec_enum("stabilize", "Stabilize",
                                "How a camera that shakes or drifts may move. Frames are moved "
                                "back to the camera's first place, by up to an eighth of the "
                                "picture. Masks and backgrounds are sent as the camera sees them",
                                gst_qdmd_background_stabilize_get_type(), gint(d.engine.stabilize),
                                kAtStart);
     },
     QDMD_ENUM(s.engine.stabilize)},
    {[](const Settings& d) {
       return g_param_spec_boolean("stabilize-output", "Stabilize the output",
                                   "Send pictures as they would be if the camera stood still, in "
                                   "place of where it looks; alpha stays as it came",
                                   d.wishes.stabilize_output, kControllable);
     },
     QDMD_BOOLEAN(s.wishes.stabilize_output)},
    {[](const Settings& d) {
       return g_param_spec_boolean(
           "object-messages", "Messages of objects",
           "Post an element message `qdmdbackground-object` for each thing that appeared, stopped, "
           "was left behind or removed, moved on or is gone, and when motion begins and ends",
           d.object_messages, kAnyTime);
     },
     QDMD_BOOLEAN(s.object_messages)},
    {[](const Settings& d) {
       return g_param_spec_boolean("object-snapshots", "Snapshots of objects",
                                   "Messages of objects have the frame, cut to the object's box, "
                                   "as a GstSample `snapshot`",
                                   d.object_snapshots, kAnyTime);
     },
     QDMD_BOOLEAN(s.object_snapshots)},
    {[](const Settings& d) {
       return g_param_spec_double("object-min-size", "Least size of objects",
                                  "Least length of the longer side of an object's box, in parts of "
                                  "the picture's height. Smaller things have no messages",
                                  0, 1, d.object_min_size, kAnyTime);
     },
     QDMD_DOUBLE(s.object_min_size)},
    {[](const Settings& d) {
       return g_param_spec_double("object-appear-time", "Time in which objects appear",
                                  "Seconds for which something must be seen before a message says "
                                  "that it appeared, three frames at least",
                                  0, 1e6, d.object_appear_time, kAnyTime);
     },
     QDMD_DOUBLE(s.object_appear_time)},
    {[](const Settings& d) {
       return g_param_spec_double("object-stop-time", "Time in which objects stop",
                                  "Seconds for which an object must stand before a message says "
                                  "that it stopped or was left behind, three frames at least",
                                  0, 1e6, d.object_stop_time, kAnyTime);
     },
     QDMD_DOUBLE(s.object_stop_time)},
    {[](const Settings& d) {
       return g_param_spec_double("object-gone-time", "Time after which objects are gone",
                                  "Seconds without a frame that shows an object until a message "
                                  "says that it is gone, three frames at least",
                                  0, 1e6, d.object_gone_time, kAnyTime);
     },
     QDMD_DOUBLE(s.object_gone_time)},
    {[](const Settings& d) {
       return g_param_spec_double(
           "motion-end-time", "Time after which motion ends",
           "Seconds in which nothing moves in the picture until a message says that motion ends", 0,
           1e6, d.motion_end_time, kAnyTime);
     },
     QDMD_DOUBLE(s.motion_end_time)},
    {[](const Settings& d) {
       return g_param_spec_uint(
           "mask-scale", "Scale of masks",
           "Masks are found in a picture so many times smaller in each direction, and enlarged: 1, "
           "2 or 4. Other pictures have no more pixels than that, either (0: 1 up to 2.5 million "
           "pixels, or if anything but masks is sent, else 2, and 4 above 20 million)",
           0, 4, guint(d.mask_scale), kAtStart);
     },
     QDMD_UINT(s.mask_scale)},
};

}  // namespace

void install_settings(GObjectClass* klass, WhichSettings which) {
  static_assert(std::size(kProperties) < kMostSettings);
  const Settings defaults;
  guint id = 1;
  for (const Property& property : kProperties) {
    GParamSpec* spec = property.spec(defaults);
    if (which == WhichSettings::without_output && std::strcmp(spec->name, "output") == 0)
      g_param_spec_unref(g_param_spec_ref_sink(spec));
    else
      g_object_class_install_property(klass, id, spec);
    ++id;
  }
}

bool set_setting(Settings* settings, guint id, const GValue* value) {
  if (id < 1 || id > std::size(kProperties)) return false;
  kProperties[id - 1].set(*settings, value);
  settings->asked.set(id);
  return true;
}

bool get_setting(const Settings& settings, guint id, GValue* value) {
  if (id < 1 || id > std::size(kProperties)) return false;
  kProperties[id - 1].get(settings, value);
  return true;
}

}  // namespace qdmd
