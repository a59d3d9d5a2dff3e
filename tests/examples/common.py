# SPDX-License-Identifier: LGPL-2.1-or-later
"""What the tests of the examples share: short films, pictures, and a report in TAP."""
import subprocess

import gi

gi.require_version('Gst', '1.0')
from gi.repository import GLib, Gst

Gst.init(None)

# More than a window of 100 frames, so that sound really has to wait.
FILM_FRAMES = 130


def play(description):
    """Runs a pipeline to its end; returns it, in PAUSED, for what its elements still know."""
    pipeline = Gst.parse_launch(description)
    pipeline.set_state(Gst.State.PLAYING)
    message = pipeline.get_bus().timed_pop_filtered(
        60 * Gst.SECOND, Gst.MessageType.EOS | Gst.MessageType.ERROR)
    if not message or message.type != Gst.MessageType.EOS:
        pipeline.set_state(Gst.State.NULL)
        raise RuntimeError(message.parse_error()[0].message if message else f'stuck: {description}')
    pipeline.set_state(Gst.State.PAUSED)
    return pipeline


def element_message(pipeline, name, timeout=60 * Gst.SECOND):
    """The structure of the next element message of this name; others before it are dropped.
    None: no such message came in `timeout` ns."""
    end = GLib.get_monotonic_time() * 1000 + timeout
    while message := pipeline.get_bus().timed_pop_filtered(
            max(0, end - GLib.get_monotonic_time() * 1000), Gst.MessageType.ELEMENT):
        if message.get_structure().get_name() == name:
            return message.get_structure()
    return None


def make_film(path):
    """A film of a simulated street, 320x240 at 25 frames/s, with sound."""
    samples = FILM_FRAMES * 44100 // 25
    play(f'avimux name=film ! filesink location="{path}" '
         f'qdmdscenesrc scene=basic num-buffers={FILM_FRAMES} ! videoconvert ! jpegenc ! film. '
         f'audiotestsrc num-buffers=1 samplesperbuffer={samples} ! audio/x-raw,rate=44100 ! '
         'audioconvert ! film.').set_state(Gst.State.NULL)


def make_picture(path):
    play('videotestsrc pattern=gradient num-buffers=1 ! video/x-raw,width=320,height=240 ! '
         f'pngenc ! filesink location="{path}"').set_state(Gst.State.NULL)


def last_picture(description):
    """The RGB bytes of the last frame that `description` makes."""
    pipeline = play(f'{description} ! videoconvert ! video/x-raw,format=RGB ! '
                    'fakesink name=end sync=false')
    buffer = pipeline.get_by_name('end').get_property('last-sample').get_buffer()
    data = buffer.extract_dup(0, buffer.get_size())
    pipeline.set_state(Gst.State.NULL)
    return data


def picture_of(path):
    return last_picture(f'filesrc location="{path}" ! decodebin')


def count_frames(path):
    frames = 0

    def count(pad, info):
        nonlocal frames
        frames += 1
        return Gst.PadProbeReturn.OK

    pipeline = Gst.parse_launch(f'filesrc location="{path}" ! decodebin ! video/x-raw ! '
                                'fakesink name=end sync=false')
    pipeline.get_by_name('end').get_static_pad('sink').add_probe(Gst.PadProbeType.BUFFER, count)
    pipeline.set_state(Gst.State.PLAYING)
    pipeline.get_bus().timed_pop_filtered(60 * Gst.SECOND,
                                          Gst.MessageType.EOS | Gst.MessageType.ERROR)
    pipeline.set_state(Gst.State.NULL)
    return frames


def report(cases):
    """Runs (name, function) pairs. A function raises what is wrong, or returns."""
    print(f'1..{len(cases)}', flush=True)
    failed = 0
    for number, (name, function) in enumerate(cases, 1):
        try:
            function()
            print(f'ok {number} - {name}', flush=True)
        except (AssertionError, RuntimeError, OSError, subprocess.TimeoutExpired) as error:
            failed += 1
            print(f'not ok {number} - {name}')
            for line in str(error).splitlines():
                print(f'# {line}', flush=True)
    return 1 if failed else 0
