#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""The most memory of a process whose window is I420 is below 0.6 times that of RGB.

  GST_PLUGIN_PATH_1_0=build/gst tests/gst/format_memory_test.py
"""

import os
import subprocess
import sys

PIPELINE = (
    'videotestsrc num-buffers=100 pattern=ball ! video/x-raw,format={pixels},width=1920,height=1080 ! '
    'qdmdbackground n-threads=2 {settings} ! fakesink'
)
# Half for the window, and what both have alike.
MOST = 0.6


def most_memory(pixels, settings):
    """Kilobytes of the largest moment of the process."""
    words = PIPELINE.format(pixels=pixels, settings=settings).split()
    process = subprocess.Popen(['gst-launch-1.0', '-q', *words])
    _, status, usage = os.wait4(process.pid, 0)
    assert status == 0, f'{pixels} {settings}: status {status}'
    return usage.ru_maxrss


failed = 0
for settings in ('', 'output=mask'):
    shared, whole = (most_memory(pixels, settings) for pixels in ('I420', 'RGB'))
    print(f'{settings or "default"}: I420 {shared} kB, RGB {whole} kB: {shared / whole:.3f}')
    failed += shared >= MOST * whole
sys.exit(1 if failed else 0)
