#!/usr/bin/python3
"""hostile.py [FOLDER ...] [options of whittled]: how long a daemon and its worker take to refuse what was made to hurt
them, and how much memory that costs them at most.

Starts whittled (from $WHITTLE_BIN) on free ports with an empty data directory. Documents are those of tests/reader/invalid, of the
reader's corpus and of each FOLDER (*.json), asked for by POST /v1/render; so are scenes with one texture or one mesh of
the corpora of fuzzers, every file of which called bad_ is broken, a bomb or both. A row tells of one kind: how many there
were, how many were refused, the slowest refusal and its name, and by how much the most memory that the daemon and its
worker ever had in use grew. The first of a kind is asked for once before, and what is right of it, for libraries are
loaded when they are needed first. What libpng says of broken pictures stands in the daemon's log, and is no matter here.
"""
import contextlib
import http.client
import json
import os
import pathlib
import shutil
import sys
import tempfile
import time

SOURCE = pathlib.Path(__file__).parents[2]
sys.path.insert(0, str(SOURCE))
from tests.http.daemon import Daemon  # pylint: disable=wrong-import-position
from tests.reader import invalid_documents  # pylint: disable=wrong-import-position

CORPUS = SOURCE / "tests/fuzz/corpus"


def scene(**changes):
    return json.dumps({"version": 1, "image": {"width": 8, "height": 6}, "job": {"cache": "off"},
                       "camera": {"position": [0, 0, 5], "look_at": [0, 0, 0]}, **changes}).encode()


def textured(name):
    return scene(objects=[{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": {"color": {"file": name}}}])


def with_mesh(name):
    return scene(objects=[{"type": "mesh", "file": name, "material": {}}])


def peak_bytes(pid):
    """The most memory that a process ever had in use."""
    status = pathlib.Path(f"/proc/{pid}/status").read_text("ascii")
    return 1024 * int(status.partition("VmHWM:")[2].split()[0])


def requests_by_kind(folders, assets):
    """{kind: [(name, body of a request)]}; files that scenes name are put into `assets`."""
    kinds = {"invalid": [(case.name, case.text) for case in invalid_documents.cases()]}
    for folder in [CORPUS / "reader", *folders]:
        kinds[folder.name] = [(path.name, path.read_bytes()) for path in sorted(folder.iterdir())
                              if path.suffix != ".txt" and not (path.suffix == ".json" and path.name.startswith("y_"))]
    for kind, scene_with in (("image", textured), ("mesh", with_mesh)):
        kinds[kind] = []
        for path in sorted((CORPUS / kind).glob("good*")):
            shutil.copy(path, assets)
        for path in sorted((CORPUS / kind).glob("bad_*")):
            shutil.copy(path, assets)
            kinds[kind].append((path.name, scene_with(path.name)))
    return kinds


def measure():
    options = [argument for argument in sys.argv[1:] if argument.startswith("-")]
    folders = [pathlib.Path(argument) for argument in sys.argv[1:] if not argument.startswith("-")]
    with tempfile.TemporaryDirectory() as assets, Daemon("--assets", assets, *options) as daemon:
        os.chmod(assets, 0o755)
        kinds = requests_by_kind(folders, assets)
        kept = http.client.HTTPConnection("127.0.0.1", daemon.port, timeout=60)

        def ask(body):
            start = time.perf_counter()
            kept.request("POST", "/v1/render", body=body, headers={"Content-Type": "application/json"})
            response = kept.getresponse()
            response.read()
            return response.status, time.perf_counter() - start

        for body in (scene(), textured("good_half.exr"), with_mesh("good_ascii.ply")):
            ask(body)
        print(f"{'kind':18} {'asked':>6} {'refused':>8} {'slowest/ms':>11} {'daemon/MiB':>11} {'worker/MiB':>11}  slowest")
        for kind, asked in kinds.items():
            ask(asked[0][1])
            pids = [daemon.process.pid, *daemon.worker_pids()]
            before = [peak_bytes(pid) for pid in pids]
            answers = [(*ask(body), name) for name, body in asked]
            after = [peak_bytes(pid) for pid in pids]  # raises where one of them has gone
            refused = [answer for answer in answers if 400 <= answer[0] < 500]
            _, seconds, slowest = max(refused, key=lambda answer: answer[1])
            grown = [(late - early) / 2**20 for early, late in zip(before, after)]
            print(f"{kind:18} {len(answers):6} {len(refused):8} {1e3 * seconds:11.1f} {grown[0]:11.1f} {max(grown[1:]):11.1f}"
                  f"  {slowest}")
            for status, _, name in answers:
                if status >= 500:
                    print(f"  {name} answered {status}")


if __name__ == "__main__":
    with contextlib.suppress(AssertionError):  # the Daemon's, of lines in its log that are not its own
        measure()
