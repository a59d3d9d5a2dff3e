# SPDX-License-Identifier: LGPL-2.1-or-later
"""Runs qdmd-archive with --jobs, --part and mpirun: whatever the number of processes, and however
often they are killed, what they write is the same, and what the element gives.

Usage: archive_test.py ARCHIVE MPIRUN [WORD...]     WORD: only cases with one of them in the name
       QDMD_ARCHIVE_LONG=1: more kills
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
JOB = ['--oversubscribe', '--allow-run-as-root', '--bind-to', 'none']
# One machine only: no launcher and no network. Open MPI 5 has no such options.
if ') 4.' in subprocess.run([mpirun, '--version'], capture_output=True, text=True).stdout:
    JOB += ['--mca', 'plm', 'isolated', '--mca', 'btl', 'self,vader', '--mca', 'oob_tcp_if_include', 'lo',
            '--mca', 'btl_vader_single_copy_mechanism', 'none', '--mca', 'mpi_yield_when_idle', '1']
WIDTH, HEIGHT, FRAMES, WINDOW = 162, 122, 90, 10


def command(*words, ranks=0):
    words = [archive, *map(str, words)]
    return [mpirun, '-n', str(ranks), *JOB, *words] if ranks else words


def run(folder, *words, expect=0, ranks=0, env=None):
    done = subprocess.run(command(*words, ranks=ranks), cwd=folder, capture_output=True, text=True,
                          timeout=240, env=env)
    text = done.stdout + done.stderr
    # mpirun has a status of its own.
    status = bool(done.returncode) if ranks else done.returncode
    assert status == (bool(expect) if ranks else expect), f'{words}: exit status {status}\n{text}'
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


def decoded(clip):
    """Its frames as they are decoded, and their caps."""
    pipeline = Gst.parse_launch(f'filesrc location="{clip}" ! decodebin ! appsink name=end sync=false')
    pipeline.set_state(Gst.State.PLAYING)
    samples = list(samples_of(pipeline.get_by_name('end')))
    buffers = [sample.get_buffer().copy_deep() for sample in samples]
    caps = samples[0].get_caps().copy()
    pipeline.set_state(Gst.State.NULL)
    return buffers, caps


def make_clip(path, frames=FRAMES, width=WIDTH, height=HEIGHT, pixels='I420', seed=3,
              encoder='avenc_ffv1'):
    common.play(f'qdmdscenesrc scene=basic,noise=2,trees seed={seed} num-buffers={frames} ! '
                f'video/x-raw,width={width},height={height},framerate=25/1 ! videoconvert ! '
                f'video/x-raw,format={pixels} ! {encoder} ! matroskamux ! '
                f'filesink location="{path}"').set_state(Gst.State.NULL)


def leftovers(folder, name):
    return [path.name for path in folder.glob(f'{name}*')
            if path.suffix in ('.parts', '.tmp', '.progress')]


OUTPUTS = {'background': '.png', 'mask': '-mask.mkv', 'foreground': '-foreground.mkv'}


def outputs(name):
    return [word for kind, end in OUTPUTS.items() for word in (f'--{kind}', f'{name}{end}')]


def results(folder, name):
    """All that a job has written: the background of each window, and the frames of each video."""
    found = {path.name[len(name):]: video(path) for path in sorted(folder.glob(f'{name}*.png'))}
    for kind, end in list(OUTPUTS.items())[1:]:
        found[kind] = video(folder / f'{name}{end}')
    return found


def compare(one, other, what):
    assert one.keys() == other.keys(), f'{what}: {one.keys()} and {other.keys()}'
    for kind in one:
        assert [time for time, _ in one[kind]] == [time for time, _ in other[kind]], \
            f'{what}: times of {kind}'
        differ = [t for t, (a, b) in enumerate(zip(one[kind], other[kind])) if a != b]
        assert not differ, f'{what}: {kind} of frames {differ}'


def of_the_element(clip, kind, *settings):
    """What the element sends, as the archive keeps it."""
    form = {'mask': 'video/x-raw,format=GRAY8 ! '}.get(kind, '')
    return frames_of(f'filesrc location="{clip}" ! decodebin ! qdmdseparate name=s '
                     f'{" ".join(settings)} s.{kind} ! {form}queue')


def one_stretch_is_the_element(folder):
    """Whatever the element can: one product."""
    for settings in ([], ['stabilize=translation', 'mask-softness=2', 'shadows=marked'],
                     ['method=dmd', 'sample-step=2'], ['mode=live', 'hop-size=4'],
                     ['ignore=<<0,0,40,60>>']):
        words = [word for one in settings for word in ('--' + one.partition('=')[0],
                                                       one.partition('=')[2])]
        run(folder, 'clip.mkv', *outputs('one'), '--cutout', 'one-cutout.mkv', '--window', WINDOW,
            '--quiet', *words)
        for kind in ('mask', 'foreground', 'cutout'):
            expected = of_the_element(folder / 'clip.mkv', kind, f'window-size={WINDOW}', *settings)
            assert video(folder / f'one-{kind}.mkv') == expected, f'{kind}, {settings}'
        assert any(mask.count(255) for _, mask in video(folder / 'one-mask.mkv'))
    backgrounds = frames_of(f'filesrc location="{folder}/clip.mkv" ! decodebin ! qdmdseparate '
                            f'name=s window-size={WINDOW} s.background', 'RGB')
    run(folder, 'clip.mkv', *outputs('one'), '--window', WINDOW, '--quiet')
    for window in range(FRAMES // WINDOW):
        name = f'one-{window + 1}.png' if window else 'one.png'
        assert video(folder / name)[0][1] == backgrounds[WINDOW * (window + 1) - 1][1], name


def any_number_of_processes(folder):
    for method in ('robust', 'dmd'):
        common_words = ['clip.mkv', '--window', WINDOW, '--method', method, '--stretch', 20,
                        '--warm-up', WINDOW, '--quiet', '--report', 'report.json']
        run(folder, *common_words, *outputs('alone'))
        alone = results(folder, 'alone')
        assert len(alone['mask']) == FRAMES and len(alone) == FRAMES // WINDOW + 2, alone.keys()
        for name, options in (('jobs', {'words': ['--jobs', 3]}), ('ranks', {'ranks': 3}),
                              ('both', {'words': ['--jobs', 2], 'ranks': 2})):
            run(folder, *common_words, *outputs(name), *options.get('words', ()),
                ranks=options.get('ranks', 0))
            compare(alone, results(folder, name), f'{method}, {name}')
            assert not leftovers(folder, name), leftovers(folder, name)
            report = json.loads((folder / 'report.json').read_text())
            assert report['frames'] == FRAMES and len(report['stretches']) == 5
        # In any order, and joined by the last one.
        for part in (3, 1, 2):
            assert not (folder / 'parts-mask.mkv').exists()
            run(folder, *common_words, *outputs('parts'), '--part', f'{part}/3')
        compare(alone, results(folder, 'parts'), f'{method}, parts')
        (folder / 'parts-mask.mkv').unlink()
        # Windows of dmd know nothing of each other.
        if method == 'dmd':
            run(folder, *common_words[:5], *outputs('whole'), '--quiet')
            whole = results(folder, 'whole')
            for kind in set(whole) - {'mask'}:
                assert alone[kind] == whole[kind], f'{kind} in stretches, and in one'


def the_first_stretch_is_longer(folder):
    """It needs no warming up: all end at about the same time."""
    run(folder, 'clip.mkv', *outputs('two'), '--window', 5, '--warm-up', 40, '--jobs', 2, '--quiet',
        '--report', 'report.json')
    stretches = json.loads((folder / 'report.json').read_text())['stretches']
    assert [s['frames'] for s in stretches] == [55, 35], stretches
    assert len(video(folder / 'two-mask.mkv')) == FRAMES


def irregular(folder, name):
    """A file whose frames are shown at any times, and depend on many around."""
    buffers, caps = decoded(folder / 'clip.mkv')
    pipeline = Gst.parse_launch('appsrc name=source format=time ! x264enc bframes=3 key-int-max=25 '
                                'option-string="open-gop=1" ! h264parse ! matroskamux ! '
                                f'filesink location="{folder}/{name}"')
    source = pipeline.get_by_name('source')
    source.set_caps(caps)
    pipeline.set_state(Gst.State.PLAYING)
    chance = random.Random(3)
    for t, buffer in enumerate(buffers):
        buffer.pts, buffer.duration = (40 * t + chance.randrange(30)) * Gst.MSECOND, 5 * Gst.MSECOND
        source.push_buffer(buffer)
    source.end_of_stream()
    pipeline.get_bus().timed_pop_filtered(60 * Gst.SECOND, Gst.MessageType.EOS)
    pipeline.set_state(Gst.State.NULL)
    return name


def frames_are_found_again(folder):
    """A stretch begins with the same frame whatever the file: none is lost, and none comes twice."""
    h264 = 'x264enc bframes=3 key-int-max=25 option-string="open-gop=1" ! h264parse'
    files = {'open.mp4': f'{h264} ! mp4mux', 'open.mkv': f'{h264} ! matroskamux',
             'open.ts': f'{h264} ! mpegtsmux', 'pictures.avi': 'jpegenc ! avimux',
             'hidden.webm': 'vp8enc lag-in-frames=16 auto-alt-ref=true deadline=1 '
                            'keyframe-max-dist=40 ! webmmux'}
    for name, encoder in files.items():
        common.play(f'filesrc location="{folder}/clip.mkv" ! decodebin ! {encoder} ! '
                    f'filesink location="{folder}/{name}"').set_state(Gst.State.NULL)
    words = ['--window', WINDOW, '--method', 'dmd', '--foreground', 'found.mkv', '--quiet']
    for recording, frames, by_time in (
            (['clip.mkv'], FRAMES, True), (['open.mp4'], FRAMES, True), (['open.mkv'], FRAMES, True),
            ([irregular(folder, 'any.mkv')], FRAMES, True), (['open.ts'], FRAMES, False),
            (['pictures.avi'], FRAMES, False), (['hidden.webm'], FRAMES, None),
            (['open.mp4', 'clip.mkv', 'any.mkv'], 3 * FRAMES, True),
            (['open.mp4', 'open.ts'], 2 * FRAMES, False)):
        run(folder, *recording, *words)
        whole = video(folder / 'found.mkv')
        assert len(whole) == frames, f'{recording}: {len(whole)} frames'
        run(folder, *recording, *words, '--stretch', 3 * WINDOW, '--part', '2/3')
        plan = json.loads((folder / 'found.mkv.progress' / 'plan.json').read_text())
        assert by_time is None or plan['by-time'] == by_time, f'{recording}: {plan}'
        for part in (1, 3):
            run(folder, *recording, *words, '--stretch', 3 * WINDOW, '--part', f'{part}/3')
        found = video(folder / 'found.mkv')
        others = [t for t, (a, b) in enumerate(zip(found, whole)) if a != b]
        assert found == whole, f'{recording}: {len(found)} frames, others from {others[:3]} on'


def rows_of_windows(folder):
    """Backgrounds of one process, to the last bit."""
    for width, height, pixels in ((161, 123, 'I420'), (64, 97, 'BGRx'), (33, 7, 'I422_10LE')):
        make_clip(folder / 'rows.mkv', 25, width, height, pixels=pixels)
        for method in ('qdmd', 'dmd'):
            words = ['rows.mkv', '--window', WINDOW, '--method', method, '--quiet']
            run(folder, *words, '--background', 'whole.png')
            for ranks in (0, 2, 3):
                run(folder, *words, '--by', 'rows', '--background', f'rows{ranks}.png', ranks=ranks)
                for end in ('.png', '-2.png', '-3.png'):
                    assert video(folder / f'rows{ranks}{end}') == video(folder / f'whole{end}'), \
                        f'{method}, {width}x{height}, {ranks} processes: {end}'
    text = run(folder, 'rows.mkv', '--by', 'rows', '--background', 'r.png', '--window', 4,
               expect=2)
    assert 'method=qdmd and dmd' in text, text
    text = run(folder, 'rows.mkv', '--by', 'rows', '--mask', 'r.mkv', expect=2)
    assert '--background x.png alone' in text, text
    # One process's file is another: the job ends, and says why. (Open MPI 5.0.7 crashes with two
    # commands, so that a shell chooses.)
    make_clip(folder / 'short.mkv', 13, 33, 7)
    choice = 'f=rows.mkv; [ "$OMPI_COMM_WORLD_RANK" = 0 ] || f=short.mkv; exec "$0" "$f" "$@"'
    words = ['--by', 'rows', '--background', 'r.png', '--window', '10', '--method', 'qdmd']
    done = subprocess.run([mpirun, '-n', '2', *JOB, 'sh', '-c', choice, archive, *words],
                          cwd=folder, capture_output=True, text=True, timeout=60)
    assert done.returncode and 'do all machines have the same files' in done.stderr, done.stderr


def colours_of_recordings(folder):
    """Videos have the colours, the chroma, the range and the bits of what is read."""
    for pixels, kept, encoder in (
            ('Y42B', 'Y42B', 'avenc_ffv1'), ('Y444', 'Y444', 'avenc_ffv1'),
            ('GRAY8', 'GRAY8', 'avenc_ffv1'), ('BGRx', 'BGRx', 'avenc_ffv1'),
            ('A420', 'A420', 'avenc_ffv1'), ('YUY2', 'Y42B', 'capsfilter caps=video/x-raw'),
            ('Y41B', 'Y444', 'avenc_ffv1'), ('I420_10LE', 'I420_10LE', 'avenc_ffv1'),
            ('I422_10LE', 'I422_10LE', 'avenc_ffv1'), ('GRAY16_LE', 'GRAY16_LE', 'avenc_ffv1'),
            ('I420', 'I420', 'jpegenc quality=100')):
        make_clip(folder / 'k.mkv', WINDOW, WIDTH, HEIGHT, pixels, encoder=encoder)
        run(folder, 'k.mkv', '--background', 'k.png', '--cutout', 'kc.mkv', '--window', WINDOW,
            '--quiet')
        caps = decoded(folder / 'kc.mkv')[1].to_string()
        assert f'format=(string){kept},' in caps, f'{pixels}: {caps}'
        if pixels != kept:
            continue
        cutouts = of_the_element(folder / 'k.mkv', 'cutout', f'window-size={WINDOW}')
        found = video(folder / 'kc.mkv')
        # The element keeps the byte that nobody looks at.
        if pixels == 'BGRx':
            cutouts, found = ([[frame[c::4] for c in range(3)] for _, frame in frames]
                              for frames in (cutouts, found))
        assert cutouts == found, f'{pixels}: not what the element sends'


def files_of_other_colours(folder):
    """All are read as the first one is, wherever a process begins."""
    make_clip(folder / 'colour.mkv', 20, seed=5, pixels='BGRx')
    make_clip(folder / 'grey.mkv', 20, seed=6, pixels='GRAY8')
    for files, kept in ((('colour', 'clip'), 'BGRx'), (('grey', 'colour', 'clip'), 'GRAY8')):
        for name, words in (('o1.mkv', []), ('o2.mkv', ['--stretch', WINDOW, '--jobs', 2])):
            run(folder, *(f'{file}.mkv' for file in files), '--foreground', name, '--window',
                WINDOW, '--method', 'dmd', '--quiet', *words)
        assert video(folder / 'o1.mkv') == video(folder / 'o2.mkv'), files
        caps = decoded(folder / 'o2.mkv')[1].to_string()
        assert f'format=(string){kept},' in caps, f'{files}: {caps}'


def what_colours_mean(folder):
    """It is that of the first file, not of a later one."""
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
        run(folder, *recordings, '--background', 'w.mkv', '--window', 6, '--quiet', '--jobs', 2,
            '--stretch', 6)
        frames = [frame[:48 * 36] for _, frame in video(folder / 'w.mkv')]
        assert len(frames) == 12 and all(abs(min(frame) - level) <= 1 for frame in frames), \
            f'{recordings}: {[(min(frame), max(frame)) for frame in frames]}'
    # Grey pictures may come first.
    white(whites / '0%02d.jpg', 'GRAY8', 'jpegenc quality=100')
    run(folder, whites, '--background', 'w.mkv', '--window', 6, '--quiet')
    assert 'format=(string)BGRx' in decoded(folder / 'w.mkv')[1].to_string()

    # How pixels are shown. Two fields are one frame.
    make_clip(folder / 'fields.mkv', 12, encoder='capssetter caps=video/x-raw,interlace-mode='
              'interleaved,field-order=top-field-first,pixel-aspect-ratio=4/3 ! avenc_ffv1')
    run(folder, 'fields.mkv', '--cutout', 's.mkv', '--mask', 'sm.mkv', '--window', 12, '--quiet')
    for name in ('fields.mkv', 's.mkv', 'sm.mkv'):
        shape = decoded(folder / name)[1].get_structure(0).get_fraction('pixel-aspect-ratio')
        assert shape[1] > shape[2], (name, shape)


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
    words = ['--window', WINDOW, '--method', 'dmd', '--stretch', WINDOW, '--quiet']
    run(folder, 'first.mkv', 'second.mkv', *outputs('files'), *words)
    run(folder, pictures, *outputs('folder'), *words, '--jobs', 2)
    files = results(folder, 'files')
    assert len(files['mask']) == 33
    compare(files, results(folder, 'folder'), 'a folder of pictures')


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


def whole_so_far(folder, name, frames):
    """What has its final name is whole."""
    for path in folder.glob(f'{name}*.parts/*.mkv'):
        assert len(video(path)) in (10, frames % 10), f'{path} has {len(video(path))} frames'
    for path in folder.glob(f'{name}*.mkv'):
        if path.is_file():
            assert len(video(path)) == frames, path
    for path in folder.glob(f'{name}*.png'):
        assert len(video(path)) == 1, path


def stretches_done(folder, name):
    return len(list((folder / f'{name}.png.progress').glob('*.done')))


KILLED = ['long.mkv', '--window', 10, '--stretch', 10, '--warm-up', 10, '--quiet']
LONG_FRAMES = 97


def undisturbed_results(folder):
    if not (folder / 'undisturbed.png').exists():
        run(folder, *KILLED, *outputs('undisturbed'), '--jobs', 2)
    return results(folder, 'undisturbed')


def killed_and_resumed(folder):
    start = time.monotonic()
    undisturbed = undisturbed_results(folder)
    takes = time.monotonic() - start
    assert len(undisturbed['mask']) == LONG_FRAMES
    chance = random.Random(27)
    resumed = 0
    for kill in range(10 if LONG else 4):
        # Some kills come before the first stretch is done, and some after the last.
        ranks = chance.choice((0, 2))
        words = ['--jobs', chance.choice((1, 3))] if ranks == 0 else []
        job = subprocess.Popen(command(*KILLED, *outputs('killed'), *words, '--resume',
                                       ranks=ranks),
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=folder)
        time.sleep(chance.uniform(0.3, 0.8) * takes)
        processes = descendants(job.pid)
        # All at once, or the one that was started first.
        for process in processes if kill % 2 == 0 else processes[:1]:
            try:
                os.kill(process, signal.SIGKILL)
            except ProcessLookupError:
                pass
        job.wait(300)
        # What mpirun started goes on without it.
        while any(pathlib.Path(f'/proc/{process}').exists() for process in processes):
            time.sleep(0.05)
        resumed += stretches_done(folder, 'killed') > 0
        whole_so_far(folder, 'killed', LONG_FRAMES)
    run(folder, *KILLED, *outputs('killed'), '--jobs', 2, '--resume')
    compare(undisturbed, results(folder, 'killed'), f'{resumed} times resumed')
    assert not leftovers(folder, 'killed'), leftovers(folder, 'killed')
    print(f'# {resumed} of the killed jobs had finished stretches', flush=True)


def a_process_that_dies(folder):
    """Others do its stretch, without anybody's help."""
    job = subprocess.Popen(command(*KILLED, *outputs('died'), '--jobs', 2), cwd=folder,
                           stderr=subprocess.PIPE, text=True)
    while stretches_done(folder, 'died') == 0 and job.poll() is None:
        time.sleep(0.01)
    os.kill(descendants(job.pid)[-1], signal.SIGKILL)
    said = job.communicate(timeout=240)[1]
    assert job.returncode == 0 and 'its stretch is done again' in said, said
    compare(undisturbed_results(folder), results(folder, 'died'), 'a process died')


