"""tests/run: each test is in one part, a file's cases are split without loss, whatever a run starts ends with it, and the
summary counts the cases in the output of each kind of runner."""
import contextlib
import io
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from xml.sax.saxutils import escape

from tests.support import cases, descendants, leftovers, runner, summarize
from tests.support.sources import SOURCE, text, tracked

PATIENCE_S = 300
GTEST = "[==========] 5 tests from 2 test suites ran. (1 ms total)\n[  PASSED  ] 3 tests.\n"
GTEST_BAD = GTEST + "[  SKIPPED ] 1 test, listed below:\n[  FAILED  ] 1 test, listed below:\n[  FAILED  ] A.B\n"
UNITTEST = "Ran 7 tests in 0.1s\n\nOK (skipped=2)\n"
UNITTEST_BAD = "Ran 7 tests in 0.1s\n\nFAILED (failures=1, errors=2, unexpected successes=1)\n"
# A test that starts a process which leaves its session and its parent, as a daemon does.
ESCAPES = """
import os, pathlib, subprocess, sys, time
from tests.support import descendants
def work():
    script = 'import os, subprocess; os.setsid(); subprocess.Popen(["sleep", "1000"]); print(flush=True); os._exit(0)'
    subprocess.run([sys.executable, "-c", script], check=True, stdout=subprocess.DEVNULL)
    others = set(descendants.descendants(os.getppid())) - {os.getpid()}
    pathlib.Path(sys.argv[1]).write_text(" ".join(map(str, others)))
    print("ready", flush=True)
    return 7 if sys.argv[2] == "ends" else time.sleep(1000)
sys.exit(descendants.supervise(work))
"""


def named(name, *labels):
    return {"name": name, "properties": [{"name": "LABELS", "value": list(labels)}]}


class Parts(unittest.TestCase):
    def test_a_test_is_in_exactly_one(self):
        self.assertEqual(runner.part_of(named("a", "part.quick", "unit")), "quick")
        for labels in ((), ("unit",), ("part.quick", "part.http"), ("part.unknown",)):
            with self.assertRaises(ValueError):
                runner.part_of(named("a", *labels))

    def test_all_are_used_and_listed_in_the_documentation(self):
        listings = "\n".join(text(path) for path in tracked(".txt") if path.name == "CMakeLists.txt" and path.parts[0] == "tests")
        table = re.findall(r"^\| `(\w+)` \|.*\|$", text("tests/README.md").partition("<!-- parts -->")[2].partition("<!-- end -->")[0],
                           re.MULTILINE)
        self.assertEqual(table, [runner.QUICK, *runner.LONG])
        for part in {runner.QUICK, *runner.LONG} - set(runner.SANITIZERS):
            self.assertRegex(listings, rf"\b{part}\b", part)

    def test_the_cases_of_a_file_are_split_without_loss(self):
        class Some(unittest.TestCase):
            def test_a(self):
                pass

            def test_b(self):
                pass

        both = cases.flatten(unittest.defaultTestLoader.loadTestsFromTestCase(Some))
        self.assertEqual([case.id().split(".")[-1] for case in cases.select(both, ["test_a"], only=True)], ["test_a"])
        self.assertEqual([case.id().split(".")[-1] for case in cases.select(both, ["test_a"], only=False)], ["test_b"])
        with self.assertRaises(LookupError):
            cases.select(both, ["test_c"], only=False)


class Processes(unittest.TestCase):
    def run_and_end(self, how, number=None):
        """The exit code of a run that starts a process which escapes, once that process has ended."""
        with tempfile.TemporaryDirectory() as directory:
            pids = pathlib.Path(directory, "pids")
            with subprocess.Popen([sys.executable, "-c", ESCAPES, pids, how], cwd=SOURCE, stdout=subprocess.PIPE) as process:
                process.stdout.readline()
                started = [int(pid) for pid in pids.read_text(encoding="ascii").split()]
                if number:
                    process.send_signal(number)
                try:
                    code = process.wait(PATIENCE_S)
                finally:
                    process.kill()  # does nothing after its end
                process.stdout.read()  # ends with the last process that has inherited it
            self.assertEqual(len(started), 1)
            end = time.monotonic() + PATIENCE_S
            while any(self.runs(pid) for pid in started) and time.monotonic() < end:
                time.sleep(0.01)
            self.assertEqual([pid for pid in started if self.runs(pid)], [])
            return code

    @staticmethod
    def runs(pid):
        try:
            return pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="latin-1").rpartition(")")[2].split()[0] != "Z"
        except OSError:
            return False

    def test_end_with_the_run(self):
        self.assertEqual(self.run_and_end("ends"), 7)

    def test_end_as_a_signal_ends_the_run(self):
        for number in descendants.SIGNALS:
            self.assertEqual(self.run_and_end("goes on", number), 128 + number)

    def test_end_as_the_run_is_killed(self):
        self.assertEqual(self.run_and_end("goes on", signal.SIGKILL), -signal.SIGKILL)


class Leftovers(unittest.TestCase):
    def test_of_ended_runs_are_removed_and_of_others_kept(self):
        with tempfile.TemporaryDirectory() as root:
            with subprocess.Popen(["true"]) as ended:
                ended.wait()
            for name in (leftovers.name_of(ended.pid), leftovers.name_of(os.getpid()), "whittle-tests-mine"):
                pathlib.Path(root, name, "directory").mkdir(parents=True)
            leftovers.remove_orphans(root)
            self.assertEqual(sorted(path.name for path in pathlib.Path(root).iterdir()), sorted([leftovers.name_of(os.getpid()), "whittle-tests-mine"]))


class Summarize(unittest.TestCase):
    def expect(self, passed, failed, *cases, more=()):
        """The last line and the exit code for ctest cases (output, passed), and for further files."""
        with tempfile.TemporaryDirectory() as name, contextlib.redirect_stdout(io.StringIO()) as printed:
            body = "".join(f'<testcase name="t{i}" status="{"run" if passed else "fail"}"><system-out>{escape(output)}</system-out></testcase>'
                           for i, (output, passed) in enumerate(cases))
            pathlib.Path(name, "release.xml").write_text(f"<testsuite>{body}</testsuite>", encoding="utf-8")
            for file in more:
                pathlib.Path(name, file).touch()
            code = summarize.summarize_and_print(pathlib.Path(name))
        self.assertEqual((code, printed.getvalue().splitlines()[-1]), (failed > 0, f"{passed} passed, {failed} failed"))

    def test_counts_the_cases_of_all_runners(self):
        self.expect(5 + 5 + 40 + 1, 0, (GTEST, True), (UNITTEST, True), ("replayed 40 inputs\n", True), ("?", True))
        self.expect(3 + 3, 1 + 4, (GTEST_BAD, False), (UNITTEST_BAD, False))

    def test_counts_crashes_runs_without_cases_and_failed_builds_as_failures(self):
        for output, passed in (("", 0), (GTEST, 5), (UNITTEST, 5), ("replayed 3 inputs\n", 3), ("Segmentation fault", 0)):
            self.expect(passed, 1, (output, False))
        for output in ("[==========] 0 tests from 0 test suites ran. (0 ms total)\n", "Ran 0 tests in 0.0s\n\nOK\n", "replayed 0 inputs\n"):
            self.expect(0, 1, (output, True))
        self.expect(5, 1, (GTEST, True), more=["tsan.not-built"])
        self.expect(0, 1)
