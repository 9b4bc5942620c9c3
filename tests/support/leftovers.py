"""Leftovers of a run of tests that was killed: a directory of temporary files with mounts, and network namespaces. Their names contain
the PID of the run or of the test, so that the next run finds them orphaned and removes them."""
import os
import pathlib
import re
import shutil
import subprocess
import tempfile

NAMESPACES = pathlib.Path("/run/netns")


def orphaned(name):
    """True for a name that was made with the PID of a process that has ended."""
    found = re.fullmatch(r"whittle-tests-(\d+)", name)
    return bool(found) and not pathlib.Path("/proc", found.group(1)).exists()


def name_of(pid):
    return f"whittle-tests-{pid}"


def delete(directory):
    """A directory, and file systems that are mounted below it."""
    mounts = [line.split()[1] for line in pathlib.Path("/proc/self/mounts").read_text(encoding="utf-8").splitlines()]
    for mount in sorted((path for path in mounts if path.startswith(f"{directory}/")), reverse=True):
        subprocess.run(["umount", "--lazy", mount], check=False)
    shutil.rmtree(directory, ignore_errors=True)


def remove_orphans(root=None):
    """Removes what killed runs have left; the names."""
    removed = []
    for path in pathlib.Path(root or tempfile.gettempdir()).glob("whittle-tests-*"):
        if orphaned(path.name):
            delete(path)
            removed.append(path.name)
    for path in NAMESPACES.glob("whittle-tests-*"):
        if orphaned(path.name) and subprocess.run(["ip", "netns", "delete", path.name], check=False).returncode == 0:
            removed.append(f"network namespace {path.name}")
    return removed


def create_directory():
    """The directory of the temporary files of the run of this process."""
    directory = pathlib.Path(tempfile.gettempdir(), name_of(os.getpid()))
    directory.mkdir()
    directory.chmod(0o1777)  # PostgreSQL runs with an account of its own
    return directory
