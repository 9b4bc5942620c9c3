"""Runs the command line; reads the example scenes."""
import json
import os
import pathlib
import shlex
import subprocess
import tempfile
import unittest

from tests.support.sources import SOURCE

# ctest sets the variable; without it, tests use the release build.
BIN = pathlib.Path(os.environ.get("WHITTLE_BIN") or SOURCE / "build/release/bin")
SCENES = SOURCE / "scenes"

# A test that takes long and repeats on more data what shorter ones show.
only_in_long_runs = unittest.skipUnless(os.environ.get("WHITTLE_LONG"), "tests/run --long")
QUICK = bool(os.environ.get("WHITTLE_QUICK"))  # less effort, in tests/run without options


def on_terminal(*command):
    """The finished process of a command that ran on a terminal, which script(1) makes; its standard output has both streams."""
    return subprocess.run(["script", "--quiet", "--return", "--command", shlex.join(map(str, command)), "/dev/null"], stdin=subprocess.DEVNULL,
                          capture_output=True, check=False, timeout=300, env={**os.environ, "TERM": "xterm"})


def temporary_directory(test):
    """A new directory, which a test, or a class of tests, removes at its end."""
    enter = test.enterClassContext if isinstance(test, type) else test.enterContext
    return pathlib.Path(enter(tempfile.TemporaryDirectory()))


class DirectoryTest(unittest.TestCase):
    """Each case has an empty directory of its own."""

    def setUp(self):
        self.directory = temporary_directory(self)


def succeeded(done):
    """The process, if it ended with code 0."""
    if done.returncode != 0:
        raise AssertionError(f"{done.args} ended with {done.returncode}: {done.stderr}{done.stdout}")
    return done


def scene(name, **changes):
    """The example scene as a dict; `changes` replace top-level fields."""
    return {**json.loads((SCENES / f"{name}.json").read_text(encoding="utf-8")), **changes}


def whittle(*arguments, document=None, environment=None, timeout=300):
    """Returns the finished process. `document` (dict, str or bytes) is its standard input."""
    if isinstance(document, dict):
        document = json.dumps(document)
    if isinstance(document, str):
        document = document.encode()
    return subprocess.run([BIN / "whittle", *map(str, arguments)], input=document if document is not None else b"",
                          capture_output=True, check=False, timeout=timeout,
                          env={**os.environ, **(environment or {})})
