"""Command line: options, progress bars, messages and exit codes."""
import argparse
import collections
import os
import pathlib
import shutil
import sys
import time
import urllib.parse

from whittle_submit.run import Run, StateError
from whittle_submit.server import ServerError
from whittle_submit.sweep import InputError, group_frames, parse_sweep, read_frames

EXIT_SUCCESS, EXIT_FAILED, EXIT_BAD_INPUT, EXIT_ENVIRONMENT, EXIT_INTERRUPTED = 0, 1, 2, 3, 130
REDRAW_S = 0.2
BAR_WIDTH = 30

DESCRIPTION = """\
Submits scenes to a Whittle service, uploads the files they name, waits, and downloads the images to a directory.
Run the same command again after an interruption: it continues, and submits nothing twice."""

EPILOG = """\
--set PATH=VALUES submits a job for each value; several --set submit one for each combination.
  PATH    camera.fov or objects.0.radius, or a JSON pointer: /camera/fov
  VALUES  a range with both ends and a step, 30..60:5 (default step: 1), or a list: 1,2,3 or [0,1,6],[0,2,6] or draft,fine

Images are named after the scene file and the values: orbit-fov=30.png. The file whittle-submit.state in the output
directory records the progress. A scene that has changed since is rendered again; the others are not.

Exit codes: 0 all images are complete, 1 a scene was rejected, its job failed or, with --require-target, an image
misses its target error, 2 invalid command line or unreadable file, 3 error of the server or the disk (run the same
command again to continue), 130 interrupted (the same)."""


class Parser(argparse.ArgumentParser):
    def error(self, message):
        raise InputError(f"{message}; see --help")


def parse_url(text):
    url = urllib.parse.urlsplit(text)
    if url.scheme not in ("http", "https") or not url.hostname or url.query or url.fragment:
        raise InputError(f"--server must be http://HOST:PORT or https://HOST, got {text!r}")
    return url


def read_key(path, environment):
    """Returns the service's key or None. The command line cannot hold it, as other users can read that."""
    if path is None:
        return environment.get("WHITTLE_KEY") or None
    try:
        key = pathlib.Path(path).read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"--key-file {path}: {error}") from error
    if not key or any(character.isspace() for character in key):
        raise InputError(f"--key-file {path}: must contain one key and nothing else")
    return key


def parse_arguments(arguments, environment):
    parser = Parser(prog="whittle-submit", description=DESCRIPTION, epilog=EPILOG,
                    formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False)
    parser.add_argument("scenes", nargs="+", metavar="SCENE", help="scene file, or a quoted pattern: 'shots/*.json'")
    parser.add_argument("--set", action="append", default=[], metavar="PATH=VALUES", dest="sweeps", help="see below")
    parser.add_argument("-o", "--out", default=".", metavar="DIRECTORY", type=pathlib.Path,
                        help="output directory (default: the current one)")
    parser.add_argument("--name", metavar="NAME", help="the jobs' label \"batch\" (default: the first scene's name)")
    parser.add_argument("--server", default=environment.get("WHITTLE_SERVER", "http://127.0.0.1:8080"), metavar="URL",
                        help="default: $WHITTLE_SERVER, or http://127.0.0.1:8080")
    parser.add_argument("--key-file", metavar="FILE", help="file with the service's key (default: $WHITTLE_KEY, if set)")
    parser.add_argument("--server-files", action="store_true",
                        help="leave files that do not exist here to the server's asset directory")
    parser.add_argument("--retry-failed", action="store_true", help="submit frames again that failed before")
    parser.add_argument("--require-target", action="store_true", help="exit with 1 also if an image misses its target error")
    parser.add_argument("--patience", type=float, default=600, metavar="SECONDS",
                        help="how long to retry while the server does not respond (default: 600)")
    parser.add_argument("--dry-run", action="store_true", help="list jobs and uploads; send nothing")
    options = parser.parse_args(arguments)
    options.server = parse_url(options.server)
    options.key = read_key(options.key_file, environment)
    if not options.patience >= 0:
        raise InputError("--patience must not be negative")
    options.sweeps = [parse_sweep(text) for text in options.sweeps]
    for path, count in collections.Counter(path for path, _ in options.sweeps).items():
        if count > 1:
            raise InputError(f"--set {'.'.join(path)} is given twice")
    return options


