"""Rules that hold for every file of the repository."""
import os
import pathlib
import re
import unittest

from tests.support.sources import SOURCE, run, text, tracked

MAX_LINES = 400
CODE = (".h", ".cpp", ".py", ".js", ".css", ".html")
# Split, so that this file does not match.
UNFINISHED = re.compile(r"\b(TO" r"DO|FIX" r"ME|X" r"XX|HA" r"CK)\b")
PATHS_OF_ONE_MACHINE = re.compile(r"(?<![\w.])/wo" r"rk/|/ho" r"me/\w")


def scripts():
    return [path for path in tracked() if (SOURCE / path).read_bytes()[:2] == b"#!"]


def bash_scripts():
    return [path for path in scripts() if "bash" in text(path).splitlines()[0]]


class EverySourceFile(unittest.TestCase):
    def test_is_listed_in_a_build_file(self):
        lists = {path.parent: text(path) for path in tracked(".txt") if path.name == "CMakeLists.txt"}
        for path in tracked(".cpp"):
            named = any(re.search(rf"(?<![\w./]){re.escape(os.path.relpath(path, directory))}(?![\w.])", listed)
                        for directory, listed in lists.items())
            if path.stem.startswith("fuzz_"):  # whittle_fuzzer() derives the file name from the target
                named = f"NAME {path.stem} " in text(path.parent / "CMakeLists.txt")
            self.assertTrue(named, f"{path} is in no CMakeLists.txt")

    def test_has_at_most_400_lines(self):
        for path in tracked(*CODE) + bash_scripts():
            lines = text(path).count("\n")
            self.assertLessEqual(lines, MAX_LINES, f"{path} has {lines} lines")

    def test_is_formatted_by_clang_format(self):
        paths = tracked(".h", ".cpp")
        done = run("clang-format", "--dry-run", "--Werror", *paths, cwd=SOURCE)
        self.assertEqual(done.returncode, 0, "\n".join(done.stderr.splitlines()[:40]))


class EveryHeader(unittest.TestCase):
    def test_begins_with_pragma_and_purpose(self):
        for path in tracked(".h"):
            first, second = (text(path).splitlines() + ["", ""])[:2]
            self.assertEqual(first, "#pragma once", path)
            self.assertRegex(second, r"^/// \S.{15,}", f"{path}: the second line must state the purpose")


class EveryFile(unittest.TestCase):
    def test_is_finished(self):
        for path in tracked():
            if path.suffix in (*CODE, ".txt", ".md", ".yaml", ".yml", "") and (SOURCE / path).suffix != ".png":
                found = UNFINISHED.search(text(path))
                self.assertIsNone(found, f"{path} contains {found and found.group()}")

    def test_contains_no_path_of_one_machine(self):
        for path in tracked(*CODE, ".txt", ".md", ".yaml", ".json", ""):
            found = PATHS_OF_ONE_MACHINE.search(text(path))
            self.assertIsNone(found, f"{path} contains {found and found.group()}")

    def test_is_small_enough_to_clone(self):
        for path in tracked():
            self.assertLess((SOURCE / path).stat().st_size, 8_000_000, path)


class EveryScript(unittest.TestCase):
    def test_is_executable(self):
        self.assertGreaterEqual(len(bash_scripts()), 4)
        for path in scripts():
            self.assertTrue(os.access(SOURCE / path, os.X_OK), f"{path} is not executable")

    def test_begins_with_interpreter_if_executable(self):
        for path in tracked():
            if os.access(SOURCE / path, os.X_OK):
                self.assertIn(path, scripts(), f"{path} is executable without a #! line")

    def test_passes_shellcheck(self):
        done = run("shellcheck", *bash_scripts(), cwd=SOURCE)
        self.assertEqual(done.returncode, 0, done.stdout)

    def test_installs_packages_with_docker_install_only(self):
        for path in bash_scripts():
            if path != pathlib.PurePosixPath("docker/install"):
                self.assertNotRegex(text(path), r"apt(-get)? install", f"{path}: docker/install does that")
