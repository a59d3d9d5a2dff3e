"""Runs qdmd-archive with mpirun: whatever the number of processes, and however often it is killed,
what it writes is what one process writes, and what the element gives of the same window.

Usage: archive_test.py ARCHIVE MPIRUN [WORD...]     WORD: only cases with one of them in the name
       QDMD_ARCHIVE_LONG=1: more kills and numbers of processes
"""
import json
import os
import pathlib
import random
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import zlib

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / 'examples'))
import common
from common import Gst

import gi

gi.require_version('GstApp', '1.0')
gi.require_version('GstVideo', '1.0')
from gi.repository import GstApp, GstVideo  # noqa: F401  (methods of appsrc and appsink)

archive, mpirun = (str(pathlib.Path(argument).resolve()) for argument in sys.argv[1:3])
LONG = bool(os.environ.get('QDMD_ARCHIVE_LONG'))
# One machine only: no launcher and no network.
JOB = ['--oversubscribe', '--allow-run-as-root', '--bind-to', 'none', '--mca', 'plm', 'isolated',
       '--mca', 'btl', 'self,vader', '--mca', 'oob_tcp_if_include', 'lo', '--mca',
       'btl_vader_single_copy_mechanism', 'none', '--mca', 'mpi_yield_when_idle', '1']
WIDTH, HEIGHT, FRAMES, WINDOW = 161, 123, 50, 20
LONG_FRAMES = 97


def command(processes, *words):
    words = [str(word) for word in words]
    if processes == 0:  # by itself, without mpirun
        return [archive, *words]
    return [mpirun, '-q', '-n', str(processes), *JOB, archive, *words]


def run(folder, processes, *words, expect=0, env=None):
    done = subprocess.run(command(processes, *words), cwd=folder, capture_output=True, text=True,
                          timeout=240, env=env)
    text = done.stdout + done.stderr
    if expect == 0:
        assert done.returncode == 0, f'exit status {done.returncode}\n{text}'
    elif processes == 0:
        assert done.returncode == expect, f'exit status {done.returncode}\n{text}'
    else:
        assert done.returncode != 0, f'it ended well\n{text}'
    return text


def samples_of(end):
    while sample := end.try_pull_sample(30 * Gst.SECOND):
        yield sample


def bytes_of(sample):
    """Of a frame, without what pads rows."""
    info = GstVideo.VideoInfo.new_from_caps(sample.get_caps())
    data = sample.get_buffer().extract_dup(0, sample.get_buffer().get_size())
    rows, component = [], 0
    for plane in range(info.finfo.n_planes):
        while info.finfo.plane[component] != plane:
            component += 1
        row = -(-info.width >> info.finfo.w_sub[component]) * info.finfo.pixel_stride[component]
        for y in range(-(-info.height >> info.finfo.h_sub[component])):
            begin = info.offset[plane] + y * info.stride[plane]
            rows.append(data[begin:begin + row])
    return b''.join(rows)


def frames_of(description, pixel_format=None):
    """The frames that a pipeline gives: (time in ms, bytes)."""
    convert = f' ! videoconvert ! video/x-raw,format={pixel_format}' if pixel_format else ''
    pipeline = Gst.parse_launch(f'{description}{convert} ! appsink name=end sync=false')
    pipeline.set_state(Gst.State.PLAYING)
    frames = [(round(sample.get_buffer().pts / 1e6), bytes_of(sample))
              for sample in samples_of(pipeline.get_by_name('end'))]
    message = pipeline.get_bus().pop_filtered(Gst.MessageType.ERROR)
    pipeline.set_state(Gst.State.NULL)
    if message:
        raise RuntimeError(f'{description}: {message.parse_error()[0].message}')
    return frames


def video(path, pixel_format=None):
    return frames_of(f'filesrc location="{path}" ! decodebin', pixel_format)


def make_clip(path, frames=FRAMES, width=WIDTH, height=HEIGHT, pixels='I420', seed=3,
              encoder='avenc_ffv1'):
    common.play(f'qdmdscenesrc scene=basic,noise=2,trees seed={seed} num-buffers={frames} ! '
                f'video/x-raw,width={width},height={height},framerate=25/1 ! videoconvert ! '
                f'video/x-raw,format={pixels} ! {encoder} ! matroskamux ! '
                f'filesink location="{path}"').set_state(Gst.State.NULL)


def outputs(folder, name):
    return ['--background', folder / f'{name}.png', '--mask', folder / f'{name}-mask.mkv',
            '--foreground', folder / f'{name}-foreground.mkv']


