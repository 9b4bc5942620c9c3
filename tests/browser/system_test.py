"""The system page: the state in words, the last hour, limits against use."""
import json
import unittest

from tests.browser.browser import BrowserTest
from tests.http.daemon import json_of, scene
from tests.support.sources import text


class System(BrowserTest):
    def test_says_that_jobs_run_and_what_is_used(self):
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
        """A part of acceptance test 42: the page shows what /v1/status says."""
        self.open("#/system")
        status = json_of(self.daemon.get("/v1/status"))
        shown = self.browser.text(".system")
        self.assertIn(str(status["workers"][0]["pid"]), shown)
        self.assertIn(status["version"]["build"], shown)
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


if __name__ == "__main__":
    unittest.main()
