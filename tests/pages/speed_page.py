"""Times whole pipelines, in turns, and puts milliseconds a frame less identity into a page.

usage: speed_page.py PAGE VIDEO FOLDER      VIDEO may be empty: a simulated scene takes its place
"""
import os
import statistics
import subprocess
import sys
import time

import page

TURNS = 5
SIZES = ((320, 240, 700), (768, 576, 400), (1920, 1080, 150))
BYTES = {'RGBA': 4, 'I420': 1.5, 'NV12': 1.5}
MASK = 'qdmdbackground output=mask'
# name: format, elements. Others are compared with the first one of their format.
CASES = {
    'identity': ('RGBA', 'identity'),
    'segmentation': ('RGBA', 'segmentation method=mog2 test-mode=true'),
    'default': ('RGBA', 'qdmdbackground'),
    'default, `output=mask`': ('RGBA', MASK),
    '`stabilize=off output=mask`': ('RGBA', f'{MASK} stabilize=off'),
    '`mode=live output=mask`': ('RGBA', f'{MASK} mode=live'),
    '`method=qdmd output=mask`': ('RGBA', f'{MASK} method=qdmd'),
    'I420 identity': ('I420', 'identity'),
    'I420, `output=mask`': ('I420', MASK),
    'I420 through videoconvert to RGBA, `output=mask`':
        ('I420', f'videoconvert ! video/x-raw,format=RGBA ! {MASK}'),
    'I420, `mode=live output=mask`': ('I420', f'{MASK} mode=live'),
    'NV12 identity': ('NV12', 'identity'),
    'NV12, `output=mask`': ('NV12', MASK),
}


def launch(pipeline):
    start = time.perf_counter()
    subprocess.run(['gst-launch-1.0', '-q', *pipeline.split()], check=True)
    return time.perf_counter() - start


def raw(video, folder, form, width, height, frames):
    path = f'{folder}/{width}x{height}.{form}'
    source = f'filesrc location={video} ! decodebin' if video else 'qdmdscenesrc scene=basic'
    if not os.path.exists(path):
        launch(f'{source} ! videoconvert ! videoscale ! '
               f'video/x-raw,format={form},width={width},height={height} ! '
               f'identity eos-after={frames} ! filesink location={path}')
    return path


def milliseconds(video, folder, width, height, frames):
    """{case: what it takes a frame, beyond identity}"""
    seconds = {name: [] for name in CASES}
    for turn in range(TURNS):
        print(f'\r{width}x{height}: turn {turn + 1} of {TURNS} ', end='', file=sys.stderr)
        for name, (form, elements) in CASES.items():
            size = int(width * height * BYTES[form])
            path = raw(video, folder, form, width, height, frames)
            source = (f'filesrc location={path} blocksize={size} ! rawvideoparse format={form.lower()} '
                      f'width={width} height={height} framerate=25/1')
            seconds[name].append(launch(f'{source} ! {elements} ! fakesink sync=false')
                                 * 1000 * size / os.path.getsize(path))
    median = {name: statistics.median(values) for name, values in seconds.items()}
    of_format = {form: name for name, (form, elements) in CASES.items() if elements == 'identity'}
    return {name: median[name] - median[of_format[form]]
            for name, (form, elements) in CASES.items() if elements != 'identity'}


if __name__ == '__main__':
    target, clip, results = sys.argv[1:]
    columns = [milliseconds(clip, results, *size) for size in SIZES]
    print(file=sys.stderr)
    rows = [[name] + [f'{column[name]:.2f} ({column["segmentation"] / column[name]:.2f})'
                      for column in columns] for name in columns[0]]
    head = ['ms a frame (times as fast as `segmentation`)', *(f'{w}x{h}' for w, h, _ in SIZES)]
    page.put(target, {'speed': page.table(head, rows)})
