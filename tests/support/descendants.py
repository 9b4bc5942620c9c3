"""Processes that end with the process that started them.

`END_WITH_PARENT` before a command: the kernel kills the process as soon as the thread that started it ends.

`supervise(work)`: a run of many programs. A child of this process, the reaper, adopts orphans (PR_SET_CHILD_SUBREAPER), and a child
of the reaper does the work, so that no program can leave the reaper, not even by a session of its own. The reaper kills them all when
the work is done, when this process gets SIGTERM, SIGINT or SIGHUP, and when it is killed.
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


def parents():
    """{pid: pid of its parent} of all processes."""
    found = {}
    for path in pathlib.Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # of a process that has ended
            found[int(path.parent.name)] = int(path.read_text(encoding="latin-1").rpartition(")")[2].split()[1])
    return found


def reachable(graph, start):
    """The nodes to which the edges {node: its next nodes} lead from `start`."""
    found, open_ends = set(), [start]
    while open_ends:
        new = set(graph.get(open_ends.pop(), ())) - found
        found |= new
        open_ends += new
    return found


def descendants(root):
    children = {}
    for pid, parent in parents().items():
        children.setdefault(parent, []).append(pid)
    return reachable(children, root)


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


def wait(child, on_signal):
    """The exit code of a child of this process, which has blocked SIGNALS and SIGCHLD: none can come between a look and a wait, as it
    could with a handler. Other children that end are reaped."""
    while True:
        number = signal.sigwait({*SIGNALS, signal.SIGCHLD})
        if number in SIGNALS:
            on_signal(number)
            continue
        pid = -1
        while pid != 0:
            pid, status = os.waitpid(-1, os.WNOHANG)
            if pid == child:
                code = os.waitstatus_to_exitcode(status)
                return code if code >= 0 else 128 - code


def fork(do):
    """The pid of a child that does it and ends with its exit code."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            code = do()
        except BaseException:  # pylint: disable=broad-exception-caught
            traceback.print_exc()
        sys.stdout.flush()
        os._exit(code)
    return child


def supervise(work, clean_up=lambda: None):
    """Returns the exit code that `work()` returns, or 128 + the signal that ended it. `clean_up()` is called at last. From then on
    this process blocks SIGNALS."""
    parent = os.getpid()

    def unblock_and_work():
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {*SIGNALS, signal.SIGCHLD})
        return work()

    def reap():
        def end(code):
            kill_descendants()
            clean_up()
            os._exit(code)

        prctl = ctypes.CDLL(None).prctl
        if prctl(PR_SET_CHILD_SUBREAPER, 1) or prctl(PR_SET_PDEATHSIG, signal.SIGTERM) or os.getppid() != parent:
            end(1)
        end(wait(fork(unblock_and_work), lambda number: end(128 + number)))

    sys.stdout.flush()
    signal.pthread_sigmask(signal.SIG_BLOCK, {*SIGNALS, signal.SIGCHLD})
    child = fork(reap)
    return wait(child, lambda number: os.kill(child, number))
