# SPDX-License-Identifier: LGPL-2.1-or-later
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
import prose

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


class Prose(unittest.TestCase):
    def test_sentences(self):
        text = ('# A heading without an end\n\nOne is here. Two (with 3.5 dots.)\ngoes on `in. code` - here! *Three?*\n'
                '- an item\n- [a link. Of two](page.md)\n\n```sh\nno. prose.\n```\n| a cell | another. one<br>third |\n|---|---|\n'
                '\n    a formula. is none\n\n<!-- no. prose -->\nlast')
        self.assertEqual(list(prose.sentences(text)),
                         ['A heading without an end', 'One is here.', 'Two (with 3.5 dots.', 'goes on code - here!',
                          '*Three?', 'an item', 'a link.', 'Of two', 'a cell', 'another.', 'one', 'third',
                          '---', '---', 'last'])
        self.assertEqual(len(prose.words('goes on code - here!')), 4)

    def test_anchors(self):
        self.assertEqual(list(prose.anchors('# The `a-b` of [it](x.md), 1.\n```sh\n# none\n```\n## Twice\n## Twice\n')),
                         ['the-a-b-of-it-1', 'twice', 'twice-1'])

    def test_dead_links(self):
        with tempfile.TemporaryDirectory() as folder:
            page_path = pathlib.Path(folder) / 'page.md'
            (pathlib.Path(folder) / 'other.md').write_text('# Here\n')
            page_path.write_text('# Top\n[a](other.md) [b](other.md#here) [c](#top) [d](https://e.org) `[e](none.md)`\n'
                                 '[f](other.md#there) [g](none.md) ![h](no.jpg) [i](#bottom)\n')
            self.assertEqual(list(prose.dead_links(page_path)),
                             ['other.md#there', 'none.md', 'no.jpg', '#bottom'])


GUIDES = [ROOT / 'README.md', *sorted(ROOT.glob('docs/*.md')), *sorted(ROOT.glob('examples/*.md'))]
NOTEBOOK = sorted(ROOT.glob('docs/notebook/*.md'))
MOST_LINES, MOST_WORDS = 250, 35
# Lists of names, in what the elements say of themselves, are no sentences.
LISTS = ('Presets: ', 'Effects, each of them a preset too: ')


class Pages(unittest.TestCase):
    def test_guides_are_short(self):
        for path in ROOT.glob('docs/*.md'):
            with self.subTest(path.name):
                lines = len(path.read_text(encoding='utf-8').splitlines())
                self.assertLessEqual(lines, MOST_LINES, f'{path}: what was tried belongs into docs/notebook')

    def test_sentences_of_guides_are_short(self):
        for path in GUIDES:
            if path.name == 'CHANGELOG.md':
                continue
            for sentence in prose.sentences(path.read_text(encoding='utf-8')):
                with self.subTest(path.name):
                    if not sentence.startswith(LISTS):
                        self.assertLessEqual(len(prose.words(sentence)), MOST_WORDS, f'{path}: {sentence}')

    def test_links_lead_somewhere(self):
        for path in GUIDES + NOTEBOOK:
            with self.subTest(path.name):
                self.assertEqual(list(prose.dead_links(path)), [], path)

    def test_each_page_of_the_notebook_has_a_guide_that_leads_to_it(self):
        self.assertGreater(len(NOTEBOOK), 0)
        for path in NOTEBOOK:
            with self.subTest(path.name):
                guide = (ROOT / 'docs' / path.name).read_text(encoding='utf-8')
                self.assertIn(f'](notebook/{path.name}', guide)

    def test_pages_take_each_of_their_blocks_back(self):
        found = 0
        for path in GUIDES + NOTEBOOK:
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

    def test_readme_is_short(self):
        self.assertLessEqual(len((ROOT / 'README.md').read_text(encoding='utf-8').split()), 900)


unittest.main()
