# SPDX-License-Identifier: LGPL-2.1-or-later
"""Runs every program of examples/ and looks at what it leaves.

Usage: programs_test.py SOURCE_ROOT EMBED DEMO TWO_PADS      (the programs that are built)
"""
import json
import pathlib
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time

import common

# demo.sh installs packages and builds: continuous integration runs it after these tests.
# subtract.cpp is built and run by tests/install, archive by tests/archive.
KNOWN = {'archive', 'demo.cpp', 'demo.sh', 'embed.cpp', 'frames.py', 'meson.build', 'pipelines.md', 'record.py', 'recorder.py',
         'subtract.cpp', 'two_pads.cpp', 'watch.py'}
WIDTH, HEIGHT = 320, 240

root, embed, demo, two_pads = (pathlib.Path(argument).resolve() for argument in sys.argv[1:])
examples = root / 'examples'


def run(folder, *command, expect=0):
    done = subprocess.run([str(word) for word in command], cwd=folder, timeout=120,
                          capture_output=True, text=True)
    assert done.returncode == expect, \
        f'exit status {done.returncode}, expected {expect}\n{done.stdout}{done.stderr}'
    assert 'Traceback' not in done.stderr, done.stderr
    return done.stdout, done.stderr


def check_close(one, other, most):
    assert len(one) == len(other), f'{len(one)} and {len(other)} bytes'
    difference = sum(abs(a - b) for a, b in zip(one, other)) / len(one)
    assert difference < most, f'mean difference {difference:.2f} levels, at most {most} expected'


def all_are_known(folder):
    names = {path.name for path in examples.iterdir() if path.name != '__pycache__'}
    assert names == KNOWN, f'no test for {names - KNOWN}, no example {KNOWN - names}'


