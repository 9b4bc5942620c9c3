"""Requirements of every view: accessibility, narrow screens, sizes, no other host."""
import http.client
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from tests.browser.browser import LATER, SCRIPTS, Browser, BrowserTest
from tests.http.daemon import Daemon, json_of, scene, sha256
from tests.http.keys_test import new_key
from tests.http.page_test import CACHE
from tests.support.sources import SOURCE

AXE = CACHE / "node_modules/axe-core/axe.min.js"
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]


class Everywhere(BrowserTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        layers = {"formats": ["png", "exr"], "layers": ["error", "samples"]}
        done = cls.daemon.rendered(scene(80, 60, name=200 * "n", samples=2, output=layers, job={"labels": {"shot": "12"}}))["id"]
        cls.daemon.submit(scene(name="waits", job=LATER))
        measured = json_of(cls.daemon.request("POST", "/v1/measure", {"scene": scene(name=200 * "s"), "settings": {"parameters": ["samples"], "reference_samples": 16}}))["id"]
        cls.daemon.wait_for_end(measured)
        swept = json_of(cls.daemon.request("POST", "/v1/batches", {"scene": scene(name=200 * "m"), "sweep": {"/ambient": [0, 0.1], "/camera/fov": [30, 40]}}))["id"]
        cls.views = ["#/", "#/?state=failed", "#/new", f"#/edit/{done}", "#/nothing", "#/system", "#/compare", f"#/compare?a={done}&b={done}", f"#/measure/{measured}", "#/batches", f"#/batches/{swept}", f"#/batches/{swept}?view=player", f"#/batches/new?job={done}",
                     *(f"#/jobs/{done}?tab={tab}" for tab in ("image", "error", "cost", "document", "history", "webhooks"))]

    def shown(self, view):
        self.open(view, lambda: self.browser.all("h1") and not self.browser.all("main > .visually-hidden"), view)
        if view.startswith(("#/new", "#/edit")):
            self.browser.until(lambda: self.browser.all(".canvas img"), "the draft")
        if "tab=error" in view:
            self.browser.until(lambda: self.browser.all("img[data-cover]"), "the map")

    def frame(self):
        """Waits until what was changed is drawn."""
        self.browser.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")

    def violations(self, rules):
        return self.browser.execute_script(SCRIPTS + "return violations(arguments[0])", rules)

    def test_keeps_its_promises_in_every_view(self):
        """Acceptance tests 3, 43 and 45, in one visit of each view: no known barrier, no sideways scroll, no other host."""
        axe = AXE.read_text(encoding="utf-8")
        self.addCleanup(self.browser.prefer, prefers_color_scheme="dark")
        self.browser.requests()
        for view in self.views:
            self.browser.resize(1440, 900)
            self.browser.prefer(prefers_color_scheme="dark")
            self.shown(view)
            self.browser.execute_script(axe)
            for theme, rules in (("dark", RULES), ("light", ["color-contrast"])):  # other rules are not of colours
                self.browser.prefer(prefers_color_scheme=theme)
                self.frame()
                with self.subTest(view, theme=theme):
                    self.assertEqual(self.violations(rules), [])
            for width in (360, 320):
                self.browser.resize(width, 740)
                self.frame()
                with self.subTest(view, width=width):
                    self.assertLessEqual(self.browser.execute_script(SCRIPTS + "return sidewaysScroll()"), 0)
        self.browser.resize(1440, 900)
        hosts = {url.split("/")[2] for _, url in self.browser.requests() if url.startswith("http")}
        self.assertEqual(hosts, {f"127.0.0.1:{self.daemon.port}"})

    def test_is_small(self):
        """Acceptance test 8: bytes of /ui that come over the network, without those of workers."""
        self.browser.execute_cdp_cmd("Network.clearBrowserCache", {})
        for view, least, most in (("#/", 10_000, 80_000), ("#/new", 10_000, 200_000)):
            self.open(view)
            self.browser.one("h1")
            if view == "#/new":
                self.browser.until(lambda: self.browser.execute_script("return document.querySelector('.editor')?.shadowRoot?.querySelector('.cm-content')"), "the editor")
            sizes = self.browser.execute_script(SCRIPTS + "return transferSizes()")
            self.assertTrue(least <= sum(sizes) <= most, f"{view}: {sizes}")


@unittest.skipUnless(os.geteuid() == 0, "makes a namespace of its own")
class Alone(unittest.TestCase):
    """In a network namespace with loopback only, which also has the address 192.0.2.1 (RFC 5737)."""

    def test_works_without_a_secure_context(self):
        """Acceptance test 12: over plain HTTP at another address than loopback there is neither crypto.subtle nor a clipboard."""
        script = "from tests.browser import everywhere_test; everywhere_test.use_from_afar()"
        done = subprocess.run(["unshare", "--net", "bash", "-c", 'ip link set lo up && ip address add 192.0.2.1/32 dev lo && exec "$@"', "bash", sys.executable, "-c", script],
                              cwd=SOURCE, check=False, capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


class FarDaemon(Daemon):
    """At 192.0.2.1, where it needs keys; its requests have one."""

    def __init__(self, directory):
        keys = pathlib.Path(directory) / "keys"
        self.key = new_key(keys, "ann", "jobs:read,jobs:write")
        self.allowed = {"Authorization": f"Bearer {self.key}"}
        super().__init__("--keys", str(keys), listen="192.0.2.1:0")

    def connection(self, port):
        return http.client.HTTPConnection("192.0.2.1", port, timeout=600)


def use_from_afar():
    """Upload, copy, compare."""
    with tempfile.TemporaryDirectory() as directory, FarDaemon(directory) as daemon, Browser() as browser:
        job = daemon.rendered(scene(96, 72))["id"]
        image = pathlib.Path(directory) / "reference.png"
        other = daemon.rendered(scene(96, 72, ambient=0.2))["id"]
        image.write_bytes(daemon.get(f"/v1/jobs/{other}/image.png").body)
        browser.get(f"http://192.0.2.1:{daemon.port}/#/compare?a={job}")
        browser.one("dialog[open] input[type=password]").send_keys(daemon.key, Keys.ENTER)
        assert browser.execute_script("return [isSecureContext, typeof crypto.subtle, typeof navigator.clipboard]") == [False, "undefined", "undefined"]
        browser.one("input[type=file]").send_keys(str(image))
        browser.until(lambda: f"b={sha256(image.read_bytes())}" in browser.current_url, "the upload")
        values = browser.until(lambda: browser.all(".facts-list dd[data-value]"), "the comparison")
        assert float(values[0].get_attribute("data-value")) > 1
        browser.get("about:blank")
        browser.get(f"http://192.0.2.1:{daemon.port}/#/new")
        browser.until(lambda: browser.all(".canvas img[data-kind]"), "the draft")
        browser.all(".bar select")[-1].send_keys("c")  # a key of the user, as a copy needs one
        browser.until(lambda: browser.text("[aria-live]"), "the copy")
        assert browser.text("[aria-live]") == "Copied"
        browser.execute_script("document.querySelector('.editor').shadowRoot.querySelector('.cm-content').focus()")
        ActionChains(browser).key_down(Keys.CONTROL).send_keys("a").send_keys("v").key_up(Keys.CONTROL).perform()
        browser.until(lambda: "curl" in browser.execute_script("return document.querySelector('.editor').shadowRoot.querySelector('.cm-content').textContent"), "the pasted command")
        # 401 before the key was entered, and a policy that is for HTTPS.
        expected = ("status of 401", "Cross-Origin-Opener-Policy header has been ignored")
        errors = [error for error in browser.errors() if not any(each in error for each in expected)]
        assert not errors, errors
