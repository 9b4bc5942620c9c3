"""clang-tidy, with the rules of .clang-tidy, finds nothing in the sources that are built: where WHITTLE_TIDY_TESTS is set in all
of them and in those of the tests; else, since all take ten minutes, in a third, which changes with every commit."""
import concurrent.futures
import json
import os
import subprocess
import unittest

from tests.support.sources import SOURCE, tracked

BUILD = os.path.dirname(os.environ["WHITTLE_BIN"])


def findings(path):
    """What it says of one source; empty when all is well. GCC's own warning options are none of clang's business."""
    done = subprocess.run(["clang-tidy", "--quiet", "-p", BUILD, "--extra-arg=-Wno-unknown-warning-option", path],
                          check=False, capture_output=True, text=True)
    return "" if done.returncode == 0 else done.stdout + done.stderr


class ClangTidy(unittest.TestCase):
    def test_finds_nothing(self):
        with open(f"{BUILD}/compile_commands.json", encoding="utf-8") as file:
            built = {entry["file"] for entry in json.load(file)}
        names = [name for name in tracked(".cpp")
                 if "WHITTLE_TIDY_TESTS" in os.environ or not str(name).startswith("tests/")]
        sources = [path for path in (str(SOURCE / name) for name in names) if path in built]
        self.assertGreater(len(sources), 50)
        if "WHITTLE_TIDY_TESTS" not in os.environ:
            commits = subprocess.run(["git", "-C", SOURCE, "rev-list", "--count", "HEAD"], check=True, capture_output=True)
            sources = sources[int(commits.stdout) % 3::3]
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            found = [text for text in pool.map(findings, sources) if text]
        self.assertEqual(found, [], "\n".join(found))


if __name__ == "__main__":
    unittest.main()
