"""A private PostgreSQL server for tests: a data directory of its own, one unix socket, no syncs.

As a program it is the server of a test in another language: it prints a connection string and then answers lines of
standard input, each with one line, until that is closed.
    new               creates an empty database; its connection string
    copy DATABASE     creates a copy of a database without sessions; its connection string
    sql DATABASE SQL  runs a statement; its rows, separated by blanks
    stop, kill, start ends the server with its clients, ends it without a checkpoint, starts it again
"""
import contextlib
import glob
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

# "Immediate", which ends the sessions too and frees shared memory.
END_WITH_PARENT = ("setpriv", "--pdeathsig", "QUIT")
ACCOUNT = "postgres"  # the server refuses to run as root


def programs():
    """The directory of the newest version that is installed."""
    found = sorted(glob.glob("/usr/lib/postgresql/*/bin/initdb"), key=lambda path: int(path.split("/")[4]))
    if not found:
        raise FileNotFoundError("PostgreSQL is not installed")
    return pathlib.Path(found[-1]).parent


class PostgresServer:
    """Runs from the construction to `close`. `settings`: options of the server, as name=value."""

    def __init__(self, settings=()):
        self.directory = tempfile.mkdtemp(prefix="postgres")
        self.settings = ["fsync=off", "listen_addresses=", f"unix_socket_directories={self.directory}", *settings]
        self.account = {"user": ACCOUNT} if os.geteuid() == 0 else {}
        if self.account:
            shutil.chown(self.directory, ACCOUNT)
        self.data = f"{self.directory}/data"
        self.databases = 0
        self.process = None
        subprocess.run([programs() / "initdb", "--no-sync", "--auth=trust", "--encoding=UTF8", "--locale=C.UTF-8",
                        f"--username={ACCOUNT}", "-D", self.data], check=True, stdout=subprocess.DEVNULL, **self.account)
        self.start()

    def start(self):
        options = [word for setting in self.settings for word in ("-c", setting)]
        with open(f"{self.directory}/log", "ab") as log:
            self.process = subprocess.Popen([*END_WITH_PARENT, programs() / "postgres", "-D", self.data, *options], cwd=self.directory,
                                            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=log, **self.account)
        end = time.monotonic() + 60
        while subprocess.run([programs() / "pg_isready", "-q", "-h", self.directory]).returncode != 0:
            if self.process.poll() is not None or time.monotonic() > end:
                raise RuntimeError(pathlib.Path(f"{self.directory}/log").read_text())
            time.sleep(0.05)

    def stop(self, how=signal.SIGINT):
        """SIGINT: "fast", which ends the sessions; SIGQUIT: "immediate", without a checkpoint."""
        self.process.send_signal(how)
        self.process.wait(60)

    def kill(self):
        """As kill -9 of the server and its sessions at once."""
        children = pathlib.Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        for pid in [self.process.pid, *map(int, children)]:
            with contextlib.suppress(ProcessLookupError):  # of a session that has ended
                os.kill(pid, signal.SIGKILL)
        self.process.wait(60)
        # Nobody may be attached to the shared memory of the server that is started next.
        end = time.monotonic() + 60
        while any(pathlib.Path(f"/proc/{pid}/fd").exists() for pid in children) and time.monotonic() < end:
            time.sleep(0.01)

    def sql(self, database, statement):
        command = [programs() / "psql", "-qAtX", "-v", "ON_ERROR_STOP=1", "-h", self.directory, "-U", ACCOUNT,
                   "-d", database, "-c", statement]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()

    def new_database(self, template="template0"):
        """Its name."""
        self.databases += 1
        name = f"test{self.databases}"
        self.sql("postgres", f"CREATE DATABASE {name} TEMPLATE {template} STRATEGY file_copy")
        return name

    def uri(self, database):
        return f"postgres://{ACCOUNT}@/{database}?host={self.directory}"

    def close(self):
        if self.process.poll() is None:
            self.stop(signal.SIGQUIT)
        shutil.rmtree(self.directory)


def answer(server, line):
    command, _, rest = line.strip().partition(" ")
    if command == "new":
        return server.uri(server.new_database())
    if command == "copy":
        return server.uri(server.new_database(template=rest))
    if command == "sql":
        database, _, statement = rest.partition(" ")
        return server.sql(database, statement).replace("\n", " ")
    {"stop": server.stop, "kill": server.kill, "start": server.start}[command]()
    return "done"


if __name__ == "__main__":
    running = PostgresServer()
    try:
        print(running.uri("postgres"), flush=True)
        for request in sys.stdin:
            print(answer(running, request), flush=True)
    finally:
        running.close()
