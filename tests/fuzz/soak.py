#!/usr/bin/python3
"""soak.py [--minutes 30] [--folder build/fuzz/soak] [FUZZER...]: the fuzzers, each for so many minutes of processor time.

Needs the preset `fuzz` built. As many run at once as there are processors; each begins with its corpus and with what it
found when it was run into the same folder before. A row tells how many inputs one ran, how much of the program they
reached (libFuzzer's `cov`, edges), its most memory, and the findings: inputs that crash, leak, take over 10 s or 2 GiB.
These are left in the folder, the fuzzer goes on, and the exit code is 1.
"""
import argparse
import concurrent.futures
import os
import pathlib
import re
import signal
import subprocess
import sys
import time

SOURCE = pathlib.Path(__file__).parents[2]
BIN = SOURCE / "build/fuzz/bin"
SEEDS = {"fuzz_reader": ["tests/fuzz/corpus/reader", "scenes/invalid", "scenes"],
         "fuzz_http_request": ["tests/fuzz/corpus/http_request"],
         "fuzz_image": ["tests/fuzz/corpus/image"],
         "fuzz_mesh": ["tests/fuzz/corpus/mesh"]}
LIMITS = ["-max_len=4096", "-timeout=10", "-rss_limit_mb=2048", "-print_final_stats=1"]


def processor_s(pid):
    """Of a process that lives or waits to be reaped."""
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def run_once(name, folder, seconds):
    """Until it found something or took so long; what it printed, and its processor seconds."""
    found = folder / name
    found.mkdir(parents=True, exist_ok=True)
    dictionary = SOURCE / "tests/fuzz" / f"{name.removeprefix('fuzz_')}.dict"
    command = [BIN / name, *LIMITS, f"-artifact_prefix={folder}/{name}-", found, *(SOURCE / seed for seed in SEEDS[name])]
    if dictionary.exists():
        command.insert(1, f"-dict={dictionary}")
    # LeakSanitizer, as the program ends, meets threads of OpenImageIO's that are ending too.
    environment = dict(os.environ, ASAN_OPTIONS="detect_leaks=0" if name == "fuzz_image" else "")
    log = folder / f"{name}.log"
    with log.open("wb") as out, subprocess.Popen(command, stdout=out, stderr=out, env=environment) as running:
        while True:
            ended = os.waitid(os.P_PID, running.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None
            took_s = processor_s(running.pid)
            if ended:
                break
            if took_s >= seconds:
                running.send_signal(signal.SIGINT)
                os.waitid(os.P_PID, running.pid, os.WEXITED | os.WNOWAIT)
                break
            time.sleep(0.5)
    return log.read_text(errors="replace"), took_s


def soak(name, folder, minutes):
    inputs, edges, memory_mb, spent_s, idle = 0, 0, 0, 0, 0
    while spent_s < 60 * minutes and idle < 3:
        told, took_s = run_once(name, folder, 60 * minutes - spent_s)
        ran = re.search(r"number_of_executed_units:\s+(\d+)", told)
        inputs += int(ran[1]) if ran else 0
        edges = max([edges, *map(int, re.findall(r" cov: (\d+)", told))])
        memory_mb = max([memory_mb, *map(int, re.findall(r"peak_rss_mb:\s+(\d+)", told))])
        spent_s += took_s
        idle = idle + 1 if took_s < 1 else 0  # it does not even begin
    findings = sorted(file.name for file in folder.glob(f"{name}-*") if not file.name.startswith(f"{name}-slow-unit"))
    print(f"{name:18}{spent_s / 60:8.1f}{inputs:12}{edges:8}{memory_mb:8}  {', '.join(findings) or 'none'}", flush=True)
    return not findings and idle < 3


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=30)
    parser.add_argument("--folder", type=pathlib.Path, default=SOURCE / "build/fuzz/soak")
    parser.add_argument("fuzzers", nargs="*", choices=[*SEEDS, []])
    arguments = parser.parse_args()
    folder = arguments.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    print(f"{'':18}{'minutes':>8}{'inputs':>12}{'edges':>8}{'MB':>8}  findings")
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        good = list(pool.map(lambda name: soak(name, folder, arguments.minutes), arguments.fuzzers or SEEDS))
    return 0 if all(good) else 1


if __name__ == "__main__":
    sys.exit(main())
