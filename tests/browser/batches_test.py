"""Batches: the list, a new sweep, the contact sheet by axes, the animation, failed jobs, cancel and remove."""
import itertools
import json

import numpy
from selenium.webdriver.common.action_chains import ActionChains

from tests.browser.browser import LATER, SCRIPTS, BrowserTest
from tests.http.animation_test import frames
from tests.http.daemon import json_of, scene
from tests.support.images import read_png
from tests.support.whittle import temporary_directory


class Batches(BrowserTest):
    def batch(self, batch_id):
        return json_of(self.daemon.get(f"/v1/batches/{batch_id}"))

    def submitted(self, **changes):
        return self.daemon.submit({"scene": scene(), **changes}, "/v1/batches")

    def ended(self, **changes):
        return self.daemon.finished_batch(**{"scene": scene(), **changes})["id"]

    def cells(self):
        """{index: state} of the cells that have a job."""
        return {int(each.get_attribute("data-index")): each.get_attribute("data-state") for each in self.browser.all(".cell[data-id]")}

    def fill(self, placeholder, value, last=False):
        field = self.browser.until(lambda: self.browser.all(f'input[placeholder="{placeholder}"]'), placeholder)[-1 if last else 0]
        field.clear()
        field.send_keys(value)

    def test_makes_a_sweep_and_shows_it_by_its_axes(self):
        """A part of acceptance test 38: 12 cells, each at the values of its row and column."""
        job = self.daemon.rendered(scene(64, 48, name="swept"))["id"]
        self.open(f"#/jobs/{job}")
        self.browser.button("Sweep").click()
        self.fill("/camera/fov", "/camera/fov")
        self.fill("30..60:5", "30..60:15")
        self.browser.button("Vary another value").click()
        self.fill("/camera/fov", "/image/width", last=True)
        self.fill("30..60:5", "40, 48, 56, 64", last=True)
        self.browser.until(lambda: self.browser.text("form [role=status]").startswith("12 images"), "the number of images")
        self.browser.execute_script("arguments[0].click(); arguments[0].click()", self.browser.button("Render 12"))
        self.browser.until(lambda: len(self.cells()) == 12, "12 cells")
        batch_id = self.browser.current_url.split("/batches/")[1]
        self.assertEqual(self.batch(batch_id)["name"], "swept")
        self.browser.until(lambda: set(self.cells().values()) == {"succeeded"}, "the end")
        self.browser.until(lambda: len(self.browser.all(".cell img")) == 12, "the images")
        columns = [json.loads(each.text) for each in self.browser.all(".axes thead th")]
        for row in self.browser.all(".axes tbody tr"):
            fov = json.loads(row.find_element("css selector", "th").text)
            for width, cell in zip(columns, row.find_elements("css selector", ".cell"), strict=True):
                values = self.daemon.job(cell.get_attribute("data-id"))["variation"]["values"]
                self.assertEqual(values, {"/camera/fov": fov, "/image/width": width})
        self.assertEqual([each["name"] for each in json_of(self.daemon.get("/v1/batches"))["items"]].count("swept"), 1)  # of two clicks
        previews = [url for _, url in self.browser.requests() if "/preview?max=" in url]
        self.assertGreaterEqual(len(previews), 12)
        total = sum(len(self.daemon.get(url.split(str(self.daemon.port))[1]).body) for url in set(previews))
        self.assertLessEqual(total, 400_000)

    def test_follows_retries_and_removes(self):
        """Acceptance test 38: one failed cell is retried alone."""
        late = {"deadline": "2020-01-01T00:00:00Z"}
        batch_id = self.ended(name="some late", frames=[{"job": late}, {"ambient": 0.1}, {"job": late}])
        self.open("#/batches")
        self.browser.one(f'tr[data-id="{batch_id}"] a').click()
        self.browser.until(lambda: self.cells() == {0: "failed", 1: "succeeded", 2: "failed"}, "the cells")
        self.assertIn("deadline", self.browser.text('.cell[data-index="0"] .reason'))
        self.browser.click("Retry", lambda: self.cells() == {0: "failed", 1: "succeeded", 2: "succeeded"}, "the retry", '.cell[data-index="2"]')
        self.browser.until(lambda: len(self.browser.all(".cell img")) == 2, "its image")
        self.browser.click("Retry what failed", lambda: set(self.cells().values()) == {"succeeded"}, "the rest")
        self.browser.button("Remove").click()
        self.browser.click("Remove them", lambda: self.browser.current_url.endswith("#/batches"), "the list", "dialog[open]")
        self.browser.until(lambda: self.browser.all("h1") and not self.browser.all(f'tr[data-id="{batch_id}"]'), "without it")
        self.assertEqual(self.daemon.get(f"/v1/batches/{batch_id}").status, 404)

    def shown(self):
        return int(self.browser.execute_script("return document.querySelector('.player canvas')?.dataset.shown ?? -1"))

    def test_plays_and_downloads_the_animation(self):
        """Acceptance tests 39 and 40 through the page; images of two sizes are refused in words."""
        directory = temporary_directory(self)
        self.browser.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(directory)})
        batch_id = self.ended(name="turn", scene=scene(64, 48), frames=[{"camera": {"fov": 30 + index}} for index in range(24)])
        self.open(f"#/batches/{batch_id}")
        self.browser.click("Animation", lambda: self.browser.text(".player .number") == "1 / 24", "the first image")
        self.browser.one(".player button[aria-label^=Next]").click()
        ActionChains(self.browser).send_keys(" ").perform()  # presses the button, which has the focus
        self.browser.until(lambda: self.browser.text(".player .number") == "3 / 24", "the third image")
        for label, place in (("Last", 23), ("First", 0), ("Middle", 11)):
            self.browser.click(label, lambda place=place: self.shown() == place, label, ".player")
        ActionChains(self.browser).send_keys(".").send_keys(".").send_keys(",").perform()
        self.browser.until(lambda: self.shown() == 12, "steps by key")
        self.browser.execute_script(SCRIPTS + "recordFrames()")
        self.browser.click("Play", lambda: len(self.browser.execute_script("return seen")) >= 20, "a turn", ".player")
        self.browser.button("Pause", ".player").click()
        steps = [(b - a) % 24 for a, b in itertools.pairwise([12, *self.browser.execute_script("return seen")])]
        self.assertGreaterEqual(min(steps), 1)
        self.assertLessEqual(sum(step - 1 for step in steps), int(self.browser.one(".player canvas").get_attribute("data-dropped")))
        self.browser.click("Download animation", (directory / "turn.apng").exists, "the file")
        found = frames((directory / "turn.apng").read_bytes())
        jobs = json_of(self.daemon.get(f"/v1/jobs?batch={batch_id}&limit=200"))["items"][::-1]
        exact = [read_png(self.daemon.get(f"/v1/jobs/{job['id']}/image.png").body) for job in jobs]
        for (_, png), image in zip(found, exact, strict=True):
            numpy.testing.assert_array_equal(read_png(png), image)
        place, drawn = self.browser.execute_script("const canvas = document.querySelector('.player canvas'); return [canvas.dataset.shown, [...canvas.getContext('2d').getImageData(0, 0, 64, 48).data]]")
        numpy.testing.assert_array_equal(numpy.array(drawn).reshape(48, 64, 4)[:, :, :3], exact[int(place)])
        sizes = self.ended(sweep={"/image/width": [16, 24]})
        self.open(f"#/batches/{sizes}")
        self.expected.append("409")
        self.browser.click("Download animation", lambda: "images of one size" in self.browser.text("[aria-live]"), "the refusal")
        self.assertIn("-framerate 24 ", self.browser.button("Copy as ffmpeg command").get_attribute("title"))

    def test_rings_when_the_last_job_ends(self):
        batch_id = self.submitted(name="rings", scene=scene(job=LATER), frames=[{}, {}])
        self.open(f"#/batches/{batch_id}")
        self.browser.one(".bell").click()
        self.browser.until(lambda: self.browser.one(".bell").get_attribute("aria-pressed") == "true", "the bell")
        jobs = [job["id"] for job in json_of(self.daemon.get(f"/v1/jobs?batch={batch_id}"))["items"]]
        before = self.reads(batch_id)
        self.daemon.request("POST", f"/v1/jobs/{jobs[0]}/cancel")
        self.browser.until(lambda: "cancelled" in self.cells().values(), "the first one")
        self.browser.until(lambda: self.reads(batch_id) >= before + 2, "the batch, read for the page and for the bell")
        self.browser.until(lambda: "cancelled" in self.browser.text(".shares"), "what the page has read")
        self.assertEqual(self.browser.text("[aria-live]"), "")
        self.browser.button("Cancel").click()
        self.assertIn("Cancel 1 job?", self.browser.text("dialog[open] h2"))
        self.daemon.request("POST", f"/v1/jobs/{jobs[1]}/cancel")
        self.browser.until(lambda: self.browser.text("[aria-live]").startswith("rings: cancelled"), "the end")
        self.assertTrue(self.browser.one("[aria-live] a").get_attribute("href").endswith(f"#/batches/{batch_id}"))
        self.assertEqual(self.browser.execute_script("return localStorage.getItem('whittle.bells')"), "[]")
        self.browser.until(lambda: not self.browser.all("dialog[open]"), "no question about a batch that has ended")

    def reads(self, batch_id):
        """The number of reads of the batch over HTTP."""
        return sum(row["event"] == "request" and row["path"] == f"/v1/batches/{batch_id}" for row in self.daemon.log_rows())

    def wait_for_name(self, name):
        """Until the playground has a document of this name."""
        self.browser.until(lambda: self.browser.execute_script("return document.querySelector('.canvas img') && document.querySelector('.editor')?.shadowRoot?.querySelector('.cm-content')")
                           and f'"name": "{name}"' in self.editor("return view.state.doc.toString()"), name)

    def test_takes_the_text_of_the_playground(self):
        """A text stays as the page is left, and is the scene of a sweep and of one job, whose button is clicked twice."""
        self.open("#/new")
        self.wait_for_name("shapes")
        self.editor("view.dispatch({changes: {from: view.state.doc.toString().indexOf('shapes') + 6, insert: '!'}})")
        self.browser.execute_script("location.hash = '#/'")
        self.browser.one(".empty, .rows")
        self.browser.back()
        self.wait_for_name("shapes!")
        self.browser.click("Sweep", lambda: self.browser.text(".batch-form strong") == "shapes!", "the scene of the sweep")
        self.browser.back()
        self.wait_for_name("shapes!")
        self.browser.execute_script("arguments[0].click(); arguments[0].click()", self.browser.button("Render"))
        self.browser.until(lambda: "#/jobs/" in self.browser.current_url, "the job")
        self.assertEqual(len(json_of(self.daemon.get("/v1/jobs?q=shapes!"))["items"]), 1)

    def test_cancels_what_waits(self):
        batch_id = self.submitted(name="waits", scene=scene(job=LATER), sweep={"/camera/fov": [30, 40], "/ambient": [0, 0.1], "/image/width": [8, 16, 24]})
        self.open(f"#/batches/{batch_id}", lambda: set(self.cells()) == set(range(6)), "the first of the fields of view")
        self.browser.execute_script("const axis = document.querySelector('.batch select'); axis.value = 1; axis.dispatchEvent(new Event('change', {bubbles: true}))")
        self.browser.until(lambda: set(self.cells()) == set(range(6, 12)), "the other one")
        self.browser.button("Cancel").click()
        self.assertIn("Cancel 12 jobs?", self.browser.text("dialog[open] h2"))
        self.browser.click("Cancel them", lambda: set(self.cells().values()) == {"cancelled"}, "the end", "dialog[open]")
        self.assertEqual(self.batch(batch_id)["state"], "cancelled")

    def test_explains_what_is_wrong_with_a_sweep(self):
        job = self.daemon.submit(scene())
        self.open(f"#/batches/new?job={job}")
        self.fill("/camera/fov", "/camera/fov")
        self.fill("30..60:5", "-5, 40")
        self.expected.append("422")
        self.browser.button("Render 2").click()
        self.assertIn("fov", self.browser.text("form .needs"))

    def test_shows_few_cells_of_many_jobs(self):
        """2,500 jobs in rows and columns, and 450 in sequence: what is in view exists."""
        many = {"sweep": {"/camera/fov": list(range(20, 70)), "/image/width": list(range(8, 58))}}, {"frames": [{"ambient": index / 450} for index in range(450)]}
        for changes, last in zip(many, (2499, 449), strict=True):
            batch_id = self.submitted(scene=scene(job=LATER), **changes)
            self.open(f"#/batches/{batch_id}", lambda: len(self.browser.all(".cell")) > 20, "cells")
            self.assertLessEqual(len(self.browser.all(".cell")), 100)
            self.browser.execute_script(SCRIPTS + "scrollToLastCell()")
            self.browser.until(lambda last=last: self.cells().get(last) == "queued" and 0 not in self.cells(), "the last cell")
            self.assertLessEqual(len(self.browser.all(".cell")), 100)
            self.daemon.request("POST", f"/v1/batches/{batch_id}/cancel")
