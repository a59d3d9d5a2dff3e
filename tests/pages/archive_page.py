"""Times qdmd-archive on one core and on two, counts its bytes, and puts both and a model of larger
jobs into a page.

usage: archive_page.py PAGE VIDEO FOLDER [memory]

VIDEO may be empty: a simulated scene takes its place. memory: the table of memory only
"""
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys
import time

import page

ARCHIVE = 'build/examples/archive/qdmd-archive'
# Two windows of backgrounds: memory that is new to the machine is taken in the first of them. One
# shorter window of the rest, which takes long to encode.
WIDTH, HEIGHT, FRAMES = 1920, 1080, int(os.environ.get('QDMD_ARCHIVE_FRAMES', 600))
FEW = min(FRAMES, 200)
TURNS = int(os.environ.get('QDMD_ARCHIVE_TURNS', 3))
# One machine: no launcher, no network, a core for each process.
JOB = ['mpirun', '-q', '--oversubscribe', '--allow-run-as-root', '--mca', 'plm', 'isolated',
       '--mca', 'btl', 'self,vader', '--mca', 'oob_tcp_if_include', 'lo', '--mca',
       'btl_vader_single_copy_mechanism', 'none']
# name: options, outputs.
CASES = {
    '`qdmd`, background': ('qdmd', ['background']),
    '`qdmd`, background and masks': ('qdmd', ['background', 'mask']),
    '`robust`, background': ('robust', ['background']),
    '`robust`, background and masks': ('robust', ['background', 'mask']),
    '`robust`, background, masks and foreground': ('robust', ['background', 'mask', 'foreground']),
}
# The model is of an 8K recording, in windows of so many frames; machines of one core each.
MODEL_WIDTH, MODEL_HEIGHT, MODEL_WINDOW = 7680, 4320, 2000
MACHINES = (1, 2, 4, 8, 16, 32, 64)
MEMORY_PROCESSES = (1, 2, 3, 4)
MEMORY_CASES = [(WIDTH, HEIGHT, FRAMES, 'qdmd'), (WIDTH, HEIGHT, FRAMES, 'robust'),
                (1280, 720, FEW, 'robust'), (640, 480, FEW, 'robust')]


def launch(pipeline, core=None):
    start = time.perf_counter()
    subprocess.run([*(['taskset', '-c', str(core)] if core is not None else []), 'gst-launch-1.0',
                    '-q', *pipeline.split()], check=True)
    return time.perf_counter() - start


def clip(video, folder, width, height, frames):
    path = f'{folder}/{width}x{height}x{frames}.mkv'
    source = f'filesrc location={video} ! decodebin' if video else 'qdmdscenesrc scene=basic'
    if not os.path.exists(path):
        launch(f'{source} ! videoconvert ! videoscale ! '
               f'video/x-raw,format=I420,width={width},height={height} ! '
               f'identity eos-after={frames} ! x264enc speed-preset=veryfast ! h264parse ! '
               f'matroskamux ! filesink location={path}')
    return path


def frames_of(film):
    """What eos-after left is a frame more or less."""
    text = subprocess.run(['gst-launch-1.0', '-v', *f'filesrc location={film} ! matroskademux ! '
                           'identity silent=false ! fakesink'.split()], check=True,
                          capture_output=True, text=True).stdout
    return len(re.findall(r'chain  *\*\*\*', text))


def run(folder, films, processes, method, outputs, window, bind='core'):
    report = f'{folder}/report.json'
    names = {'background': 'b.png', 'mask': 'm.mkv', 'foreground': 'f.mkv'}
    words = [word for output in outputs for word in (f'--{output}', f'{folder}/{names[output]}')]
    subprocess.run([*JOB, '-n', str(processes), '--bind-to', bind, ARCHIVE, *films, *words,
                    '--method', method, '--window', str(window), '--report', report, '--quiet'],
                   check=True)
    return json.loads(pathlib.Path(report).read_text())


