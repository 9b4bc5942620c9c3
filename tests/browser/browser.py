"""A headless Chromium on the page of a daemon. Every message that the page logs as an error, and every violation of its policy, fails the
test that caused it."""
import json
import unittest

from selenium import webdriver
from selenium.common.exceptions import JavascriptException, StaleElementReferenceException, TimeoutException
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

from tests.http.daemon import FAR, Daemon
from tests.support.sources import SOURCE, text

PATIENCE_S = 300
LATER = {"run_after": FAR}
# Without a process for each address that is opened, and one in reserve, a test takes two thirds of the processor time.
FEW_PROCESSES = ("--in-process-gpu", "--num-raster-threads=1", "--renderer-process-limit=1", "--disable-site-isolation-trials",
                 "--disable-features=SpareRendererForSitePerProcess,IsolateOrigins,site-per-process", "--disable-extensions")
SCRIPTS = text("tests/browser/scripts.js")
SCREENSHOTS = SOURCE / "build" / "test-results" / "browser"


class Browser(webdriver.Chrome):
    def __init__(self, width=1440, height=900, arguments=()):
        options = webdriver.ChromeOptions()
        options.binary_location = "/usr/bin/chromium"
        for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
                         "--disable-background-networking", *FEW_PROCESSES, f"--window-size={width},{height}", *arguments):
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        super().__init__(service=Service("/usr/bin/chromedriver"), options=options)
        self.resize(width, height)

    def resize(self, width, height):
        """The size of the page itself."""
        self.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False})

    def prefer(self, **features):
        """Media features, such as prefers_color_scheme="dark"."""
        self.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [
            {"name": name.replace("_", "-"), "value": value} for name, value in features.items()]})

    def until(self, condition, what, seconds=PATIENCE_S):
        """Returns the first true value of `condition()`, which may fail while the page is being replaced."""
        try:
            return WebDriverWait(self, seconds, 0.05, (StaleElementReferenceException, JavascriptException)).until(lambda _: condition())
        except TimeoutException:
            self.save(f"timeout-{what}")
            raise AssertionError(f"waited {seconds} s in vain: {what}\n{self.find_element(By.TAG_NAME, 'body').text[:2000]}") from None

    def all(self, selector):
        return self.find_elements(By.CSS_SELECTOR, selector)

    def one(self, selector):
        return self.until(lambda: next(iter(self.all(selector)), None), selector)

    def button(self, text, within=""):
        """The first shown button or link with this text."""
        return self.until(lambda: next((each for each in self.all(f"{within} button, {within} a, {within} summary")
                                        if each.is_displayed() and each.text.strip().startswith(text)), None), f"button {text}")

    def click(self, text, condition, what, within=""):
        """Clicks a button and returns the first true value of `condition()`, which is its effect."""
        self.button(text, within).click()
        return self.until(condition, what)

    def text(self, selector):
        return self.one(selector).text

    def errors(self):
        """Errors that the page logged since the last call."""
        return [f"{entry['source']}: {entry['message']}" for entry in self.get_log("browser") if entry["level"] == "SEVERE"]

    def requests(self):
        """[(method, url)] since the last call."""
        messages = [json.loads(entry["message"])["message"] for entry in self.get_log("performance")]
        return [(each["params"]["request"]["method"], each["params"]["request"]["url"]) for each in messages
                if each["method"] == "Network.requestWillBeSent"]

    def save(self, name):
        """Saves a screenshot beside the results of the tests."""
        SCREENSHOTS.mkdir(parents=True, exist_ok=True)
        self.save_screenshot(str(SCREENSHOTS / f"{name.replace(' ', '-').replace('/', '-')[:80]}.png"))


class BrowserTest(unittest.TestCase):
    """Tests that share a daemon and a browser."""

    options = ()
    arguments = ()
    expected_errors = ()  # parts of messages that a test causes on purpose

    @classmethod
    def setUpClass(cls):
        cls.daemon = cls.enterClassContext(Daemon(*cls.options))
        cls.browser = cls.enterClassContext(Browser(arguments=cls.arguments))

    def setUp(self):
        self.expected = list(self.expected_errors)
        self.browser.get("about:blank")
        self.browser.errors()

    def tearDown(self):
        unexpected = [message for message in self.browser.errors() if not any(part in message for part in self.expected)]
        if unexpected:
            self.browser.save(f"{self.id()}")
        self.assertEqual(unexpected, [])

    def address(self, route=""):
        return f"http://127.0.0.1:{self.daemon.port}/{route}"

    def open(self, route="", condition=None, what=""):
        """Opens a route of the page anew, with nothing stored, and waits for the condition if there is one."""
        self.browser.get("about:blank")
        clear = self.browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": "localStorage.clear(); sessionStorage.clear();"})
        self.browser.get(self.address(route))
        self.browser.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", clear)
        if condition:
            self.browser.until(condition, what)

    def editor(self, script, *arguments):
        """Runs a script with `view`, the CodeMirror view of the editor."""
        return self.browser.execute_script(SCRIPTS + "const view = editorView();" + script, *arguments)
