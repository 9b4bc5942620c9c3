#!/usr/bin/env -S /usr/bin/python3 -u
"""Measures the service under load, for one build or for two builds alternately.

    tests/bench/load.py [--bin DIRECTORY] [--against OLD/bin] [--rounds 20] [--seconds 1] [PART ...]

  renders      small images (16 x 16) by POST /v1/render from --clients connections and from one: images per second,
               latency, CPU time of the daemon and its workers. Every accepted job must succeed.
  submissions  durable jobs per second, latency and CPU time, from --clients connections; nothing is rendered.
               Goal: 500/s, p99 25 ms.
  claims       one small job at a time, submitted and awaited by long polling: time until its end, time in the queue.
  mixed        small renders, and submissions at a moderate rate, while more large renders run and wait than there are
               slots.
  crowd        GET /v1/version over new connections beside idle connections, incomplete request heads and event streams
               (--idle, --slow, --streams), and the memory of the daemon.
  flood        small renders of one API key while another has submitted a batch and --endless jobs that look small and do
               not end. Goal: p99 500 ms.
  batches      a batch of 10,000 frames of a scene of 1 MB: time, peak memory of the daemon, and reads by others meanwhile.
               Goal: 5 s, 200 MB, p99 of the reads 50 ms.
  history      pages and submissions with --jobs finished jobs in the store. Goal: p99 within twice that of --jobs 100.

Each part starts `whittled` with an empty data directory. A round of --seconds is measured for one build after the other;
the clients share the machine with the daemon and wait for each response. Without PART all parts run. The lines show the
median of the rounds with its quartiles, or the medians of both builds and the ratio new / old (see compare.py).
"""
import argparse
import contextlib
import functools
import json
import os
import pathlib
import resource
import signal
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
# pylint: disable=wrong-import-position
from tests.bench.compare import measure_alternately, print_figures
from tests.bench.service import Connection, Crowd, Service, get, latencies_under_load, percentiles, post, timed
from tests.http.daemon import json_of, long_scene, scene, wait_until
from tests.support.whittle import BIN

DEFERRED = scene(job={"run_after": "2999-01-01T00:00:00Z"})  # stored durably and never run
LARGE_RENDERS = 8
FRAMES = 10_000
MIB = 2**20
SHARES = (0.1, 0.5, 0.99)  # other work on the machine affects the first decile least


def load_figures(name, service, request, seconds, clients):
    start_s = service.cpu_seconds()
    rate, latencies_ms = latencies_under_load(service, request, seconds, clients)
    cpu_ms = 1000 * (service.cpu_seconds() - start_s) / len(latencies_ms)
    return {f"{name}, per second": rate, **percentiles(name, latencies_ms), f"{name}, CPU ms each": cpu_ms}


# Each part prepares a service and yields a function: seconds -> {figure: value}.

def renders(service, options):
    request = post("/v1/render", scene(16, 16))

    def measure(seconds):
        return {**load_figures(f"images from {options.clients} clients", service, request, seconds / 2, options.clients),
                **percentiles("image from 1 client", latencies_under_load(service, request, seconds / 2)[1], SHARES)}
    yield measure

    def all_succeeded():
        jobs = json_of(service.get("/v1/queue"))["jobs"]
        return sum(jobs.values()) == jobs["succeeded"]
    wait_until(all_succeeded, "success of every accepted job")


def submissions(service, options):
    yield lambda seconds: load_figures(f"submissions from {options.clients} clients", service,
                                       post("/v1/jobs", DEFERRED), seconds, options.clients)


def claims(service, _):
    request = post("/v1/jobs", scene(16, 16))

    def run_job(connection):
        status, body = connection.exchange(request)
        if status != 202:
            sys.exit(f"a submission is rejected: {body.decode()}")
        job = json.loads(connection.exchange(get(f"/v1/jobs/{json.loads(body)['id']}?wait=60"))[1])
        if job["state"] != "succeeded":
            sys.exit(f"a small job is {job['state']}")
        return job["report"]["time_ms"]["queue"]

    def measure(seconds):
        connection, end, rows = Connection(service.port), time.monotonic() + seconds, []
        while time.monotonic() < end:
            rows.append(timed(lambda: run_job(connection)))
        connection.close()
        queue_ms, total_ms = zip(*rows)
        return {**percentiles("job from submission to end", total_ms, SHARES),
                "job in the queue until claimed, mean ms": sum(queue_ms) / len(queue_ms)}
    yield measure


def mixed(service, _):
    def measure(seconds):
        large = [service.submit(long_scene(name=f"large {index}")) for index in range(LARGE_RENDERS)]
        service.wait_for_state(large[0], "running")
        time.sleep(0.5)  # the large renders use all slots that they get
        name = f"beside {LARGE_RENDERS} large renders"
        images = latencies_under_load(service, post("/v1/render", scene(16, 16)), seconds / 2)[1]
        jobs = latencies_under_load(service, post("/v1/jobs", DEFERRED), seconds / 2, clients=4, pause_s=0.02)[1]
        for job_id in large:
            service.request("POST", f"/v1/jobs/{job_id}/cancel")
        for job_id in large:
            service.wait_for_end(job_id)
        return {**percentiles(f"small image {name}", images, SHARES), **percentiles(f"submission {name}", jobs)}
    yield measure


