"""The page without a pointer: Tab, Enter and the arrow keys reach every step from an example to its removal."""
import json

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from tests.browser.browser import LATER, SCRIPTS, BrowserTest
from tests.http.daemon import scene
from tests.support.sources import SOURCE

MAX_STEPS = 80


class Keyboard(BrowserTest):
    def press(self, *keys):
        ActionChains(self.browser).send_keys(*keys).perform()

    def tab_to(self, name, tag):
        """Presses Tab until a control of this name has the focus. Each stop on the way shows that it has it."""
        passed = []
        for _ in range(MAX_STEPS):
            self.press(Keys.TAB)
            at = self.browser.execute_script(SCRIPTS + "return focused()")
            if at is None:
                continue
            passed.append(at["name"][:30])
            self.assertTrue(at["visible"], f"the focus is not visible at {at['tag']} {at['name'][:60]}")
            if at["tag"] == tag and at["name"].startswith(name):
                return
            if at["editing"]:
                self.press(Keys.ESCAPE)  # Tab indents in an editor until Escape
        self.fail(f"Tab does not reach {tag} {name}: {passed}")

    def activate(self, name, tag="BUTTON"):
        self.tab_to(name, tag)
        self.press(Keys.ENTER)

    def wait_for_route(self, part):
        self.browser.until(lambda: part in self.browser.current_url, f"the route {part}")

    def test_leads_from_an_example_to_its_removal(self):
        """Acceptance test 44."""
        example = (SOURCE / "scenes/tiny.json").read_text(encoding="utf-8")
        other = self.daemon.wait_for_end(self.daemon.submit(json.loads(example)))
        self.open("#/")
        self.activate("Playground", "A")
        self.wait_for_route("#/new")
        self.browser.until(lambda: self.browser.all(".canvas img"), "the first draft")
        self.activate("Examples")
        self.activate("Tiny", "A")
        self.browser.until(lambda: self.editor("return view.state.doc.toString()") == example, "the example")
        self.activate("Render")
        self.wait_for_route("#/jobs/")
        job = self.browser.current_url.split("#/jobs/")[1].split("?")[0]
        self.browser.until(lambda: self.daemon.job(job)["state"] == "succeeded", "the image")
        self.browser.until(lambda: "succeeded" in self.browser.text(".job .bar"), "the end of the job")
        self.activate("Error", "A")
        self.browser.until(lambda: self.browser.all(".parts-bar"), "the parts of the error")
        self.activate("Compare", "A")
        self.browser.until(lambda: self.browser.all(".choices button"), "the choices")
        self.activate("tiny")
        self.wait_for_route(other["id"])
        self.browser.until(lambda: self.browser.all(".facts-list dd[data-value]"), "the numbers")

        self.expected.append("/preview?max=")  # may be requested in the moment of the cancellation
        running = self.daemon.submit(scene(2048, 2048, samples=256, name="long"))
        self.open("#/", lambda: self.browser.all(f'.rows tr[data-id="{running}"]'), "the row")
        self.activate("long", "A")
        self.wait_for_route(running)
        self.activate("Cancel")
        self.browser.until(lambda: self.browser.all("dialog[open]"), "the question")
        self.activate("Cancel")
        self.browser.until(lambda: self.daemon.job(running)["state"] == "cancelled", "the end")
        self.browser.until(lambda: "cancelled" in self.browser.text(".job .bar"), "the state")
        self.activate("Remove")
        self.browser.until(lambda: self.browser.all("dialog[open]"), "the question")
        self.expected.append(f"/v1/jobs/{running} - ")  # the page may request the job in the moment of its removal
        self.activate("Remove")
        self.browser.until(lambda: self.daemon.get(f"/v1/jobs/{running}").status == 404, "the removal")
        self.browser.until(lambda: not self.browser.all(f'.rows tr[data-id="{running}"]'), "the list without it")

    def test_dialogs_keep_the_keys_and_close_on_escape(self):
        """A confirmation does not come back with an earlier selection, and no command runs under it."""
        jobs = [self.daemon.submit(scene(name=f"kept {index}", job=LATER)) for index in range(2)]
        self.daemon.request("POST", f"/v1/jobs/{jobs[1]}/cancel")
        self.open("#/?q=kept", lambda: len(self.browser.all(".rows tr[data-id]")) == 2, "rows")
        self.press("j", "x")
        self.browser.click("Remove", lambda: self.browser.all("dialog[open]"), "the question", ".bulk")
        self.press("x", "?", Keys.ESCAPE)
        self.browser.until(lambda: not self.browser.all("dialog[open]"), "no question")
        self.assertEqual(self.browser.text(".bulk strong"), "1 selected")
        self.press(Keys.ESCAPE)
        self.browser.until(lambda: not self.browser.all(".bulk"), "no selection")
        self.press("j", "x")
        self.browser.until(lambda: self.browser.all(".bulk"), "the other selection")
        self.assertEqual(self.browser.all("dialog[open]"), [])
        self.open(f"#/jobs/{jobs[1]}")
        self.browser.click("Remove", lambda: self.browser.all("dialog[open]"), "the question")
        self.press("r", Keys.ESCAPE)
        self.browser.until(lambda: not self.browser.all("dialog[open]"), "no question")
        self.press("?")
        self.browser.until(lambda: self.browser.all("dialog[open] .key-list"), "the list of keys")
        self.press(Keys.ESCAPE)
        self.browser.until(lambda: not self.browser.all("dialog[open]"), "no list")
        self.assertEqual(self.daemon.job(jobs[1])["state"], "cancelled")
        self.press("g", "n")
        self.wait_for_route("#/new")

    def test_the_row_of_the_keys_stays_as_jobs_arrive(self):
        jobs = [self.daemon.submit(scene(name=f"row {index}", job=LATER)) for index in range(2)]
        self.open("#/?q=row", lambda: len(self.browser.all(".rows tr[data-id]")) == 2 and self.browser.text(".light") == "Live", "rows")
        self.press("j")
        for count in (3, 4):
            self.daemon.submit(scene(name="row of another", job=LATER))
            self.browser.until(lambda count=count: len(self.browser.all(".rows tr[data-id]")) == count, "the new row")
            if count == 3:
                self.press("x")
        selected = "return [...document.querySelectorAll('.rows tr[aria-selected=true]')].map((each) => each.dataset.id)"
        self.assertEqual(self.browser.execute_script(selected), [jobs[1]])
        box = self.browser.one(f'.rows tr[data-id="{jobs[0]}"] input')
        ActionChains(self.browser).key_down(Keys.SHIFT).click(box).key_up(Keys.SHIFT).perform()
        self.browser.until(lambda: self.browser.execute_script(selected) == [jobs[1], jobs[0]], "both rows")
        self.expected.append("404")  # the page may request the job that was cancelled when it is removed
        for job in jobs:
            self.daemon.request("POST", f"/v1/jobs/{job}/cancel")
        self.daemon.request("DELETE", f"/v1/jobs/{jobs[0]}")
        self.browser.until(lambda: self.browser.text(".bulk strong") == "1 selected", "the selection without the removed job")
        self.browser.execute_script("location.hash = '#/?q=row&state=queued'")
        self.browser.until(lambda: not self.browser.all(".bulk"), "no selection in another list")
