"""Fails unless the reference inside docs/scenes.md is what scene-table prints.

Usage: compare_docs.py PAGE SCENE_TABLE
"""
import pathlib
import re
import subprocess
import sys

page, program = sys.argv[1:]
text = pathlib.Path(page).read_text()
reference = re.search('<!-- reference -->(.*)<!-- end of reference -->', text, re.S)
if not reference:
    sys.exit(f'{page} has no place for the reference')
printed = subprocess.run([program], check=True, capture_output=True, text=True).stdout
if reference.group(1).strip() != printed.strip():
    sys.exit(f'{page} does not match the effects: run docs/make-scenes.sh')
missing = [name for name in re.findall(r'\]\((images/[^)]*)\)', text)
           if not (pathlib.Path(page).parent / name).exists()]
if missing:
    sys.exit(f'{page} shows pictures that are not there: {missing}')
