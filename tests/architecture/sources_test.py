"""Rules that hold for every file of the repository."""
import os
import pathlib
import re
import subprocess
import unittest

from tests.support.sources import SOURCE, text, tracked

MAX_LINES = 400  # a file that needs more has two reasons to change
CODE = (".h", ".cpp", ".py")
# In two halves, so that this file does not hold them.
UNFINISHED = re.compile(r"\b(TO" r"DO|FIX" r"ME|X" r"XX|HA" r"CK)\b")
PLACES_OF_ONE_MACHINE = re.compile(r"(?<![\w.])/wo" r"rk/|/ho" r"me/\w")


def scripts():
    return [path for path in tracked() if (SOURCE / path).read_bytes()[:2] == b"#!"]


def bash_scripts():
    return [path for path in scripts() if "bash" in text(path).splitlines()[0]]


class EverySourceFile(unittest.TestCase):
    def test_is_named_by_a_build_file_above_it(self):
        for path in tracked(".cpp"):
            folders = [folder for folder in path.parents if (SOURCE / folder / "CMakeLists.txt").exists()]
            names = [str(path.relative_to(folder)) for folder in folders]
            named = any(re.search(rf"(?<![\w/]){re.escape(name)}(?![\w.])", text(folder / "CMakeLists.txt"))
                        for folder, name in zip(folders, names))
            if path.stem.startswith("fuzz_"):  # whittle_fuzzer() makes the file's name of the target's
                named = f"NAME {path.stem} " in text(path.parent / "CMakeLists.txt")
            self.assertTrue(named, f"{path} is in no CMakeLists.txt: nothing builds it")

    def test_has_at_most_400_lines(self):
        for path in tracked(*CODE) + bash_scripts():
            lines = text(path).count("\n")
            self.assertLessEqual(lines, MAX_LINES, f"{path} has {lines} lines")

    def test_is_formatted_as_clang_format_wants(self):
        paths = tracked(".h", ".cpp")
        done = subprocess.run(["clang-format", "--dry-run", "--Werror", *paths], cwd=SOURCE, check=False,
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, "\n".join(done.stderr.splitlines()[:40]))


class EveryHeader(unittest.TestCase):
    def test_opens_with_what_it_is_for(self):
        for path in tracked(".h"):
            first, second = (text(path).splitlines() + ["", ""])[:2]
            self.assertEqual(first, "#pragma once", path)
            self.assertRegex(second, r"^/// \S.{15,}", f"{path}: its second line must say what it is for")


class EveryFile(unittest.TestCase):
    def test_is_finished(self):
        for path in tracked():
            if path.suffix in (*CODE, ".txt", ".md", ".yaml", ".yml", "") and (SOURCE / path).suffix != ".png":
                found = UNFINISHED.search(text(path))
                self.assertIsNone(found, f"{path} holds {found and found.group()}")

    def test_names_no_place_of_one_machine(self):
        for path in tracked(*CODE, ".txt", ".md", ".yaml", ".json", ""):
            found = PLACES_OF_ONE_MACHINE.search(text(path))
            self.assertIsNone(found, f"{path} holds {found and found.group()}")

    def test_is_small_enough_to_clone(self):
        for path in tracked():
            self.assertLess((SOURCE / path).stat().st_size, 8_000_000, path)


class EveryScript(unittest.TestCase):
    def test_can_be_run(self):
        self.assertGreaterEqual(len(bash_scripts()), 4)
        for path in scripts():
            self.assertTrue(os.access(SOURCE / path, os.X_OK), f"{path} is not executable")

    def test_is_a_script_when_it_is_executable(self):
        for path in tracked():
            if os.access(SOURCE / path, os.X_OK):
                self.assertIn(path, scripts(), f"{path} is executable without a #! line")

    def test_pleases_shellcheck(self):
        done = subprocess.run(["shellcheck", *bash_scripts()], cwd=SOURCE, check=False, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout)

    def test_takes_its_packages_from_the_one_list(self):
        for path in bash_scripts():
            if path != pathlib.PurePosixPath("docker/install"):
                self.assertNotRegex(text(path), r"apt(-get)? install", f"{path}: docker/install does that")


if __name__ == "__main__":
    unittest.main()
