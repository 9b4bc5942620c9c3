"""The queue: rows, filters, selection, events, lost connections, keys of users."""
import json
import signal
import time
import unittest

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from tests.browser.browser import LATER, SCRIPTS, Browser, BrowserTest
from tests.http.daemon import Daemon, json_of, scene
from tests.http.keys_test import bearer, new_key
from tests.support.whittle import temporary_directory


class Queue(BrowserTest):
    def setUp(self):
        super().setUp()
        self.daemon.request("POST", "/v1/jobs/bulk", {"action": "cancel", "filter": {"created_after": "2020-01-01T00:00:00Z"}})
        self.daemon.request("POST", "/v1/jobs/bulk", {"action": "remove", "filter": {"created_after": "2020-01-01T00:00:00Z"}})

    def names(self):
        return self.browser.execute_script("return [...document.querySelectorAll('.rows .c-name a')].map((each) => each.textContent)")

    def state_of(self, job_id):
        row = self.browser.all(f'.rows tr[data-id="{job_id}"] .state')
        return row[0].text if row else None

    def counts(self):
        return {each.text.split()[0]: int(each.text.split()[1].replace(",", "")) for each in self.browser.all(".count") if len(each.text.split()) == 2}

    def submit_many(self, count, **changes):
        frames = [{"name": f"frame {index}"} for index in range(count)]
        return f"#/?batch={self.daemon.submit({'scene': scene(job=LATER, **changes), 'frames': frames}, '/v1/batches')}"

    def test_shows_examples_at_first(self):
        """Images that the service renders, in no list of jobs. One opens the playground with its text."""
        self.open()
        self.assertIn("No jobs yet", self.browser.text(".empty"))
        self.browser.until(lambda: len(self.browser.all(".gallery img")) == len(self.browser.all(".gallery a")) == 8, "the images")
        self.assertEqual(json_of(self.daemon.get("/v1/jobs"))["items"], [])
        self.browser.button("Torus", ".gallery").click()
        self.browser.until(lambda: '"torus"' in self.browser.execute_script(SCRIPTS + "return editorText()"), "the example in the playground")

    def test_shows_a_batch_as_one_row_and_returns_to_it(self):
        jobs = [self.daemon.submit(scene(name=f"alone {index}")) for index in range(40)]
        batch = json_of(self.daemon.request("POST", "/v1/batches", {"name": "swept", "scene": scene(), "sweep": {"/camera/fov": [30, 40, 50], "/ambient": [0, 0.1]}}))["id"]
        self.daemon.submit(scene(name="last"))
        self.open("", lambda: self.names()[:3] == ["last", "swept", "alone 39"] and self.state_of(batch) == "succeeded", "rows")
        self.assertEqual([each.text for each in self.browser.all(f'tr[data-id="{batch}"] .chip')], ["6 images", "camera/fov 30 … 50", "ambient 0, 0.1"])
        self.browser.until(lambda: self.browser.all(f'tr[data-id="{batch}"] img.thumb'), "its image")
        for job in (jobs[22], batch):
            self.browser.execute_script("document.querySelector('.rows').scrollTop = 0")
            link = self.browser.one(f'tr[data-id="{job}"] a')
            self.browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", link)
            top = self.browser.execute_script("return document.querySelector('.rows').scrollTop")
            link.send_keys(Keys.ENTER)
            self.browser.until(lambda job=job: job in self.browser.current_url and self.browser.all("main h1"), "its page")
            self.browser.back()
            self.browser.until(lambda job=job: self.browser.execute_script("return document.activeElement.closest('tr')?.dataset.id") == job, "the focus as it was")
            self.assertEqual(self.browser.execute_script("return document.querySelector('.rows').scrollTop"), top)
        self.browser.one(f'tr[data-id="{batch}"] input').click()
        self.browser.button("Remove", ".bulk").click()
        self.assertIn("Remove 6 jobs", self.browser.text("dialog[open] h2"))
        self.browser.click("Remove them", lambda: "swept" not in self.names(), "the list without it", "dialog[open]")

    def test_follows_jobs_to_their_end(self):
        self.open("", lambda: self.browser.text(".light") == "Live", "the stream")
        job = self.daemon.submit(scene(64, 48, name="followed"))
        self.browser.until(lambda: self.state_of(job) == "succeeded", "the job")
        self.browser.until(lambda: self.browser.all(f'.rows tr[data-id="{job}"] img.thumb'), "its image")
        self.browser.until(lambda: "level" in self.browser.text(f'.rows tr[data-id="{job}"] .c-error'), "its error")
        self.browser.until(lambda: self.counts().get("succeeded") == 1, "the count")

    def test_shows_few_rows_of_many_jobs(self):
        """Acceptance test 13 with 2,000 jobs."""
        self.open(self.submit_many(2000), lambda: len(self.names()) > 10, "rows")
        self.assertEqual(self.names()[0], "frame 1999")
        def scrolled_to_the_end():
            self.browser.execute_script("const box = document.querySelector('.rows'); box.scrollTop = box.scrollHeight;")
            self.assertLessEqual(len(self.browser.all(".rows tbody tr[data-id]")), 60)
            return "frame 0" in self.names()
        self.browser.until(scrolled_to_the_end, "the last row")

    def test_counts_many_submissions_with_few_requests(self):
        """Acceptance test 14."""
        self.open("", lambda: self.browser.text(".light") == "Live", "the stream")
        begin = time.monotonic()
        self.browser.requests()
        for _ in range(4):
            self.submit_many(250)
        self.browser.until(lambda: self.counts().get("queued") == 1000, "the count")
        self.browser.until(lambda: self.names(), "rows")
        lists = [url for method, url in self.browser.requests() if method == "GET" and "/v1/jobs?" in url and "limit=200" in url]
        self.assertLessEqual(len(lists), 5 + (time.monotonic() - begin), "once a second at most, and a few pages")

    def test_filters_and_searches(self):
        self.submit_many(3)
        done = self.daemon.rendered(scene(name="needle"))["id"]
        self.open("#/?state=succeeded", lambda: self.names() == ["needle"], "one row")
        self.open("#/", lambda: self.names() == ["needle", "untitled"], "rows, of which one is the batch")
        ActionChains(self.browser).send_keys("/").send_keys("FRAME 1").perform()
        self.browser.until(lambda: self.names() == ["frame 1"], "the found row")
        self.assertIn("q=FRAME", self.browser.current_url)
        self.browser.get(self.address("#/?q=nothing"))
        self.browser.until(lambda: "No job matches" in self.browser.text(".empty"), "the hint")

    def test_cancels_what_is_selected(self):
        """Acceptance test 17 with fewer jobs: the dry run is shown, what ended meanwhile is counted."""
        self.open(self.submit_many(30), lambda: len(self.names()) == 30 or len(self.names()) > 15, "rows")
        boxes = self.browser.all(".rows .c-check input")
        boxes[0].click()
        ActionChains(self.browser).key_down(Keys.SHIFT).click(boxes[9]).key_up(Keys.SHIFT).perform()
        self.assertEqual(self.browser.text(".bulk strong"), "10 selected")
        self.browser.button("Cancel", ".bulk").click()
        self.assertIn("Cancel 10 jobs?", self.browser.text("dialog[open] h2"))
        first = self.browser.all(".rows tbody tr[data-id]")[0].get_attribute("data-id")
        self.daemon.request("POST", f"/v1/jobs/{first}/cancel")
        self.browser.click("Cancel them", lambda: "9 done, 1 refused" in self.browser.text("[aria-live]"), "the outcome", "dialog[open]")
        self.browser.until(lambda: self.counts().get("cancelled") == 10, "the count")
        self.browser.until(lambda: self.selected() == [first], "the refused one, still selected")
        self.browser.all(".rows .c-check input")[12].click()
        toast, bar = (self.browser.one(each).rect for each in (".toast", ".bulk"))
        self.assertLessEqual(toast["y"] + toast["height"], bar["y"])  # no button is covered

    def selected(self):
        return self.browser.execute_script("return [...document.querySelectorAll('.rows tr[aria-selected=true]')].map((each) => each.dataset.id)")

    def test_cancels_everything_that_matches(self):
        """Acceptance test 17: 500 of 3,412 in one request, more than the page has read."""
        self.submit_many(2912)
        self.daemon.request("POST", "/v1/batches", {"scene": scene(job=LATER), "frames": [{"name": f"needle {index}"} for index in range(500)]})
        self.open("#/?q=needle", lambda: len(self.names()) > 15, "rows")
        self.browser.all(".rows .c-check input")[0].click()
        self.browser.button("All that match", ".bulk").click()
        self.assertEqual(self.browser.text(".bulk strong"), "All that match")
        self.browser.all(".rows .c-check input")[1].click()
        self.assertEqual(self.browser.text(".bulk strong"), "2 selected")  # a changed selection is meant as it is
        self.browser.button("All that match", ".bulk").click()
        self.browser.button("Cancel", ".bulk").click()
        self.assertIn("Cancel 500 jobs?", self.browser.text("dialog[open] h2"))
        ended = {row.get_attribute("data-id") for row in self.browser.all(".rows tbody tr[data-id]")[:3]}
        for job in ended:
            self.daemon.request("POST", f"/v1/jobs/{job}/cancel")
        self.browser.requests()
        self.browser.click("Cancel them", lambda: "497 done, 3 refused" in self.browser.text("[aria-live]"), "the outcome", "dialog[open]")
        self.assertEqual([method for method, url in self.browser.requests() if url.endswith("/bulk")], ["POST"])
        self.browser.until(lambda: set(self.selected()) == ended, "the refused ones, still selected")
        self.assertEqual(json_of(self.daemon.get("/v1/queue"))["jobs"]["queued"], 2912)

    def test_announces_the_end_of_a_job_once_over_two_tabs(self):
        """Acceptance test 18, and a job that ends while no tab is open."""
        jobs = [self.daemon.submit(scene(name=f"rings {index}", job=LATER)) for index in range(2)]
        self.open(f"#/jobs/{jobs[0]}")
        self.browser.one(".bell").click()
        first = self.browser.current_window_handle
        self.browser.switch_to.new_window("tab")
        self.browser.get(self.address(f"#/jobs/{jobs[1]}"))
        self.browser.until(lambda: self.browser.text(".light") == "Live", "the stream")
        self.browser.execute_script(SCRIPTS + "recordAnnounced()")
        self.daemon.request("POST", f"/v1/jobs/{jobs[0]}/cancel")
        self.browser.until(lambda: self.browser.text("[aria-live]").startswith("rings 0: cancelled"), "the visible tab")
        self.assertTrue(self.browser.one("[aria-live] a").get_attribute("href").endswith(f"#/jobs/{jobs[0]}"))
        self.browser.one(".bell").click()
        self.browser.until(lambda: jobs[1] in self.browser.execute_script("return localStorage.getItem('whittle.bells')"), "the other bell")
        self.assertEqual(len(set(self.browser.execute_script("return announced"))), 1)
        self.browser.close()
        self.browser.switch_to.window(first)
        self.assertEqual(self.browser.text("[aria-live]"), "")
        self.browser.get("about:blank")
        self.daemon.request("POST", f"/v1/jobs/{jobs[1]}/cancel")
        self.browser.get(self.address("#/"))
        self.browser.until(lambda: self.browser.text("[aria-live]").startswith("rings 1: cancelled"), "the end that was missed")


