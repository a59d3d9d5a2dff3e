# SPDX-License-Identifier: LGPL-2.1-or-later
"""Fails unless the reference inside a page is what a program prints.

Usage: compare_docs.py PAGE MAKER PROGRAM [ARGUMENT...]
"""
import pathlib
import re
import subprocess
import sys

from page import block

page, maker, *program = sys.argv[1:]
reference = block(page, 'reference')
printed = subprocess.run(program, check=True, stdout=subprocess.PIPE, text=True).stdout
if reference != printed.strip():
    sys.exit(f'{page} does not match what {program[-1]} prints: run {maker}')
missing = [name for name in re.findall(r'\]\((images/[^)]*)\)', pathlib.Path(page).read_text())
           if not (pathlib.Path(page).parent / name).exists()]
if missing:
    sys.exit(f'{page} shows pictures that are not there: {missing}')
