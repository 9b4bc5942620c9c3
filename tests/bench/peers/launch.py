"""launch.py FILE COMMAND...: runs the command and writes {"status", "seconds", "cpu_seconds", "memory_kb"} of it to FILE.

A process of its own, as small as Python gets: Linux counts what a process had before it became another program towards
that program's peak memory (getrusage(2), ru_maxrss), and the one that makes the scenes is large.
"""
import json
import os
import sys
import time

start = time.perf_counter()
process = os.posix_spawnp(sys.argv[2], sys.argv[2:], os.environ)
_, status, usage = os.wait4(process, 0)
seconds = time.perf_counter() - start
with open(sys.argv[1], "w", encoding="ascii") as file:
    json.dump({"status": os.waitstatus_to_exitcode(status), "seconds": seconds,
               "cpu_seconds": usage.ru_utime + usage.ru_stime, "memory_kb": usage.ru_maxrss}, file)
