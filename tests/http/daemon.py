"""Starts the daemon on free ports with its own data directory, and sends HTTP requests to it.

Every wait is on a condition; PATIENCE_S only bounds how long a broken daemon is waited for.
"""
import collections
import concurrent.futures
import contextlib
import hashlib
import http.client
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import unittest

from tests.support.descendants import END_WITH_PARENT
from tests.support.whittle import BIN

SANITIZED = os.environ.get("WHITTLE_SANITIZED", "")
PATIENCE_S = 600
NOBODY = "0190a000-0000-7000-8000-000000000001"  # the id of no job, batch or delivery
FAR = "2099-01-01T00:00:00Z"

Reply = collections.namedtuple("Reply", "status headers body")


def json_of(reply, status=None):
    """The content of the reply, which must have the status, if one is given."""
    if status not in (None, reply.status):
        raise AssertionError(f"the reply has the status {reply.status}, not {status}: {reply.body.decode()}")
    return json.loads(reply.body)


def sha256(content):
    return hashlib.sha256(content).hexdigest()


def status_of(pid):
    """The fields of /proc/PID/status."""
    lines = pathlib.Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines()
    return dict(re.split(r":\s*", line, maxsplit=1) for line in lines)


def whittled(*arguments, environment=None, cwd=None):
    """The finished process of a command that ends at once, by default with no environment."""
    return subprocess.run([BIN / "whittled", *map(str, arguments)], capture_output=True, text=True, check=False, timeout=PATIENCE_S,
                          env=environment or {}, cwd=cwd)


def failed(done, code=1):
    """The standard error of a process, which must have ended with the code."""
    if done.returncode != code:
        raise AssertionError(f"{done.args} ended with {done.returncode}, not {code}: {done.stderr}{done.stdout}")
    return done.stderr


