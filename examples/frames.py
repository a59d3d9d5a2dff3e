#!/usr/bin/python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Pushes frames that a program has as numpy arrays, and takes their masks as numpy arrays.

Needs python3-gi, python3-numpy and gir1.2-gst-plugins-base-1.0, and GST_PLUGIN_PATH where the plugin is not installed.
"""
import argparse

import gi
import numpy as np

gi.require_version('Gst', '1.0')
gi.require_version('GstApp', '1.0')
from gi.repository import Gst, GstApp

WIDTH, HEIGHT, RATE = 160, 120, 25


def frame_at(t):
    """A wall, before which a square walks."""
    x, y = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    frame = np.stack([60 + x % 64, 90 + y // 3, 120 + 0 * x], axis=-1).astype(np.uint8)
    left = 3 * t % (WIDTH - 30)
    frame[40:70, left:left + 30] = (250, 20, 30)
    return frame


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--frames', type=int, default=150)
    parser.add_argument('--gap', action='store_true', help='a camera is off for a minute in the middle')
    options = parser.parse_args()
    Gst.init(None)
    pipeline = Gst.parse_launch(
        f'appsrc name=in is-live=false format=time block=true max-buffers=4 max-bytes=0 '
        f'caps=video/x-raw,format=RGB,width={WIDTH},height={HEIGHT},framerate={RATE}/1 ! '
        'qdmdbackground output=mask ! videoconvert ! video/x-raw,format=GRAY8 ! '
        'appsink name=out sync=false max-buffers=4 emit-signals=true')
    masks = []

    # In the thread of the pipeline. A loop that pushes a frame and then waits for a mask hangs: a window is let go at
    # once at a gap and at the end, the sink is full, and the loop waits for room in the source.
    def take(sink):
        sample = sink.emit('pull-sample')
        data = sample.get_buffer().extract_dup(0, sample.get_buffer().get_size())
        masks.append(np.frombuffer(data, np.uint8).reshape(HEIGHT, WIDTH))
        return Gst.FlowReturn.OK

    pipeline.get_by_name('out').connect('new-sample', take)
    source = pipeline.get_by_name('in')
    pipeline.set_state(Gst.State.PLAYING)
    time = 0
    for t in range(options.frames):
        if options.gap and t == options.frames // 2:
            source.send_event(Gst.Event.new_gap(time, 60 * Gst.SECOND))
            time += 60 * Gst.SECOND
        buffer = Gst.Buffer.new_wrapped(frame_at(t).tobytes())
        buffer.pts, buffer.duration = time, Gst.SECOND // RATE
        source.emit('push-buffer', buffer)
        time += buffer.duration
    source.emit('end-of-stream')
    message = pipeline.get_bus().timed_pop_filtered(Gst.CLOCK_TIME_NONE, Gst.MessageType.EOS | Gst.MessageType.ERROR)
    pipeline.set_state(Gst.State.NULL)
    if message.type == Gst.MessageType.ERROR:
        raise SystemExit(message.parse_error()[0].message)
    print(f'{len(masks)} masks, {100 * np.mean(np.stack(masks) > 0):.1f} % foreground')


main()
