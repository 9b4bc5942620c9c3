#!/usr/bin/python3
"""summarize.py DIRECTORY: counts the test cases in BUILD.xml (JUnit output of ctest) by build and by suite. The suite is
the ctest label in BUILD.tests.json (ctest --show-only=json-v1).

Each ctest test is a runner of many cases, which are counted in its output: GoogleTest and unittest print the number of
cases, a fuzz replay the number of inputs; any other runner is one case. A runner that fails counts as one failure at
least, even if it crashed before it printed one. A runner without cases is a failure, and so is a file BUILD.not-built.
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


def suites(listing):
    """Returns {test: label}."""
    tests = json.loads(listing.read_text(encoding="utf-8"))["tests"]
    labels = {test["name"]: [label for p in test["properties"] if p["name"] == "LABELS" for label in p["value"] if label != "all"]
              for test in tests}
    return {name: found[0] if found else "unlabelled" for name, found in labels.items()}


def summarize(directory):
    """Returns {(suite, build): Count} of all builds in `directory`."""
    totals = collections.defaultdict(lambda: Count(0, 0, 0))
    for file in sorted(directory.glob("*.xml")):
        suite_of = suites(file.with_suffix(".tests.json"))
        for case in xml.etree.ElementTree.parse(file).iter("testcase"):
            at = (suite_of[case.get("name")], file.stem)
            totals[at] = Count(*map(sum, zip(totals[at], count_test(case))))
    for file in directory.glob("*.not-built"):
        totals[("build", file.stem)] = Count(0, 1, 0)
    return totals


def main():
    totals = summarize(pathlib.Path(sys.argv[1]))
    print(f"\n{'suite':<16}{'build':<10}{'passed':>8}{'failed':>8}{'skipped':>9}")
    for (suite, build), count in sorted(totals.items()):
        print(f"{suite:<16}{build:<10}{count.passed:>8}{count.failed:>8}{count.skipped:>9}")
    passed, failed = (sum(count[i] for count in totals.values()) for i in (0, 1))
    if passed == 0 and failed == 0:
        failed = 1  # a run without tests is a failure
    print(f"{passed} passed, {failed} failed")
    return 0 if failed == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