def results(folder, name):
    """All that a job has written."""
    pictures = {path.name[len(name):]: video(path)[0][1]
                for path in sorted(folder.glob(f'{name}*.png'))}
    return (pictures, video(folder / f'{name}-mask.mkv', 'GRAY8'),
            video(folder / f'{name}-foreground.mkv'))


def leftovers(folder, name):
    return [path.name for path in folder.glob(f'{name}*')
            if path.suffix in ('.parts', '.tmp', '.progress')]


def compare(one, other, what):
    assert one[0].keys() == other[0].keys(), f'{what}: {one[0].keys()} and {other[0].keys()}'
    for number in one[0]:
        assert one[0][number] == other[0][number], f'{what}: another background {number}'
    for kind, mine, theirs in (('mask', one[1], other[1]), ('foreground', one[2], other[2])):
        assert [time for time, _ in mine] == [time for time, _ in theirs], f'{what}: {kind} times'
        differ = [t for t, (a, b) in enumerate(zip(mine, theirs)) if a[1] != b[1]]
        assert not differ, f'{what}: {kind} of frames {differ}'


def any_number_of_processes(folder, method):
    clip = folder / 'clip.mkv'
    run(folder, 0, clip, *outputs(folder, f'{method}0'), '--window', WINDOW, '--method', method,
        '--report', f'{method}0.json', '--quiet')
    alone = results(folder, f'{method}0')
    solves = json.loads((folder / f'{method}0.json').read_text())['solves']
    assert len(solves) == 3 and len(alone[0]) == 3 and len(alone[1]) == FRAMES, solves
    assert 0 < sum(mask.count(255) for _, mask in alone[1]), 'empty masks compare nothing'
    for processes in (1, 2, 3, 4):
        name = f'{method}{processes}'
        run(folder, processes, clip, *outputs(folder, name), '--window', WINDOW, '--method',
            method, '--report', f'{name}.json', '--quiet')
        compare(alone, results(folder, name), name)
        found = json.loads((folder / f'{name}.json').read_text())
        assert found['solves'] == solves, f'{name}: {found["solves"]}, alone {solves}'
        assert found['processes'] == processes and sum(found['of-process']['rows']) == HEIGHT
        assert not leftovers(folder, name), leftovers(folder, name)
    return alone, solves


def decoded(clip):
    """Its frames as they are decoded, and their caps."""
    pipeline = Gst.parse_launch(f'filesrc location="{clip}" ! decodebin ! appsink name=end sync=false')
    pipeline.set_state(Gst.State.PLAYING)
    samples = list(samples_of(pipeline.get_by_name('end')))
    buffers = [sample.get_buffer().copy_deep() for sample in samples]
    caps = samples[0].get_caps().copy()
    pipeline.set_state(Gst.State.NULL)
    return buffers, caps


def element_of_window(clip, first, count, method, output, into=''):
    """What the element sends of frames first .. first + count - 1, and its message."""
    buffers, caps = decoded(clip)
    pipeline = Gst.parse_launch(
        f'appsrc name=source format=time ! qdmdbackground window-size={WINDOW} method={method} '
        f'output={output} stabilize=off post-messages=true {into} ! appsink name=end sync=false')
    source, end = pipeline.get_by_name('source'), pipeline.get_by_name('end')
    source.set_caps(caps)
    pipeline.set_state(Gst.State.PLAYING)
    for t, buffer in enumerate(buffers[first:first + count]):
        buffer.pts, buffer.duration = t * 40 * Gst.MSECOND, 40 * Gst.MSECOND
        source.push_buffer(buffer)
    source.end_of_stream()
    frames = [bytes_of(sample) for sample in samples_of(end)]
    message = common.element_message(pipeline, 'qdmdbackground', timeout=0)
    pipeline.set_state(Gst.State.NULL)
    return frames, message


def as_the_element(folder, method, alone, solves):
    for window in (0, 1, 2):
        # The last window is not full: it has frames of the one before it.
        first = min(WINDOW * window, FRAMES - WINDOW)
        mine = slice(WINDOW * window, min(WINDOW * (window + 1), FRAMES))
        shown = slice(mine.start - first, WINDOW)
        clip = folder / 'clip.mkv'
        # A PNG has R, G and B; videos are what the element sends, sample by sample.
        backgrounds, message = element_of_window(clip, first, WINDOW, method, 'background',
                                                 '! videoconvert ! video/x-raw,format=RGB')
        number = f'-{window + 1}.png' if window else '.png'
        assert alone[0][number] == backgrounds[-1], f'{method}: background of window {window}'
        eigenvalue = [message.get_double(f'lambda-{part}')[1] for part in ('real', 'imaginary')]
        assert eigenvalue == solves[window]['lambda'], f'{eigenvalue}, {solves[window]}'
        foregrounds, _ = element_of_window(clip, first, WINDOW, method, 'foreground')
        assert foregrounds[shown] == [frame for _, frame in alone[2][mine]], \
            f'{method}: foreground of window {window}'
        # What masks learn from the frames before is not there in the last window.
        if first == WINDOW * window:
            masks, _ = element_of_window(clip, first, WINDOW, method, 'mask')
            # The element's are black and white in the video's range.
            black_and_white = bytes.maketrans(bytes((16, 235)), bytes((0, 255)))
            assert [mask[:WIDTH * HEIGHT].translate(black_and_white) for mask in masks[shown]] \
                == [mask for _, mask in alone[1][mine]], \
                f'{method}: masks of window {window}'


