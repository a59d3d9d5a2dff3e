// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gst/solvereport.h"

#include <complex>
#include <numbers>

#include "gst/gstqdmdenums.h"

namespace qdmd {
namespace {

// A timestamp as applications go by it.
struct FrameTimes {
  FrameTimes(const GstSegment& segment, GstClockTime timestamp) {
    if (segment.format != GST_FORMAT_TIME || !GST_CLOCK_TIME_IS_VALID(timestamp)) return;
    stream = gst_segment_to_stream_time(&segment, GST_FORMAT_TIME, timestamp);
    running = gst_segment_to_running_time(&segment, GST_FORMAT_TIME, timestamp);
  }
  guint64 stream = GST_CLOCK_TIME_NONE, running = GST_CLOCK_TIME_NONE;
};

double degrees(double radians) { return radians * 180 / std::numbers::pi; }

GValue value_of(double number) {
  GValue value = G_VALUE_INIT;
  g_value_init(&value, G_TYPE_DOUBLE);
  g_value_set_double(&value, number);
  return value;
}

GValue value_of(bool truth) {
  GValue value = G_VALUE_INIT;
  g_value_init(&value, G_TYPE_BOOLEAN);
  g_value_set_boolean(&value, truth);
  return value;
}

void append(GValue* array, GValue value) { gst_value_array_append_and_take_value(array, &value); }

GValue array_of(std::size_t size) {
  GValue array = G_VALUE_INIT;
  gst_value_array_init(&array, guint(size));
  return array;
}

GValue value_of(std::complex<double> number) {
  GValue array = array_of(2);
  append(&array, value_of(number.real()));
  append(&array, value_of(number.imag()));
  return array;
}

// Arrays of equal length, where there is a spectrum.
void add_spectrum(const DmdSummary& dmd, GstStructure* structure) {
  if (!dmd.spectrum) return;
  const auto add = [&](const char* name, auto number_of) {
    GValue array = array_of(dmd.spectrum->size());
    for (const SpectrumMode& mode : *dmd.spectrum) append(&array, value_of(number_of(mode)));
    gst_structure_take_value(structure, name, &array);
  };
  add("eigenvalues-real", [](const SpectrumMode& mode) { return mode.lambda.real(); });
  add("eigenvalues-imaginary", [](const SpectrumMode& mode) { return mode.lambda.imag(); });
  add("amplitudes", [](const SpectrumMode& mode) { return mode.amplitude; });
  add("background", [](const SpectrumMode& mode) { return mode.background; });
}

}  // namespace

GstStructure* make_stats(const SolveReport& report, const Counters& counters) {
  GstStructure* stats = gst_structure_new(
      "qdmdbackground-stats", "frames-in", G_TYPE_UINT64, counters.frames_in, "frames-out",
      G_TYPE_UINT64, counters.frames_out, "solves", G_TYPE_UINT64, counters.solves, "window-frames",
      G_TYPE_UINT, guint(report.window_frames), "rank", G_TYPE_UINT, guint(report.dmd.rank),
      "background-modes", G_TYPE_UINT, guint(report.dmd.background_modes), "omega", G_TYPE_DOUBLE,
      report.dmd.omega, "residual", G_TYPE_DOUBLE, report.dmd.residual, "condition", G_TYPE_DOUBLE,
      report.dmd.condition, "rounding-bound", G_TYPE_DOUBLE, report.dmd.rounding_bound,
      "sensitivity", G_TYPE_DOUBLE, report.dmd.sensitivity, "solver",
      gst_qdmd_background_solver_get_type(), gint(report.dmd.solver), "estimator",
      gst_qdmd_background_estimator_get_type(), gint(report.dmd.estimator), "converged",
      G_TYPE_BOOLEAN, gboolean(report.dmd.converged), "replaced", G_TYPE_BOOLEAN,
      gboolean(report.replaced), "noise", G_TYPE_DOUBLE, report.foreground.noise,
      "foreground-threshold", G_TYPE_DOUBLE, report.foreground.threshold, "foreground-ratio",
      G_TYPE_DOUBLE, report.foreground.ratio, "gram-time", G_TYPE_DOUBLE, report.gram_time,
      "solve-time", G_TYPE_DOUBLE, report.solve_time, "sample-step", G_TYPE_UINT,
      guint(report.sample_step), "iterations", G_TYPE_UINT, guint(report.iterations),
      "solve-period", G_TYPE_UINT, counters.solve_period, "time-per-frame", G_TYPE_DOUBLE,
      counters.time_per_frame, "camera-x", G_TYPE_DOUBLE, counters.camera.x, "camera-y",
      G_TYPE_DOUBLE, counters.camera.y, "camera-angle", G_TYPE_DOUBLE,
      degrees(counters.camera.angle), nullptr);
  GValue lambda = value_of(report.dmd.lambda);
  gst_structure_take_value(stats, "lambda", &lambda);
  add_spectrum(report.dmd, stats);
  return stats;
}

GstStructure* make_camera_message(const GstSegment& segment, GstClockTime timestamp,
                                  const Pose& camera) {
  const FrameTimes times(segment, timestamp);
  return gst_structure_new("qdmdbackground-camera", "timestamp", G_TYPE_UINT64, guint64(timestamp),
                           "stream-time", G_TYPE_UINT64, times.stream, "running-time",
                           G_TYPE_UINT64, times.running, "camera-x", G_TYPE_DOUBLE, camera.x,
                           "camera-y", G_TYPE_DOUBLE, camera.y, "camera-angle", G_TYPE_DOUBLE,
                           degrees(camera.angle), nullptr);
}

GstStructure* make_scene_message(const GstSegment& segment, GstClockTime timestamp,
                                 bool camera_moved) {
  const FrameTimes times(segment, timestamp);
  return gst_structure_new("qdmdbackground-scene", "timestamp", G_TYPE_UINT64, guint64(timestamp),
                           "stream-time", G_TYPE_UINT64, times.stream, "running-time",
                           G_TYPE_UINT64, times.running, "camera-moved", G_TYPE_BOOLEAN,
                           gboolean(camera_moved), nullptr);
}

GstStructure* make_ready_message(const GstSegment& segment, GstClockTime timestamp) {
  const FrameTimes times(segment, timestamp);
  return gst_structure_new("qdmdbackground-ready", "timestamp", G_TYPE_UINT64, guint64(timestamp),
                           "stream-time", G_TYPE_UINT64, times.stream, "running-time",
                           G_TYPE_UINT64, times.running, nullptr);
}

GstStructure* make_solve_message(const SolveReport& report, const Counters& counters,
                                 const GstSegment& segment, GstClockTime timestamp,
                                 GstClockTime duration) {
  const FrameTimes times(segment, timestamp);
  GstStructure* message = gst_structure_new(
      "qdmdbackground", "timestamp", G_TYPE_UINT64, guint64(timestamp), "stream-time",
      G_TYPE_UINT64, times.stream, "running-time", G_TYPE_UINT64, times.running, "duration",
      G_TYPE_UINT64, guint64(duration), "window-frames", G_TYPE_UINT, guint(report.window_frames),
      "rank", G_TYPE_UINT, guint(report.dmd.rank), "lambda-real", G_TYPE_DOUBLE,
      report.dmd.lambda.real(), "lambda-imaginary", G_TYPE_DOUBLE, report.dmd.lambda.imag(),
      "omega", G_TYPE_DOUBLE, report.dmd.omega, "residual", G_TYPE_DOUBLE, report.dmd.residual,
      "rounding-bound", G_TYPE_DOUBLE, report.dmd.rounding_bound, "sensitivity", G_TYPE_DOUBLE,
      report.dmd.sensitivity, "solver", gst_qdmd_background_solver_get_type(),
      gint(report.dmd.solver), "estimator", gst_qdmd_background_estimator_get_type(),
      gint(report.dmd.estimator), "converged", G_TYPE_BOOLEAN, gboolean(report.dmd.converged),
      "replaced", G_TYPE_BOOLEAN, gboolean(report.replaced), "settled", G_TYPE_BOOLEAN,
      gboolean(report.settled), "foreground-ratio", G_TYPE_DOUBLE, report.foreground.ratio,
      "solve-time", G_TYPE_DOUBLE, report.solve_time, "sample-step", G_TYPE_UINT,
      guint(report.sample_step), "iterations", G_TYPE_UINT, guint(report.iterations),
      "solve-period", G_TYPE_UINT, counters.solve_period, "time-per-frame", G_TYPE_DOUBLE,
      counters.time_per_frame, nullptr);
  add_spectrum(report.dmd, message);
  return message;
}

}  // namespace qdmd
