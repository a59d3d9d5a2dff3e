#!/usr/bin/python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Adds up the test log of a build folder: count_results.py BUILD prints `N passed, N failed, N skipped`.

GoogleTest's own cases are counted, not programs.
"""
import sys
import xml.etree.ElementTree as tree

cases = failed = skipped = 0
for case in tree.parse(sys.argv[1] + '/meson-logs/testlog.junit.xml').iter('testcase'):
    cases += 1
    if case.find('failure') is not None or case.find('error') is not None:
        failed += 1
    elif case.find('skipped') is not None:
        skipped += 1
print(f'{cases - failed - skipped} passed, {failed} failed, {skipped} skipped')
