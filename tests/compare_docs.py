"""Fails unless the reference inside a page is what a program prints.

Usage: compare_docs.py PAGE MAKER PROGRAM [ARGUMENT...]
"""
import pathlib
import re
import subprocess
import sys

page, maker, *program = sys.argv[1:]
text = pathlib.Path(page).read_text()
reference = re.search('<!-- reference -->(.*)<!-- end of reference -->', text, re.S)
if not reference:
    sys.exit(f'{page} has no place for the reference')
printed = subprocess.run(program, check=True, stdout=subprocess.PIPE, text=True).stdout
if reference.group(1).strip() != printed.strip():
    sys.exit(f'{page} does not match what {program[-1]} prints: run {maker}')
missing = [name for name in re.findall(r'\]\((images/[^)]*)\)', text)
           if not (pathlib.Path(page).parent / name).exists()]
if missing:
    sys.exit(f'{page} shows pictures that are not there: {missing}')
