# SPDX-License-Identifier: LGPL-2.1-or-later
"""A short animated picture of a video, its background and what moves alone, by the element at its defaults.

usage: animation.py VIDEO FOLDER PICTURE
"""
import subprocess
import sys

import numpy as np
from PIL import Image

WIDTH, HEIGHT = 288, 216
FIRST, STEP, COUNT = 100, 4, 36  # of 10 frames a second


def frames(video, elements, path):
    pipeline = (f'filesrc location={video} ! decodebin ! videoconvert ! {elements}videoconvert ! '
                f'videoscale method=lanczos ! video/x-raw,format=RGB,width={WIDTH},height={HEIGHT},'
                f'pixel-aspect-ratio=1/1 ! identity eos-after={FIRST + STEP * COUNT + 1} ! '
                f'filesink location={path}')
    subprocess.run(['gst-launch-1.0', '-q', *pipeline.split()], check=True)
    data = np.fromfile(path, np.uint8).reshape(-1, HEIGHT, WIDTH, 3)
    return data[FIRST:FIRST + STEP * COUNT:STEP]


def main(video, folder, picture):
    columns = [frames(video, elements, f'{folder}/{i}.raw') for i, elements in enumerate(
        ('', 'qdmdbackground ! ', 'qdmdbackground output=cutout ! '))]
    pages = [Image.fromarray(np.hstack(row)) for row in zip(*columns)]
    pages[0].save(picture, save_all=True, append_images=pages[1:], duration=160, loop=0, quality=55, method=6)


main(*sys.argv[1:])
