#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""How a pipeline of 4K frames ends under limits of its address space.

  GST_PLUGIN_PATH_1_0=build/gst tests/gst/memory_limits.py [--from 250 --to 700 --steps 19]

Prints for each limit (MB) and number of threads the exit status, who ended it, and the last line. Of
those that ended by a signal, a stack is taken again under gdb, where that is installed: `ours` has
code of libgstqdmd.so in the thread that ended the process, `other` has none (GLib ends the process
where any element gets no memory from it). Exits with 1 if one was ours.
"""

import argparse
import collections
import re
import shutil
import signal
import subprocess
import sys

PIPELINE = (
    'videotestsrc num-buffers=12 ! video/x-raw,format=RGB,width=3840,height=2160 ! '
    'qdmdbackground window-size=4 n-threads={threads} {more} ! fakesink'
)


def run(command, limit, timeout):
    limited = ['prlimit', f'--as={limit << 20}', *command]
    done = subprocess.run(limited, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          errors='replace', timeout=timeout, check=False)
    return done.returncode, done.stdout


def who_ended_it(command, limit, timeout):
    """`ours` or `other`, by the stack of the thread that ended the process."""
    if not shutil.which('gdb'):
        return '?'
    # The limit is the program's, not gdb's.
    gdb = ['gdb', '-q', '-batch', '-ex', f'set exec-wrapper prlimit --as={limit << 20}',
           '-ex', 'run', '-ex', 'bt 60', '--args', *command]
    done = subprocess.run(gdb, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          errors='replace', timeout=timeout, check=False)
    frames = [line for line in done.stdout.splitlines() if line.startswith('#')]
    if not frames:
        return '?'
    if any('qdmd' in frame for frame in frames):
        return 'ours'
    named = [frame.split(' in ')[-1] for frame in frames if re.search(r' in [a-z]', frame)]
    return f'other ({named[-1][:60] if named else frames[-1][:60]})'


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--from', dest='first', type=int, default=250)
    parser.add_argument('--to', dest='last', type=int, default=700)
    parser.add_argument('--steps', type=int, default=19)
    parser.add_argument('--threads', type=int, nargs='+', default=[1, 4])
    parser.add_argument('--more', default='', help='properties of qdmdbackground')
    parser.add_argument('--timeout', type=float, default=120)
    args = parser.parse_args()

    ends = collections.Counter()
    for threads in args.threads:
        pipeline = PIPELINE.format(threads=threads, more=args.more)
        command = [shutil.which('gst-launch-1.0'), '-q', *pipeline.split()]
        for step in range(args.steps):
            limit = args.first + (args.last - args.first) * step // max(1, args.steps - 1)
            try:
                code, output = run(command, limit, args.timeout)
            except subprocess.TimeoutExpired:
                code, output = None, ''
            lines = [line for line in output.splitlines() if line.strip()]
            if code is None:
                end = 'hangs'
            elif code < 0:
                # No other element here is written in C++.
                who = 'ours' if 'terminate called' in output else who_ended_it(
                    command, limit, args.timeout)
                end = f'{signal.Signals(-code).name} {who}'
            elif re.search(r'ERROR: from element \S*qdmdbackground', output):
                end = 'our error'
            elif 'ERROR' in output:
                end = "another's error"
            else:
                end = 'ok' if code == 0 else 'status'
            ends[end.split(' (')[0]] += 1
            # After an error, gst-launch has more to say.
            said = [line for line in lines if 'ERROR' in line] or lines[-1:] or ['']
            print(f'{limit} MB, {threads} threads: status {code}, {end}; {said[0][:160]}',
                  flush=True)
    for end, count in ends.most_common():
        print(f'{count:3} {end}')
    return 1 if any('ours' in end or end == 'hangs' for end in ends) else 0


if __name__ == '__main__':
    sys.exit(main())