class Connection(BrowserTest):
    expected_errors = ("net::ERR_",)

    def test_shows_that_the_service_is_gone_and_returns(self):
        """Acceptance test 15."""
        self.open("#/", lambda: self.browser.text(".light") == "Live", "the stream")
        port = self.daemon.port
        self.daemon.kill()
        self.browser.until(lambda: self.browser.text(".light") == "No connection", "the light")
        self.assertTrue(self.browser.text(".service").startswith("Unreachable The service does not answer"))
        self.assertEqual(self.browser.all(".top dl"), [])
        self.daemon.listen = f"127.0.0.1:{port}"
        self.daemon.start()
        job = self.daemon.submit(scene(name="after the restart"))
        self.browser.until(lambda: self.browser.all(f'.rows tr[data-id="{job}"]'), "the new job")
        self.browser.until(lambda: self.browser.text(".service") == "Idle", "the word")

    def test_has_one_stream_for_all_tabs(self):
        """Acceptance test 16."""
        self.open("#/")
        handle = self.browser.current_window_handle
        for _ in range(7):
            self.browser.switch_to.new_window("tab")
            self.browser.get(self.address("#/"))
            self.browser.until(lambda: self.browser.text(".light") == "Live", "the stream")
        metrics = self.daemon.health("/metrics").body.decode()
        self.assertIn("whittle_event_listeners 1\n", metrics)
        for other in self.browser.window_handles:
            if other != handle:
                self.browser.switch_to.window(other)
                self.browser.close()
        self.browser.switch_to.window(handle)


