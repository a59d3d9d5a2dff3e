"""Tests what puts text between the markers of a page, and the pages themselves.

Usage: page_test.py SOURCE_ROOT
"""
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import page

ROOT = pathlib.Path(sys.argv.pop())
# Two blocks, text of several bytes a character, line ends of two kinds, none at the end.
PAGE = ('# Größe\r\n\n<!-- a -->\nold\n<!-- end of a -->\n\\1 between\r\n'
        '<!-- b -->\n<!-- end of b -->\nlast').encode()


class Markers(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def put(self, before, **contents):
        """What page.py ends with, what it says, and what the page is then."""
        path = self.folder / 'page.md'
        path.write_bytes(before)
        arguments = []
        for name, content in contents.items():
            (self.folder / name).write_text(content, encoding='utf-8')
            arguments.append(f'{name}={self.folder / name}')
        run = subprocess.run([sys.executable, page.__file__, path, *arguments],
                             capture_output=True, text=True, check=False)
        return run.returncode, run.stderr.strip(), path.read_bytes()

    def assert_refused(self, before, saying):
        status, said, after = self.put(before, a='new', b='new')
        self.assertEqual((status, after), (1, before))
        self.assertEqual(said, f'{self.folder}/page.md must have {saying}')

    def test_replaces_what_is_between_and_nothing_else(self):
        status, said, after = self.put(PAGE, a='\nnew\n\\1 é\n\n', b='b')
        self.assertEqual((status, said), (0, ''))
        self.assertEqual(after, PAGE.replace(b'old', 'new\n\\1 é'.encode())
                         .replace(b'<!-- b -->\n', b'<!-- b -->\nb\n'))

    def test_refuses_a_marker_that_is_missing(self):
        self.assert_refused(PAGE.replace(b'<!-- b -->', b''), '<!-- b --> once, and has it 0 times')
        self.assert_refused(PAGE.replace(b'<!-- end of b -->', b''),
                            '<!-- end of b --> once, and has it 0 times')

    def test_refuses_a_marker_that_is_there_twice(self):
        self.assert_refused(PAGE + PAGE, '<!-- a --> once, and has it 2 times')
        self.assert_refused(PAGE + b'<!-- end of b -->',
                            '<!-- end of b --> once, and has it 2 times')

    def test_refuses_an_end_before_its_start(self):
        self.assert_refused(b'<!-- end of a --><!-- a -->',
                            '<!-- end of a --> after <!-- a -->, and has it before')

    def test_says_how_it_is_used(self):
        run = subprocess.run([sys.executable, page.__file__, 'page.md'], capture_output=True,
                             text=True, check=False)
        self.assertEqual((run.returncode, run.stderr), (1, 'usage: page.py PAGE NAME=FILE...\n'))


class Pages(unittest.TestCase):
    def test_pages_take_each_of_their_blocks_back(self):
        found = 0
        for path in sorted(ROOT.glob('docs/*.md')):
            text = path.read_bytes()
            names = re.findall('<!-- (?:end of )?(.*?) -->', text.decode())
            with tempfile.TemporaryDirectory() as folder:
                copy = pathlib.Path(folder) / path.name
                copy.write_bytes(text)
                page.put(copy, {name: page.block(copy, name) for name in names})
                self.assertEqual(copy.read_bytes(), text, path)
            found += len(names)
        self.assertGreater(found, 0)

    def test_the_index_has_every_page(self):
        index = (ROOT / 'docs/README.md').read_text(encoding='utf-8')
        for path in sorted(ROOT.glob('docs/*.md')):
            if path.name != 'README.md':
                self.assertIn(f']({path.name})', index)

    def test_readme_has_the_figures_of_the_pages(self):
        made = subprocess.run([sys.executable, ROOT / 'tests/pages/readme_page.py', ROOT / 'docs'],
                              capture_output=True, text=True, check=True).stdout
        self.assertEqual(page.block(ROOT / 'README.md', 'figures'), made.strip(),
                         'run tests/pages/readme.sh')

    def test_readme_is_short_and_its_links_lead_somewhere(self):
        text = (ROOT / 'README.md').read_text(encoding='utf-8')
        self.assertLessEqual(len(text.split()), 900)
        links = re.findall(r'\]\(([^)#:]+)', text)
        self.assertGreater(len(links), 5)
        for link in links:
            self.assertTrue((ROOT / link).exists(), link)


unittest.main()
