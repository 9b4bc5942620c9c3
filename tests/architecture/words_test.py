"""The words of code and documents: banned_words.txt lists those that they must not use, by where they must not stand."""
import functools
import io
import re
import tokenize
import unittest

from tests.support import cpp
from tests.support.sources import text, tracked


def sections(listing):
    """{section: its words}"""
    found = {}
    for line in listing.splitlines():
        if heading := re.fullmatch(r"\[(.*)\]", line):
            found[heading.group(1)] = words = set()
        elif line and not line.startswith("#"):
            words.update(line.split())
    return found


WORDS = sections(text("tests/architecture/banned_words.txt"))
# Files that are read as a whole: documents, the schema, and the texts of the page.
DOCUMENTS = (".md", "openapi.yaml", ".schema.json", "server/web/words.js")
# The beginning of a description (YAML, JSON) or of a cell of a table (Markdown).
DESCRIPTION = re.compile(r'(?:"description": "|\bdescription: "?|\| )(\w.*?)(?=$| \|)')


def parts(identifier):
    """The lower-case words that an identifier is made of."""
    return [part.lower() for part in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", identifier)]


@functools.cache
def python_tokens(source):
    """({identifier: the first line that has it}, [(line, text)] of comments, the same of docstrings)"""
    names, comments, docstrings, previous = {}, [], [], tokenize.NEWLINE
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.NAME:
            names.setdefault(token.string, token.start[0])
        elif token.type == tokenize.COMMENT:
            comments.append((token.start[0], token.string))
        elif token.type == tokenize.STRING and previous in (tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT):
            docstrings.append((token.start[0], token.string))
        if token.type not in (tokenize.COMMENT, tokenize.NL):
            previous = token.type
    return names, comments, docstrings


def is_python(path, source):
    return path.endswith(".py") or source.startswith("#!/usr/bin/env python3")


def identifiers(path, source):
    return python_tokens(source)[0] if is_python(path, source) else cpp.identifiers(source)


def prose(path, source):
    """[(line, text)] that people read: of code, the comments and docstrings; of other files, all."""
    if path.endswith(DOCUMENTS):
        return list(enumerate(source.splitlines(), 1))
    if is_python(path, source):
        _, comments, docstrings = python_tokens(source)
        return comments + docstrings
    return cpp.comments(source)


def documentation(path, source):
    """[(line, text)] of descriptions, cells of tables, docstrings and comments that document (`///`, `/**`, the one that opens a file)."""
    if path.endswith(DOCUMENTS):
        found = [(number, part) for number, line in enumerate(source.splitlines(), 1) for part in DESCRIPTION.findall(line)]
    elif is_python(path, source):
        found = python_tokens(source)[2]
    else:
        found = [(line, comment) for line, comment in cpp.comments(source)
                 if re.match(r"///|/\*\*", comment) or (line == 1 and comment.startswith("//"))]
    return [(line, re.sub(r'^[/*<"]+\s*', "", part)) for line, part in found]


def banned_identifiers(path, source):
    found = []
    for name, line in identifiers(path, source).items():
        if name in WORDS["accepted identifiers"]:
            continue
        if name in WORDS["identifiers"]:
            found.append(f"{path}:{line}: identifier {name}")
        elif banned := set(parts(name)) & WORDS["parts of identifiers"]:
            found.append(f"{path}:{line}: identifier {name} ({', '.join(sorted(banned))})")
    return found


def banned_text(path, source):
    return [f"{path}:{number}: {name}" for number, line in enumerate(source.splitlines(), 1)
            for name in re.findall(r"\w+", line) if name in WORDS["text"]]


def banned_prose(path, source):
    return [f"{path}:{line}: {word}" for line, part in prose(path, source)
            for word in re.findall(r"\b[A-Za-z]+\b", part) if word.lower() in WORDS["words of prose"]]


def banned_first_words(path, source):
    found = []
    for line, part in documentation(path, source):
        first = re.match(r"[A-Za-z]+", part)
        if first and first.group().capitalize() in WORDS["first words of documentation"]:
            found.append(f"{path}:{line}: \"{part.splitlines()[0][:60]}\"")
    return found


class Words(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        paths = [path for path in tracked(".h", ".cpp", ".js", ".py", "", ".md", ".json", ".yaml", ".yml")]
        cls.files = {str(path): text(path) for path in paths}
        cls.code = {path: source for path, source in cls.files.items() if path.endswith((".h", ".cpp", ".js")) or is_python(path, source)}
        cls.readable = {path: source for path, source in cls.files.items() if path in cls.code or path.endswith(DOCUMENTS)}

    def expect_none(self, check, files):
        found = [line for path, source in files.items() for line in check(path, source)]
        self.assertFalse(found, "\n" + "\n".join(found))

    def test_identifiers_are_terms_of_the_field(self):
        self.expect_none(banned_identifiers, self.code)

    def test_documentation_begins_with_its_subject(self):
        self.expect_none(banned_first_words, self.readable)

    def test_prose_does_not_speak_of_programs_as_of_people(self):
        self.expect_none(banned_prose, self.readable)

    def test_former_names_are_gone(self):
        self.expect_none(banned_text, self.files)

    def test_terms_of_ray_tracing_are_in_use(self):
        used = set()
        for path in tracked(".h", ".cpp"):
            if path.parts[0] == "tracer":
                used |= cpp.identifiers(text(path)).keys()
        self.assertLessEqual(WORDS["required identifiers"], used)


class WordChecks(unittest.TestCase):
    """The checks themselves, on samples."""

    def test_find_words_where_they_must_not_stand(self):
        cpp_source = 'int x = 1\'000;  // It knows.\nconst char* s = "told";\nvoid tell_all(PictureFile f);\n/// What it is.\n// Where not.\nint y;  ///< whether so\n'
        python_source = '"""What."""\ntold = "folder"  # Tells.\n'
        self.assertEqual(banned_identifiers("a.h", cpp_source), ["a.h:3: identifier tell_all (tell)", "a.h:3: identifier PictureFile (picture)"])
        self.assertEqual(banned_identifiers("a.js", "const x = 'told';\nconst asked = html`<b>${tell(x)}</b>`;\n"), ["a.js:2: identifier asked (asked)", "a.js:2: identifier tell (tell)"])
        self.assertEqual(banned_identifiers("a.py", python_source), ["a.py:2: identifier told (told)"])
        self.assertEqual(banned_prose("a.h", cpp_source), ["a.h:1: knows"])
        self.assertEqual(banned_prose("a.py", python_source), ["a.py:2: Tells"])
        self.assertEqual(banned_prose("README.md", "A scene\nor a folder\n"), ["README.md:2: folder"])
        for path, source, count in (("a.h", cpp_source, 2), ("a.py", python_source, 1), ("a.js", "/** What. */\nlet x;  // What else.\n", 1),
                                    ("a.schema.json", '{"description": "Of all."}\n', 1), ("openapi.yaml", "a: {description: Of all}\n", 1),
                                    ("README.md", "What is a ray?\n\n| a | What it is |\n", 1)):
            self.assertEqual(len(banned_first_words(path, source)), count, path)
