"""clang-tidy with the rules of .clang-tidy finds nothing.

$WHITTLE_TIDY_ALL=yes checks every source that is built, which takes half an hour of processor time. Otherwise MAX_SOURCES are checked:
those of the product that the last commit or the working tree changes, and others, which differ from commit to commit.
"""
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

from tests.support.sources import SOURCE, run, tracked

MAX_SOURCES = 16


def git(*command):
    return run("git", "-C", SOURCE, "-c", f"safe.directory={SOURCE}", *command).stdout.split()


def compile_commands(directory):
    """The entries of a build without batches of sources and without GCC's precompiled headers, which clang cannot read. The
    build is configured in `directory` only."""
    subprocess.run(["cmake", "--preset", "debug", "-B", directory], cwd=SOURCE, check=True, capture_output=True)
    entries = json.loads(pathlib.Path(directory, "compile_commands.json").read_text(encoding="utf-8"))
    for entry in entries:
        entry["command"] = re.sub(r" -Winvalid-pch| -include \S*cmake_pch\.hxx", "", entry["command"])
    return entries


def selected(built):
    """The sources to check, relative to the root."""
    product = [path for path in tracked(".cpp") if str(SOURCE / path) in built]
    if os.environ.get("WHITTLE_TIDY_ALL"):
        return product
    product = [path for path in product if path.parts[0] != "tests"]
    changed = set(git("diff", "--name-only", "HEAD~1"))
    commits = int((git("rev-list", "--count", "HEAD") or ["0"])[0])
    start = commits * MAX_SOURCES % len(product)
    return sorted(product[start:] + product[:start], key=lambda path: str(path) not in changed)[:MAX_SOURCES]


def findings(directory, path):
    """The output of clang-tidy if it finds something in one source. GCC's own warning options are unknown to it."""
    done = run("clang-tidy", "--quiet", "-p", directory, "--extra-arg=-Wno-unknown-warning-option", SOURCE / path, timeout=None)
    return "" if done.returncode == 0 else done.stdout + done.stderr


class ClangTidy(unittest.TestCase):
    def test_finds_nothing(self):
        with tempfile.TemporaryDirectory() as directory:
            entries = compile_commands(directory)
            pathlib.Path(directory, "compile_commands.json").write_text(json.dumps(entries), encoding="utf-8")
            sources = selected({entry["file"] for entry in entries})
            self.assertGreaterEqual(len(sources), MAX_SOURCES)
            with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
                found = [text for text in pool.map(lambda path: findings(directory, path), sources) if text]
        self.assertFalse(found, "\n".join(found))