def one_method(folder, method):
    alone, solves = any_number_of_processes(folder, method)
    as_the_element(folder, method, alone, solves)


def colours_of_recordings(folder):
    """Videos have the colours, the chroma and the range of what is read, and 8 bits."""
    for pixels, kept, encoder in (
            ('Y42B', 'Y42B', 'avenc_ffv1'), ('Y444', 'Y444', 'avenc_ffv1'),
            ('GRAY8', 'GRAY8', 'avenc_ffv1'), ('BGRx', 'BGRx', 'avenc_ffv1'),
            ('A420', 'I420', 'avenc_ffv1'), ('YUY2', 'Y42B', 'capsfilter caps=video/x-raw'),
            ('Y41B', 'Y444', 'avenc_ffv1'), ('I420_10LE', 'I420', 'avenc_ffv1'),
            ('I422_10LE', 'Y42B', 'avenc_ffv1'), ('I420', 'I420', 'jpegenc quality=100')):
        clip = folder / f'{pixels}-{encoder[:4]}.mkv'
        # GStreamer's videocrop leaves out the last V of an odd row.
        make_clip(clip, WINDOW, WIDTH - (pixels == 'YUY2'), pixels=pixels, encoder=encoder)
        for processes in (0, 3):
            run(folder, processes, clip, '--background', folder / f'k{processes}.png',
                '--cutout', folder / f'k{processes}.mkv', '--window', WINDOW, '--quiet')
        one, other = (video(folder / f'k{processes}.mkv') for processes in (0, 3))
        assert one == other, f'{pixels}: cut-outs of one process and of three'
        assert video(folder / 'k0.png') == video(folder / 'k3.png'), f'{pixels}: backgrounds'
        caps = decoded(folder / 'k0.mkv')[1].to_string()
        assert f'format=(string){kept},' in caps, f'{pixels}: {caps}'
        if pixels != kept:
            continue
        cutouts, _ = element_of_window(clip, 0, WINDOW, 'robust', 'cutout')
        # The element keeps the byte that nobody looks at.
        if pixels == 'BGRx':
            cutouts = [[frame[c::4] for c in range(3)] for frame in cutouts]
            one = [(time, [frame[c::4] for c in range(3)]) for time, frame in one]
        assert cutouts == [frame for _, frame in one], f'{pixels}: not what the element sends'


def files_of_other_colours(folder):
    """All are read as the first one is."""
    make_clip(folder / 'colour.mkv', 12, seed=5, pixels='BGRx')
    make_clip(folder / 'grey.mkv', 12, seed=6, pixels='GRAY8')
    for files, kept in ((('clip', 'colour', 'grey'), 'I420'), (('colour', 'clip'), 'BGRx'),
                        (('grey', 'clip'), 'GRAY8')):
        for processes in (0, 2):
            run(folder, processes, *(folder / f'{name}.mkv' for name in files), '--foreground',
                folder / f'o{processes}.mkv', '--window', 20, '--quiet')
        one, other = (video(folder / f'o{processes}.mkv') for processes in (0, 2))
        assert one == other, f'{files}: one process and two'
        assert len(one) == 12 * len(files) + (FRAMES - 12), f'{files}: {len(one)} frames'
        caps = decoded(folder / 'o0.mkv')[1].to_string()
        assert f'format=(string){kept},' in caps, f'{files}: {caps}'