def decoding(folder, video, width, height, frames):
    """Seconds a frame of one core."""
    film = clip(video, folder, width, height, frames)
    # What a pipeline of no frame takes is small beside it.
    return min(launch(f'filesrc location={film} ! decodebin ! fakesink sync=false', 0)
               for _ in range(3)) / frames


def is_short(outputs):
    return outputs != ['background']


def times(folder, film, short):
    """{case: {processes: [reports]}}, in turns."""
    found = {name: {1: [], 2: []} for name in CASES}
    for turn in range(TURNS):
        for name, (method, outputs) in CASES.items():
            for processes in (1, 2):
                print(f'\rturn {turn + 1} of {TURNS}: {name}, {processes} processes ', end='',
                      file=sys.stderr)
                films = [short] if is_short(outputs) else [film, film]
                found[name][processes].append(
                    run(folder, films, processes, method, outputs, frames_of(films[0])))
    print(file=sys.stderr)
    return found


def seconds(reports):
    return statistics.median(report['of-process']['seconds'][0] for report in reports)


def part(reports, name):
    """Milliseconds a frame of the first process."""
    return 1000 * statistics.median(report['of-process'][f'seconds-{name}'][0] / report['frames']
                                    for report in reports)


def speed_table(found):
    rows = []
    for name, reports in found.items():
        one, two = seconds(reports[1]), seconds(reports[2])
        worked = [statistics.median(max(report['of-process']['processor-seconds'])
                                    for report in reports[n]) for n in (1, 2)]
        frames = reports[1][0]['frames']
        window = FRAMES if name.endswith('background') else FEW
        rows.append([f'{name}: {frames} frames, windows of {window}',
                     f'{1000 * one / frames:.1f}', f'{1000 * two / frames:.1f}',
                     f'{one / two:.2f}', f'{worked[0] / worked[1]:.2f}'])
    return page.table(['1920x1080', 'ms a frame, one process',
                       'two processes', 'times as fast',
                       'by processor time, of the one that works most'], rows)


def parts_table(found):
    names = ('reading', 'taking', 'solving', 'pictures', 'encoding', 'talking')
    rows = [[f'{name}, {processes}', *(f'{part(reports[processes], of):.2f}' for of in names)]
            for name, reports in found.items() for processes in (1, 2)]
    return page.table(['ms a frame of the first process, of processes', *names], rows)


def bytes_text(count):
    return f'{count / 1e6:.2f} MB' if count >= 1e6 else f'{count / 1e3:.2f} kB' if count >= 1000 \
        else f'{count:.0f} B'


def bytes_table(reports):
    steps = [step for step in reports[0]['bytes-received-a-frame'] if step != 'pace']
    rows = []
    for step in steps:
        most = [max(report['bytes-received-a-frame'][step]) for report in reports]
        rows.append([step, *(bytes_text(count) for count in most)])
    return page.table([f'bytes that a process takes in, a frame; *products* of a window of {FRAMES} frames',
                       *(f'{report["processes"]} processes' for report in reports)], rows)


def memory_table(folder, video):
    """Beside what the same job takes with windows of two frames."""
    rows = [[name, *(f'{part * (1 / n + 0.1):.3f}' for n in MEMORY_PROCESSES), '']
            for name, part in (('1/n and a tenth', 1), ('the same of a window in I420', 0.5))]
    for width, height, frames, method in MEMORY_CASES:
        film, little = (clip(video, folder, width, height, count) for count in (frames, 20))
        window = 3 * width * height * frames
        row, beside = [f'`{method}`, {frames} frames of {width}x{height}'], 0
        for n in MEMORY_PROCESSES:
            print(f'\rmemory: {row[0]}, {n} processes    ', end='', file=sys.stderr)
            whole, bare = (run(folder, [of], n, method, ['background'], size, 'none')
                           ['of-process']['most-memory']
                           for of, size in ((film, frames), (little, 2)))
            row.append(f'{max(a - b for a, b in zip(whole, bare)) / window:.3f}')
            beside = max(beside, *bare)
        rows.append([*row, f'{beside / 2**20:.0f} MiB'])
    print(file=sys.stderr)
    return page.table(['most memory of a process, of a window in RGB',
                       *(f'n = {n}' for n in MEMORY_PROCESSES), 'at most beside that'], rows)


