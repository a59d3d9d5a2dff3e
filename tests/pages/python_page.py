# SPDX-License-Identifier: LGPL-2.1-or-later
"""Runs the code of docs/notebook/python.md from its first block to its last, as a notebook does. What a block prints goes
between the markers behind it, and the pictures that it writes into docs/images/python.

Usage: python_page.py PAGE PICTURES      in a folder that has street.avi
"""
import contextlib
import io
import pathlib
import re
import shutil
import sys

import page


def main():
    if len(sys.argv) != 3:
        sys.exit('usage: python_page.py PAGE PICTURES')
    path, pictures = sys.argv[1], pathlib.Path(sys.argv[2])
    text = page.read(path)
    blocks = re.findall(r'^```python\n(.*?)^```\n\n<!-- (printed-\d+) -->', text, re.S | re.M)
    if len(blocks) != text.count('```python'):
        sys.exit(f'{path}: each block of code needs markers of what it prints behind it')
    names, contents = {}, {}
    for code, name in blocks:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, f'{path}, before {name}', 'exec'), names)
        contents[name] = f'```\n{printed.getvalue()}```' if printed.getvalue() else ''
    page.put(path, contents)
    pictures.mkdir(parents=True, exist_ok=True)
    for picture in re.findall(r'\]\(\.\./images/python/([\w.-]+)\)', text):
        shutil.copy(picture, pictures / picture)


main()
