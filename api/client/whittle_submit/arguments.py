"""The command line, as one plain value."""
import argparse
import os
import pathlib
import urllib.parse

from whittle_submit.sweep import BadSweep, read_sweep

DESCRIPTION = """\
Submits scenes to a Whittle service, uploads the files they name, waits, and brings the pictures back into a folder.
Killed, or when the server is, the same command goes on where it was: nothing is submitted twice."""

EPILOG = """\
--set PATH=VALUES makes a job of each value; several make one of each combination.
  PATH    camera.fov or objects.0.radius, or a JSON pointer: /camera/fov
  VALUES  30..60:5 (both ends, step 5; without one 1), or a list: 1,2,3 or [0,1,6],[0,2,6] or draft,fine

Pictures are called after the scene's file and the values: orbit-fov=30.png. What was done stands in the folder's
whittle-submit.state. A scene that was changed since is rendered anew, the others are not.

Exit codes: 0 all pictures are there, 1 some scene was refused or failed, 2 the command line is bad or a file cannot be
read, 3 the server or the disk failed (the same command goes on), 130 interrupted (likewise)."""


class BadArguments(Exception):
    """A sentence that says what is wrong with the command line."""


class Parser(argparse.ArgumentParser):
    def error(self, message):
        raise BadArguments(f"{message}; --help tells more")


def checked_url(text):
    url = urllib.parse.urlsplit(text)
    if url.scheme not in ("http", "https") or not url.hostname or url.query or url.fragment:
        raise BadArguments(f"--server must be http://HOST:PORT or https://HOST, got {text!r}")
    return url


def read_key(path, environment):
    """The service's key, or None. Never from the command line: others see that."""
    if path is None:
        return environment.get("WHITTLE_KEY") or None
    try:
        key = pathlib.Path(path).read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError) as trouble:
        raise BadArguments(f"--key-file {path}: {trouble}") from trouble
    if not key or any(character.isspace() for character in key):
        raise BadArguments(f"--key-file {path}: must hold one key, alone")
    return key


def read_arguments(arguments, environment=None):
    environment = os.environ if environment is None else environment
    parser = Parser(prog="whittle-submit", description=DESCRIPTION, epilog=EPILOG,
                    formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False)
    parser.add_argument("scenes", nargs="+", metavar="SCENE", help="a scene's file, or a glob in quotes: 'shots/*.json'")
    parser.add_argument("--set", action="append", default=[], metavar="PATH=VALUES", dest="sweeps", help="see below")
    parser.add_argument("-o", "--out", default=".", metavar="FOLDER", help="where the pictures go (default: here)")
    parser.add_argument("--name", metavar="NAME", help="the jobs' label \"batch\" (default: the first scene's name)")
    parser.add_argument("--server", default=environment.get("WHITTLE_SERVER", "http://127.0.0.1:8080"), metavar="URL",
                        help="default: $WHITTLE_SERVER, or http://127.0.0.1:8080")
    parser.add_argument("--key-file", metavar="FILE", help="holds the service's key (default: $WHITTLE_KEY, if set)")
    parser.add_argument("--server-files", action="store_true",
                        help="files that are not here are the server's, below its asset folder")
    parser.add_argument("--retry-failed", action="store_true", help="submit anew what failed before")
    parser.add_argument("--patience", type=float, default=600, metavar="SECONDS",
                        help="how long a server that does not answer is waited for (default: 600)")
    parser.add_argument("--dry-run", action="store_true", help="say what would be submitted and uploaded; ask no server")
    options = parser.parse_args(arguments)
    options.server = checked_url(options.server)
    options.key = read_key(options.key_file, environment)
    options.out = pathlib.Path(options.out)
    if not options.patience >= 0:
        raise BadArguments("--patience must not be negative")
    try:
        options.sweeps = [read_sweep(text) for text in options.sweeps]
    except BadSweep as mistake:
        raise BadArguments(str(mistake)) from mistake
    paths = [path for path, _ in options.sweeps]
    for path in paths:
        if paths.count(path) > 1:
            raise BadArguments(f"--set {'.'.join(path)} is given twice")
    return options
