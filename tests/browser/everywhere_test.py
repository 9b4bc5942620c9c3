"""What holds for every view: accessibility, narrow screens, sizes, no other host."""
import json
import os
import subprocess
import sys
import time
import unittest

from tests.browser.browser import Browser, BrowserTest
from tests.http.daemon import Daemon, json_of, scene
from tests.http.page_test import CACHE
from tests.support.sources import SOURCE

AXE = CACHE / "node_modules/axe-core/axe.min.js"
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]


class Everywhere(BrowserTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        layers = {"formats": ["png", "exr"], "layers": ["error", "samples"]}
        done = cls.daemon.submit(scene(80, 60, name="done", samples=2, output=layers, job={"labels": {"shot": "12"}}))
        cls.daemon.wait_for_end(done)
        cls.daemon.submit(scene(name="waits", job={"run_after": "2099-01-01T00:00:00Z"}))
        measured = json_of(cls.daemon.request("POST", "/v1/measure", {"scene": scene(), "settings": {"parameters": ["samples"], "reference_samples": 16}}))["id"]
        cls.daemon.wait_for_end(measured)
        swept = json_of(cls.daemon.request("POST", "/v1/batches", {"scene": scene(), "sweep": {"/ambient": [0, 0.1], "/camera/fov": [30, 40]}}))["id"]
        cls.views = ["#/", "#/?state=failed", "#/new", f"#/edit/{done}", "#/nothing", "#/system", "#/compare", f"#/compare?a={done}&b={done}", f"#/measure/{measured}", "#/batches", f"#/batches/{swept}", f"#/batches/{swept}?view=player", f"#/batches/new?job={done}",
                     *(f"#/jobs/{done}?tab={tab}" for tab in ("image", "error", "cost", "document", "history", "webhooks"))]

    def shown(self, view):
        self.open(view)
        self.browser.until(lambda: self.browser.all("h1") and not self.browser.all("main > .visually-hidden"), view)
        if view.startswith(("#/new", "#/edit")):
            self.browser.until(lambda: self.browser.all(".canvas img"), "the draft")
        if "tab=error" in view:
            self.browser.until(lambda: self.browser.all("img[data-cover]"), "the map")

    def test_has_no_known_barrier(self):
        """Acceptance test 43."""
        axe = AXE.read_text(encoding="utf-8")
        for theme in ("dark", "light"):
            self.browser.prefer(prefers_color_scheme=theme)
            for view in self.views:
                with self.subTest(view, theme=theme):
                    self.shown(view)
                    self.browser.execute_script(axe)
                    found = self.browser.execute_async_script(
                        "const done = arguments[1]; axe.run(document, {runOnly: arguments[0]}).then(result => done(result.violations.map("
                        "each => each.id + ': ' + each.nodes.map(node => node.target.join(' ') + ' ' + node.failureSummary).join('; '))));", RULES)
                    self.assertEqual(found, [])

    def test_needs_no_sideways_scroll(self):
        """Acceptance test 45."""
        self.addCleanup(self.browser.resize, 1440, 900)
        for width in (360, 320):
            self.browser.resize(width, 740)
            for view in self.views:
                with self.subTest(view, width=width):
                    self.shown(view)
                    wide = self.browser.execute_script(
                        "return [document.documentElement, ...document.querySelectorAll('main, main .page')].map(each => each.scrollWidth - each.clientWidth)")
                    self.assertLessEqual(max(wide), 0)

    def test_is_small(self):
        """Acceptance test 8."""
        self.browser.execute_cdp_cmd("Network.clearBrowserCache", {})
        sizes = {}
        for view in ("#/", "#/new"):
            self.browser.get_log("performance")
            self.shown(view)
            time.sleep(1)
            sizes[view] = self.transferred()
        print(f"transferred: {sizes}")
        self.assertLessEqual(sizes["#/"], 80_000)
        self.assertLessEqual(sizes["#/new"], 200_000)

    def transferred(self):
        """Bytes of /ui that came over the network since the last call."""
        urls, total = {}, 0
        for entry in self.browser.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.responseReceived":
                urls[message["params"]["requestId"]] = message["params"]["response"]["url"]
            if message["method"] == "Network.loadingFinished" and "/ui/" in urls.get(message["params"]["requestId"], ""):
                total += message["params"]["encodedDataLength"]
        return total

    def test_asks_no_other_host(self):
        """A part of acceptance test 3."""
        self.browser.requests()
        for view in self.views:
            self.shown(view)
        hosts = {url.split("/")[2] for _, url in self.browser.requests() if url.startswith("http")}
        self.assertEqual(hosts, {f"127.0.0.1:{self.daemon.port}"})


class Alone(unittest.TestCase):
    @unittest.skipUnless(os.geteuid() == 0, "makes a namespace of its own")
    def test_works_without_network(self):
        """Acceptance test 3: in a network namespace with loopback only."""
        script = "from tests.browser.everywhere_test import look; look()"
        done = subprocess.run(["unshare", "--net", "bash", "-c", 'ip link set lo up && exec "$@"', "bash", sys.executable, "-c", script],
                              cwd=SOURCE, check=False, capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


def look():
    """Opens views and ends with an exception if one shows nothing or logs an error."""
    with Daemon() as daemon:
        browser = Browser()
        try:
            for view, selector in (("#/", ".empty h2"), ("#/new", ".canvas img")):
                browser.get(f"http://127.0.0.1:{daemon.port}/{view}")
                browser.one(selector)
            assert not browser.errors()
        finally:
            browser.quit()


if __name__ == "__main__":
    unittest.main()
