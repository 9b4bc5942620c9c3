"""Processes that end with the process that started them.

`END_WITH_PARENT` before a command: the kernel kills the process as soon as the thread that started it ends.

`supervise(work)`: a run of many programs. They are descendants of a child of this process that adopts orphans
(PR_SET_CHILD_SUBREAPER), so that none can leave it, not even by a session of its own. The child kills them all when the work is
done, when this process gets SIGTERM, SIGINT or SIGHUP, and when it is killed itself.
"""
import contextlib
import ctypes
import os
import pathlib
import signal
import sys
import time
import traceback

END_WITH_PARENT = ("setpriv", "--pdeathsig", "KILL")
PR_SET_PDEATHSIG, PR_SET_CHILD_SUBREAPER = 1, 36
SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)


def set_process_option(option, value):
    if ctypes.CDLL(None, use_errno=True).prctl(option, value, 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "prctl")


def parents():
    """{pid: pid of its parent} of all processes."""
    found = {}
    for path in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            found[int(path.parent.name)] = int(path.read_text(encoding="latin-1").rpartition(")")[2].split()[1])
        except OSError:
            pass  # it has ended
    return found


def descendants(root):
    children = {}
    for pid, parent in parents().items():
        children.setdefault(parent, []).append(pid)
    found, open_ends = [], [root]
    while open_ends:
        of_one = children.get(open_ends.pop(), [])
        found += of_one
        open_ends += of_one
    return found


def kill_descendants():
    """Ends when no descendant is left: this process adopts them, so that each is below one of its children."""
    while True:
        for pid in descendants(os.getpid()):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        try:
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass
        except ChildProcessError:
            return
        time.sleep(0.01)


def wait(process):
    """Waits for a Popen, and for the orphans that end before it; its exit code."""
    while process.returncode is None:
        pid, status = os.wait()
        if pid == process.pid:
            process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode


def run_as_reaper(work, clean_up, parent):
    """Does the work, ends all descendants, and ends this process."""
    def end(code):
        for number in SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        kill_descendants()
        clean_up()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)

    for number in SIGNALS:
        signal.signal(number, lambda signum, _: end(128 + signum))
    set_process_option(PR_SET_CHILD_SUBREAPER, 1)
    set_process_option(PR_SET_PDEATHSIG, signal.SIGTERM)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    code = 1
    try:
        if os.getppid() == parent:
            code = work()
    except BaseException:  # pylint: disable=broad-exception-caught
        traceback.print_exc()
    end(code)


def supervise(work, clean_up=lambda: None):
    """Returns the exit code that `work()` returns, or 128 + the signal that ended it. `clean_up()` is called at last."""
    parent = os.getpid()
    sys.stdout.flush()
    signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    child = os.fork()
    if child == 0:
        run_as_reaper(work, clean_up, parent)
    for number in SIGNALS:
        signal.signal(number, lambda signum, _: os.kill(child, signum))
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