def several_commands_share_a_job(folder):
    """A second one takes what is free, too."""
    words = [*KILLED, *outputs('shared'), '--resume']
    first = subprocess.Popen(command(*words), cwd=folder)
    while not (folder / 'shared.png.progress' / 'plan.json').exists() and first.poll() is None:
        time.sleep(0.01)
    run(folder, *words)
    assert first.wait(240) == 0
    compare(undisturbed_results(folder), results(folder, 'shared'), 'two commands')
    assert not leftovers(folder, 'shared'), leftovers(folder, 'shared')


def killed_while_parts_are_removed(folder):
    """What the joined videos were made of is gone in part: they are whole all the same."""
    for part in (1, 2):
        run(folder, *KILLED, *outputs('joined'), '--part', f'{part}/3')
    text = run(folder, *KILLED, *outputs('joined'), '--join', expect=1)
    assert '3 of 10 stretches are not done yet' in text, text
    shutil.copytree(folder / 'joined.png.progress', folder / 'kept')
    run(folder, *KILLED, *outputs('joined'), '--part', '3/3')
    whole = results(folder, 'joined')
    plan = json.loads((folder / 'kept' / 'plan.json').read_text())
    plan['joined'] = True
    (folder / 'kept' / 'plan.json').write_text(json.dumps(plan))
    shutil.move(folder / 'kept', folder / 'joined.png.progress')
    parts = folder / 'joined-mask.mkv.parts'
    parts.mkdir()
    (parts / '00000002.mkv').write_bytes(b'one of those that are left')
    run(folder, *KILLED, *outputs('joined'), '--resume')
    compare(whole, results(folder, 'joined'), 'as it was')
    assert not leftovers(folder, 'joined'), leftovers(folder, 'joined')


