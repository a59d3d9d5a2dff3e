#!/usr/bin/python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Draws the spectrum of one window, as the paper does: eigenvalues in the unit circle, and |omega| by
amplitude, what was taken for background filled.

Usage: spectrum.py PICTURE.svg PIPELINE...
PIPELINE: what stands before the element, for gst-launch-1.0; the element's settings follow a word
"--", such as: spectrum.py a.svg qdmdscenesrc num-buffers=40 -- window-size=40
GST_PLUGIN_PATH_1_0 names the folder of the plugin.
"""
import math
import sys
import warnings

import gi

gi.require_version('Gst', '1.0')
from gi.repository import Gst  # noqa: E402


# Nothing else reads an array of a structure.
warnings.filterwarnings("ignore", category=DeprecationWarning)


def spectrum(source, settings):
    """(eigenvalue, amplitude, background) for each mode of the first window."""
    Gst.init(None)
    pipeline = Gst.parse_launch(f'{source} ! videoconvert ! qdmdbackground method=qdmd spectrum=true '
                                f'post-messages=true {settings} ! fakesink sync=false')
    try:
        return first_window(pipeline)
    finally:
        pipeline.set_state(Gst.State.NULL)


def first_window(pipeline):
    pipeline.set_state(Gst.State.PLAYING)
    kinds = Gst.MessageType.ELEMENT | Gst.MessageType.ERROR | Gst.MessageType.EOS
    found = None
    while found is None:
        message = pipeline.get_bus().timed_pop_filtered(Gst.CLOCK_TIME_NONE, kinds)
        if message.type == Gst.MessageType.ERROR:
            sys.exit(message.parse_error()[0].message)
        if message.type == Gst.MessageType.EOS:
            sys.exit('The clip is shorter than one window: set window-size.')
        facts = message.get_structure()
        if facts.get_name() == 'qdmdbackground' and facts.has_field('amplitudes'):
            real, imaginary, amplitudes, background = (
                [array.get_nth(k) for k in range(array.n_values)] for array in (
                    facts.get_array(name)[1] for name in ('eigenvalues-real', 'eigenvalues-imaginary',
                                                          'amplitudes', 'background')))
            found = [(complex(x, y), amplitude, chosen) for x, y, amplitude, chosen in zip(
                real, imaginary, amplitudes, background)]
    return found


def draw(path, modes):
    import matplotlib
    matplotlib.use('Agg')
    import matplotlib.pyplot as plt
    drawing, (plane, sizes) = plt.subplots(1, 2, figsize=(9, 3.6), layout='constrained')
    angles = [math.pi * k / 200 for k in range(201)]
    plane.plot([math.cos(a) for a in angles], [math.sin(a) for a in angles], color='#999999', lw=0.8)
    for background, colour in (False, '#0072B2'), (True, '#D55E00'):
        chosen = [mode for mode in modes if mode[2] == background]
        plane.plot([v.real for v, _, _ in chosen], [v.imag for v, _, _ in chosen], 'o', ms=4,
                   color=colour, label='background' if background else 'other modes')
        sizes.plot([math.hypot(math.log(abs(v)), math.atan2(v.imag, v.real)) for v, _, _ in chosen
                    if abs(v) > 0],
                   [amplitude for v, amplitude, _ in chosen if abs(v) > 0], 'o', ms=4, color=colour)
    plane.set(xlabel='real part', ylabel='imaginary part', aspect='equal')
    plane.legend(fontsize=7)
    sizes.set(xlabel='|omega|, rad/frame', ylabel='amplitude, levels', yscale='log')
    sizes.grid(alpha=0.3)
    drawing.savefig(path, metadata={'Date': None})


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    words = sys.argv[2:]
    cut = words.index('--') if '--' in words else len(words)
    draw(sys.argv[1], spectrum(' '.join(words[:cut]), ' '.join(words[cut + 1:])))


main()
