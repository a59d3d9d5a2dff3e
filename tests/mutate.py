#!/usr/bin/python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Whether the suite notices small mistakes: makes one at a time in core/, in a copy of the tree.

  tests/mutate.py [--count 40] [--seed 1] [--jobs 2] [--only REGEX] [--missed LOG]

A mistake is an operator or a constant that is changed (< to <=, + to -, 1 to 2, && to || ..). What
includes the file is built anew and the core tests that link it run until one fails. Prints each
mistake and who noticed it: a test, the compiler, or nobody. Ends with 1 where fewer than 85 % are
noticed. Takes minutes for each. --missed tries those again that an earlier run's output calls missed.
"""

import argparse
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
COPY = ROOT / 'build-mutate'
# What an operator becomes. Only those with spaces around them: no pointers, templates, includes.
OPERATORS = {' < ': ' <= ', ' <= ': ' < ', ' > ': ' >= ', ' >= ': ' > ', ' == ': ' != ',
             ' != ': ' == ', ' + ': ' - ', ' - ': ' + ', ' * ': ' + ', ' / ': ' * ', ' && ': ' || ',
             ' || ': ' && ', ' += ': ' -= ', ' -= ': ' += ', '++': '--'}
NUMBER = re.compile(r'(?<![\w.])(\d+)(\.\d+)?(?![\w.])')
# Lines that only say or name something.
SKIPPED = re.compile(r'^\s*(//|#|namespace|using |template|static_assert|assert)|HWY_|constexpr const char|"')
# What is told to users and other parts of the house is for all tests; the rest for those near it.
TESTS = {
    'quaternion': 'quaternion double_double factorization hessenberg pencil schur svd dmd',
    'gram': 'gram gram_slices kernel shared_chroma dmd',
    'dmd': 'dmd dmd_degenerate solver channel_dmd estimator error_bound modes leading_spectrum',
    'passes': 'passes grid chroma combine majority mask_passes soft_mask resample robust_parts robust_fill picture median_picture '
              'parts_memory',
    'frames': 'frame_store shared_store engine sample_step memory',
    'model': 'background learnt learnt_file engine_output live',
    'learn': 'robust_parts robust_memory absorb another_scene robust robust_fill median_picture sample_step freeze '
             'parts_memory memory',
    'foreground': 'decision ignored soft_mask mask_passes picture engine_output regions parts_memory band',
    'engine': 'engine engine_output pacing live_plan live live_schedule freeze time_budget learnt '
              'another_scene memory',
    'align': 'motion stabilize resample parts_memory',
    'parallel': 'pool side_thread workers gram_slices',
    'base': 'clock engine',
    'library': 'engine',
    'scene': 'scene scene_description scene_streams scene_objects scene_foliage scene_trees scene_ground scene_light scene_exposure scene_camera',
    'metrics': 'metrics',
}
LAST = 'golden'  # where nobody near it has noticed


def places(only):
    """(file, line number, start, end, what is put there) of every change that could be made."""
    for path in sorted((ROOT / 'core').rglob('*')):
        name = str(path.relative_to(ROOT))
        if path.suffix not in ('.cpp', '.h') or (only and not re.search(only, name)):
            continue
        for number, line in enumerate(path.read_text().split('\n')):
            code = line.split('//')[0]
            if SKIPPED.search(code):
                continue
            for old, new in OPERATORS.items():
                for found in re.finditer(re.escape(old), code):
                    yield name, number, found.start(), found.end(), new
            for found in NUMBER.finditer(code):
                more = str(int(found.group(1)) + 1) + (found.group(2) or '')
                yield name, number, found.start(), found.end(), more


def described(name, number, start, end, new):
    before = (ROOT / name).read_text().split('\n')[number]
    after = before[:start] + new + before[end:]
    return f'{name}:{number + 1}: {before.strip()}   ->   {after.strip()}'


def run(command, seconds):
    try:
        return subprocess.run(command, cwd=COPY, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              timeout=seconds, check=False).returncode
    except subprocess.TimeoutExpired:
        return -1


def who_notices(name, jobs):
    room = name.split('/')[1]
    # One after the other: what the first of them notices needs no other program.
    for test in TESTS.get(room, 'engine').split() + [LAST]:
        target = f'tests/core/{test}_test'
        if run(['ninja', f'-j{jobs}', '-C', 'build', target], 3600) != 0:
            return 'the compiler'
        # A mistake may make it hang.
        if run([f'build/{target}', '--gtest_brief=1'], 300) != 0:
            return target.split('/')[-1]
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    parser.add_argument('--count', type=int, default=40)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--only', help='files whose names match')
    parser.add_argument('--missed', type=pathlib.Path, metavar='LOG',
                        help='only those that this output of an earlier run calls missed')
    wanted = parser.parse_args()

    files = subprocess.run(['git', 'ls-files'], cwd=ROOT, check=True, capture_output=True, text=True)
    for name in files.stdout.split('\n'):
        if not name or name.startswith('docs/'):
            continue
        to = COPY / name
        to.parent.mkdir(parents=True, exist_ok=True)
        if not to.exists() or to.read_bytes() != (ROOT / name).read_bytes():
            shutil.copy(ROOT / name, to)
    (COPY / 'docs').mkdir(exist_ok=True)
    if not (COPY / 'build' / 'build.ninja').exists():
        # As everybody builds it: what was compiled before is found again.
        subprocess.run(['meson', 'setup', 'build', '-Dtests=enabled', '-Dscene=enabled'],
                       cwd=COPY, check=True, stdout=subprocess.DEVNULL,
                       env={**os.environ, 'CXX': os.environ.get('CXX', 'ccache g++')})

    every = list(places(wanted.only))
    random.Random(wanted.seed).shuffle(every)
    if wanted.missed:
        missed = set(wanted.missed.read_text().split('\n'))
        every = [place for place in every if f'MISSED: {described(*place)}' in missed]
    else:
        every = every[:wanted.count]
    noticed = 0
    for name, number, start, end, new in every:
        path = COPY / name
        original = (ROOT / name).read_text()
        lines = original.split('\n')
        lines[number] = lines[number][:start] + new + lines[number][end:]
        path.write_text('\n'.join(lines))
        by = who_notices(name, wanted.jobs)
        path.write_text(original)
        noticed += by is not None
        print(f'{"noticed by " + by if by else "MISSED"}: '
              f'{described(name, number, start, end, new)}', flush=True)
    print(f'{noticed} of {len(every)} noticed')
    return 0 if noticed >= 0.85 * len(every) else 1


if __name__ == '__main__':
    sys.exit(main())
