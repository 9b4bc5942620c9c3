"""The page of a job: progress, error account, heat map, layers of EXR files, actions."""
import json
import os
import random
import re
import subprocess
import sys
import time
import urllib.request

import numpy
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from tests.browser.browser import LATER, SCRIPTS, BrowserTest
from tests.http.daemon import json_of, scene
from tests.support.images import read_exr_channels, read_png
from tests.support.sources import SOURCE, text
from tests.support.whittle import BIN, temporary_directory


def example(name, **changes):
    return {**json.loads(text(f"scenes/{name}.json")), "image": {"width": 80, "height": 60}, "job": {"cache": "off"}, **changes}


class JobPage(BrowserTest):
    options = ("--assets", str(SOURCE / "scenes"))

    def pixels(self, selector):
        return self.browser.execute_script(SCRIPTS + "return codesOf(arguments[0])", selector)

    def decoded(self, path):
        return read_png(self.daemon.get(path).body)[:, :, :3].ravel().tolist()


class Account(JobPage):
    def test_shows_shares_and_levels_of_the_report(self):
        """Acceptance test 20, for a job whose error has every part."""
        accuracy = {"samples": [2, 2], "cutoff": 0.3, "max_depth": 2, "approximate": {"shadows": "none"}}
        job = self.daemon.rendered(example("transparency", accuracy=accuracy))
        error = job["report"]["error"]
        self.assertGreater(min(error["parts"][name] for name in ("sampling", "approximation", "depth", "cutoff")), 0)
        self.open(f"#/jobs/{job['id']}?tab=error", lambda: self.browser.all(".tab .plain tbody tr"), "the table")
        cells = self.browser.execute_script("return [...document.querySelectorAll('.tab .plain tbody tr')].map((row) => [...row.cells].map((cell) => cell.innerText.trim()))")
        rows = {name: (float(share.rstrip(" %") or "nan"), float(levels)) for name, share, levels in cells}
        shares = [rows[part][0] for part in ("Sampling", "Truncation", "Approximation")]
        widths = [float(part.get_attribute("data-share")) for part in self.browser.all(".parts-bar .part")]
        self.assertAlmostEqual(widths[0], error["parts"]["sampling"] ** 2 / error["estimate"] ** 2, delta=0.001)
        self.assertAlmostEqual(sum(widths), 1, delta=0.001)
        for share, width in zip(shares, widths, strict=True):
            self.assertAlmostEqual(share, 100 * width, delta=0.06)
        for row, value in (("Sampling", error["parts"]["sampling"]), ("Approximation", error["parts"]["approximation"]),
                           ("max_depth alone", error["parts"]["depth"]), ("cutoff alone", error["parts"]["cutoff"]), ("Estimate", error["estimate"])):
            self.assertAlmostEqual(rows[row][1], value, delta=0.06 * value, msg=f"{row}: {rows}")  # two digits are shown

    def test_pixels_of_the_map_equal_the_layer(self):
        """Acceptance test 21: the value under the pointer against the reader of tests/support, the colors against the service."""
        job = self.daemon.rendered(example("transparency", accuracy={"samples": [4, 4]}, output={"formats": ["png", "exr"], "layers": ["error", "samples"]}))
        self.open(f"#/jobs/{job['id']}?tab=error", lambda: self.browser.all("img[data-cover]"), "the map")
        white = self.browser.one("input.white").get_attribute("value")
        expected = self.decoded(f"/v1/jobs/{job['id']}/view.png?layer=error&map=heat&range=0,{white}")
        self.assertLessEqual(numpy.abs(numpy.subtract(self.pixels("img[data-cover]"), expected)).max(), 2)
        values = read_exr_channels(self.daemon.get(f"/v1/jobs/{job['id']}/image.exr").body)["error"].ravel()
        for at in random.Random(1).sample(range(len(values)), 20):
            x, y = at % 80, at // 80
            shown = self.browser.until(lambda x=x, y=y: self.caption_at(x, y), f"the caption of x {x}, y {y}")
            self.assertAlmostEqual(float(re.search(r"([\d.e-]+) levels", shown)[1]), values[at], delta=0.01 + 0.05 * values[at], msg=shown)

    def caption_at(self, x, y):
        """Points at a pixel of the image of 80 x 60 pixels; the caption once it is of that pixel. The longer text may have resized the image."""
        shown = self.browser.execute_script(SCRIPTS + "return captionAt(...arguments)", x, y)
        return shown if f"x {x}, y {y} " in shown else None

    def test_offers_to_render_with_the_layers(self):
        job = self.daemon.rendered(example("tiny", accuracy={"samples": [1, 1]}))
        self.open(f"#/jobs/{job['id']}?tab=error")
        self.browser.click("Render again with them", lambda: self.browser.all("img[data-cover]"), "the map")
        other = self.browser.current_url.split("/jobs/")[1].split("?")[0]
        self.assertNotEqual(other, job["id"])
        images = [self.daemon.get(f"/v1/jobs/{each}/image.png").body for each in (job["id"], other)]
        self.assertEqual(*images)


