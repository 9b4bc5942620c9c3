"""Runs the command line and knows the example scenes."""
import json
import os
import pathlib
import subprocess

SOURCE = pathlib.Path(os.environ["WHITTLE_SOURCE"])
BIN = pathlib.Path(os.environ["WHITTLE_BIN"])
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
