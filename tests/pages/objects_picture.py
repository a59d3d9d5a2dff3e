# SPDX-License-Identifier: LGPL-2.1-or-later
"""Draws docs/objects.md's picture from a real run: a frame of a street with the numbers of things,
and a time line of what was told of them.

Usage: objects_picture.py VIDEO FRAMES FRAME PICTURE
"""
import sys

import cv2
import gi
import numpy as np

gi.require_version('Gst', '1.0')
gi.require_version('GstVideo', '1.0')
from gi.repository import Gst, GstVideo

COLOURS = {'moves': (60, 160, 60), 'stands': (40, 140, 230), 'gone': (90, 90, 90)}


def run(video, frames, wanted):
    """The frame that is wanted, its regions, and all events."""
    pipeline = Gst.parse_launch(
        'filesrc name=file ! decodebin ! videoconvert ! video/x-raw,format=BGR ! tee name=t '
        't. ! queue ! appsink name=frames sync=false max-buffers=4 '
        't. ! queue ! qdmdseparate name=s mode=live regions=true object-messages=true '
        's.mask ! queue ! appsink name=masks sync=false max-buffers=4')
    pipeline.get_by_name('file').set_property('location', video)
    pipeline.set_state(Gst.State.PLAYING)
    picture, regions, events = None, [], []
    for number in range(frames):
        frame = pipeline.get_by_name('frames').emit('pull-sample')
        mask = pipeline.get_by_name('masks').emit('pull-sample')
        if not frame or not mask:
            break
        while message := pipeline.get_bus().pop_filtered(Gst.MessageType.ELEMENT):
            fields = message.get_structure()
            if fields.get_name() == 'qdmdbackground-object' and fields.has_field('id'):
                events.append((fields.get_uint64('stream-time').value / Gst.SECOND,
                               fields.get_uint('id').value, fields.get_string('event')))
        if number != wanted:
            continue
        caps = frame.get_caps().get_structure(0)
        width, height = caps.get_int('width').value, caps.get_int('height').value
        data = frame.get_buffer().extract_dup(0, frame.get_buffer().get_size())
        picture = np.frombuffer(data, np.uint8).reshape(height, -1)[:, :3 * width]
        picture = picture.reshape(height, width, 3).copy()
        for thing in range(1, 1000):
            region = GstVideo.buffer_get_video_region_of_interest_meta_id(mask.get_buffer(), thing)
            if region and region.get_param('foreground').get_boolean('appeared').value:
                regions.append((thing, region.x, region.y, region.w, region.h))
    pipeline.set_state(Gst.State.NULL)
    return picture, regions, events


def draw_frame(picture, regions):
    for thing, x, y, w, h in regions:
        cv2.rectangle(picture, (x, y), (x + w, y + h), (60, 60, 230), 2)
        cv2.putText(picture, str(thing), (x, max(20, y - 6)), cv2.FONT_HERSHEY_SIMPLEX, 0.8,
                    (255, 255, 255), 2, cv2.LINE_AA)


def draw_time_line(events, seconds, width):
    things = sorted({thing for _, thing, _ in events})
    row, left = 22, 60
    lines = np.full((row * (len(things) + 2), width, 3), 255, np.uint8)
    at = lambda time: int(left + (width - left - 90) * time / seconds)
    for k, thing in enumerate(things):
        y = row * k + row // 2 + 4
        cv2.putText(lines, str(thing), (20, y + 5), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (0, 0, 0), 1,
                    cv2.LINE_AA)
        state, since, last = None, 0, ''
        for time, _, event in [one for one in events if one[1] == thing] + [(seconds, thing, 'end')]:
            if state:
                cv2.rectangle(lines, (at(since), y - 6), (at(time), y + 6), COLOURS[state], -1)
            state = {'appeared': 'moves', 'moved-on': 'moves', 'stopped': 'stands',
                     'left-behind': 'stands'}.get(event)
            since = time
            if event == 'removed':
                cv2.circle(lines, (at(time), y), 6, (200, 60, 160), -1)
            last = event if event != 'end' else last
            end = at(time)
        cv2.putText(lines, last, (end + 8, y + 5), cv2.FONT_HERSHEY_SIMPLEX, 0.4, (60, 60, 60), 1,
                    cv2.LINE_AA)
    y = row * len(things) + row
    for time in range(0, int(seconds) + 1, 5):
        cv2.line(lines, (at(time), 0), (at(time), y - 10), (215, 215, 215), 1)
        cv2.putText(lines, f'{time} s', (at(time) - 8, y + 6), cv2.FONT_HERSHEY_SIMPLEX, 0.45,
                    (0, 0, 0), 1, cv2.LINE_AA)
    return lines


def main():
    video, frames, wanted, path = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
    Gst.init(None)
    picture, regions, events = run(video, frames, wanted)
    for time, thing, event in events:
        print(f'{time:6.1f} s  {event:12} {thing}')
    draw_frame(picture, regions)
    lines = draw_time_line(events, frames / 10, picture.shape[1])
    cv2.imwrite(path, np.vstack([picture, lines]), [cv2.IMWRITE_JPEG_QUALITY, 85])


main()
