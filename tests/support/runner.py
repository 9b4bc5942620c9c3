"""The program of tests/run: builds and runs parts of the tests. See tests/README.md."""
import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import time

from tests.support import descendants, leftovers, summarize
from tests.support.sources import SOURCE

QUICK = "quick"
# Parts of the long run, in its order. Each test has the label "part." and one of these names, or "part.quick".
LONG = ("units", "scenes", "cli", "docs", "http", "crash", "disk", "postgres", "s3", "cluster", "property", "statistics", "stability",
        "bench", "browser", "asan", "tsan", "tidy", "containers", "ceph")
SANITIZERS = ("asan", "tsan")
RESULTS = SOURCE / "build/test-results"
PROGRESS_S = 15  # between two lines about a build

# Tests of figures that take many samples, of renders that take long, and of stores that take many rounds: with a sanitizer each takes
# ten seconds and more, and shorter tests run the same code.
NOT_WITH_SANITIZERS = (
    "ModelError.*", "Filtering.*", "SurfaceRows.*", "SurfacePatches.KeepWithinTheLimit", "Looks.Estimate*",
    "PixelBounds.ContainEvery*", "Palette.HasAnErrorOf*", "TorusHits.MatchAll*", "FileError.*", "TracePart.RendersGlobalLight*",
    "TracePart.RendersApproximations*", "SceneCacheOfAWorker.Reads*",
    "WorkerTest.LowersThePriorityOf*", "TracePart.RendersFixedSamples*", "TracePart.RendersCrops*", "TracePart.RendersLayers*",
    "Preview.OfALongWindow*", "SqliteStoresTest.BoundsTheLog*", "S3ClientTest.ReturnsTheBytes*",
    "Stores/JobStoreConformance.*/Postgres", "ReaderLimits.ReportTheFirstOf*")


def part_of(test):
    """The part that runs a test of ctest's list; ValueError unless it is exactly one."""
    labels = [label for each in test["properties"] if each["name"] == "LABELS" for label in each["value"]]
    parts = [label.removeprefix("part.") for label in labels if label.startswith("part.")]
    if len(parts) != 1 or parts[0] not in (QUICK, *LONG, "none"):
        raise ValueError(f"{test['name']} is in the parts {parts}, and must be in one of {(QUICK, *LONG)}")
    return parts[0]


class Build:
    """Compiles for one part and prints how far it is."""

    def __init__(self, part, preset):
        self.part, self.preset = part, preset
        self.log = RESULTS / f"{part}.build.log"
        self.start = self.printed = time.monotonic()

    def run(self):
        """False if it fails."""
        for command in (["cmake", "--preset", self.preset],
                        ["cmake", "--build", "--preset", self.preset, "--target", f"part_{self.part}"]):
            with subprocess.Popen(command, cwd=SOURCE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                  errors="replace") as process, open(self.log, "a", encoding="utf-8") as log:
                for line in process.stdout:
                    log.write(line)
                    self.report(line)
            if process.returncode != 0:
                print("\n".join(self.log.read_text(encoding="utf-8").splitlines()[-60:]))
                print(f"{self.part} does not build; the whole log is {self.log}")
                return False
        return True

    def report(self, line):
        now = time.monotonic()
        step = re.match(r"\[(\d+)/(\d+)\]", line)
        if step and now - self.printed >= PROGRESS_S:
            print(f"   {step.group(1)} of {step.group(2)} after {now - self.start:.0f} s", flush=True)
            self.printed = now


def environment_of(part, temporary):
    changes = {"TMPDIR": str(temporary)}
    if part in SANITIZERS:
        changes["GTEST_FILTER"] = "-" + ":".join(NOT_WITH_SANITIZERS)
    elif part != QUICK:
        changes["WHITTLE_LONG"] = "yes"
    return {**os.environ, **changes}


def test(part, preset, temporary):
    """Runs the tests of a part. What they find is in RESULTS."""
    directory = SOURCE / "build" / preset
    listing = subprocess.run(["ctest", "--test-dir", directory, "--show-only=json-v1"], check=True, capture_output=True, text=True).stdout
    for each in json.loads(listing)["tests"]:
        part_of(each)
    command = ["ctest", "--test-dir", directory, "--parallel", str(os.cpu_count()), "--output-on-failure", "--no-tests=error",
               "--test-output-size-passed", "10000000", "--test-output-size-failed", "10000000",
               "--output-junit", RESULTS / f"{part}.xml", "--label-regex", rf"^part\.{part}$"]
    subprocess.run(command, env=environment_of(part, temporary), check=False)
    if not (RESULTS / f"{part}.xml").exists():
        raise ValueError(f"{part} ran nothing")


def run_part(part, temporary):
    preset = part if part in SANITIZERS else "release"
    start = time.monotonic()
    built = None
    print(f"== {part}: build", flush=True)
    try:
        if part == "ceph":
            subprocess.run([SOURCE / "docker/install", "Ceph"], check=True)
        if not Build(part, preset).run():
            raise ValueError(f"{part} does not build")
        built = time.monotonic()
        print(f"== {part}: tests (built in {built - start:.0f} s)", flush=True)
        test(part, preset, temporary)
    except (ValueError, subprocess.CalledProcessError) as error:
        print(error)
        (RESULTS / f"{part}.not-built").write_text(str(error), encoding="utf-8")
    end = time.monotonic()
    seconds = {"build": (built or end) - start, "tests": end - (built or end)}
    (RESULTS / f"{part}.times.json").write_text(json.dumps(seconds), encoding="utf-8")
    print(f"== {part}: tested in {seconds['tests']:.0f} s", flush=True)


def run(parts, temporary):
    shutil.rmtree(RESULTS, ignore_errors=True)
    RESULTS.mkdir(parents=True)
    for part in parts:
        run_part(part, temporary)
    return summarize.summarize_and_print(RESULTS)


def main():
    parser = argparse.ArgumentParser(prog="tests/run", description="Builds and runs the quick tests. The last line is "
                                     '"N passed, N failed".')
    parser.add_argument("--long", nargs="*", metavar="PART", help="runs these parts of the long tests instead, or all of them")
    parser.add_argument("--list", action="store_true", help="lists the parts")
    options = parser.parse_args()
    if options.list:
        print("\n".join((QUICK, *LONG)))
        return 0
    parts = [QUICK] if options.long is None else list(dict.fromkeys(options.long)) or list(LONG)
    if unknown := set(parts) - {QUICK, *LONG}:
        parser.error(f"no part is named {', '.join(sorted(unknown))}; they are {', '.join((QUICK, *LONG))}")
    for name in leftovers.remove_orphans():
        print(f"removed what a killed run had left: {name}")
    temporary = leftovers.create_directory()
    return descendants.supervise(lambda: run(parts, temporary), lambda: leftovers.delete(temporary))


if __name__ == "__main__":
    sys.exit(main())