def embed_simulated(folder):
    said, _ = run(folder, embed, '--frames', 200, '--plate', 'wall.png', '--save', 'sent.avi')
    for output in ('background', 'foreground', 'mask', 'cutout'):
        assert f'-> {output}' in said, said
    # The wall behind the square, as embed.cpp paints it.
    wall = bytes(value for y in range(HEIGHT) for x in range(WIDTH)
                 for value in (60 + x % 64, 90 + y // 3, 120))
    check_close(common.picture_of(folder / 'wall.png'), wall, 1)
    assert common.count_frames(folder / 'sent.avi') == 200


def embed_film(folder):
    said, _ = run(folder, embed, '--plate', 'street.png', 'film.avi')
    assert '3 solves' in said, said
    assert (folder / 'street.png').stat().st_size > 1000


def embed_errors(folder):
    said, _ = run(folder, embed, '--help')
    assert '--plate' in said
    run(folder, embed, '--window-size', 1, expect=2)
    run(folder, embed, '--no-such-option', expect=2)
    _, errors = run(folder, embed, 'missing.avi', expect=1)
    assert 'missing.avi' in errors, errors
    _, errors = run(folder, embed, '--plate', 'no/folder/wall.png', expect=1)
    assert 'no/folder' in errors, errors


def two_pads_simulated(folder):
    said, _ = run(folder, two_pads)
    shares = [float(share) for share in re.findall(r's: foreground +([\d.]+) %', said)]
    assert len(shares) == 150, said
    assert 0.5 < sum(shares) / len(shares) < 20, said


def two_pads_film(folder):
    said, _ = run(folder, two_pads, 'film.avi')
    assert said.count('foreground') > 100, said
    _, errors = run(folder, two_pads, 'missing.avi', expect=1)
    assert 'missing.avi' in errors, errors


def frames_with_a_gap(folder):
    for arguments in ((), ('--gap',)):
        said, _ = run(folder, examples / 'frames.py', *arguments)
        match = re.fullmatch(r'150 masks, ([\d.]+) % foreground\n', said)
        # The square is 4.7 % of the picture.
        assert match and 4 < float(match[1]) < 6, said


def watch_simulated(folder):
    said, _ = run(folder, examples / 'watch.py', '--frames', 120, '--plate', 'scene.png')
    regions = re.findall(r's: x (\d+), y (\d+), w (\d+), h (\d+), area (\d+), mean residual \d',
                         said)
    assert len(regions) > 50, said
    for x, y, w, h, area in (map(int, region) for region in regions):
        assert x + w <= WIDTH and y + h <= HEIGHT and 100 <= area <= w * h, (x, y, w, h, area)
    truth = common.last_picture('qdmdscenesrc scene=basic truth=background num-buffers=120')
    check_close(common.picture_of(folder / 'scene.png'), truth, 1)


def watch_film(folder):
    said, _ = run(folder, examples / 'watch.py', 'film.avi', '--plate', 'film.png')
    assert said.count(' s: x ') > 50, said
    assert (folder / 'film.png').stat().st_size > 1000


def watch_errors(folder):
    run(folder, examples / 'watch.py', '--help')
    _, errors = run(folder, examples / 'watch.py', 'missing.avi', expect=1)
    assert 'missing.avi' in errors, errors
    _, errors = run(folder, examples / 'watch.py', '--frames', 20, '--plate', 'no/plate.png',
                    expect=1)
    assert 'no/plate.png' in errors, errors


def record_events(folder):
    said, errors = run(folder, examples / 'recorder.py',
                       'qdmdscenesrc scene=noise,stop,abandon num-buffers=500', '--output', 'events')
    lines = [json.loads(line) for line in (folder / 'events' / 'events.jsonl').open()]
    events = [line['event'] for line in lines]
    for event in 'motion-begins', 'appeared', 'stopped', 'motion-ends', 'moved-on', 'left-behind':
        assert event in events, said + errors
    assert events[0] == 'motion-begins', events
    assert events.count('motion-begins') == events.count('motion-ends'), events
    told = [(line['id'], line['event']) for line in lines if line['event'] in ('appeared', 'gone')]
    assert len(told) == len(set(told)), 'each thing appears once, and is gone once'
    assert {thing for thing, event in told if event == 'appeared'} == {
        thing for thing, event in told if event == 'gone'}, f'each thing that appears is gone at the end: {told}'
    for line in lines:
        if 'picture' in line:
            assert (folder / 'events' / line['picture']).stat().st_size > 300
    films = {line['film'] for line in lines} - {None}
    assert len(films) == events.count('motion-begins') > 1, films
    # From two seconds before the frame that told of a motion to the one that told of its end.
    time_of = {(line['film'], line['event']): line['stream-time'] for line in lines}
    for film in films:
        begin, end = (time_of[film, f'motion-{what}'] for what in ('begins', 'ends'))
        frames = round((end - max(0, begin - 2)) * 25) + 1
        for kind in 'video', 'background', 'mask':
            path = folder / 'events' / film.replace('video', kind)
            assert common.count_frames(path) == frames, f'{path} has not {frames} frames'
    return f'{len(lines)} events, {len(films)} films'


def record_for_nobody(folder):
    recorder = subprocess.Popen(
        [examples / 'recorder.py', 'qdmdscenesrc scene=basic', '--output', 'unread'],
        cwd=folder, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert recorder.stdout.readline()
    recorder.stdout.close()
    errors = recorder.stderr.read()
    assert recorder.wait(timeout=60) == 0 and not errors, errors
    films = {path: path.stat().st_size for path in (folder / 'unread').glob('*.mkv')}
    lines = (folder / 'unread' / 'events.jsonl').read_text()
    assert films, 'what was recorded is kept'
    run(folder, examples / 'recorder.py', 'qdmdscenesrc scene=basic num-buffers=250', '--output', 'unread')
    assert films == {path: path.stat().st_size for path in films}, 'a second recording goes on'
    assert len(list((folder / 'unread').glob('*.mkv'))) > len(films)
    assert (folder / 'unread' / 'events.jsonl').read_text().startswith(lines)
    return 'ends, and goes on'


def watch_for_nobody(folder):
    watch = subprocess.Popen([examples / 'watch.py', 'film.avi'], cwd=folder, text=True,
                             stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert watch.stdout.readline()
    watch.stdout.close()
    errors = watch.stderr.read()
    watch.wait(timeout=60)
    assert not errors, errors


def record_until_terminated(folder):
    (folder / 'ended').mkdir()
    (folder / 'ended' / '1234-video.mkv').write_bytes(b'')
    recorder = subprocess.Popen([examples / 'recorder.py', 'qdmdscenesrc scene=basic', '--output', 'ended'], cwd=folder,
                                text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert recorder.stdout.readline()
    recorder.terminate()
    _, errors = recorder.communicate(timeout=60)
    assert recorder.returncode == 0 and not errors, errors
    assert common.count_frames(folder / 'ended' / '1235-mask.mkv') > 0
    return 'the film is whole'


def record_without_room(folder):
    def few_bytes():
        resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

    done = subprocess.run([examples / 'recorder.py', 'qdmdscenesrc scene=basic num-buffers=400', '--output', 'full'],
                          cwd=folder, timeout=120, capture_output=True, text=True, preexec_fn=few_bytes)
    assert done.returncode == 1 and 'Could not write' in done.stderr, done.stderr
    assert 'Traceback' not in done.stderr, done.stderr
    return done.stderr.strip()


def record_motion(folder):
    recorder = subprocess.Popen([examples / 'record.py', '--output', 'motion.mkv'], cwd=folder,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    # Some hundred frames of 40 kB. A minute is for a recorder that hangs.
    film = folder / 'motion.mkv'
    hung = time.monotonic() + 60
    while not film.exists() or film.stat().st_size < 4_000_000:
        if recorder.poll() is not None or time.monotonic() > hung:
            recorder.kill()
            raise AssertionError('nothing is recorded: ' + ''.join(recorder.communicate()))
        time.sleep(0.05)
    recorder.send_signal(signal.SIGINT)
    said, errors = recorder.communicate(timeout=60)
    assert recorder.returncode == 0, said + errors
    assert 'recording' in said, said
    frames = common.count_frames(film)
    assert frames > 50, f'{frames} frames\n{said}'


def record_nothing(folder):
    said, _ = run(folder, examples / 'record.py', 'qdmdscenesrc truth=background is-live=true',
                  '--output', 'nothing.mkv', '--seconds', 4)
    assert 'Nothing moved.' in said, said
    assert not (folder / 'nothing.mkv').exists()


def readme_gives_frames_and_masks(folder):
    """The program of README.md, which reads street.avi; then what it holds at the end."""
    program, = re.findall(r'^```python\n(.*?)^```', (root / 'README.md').read_text(), re.M | re.S)
    (folder / 'street.avi').write_bytes((folder / 'film.avi').read_bytes())
    seen = '    print(frame.shape, mask.shape, len(people) == (mask > 0).sum(), mask.mean())\n'
    loop, after = program.split('\nerror = ')
    said, _ = run(folder, sys.executable, '-c', f'{loop}\n{seen}error = {after}')
    lines = said.splitlines()
    assert len(lines) == common.FILM_FRAMES, said
    assert all(line.startswith(f'({HEIGHT}, {4 * WIDTH}) ({HEIGHT}, {WIDTH}) True') for line in lines), said
    assert sum(float(line.split()[-1]) > 0 for line in lines) > common.FILM_FRAMES / 2, said
    (folder / 'street.avi').unlink()
    _, errors = run(folder, sys.executable, '-c', program, expect=1)
    assert 'No such file' in errors and 'CRITICAL' not in errors, errors


def record_errors(folder):
    run(folder, examples / 'record.py', '--help')
    _, errors = run(folder, examples / 'record.py', 'v4l2src device=/dev/no-such-camera', expect=1)
    assert 'no-such-camera' in errors, errors
    _, errors = run(folder, examples / 'record.py', 'no-such-element', expect=1)
    assert 'no-such-element' in errors, errors


def run_demo(folder):
    run(folder, demo, '--scene', 'basic', '--frames', 40, '--window-size', 20, '--output-dir', 'demo')
    for name in ('background.png', 'separated.mp4', 'contact-sheet.png'):
        assert (folder / 'demo' / name).stat().st_size > 1000, name


def messages_as_documented(folder):
    page = (root / 'docs' / 'messages.md').read_text()
    table = page.split('\n## Messages\n')[1].split('\n## ')[0]
    documented = {name: kind for names, kind in re.findall(r'^\| (`.*`) \| (\w+)', table, re.M)
                  for name in re.findall('`(.*?)`', names)}
    pipeline = common.Gst.parse_launch(
        'qdmdscenesrc num-buffers=30 ! qdmdbackground window-size=10 post-messages=true ! fakesink')
    pipeline.set_state(common.Gst.State.PLAYING)
    names = {'guint64': 'uint64', 'guint': 'uint', 'gdouble': 'double',
             'gboolean': 'boolean', 'GstQdmdBackgroundSolver': 'enum', 'GstQdmdBackgroundEstimator': 'enum'}
    try:
        for _ in range(3):
            fields = common.element_message(pipeline, 'qdmdbackground')
            assert fields, 'no message came'
            posted = {}
            for number in range(fields.n_fields()):
                name = fields.nth_field_name(number)
                posted[name] = names.get(fields.get_field_type(name).name)
            assert posted == documented, f'posted {posted}, documented {documented}'
    finally:
        pipeline.set_state(common.Gst.State.NULL)


def main():
    checks = [all_are_known, embed_simulated, embed_film, embed_errors, frames_with_a_gap, watch_simulated, watch_film,
              watch_errors, record_events, record_for_nobody, watch_for_nobody, record_until_terminated,
              record_without_room, record_motion, record_nothing, record_errors, messages_as_documented,
              readme_gives_frames_and_masks, two_pads_simulated, two_pads_film, run_demo]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        common.make_film(folder / 'film.avi')
        return common.report([(check.__name__.replace('_', ' '),
                               lambda check=check: check(folder)) for check in checks])


sys.exit(main())
