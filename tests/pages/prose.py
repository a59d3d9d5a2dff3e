# SPDX-License-Identifier: LGPL-2.1-or-later
"""Reads pages as people do: their sentences, their links and the places that links can lead to."""
import re
import urllib.parse

FENCE = re.compile(r'^ *```.*?^ *```', re.S | re.M)
LINK = re.compile(r'(!?)\[((?:[^][]|\[[^]]*\])*)\]\(([^()\s]+)\)')
# A full stop, or another end, that space or the text's end follows; brackets and quotes may close before that.
END = re.compile(r'(?<=[.!?])[)*"\'\]]*(?:\s+|$)')


def without_code(text):
    return FENCE.sub('', text)


def paragraphs(text):
    """Runs of prose: paragraphs, items of lists, headings and cells of tables. Formulas, which are indented, are none."""
    text = re.sub(r'<!--.*?-->', '', without_code(text), flags=re.S)
    text = LINK.sub(lambda link: link[2], text)
    text = re.sub(r'``.*?``|`[^`]*`', 'code', text).replace('<br>', '|')
    current = []
    for line in [*text.splitlines(), '']:
        begins = re.match(r' *(?:[-*] |\d+\. |#|\|)', line)
        formula = re.match(r' {4}', line) and not current
        if (not line.strip() or begins or formula) and current:
            yield ' '.join(current)
            current = []
        if line.lstrip().startswith('|'):
            yield from line.strip().strip('|').split('|')
        elif line.strip() and not formula:
            current.append(line.strip().lstrip('#-*0123456789. ') if begins else line.strip())
    if current:
        yield ' '.join(current)


def sentences(text):
    for paragraph in paragraphs(text):
        yield from (part.strip() for part in END.split(paragraph) if part.strip())


def words(sentence):
    return [word for word in sentence.split() if re.search(r'\w', word)]


def anchors(text):
    """What GitHub makes of headings: lower case, without punctuation, - for spaces; later ones of a name get a number."""
    found = {}
    for heading in re.findall(r'^#{1,6} +(.*?) *$', without_code(text), re.M):
        heading = LINK.sub(lambda link: link[2], heading)
        name = re.sub(r'[^\w\- ]', '', heading.lower()).replace(' ', '-')
        count = found.get(name, 0)
        found[name] = count + 1
        yield f'{name}-{count}' if count else name


def dead_links(path):
    """Links of a page to files, or to headings, that are not there. Addresses of the web are taken as they are."""
    text = path.read_text(encoding='utf-8')
    for _, _, target in LINK.findall(re.sub(r'`[^`\n]*`', '', without_code(text))):
        if re.match(r'\w+:', target):
            continue
        name, _, anchor = urllib.parse.unquote(target).partition('#')
        page = path.parent / name if name else path
        if not page.exists():
            yield target
        elif anchor and anchor not in anchors(page.read_text(encoding='utf-8')):
            yield target
