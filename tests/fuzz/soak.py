#!/usr/bin/python3
"""soak.py [--minutes 30] [--directory build/fuzz/soak] [FUZZER...]: runs each fuzzer for that many minutes of processor time.

Needs the preset `fuzz` built. One fuzzer runs per processor. Each starts with its seeds and with the inputs that earlier runs
left in the same directory. A row lists the number of inputs, the edges that they cover (libFuzzer's `cov`), the peak memory and
the findings: inputs that crash, leak, or take more than 10 s or 2 GiB. Findings are written to the directory, the fuzzer
continues, and the exit code is 1.
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

import seeds

SOURCE = pathlib.Path(__file__).parents[2]
BIN = SOURCE / "build/fuzz/bin"
SEEDS = {f"fuzz_{name}": [f"build/fuzz/corpus/{name}"] for name in seeds.FUZZERS}
SEEDS["fuzz_reader"].append("scenes")
LIMITS = ["-max_len=4096", "-timeout=10", "-rss_limit_mb=2048", "-print_final_stats=1"]


def processor_s(pid):
    """Processor time of a process that runs or is a zombie."""
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def run_once(name, directory, seconds):
    """Runs a fuzzer until its first finding or the time limit; returns its output and its processor seconds."""
    found = directory / name
    found.mkdir(parents=True, exist_ok=True)
    dictionary = SOURCE / "tests/fuzz" / f"{name.removeprefix('fuzz_')}.dict"
    command = [BIN / name, *LIMITS, f"-artifact_prefix={directory}/{name}-", found, *(SOURCE / seed for seed in SEEDS[name])]
    if dictionary.exists():
        command.insert(1, f"-dict={dictionary}")
    # LeakSanitizer crashes at exit when a thread of OpenImageIO ends at the same time.
    environment = dict(os.environ, ASAN_OPTIONS="detect_leaks=0" if name == "fuzz_image" else "")
    log = directory / f"{name}.log"
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


def soak(name, directory, minutes):
    inputs, edges, memory_mb, spent_s, idle = 0, 0, 0, 0, 0
    while spent_s < 60 * minutes and idle < 3:
        output, took_s = run_once(name, directory, 60 * minutes - spent_s)
        ran = re.search(r"number_of_executed_units:\s+(\d+)", output)
        inputs += int(ran[1]) if ran else 0
        edges = max([edges, *map(int, re.findall(r" cov: (\d+)", output))])
        memory_mb = max([memory_mb, *map(int, re.findall(r"peak_rss_mb:\s+(\d+)", output))])
        spent_s += took_s
        idle = idle + 1 if took_s < 1 else 0  # it fails at the start
    findings = sorted(file.name for file in directory.glob(f"{name}-*") if not file.name.startswith(f"{name}-slow-unit"))
    print(f"{name:18}{spent_s / 60:8.1f}{inputs:12}{edges:8}{memory_mb:8}  {', '.join(findings) or 'none'}", flush=True)
    return not findings and idle < 3


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=30)
    parser.add_argument("--directory", type=pathlib.Path, default=SOURCE / "build/fuzz/soak")
    parser.add_argument("fuzzers", nargs="*", choices=[*SEEDS, []])
    arguments = parser.parse_args()
    directory = arguments.directory.resolve()
    directory.mkdir(parents=True, exist_ok=True)
    print(f"{'':18}{'minutes':>8}{'inputs':>12}{'edges':>8}{'MB':>8}  findings")
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        good = list(pool.map(lambda name: soak(name, directory, arguments.minutes), arguments.fuzzers or SEEDS))
    return 0 if all(good) else 1


if __name__ == "__main__":
    sys.exit(main())
