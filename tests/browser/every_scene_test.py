"""The page of a job for every example scene, many broken files and a large one."""
import time
import unittest

from tests.browser.job_page import JobPage, example
from tests.http.daemon import json_of
from tests.support.sources import SOURCE

SCENES = sorted(path.stem for path in (SOURCE / "scenes").glob("*.json"))
SETTINGS = ({"target_error": 20}, {"samples": [2, 2], "cutoff": 0.05, "max_depth": 2, "approximate": {"reflections": "environment"}})
LONGEST_TASK = "window.longest = 0; new PerformanceObserver((list) => { for (const each of list.getEntries()) longest = Math.max(longest, each.duration); }).observe({type: 'longtask'});"


class EveryScene(JobPage):
    def test_has_an_account(self):
        """Acceptance test 20."""
        self.open("#/nothing")
        for name in SCENES:
            for accuracy in SETTINGS:
                document = example(name, accuracy=accuracy)
                if not json_of(self.daemon.request("POST", "/v1/jobs/validate", document))["valid"]:
                    del document["accuracy"]["approximate"]  # of scenes without reflections
                with self.subTest(name, accuracy=document["accuracy"]):
                    self.check_account(self.daemon.submit(document))

    def test_has_channels_that_equal_those_of_another_reader(self):
        """Acceptance test 22."""
        self.open("#/nothing")
        for name in SCENES:
            with self.subTest(name):
                self.check_layers(name, half=False)

    def test_has_needs_that_lead_to_their_values(self):
        """Acceptance test 23."""
        for name in SCENES:
            with self.subTest(name):
                self.check_links(name)


class Files(JobPage):
    def test_that_are_broken_are_refused_soon(self):
        """Acceptance test 22: the corpus and 1,000 mutations; the longest time and the greatest memory are printed."""
        self.open("#/nothing")
        job = self.finished(example("tiny", image={"width": 24, "height": 20}, output={"formats": ["exr"], "layers": ["error"]}))
        good = self.daemon.get(f"/v1/jobs/{job['id']}/image.exr").body
        longest, most = 0, 0
        for index, file in enumerate(self.mutations(good, 1000)):
            begin = time.monotonic()
            self.assertIsInstance(self.read_channels(file), (str, list))
            longest = max(longest, time.monotonic() - begin)
            if index % 50 == 0:
                most = max(most, self.browser.execute_script("return performance.memory?.usedJSHeapSize ?? 0"))
        print(f"longest {1000 * longest:.0f} ms, heap {most / 1e6:.0f} MB")
        self.assertIsInstance(self.read_channels(good), list, "a good file is read after them")

    def test_that_are_large_are_shown(self):
        """Acceptance test 22: five channels of 1920 x 1080 pixels; the times are printed."""
        document = example("shapes", image={"width": 1920, "height": 1080}, accuracy={"samples": [1, 1]}, output={"formats": ["png", "exr"], "layers": ["error", "samples"]})
        job = self.finished(document)
        size = next(each["bytes"] for each in job["artifacts"] if each["name"] == "image.exr")
        script = self.browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": LONGEST_TASK})
        begin = time.monotonic()
        self.open(f"#/jobs/{job['id']}?tab=error")
        self.browser.until(lambda: self.browser.all("img[data-cover]"), "the map")
        print(f"{size / 1e6:.1f} MB are shown after {time.monotonic() - begin:.1f} s, longest task {self.browser.execute_script('return longest'):.0f} ms")
        self.browser.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", script)


del JobPage  # only its subclasses have tests

if __name__ == "__main__":
    unittest.main()
