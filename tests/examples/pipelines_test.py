# SPDX-License-Identifier: LGPL-2.1-or-later
"""Runs every gst-launch-1.0 command of the documentation, with stand-ins for what is not here.

Usage: pipelines_test.py SOURCE_ROOT

The commands come from the sh blocks of README.md, examples/*.md and docs/*.md and from the example
launch lines of the elements' own documentation. A command passes if it exits with 0 and every sink
got buffers. One with a source or sink that is neither local nor has a stand-in fails.
"""
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

import common
from common import Gst

FRAMES = 60

# Elements that need a device, a network or a screen, and what runs in their place; their own
# properties are left out.
STAND_INS = {
    'v4l2src': f'videotestsrc is-live=true pattern=ball num-buffers={FRAMES} ! '
               'video/x-raw,width=320,height=240,framerate=25/1',
    'rtspsrc': f'qdmdscenesrc is-live=true num-buffers={FRAMES} ! videoconvert ! '
               'video/x-raw,format=I420 ! jpegenc ! rtpjpegpay',
    'autoaudiosrc': f'audiotestsrc is-live=true samplesperbuffer=1764 num-buffers={FRAMES} ! '
                    'audio/x-raw,rate=44100',
    'autovideosink': 'filesink',
    'autoaudiosink': 'filesink',
    'fakesink': 'filesink',
}
ENDLESS_SOURCES = {'qdmdscenesrc', 'videotestsrc', 'audiotestsrc'}
LOCAL_SOURCES = ENDLESS_SOURCES | {'filesrc'}
LOCAL_SINKS = {'filesink', 'multifilesink'}
FILE_MAKERS = {'.avi': common.make_film, '.mp4': common.make_film, '.png': common.make_picture}


def logical_lines(text, first_line):
    """Lines of a shell script, continued ones joined, with the number of their first line."""
    joined, start = '', None
    for number, line in enumerate(text.splitlines(), first_line):
        start = start or number
        joined += line
        if joined.endswith('\\'):
            joined = joined[:-1]
            continue
        yield start, joined.strip()
        joined, start = '', None
    if joined:
        yield start, joined.strip()


def scripts_of(page):
    """(language, text, first line) of every block of code."""
    text = page.read_text()
    if page.suffix == '.md':
        blocks = re.finditer(r'^ *```(\w*)\n(.*?)^ *```', text, re.S | re.M)
        return [(b[1], b[2], text[:b.start(2)].count('\n') + 1) for b in blocks]
    blocks = re.finditer(r'\|\[\n(.*?)\n \* \]\|', text, re.S)
    return [('sh', re.sub(r'^ \* ?', '', b[1], flags=re.M), text[:b.start(1)].count('\n') + 1)
            for b in blocks]


def commands_of(page):
    for language, script, first_line in scripts_of(page):
        for number, line in logical_lines(script, first_line):
            if 'gst-launch-1.0' in line and not line.startswith('#'):
                yield number, language, line


def with_stand_ins(words):
    """The words of a pipeline in which nothing needs a device or goes on for long."""
    replaced, dropping = [], False
    for word in words:
        is_property = re.match(r'[\w:-]+=', word)
        if word in STAND_INS:
            replaced += STAND_INS[word].split()
            if STAND_INS[word] == 'filesink':
                replaced.append(f'location=stand-in-{len(replaced)}')
            dropping = True
        elif not (dropping and is_property):
            dropping = False
            replaced.append(word)
    short = []
    for word in replaced:
        number = re.fullmatch(r'num-buffers=(\d+)', word)
        if number and int(number[1]) > FRAMES:
            continue
        short.append(word)
        if word in ENDLESS_SOURCES:
            # The last one holds: fewer that are asked for are kept.
            short.append(f'num-buffers={FRAMES}')
    return short


def has_pads(element, direction):
    templates = element.get_factory().get_static_pad_templates()
    return any(template.direction == direction for template in templates)


def check_is_local(words):
    """Returns the pipeline's sinks; fails where an element would reach out of this folder."""
    pipeline = Gst.parse_launchv(words)
    sinks = []
    for element in pipeline.children:
        name = element.get_factory().get_name()
        is_source = not has_pads(element, Gst.PadDirection.SINK)
        is_sink = not has_pads(element, Gst.PadDirection.SRC)
        assert not is_source or name in LOCAL_SOURCES, f'the source {name} has no stand-in'
        assert not is_sink or name in LOCAL_SINKS, f'the sink {name} has no stand-in'
        if is_sink:
            sinks.append(element)
    assert sinks, 'there is no sink'
    return sinks


def check_command(language, line, folder):
    assert language == 'sh', f'a command in a block of "{language}", which is not run: use sh'
    words = shlex.split(line, comments=True)
    assert words[0] == 'gst-launch-1.0', 'only commands that begin with gst-launch-1.0 are run'
    operators = {'|', '||', '&', '&&', ';', '>', '<', '2>'}.intersection(words)
    assert not operators, f'{operators} would need a shell'
    words = with_stand_ins([word for word in words[1:] if word not in ('-e', '-m', '-q', '-v')])
    try:
        sinks = check_is_local(words)
    except common.GLib.Error as error:
        raise AssertionError(f'{" ".join(words)}\n{error.message}') from error

    for word in words:
        location = re.fullmatch(r'location=(.*)', word)
        path = pathlib.Path(location[1]) if location else None
        assert not path or not path.is_absolute(), f'{path} is not in the folder of the test'
    for index, word in enumerate(words):
        if word == 'filesrc':
            path = folder / words[index + 1].removeprefix('location=')
            assert path.suffix in FILE_MAKERS, f'no stand-in for {path.name}'
            if not path.exists():
                FILE_MAKERS[path.suffix](path)

    written = [re.sub(r'%0?\d*d', '*', sink.get_property('location')) for sink in sinks]
    # What an earlier command left must not stand for what this one did not write.
    for pattern in written:
        for path in folder.glob(pattern):
            path.unlink()
    run = subprocess.run(['gst-launch-1.0', *words], cwd=folder, timeout=60,
                         stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert run.returncode == 0, '\n'.join([' '.join(words), run.stdout])
    for pattern in written:
        arrived = [path for path in folder.glob(pattern) if path.stat().st_size > 0]
        assert arrived, '\n'.join([f'nothing arrived at {pattern}', ' '.join(words), run.stdout])


def main():
    root = pathlib.Path(sys.argv[1])
    pages = [root / 'README.md', *sorted(root.glob('docs/*.md')),
             *sorted(root.glob('examples/*.md')), *sorted(root.glob('gst/*.cpp'))]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        cases = [(f'{page.relative_to(root)}:{number}',
                  lambda language=language, line=line: check_command(language, line, folder))
                 for page in pages for number, language, line in commands_of(page)]
        return common.report(cases)


sys.exit(main())