class OwnStreams(BrowserTest):
    """Browsers without SharedWorker, such as those of Android."""

    def test_load_a_seventh_tab_as_hidden_ones_let_go(self):
        """Acceptance test 16."""
        self.browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": "delete window.SharedWorker"})
        self.browser.get(self.address("#/"))
        first = self.browser.current_window_handle
        for _ in range(7):
            self.browser.switch_to.new_window("tab")
            self.browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": "delete window.SharedWorker"})
            self.browser.get(self.address("#/"))
            self.assertEqual(self.browser.execute_script("return typeof SharedWorker"), "undefined")
            self.browser.until(lambda: self.browser.text(".light") == "Live", "the stream")
        job = self.daemon.submit(scene(name="in the last tab"))
        self.browser.until(lambda: self.browser.all(f'.rows tr[data-id="{job}"]'), "the job")
        self.browser.until(lambda: "whittle_event_listeners 1\n" in self.daemon.health("/metrics").body.decode(), "one stream, of the visible tab")
        self.browser.switch_to.window(first)
        self.browser.execute_cdp_cmd("Page.bringToFront", {})
        self.browser.until(lambda: self.browser.all(f'.rows tr[data-id="{job}"]'), "the job in the first tab")
        self.browser.until(lambda: self.browser.text(".light") == "Live", "its stream")