def wait_until(condition, what):
    """Returns the first true value of `condition()`."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.01)
    raise AssertionError(f"waited {PATIENCE_S} s in vain: {what}")


def scene(width=16, height=12, samples=1, name="sphere", **changes):
    """A small scene as a dict, by default without the result cache."""
    changes["job"] = {"cache": "off", **changes.get("job", {})}
    return {"version": 1, "name": name, "image": {"width": width, "height": height},
            "camera": {"position": [0, 1, 6], "look_at": [0, 0.5, 0], "fov": 40},
            "lights": [{"type": "point", "position": [4, 6, 5]}],
            "objects": [{"type": "sphere", "center": [0, 0.5, 0], "radius": 0.5, "material": {"color": 0.7}},
                        {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": {"color": 0.4}}],
            "accuracy": {"samples": [samples, samples]}, **changes}


def long_scene(**changes):
    """A scene of thousands of tiles that renders for minutes, for tests of running jobs."""
    return scene(4000, 4000, samples=64, **{"name": "long", **changes})


class Served:
    """A daemon at 127.0.0.1 with self.port and self.health_port."""

    port = health_port = None
    allowed = {}  # headers with the key of every request

    @contextlib.contextmanager
    def sent(self, method, path, body=None, headers=None, port=None):
        """A new connection, on which the request is sent. A dict is sent as JSON."""
        headers = {**self.allowed, **(headers or {})}
        if isinstance(body, dict):
            body = json.dumps(body).encode()
        if body is not None:
            headers.setdefault("Content-Type", "application/json")
        with contextlib.closing(self.connection(port or self.port)) as connection:
            connection.request(method, path, body=body, headers=headers)
            yield connection

    def request(self, *request, **parts):
        """Sends a request, with the parameters of sent(), and returns the reply."""
        with self.sent(*request, **parts) as connection:
            response = connection.getresponse()
            return Reply(response.status, response.headers, response.read())

    def get(self, path, **headers):
        return self.request("GET", path, headers={name.replace("_", "-"): value for name, value in headers.items()})

    def in_background(self, *request):
        """Sends the request; the future of its reply."""
        return concurrent.futures.ThreadPoolExecutor(1).submit(self.request, *request)

    def health(self, path, method="GET"):
        return self.request(method, path, port=self.health_port)

    def metrics(self):
        """The figures by name with labels."""
        lines = self.health("/metrics").body.decode().splitlines()
        return {name: float(value) for name, _, value in (line.rpartition(" ") for line in lines if not line.startswith("#"))}

    def sandbox(self):
        """The sandbox as the worker reports it, once it runs."""
        return wait_until(lambda: json_of(self.get("/v1/version"))["sandbox"], "the worker")

    def connection(self, port):
        return http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)

    def socket(self):
        """Returns a connected socket."""
        return socket.create_connection(("127.0.0.1", self.port), timeout=PATIENCE_S)

    # ---- jobs

    def submit(self, document, path="/v1/jobs"):
        """Submits a job, or what another path takes, and returns its id."""
        return json_of(self.request("POST", path, document), 202)["id"]

    def rendered(self, document):
        """Submits a job and returns it when it has succeeded."""
        return self.wait_for_success(self.submit(document))

    def start_job(self, document=None):
        """Submits a job, by default a long one, and returns its id when it runs."""
        job_id = self.submit(document or long_scene())
        self.wait_for_state(job_id, "running")
        return job_id

    def jobs(self, query="", limit=200):
        """Returns all jobs that match, newest first, page by page."""
        items, cursor = [], ""
        while cursor is not None:
            page = json_of(self.get(f"/v1/jobs?limit={limit}{query}{cursor}"))
            items += page["items"]
            cursor = f"&cursor={page['next_cursor']}" if page["next_cursor"] else None
        return items

    def job(self, job_id):
        return json_of(self.get(f"/v1/jobs/{job_id}"), 200)

    def wait_for_state(self, job_id, *states):
        """Waits until the job is in one of `states` and returns it."""
        def job_in_state():
            job = self.job(job_id)
            return job if job["state"] in states else None
        return wait_until(job_in_state, f"job {job_id} to be {' or '.join(states)}; {self.job(job_id)}")

    def last_preview(self, job_id):
        """Waits until a job that was stopped has its last preview, and returns the job."""
        wait_until(lambda: self.job(job_id)["artifacts"], "the last preview")
        return self.job(job_id)

    def cancel_in_work(self, document):
        """Cancels a job that has shown a preview; returns the job with its last preview."""
        job_id = self.submit(document)
        wait_until(lambda: self.get(f"/v1/jobs/{job_id}/preview").status == 200, "a preview")
        self.request("POST", f"/v1/jobs/{job_id}/cancel")
        return self.last_preview(job_id)

    def wait_for_end(self, job_id):
        return self.wait_for_state(job_id, "succeeded", "failed", "cancelled")

    def wait_for_success(self, job_id):
        job = self.wait_for_end(job_id)
        if job["state"] != "succeeded":
            raise AssertionError(f"{job['state']}: {job['problem']}")
        return job

    def finished_batch(self, **body):
        """Submits a batch and returns it when all its jobs have ended."""
        batch = self.submit(body, "/v1/batches")
        return wait_until(lambda: (now := json_of(self.get(f"/v1/batches/{batch}")))["links"]["cancel"] is None and now, f"the end of {batch}")


def put(daemon, content, name=None):
    """Sends an asset under its hash."""
    return daemon.request("PUT", f"/v1/assets/{name or sha256(content)}", content, {"Content-Type": "application/octet-stream"})


class Daemon(Served, contextlib.AbstractContextManager):
    """whittled, which ends with the thread that starts it. Use as a context manager."""

    worker_may_speak = False  # its libraries, of what is wrong with a file

    def __init__(self, *options, data=None, environment=None, wrapper=(), listen="127.0.0.1:0"):
        self.wrapper = wrapper  # a command that starts another one
        self.options = options
        self.environment = {name: value for name, value in os.environ.items() if not name.startswith("WHITTLE_")}
        self.environment.update(environment or {})
        self.directory = pathlib.Path(tempfile.mkdtemp(prefix="whittle-http-"))
        self.data = pathlib.Path(data) if data else self.directory / "data"
        self.process = None
        self.listen = listen
        self.start()

    def start(self):
        """Starts the daemon again with the same data."""
        if self.process:
            self.process.stdout.close()
        # A busy machine must not turn 200 into 202: only tests of the wait set it.
        environment = {"WHITTLE_LOG_LEVEL": "debug", "WHITTLE_RENDER_WAIT_S": "3600", **self.environment}
        library = environment.pop("LD_PRELOAD", None)  # for the daemon alone
        self.port = None  # another listener may get the old one
        preload = ("env", f"LD_PRELOAD={library}") if library else ()
        self.log_path = self.directory / f"log-{time.monotonic_ns()}"
        with open(self.log_path, "wb") as log:
            # pylint: disable-next=consider-using-with
            self.process = subprocess.Popen(
                [*END_WITH_PARENT, *self.wrapper, *preload, BIN / "whittled", "--listen", self.listen, "--health-listen", "127.0.0.1:0",
                 "--data", self.data, *self.options],
                stdout=subprocess.PIPE, stderr=log, env=environment)
        self.port = self.read_port("listening")
        self.health_port = self.read_port("health")

    def read_port(self, what):
        line = self.process.stdout.readline().decode()
        found = re.fullmatch(r'\{"' + what + r'":"http://[\d.]+:(\d+)"\}\n', line)
        if not found:
            self.process.kill()
            self.process.wait(PATIENCE_S)
            self.process.stdout.close()
            raise AssertionError(f"whittled printed {line!r}\n{self.log()}")
        return int(found.group(1))

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.kill()
        self.process.stdout.close()
        lines = [line for path in self.directory.glob("log-*") for line in path.read_text("utf-8").splitlines(keepends=True)]
        strange = [line for line in lines if not line.startswith("{") or (
            line.endswith("\n") and json.loads(line)["event"] == "worker_output" and not self.worker_may_speak)]
        shutil.rmtree(self.directory)
        if strange:  # a sanitizer's report, an abort's last words
            raise AssertionError("in the daemon's log:\n" + "".join(strange))

    # ---- the process

    def log(self):
        return self.log_path.read_text(encoding="utf-8")

    def log_rows(self, event=None):
        """All rows or those of an event, without a last line that is not complete, or never will be because the daemon was killed."""
        rows = [json.loads(line) for line in self.log().splitlines(keepends=True) if line.endswith("\n")]
        return [row for row in rows if event in (None, row["event"])]

    def kill(self):
        """kill -9. The worker detects the end of the daemon and ends too."""
        self.process.kill()
        self.process.wait(PATIENCE_S)

    def restart(self):
        """kill -9, then a start with the same data."""
        self.kill()
        self.start()

    def terminate(self):
        """Sends SIGTERM and returns the exit code."""
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(PATIENCE_S)

    def threads(self):
        return pathlib.Path(f"/proc/{self.process.pid}/task").iterdir()

    def worker(self):
        """PID of the worker in use, from the log; None before the first."""
        started = self.log_rows("worker_started")
        return int(started[-1]["pid"]) if started else None

    def worker_pids(self):
        """PIDs of the child processes: the worker, and before its end a killed one."""
        children = []
        for task in self.threads():
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # a thread that has just ended has none
                children += (task / "children").read_text(encoding="ascii").split()
        return [int(pid) for pid in children]

    def resident_bytes(self):
        pages = pathlib.Path(f"/proc/{self.process.pid}/statm").read_text(encoding="ascii").split()[1]
        return int(pages) * os.sysconf("SC_PAGESIZE")

    def forget_peak(self):
        """Makes the memory that is resident now the peak so far (proc_pid_clear_refs(5))."""
        pathlib.Path(f"/proc/{self.process.pid}/clear_refs").write_text("5", encoding="ascii")

    def peak_bytes(self):
        """Returns the most memory that was resident at once."""
        return 1024 * int(status_of(self.process.pid)["VmHWM"].removesuffix(" kB"))


class OneDaemon(unittest.TestCase):
    """Tests that share a daemon; each uses jobs of its own."""

    options = ()

    @classmethod
    def setUpClass(cls):
        cls.daemon = cls.enterClassContext(Daemon(*cls.options))

    def assert_problem(self, reply, status, name):
        self.assertEqual(reply.status, status, reply.body)
        self.assertEqual(reply.headers["Content-Type"], "application/problem+json")
        problem = json_of(reply)
        self.assertEqual(problem["type"], f"urn:whittle:problem:{name}")
        self.assertEqual(problem["status"], status)
        self.assertEqual(problem["request_id"], reply.headers["X-Request-Id"])
        self.assertTrue(problem["title"] and problem["detail"])
        return problem

    def finished(self, **changes):
        return self.daemon.rendered(scene(**changes))
