"""launch.py FILE COMMAND...: runs the command and writes its {"status", "seconds", "cpu_seconds", "memory_kb"} to FILE.

This is a separate small process, because ru_maxrss (getrusage(2)) of a program includes the memory that its process had
before exec, and the process that generates the scenes is large.
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