def what_colours_mean(folder):
    """It is that of the whole picture, and of the first file: not of a band, nor of a later one."""
    # Nothing says it in this file. GStreamer takes BT.709 above 576 rows, and a band has fewer.
    clip = folder / 'high.avi'
    common.play('qdmdscenesrc scene=basic num-buffers=20 ! '
                'video/x-raw,width=64,height=600,framerate=25/1 ! videoconvert ! '
                'video/x-raw,format=I420 ! avenc_mpeg4 bitrate=4000000 ! avimux ! '
                f'filesink location="{clip}"').set_state(Gst.State.NULL)
    assert 'colorimetry' not in decoded(clip)[1].to_string()
    backgrounds, _ = element_of_window(clip, 0, WINDOW, 'robust', 'background',
                                       '! videoconvert ! video/x-raw,format=RGB')
    for processes in (0, 2, 3):
        run(folder, processes, clip, '--background', folder / 'h.png', '--cutout',
            folder / 'h.mkv', '--window', WINDOW, '--quiet')
        assert video(folder / 'h.png')[0][1] == backgrounds[-1], f'{processes} processes'
        caps = decoded(folder / 'h.mkv')[1].to_string()
        assert 'colorimetry=(string)bt709' in caps, f'{processes} processes: {caps}'

    # White is 235 in the first file, 255 in the JPEGs, and what the first one has in the result.
    def white(path, pixels, encoder):
        end = {'.jpg': 'multifilesink', '.avi': 'avimux ! filesink',
               '.mkv': 'matroskamux ! filesink'}[path.suffix]
        common.play('videotestsrc pattern=white num-buffers=6 ! '
                    'video/x-raw,format=RGB,width=48,height=36,framerate=25/1 ! videoconvert ! '
                    f'video/x-raw,format={pixels} ! {encoder} ! {end} location="{path}"'
                    ).set_state(Gst.State.NULL)

    white(folder / 'limited.mkv', 'I420,colorimetry=bt601', 'avenc_ffv1')
    white(folder / 'full.avi', 'I420,colorimetry=1:4:0:0', 'jpegenc quality=100')
    whites = folder / 'whites'
    whites.mkdir()
    white(whites / 'a%02d.jpg', 'I420,colorimetry=1:4:0:0', 'jpegenc quality=100')
    white(whites / 'b%02d.jpg', 'GRAY8', 'jpegenc quality=100')
    for recordings, level in ((('limited.mkv', 'full.avi'), 235), (('full.avi', 'limited.mkv'), 255),
                              (('whites',), 255)):
        run(folder, 2, *(folder / name for name in recordings), '--background', folder / 'w.mkv',
            '--window', 6, '--quiet')
        frames = [frame[:48 * 36] for _, frame in video(folder / 'w.mkv')]
        assert len(frames) == 12 and all(abs(min(frame) - level) <= 1 for frame in frames), \
            f'{recordings}: {[(min(frame), max(frame)) for frame in frames]}'
    # Grey pictures may come first.
    white(whites / '0%02d.jpg', 'GRAY8', 'jpegenc quality=100')
    run(folder, 0, whites, '--background', folder / 'w.mkv', '--window', 6, '--quiet')
    assert 'format=(string)BGRx' in decoded(folder / 'w.mkv')[1].to_string()

    # How pixels are shown.
    clip = folder / 'fields.mkv'
    make_clip(clip, 12, encoder='capssetter caps=video/x-raw,interlace-mode=interleaved,'
              'field-order=top-field-first,pixel-aspect-ratio=4/3 ! avenc_ffv1')

    def shown(path, *fields):
        structure = decoded(path)[1].get_structure(0)
        return [structure.get_fraction(field)[1:] if field == 'pixel-aspect-ratio'
                else structure.get_string(field) for field in fields]

    mode, shape = shown(clip, 'interlace-mode', 'pixel-aspect-ratio')
    assert mode == 'interleaved' and shape[0] > shape[1], (mode, shape)
    run(folder, 2, clip, '--cutout', folder / 's.mkv', '--mask', folder / 'sm.mkv', '--window', 12,
        '--quiet')
    assert shown(folder / 's.mkv', 'interlace-mode', 'pixel-aspect-ratio') == [mode, shape]
    assert shown(folder / 'sm.mkv', 'pixel-aspect-ratio') == [shape]


def rows_that_share_samples(folder):
    """Bands begin with them, in low pictures, too."""
    for width, height in ((33, 7), (64, 96), (97, 49), (5, 100)):
        clip = folder / 'low.mkv'
        make_clip(clip, 6, width, height)
        names = [folder / f'r{processes}.mkv' for processes in (0, 2, 3)]
        for processes, name in zip((0, 2, 3), names):
            run(folder, processes, clip, '--foreground', name, '--window', 6, '--quiet')
        whole = video(names[0])
        for name in names[1:]:
            assert video(name) == whole, f'{width}x{height}: {name.name}'


