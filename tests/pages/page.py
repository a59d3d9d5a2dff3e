# SPDX-License-Identifier: LGPL-2.1-or-later
"""What pages are made of: text between markers, tables and short numbers.

A page has a marker before and a marker after what is made: <!-- NAME --> and <!-- end of NAME -->.

Usage: page.py PAGE NAME=FILE...    puts what each file has between the markers of its name
"""
import json
import os
import re
import sys


def parts(path, text, name):
    """What stands before the text between the markers of a name, that text, and what follows."""
    start, end = f'<!-- {name} -->', f'<!-- end of {name} -->'
    for marker in start, end:
        if text.count(marker) != 1:
            sys.exit(f'{path} must have {marker} once, and has it {text.count(marker)} times')
    before, _, rest = text.partition(start)
    content, found, after = rest.partition(end)
    if not found:
        sys.exit(f'{path} must have {end} after {start}, and has it before')
    return before + start, content, end + after


def read(path):
    # Line ends stay what they are.
    with open(path, encoding='utf-8', newline='') as file:
        return file.read()


def block(path, name):
    return parts(path, read(path), name)[1].strip()


def put(path, contents):
    """contents: {name: text between its markers}. Where one has no place, the page stays as it is."""
    text = read(path)
    for name, content in contents.items():
        before, _, after = parts(path, text, name)
        text = f'{before}\n{content.strip()}\n{after}'
    with open(path, 'w', encoding='utf-8', newline='') as file:
        file.write(text)


def table(head, rows):
    lines = ['| ' + ' | '.join(head) + ' |', '|---' * len(head) + '|']
    lines += ['| ' + ' | '.join(row) + ' |' for row in rows]
    return '\n'.join(lines)


def figure(value, unit=''):
    """Three digits."""
    if value is None:
        return ''
    if abs(value) >= 1000:
        return f'{value:.0f}{unit}'
    return f'{value:#.3g}'.rstrip('.') + unit


def medians(path):
    """The medians among what Google Benchmark wrote as JSON."""
    return [run for run in json.loads(read(path))['benchmarks']
            if run.get('aggregate_name') == 'median']


def machine(folder):
    """The processor, and its load as uptime gave it in load-before and load-after of a folder."""
    model = re.search(r'model name\s*: (.*)', read('/proc/cpuinfo'))
    before, after = (re.search(r'load average: (.*)', read(os.path.join(folder, f'load-{when}')))[1]
                     for when in ('before', 'after'))
    return (f'{model[1] if model else "unknown processor"}, {os.cpu_count()} cores; load averages '
            f'over 1, 5 and 15 minutes {before} before and {after} after.')


def main():
    if len(sys.argv) < 3 or not all('=' in argument for argument in sys.argv[2:]):
        sys.exit('usage: page.py PAGE NAME=FILE...')
    files = dict(argument.split('=', 1) for argument in sys.argv[2:])
    put(sys.argv[1], {name: read(file) for name, file in files.items()})


if __name__ == '__main__':
    main()