class ApiKeys(unittest.TestCase):
    """Acceptance tests 9 and 10."""

    def setUp(self):
        self.file = temporary_directory(self) / "keys"
        self.keys = {}
        for name, scopes in (("ann", "jobs:read,jobs:write"), ("bob", "jobs:read")):
            self.keys[name] = new_key(self.file, name, scopes)
        self.daemon = self.enterContext(Daemon("--keys", str(self.file)))
        self.daemon.allowed = bearer(self.keys["ann"])
        self.browser = self.enterContext(Browser())

    def open(self, route="#/"):
        self.browser.get(f"http://127.0.0.1:{self.daemon.port}/{route}")

    def enter(self, key):
        field = self.browser.one("dialog[open] input[type=password]")
        field.clear()
        field.send_keys(key, Keys.ENTER)

    def test_are_requested_once_and_stay_in_the_tab(self):
        self.open()
        self.browser.one("dialog[open] input[type=password]")
        requests = [url for _, url in self.browser.requests() if "/v1/" in url and not url.endswith("/v1/me")]
        self.assertEqual(requests, [])
        self.enter("wrong")
        self.browser.until(lambda: "not valid" in self.browser.text("dialog[open]"), "the refusal")
        self.enter(self.keys["ann"])
        self.browser.until(lambda: self.browser.text(".light") == "Live", "the stream")
        self.assertIn("ann", self.browser.text("header"))
        stored = "return JSON.stringify({...localStorage}) + location.href"
        self.assertNotIn(self.keys["ann"], self.browser.execute_script(stored))
        sent = [json.loads(entry["message"])["message"] for entry in self.browser.get_log("performance")]
        sent = [each["params"]["request"] for each in sent if each["method"] == "Network.requestWillBeSent"]
        self.assertTrue(sent)
        for request in sent:
            headers = [value for name, value in request["headers"].items() if name.lower() != "authorization"]
            self.assertNotIn(self.keys["ann"], " ".join([request["url"], *headers]))
        self.browser.execute_script("sessionStorage.clear()")
        self.browser.refresh()
        self.browser.one("dialog[open] input[type=checkbox]").click()
        self.enter(self.keys["ann"])
        self.browser.until(lambda: self.browser.text(".light") == "Live", "the stream")
        self.assertIn(self.keys["ann"], self.browser.execute_script(stored))
        self.assertNotIn(self.keys["ann"], self.daemon.log())

    def test_that_are_removed_are_requested_again_and_the_text_stays(self):
        self.open("#/new")
        self.enter(self.keys["ann"])
        self.browser.until(lambda: self.browser.all(".canvas img"), "the draft")
        self.browser.until(lambda: self.browser.text(".light") == "Live", "the stream")
        before = self.browser.execute_script("return document.querySelector('.editor').shadowRoot.querySelector('.cm-content').textContent")
        self.file.unlink()
        other = new_key(self.file, "cy", "jobs:read,jobs:write")
        self.daemon.process.send_signal(signal.SIGHUP)
        self.browser.until(lambda: self.browser.all("dialog[open] input[type=password]"), "the dialog")
        self.enter(other)
        self.browser.until(lambda: "cy" in self.browser.text("header") and self.browser.text(".light") == "Live", "the new key")
        after = self.browser.execute_script("return document.querySelector('.editor').shadowRoot.querySelector('.cm-content').textContent")
        self.assertEqual(after, before)

    def test_are_not_needed_by_the_browser_to_save_a_large_file(self):
        """The page gets a ticket for it, and the file is never in its memory."""
        directory = temporary_directory(self)
        output = {"formats": ["png", "exr"], "layers": ["depth", "normal", "albedo", "object_id"], "half": False}
        batch = self.daemon.finished_batch(name="large", scene=scene(1200, 900, output=output), frames=[{"ambient": index / 10} for index in range(4)])["id"]
        tar = self.daemon.request("GET", f"/v1/batches/{batch}/artifacts.tar", None, bearer(self.keys["bob"])).body
        self.assertGreater(len(tar), 8_000_000)
        self.open(f"#/batches/{batch}")
        self.enter(self.keys["bob"])
        self.browser.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(directory)})
        self.browser.click("Download all", (directory / f"{batch}.tar").exists, "the file")
        self.browser.until(lambda: (directory / f"{batch}.tar").stat().st_size == len(tar), "all of it")
        self.assertEqual((directory / f"{batch}.tar").read_bytes(), tar)
        self.assertIn("/v1/tickets", " ".join(url for method, url in self.browser.requests() if method == "POST"))

    def test_that_may_only_read_see_no_controls(self):
        """Acceptance test 9: nothing in any view changes anything."""
        later = scene(job=LATER)
        jobs = [self.daemon.rendered(scene())["id"], self.daemon.submit(later)]
        measured = self.daemon.submit({"scene": scene(), "settings": {"parameters": ["samples"], "reference_samples": 16}}, "/v1/measure")
        batch = self.daemon.submit({"scene": later, "frames": [{}, {}]}, "/v1/batches")
        self.daemon.wait_for_end(measured)
        self.open()
        self.enter(self.keys["bob"])
        self.browser.until(lambda: self.browser.all(f'.rows tr[data-id="{jobs[0]}"]'), "the job")
        self.assertIn("read only", self.browser.text("header"))
        views = {"#/": ".rows tbody a", **{f"#/jobs/{job}?tab={tab}": ".tab" for job in jobs for tab in ("image", "error", "document", "webhooks")}, "#/new": ".editor",
                 f"#/compare?a={jobs[0]}": ".choices, .empty", f"#/compare?a={jobs[0]}&b={jobs[0]}": ".verdict", f"#/measure/{measured}": ".tradeoff g",
                 "#/batches": ".batch-list a", f"#/batches/{batch}": ".cell[data-id]", "#/batches/new": ".empty, .batch-list", "#/system": ".health"}
        for view, shown in views.items():
            with self.subTest(view):
                self.browser.execute_script("location.hash = '#/nothing'")
                self.browser.until(lambda: "#/nothing" in self.browser.current_url and not self.browser.all("main > .visually-hidden"), "another page")
                self.browser.execute_script("location.hash = arguments[0]", view)
                self.browser.one(shown)
                self.assertEqual(self.browser.all("main input[type=checkbox], main input[type=file], main input.priority, main form, main .danger, main .primary"), [])
                buttons = {each.text.strip() for each in self.browser.all("main button, main a.button")}
                self.assertEqual(buttons & {"Cancel", "Retry", "Remove", "Measure", "Sweep", "Render", "Render with it", "New batch", "Send again", "Retry what failed"}, set())
        changes = [(method, url) for method, url in self.browser.requests() if method not in ("GET", "HEAD")]
        self.assertEqual(changes, [])