def crowd(service, options):
    idle_mib = service.resident_bytes() / MIB
    with Crowd(service.port, options):
        def measure(seconds):
            service.submit(scene())  # its events are sent to every stream
            taken = latencies_under_load(service, get("/v1/version"), seconds, pause_s=0.002, reconnect=True)[1]
            return {**percentiles("GET beside the crowd", taken), "memory of the daemon alone, MiB": idle_mib,
                    "memory of the daemon with the crowd, MiB": service.resident_bytes() / MIB}
        yield measure


def flood(service, options):
    mirror = {"color": 0, "reflection": 1}
    walls = [{"type": "plane", "point": [x, y, z], "normal": [-x, -y, -z], "material": mirror}
             for x, y, z in ((2, 0, 0), (-2, 0, 0), (0, 2, 0), (0, -2, 0), (0, 0, 9), (0, 0, -2))]
    endless = scene(40, 25, objects=walls, accuracy={"samples": [1000, 1000], "max_depth": 1_000_000, "cutoff": 0})
    other, own = service.keys
    batch = {"scene": scene(64, 48), "frames": [{}] * FRAMES}
    connection = Connection(service.port)
    for request in [post("/v1/jobs", endless, other)] * options.endless + [post("/v1/batches", batch, other)]:
        status, body = connection.exchange(request)
        if status != 202:
            sys.exit(body.decode())
    connection.close()
    yield lambda seconds: percentiles("render beside the flood of another key", latencies_under_load(
        service, post("/v1/render", scene(16, 16), own), seconds)[1])


def batches(service, _):
    materials = {f"material {i}": {"color": [i / 4000, 0.5, 0.25], "diffuse": 0.8, "specular": 0.125, "shininess": 20 + i,
                                   "specular_color": [1, 1, 1], "reflection": 0.125, "reflection_color": [0.5, 0.5, 1],
                                   "emission": [0, 0, 0], "absorption": [0.1, 0.2, 0.3], "ior": 1.5} for i in range(4000)}
    request = post("/v1/batches", {"scene": {**DEFERRED, "materials": materials},
                                   "frames": [{"camera": {"fov": 20 + 60 * i / FRAMES}} for i in range(FRAMES)]})

    def measure(_):
        replies, reads_ms, reader, submitter = [], [], Connection(service.port), Connection(service.port)
        service.forget_peak()
        thread = threading.Thread(target=lambda: replies.append(timed(lambda: submitter.exchange(request))))
        thread.start()
        while thread.is_alive():
            reads_ms.append(timed(lambda: reader.exchange(get("/v1/version")))[1])
            time.sleep(0.001)
        reader.close()
        submitter.close()
        ((status, body), batch_ms), = replies
        if status != 202:
            sys.exit(body.decode())
        return {"batch, ms": batch_ms, "peak memory of the daemon, MiB": service.peak_bytes() / MIB,
                **percentiles("GET during a batch", reads_ms)}
    yield measure


def history(service, options):
    finish_jobs(service, options.jobs)
    requests = {"page of 50": get("/v1/jobs?limit=50"),
                "page of failed jobs": get("/v1/jobs?limit=50&state=failed"), "submission": post("/v1/jobs", DEFERRED)}

    def measure(seconds):
        figures = {}
        for name, request in requests.items():
            taken = latencies_under_load(service, request, seconds / len(requests), clients=4, pause_s=0.005)[1]
            figures.update(percentiles(f"{name}, {options.jobs} finished jobs", taken))
        return figures
    yield measure


def finish_jobs(service, count):
    """Stores `count` succeeded jobs: the first is rendered, the others get its image from the result cache."""
    document = scene(job={"cache": "use"})
    service.wait_for_end(service.submit(document))
    for start in range(1, count, 10_000):
        frames = [{"job": {"labels": {"frame": str(index)}}} for index in range(start, min(start + 10_000, count))]
        service.submit({"scene": document, "frames": frames}, "/v1/batches")
    jobs = json_of(service.get("/v1/queue"))["jobs"]
    if jobs["succeeded"] < count:
        sys.exit(f"not all jobs succeeded: {jobs}")


PARTS = {part.__name__: contextlib.contextmanager(part)
         for part in (renders, submissions, claims, mixed, crowd, flood, batches, history)}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=pathlib.Path, default=BIN)
    parser.add_argument("--against", type=pathlib.Path)
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=1)
    for name, default in (("clients", 8), ("idle", 2000), ("slow", 500), ("streams", 500), ("endless", 3), ("jobs", 20_000)):
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], metavar="PART")
    return parser.parse_args()


def end_with_daemons(*_):
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # timeout(1) sends it twice
    sys.exit(143)


def main():
    options = arguments()
    signal.signal(signal.SIGTERM, end_with_daemons)
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    builds = [options.bin] + ([options.against] if options.against else [])
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}, {options.rounds} rounds of {options.seconds:g} s"
          + ("; new, old, new / old" if options.against else ""))
    for name in options.parts or PARTS:
        with contextlib.ExitStack() as stack:
            measures = []
            for build in builds:
                service = stack.enter_context(Service(build, ("other", "own") if name == "flood" else ()))
                service.wait_for_end(service.submit(scene()))  # the worker has started
                measures.append(functools.partial(stack.enter_context(PARTS[name](service, options)), options.seconds))
            print_figures(measure_alternately(measures, options.rounds))


if __name__ == "__main__":
    main()
