"""The system page: the state in words, the last hour, limits against use."""
import contextlib
import json
import signal
import sqlite3
import unittest

from tests.browser.browser import Browser, BrowserTest
from tests.http.daemon import Daemon, json_of, long_scene, scene
from tests.http.full_disk_test import Disk, may_mount
from tests.support.sources import text


class System(BrowserTest):
    def test_shows_that_jobs_run_and_what_is_used(self):
        self.daemon.wait_for_end(self.daemon.submit(scene()))
        for _ in range(3):
            self.daemon.submit(scene(job={"run_after": "2099-01-01T00:00:00Z"}))
        self.open("#/system")
        self.browser.until(lambda: "Ready" in self.browser.text(".health"), "the state")
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

    @unittest.skipUnless(may_mount(), "no tmpfs can be mounted here")
    def test_shows_that_the_disk_is_full_and_that_the_service_stops(self):
        """Acceptance test 41."""
        with Disk("64m") as disk, Daemon("--jobs", "1", data=disk.data) as daemon:
            self.opened(daemon)
            for step, shown in ((disk.fill, "Disk full"), (disk.make_room, "Idle")):
                step()
                self.browser.until(lambda shown=shown: self.header().startswith(shown), shown)
                if shown == "Disk full":
                    self.assertRegex(self.header(), r"free, new jobs are refused below .*Remove jobs")
            daemon.wait_for_state(daemon.submit(long_scene()), "running")
            daemon.process.send_signal(signal.SIGTERM)
            self.browser.until(lambda: self.header().startswith("Stopping Running jobs end"), "the word while the daemon drains")

    def opened(self, daemon):
        self.browser = Browser()
        self.addCleanup(self.browser.quit)
        self.browser.get(f"http://127.0.0.1:{daemon.port}/#/")
        self.browser.until(lambda: self.header() == "Idle", "the word")

    def test_shows_that_the_queue_is_full_and_that_nothing_can_be_stored(self):
        with Daemon("--queued-jobs", "2") as daemon:
            self.opened(daemon)
            jobs = [daemon.submit(scene(job={"run_after": "2099-01-01T00:00:00Z"})) for _ in range(2)]
            self.assertEqual(daemon.request("POST", "/v1/jobs", scene()).status, 503)
            self.browser.until(lambda: self.header().startswith("Queue full New jobs are refused"), "that the queue is full")
            for job in jobs:
                daemon.request("POST", f"/v1/jobs/{job}/cancel")
            self.browser.until(lambda: self.header() == "Idle", "the end of that")
            with contextlib.closing(sqlite3.connect(daemon.data / "whittle.db", isolation_level=None)) as other:
                other.execute("BEGIN IMMEDIATE")  # no one else writes now
                self.browser.until(lambda: self.header().startswith("Store down Jobs cannot be stored"), "that the store is down")
            self.browser.until(lambda: self.header() == "Idle", "the store")


if __name__ == "__main__":
    unittest.main()
