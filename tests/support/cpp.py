"""C++ sources for the tests of tests/architecture: code without comments, comments without code, classes and functions (ctags)."""
import collections
import json
import re
import subprocess

from tests.support.sources import SOURCE, text

# Comments, string and character literals; the first group holds a comment. Digit separators (1'000) are no literals.
TOKEN = re.compile(r'(//[^\n]*|/\*.*?\*/)|R"(\w*)\(.*?\)\2"|"(?:\\.|[^"\\\n])*"|(?<![0-9A-Fa-f])\'(?:\\.|[^\'\\\n])+\'', re.DOTALL)


def code(source):
    """`source` without comments and literals; the lines stay."""
    return TOKEN.sub(lambda found: '""' + "\n" * found.group().count("\n"), source)


def identifiers(source):
    """{identifier: the first line that has it}"""
    lines = {}
    for number, line in enumerate(code(source).splitlines(), 1):
        if not re.match(r"\s*#\s*(include|pragma|error)", line):
            for name in re.findall(r"(?<![\w.])[A-Za-z_]\w*", re.sub(r"\.(?=[A-Za-z_])", " ", line)):
                lines.setdefault(name, number)
    return lines


def comments(source):
    """[(line, text)]: each comment, successive `//` lines joined; the text begins with its slashes."""
    found = []
    end = -1
    for match in TOKEN.finditer(source):
        if match.group(1) is None:
            continue
        line = source.count("\n", 0, match.start()) + 1
        alone = not source[source.rfind("\n", 0, match.start()) + 1:match.start()].strip()
        if alone and line == end + 1 and not match.group().startswith("/*"):
            found[-1] = (found[-1][0], found[-1][1] + "\n" + match.group())
        else:
            found.append((line, match.group()))
        end = line if alone else -1
    return found


Class = collections.namedtuple("Class", "path line name functions members pure_functions")
Function = collections.namedtuple("Function", "path line name lines")


def outline(paths):
    """([Class], [Function]) of the C++ files `paths`. Functions that are defaulted or deleted, and constants, are not counted."""
    command = ["ctags", "--output-format=json", "--languages=C++", "--langmap=C++:.h.cpp", "--kinds-C++=cfmps", "--fields=+neKsSp",
               "--fields-C++=+{properties}", "--sort=no", "-f", "-", *map(str, paths)]
    printed = subprocess.run(command, cwd=SOURCE, check=True, capture_output=True, text=True).stdout
    tags = [json.loads(line) for line in printed.splitlines()]
    functions = [Function(tag["path"], tag["line"], "::".join(filter(None, [tag.get("scope", ""), tag["name"]])),
                          tag["end"] - tag["line"] + 1)
                 for tag in tags if tag["kind"] == "function" and "end" in tag]
    inside = collections.defaultdict(list)
    for tag in tags:
        inside[tag["path"], tag.get("scope")].append(tag)
    classes = []
    for tag in tags:
        if tag["kind"] not in ("class", "struct") or "end" not in tag:
            continue
        name = "::".join(filter(None, [tag.get("scope", ""), tag["name"]]))
        body = [other for other in inside[tag["path"], name]
                if tag["line"] <= other["line"] <= tag["end"]]
        lines = text(tag["path"]).splitlines()
        made = [other for other in body if other["kind"] in ("function", "prototype")
                and not {"delete", "default"} & set(other.get("properties", "").split(","))]
        held = [other for other in body if other["kind"] == "member"
                and not re.match(r"\s*(static|constexpr)\b", lines[other["line"] - 1])]
        pure = [other for other in made if "pure" in other.get("properties", "").split(",")]
        classes.append(Class(tag["path"], tag["line"], name, len(made), len(held), len(pure)))
    return classes, functions
