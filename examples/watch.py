#!/usr/bin/python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Prints where something moves in a video, frame by frame, and keeps the empty scene as a picture.

Needs python3-gi and gir1.2-gst-plugins-base-1.0, and GST_PLUGIN_PATH where the plugin is not
installed.
"""
import argparse
import signal
import sys

import gi

gi.require_version('Gst', '1.0')
gi.require_version('GstVideo', '1.0')
from gi.repository import GLib, Gst, GstVideo


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('video', nargs='?', help='a simulated scene where none is named')
    parser.add_argument('--frames', type=int, default=150, help='length of the simulated scene')
    parser.add_argument('--window-size', type=int, default=100)
    parser.add_argument('--min-area', type=int, default=100, help='smallest region, in pixels')
    parser.add_argument('--plate', default='plate.png', help='where the empty scene goes')
    return parser.parse_args()


def make_pipeline(options):
    if options.video:
        source = 'filesrc name=file ! decodebin'
    elif Gst.ElementFactory.find('qdmdscenesrc'):
        source = f'qdmdscenesrc scene=basic num-buffers={options.frames}'
    else:
        source = f'videotestsrc pattern=ball num-buffers={options.frames}'
    pipeline = Gst.parse_launch(f'{source} ! videoconvert ! qdmdbackground name=separator '
                                'regions=true ! fakesink sync=false')
    if options.video:
        pipeline.get_by_name('file').set_property('location', options.video)
    separator = pipeline.get_by_name('separator')
    separator.set_property('window-size', options.window_size)
    separator.set_property('regions-min-area', options.min_area)
    separator.get_static_pad('src').add_probe(Gst.PadProbeType.BUFFER, print_regions)
    return pipeline, separator


# Of things that are followed: the lowest that may still be there, and the highest so far.
NUMBERS = [0, 0]


def regions_of(buffer):
    # Python finds a region by its number alone, and others than ours may have the same: on a copy,
    # what has been read gets another one. A thing keeps its number, and new ones have higher ones.
    # (Python's copy() is another reference to the same buffer.)
    copy = buffer.copy_region(Gst.BufferCopyFlags.MEMORY | Gst.BufferCopyFlags.META, 0, buffer.get_size())
    left = copy.get_n_meta(GstVideo.video_region_of_interest_meta_api_get_type())
    number, found = NUMBERS[0], []
    while left > 0 and number < NUMBERS[1] + 1000:
        while region := GstVideo.buffer_get_video_region_of_interest_meta_id(copy, number):
            left -= 1
            if GLib.quark_to_string(region.roi_type) == 'foreground':
                found.append(number)
                yield number, region
            region.id = -1
        number += 1
    if found:
        NUMBERS[:] = max(0, found[0] - 100), max(NUMBERS[1], found[-1])


def print_regions(pad, info):
    buffer = info.get_buffer()
    for number, region in regions_of(buffer):
        line = (f'{buffer.pts / Gst.SECOND:8.2f} s: x {region.x}, y {region.y}, '
                f'w {region.w}, h {region.h}')
        details = region.get_param('foreground')
        if details:
            line += (f', area {details.get_uint("area").value}, '
                     f'mean residual {details.get_double("mean-residual").value:.1f}')
        print(f'{line}, number {number}')
    return Gst.PadProbeReturn.OK


def play(pipeline, options):
    """Plays to the end, or to Ctrl-C; returns an error's text, or None."""
    def interrupt():
        pipeline.send_event(Gst.Event.new_eos())
        return GLib.SOURCE_REMOVE

    failure = []
    loop = GLib.MainLoop()

    def at_message(bus, message):
        if message.type == Gst.MessageType.ERROR:
            where = options.video if message.src.name == 'file' else message.src.name
            failure.append(f'{where}: {message.parse_error()[0].message}')
        if message.type in (Gst.MessageType.ERROR, Gst.MessageType.EOS):
            loop.quit()

    bus = pipeline.get_bus()
    bus.add_signal_watch()
    bus.connect('message', at_message)
    GLib.unix_signal_add(GLib.PRIORITY_DEFAULT, signal.SIGINT, interrupt)
    # Nobody reads any longer, as after `| head`.
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    pipeline.set_state(Gst.State.PLAYING)
    loop.run()
    return failure[0] if failure else None


def save_plate(separator, path):
    background = separator.get_property('background')
    if not background:
        return 'There were too few frames for a background.'
    try:
        picture = GstVideo.video_convert_sample(background, Gst.Caps.from_string('image/png'),
                                                10 * Gst.SECOND)
        good, data = picture.get_buffer().map(Gst.MapFlags.READ)
        with open(path, 'wb') as file:
            file.write(data.data)
        picture.get_buffer().unmap(data)
    except (GLib.Error, OSError) as error:
        return str(error)
    print(f'The empty scene is in {path}')
    return None


def main():
    options = parse_arguments()
    Gst.init(None)
    try:
        pipeline, separator = make_pipeline(options)
    except GLib.Error as error:
        return error.message
    failure = play(pipeline, options) or save_plate(separator, options.plate)
    pipeline.set_state(Gst.State.NULL)
    return failure


sys.exit(main())
