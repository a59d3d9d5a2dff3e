// SPDX-License-Identifier: LGPL-2.1-or-later
#include "gst/gstqdmdenums.h"

#include "core/engine/engine_options.h"
#include "core/foreground/decision.h"
#include "core/foreground/picture.h"

using qdmd::Output;
using qdmd::Shadows;

GType gst_qdmd_background_output_get_type() {
  static const GEnumValue values[] = {
      {int(Output::background), "The background L(t) at the frame's time", "background"},
      {int(Output::foreground), "The residual of each channel, abs(x - L)", "foreground"},
      {int(Output::mask),
       "White where the frame differs from the background by more than the background's own noise, "
       "else black; grey at edges with mask-softness",
       "mask"},
      {int(Output::cutout),
       "The frame where the mask is white, elsewhere black (transparent with alpha)", "cutout"},
      {0, nullptr, nullptr}};
  static const GType type = g_enum_register_static("GstQdmdBackgroundOutput", values);
  return type;
}

GType gst_qdmd_background_shadows_get_type() {
  static const GEnumValue values[] = {
      {int(Shadows::background), "Background", "background"},
      {int(Shadows::foreground), "Foreground, where they are strong enough", "foreground"},
      {int(Shadows::marked), "Background, and grey (127) in output=mask, never soft", "marked"},
      {0, nullptr, nullptr}};
  static const GType type = g_enum_register_static("GstQdmdBackgroundShadows", values);
  return type;
}

GType gst_qdmd_background_mode_get_type() {
  static const GEnumValue values[] = {
      {int(qdmd::Mode::batch),
       "Fill a window, solve it, then send one frame for each that comes, each with its own L(t). "
       "Latency: window-size - 1 frames and the time of a solve",
       "batch"},
      {int(qdmd::Mode::live),
       "Send each frame at once, against the newest model; solve every hop-size frames on the last "
       "window-size ones",
       "live"},
      {0, nullptr, nullptr}};
  static const GType type = g_enum_register_static("GstQdmdBackgroundMode", values);
  return type;
}

GType gst_qdmd_background_method_get_type() {
  static const GEnumValue values[] = {
      {int(qdmd::Method::qdmd), "Quaternion DMD of the coupled colour channels", "qdmd"},
      {int(qdmd::Method::dmd), "Exact DMD of each colour channel by itself", "dmd"},
      {int(qdmd::Method::robust),
       "Quaternion DMD of the window without what moves or stands in the way: no ghosts", "robust"},
      {0, nullptr, nullptr}};
  static const GType type = g_enum_register_static("GstQdmdBackgroundMethod", values);
  return type;
}

GType gst_qdmd_background_stabilize_get_type() {
  using qdmd::Stabilize;
  static const GEnumValue values[] = {
      {int(Stabilize::off), "The camera stands still: frames are taken as they come", "off"},
      {int(Stabilize::translation), "It looks to the left and right, up and down", "translation"},
      {int(Stabilize::similarity),
       "It also turns around its axis and zooms, a few degrees and "
       "percent",
       "similarity"},
      {0, nullptr, nullptr}};
  static const GType type = g_enum_register_static("GstQdmdBackgroundStabilize", values);
  return type;
}

const char* qdmd::method_name(Method method) {
  auto* methods = static_cast<GEnumClass*>(g_type_class_ref(gst_qdmd_background_method_get_type()));
  const char* name = g_enum_get_value(methods, gint(method))->value_nick;
  g_type_class_unref(methods);
  return name;
}

GType gst_qdmd_background_amplitude_get_type() {
  static const GEnumValue values[] = {
      {int(qdmd::Amplitude::window), "Fitted to all frames of the window (least squares)",
       "window"},
      {int(qdmd::Amplitude::first_frame), "Fitted to the first frame alone, as the paper does",
       "first-frame"},
      {0, nullptr, nullptr}};
  static const GType type = g_enum_register_static("GstQdmdBackgroundAmplitude", values);
  return type;
}

GType gst_qdmd_background_solver_get_type() {
  static const GEnumValue values[] = {
      {int(qdmd::Solver::automatic),
       "gram, and gram-extended where gram may be off by a quarter of a level", "auto"},
      {int(qdmd::Solver::gram), "From the exact integer Gram matrix of the window (fast)", "gram"},
      {int(qdmd::Solver::gram_extended),
       "The Gram matrix factorized in double-double: for nearly dependent frames", "gram-extended"},
      {int(qdmd::Solver::qr), "From a QR factorization of the pixel columns in double (slow)",
       "qr"},
      {int(qdmd::Solver::adjoint),
       "The paper's procedure, literally, on the pixels (slow, small windows only)", "adjoint"},
      {0, nullptr, nullptr}};
  static const GType type = g_enum_register_static("GstQdmdBackgroundSolver", values);
  return type;
}

GType gst_qdmd_background_estimator_get_type() {
  static const GEnumValue values[] = {
      {int(qdmd::Estimator::exact), "The paper's: noise shrinks abs(lambda)", "exact"},
      {int(qdmd::Estimator::forward_backward),
       "The geometric mean of the operators of time and of time turned back", "forward-backward"},
      {int(qdmd::Estimator::total), "Total least squares: noise in both frames of a pair", "total"},
      {int(qdmd::Estimator::optimized),
       "The background's exponentials, fitted to all frames at once", "optimized"},
      {0, nullptr, nullptr}};
  static const GType type = g_enum_register_static("GstQdmdBackgroundEstimator", values);
  return type;
}