def resumed_with_other_options(folder):
    run(folder, *KILLED, *outputs('other'), '--part', '1/2')
    for words in (['--resume'], ['--part', '2/2']):
        text = run(folder, *KILLED, *outputs('other'), '--shadows', 'foreground', *words, expect=1)
        assert 'other options' in text, text
    # It begins anew: what another one had done is forgotten.
    run(folder, *KILLED, *outputs('other'), '--shadows', 'foreground')
    assert not leftovers(folder, 'other'), leftovers(folder, 'other')


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
        text = run(folder, *words, '--window', 4, expect=1)
        assert 'would be among what is read' in text, f'{words}: {text}'
    text = run(folder, part, '--mask', 'n.mkv', expect=1)
    assert 'move it first' in text, text
    assert {path: path.read_bytes() for path in read} == before
    text = run(folder, clip, '--mask', 'm.mkv', '--report', './m.mkv', expect=2)
    assert 'twice' in text, text
    # Names that only look alike.
    run(folder, shots / '01.png', '--background', '01.png', '--quiet')
    # A report goes where somebody waits for it.
    os.mkfifo(folder / 'pipe')
    reader = subprocess.Popen(['cat', folder / 'pipe'], stdout=subprocess.PIPE, text=True)
    run(folder, clip, '--background', 'p.png', '--report', 'pipe', '--quiet')
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
    text = run(folder, folder / 'deep', '--background', 'n.png', expect=1)
    assert 'convert it to 8 bits' in text, text
    # A name that is no text.
    strange = os.fsdecode(b'u\xff')
    clip = folder / (strange + '.mkv')
    shutil.copy(folder / 'clip.mkv', clip)
    run(folder, clip, *outputs(strange), '--window', 20, '--quiet', '--resume')
    assert not leftovers(folder, strange)
    for kind in ('png', 'jpg'):
        made = pictures_of(folder, 'none-' + kind, kind)
        (made / f'03.{kind}').write_bytes(b'')
        for jobs in (1, 2):
            text = run(folder, '--jobs', jobs, made, '--background', 'n.png', expect=1)
            assert f'03.{kind} is empty' in text, text
    for kind in ('png', 'jpg'):
        cut = pictures_of(folder, 'cut-' + kind, kind)
        last = cut / f'05.{kind}'
        whole = last.read_bytes()
        last.write_bytes(whole + b'what \xff\xd8\xff\xda a camera adds')
        run(folder, cut, '--background', 'n.png', '--window', 4, '--quiet')
        last.write_bytes(whole[:len(whole) // 2])
        text = run(folder, cut, '--background', 'n.png', expect=1)
        assert f'05.{kind} is cut off' in text, text


def a_recording_that_is_cut_off(folder):
    clip = folder / 'whole.mkv'
    make_clip(clip, 100)
    text = run(folder, clip, '--background', 'w.png', '--window', 50)
    assert 'cut off' not in text, text
    whole = clip.read_bytes()
    (folder / 'half.mkv').write_bytes(whole[:len(whole) // 2])
    text = run(folder, '--jobs', 2, folder / 'half.mkv', '--background', 'w.png', '--window', 50)
    assert text.count('of 4 s: is it cut off?') == 1, text


def errors(folder):
    for words, reason in (
            (['clip.mkv', '--mask', 'm.mkv', '--report', 'no/folder/r.json'], 'r.json cannot'),
            (['clip.mkv', '--mask', 'no/folder/mask.mkv'], 'no/folder'),
            (['clip.mkv', '--mask', 'm.mkv', '--max-memory', 1000], 'max-memory allows 1000')):
        for jobs in (1, 2):
            text = run(folder, *words, '--jobs', jobs, expect=1)
            assert reason in text, f'{words}: {text}'
    for words, reason in (
            (['clip.mkv', '--mask', 'm.mkv', '--absorb-time', 'nan'], '--absorb-time'),
            (['clip.mkv'], 'nothing is to be written'),
            (['clip.mkv', '--mask', 'mask.png'], '.mkv'),
            (['clip.mkv', '--mask', 'mask.avi'], '.mkv'),
            (['clip.mkv', '--mask', 'one.mkv', '--foreground', 'one.mkv'], 'twice'),
            (['clip.mkv', '--background', 'b.png', '--method', 'magic'], 'qdmd, dmd or robust'),
            (['clip.mkv', '--background', 'b.png', '--window', 1], '--window'),
            (['clip.mkv', '--background', 'b.png', '--part', '4/3'], '--part'),
            (['none.mkv', '--background', 'b.png'], 'none.mkv')):
        text = run(folder, *words, expect=2)
        assert reason in text, f'{words}: {text}'
    (folder / 'broken.mkv').write_bytes(b'nothing of the kind' * 1000)
    for options in ({}, {'ranks': 2}):
        text = run(folder, 'broken.mkv', '--mask', 'm.mkv', expect=1, **options)
        assert 'broken.mkv cannot be decoded' in text, text
    make_clip(folder / 'other.mkv', 12, 64, 48)
    text = run(folder, 'clip.mkv', 'other.mkv', '--mask', 'm.mkv', '--window', 10, expect=1)
    assert 'a recording has one size' in text, text
    # What fails at the end of a stretch ends the job, too.
    (folder / 'taken.png' / 'inside').mkdir(parents=True)
    text = run(folder, 'clip.mkv', '--background', 'taken.png', '--window', 10, expect=1)
    assert 'taken.png' in text, text
    assert '--window' in run(folder, '--help')


def main():
    cases = [(check.__name__.replace('_', ' '), check)
             for check in (one_stretch_is_the_element, any_number_of_processes,
                           the_first_stretch_is_longer, frames_are_found_again, rows_of_windows, colours_of_recordings,
                           files_of_other_colours, what_colours_mean, files_and_pictures,
                           killed_and_resumed, a_process_that_dies, several_commands_share_a_job,
                           killed_while_parts_are_removed, resumed_with_other_options,
                           what_is_read_stays, pictures_that_are_odd, a_recording_that_is_cut_off,
                           errors)]
    words = sys.argv[3:]
    cases = [case for case in cases if not words or any(word in case[0] for word in words)]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        make_clip(folder / 'clip.mkv')
        make_clip(folder / 'long.mkv', LONG_FRAMES, 322, 242)
        return common.report([(case, lambda check=check: check(folder)) for case, check in cases])


sys.exit(main())
