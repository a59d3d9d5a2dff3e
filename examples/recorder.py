#!/usr/bin/python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Records what happens before a camera: a film of each motion, and a line for each event.

While something moves, and for the seconds before, three films are written: the frames, the empty
scene and the mask. `events.jsonl` has a line of JSON for each event that the element tells of (things
that appear, stop, are left behind or removed, move on, are gone), with the film that shows it and a
picture of the thing. In a folder that has recordings, numbers go on. Ctrl-C ends it.

Needs python3-gi and gir1.2-gstreamer-1.0, and GST_PLUGIN_PATH where the plugin is not installed.
"""
import argparse
import collections
import json
import os
import re
import signal
import sys

import gi

gi.require_version('Gst', '1.0')
from gi.repository import GLib, Gst

FILMS = 'video', 'background', 'mask'
TIMES = 'stream-time', 'first-stream-time'


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    parser.add_argument('source', nargs='?', default='qdmdscenesrc scene=basic is-live=true',
                        help="video, as for gst-launch-1.0: 'v4l2src device=/dev/video0', "
                             "'filesrc location=street.avi ! decodebin'; else a simulated scene")
    parser.add_argument('--output', default='recordings', metavar='FOLDER')
    parser.add_argument('--before', type=float, default=2, metavar='SECONDS',
                        help='how much earlier than the motion a film begins (2)')
    parser.add_argument('--mode', default='live', choices=('live', 'batch'),
                        help='batch: better masks, some seconds later (live)')
    parser.add_argument('--settings', default='', metavar='PROPERTIES',
                        help="more properties of qdmdseparate: 'object-stop-time=10'")
    return parser.parse_args()


def make_pipeline(options):
    queue = 'queue max-size-buffers=0 max-size-bytes=0 max-size-time=0'
    # The element makes as many pictures as frames come: the first film waits for the two others.
    return Gst.parse_launch(
        f'{options.source} ! videoconvert ! video/x-raw,format=I420 ! tee name=t '
        f't. ! {queue} ! jpegenc ! appsink name=video sync=false '
        f't. ! queue ! qdmdseparate name=s mode={options.mode} object-messages=true '
        f'object-snapshots=true {options.settings} '
        's.background ! queue ! jpegenc ! appsink name=background sync=false max-buffers=4 '
        's.mask ! queue ! jpegenc ! appsink name=mask sync=false max-buffers=4')


class Film:
    """A file of JPEG pictures that begins with time 0."""

    def __init__(self, path, caps, begin):
        self.path = path
        self.begin = begin
        self.pipeline = Gst.parse_launch(
            'appsrc name=pictures format=time ! queue ! matroskamux ! filesink name=file')
        self.source = self.pipeline.get_by_name('pictures')
        self.source.set_property('caps', caps)
        self.pipeline.get_by_name('file').set_property('location', path)
        self.pipeline.set_state(Gst.State.PLAYING)

    def add(self, buffer):
        # Python's copy() is another reference to the same buffer.
        picture = buffer.copy_region(Gst.BufferCopyFlags.MEMORY | Gst.BufferCopyFlags.TIMESTAMPS, 0, buffer.get_size())
        picture.pts -= self.begin
        picture.dts = Gst.CLOCK_TIME_NONE
        self.source.emit('push-buffer', picture)

    def failure(self):
        """Why the film cannot be written, or None."""
        return text_of(self.pipeline.get_bus().pop_filtered(Gst.MessageType.ERROR), self.path)

    def finish(self):
        """The same, once all is written."""
        self.source.emit('end-of-stream')
        message = self.pipeline.get_bus().timed_pop_filtered(10 * Gst.SECOND,
                                                             Gst.MessageType.EOS | Gst.MessageType.ERROR)
        self.pipeline.set_state(Gst.State.NULL)
        return text_of(message, self.path)


def text_of(message, where):
    if message and message.type == Gst.MessageType.ERROR:
        return f'{where}: {message.parse_error()[0].message}'
    return None


def save_picture(sample, path):
    pipeline = Gst.parse_launch('appsrc name=picture ! videoconvert ! jpegenc ! filesink name=file')
    pipeline.get_by_name('picture').set_property('caps', sample.get_caps())
    pipeline.get_by_name('file').set_property('location', path)
    pipeline.set_state(Gst.State.PLAYING)
    pipeline.get_by_name('picture').emit('push-buffer', sample.get_buffer())
    pipeline.get_by_name('picture').emit('end-of-stream')
    pipeline.get_bus().timed_pop_filtered(10 * Gst.SECOND,
                                          Gst.MessageType.EOS | Gst.MessageType.ERROR)
    pipeline.set_state(Gst.State.NULL)


class Recorder:
    def __init__(self, options):
        self.folder = options.output
        self.before = int(options.before * Gst.SECOND)
        os.makedirs(self.folder, exist_ok=True)
        self.lines = open(os.path.join(self.folder, 'events.jsonl'), 'a+')
        self.lines.seek(0)
        self.told_lines = sum(1 for _ in self.lines)
        self.pipeline = make_pipeline(options)
        self.sinks = [self.pipeline.get_by_name(name) for name in FILMS]
        self.kept = collections.deque()
        self.told = collections.deque()  # of frames that are still in a queue
        self.films = None
        films = (re.fullmatch(r'(\d+)-video\.mkv', name) for name in os.listdir(self.folder))
        self.count = max((int(film[1]) for film in films if film), default=0)
        self.failure = None
        self.ended = False
        self.stopped = False

    def name(self, what, ending):
        return f'{self.count:03d}-{what}.{ending}'

    def begin(self):
        self.count += 1
        begin = self.kept[0][0].get_buffer().pts
        self.films = [Film(os.path.join(self.folder, self.name(film, 'mkv')), sample.get_caps(), begin)
                      for film, sample in zip(FILMS, self.kept[0])]
        for samples in self.kept:
            self.add(samples)

    def add(self, samples):
        for film, sample in zip(self.films, samples):
            film.add(sample.get_buffer())
            self.fail(film.failure())

    def end(self):
        for film in self.films or ():
            self.fail(film.finish())
        self.films = None

    def fail(self, why):
        if why and not self.failure:
            self.failure = why
            self.stop()

    def tell(self, fields):
        names = [fields.nth_field_name(i) for i in range(fields.n_fields())]
        line = {name: fields.get_value(name) for name in names if name != 'snapshot'}
        for name in TIMES:
            if name in line:
                line[name] = round(line[name] / Gst.SECOND, 3)
        for name in ('timestamp', 'running-time', 'first-running-time', 'standing-since'):
            line.pop(name, None)
        line['film'] = self.name('video', 'mkv') if self.films else None
        if 'snapshot' in names:
            line['picture'] = f'{self.told_lines:05d}-{line["event"]}.jpg'
            save_picture(fields.get_value('snapshot'), os.path.join(self.folder, line['picture']))
        print(json.dumps(line), file=self.lines, flush=True)
        self.told_lines += 1
        thing = f' {line["id"]}' if 'id' in line else ''
        self.say(f'{line["stream-time"]:8.2f} s: {line["event"]}{thing}')

    def say(self, text):
        try:
            print(text, flush=True)
        except BrokenPipeError:
            # Nobody reads any longer, as after `| head`: that ends the recording, too.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            self.stop()

    def see_messages(self, wait=0):
        bus = self.pipeline.get_bus()
        while message := bus.timed_pop_filtered(
                wait, Gst.MessageType.ELEMENT | Gst.MessageType.EOS | Gst.MessageType.ERROR):
            if message.type == Gst.MessageType.ERROR:
                self.failure = self.failure or text_of(message, message.src.name)
            if message.type != Gst.MessageType.ELEMENT:
                self.ended = True
                return
            if message.get_structure().get_name() == 'qdmdbackground-object':
                self.told.append(message)

    def take_events(self, newest):
        """Those of frames up to the one that was pulled last: the element tells before it sends."""
        while self.told:
            fields = self.told[0].get_structure()
            if newest < fields.get_value('timestamp') < Gst.CLOCK_TIME_NONE:
                return
            self.told.popleft()
            event = fields.get_string('event')
            if event == 'motion-begins' and not self.films and self.kept:
                self.begin()
            self.tell(fields)
            if event == 'motion-ends':
                self.end()

    def pull(self):
        """A frame's three pictures; None at the end."""
        samples = []
        for sink in self.sinks:
            while not (sample := sink.emit('try-pull-sample', Gst.SECOND // 5)):
                # The first film ends before the element has told what is gone: wait for the pipeline's end.
                self.see_messages(Gst.SECOND // 5 if sink.get_property('eos') else 0)
                if self.ended:
                    return None
                if self.stopped:
                    self.pipeline.send_event(Gst.Event.new_eos())
                    self.stopped = False
            samples.append(sample)
        return samples

    def stop(self, *_):
        self.stopped = True

    def run(self):
        signal.signal(signal.SIGINT, self.stop)
        signal.signal(signal.SIGTERM, self.stop)
        self.pipeline.set_state(Gst.State.PLAYING)
        while samples := self.pull():
            if self.films:
                self.add(samples)
            self.kept.append(samples)
            newest = samples[0].get_buffer().pts
            while newest - self.kept[0][0].get_buffer().pts > self.before:
                self.kept.popleft()
            self.see_messages()
            self.take_events(newest)
            if self.stopped:
                self.pipeline.send_event(Gst.Event.new_eos())
                self.stopped = False
        self.take_events(Gst.CLOCK_TIME_NONE)
        self.end()
        self.pipeline.set_state(Gst.State.NULL)
        self.lines.close()
        return self.failure


def main():
    options = parse_arguments()
    Gst.init(None)
    try:
        return Recorder(options).run()
    except GLib.Error as error:
        return error.message
    except OSError as error:
        return str(error)


sys.exit(main())