class Views(JobPage):
    def test_shows_layers_and_exposures(self):
        job = self.daemon.rendered(example("transparency", accuracy={"samples": [2, 2]}, output={"formats": ["png", "exr"], "layers": ["depth", "error"]}))
        self.open(f"#/jobs/{job['id']}")
        first = self.browser.until(lambda: self.source(), "the image")
        ActionChains(self.browser).send_keys("2").perform()
        self.browser.until(lambda: "layer=depth" in self.browser.current_url and self.source() != first, "the depth")
        self.assertEqual(self.pixels(".viewer img"), self.decoded(f"/v1/jobs/{job['id']}/view.png?layer=depth&max=2048"))
        self.assertEqual(self.browser.all("input.stops"), [])
        self.browser.click("Image", lambda: self.source() == first, "the image again", ".tab")
        ActionChains(self.browser).send_keys("]").send_keys("]").perform()
        self.browser.until(lambda: "exposure=2" in self.browser.current_url and self.source() not in ("", first), "two stops more")
        self.browser.until(lambda: self.pixels(".viewer img") == self.decoded(f"/v1/jobs/{job['id']}/view.png?layer=color&max=2048&exposure=2"), "brighter pixels")
        self.assertEqual(len(self.browser.all(".tab [role=group] button")), 3)
        for tab in ("Cost", "Image"):
            self.browser.button(tab, ".tabs nav").click()
        self.browser.until(lambda: "tab=image" in self.browser.current_url and "exposure=2" in self.browser.current_url, "the exposure still")

    def source(self):
        images = self.browser.all(".viewer img")
        return images[0].get_attribute("src") if images else ""

    def test_shows_that_a_target_is_missed(self):
        """In the list, and in the account of the error, which leaves out causes without a part."""
        job = self.daemon.rendered(example("transparency", accuracy={"target_error": 0.01, "samples": [1, 2]}))
        self.open("", lambda: self.browser.text(f'.rows tr[data-id="{job["id"]}"] .state') == "target missed", "the word")
        self.open(f"#/jobs/{job['id']}?tab=error")
        self.assertIn("The target of 0.01 is missed", self.browser.text(".sentence .missed"))
        self.assertEqual(len(self.browser.all(".tab .sub")), sum(job["report"]["error"]["parts"][name] > 0 for name in ("depth", "cutoff", "tone")))
        self.assertEqual(self.browser.execute_script("return document.querySelector('.viewer img').className"), "")  # it is fitted without steps


