"""The summary of tests/run: cases counted in the output of each kind of runner."""
import contextlib
import io
import json
import pathlib
import sys
import tempfile
import unittest
from unittest import mock
from xml.sax.saxutils import escape

from tests.support import summarize

GTEST = "[==========] 5 tests from 2 test suites ran. (1 ms total)\n[  PASSED  ] 3 tests.\n"
GTEST_BAD = GTEST + "[  SKIPPED ] 1 test, listed below:\n[  FAILED  ] 1 test, listed below:\n[  FAILED  ] A.B\n"
UNITTEST = "Ran 7 tests in 0.1s\n\nOK (skipped=2)\n"
UNITTEST_BAD = "Ran 7 tests in 0.1s\n\nFAILED (failures=1, errors=2, unexpected successes=1)\n"


class Summarize(unittest.TestCase):
    def summary(self, *cases, more=()):
        """Returns exit code and last line for ctest cases (output, passed)."""
        with tempfile.TemporaryDirectory() as name:
            directory = pathlib.Path(name)
            tests = [{"name": f"t{i}", "properties": [{"name": "LABELS", "value": ["unit"]}]} for i in range(len(cases))]
            (directory / "release.tests.json").write_text(json.dumps({"tests": tests}), encoding="utf-8")
            body = "".join(f'<testcase name="t{i}" status="{"run" if passed else "fail"}">'
                           f"<system-out>{escape(output)}</system-out></testcase>"
                           for i, (output, passed) in enumerate(cases))
            (directory / "release.xml").write_text(f"<testsuite>{body}</testsuite>", encoding="utf-8")
            for file in more:
                (directory / file).write_text("", encoding="utf-8")
            printed = io.StringIO()
            with mock.patch.object(sys, "argv", ["summarize", name]), contextlib.redirect_stdout(printed):
                code = summarize.main()
            return code, printed.getvalue().splitlines()[-1]

    def test_adds_the_cases_of_all_runners(self):
        self.assertEqual(self.summary((GTEST, True), (UNITTEST, True), ("replayed 40 inputs\n", True), ("?", True)),
                         (0, f"{5 + 5 + 40 + 1} passed, 0 failed"))

    def test_counts_failures_errors_and_unexpected_successes(self):
        self.assertEqual(self.summary((GTEST_BAD, False), (UNITTEST_BAD, False)), (1, f"{3 + 3} passed, {1 + 4} failed"))

    def test_counts_a_crashed_runner_as_a_failure(self):
        for output in ("", GTEST, UNITTEST, "replayed 3 inputs\n", "Segmentation fault"):
            code, line = self.summary((output, False))
            self.assertEqual(code, 1)
            self.assertTrue(line.endswith(" 1 failed"), line)

    def test_counts_a_runner_without_cases_as_a_failure(self):
        none = "[==========] 0 tests from 0 test suites ran. (0 ms total)\n[  PASSED  ] 0 tests.\n"
        for output in (none, "Ran 0 tests in 0.0s\n\nOK\n", "replayed 0 inputs\n"):
            self.assertEqual(self.summary((output, True)), (1, "0 passed, 1 failed"))

    def test_counts_a_failed_build_and_a_run_without_tests_as_failures(self):
        self.assertEqual(self.summary((GTEST, True), more=["tsan.not-built"]), (1, "5 passed, 1 failed"))
        self.assertEqual(self.summary(), (1, "0 passed, 1 failed"))


if __name__ == "__main__":
    unittest.main()
