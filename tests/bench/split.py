#!/usr/bin/env -S /usr/bin/python3 -u
"""Time of one image on two nodes of one core each, relative to one node of one core.

    tests/bench/split.py [--seconds 20] [--runs 3]

The runs alternate. Each line has the wall time of the trace and the processor time of all daemons and workers, for one
node and for two, and their ratios; the last line has the medians. It needs two cores that are otherwise idle: the wall
times of a busy machine are useless, the processor time is the overhead in any case.
"""
import argparse
import pathlib
import statistics
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from tests.cluster.nodes import Cluster  # pylint: disable=wrong-import-position
from tests.cluster.split_test import hashes, mirrors  # pylint: disable=wrong-import-position
from tests.http.daemon import wait_until  # pylint: disable=wrong-import-position

TICKS_PER_SECOND = 100


def cpu_seconds(node):
    """Processor time of the daemon and its workers so far."""
    ticks = 0
    for pid in [node.process.pid, *node.worker_pids()]:
        fields = pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(") ")[2].split()
        ticks += int(fields[11]) + int(fields[12])
    return ticks / TICKS_PER_SECOND


def render(document, count):
    """(seconds of the trace, processor seconds, hashes, report) on `count` nodes, each on a core of its own."""
    with Cluster(("fsync=off",)) as cluster:
        nodes = [cluster.node("all", "--threads", "1", wrapper=("taskset", "-c", str(core))) for core in range(count)]
        wait_until(lambda: cluster.sql("SELECT count(*) FROM task_helpers") == str(count), "the nodes to be idle")
        before = sum(map(cpu_seconds, nodes))
        job = nodes[0].submit(document)
        report = nodes[0].wait_for_end(job)["report"]
        cpu = sum(map(cpu_seconds, nodes)) - before
        return report["time_ms"]["trace"] / 1000, cpu, hashes(nodes[0], job), report


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20, help="time of the image on one core, about")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--target-error", type=float, help="instead of fixed samples")
    options = parser.parse_args()
    side = max(2, round((options.seconds * 100) ** 0.5 / 1))  # 100 samples per pixel take a second
    accuracy = {"target_error": options.target_error} if options.target_error else {"samples": [side * side] * 2}
    document = mirrors(320, 240, accuracy=accuracy)
    rows = []
    for _ in range(options.runs):
        (wall, cpu, image, _), (wall_two, cpu_two, image_two, report) = render(document, 1), render(document, 2)
        if image != image_two:
            raise SystemExit("the images differ")
        rows.append((wall / wall_two, cpu_two / cpu))
        print(f"one {wall:6.2f} s, {cpu:6.2f} s of processor; two {wall_two:6.2f} s, {cpu_two:6.2f} s; "
              f"{report['tasks']} tasks; {wall / wall_two:.2f} times as fast, {cpu_two / cpu:.3f} times the processor time")
    faster, overhead = (statistics.median(column) for column in zip(*rows))
    print(f"median: {faster:.2f} times as fast, {overhead:.3f} times the processor time")


if __name__ == "__main__":
    main()
