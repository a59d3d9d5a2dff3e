// SPDX-License-Identifier: LGPL-2.1-or-later
// Runs the element tests with fatal warnings; gst_deinit lets the leaks tracer report.
#include <gst/gst.h>
#include <gtest/gtest.h>

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  gst_init(&argc, &argv);
  g_log_set_always_fatal(GLogLevelFlags(G_LOG_LEVEL_CRITICAL | G_LOG_LEVEL_WARNING));
  const int result = RUN_ALL_TESTS();
  gst_deinit();
  return result;
}