def files_and_pictures(folder):
    """Two files, and the frames as PNG pictures, are the same recording as one file."""
    make_clip(folder / 'first.mkv', 24, seed=5, pixels='BGRx')
    make_clip(folder / 'second.mkv', 9, seed=6, pixels='BGRx')
    pictures = folder / 'pictures'
    pictures.mkdir()
    frames = video(folder / 'first.mkv', 'RGB') + video(folder / 'second.mkv', 'RGB')
    for number, (_, frame) in enumerate(frames):
        pipeline = Gst.parse_launch(
            f'appsrc name=source format=time caps=video/x-raw,format=RGB,width={WIDTH},'
            f'height={HEIGHT},framerate=25/1 ! pngenc snapshot=true ! '
            f'filesink location="{pictures}/{number:04}.png"')
        stride = (3 * WIDTH + 3) // 4 * 4
        rows = b''.join(frame[y * 3 * WIDTH:(y + 1) * 3 * WIDTH].ljust(stride, b'\0')
                        for y in range(HEIGHT))
        pipeline.set_state(Gst.State.PLAYING)
        buffer = Gst.Buffer.new_wrapped(rows)
        buffer.pts = 0
        pipeline.get_by_name('source').push_buffer(buffer)
        pipeline.get_by_name('source').end_of_stream()
        pipeline.get_bus().timed_pop_filtered(30 * Gst.SECOND, Gst.MessageType.EOS)
        pipeline.set_state(Gst.State.NULL)
    options = ['--window', 15, '--method', 'qdmd', '--quiet']
    run(folder, 2, folder / 'first.mkv', folder / 'second.mkv', *outputs(folder, 'files'), *options)
    run(folder, 3, pictures, *outputs(folder, 'folder'), *options)
    run(folder, 0, pictures, *outputs(folder, 'alone'), *options)
    files = results(folder, 'files')
    assert len(files[1]) == 33
    compare(files, results(folder, 'folder'), 'a folder of pictures')
    compare(files, results(folder, 'alone'), 'one process')


def more_outputs(folder):
    for processes in (0, 2):
        run(folder, processes, folder / 'clip.mkv', '--background', folder / f'b{processes}.mkv',
            '--cutout', folder / f'c{processes}.mkv', '--mask', folder / f'm{processes}.mkv',
            '--shadows', 'marked', '--window', WINDOW, '--quiet')
    for letter in 'bcm':
        assert video(folder / f'{letter}0.mkv') == video(folder / f'{letter}2.mkv'), letter
    assert len(video(folder / 'b0.mkv')) == FRAMES


def descendants(process):
    children, found = {}, []
    for entry in pathlib.Path('/proc').iterdir():
        try:
            parent = int((entry / 'stat').read_text().rpartition(')')[2].split()[1])
            children.setdefault(parent, []).append(int(entry.name))
        except (ValueError, OSError):
            pass
    waiting = [process]
    while waiting:
        one = waiting.pop()
        found.append(one)
        waiting += children.get(one, [])
    return found


def whole_so_far(folder, name):
    """What has its final name is whole."""
    for path in folder.glob(f'{name}*.parts/*.mkv'):
        assert len(video(path)) in (10, LONG_FRAMES % 10), f'{path} has {len(video(path))} frames'
    for path in folder.glob(f'{name}*.mkv'):
        if path.is_file():
            assert len(video(path)) == LONG_FRAMES, path
    for path in folder.glob(f'{name}*.png'):
        assert len(video(path)) == 1, path


def killed_and_resumed(folder):
    clip = folder / 'long.mkv'
    options = ['--window', 10, '--method', 'robust', '--quiet']
    start = time.monotonic()
    run(folder, 2, clip, *outputs(folder, 'undisturbed'), *options)
    takes = time.monotonic() - start
    undisturbed = results(folder, 'undisturbed')
    assert len(undisturbed[1]) == LONG_FRAMES
    chance = random.Random(27)
    resumed = 0
    for kill in range(10 if LONG else 4):
        # Some kills come before the first window, and some after the last: a job begins anew then.
        job = subprocess.Popen(command(chance.choice((1, 2, 3)), clip, *outputs(folder, 'killed'),
                                       *options, '--resume'),
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=folder)
        time.sleep(chance.uniform(0.3, 0.8) * takes)
        processes = descendants(job.pid)
        # All at once, or one of the job's own processes, which ends the job.
        for process in processes if kill % 2 == 0 else processes[-1:]:
            try:
                os.kill(process, signal.SIGKILL)
            except ProcessLookupError:
                pass
        job.wait(300)
        progress = folder / 'killed.png.progress'
        resumed += progress.exists() and json.loads(progress.read_text())['windows'] > 0
        whole_so_far(folder, 'killed')
    run(folder, 2, clip, *outputs(folder, 'killed'), *options, '--resume')
    compare(undisturbed, results(folder, 'killed'), f'{resumed} times resumed')
    assert not leftovers(folder, 'killed'), leftovers(folder, 'killed')
    print(f'# {resumed} of the killed jobs had finished windows', flush=True)


