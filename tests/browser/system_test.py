"""The system page: the state in words, the last hour, limits against use."""
import contextlib
import json
import sqlite3
import unittest

from tests.browser.browser import LATER, Browser, BrowserTest
from tests.http.daemon import Daemon, json_of, scene
from tests.support.sources import text


class System(BrowserTest):
    def test_shows_that_jobs_run_and_what_is_used(self):
        self.daemon.wait_for_end(self.daemon.submit(scene()))
        for _ in range(3):
            self.daemon.submit(scene(job=LATER))
        self.open("#/system", lambda: "Ready" in self.browser.text(".health"), "the state")
        self.assertIn("free", self.browser.text(".health"))
        rows = {row.text.split("\n")[0].rsplit(" of ")[0] for row in self.browser.all(".columns tr")}
        self.assertIn("Queued jobs 3", rows)
        self.assertEqual(len(self.browser.all(".plot canvas")), 4)

    def test_shows_the_numbers_of_the_service(self):
        """A part of acceptance test 42: the page shows the figures of /v1/status."""
        self.open("#/system")
        status = json_of(self.daemon.get("/v1/status"))
        shown = self.browser.text(".system")
        self.assertIn(str(status["workers"][0]["pid"]), shown)
        self.assertIn(status["version"]["build"], shown)
        (node,) = json_of(self.daemon.get("/v1/nodes"))["items"]
        row = self.browser.until(lambda: self.browser.all(".columns .panel:first-child tbody tr"), "the node")[0].text
        self.assertTrue(row.startswith(f"{node['name']} {node['role']} {node['running']} / {node['slots']} {node['version']} "), row)
        self.browser.one("summary").click()
        names = {each.text for each in self.browser.all("details code")}
        self.assertEqual(names, set(status["limits"]))

    def test_links_to_licences_and_documentation(self):
        self.open("#/system")
        links = {each.get_attribute("href").split("/", 3)[3] for each in self.browser.until(lambda: self.browser.all(".columns a"), "links")}
        self.assertLessEqual({"docs", "openapi.json"}, links)
        licences = next(link for link in links if link.endswith("licences.txt"))
        body = self.daemon.get("/" + licences).body.decode()
        for name in json.loads(text("server/web/package.json"))["dependencies"]:
            self.assertIn(f"{name} ", body)


class Header(unittest.TestCase):
    """The word in the header, and the sentence beside it."""

    def header(self):
        return self.browser.text(".service")

    def test_shows_that_the_queue_is_full_and_that_nothing_can_be_stored(self):
        """Acceptance test 41; modules.test.js has a full disk and a service that stops."""
        with Daemon("--queued-jobs", "2") as daemon, Browser() as self.browser:
            self.browser.get(f"http://127.0.0.1:{daemon.port}/#/system")  # without examples, whose images are jobs
            self.browser.until(lambda: self.header() == "Idle", "the word")
            jobs = [daemon.submit(scene(job=LATER)) for _ in range(2)]
            self.assertEqual(daemon.request("POST", "/v1/jobs", scene()).status, 503)
            self.browser.until(lambda: self.header().startswith("Queue full New jobs are refused"), "that the queue is full")
            for job in jobs:
                daemon.request("POST", f"/v1/jobs/{job}/cancel")
            self.browser.until(lambda: self.header() == "Idle", "the end of that")
            with contextlib.closing(sqlite3.connect(daemon.data / "whittle.db", isolation_level=None)) as other:
                other.execute("BEGIN IMMEDIATE")  # no one else writes now
                self.browser.until(lambda: self.header().startswith("Store down Jobs cannot be stored"), "that the store is down")
            self.browser.until(lambda: self.header() == "Idle", "the store")
