#!/usr/bin/python3
"""load.py [--seconds 10] [--clients 8] [--jobs 100000] [PART...]: the daemon under load, from a process of its own.

  renders      16 x 16 scenes rendered one after the other by each client: pictures a second, their latency, and how many
               accepted jobs were lost (0, or the exit code is 1)
  submissions  durable jobs a second that nobody runs yet, and the latency of each; goal: 500/s, p99 25 ms
  saturated    the same, a little at a time, beside renders that keep all cores busy
  history      pages and submissions with --jobs finished jobs in the store, beside those of one with two pages of them;
               goal: p99 within twice

Each part starts whittled (from $WHITTLE_BIN) on free ports with an empty data folder. Clients have a connection each,
share the machine with the daemon and wait for each reply. Without PART all of them.
"""
import argparse
import json
import os
import pathlib
import socket
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).parents[2]))
from tests.http.daemon import Daemon, json_of, long_scene, scene  # pylint: disable=wrong-import-position

FEW = 100
LATER = {"run_after": "2999-01-01T00:00:00Z"}  # stored as any other, and nobody runs it


class Client(threading.Thread):
    """One connection, one request at a time, written out by hand so that it costs next to nothing."""

    def __init__(self, port, request, until, pause_s=0.0):
        super().__init__()
        self.stream = socket.create_connection(("127.0.0.1", port), timeout=120).makefile("rwb")
        self.request, self.until, self.pause_s = request, until, pause_s
        self.latencies_s, self.refused = [], 0

    def status(self):
        status = int(self.stream.readline().split()[1])
        length = 0
        while (line := self.stream.readline()) not in (b"\r\n", b""):
            name, _, value = line.partition(b":")
            if name.lower() == b"content-length":
                length = int(value)
        self.stream.read(length)
        return status

    def run(self):
        while time.monotonic() < self.until:
            start = time.monotonic()
            self.stream.write(self.request)
            self.stream.flush()
            if self.status() in (200, 202):
                self.latencies_s.append(time.monotonic() - start)
            else:
                self.refused += 1
            time.sleep(self.pause_s)


def post(path, document):
    body = json.dumps(document).encode()
    return (f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
            f"Content-Length: {len(body)}\r\n\r\n").encode() + body


def get(path):
    return f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode()


def load(daemon, request, clients, seconds, pause_s=0.0):
    """What `clients` were answered in that time: how many a second, and the sorted latencies in ms."""
    start = time.monotonic()
    threads = [Client(daemon.port, request, start + seconds, pause_s) for _ in range(clients)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    latencies = sorted(1000 * latency for thread in threads for latency in thread.latencies_s)
    refused = sum(thread.refused for thread in threads)
    if refused or not latencies:
        sys.exit(f"{refused} requests were refused, {len(latencies)} were not")
    return len(latencies) / (time.monotonic() - start), latencies


def at(latencies, part):
    return latencies[min(len(latencies) - 1, int(part * len(latencies)))]


def tell(what, rate, latencies):
    print(f"{what:<44} {rate:7.0f} /s   p50 {at(latencies, 0.5):6.1f} ms   p99 {at(latencies, 0.99):6.1f} ms   "
          f"max {latencies[-1]:6.1f} ms", flush=True)


def renders(options):
    with Daemon("--log-level", "warning") as daemon:
        idle_bytes = daemon.resident_bytes()
        rate, latencies = load(daemon, post("/v1/render", scene(16, 16)), options.clients, options.seconds)
        tell(f"pictures of 16 x 16, {options.clients} clients", rate, latencies)
        jobs = json_of(daemon.get("/v1/queue"))["jobs"]
        lost = sum(jobs.values()) - jobs["succeeded"]
        print(f"{'':<44} {lost} lost of {sum(jobs.values())} accepted; the idle daemon has {idle_bytes / 2**20:.1f} MiB", flush=True)
        return lost == 0


def submissions(options):
    with Daemon("--log-level", "warning", "--queued-jobs", "10000000", "--key-queued-jobs", "10000000") as daemon:
        tell(f"durable submissions, {options.clients} clients",
             *load(daemon, post("/v1/jobs", scene(job=LATER)), options.clients, options.seconds))
    return True


def saturated(options):
    with Daemon("--log-level", "warning") as daemon:
        count = os.cpu_count()
        for index in range(count):
            job_id = daemon.submit(long_scene(name=f"keeps a core busy {index}"))
            daemon.wait_for_state(job_id, "running")
        tell("submissions while renders keep all cores busy",
             *load(daemon, post("/v1/jobs", scene(job=LATER)), 4, options.seconds, pause_s=0.02))
    return True


def history(options):
    figures = {}
    for jobs in (FEW, options.jobs):
        with Daemon("--log-level", "warning", "--queued-jobs", "10000000", "--key-queued-jobs", "10000000") as daemon:
            finish(daemon, jobs)
            for what, request in (("pages of 50", get("/v1/jobs?limit=50")),
                                  ("pages of those that failed", get("/v1/jobs?limit=50&state=failed")),
                                  ("submissions", post("/v1/jobs", scene(job=LATER)))):
                rate, latencies = load(daemon, request, 4, options.seconds / 2, pause_s=0.005)
                tell(f"{what}, {jobs} finished jobs", rate, latencies)
                figures[what, jobs] = at(latencies, 0.99)
    for what, jobs in figures:
        if jobs != FEW:
            print(f"{what}: p99 with {jobs} finished jobs is {figures[what, jobs] / figures[what, FEW]:.2f} times that with {FEW}")
    return True


def finish(daemon, jobs):
    """So many jobs that succeeded: one was rendered, the others found its picture in the result cache."""
    document = scene(job={"cache": "use"})
    daemon.wait_for_end(daemon.submit(document))
    for begun in range(1, jobs, 10_000):
        frames = [{"job": {"labels": {"frame": str(index)}}} for index in range(begun, min(begun + 10_000, jobs))]
        reply = daemon.request("POST", "/v1/batches", {"scene": document, "frames": frames})
        if reply.status != 202:
            sys.exit(reply.body.decode())
    finished = json_of(daemon.get("/v1/queue"))["jobs"]
    if finished["succeeded"] != jobs:
        sys.exit(f"not all are finished: {finished}")


PARTS = {"renders": renders, "submissions": submissions, "saturated": saturated, "history": history}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--clients", type=int, default=8)
    parser.add_argument("--jobs", type=int, default=100_000)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []])
    options = parser.parse_args()
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores", flush=True)
    sys.exit(0 if all([PARTS[part](options) for part in options.parts or PARTS]) else 1)


if __name__ == "__main__":
    main()
