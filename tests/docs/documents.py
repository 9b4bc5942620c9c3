"""Code blocks, links and headings of the Markdown files of the repository.

Blocks marked `sh` are run by docs_test.py. A block marked `console` is not; the line before it is a comment:
    <!-- not run: REASON -->    or    <!-- run by PATH OF A TEST -->
"""
import collections
import re
import textwrap

from tests.support.sources import text, tracked

Block = collections.namedtuple("Block", "language code comment")

PAGES = [str(path) for path in tracked(".md")]
BLOCK = re.compile(r"(?:^ *<!-- ([^\n]*) -->\n)?^( *)```([^\n]*)\n(.*?)^\2```$", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`[^`\n]*`")


def blocks(page, language=None):
    """The code blocks of a page in order, or those of one language."""
    found = [Block(name, textwrap.dedent(code), comment) for comment, _, name, code in BLOCK.findall(text(page))]
    return [block for block in found if language in (None, block.language)]


def links(page):
    """Targets of links and images as (path, anchor); web addresses are left out. Code is not prose."""
    prose = INLINE.sub("", BLOCK.sub("", text(page)))
    targets = re.findall(r"\]\(([^)\s]+)\)", re.sub(r"\[`?\]\(", "](", prose))
    return [(path, anchor) for path, _, anchor in (target.partition("#") for target in targets if "://" not in target)]


def anchors(page):
    """Anchors of the headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", BLOCK.sub("", text(page)), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def section(page, heading):
    """The text below a heading, up to the next heading of the same or a higher level."""
    level, body = re.search(rf"^(#+) {re.escape(heading)}\n(.*)\Z", text(page), re.MULTILINE | re.DOTALL).groups()
    return re.split(rf"^#{{1,{len(level)}}} ", body, maxsplit=1, flags=re.MULTILINE)[0]


def code_words(markdown):
    """All words in code spans: `a`, `b.c` gives a, b, c."""
    spans = re.findall(r"`([^`\n]+)`", markdown)
    return {word for span in spans for word in re.findall(r"[\w+-]+", span)}
