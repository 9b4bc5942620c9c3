"""Files that git tracks, and their text."""
import os
import pathlib
import subprocess

SOURCE = pathlib.Path(os.environ.get("WHITTLE_SOURCE") or pathlib.Path(__file__).resolve().parents[2])


def run(*command, timeout=600, **options):
    """The finished process, with its output as text."""
    return subprocess.run(command, check=False, capture_output=True, text=True, timeout=timeout, **options)


def tracked(*suffixes):
    """Paths of a clone's files, relative to the top directory, with the given suffixes (without any: all files)."""
    listed = subprocess.run(["git", "-C", SOURCE, "-c", f"safe.directory={SOURCE}", "ls-files", "-z"], check=True,
                            capture_output=True, text=True).stdout
    paths = [pathlib.PurePosixPath(name) for name in listed.split("\0") if name and (SOURCE / name).is_file()]
    return [path for path in paths if not suffixes or path.suffix in suffixes]


def text(path):
    return (SOURCE / path).read_text(encoding="utf-8", errors="surrogateescape")
