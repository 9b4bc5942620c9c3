#!/usr/bin/python3
"""summarize.py DIRECTORY: counts the test cases in PART.xml (JUnit output of ctest) by part. PART.times.json has the seconds of a part.

Each ctest test is a runner of many cases, which are counted in its output: GoogleTest and unittest print the number of
cases, a fuzz replay the number of inputs; any other runner is one case. A runner that fails counts as one failure at
least, even if it crashed before it printed one. A runner without cases is a failure, and so is a file PART.not-built.
The last line is "N passed, N failed"; the exit code is 0 only if no case failed and some passed.
"""
import collections
import json
import pathlib
import re
import sys
import xml.etree.ElementTree

Count = collections.namedtuple("Count", "passed failed skipped")


def number(pattern, text):
    """Returns the sum of the first group over all matches, or None without a match."""
    found = re.findall(pattern, text, re.MULTILINE)
    return sum(int(n) for n in found) if found else None


def count_cases(output):
    """Returns the cases that the runner printed, or None if its output has no known format."""
    if (ran := number(r"^\[==========\] (\d+) tests? from \d+ test suites? ran", output)) is not None:
        skipped = number(r"^\[  SKIPPED \] (\d+) tests?, listed below", output) or 0
        failed = number(r"^\[  FAILED  \] (\d+) tests?, listed below", output) or 0
        return Count(ran - failed - skipped, failed, skipped)
    if (ran := number(r"^Ran (\d+) tests? in", output)) is not None:
        result = re.search(r"^(?:OK|FAILED)(?: \((.*)\))?$", output, re.MULTILINE)
        parts = dict(re.findall(r"(\w+)=(\d+)", result.group(1) or "")) if result else {}
        failed = int(parts.get("failures", 0)) + int(parts.get("errors", 0)) + int(parts.get("successes", 0))
        skipped = int(parts.get("skipped", 0))
        return Count(max(ran - failed - skipped, 0), failed, skipped)
    if (replayed := number(r"^replayed (\d+) inputs?", output)) is not None:
        return Count(replayed, 0, 0)
    return None


def count_test(case):
    output = case.findtext("system-out") or ""
    failed = case.get("status") != "run" or case.find("failure") is not None
    count = count_cases(output) or Count(0 if failed else 1, 0, 0)
    if (failed and count.failed == 0) or sum(count) == 0:
        count = count._replace(failed=count.failed + 1)
    return count


def summarize(directory):
    """Returns {part: (Count, names of the ctest tests that failed)}."""
    found = {file.stem: (Count(0, 1, 0), ["(build)"]) for file in directory.glob("*.not-built")}
    for file in directory.glob("*.xml"):
        counts = {case.get("name"): count_test(case) for case in xml.etree.ElementTree.parse(file).iter("testcase")}
        total, failed = found.get(file.stem, (Count(0, 0, 0), []))
        found[file.stem] = (Count(*map(sum, zip(total, *counts.values()))), failed + [name for name, count in counts.items() if count.failed])
    return found


def summarize_and_print(directory):
    """Returns the exit code."""
    totals = summarize(directory)
    print(f"\n{'part':<12}{'build s':>8}{'tests s':>8}{'passed':>8}{'failed':>8}{'skipped':>9}")
    for part, (count, names) in sorted(totals.items()):
        file = directory / f"{part}.times.json"
        times = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {"build": 0, "tests": 0}
        print(f"{part:<12}{times['build']:>8.0f}{times['tests']:>8.0f}{count.passed:>8}{count.failed:>8}{count.skipped:>9}  {' '.join(names)}".rstrip())
    passed, failed = (sum(count[i] for count, _ in totals.values()) for i in (0, 1))
    if passed == 0 and failed == 0:
        failed = 1  # a run without tests is a failure
    print(f"{passed} passed, {failed} failed", flush=True)
    return 0 if failed == 0 else 1


if __name__ == "__main__":
    sys.exit(summarize_and_print(pathlib.Path(sys.argv[1])))
