#include "gst/solvereport.h"

#include <numbers>

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

}  // namespace

GstStructure* make_stats(const SolveReport& report, const Counters& counters) {
  GstStructure* stats = gst_structure_new(
      "qdmdbackground-stats", "frames-in", G_TYPE_UINT64, counters.frames_in, "frames-out",
      G_TYPE_UINT64, counters.frames_out, "solves", G_TYPE_UINT64, counters.solves, "window-frames",
      G_TYPE_UINT, guint(report.window_frames), "rank", G_TYPE_UINT, guint(report.dmd.rank),
      "background-modes", G_TYPE_UINT, guint(report.dmd.background_modes), "omega", G_TYPE_DOUBLE,
      report.dmd.omega, "residual", G_TYPE_DOUBLE, report.dmd.residual, "condition", G_TYPE_DOUBLE,
      report.dmd.condition, "converged", G_TYPE_BOOLEAN, gboolean(report.dmd.converged), "noise",
      G_TYPE_DOUBLE, report.foreground.noise, "foreground-threshold", G_TYPE_DOUBLE,
      report.foreground.threshold, "foreground-ratio", G_TYPE_DOUBLE, report.foreground.ratio,
      "gram-time", G_TYPE_DOUBLE, report.gram_time, "solve-time", G_TYPE_DOUBLE, report.solve_time,
      "sample-step", G_TYPE_UINT, guint(report.sample_step), "iterations", G_TYPE_UINT,
      guint(report.iterations), "solve-period", G_TYPE_UINT, counters.solve_period,
      "time-per-frame", G_TYPE_DOUBLE, counters.time_per_frame, "camera-x", G_TYPE_DOUBLE,
      counters.camera.x, "camera-y", G_TYPE_DOUBLE, counters.camera.y, "camera-angle",
      G_TYPE_DOUBLE, degrees(counters.camera.angle), nullptr);
  GValue lambda = G_VALUE_INIT, part = G_VALUE_INIT;
  gst_value_array_init(&lambda, 2);
  g_value_init(&part, G_TYPE_DOUBLE);
  for (double value : {report.dmd.lambda.real(), report.dmd.lambda.imag()}) {
    g_value_set_double(&part, value);
    gst_value_array_append_value(&lambda, &part);
  }
  gst_structure_take_value(stats, "lambda", &lambda);
  g_value_unset(&part);
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

GstStructure* make_solve_message(const SolveReport& report, const Counters& counters,
                                 const GstSegment& segment, GstClockTime timestamp,
                                 GstClockTime duration) {
  const FrameTimes times(segment, timestamp);
  return gst_structure_new(
      "qdmdbackground", "timestamp", G_TYPE_UINT64, guint64(timestamp), "stream-time",
      G_TYPE_UINT64, times.stream, "running-time", G_TYPE_UINT64, times.running, "duration",
      G_TYPE_UINT64, guint64(duration), "window-frames", G_TYPE_UINT, guint(report.window_frames),
      "rank", G_TYPE_UINT, guint(report.dmd.rank), "lambda-real", G_TYPE_DOUBLE,
      report.dmd.lambda.real(), "lambda-imaginary", G_TYPE_DOUBLE, report.dmd.lambda.imag(),
      "omega", G_TYPE_DOUBLE, report.dmd.omega, "residual", G_TYPE_DOUBLE, report.dmd.residual,
      "foreground-ratio", G_TYPE_DOUBLE, report.foreground.ratio, "solve-time", G_TYPE_DOUBLE,
      report.solve_time, "sample-step", G_TYPE_UINT, guint(report.sample_step), "iterations",
      G_TYPE_UINT, guint(report.iterations), "solve-period", G_TYPE_UINT, counters.solve_period,
      "time-per-frame", G_TYPE_DOUBLE, counters.time_per_frame, nullptr);
}

}  // namespace qdmd
