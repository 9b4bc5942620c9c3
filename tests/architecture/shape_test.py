"""Sizes and structure: classes, functions, directories, names of files, documents."""
import collections
import os
import pathlib
import re
import tempfile
import unittest

from tests.support import cpp
from tests.support.descendants import reachable
from tests.support.sources import text, tracked

MAX_CLASS_FUNCTIONS = 30
MAX_CLASS_MEMBERS = 20
MAX_INTERFACE_FUNCTIONS = 12
MAX_FUNCTION_LINES = 60
MAX_README_LINES = 150
MAX_FILES = 1247
MAX_PRODUCT_LINES = 65_966
MAX_TEST_LINES = 56_712

INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.MULTILINE)
DOCUMENT = re.compile(r"(?<![\w*<{])[\w./-]*\w\.md\b")


def product():
    return [path for path in tracked(".h", ".cpp") if path.parts[0] in ("tracer", "api", "server")]


def directory_graph(paths, read=text):
    """{directory: {directory: [(file, included file)]}} over the includes of `paths`."""
    names = {str(path) for path in paths}
    graph = collections.defaultdict(lambda: collections.defaultdict(list))
    for path in paths:
        for name in INCLUDE.findall(read(path)):
            target = next((found for found in (name, f"tracer/include/{name}", f"api/include/{name}") if found in names), None)
            if target and os.path.dirname(target) != str(path.parent):
                graph[str(path.parent)][os.path.dirname(target)].append((str(path), target))
    return graph


def include_cycles(paths, read=text):
    """The includes that lie on a cycle of directories."""
    graph = directory_graph(paths, read)
    reach = {directory: reachable(graph, directory) for directory in graph}
    return [f"{file} includes {target}: the directories include each other"
            for directory, targets in graph.items() for other, includes in targets.items()
            if directory in reach.get(other, ()) for file, target in includes]


def repeated_names(paths):
    count = collections.Counter(path.name for path in paths)
    return [f"{path}: the name occurs {count[path.name]} times" for path in paths if count[path.name] > 1]


def server_in_api(paths, read=text):
    return [f"{path} includes {name}" for path in paths if path.parts[0] == "api"
            for name in INCLUDE.findall(read(path)) if name.startswith("server/")]


def large_classes(classes):
    found = []
    for each in classes:
        at = f"{each.path}:{each.line}: {each.name} has"
        if each.functions > MAX_CLASS_FUNCTIONS:
            found.append(f"{at} {each.functions} functions, more than {MAX_CLASS_FUNCTIONS}")
        if each.members > MAX_CLASS_MEMBERS and each.functions > 0:  # without functions it is a record
            found.append(f"{at} {each.members} data members, more than {MAX_CLASS_MEMBERS}")
        if each.pure_functions > MAX_INTERFACE_FUNCTIONS:
            found.append(f"{at} {each.pure_functions} pure virtual functions, more than {MAX_INTERFACE_FUNCTIONS}")
    return found


def long_functions(functions):
    return [f"{each.path}:{each.line}: {each.name} has {each.lines} lines, more than {MAX_FUNCTION_LINES}"
            for each in functions if each.lines > MAX_FUNCTION_LINES]


def missing_documents(paths):
    """Markdown files that code and documents name and that the repository does not have."""
    names = {str(path) for path in tracked(".md")}
    found = []
    for path in paths:
        for number, line in enumerate(text(path).splitlines(), 1):
            for named in DOCUMENT.findall(re.sub(r"https?://\S+", "", line)):
                relative = os.path.normpath(os.path.join(path.parent, named))
                if named.lstrip("./") not in names and relative not in names:
                    found.append(f"{path}:{number}: {named} is not in the repository")
    return found


def lines_of(paths):
    return sum(text(path).count("\n") for path in paths)


def large_repository():
    tests = [path for path in tracked(".h", ".cpp", ".py", ".sh") if path.parts[0] == "tests"]
    sizes = ((len(tracked()), MAX_FILES, "files in the repository"), (lines_of(product()), MAX_PRODUCT_LINES, "lines of C++ in the product"),
             (lines_of(tests), MAX_TEST_LINES, "lines in the tests"), (text("README.md").count("\n"), MAX_README_LINES, "lines in README.md"))
    return [f"{size} {what}, more than {most}" for size, most, what in sizes if size > most]


class Shape(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.classes, cls.functions = cpp.outline(product())

    def expect_none(self, found):
        self.assertFalse(found, "\n" + "\n".join(found))

    def test_directories_form_a_hierarchy(self):
        self.expect_none(include_cycles(product()))

    def test_product_files_have_unique_names(self):
        self.expect_none(repeated_names(product()))

    def test_api_includes_nothing_of_server(self):
        self.expect_none(server_in_api(product()))

    def test_classes_and_interfaces_are_small(self):
        self.assertGreater(len(self.classes), 300)
        self.expect_none(large_classes(self.classes))

    def test_functions_are_short(self):
        self.assertGreater(len(self.functions), 2000)
        self.expect_none(long_functions(self.functions))

    def test_named_documents_exist(self):
        self.expect_none(missing_documents(tracked(".h", ".cpp", ".py", ".txt", ".yaml", ".json", "")))

    def test_repository_is_small(self):
        self.expect_none(large_repository())


class ShapeChecks(unittest.TestCase):
    """The checks themselves, on samples."""

    def test_count_functions_and_members_of_a_class(self):
        with tempfile.NamedTemporaryFile("w", suffix=".h") as file:
            file.write("class Store {\n public:\n  virtual ~Store() = default;\n  virtual int find(int id) const = 0;\n  Store(const Store&) = delete;\n"
                       "  int count() const { return count_; }\n private:\n  static constexpr int limit = 3;\n  int count_ = 0, size_ = 0;\n};\n"
                       "int Store::find(int id) const {\n  return id;\n}\n")
            file.flush()
            (found,), functions = cpp.outline([file.name])
        self.assertEqual((found.functions, found.members, found.pure_functions), (2, 2, 1))
        self.assertIn(("Store::find", 3), [(each.name, each.lines) for each in functions])

    def test_find_cycles_of_directories(self):
        sources = {"a/one.h": '#include "b/two.h"', "b/two.h": '#include "a/c/three.h"', "a/c/three.h": "#include <map>"}
        paths = [pathlib.PurePosixPath(name) for name in sources]
        self.assertEqual(include_cycles(paths, lambda path: sources[str(path)]), [])
        sources["a/c/three.h"] = '#include "a/one.h"'
        self.assertEqual(len(include_cycles(paths, lambda path: sources[str(path)])), 3)