class Life(JobPage):
    def test_shows_a_running_job_and_cancels_it(self):
        """Acceptance test 19: the image changes before the end, with few requests."""
        job = self.daemon.start_job()
        self.open(f"#/jobs/{job}")
        self.expected.append("/preview")  # requested while the job is cancelled
        sources = set()
        begin = time.monotonic()
        self.browser.requests()
        self.browser.until(lambda: self.browser.all(".viewer img") and sources.add(self.browser.one(".viewer img").get_attribute("src")) or len(sources) >= 3, "three previews")
        requests = [url for _, url in self.browser.requests() if f"/v1/jobs/{job}" in url]
        seconds = time.monotonic() - begin
        self.assertLessEqual(len(requests), 3 * seconds + 3, requests)
        self.browser.button("Cancel").click()
        self.browser.click("Cancel it", lambda: self.browser.text(".bar .state") == "cancelled", "the end", "dialog[open]")

    def test_takes_away_nothing_that_is_typed_as_the_job_goes_on(self):
        job = self.daemon.start_job()
        self.open(f"#/jobs/{job}")
        field = self.browser.one("input.priority")
        field.send_keys(Keys.CONTROL, "a")
        field.send_keys("4")
        changed = "const main = document.querySelector('main').innerHTML; const before = window.before; window.before = main; return before !== undefined && before !== main"
        for _ in range(3):
            self.browser.until(lambda: self.browser.execute_script(changed), "progress")
        self.daemon.request("PATCH", f"/v1/jobs/{job}", {"priority": 33}, {"If-Match": "*"})
        self.browser.until(lambda: "33" in [each.text for each in self.browser.all(".facts-list dd")], "the priority of another user")
        field.send_keys("2", Keys.TAB)
        self.browser.until(lambda: self.daemon.job(job)["priority"] == 42, "the priority")
        self.assertEqual(field.get_attribute("value"), "42")
        self.daemon.request("POST", f"/v1/jobs/{job}/cancel")

    def test_reports_a_race_for_the_priority(self):
        """Acceptance test 24."""
        job = self.daemon.submit(scene(job=LATER))
        self.open(f"#/jobs/{job}")
        field = self.browser.one("input.priority")
        self.expected.append("412")
        self.daemon.request("PATCH", f"/v1/jobs/{job}", {"priority": 7}, {"If-Match": "*"})
        self.browser.execute_script("arguments[0].value = '70'; arguments[0].dispatchEvent(new Event('change', {bubbles: true}))", field)
        announced = self.browser.until(lambda: self.browser.text("[aria-live]"), "the race")
        self.assertRegex(announced, r"priority is 7, you set 70")
        self.assertEqual(self.daemon.job(job)["priority"], 7)

    def test_follows_what_others_do_to_the_job(self):
        job = self.daemon.submit(scene(name="shared", job=LATER))
        self.open(f"#/jobs/{job}", lambda: self.browser.text(".light") == "Live", "the stream")
        self.browser.click("Cancel", lambda: self.browser.all("dialog[open]"), "the question")
        self.daemon.request("POST", f"/v1/jobs/{job}/cancel")
        self.browser.until(lambda: not self.browser.all("dialog[open]"), "no question about a job that has ended")
        self.expected.append("404")
        self.daemon.request("DELETE", f"/v1/jobs/{job}")
        self.browser.until(lambda: self.browser.all(".empty h1") and not self.browser.all(".job"), "the page of no job")
        self.expected.append("400")
        self.open("#/jobs/50%", lambda: self.browser.all(".empty h1"), "the page of no job")

    def test_shows_why_a_job_failed(self):
        reply = self.daemon.request("POST", "/v1/jobs", scene(name="late", job={"deadline": "2020-01-01T00:00:00Z"}))
        job = json_of(reply)["id"]
        self.daemon.wait_for_state(job, "failed")
        self.open(f"#/jobs/{job}")
        self.assertIn("deadline_exceeded", self.browser.text(".note"))
        self.browser.click("Retry", lambda: self.daemon.job(job)["state"] == "succeeded", "the retry")
        self.browser.until(lambda: self.browser.all(".viewer img"), "the image")
        self.browser.button("History", ".tabs").click()
        moves = json_of(self.daemon.get(f"/v1/jobs/{job}/history"))["items"]
        expected = [[move["at"], move["state"], move["code"] or ""] for move in moves]
        self.browser.until(lambda: self.browser.execute_script(SCRIPTS + "return moves()") == expected, "the moves")
        self.assertIn("deadline_exceeded", [code for _, _, code in expected])

    def test_links_lead_to_the_line_that_needs_a_feature(self):
        """Acceptance test 23, for one example: the first need of the cost."""
        value = example("transparency")
        job = self.daemon.rendered({**value, "accuracy": {"samples": [1, 1]}})
        self.open(f"#/jobs/{job['id']}?tab=cost")
        link = self.browser.until(lambda: self.browser.all(".needs a"), "the needs")[0]
        pointer = link.text
        link.click()
        self.browser.until(lambda: self.browser.execute_script("return !!document.querySelector('.editor')?.shadowRoot?.querySelector('.cm-content')"), "the editor")
        for part in pointer.split("/")[1:]:
            value = value[int(part)] if isinstance(value, list) else value[part]
        def found():
            at, written = self.editor("return [view.state.selection.main.head, view.state.doc.toString()]")
            return at > 0 and json.JSONDecoder().raw_decode(written[at:])[0] == value
        self.browser.until(found, pointer)

    def test_the_document_is_shown_whole_in_an_editor_that_changes_nothing(self):
        """The document is larger than the 100,000 characters that were once shown."""
        document = example("tiny", accuracy={"samples": [1, 1]})
        document["objects"] += [{**document["objects"][0], "radius": 0.5 + index / 10_000} for index in range(800)]
        written = json.dumps(document, indent=2)
        self.assertGreater(len(written), 100_000)
        job = self.daemon.rendered(written.encode())
        self.open(f"#/jobs/{job['id']}?tab=document", lambda: self.browser.all(".document .editor"), "the editor")
        self.browser.until(lambda: self.browser.execute_script("return document.querySelector('.editor').shadowRoot?.querySelector('.cm-content')"), "its text").send_keys("x")
        self.assertEqual(self.editor("return view.state.doc.toString()"), written)
        scripts = self.browser.execute_script("return performance.getEntriesByType('resource').map((each) => each.name)")
        self.assertFalse([each for each in scripts if "schema" in each])

    def test_the_copied_commands_render_the_same_image(self):
        """Acceptance test 26, also for Python and the command line."""
        job = self.daemon.rendered(example("tiny", accuracy={"samples": [2, 2]}))
        self.open(f"#/jobs/{job['id']}?tab=document")
        self.browser.execute_script("Object.defineProperty(navigator, 'clipboard', {value: {writeText: async (text) => { window.copied = text; }}})")
        with urllib.request.urlopen(self.address(f"v1/jobs/{job['id']}/image.png")) as reply:
            image = reply.read()
        for name, program in (("curl", ["bash"]), ("Python", [sys.executable]), ("whittle command", ["bash"])):
            with self.subTest(name):
                self.browser.execute_script("window.copied = ''")
                self.browser.button(f"Copy as {name}").click()
                command = self.browser.until(lambda: self.browser.execute_script("return window.copied"), "the command")
                directory = temporary_directory(self)
                subprocess.run(program, input=command, text=True, check=True, cwd=directory,
                               env={**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}"})
                self.assertEqual((directory / "image.png").read_bytes(), image)


del JobPage  # only its subclasses have tests