class Progress:
    """Bars on a terminal, otherwise a line for each frame that ends."""

    def __init__(self, frames):
        self.stream = sys.stderr
        self.is_terminal = self.stream.isatty() and os.environ.get("TERM") != "dumb"
        self.total = collections.Counter(frame.scene for frame in frames)
        self.done = dict.fromkeys(self.total, 0)
        self.failed = dict.fromkeys(self.total, 0)
        self.fractions = {}  # scene -> {frame name: fraction}
        self.bars = 0        # on the screen
        self.drawn_at = 0.0

    def message(self, text):
        self.erase()
        print(text, file=self.stream, flush=True)
        self.draw(True)

    def running(self, frame, fraction):
        self.fractions.setdefault(frame.scene, {})[frame.name] = fraction
        self.draw(False)

    def ended(self, frame, text, is_failure):
        self.fractions.get(frame.scene, {}).pop(frame.name, None)
        self.done[frame.scene] += 1
        self.failed[frame.scene] += is_failure
        if is_failure or not self.is_terminal:
            self.message(f"[{sum(self.done.values())}/{self.total.total()}] {frame.name}: {text}")
        self.draw(True)

    def lines(self):
        columns, rows = shutil.get_terminal_size()
        unfinished = [name for name in self.total if self.done[name] < self.total[name]]
        shown = unfinished[:max(rows - 3, 1)]
        for name in shown:
            fraction = (self.done[name] + sum(self.fractions.get(name, {}).values())) / self.total[name]
            filled = int(BAR_WIDTH * fraction)
            text = f"{'#' * filled}{'-' * (BAR_WIDTH - filled)} {self.done[name]}/{self.total[name]} {name}"
            if self.failed[name]:
                text += f", {self.failed[name]} failed"
            yield text[:columns - 1]
        if len(unfinished) > len(shown):
            yield f"and {len(unfinished) - len(shown)} more"

    def draw(self, at_once):
        now = time.monotonic()
        if not self.is_terminal or (not at_once and now - self.drawn_at < REDRAW_S):
            return
        self.erase()
        lines = list(self.lines())
        for line in lines:
            print(line, file=self.stream)
        self.stream.flush()
        self.bars, self.drawn_at = len(lines), now

    def erase(self):
        if self.bars:
            print(f"\x1b[{self.bars}F\x1b[J", end="", file=self.stream)
        self.bars = 0


def print_plan(frames):
    for frame in frames:
        print(f"{frame.name}  {frame.digest[:12]}")
    for path in sorted({str(path) for frame in frames for path in frame.files.values()}):
        print(f"file {path}")
    requests = len(group_frames(frames))
    print(f"{len(frames)} jobs in {requests} request{'s' if requests > 1 else ''}; nothing was sent")


def submit(frames, options):
    progress = Progress(frames)
    run = Run(frames, options, progress)
    failures = run.execute()
    missed = f"; {run.missed} of them miss their target error" if run.missed else ""
    progress.message(f"{len(frames) - failures} of {len(frames)} frames have their images in {options.out}{missed}")
    return EXIT_FAILED if failures or (options.require_target and run.missed) else EXIT_SUCCESS


def main(arguments):
    try:
        options = parse_arguments(arguments, os.environ)
        frames = read_frames(options.scenes, options.sweeps, options.server_files)
        if not options.dry_run:
            return submit(frames, options)
        print_plan(frames)
        return EXIT_SUCCESS
    except InputError as error:
        print(f"whittle-submit: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except (ServerError, StateError, OSError) as error:
        print(f"whittle-submit: {error}\nRun the same command again to continue.", file=sys.stderr)
        return EXIT_ENVIRONMENT
    except KeyboardInterrupt:
        print("\nwhittle-submit: interrupted; the server continues its jobs. Run the same command again to continue.",
              file=sys.stderr)
        return EXIT_INTERRUPTED