def killed_while_parts_are_removed(folder):
    """What the joined videos were made of is gone in part: they are whole all the same."""
    clip = folder / 'long.mkv'
    options = ['--window', 10, '--method', 'robust', '--quiet', '--resume']
    job = subprocess.Popen(command(1, clip, *outputs(folder, 'joined'), *options),
                           stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=folder)
    progress = folder / 'joined.png.progress'
    known = None
    while known is None and job.poll() is None:
        known = progress.read_text() if progress.exists() else None
        time.sleep(0.01)
    assert job.wait(300) == 0 and known
    whole = results(folder, 'joined')
    state = json.loads(known)
    state.update(windows=-(-LONG_FRAMES // 10), frames=LONG_FRAMES, ended=True, joined=True)
    progress.write_text(json.dumps(state))
    parts = folder / 'joined-mask.mkv.parts'
    parts.mkdir()
    (parts / '00000002.mkv').write_bytes(b'one of those that are left')
    run(folder, 1, clip, *outputs(folder, 'joined'), *options)
    compare(whole, results(folder, 'joined'), 'as it was')
    assert not leftovers(folder, 'joined'), leftovers(folder, 'joined')


def resumed_with_other_options(folder):
    clip = folder / 'long.mkv'
    job = subprocess.Popen(command(1, clip, *outputs(folder, 'other'), '--window', 10, '--quiet'),
                           stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=folder)
    progress = folder / 'other.png.progress'
    while not progress.exists() and job.poll() is None:
        time.sleep(0.01)
    for process in descendants(job.pid):
        os.kill(process, signal.SIGKILL)
    job.wait(300)
    text = run(folder, 1, clip, *outputs(folder, 'other'), '--window', 12, '--resume', expect=1)
    assert 'other options' in text, text


def memory_of_processes(folder):
    width, height, frames = 1280, 721, 100
    window = 3 * width * height * frames
    # Meson's tests touch all that is taken, and what a window may need at most is taken.
    untouched = {name: value for name, value in os.environ.items() if name != 'MALLOC_PERTURB_'}
    for pixels in ('I420', 'BGRx'):
        clip = folder / f'large-{pixels}.mkv'
        make_clip(clip, frames, width, height, pixels)
        # The short form has what takes more of RGB.
        for method in ('qdmd', 'robust') if LONG or pixels == 'I420' else ('robust',):
            for processes in (1, 2, 3, 4) if LONG else (2,):
                most = {}
                for size in (2, frames):
                    run(folder, processes, clip, '--background', folder / 'm.png', '--window',
                        size, '--method', method, '--report', folder / 'm.json', '--quiet',
                        env=untouched)
                    report = json.loads((folder / 'm.json').read_text())
                    most[size] = report['of-process']['most-memory']
                # Besides what decoding takes, and buffers of one frame.
                shares = [(whole - bare) / window for whole, bare in zip(most[frames], most[2])]
                what = f'{method}, {pixels}, {processes} processes'
                print(f'# {what}: ' + ' '.join(f'{share:.3f}' for share in shares), flush=True)
                # A window in I420 is half as large.
                part = 1 if pixels == 'BGRx' else 0.5
                assert max(shares) <= part * (1 / processes + 0.1), f'{what}: {shares}'


def memory_of_frames_is_used_again(folder):
    clip, faults = folder / 'frames.mkv', []
    make_clip(clip, 40, 1280, 721)
    for times in (1, 3):
        run(folder, 0, *[clip] * times, '--background', folder / 'f.png', '--window', 10,
            '--report', folder / 'f.json', '--quiet')
        faults += json.loads((folder / 'f.json').read_text())['of-process']['page-faults']
    # One frame as it is decoded has 338 pages, and many frames are on their way at once.
    more = (faults[1] - faults[0]) / 80
    print(f'# {more:.1f} page faults a frame', flush=True)
    assert more < 30, f'{faults}: {more} page faults a frame'


def failing_process(folder):
    """One process's file is another: the job ends, and says why."""
    def two(first, second):
        words = [str(word) for word in (*outputs(folder, 'fails'), '--window', 10, '--quiet')]
        done = subprocess.run([mpirun, '-q', *JOB, '-n', '1', archive, str(first), *words, ':',
                               '-n', '1', archive, str(second), *words],
                              cwd=folder, capture_output=True, text=True, timeout=60)
        assert done.returncode != 0, f'it ended well: {done.stdout}{done.stderr}'
        return done.stderr

    clip = folder / 'long.mkv'
    make_clip(folder / 'short.mkv', 13)
    said = two(clip, folder / 'short.mkv')
    assert 'do all machines have the same files' in said, said
    (folder / 'broken.mkv').write_bytes(b'nothing of the kind' * 1000)
    said = two(clip, folder / 'broken.mkv')
    assert 'broken.mkv cannot be decoded' in said and 'process 1' in said, said
    said = two(clip, folder / 'missing.mkv')
    assert 'missing.mkv' in said, said


def pictures_of(folder, name, kind='png'):
    made = folder / name
    made.mkdir()
    encoder = {'png': 'pngenc', 'jpg': 'jpegenc'}[kind]
    common.play(f'videotestsrc pattern=ball num-buffers=6 ! '
                f'video/x-raw,width=48,height=36,format=RGB ! {encoder} ! '
                f'multifilesink location="{made}/%02d.{kind}"').set_state(Gst.State.NULL)
    return made


def what_is_read_stays(folder):
    shots = pictures_of(folder, 'shots')
    clip = folder / 'mine.mkv'
    make_clip(clip, 12)
    (folder / 'link.mkv').symlink_to(clip)
    parts = folder / 'n.mkv.parts'
    parts.mkdir()
    part, temporary = parts / '00000001.mkv', folder / 't.mkv.tmp'
    for copy in (part, temporary):
        shutil.copy(clip, copy)
    shutil.copy(shots / '01.png', folder / 'later-2.png')
    (folder / 'later.lnk.png').symlink_to(folder / 'later-2.png')
    read = (clip, part, temporary, folder / 'later-2.png', *shots.iterdir())
    before = {path: path.read_bytes() for path in read}
    inside = shots / 'b.png'
    for words in ([clip, '--mask', clip], [clip, '--background', folder / 'link.mkv'],
                  [clip, '--mask', 'shots/../mine.mkv'], [shots, '--background', shots / '00.png'],
                  [shots, '--background', inside], [clip, '--mask', 'm.mkv', '--report', clip],
                  [shots / '01.png', '--background', shots / '01.png'],
                  [shots, '--background', 'b.png', '--report', shots / '00.png'],
                  [temporary, '--mask', 't.mkv'],
                  [folder / 'later-2.png', '--background', 'later.png'],
                  [folder / 'later.lnk.png', '--background', 'later.png']):
        for processes in (0, 2):
            text = run(folder, processes, *words, '--window', 4, expect=1)
            assert 'would be among what is read' in text, f'{words}: {text}'
    text = run(folder, 0, part, '--mask', 'n.mkv', expect=1)
    assert 'move it first' in text, text
    assert {path: path.read_bytes() for path in read} == before
    text = run(folder, 0, clip, '--mask', 'm.mkv', '--report', './m.mkv', expect=2)
    assert 'twice' in text, text
    # Names that only look alike.
    run(folder, 0, shots / '01.png', '--background', '01.png', '--quiet')
    # A report goes where somebody waits for it.
    os.mkfifo(folder / 'pipe')
    reader = subprocess.Popen(['cat', folder / 'pipe'], stdout=subprocess.PIPE, text=True)
    run(folder, 0, clip, '--background', 'p.png', '--report', 'pipe', '--quiet')
    assert json.loads(reader.communicate(timeout=60)[0])['frames'] == 12


def write_deep_png(path, size=40):
    """A picture of 16 bits a sample, which pngenc does not write."""
    def chunk(name, data):
        return (struct.pack('>I', len(data)) + name + data
                + struct.pack('>I', zlib.crc32(name + data)))

    row = b'\0' + struct.pack('>3H', 12850, 25700, 100) * size
    path.write_bytes(b'\x89PNG\r\n\x1a\n'
                     + chunk(b'IHDR', struct.pack('>2I5B', size, size, 16, 2, 0, 0, 0))
                     + chunk(b'IDAT', zlib.compress(row * size)) + chunk(b'IEND', b''))


def pictures_that_are_odd(folder):
    (folder / 'deep').mkdir()
    write_deep_png(folder / 'deep' / '1.png')
    text = run(folder, 0, folder / 'deep', '--background', 'n.png', expect=1)
    assert 'convert it to 8 bits' in text, text
    # A name that is no text.
    strange = os.fsdecode(b'u\xff')
    clip = folder / (strange + '.mkv')
    shutil.copy(folder / 'clip.mkv', clip)
    run(folder, 0, clip, *outputs(folder, strange), '--window', 20, '--quiet', '--resume')
    assert not leftovers(folder, strange)
    for kind in ('png', 'jpg'):
        made = pictures_of(folder, 'none-' + kind, kind)
        (made / f'03.{kind}').write_bytes(b'')
        for processes in (0, 2):
            text = run(folder, processes, made, '--background', 'n.png', expect=1)
            assert f'03.{kind} is empty' in text, text
    for kind in ('png', 'jpg'):
        cut = pictures_of(folder, 'cut-' + kind, kind)
        last = cut / f'05.{kind}'
        whole = last.read_bytes()
        last.write_bytes(whole + b'what \xff\xd8\xff\xda a camera adds')
        run(folder, 0, cut, '--background', 'n.png', '--window', 4, '--quiet')
        last.write_bytes(whole[:len(whole) // 2])
        text = run(folder, 0, cut, '--background', 'n.png', expect=1)
        assert f'05.{kind} is cut off' in text, text


def a_recording_that_is_cut_off(folder):
    clip = folder / 'whole.mkv'
    make_clip(clip, 100)
    text = run(folder, 0, clip, '--background', 'w.png', '--window', 50)
    assert 'cut off' not in text, text
    whole = clip.read_bytes()
    (folder / 'half.mkv').write_bytes(whole[:len(whole) // 2])
    text = run(folder, 2, folder / 'half.mkv', '--background', 'w.png', '--window', 50)
    assert text.count('of 4 s: is it cut off?') == 1, text


def errors(folder):
    clip = folder / 'clip.mkv'
    for words, reason in (
            ([clip, '--mask', 'm.mkv', '--report', 'no/folder/r.json'], 'r.json cannot'),
            ([clip, '--mask', 'no/folder/mask.mkv'], 'no/folder')):
        for processes in (0, 2):
            text = run(folder, processes, *words, expect=1)
            assert reason in text, f'{words}: {text}'
    for words, reason in (
            ([clip, '--mask', 'm.mkv', '--absorb-time', 'nan'], 'finite'),
            ([clip], 'nothing is to be written'),
            ([clip, '--mask', 'mask.png'], '.mkv'),
            ([clip, '--mask', 'mask.avi'], '.mkv'),
            ([clip, '--mask', 'one.mkv', '--foreground', 'one.mkv'], 'twice'),
            ([clip, '--background', 'b.png', '--method', 'magic'], '--method'),
            ([clip, '--background', 'b.png', '--window', 1], '--window'),
            ([folder, '--background', 'b.png', '--window', 1], '--window'),
            ([folder / 'none.mkv', '--background', 'b.png'], 'none.mkv')):
        for processes in (0, 2):
            text = run(folder, processes, *words, expect=2)
            assert reason in text, f'{words}: {text}'
    common.play('videotestsrc num-buffers=5 ! video/x-raw,format=BGRx,width=64,height=3 ! '
                f'avenc_ffv1 ! matroskamux ! filesink location="{folder}/low.mkv"'
                ).set_state(Gst.State.NULL)
    text = run(folder, 4, folder / 'low.mkv', '--background', 'b.png', expect=1)
    assert 'start fewer' in text, text
    # What fails while the next window is read ends the job, too. It begins anew: what another one
    # had done is forgotten.
    (folder / 'taken.png' / 'inside').mkdir(parents=True)
    progress = folder / 'taken.png.progress'
    progress.write_text('{}')
    text = run(folder, 0, folder / 'low.mkv', '--background', 'taken.png', '--window', 2, expect=1)
    assert 'taken.png' in text, text
    assert not progress.exists()
    (folder / 'taken.png' / 'inside').rmdir()
    (folder / 'taken.png').rmdir()
    assert '--window' in run(folder, 0, '--help')


def main():
    cases = [(f'{method} of any number of processes, and of the element', one_method, method)
             for method in ('qdmd', 'dmd', 'robust')]
    cases += [(check.__name__.replace('_', ' '), check)
              for check in (colours_of_recordings, files_of_other_colours,
                            rows_that_share_samples, what_colours_mean,
                            files_and_pictures, more_outputs, killed_and_resumed,
                            killed_while_parts_are_removed, resumed_with_other_options,
                            what_is_read_stays, pictures_that_are_odd,
                            a_recording_that_is_cut_off,
                            memory_of_processes, memory_of_frames_is_used_again,
                            failing_process, errors)]
    words = sys.argv[3:]
    cases = [case for case in cases if not words or any(word in case[0] for word in words)]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        make_clip(folder / 'clip.mkv')
        make_clip(folder / 'long.mkv', LONG_FRAMES, 321, 243)
        return common.report([(case, lambda check=check, words=words: check(folder, *words))
                              for case, check, *words in cases])


sys.exit(main())
