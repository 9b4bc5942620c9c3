"""The words of the code: banned_words.txt lists those that it must not use, by where they must not stand."""
import re
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


def parts(identifier):
    """The lower-case words that an identifier is made of."""
    return [part.lower() for part in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", identifier)]


def banned_identifiers(path, source):
    found = []
    for name, line in cpp.identifiers(source).items():
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


def documentation(source):
    """[(line, text)] of the comments that document: `///`, `///<`, and the comment that opens a file."""
    found = []
    for line, comment in cpp.comments(source):
        if re.match(r"///|/\*\*", comment) or (line == 1 and comment.startswith("//")):
            found.append((line, re.sub(r"^[/*<]+\s*", "", comment)))
    return found


def banned_comment_words(path, source):
    return [f"{path}:{line}: comment with {word}" for line, comment in cpp.comments(source)
            for word in re.findall(r"\b[a-z]+\b", comment) if word in WORDS["words of comments"]]


def banned_first_words(path, source):
    found = []
    for line, comment in documentation(source):
        first = re.match(r"[A-Za-z]+", comment)
        if first and first.group().capitalize() in WORDS["first words of documentation comments"]:
            found.append(f"{path}:{line}: comment \"{comment.splitlines()[0][:60]}\"")
    return found


class Words(unittest.TestCase):
    def expect_none(self, check, *suffixes):
        found = [line for path in tracked(*suffixes) for line in check(path, text(path))]
        self.assertFalse(found, "\n" + "\n".join(found))

    def test_identifiers_are_terms_of_the_field(self):
        self.expect_none(banned_identifiers, ".h", ".cpp")

    def test_documentation_begins_with_its_subject(self):
        self.expect_none(banned_first_words, ".h", ".cpp")

    def test_comments_do_not_speak_of_programs_as_of_people(self):
        self.expect_none(banned_comment_words, ".h", ".cpp")

    def test_former_names_are_gone(self):
        self.expect_none(banned_text, ".h", ".cpp", ".py", ".yaml", ".yml", ".json", ".md")

    def test_terms_of_ray_tracing_are_in_use(self):
        used = set()
        for path in tracked(".h", ".cpp"):
            if path.parts[0] == "tracer":
                used |= cpp.identifiers(text(path)).keys()
        self.assertLessEqual(WORDS["required identifiers"], used)


class WordChecks(unittest.TestCase):
    """The checks themselves, on samples."""

    def test_split_identifiers(self):
        self.assertEqual(parts("RayQueue_v2"), ["ray", "queue", "v"])
        self.assertEqual(parts("parseJSONText_"), ["parse", "json", "text"])

    def test_find_identifiers_in_code_only(self):
        found = banned_identifiers("a.h", 'int x = 1\'000;  // told\nconst char* s = "told";\nvoid tell_all(PictureFile f);\n')
        self.assertEqual(found, ["a.h:3: identifier tell_all (tell)", "a.h:3: identifier PictureFile (picture)"])

    def test_find_words_in_comments_only(self):
        found = banned_comment_words("a.h", 'const char* s = "told";\n// It knows.\nint say;  ///< known\n')
        self.assertEqual(found, ["a.h:2: comment with knows"])

    def test_find_first_words_of_documentation_only(self):
        source = "#pragma once\n/// What it is.\n// Where not.\n/// A ray.\n/// How: a continued line.\nint x;  ///< whether so\n"
        self.assertEqual(len(banned_first_words("a.h", source)), 2)
        self.assertEqual(len(banned_first_words("a.cpp", "// Who reads.\nint x;\n")), 1)


if __name__ == "__main__":
    unittest.main()
