"""Runs the command line and knows the example scenes."""
import json
import os
import pathlib
import subprocess

# As ctest says; by hand, what was built for release.
SOURCE = pathlib.Path(os.environ.get("WHITTLE_SOURCE") or pathlib.Path(__file__).resolve().parents[2])
BIN = pathlib.Path(os.environ.get("WHITTLE_BIN") or SOURCE / "build/release/bin")
SCENES = SOURCE / "scenes"


def scene(name, **changes):
    """The example scene as a dict, top-level fields replaced by `changes`."""
    return {**json.loads((SCENES / f"{name}.json").read_text(encoding="utf-8")), **changes}


def whittle(*arguments, document=None, environment=None, timeout=300):
    """The finished process; a `document` (dict, str or bytes) goes to standard input."""
    if isinstance(document, dict):
        document = json.dumps(document)
    if isinstance(document, str):
        document = document.encode()
    return subprocess.run([BIN / "whittle", *map(str, arguments)], input=document if document is not None else b"",
                          capture_output=True, check=False, timeout=timeout,
                          env={**os.environ, **(environment or {})})
