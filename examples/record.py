#!/usr/bin/python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Records a camera while something moves before it, and the seconds before that.

The element tells after each solve how much of the picture is foreground; that opens and closes a
valve in front of the file. Frames wait some seconds before the valve, which is why the recording
begins before the motion. Ctrl-C ends it.

Needs python3-gi and gir1.2-gstreamer-1.0, and GST_PLUGIN_PATH where the plugin is not installed.
"""
import argparse
import os
import signal
import sys

import gi

gi.require_version('Gst', '1.0')
from gi.repository import GLib, Gst


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    parser.add_argument('source', nargs='?', default='qdmdscenesrc scene=basic is-live=true',
                        help="live video, as for gst-launch-1.0: 'v4l2src device=/dev/video0', "
                             "'rtspsrc location=... ! decodebin'; else a simulated scene")
    parser.add_argument('--output', default='motion.mkv')
    parser.add_argument('--before', type=float, default=2, metavar='SECONDS',
                        help='how much earlier than the motion the recording begins (2)')
    parser.add_argument('--share', type=float, default=0.5, metavar='PERCENT',
                        help='of the picture that has to move (0.5)')
    parser.add_argument('--seconds', type=float, help='end after as many; else by Ctrl-C')
    return parser.parse_args()


def make_pipeline(options):
    delay = int(options.before * Gst.SECOND)
    pipeline = Gst.parse_launch(
        f'{options.source} ! videoconvert ! tee name=t '
        't. ! queue ! qdmdbackground mode=live window-size=50 hop-size=10 post-messages=true ! '
        'fakesink sync=false '
        f't. ! queue min-threshold-time={delay} max-size-time={delay + Gst.SECOND} '
        'max-size-buffers=0 max-size-bytes=0 ! '
        # Without caps and the end of the stream the file could not be finished.
        'valve name=gate drop=true drop-mode=forward-sticky-events ! '
        'videoconvert ! jpegenc ! matroskamux ! filesink name=file sync=false async=false')
    pipeline.get_by_name('file').set_property('location', options.output)
    return pipeline


class Recorder:
    def __init__(self, options):
        self.share = options.share / 100
        self.seconds = options.seconds
        self.pipeline = make_pipeline(options)
        self.gate = self.pipeline.get_by_name('gate')
        self.recordings = 0
        self.failure = None
        self.loop = GLib.MainLoop()

    def at_message(self, bus, message):
        if message.type == Gst.MessageType.ELEMENT and message.has_name('qdmdbackground'):
            self.at_solve(message.get_structure())
        elif message.type == Gst.MessageType.ERROR:
            self.failure = f'{message.src.name}: {message.parse_error()[0].message}'
            self.loop.quit()
        elif message.type == Gst.MessageType.EOS:
            self.loop.quit()

    def at_solve(self, fields):
        moving = fields.get_double('foreground-ratio').value > self.share
        if moving != self.gate.get_property('drop'):
            return
        self.gate.set_property('drop', not moving)
        self.recordings += moving
        seconds = fields.get_uint64('stream-time').value / Gst.SECOND
        try:
            print(f'{seconds:8.2f} s: {"recording" if moving else "nothing moves"}', flush=True)
        except BrokenPipeError:
            # Nobody reads any longer, as after `| head`: that ends the recording, too.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            self.finish()

    def finish(self):
        self.pipeline.send_event(Gst.Event.new_eos())
        return GLib.SOURCE_REMOVE

    def run(self):
        bus = self.pipeline.get_bus()
        bus.add_signal_watch()
        bus.connect('message', self.at_message)
        GLib.unix_signal_add(GLib.PRIORITY_DEFAULT, signal.SIGINT, self.finish)
        if self.seconds:
            GLib.timeout_add(int(1000 * self.seconds), self.finish)
        self.pipeline.set_state(Gst.State.PLAYING)
        self.loop.run()
        self.pipeline.set_state(Gst.State.NULL)
        return self.failure


def main():
    options = parse_arguments()
    Gst.init(None)
    try:
        recorder = Recorder(options)
    except GLib.Error as error:
        return error.message
    failure = recorder.run()
    if not failure and not recorder.recordings:
        os.remove(options.output)
        print('Nothing moved.')
    return failure


sys.exit(main())