def model_table(found, decode):
    """Seconds a frame, of machines with one core each; every part is one that was measured."""
    pixels, measured = MODEL_WIDTH * MODEL_HEIGHT, WIDTH * HEIGHT
    qdmd = found['`qdmd`, background and masks'][1]
    robust = found['`robust`, background and masks'][1]
    per_pixel = lambda reports, *names: sum(part(reports, name) for name in names) / 1000 / measured
    # What a frame takes without its window, and for each frame of it: products with half of them.
    taking = per_pixel(robust, 'taking')
    long = found['`qdmd`, background'][1], found['`robust`, background'][1]
    product = max(0.0, per_pixel(long[0], 'taking', 'solving') -
                  per_pixel(long[1], 'taking', 'solving')) / FRAMES
    work = {
        'qdmd': pixels * (taking + product * MODEL_WINDOW + per_pixel(qdmd, 'solving', 'pictures')),
        'robust': pixels * (taking + per_pixel(robust, 'solving', 'pictures')),
    }
    mask, cells = pixels / 8, 3 * 4 * 48 * 85
    rows = []
    for machines in MACHINES:
        others = 1 - 1 / machines
        row = [str(machines)]
        for method in ('qdmd', 'robust'):
            products = 2 * 36 * (MODEL_WINDOW if method == 'qdmd' else 0)
            sent = others * (mask + cells + products)
            alone = decode + work[method] / machines
            row.append(f'{alone:.2f}')
            for rate in (1e9, 1e10):
                row.append(f'{alone + 8 * sent / rate:.2f}')
        rows.append(row)
    head = ['machines']
    for method in ('qdmd', 'robust'):
        head += [f'`{method}`, s a frame without a network', '1 Gbit/s', '10 Gbit/s']
    text = (f'Decoding: {1000 * decode:.0f} ms a frame of {MODEL_WIDTH}x{MODEL_HEIGHT} on one core, '
            'by every machine; inner products with a window of '
            f'{MODEL_WINDOW} frames {pixels * product * MODEL_WINDOW:.2f} s, the rest '
            f'{work["qdmd"] - pixels * product * MODEL_WINDOW:.2f} s (`qdmd`) and '
            f'{work["robust"]:.2f} s (`robust`), which machines divide.')
    return text + '\n\n' + page.table(head, rows)


def main():
    target, video, folder = sys.argv[1:4]
    if sys.argv[4:] == ['memory']:
        page.put(target, {'memory': memory_table(folder, video)})
        return
    film, short = (clip(video, folder, WIDTH, HEIGHT, frames) for frames in (FRAMES, FEW))
    found = times(folder, film, short)
    every = ['background', 'mask', 'foreground']
    reports = [run(folder, [short], n, 'robust', every, FEW, 'none') for n in (2, 3, 4)]
    products = [run(folder, [film], n, 'qdmd', ['background'], FRAMES, 'none') for n in (2, 3, 4)]
    for report, of_qdmd in zip(reports, products):
        report['bytes-received-a-frame']['products'] = \
            of_qdmd['bytes-received-a-frame']['products']
    decode = decoding(folder, video, MODEL_WIDTH, MODEL_HEIGHT, 12)
    pathlib.Path(folder, 'load-after').write_text(subprocess.check_output(['uptime'], text=True))
    page.put(target, {
        'speed': speed_table(found),
        'parts': parts_table(found),
        'bytes': bytes_table(reports),
        'memory': memory_table(folder, video),
        'model': model_table(found, decode),
        'machine': page.machine(folder),
    })


if __name__ == '__main__':
    main()
