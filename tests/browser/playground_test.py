"""The playground: drafts while typing, completion, problems, orbit, dropped files."""
import base64
import contextlib
import json
import math
import sqlite3

from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.actions.wheel_input import ScrollOrigin
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from tests.browser.browser import SCRIPTS, BrowserTest
from tests.http.daemon import json_of, scene, sha256, wait_until
from tests.support.sources import SOURCE, text

SHAPES = text("scenes/shapes.json")


class Playground(BrowserTest):
    """Each test begins with the first example, small enough to be refined at once."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        document = SHAPES.replace('"width": 720, "height": 405', '"width": 96, "height": 54')
        assert document != SHAPES
        cls.first = cls.daemon.wait_for_end(cls.daemon.submit(document.encode()))["id"]

    def setUp(self):
        super().setUp()
        self.open(f"#/edit/{self.first}")
        self.shown("refined")

    def shown(self, kind, after=""):
        """Waits for an image of a kind; returns its address."""
        def found():
            images = self.browser.all(f".canvas img[data-kind={kind}]")
            return images[0].get_attribute("src") if images and images[0].get_attribute("src") != after else None
        return self.browser.until(found, f"{kind} image")

    def document(self):
        return self.editor("return view.state.doc.toString()")

    def set_document(self, document):
        value = document if isinstance(document, str) else json.dumps(document, indent=1)
        self.editor("view.dispatch({changes: {from: 0, to: view.state.doc.length, insert: arguments[0]}})", value)

    def put_cursor_after(self, marker):
        self.editor("const at = view.state.doc.toString().indexOf(arguments[0]) + arguments[0].length;"
                    "view.dispatch({selection: {anchor: at}, scrollIntoView: true}); view.focus();", marker)

    def type(self, *keys, pause_s=0.06):
        actions = ActionChains(self.browser, duration=0)
        for key in keys:
            actions.send_keys(key).pause(pause_s)
        actions.perform()

    def marked_lines(self):
        """The lines of the marked problems."""
        return set(self.editor("return [...view.dom.querySelectorAll('.cm-lintRange')].map((mark) => view.state.doc.lineAt(view.posAtDOM(mark)).number)"))

    def job_rows(self):
        return [job for job in json_of(self.daemon.get("/v1/jobs"))["items"] if job["id"] != self.first]


class Drafts(Playground):
    def test_follow_typing(self):
        """A part of acceptance test 29: at most two requests run, and each text has its draft."""
        self.set_document(SHAPES)
        self.browser.all("label.switch input")[1].click()  # no refinement
        for round_ in range(3):
            self.put_cursor_after('[-3.2,0.8,0],"radius":')
            self.type(*([Keys.DELETE] * 3 if round_ == 0 else [Keys.DELETE] * 4), pause_s=0)
            self.browser.execute_script(SCRIPTS + "recordImages()")
            self.type(*f"0.{50 + round_}")
            self.shown("draft", self.browser.execute_script("return record.last || ''"))
            record = self.browser.until(lambda: self.browser.execute_script("return record.inFlight === 0 && record.shown.length ? record : null"), "a draft")
            self.assertLessEqual(record["most"], 2)
            self.assertIn(f'"radius":0.{50 + round_}', self.document())
        self.assertEqual(self.job_rows(), [], "drafts are in no list")

    def test_show_the_newest_text_only(self):
        """The request for the draft of an older text, here of a red image, is sent last."""
        red, blue, green = ({**scene(64, 48), "background": {"color": color}} for color in ([0.9, 0.1, 0.1], [0.1, 0.1, 0.9], [0.1, 0.9, 0.1]))
        run, first = self.browser.execute_script, self.shown("refined")
        run(SCRIPTS + "recordImages(); record.held = [];")
        self.set_document(red)
        self.browser.until(lambda: run("return record.held.length"), "the request for a red draft")
        run("window.late = record.held; record.held = null;")
        self.set_document(blue)
        second = self.shown("refined", first)
        run("record.shown = []; for (const send of late) send();")
        self.set_document(green)
        self.shown("refined", second)
        self.browser.until(lambda: run("return record.inFlight === 0"), "the end of all requests")
        kinds = [kind for _, kind in run("return record.shown")]
        self.assertEqual(kinds.count("draft"), 1, kinds)
        job = self.browser.one(".canvas img").get_attribute("data-job")
        self.assertEqual(json_of(self.daemon.get(f"/v1/jobs/{job}/scene"))["background"], green["background"])

    def test_refine_until_the_next_key(self):
        """Acceptance test 32."""
        self.set_document(scene(2000, 1500, samples=256))
        self.shown("refining")
        self.assertIn("blob:", self.browser.one(".canvas img").get_attribute("style"))  # the draft, where nothing is rendered yet
        job = self.browser.one(".canvas img").get_attribute("data-job")
        self.assertEqual(self.daemon.job(job)["state"], "running")
        self.put_cursor_after('"version": 1')
        self.type(" ", pause_s=0)
        self.daemon.wait_for_state(job, "cancelled")

    def test_set_a_target_error(self):
        self.set_document({**scene(64, 48), "accuracy": {"samples": [4, 4], "max_depth": 3}})
        field = self.browser.until(lambda: next((each for each in self.browser.all(".target") if not each.get_attribute("value")), None), "no target")
        field.send_keys("1", Keys.ENTER)
        self.browser.until(lambda: json.loads(self.document())["accuracy"] == {"target_error": 1, "max_depth": 3}, "the target in the document")
        self.browser.until(lambda: self.browser.one(".target").get_attribute("value") == "1", "the target in the field")

    def test_follow_a_document_that_takes_long(self):
        """The time of a draft counts, not that of the document."""
        self.browser.all("label.switch input")[1].click()  # no refinement
        before = self.browser.one(".canvas img").get_attribute("src")
        self.set_document({**json.loads(SHAPES), "accuracy": {"target_error": 0.02}})
        self.shown("draft", before)
        self.assertEqual(self.browser.all(".banner"), [])

    def test_leave_no_rows(self):
        """Acceptance test 31, with fewer edits: no job in the list, and no row in the store after the page is left."""
        for _ in range(12):
            self.put_cursor_after('"version": 1')
            self.type(" ", pause_s=0.2)
        self.shown("refined")
        self.assertEqual(self.job_rows(), [])
        self.browser.get("about:blank")
        def rows():
            with contextlib.closing(sqlite3.connect(f"file:{self.daemon.data / 'whittle.db'}?mode=ro", uri=True)) as store:
                return store.execute("SELECT count(*) FROM jobs WHERE id <> ?", [self.first]).fetchone()[0]
        wait_until(lambda: rows() == 0, "a store without drafts")

    def test_check_each_text_also_if_none_is_drafted(self):
        self.browser.execute_script(SCRIPTS + "slowValidation()")
        live, refine = self.browser.all("label.switch input")
        refine.click()
        for end_drafts, begin_drafts in ((lambda: self.set_document(scene(64, 48, name="slow")), lambda: None), (live.click, live.click)):
            before = self.browser.one(".canvas img").get_attribute("src")
            end_drafts()
            self.browser.until(lambda: any(each.text.startswith("Draft") for each in self.browser.all(".bar button")), "drafts on request")
            self.set_document({**scene(64, 48), "objects": 1})
            self.browser.until(lambda: not self.browser.button("Render").is_enabled(), "the problem")
            self.browser.one(".film button").click()
            self.set_document(scene(64, 48, name="mended"))
            self.browser.until(lambda: self.browser.button("Render").is_enabled(), "no problem")
            self.assertNotIn("Earlier image", self.browser.text(".caption"))
            begin_drafts()
            self.shown("draft", before)
            self.assertEqual(self.browser.all(".banner"), [])


class LargeDocuments(Playground):
    def test_are_opened_and_edited(self):
        """Acceptance test 33: no key waits for a draft, and one is made on request."""
        document = text("scenes/mountain.json").replace('"name": "mountain"', '"name": "mountain", "job": {"run_after": "2099-01-01T00:00:00Z"}')
        self.assertGreater(len(document), 5_700_000)
        job = json_of(self.daemon.request("POST", "/v1/jobs", document.encode()))["id"]
        self.open(f"#/edit/{job}", lambda: "on request" in self.browser.text(".banner"), "the banner")
        self.put_cursor_after('"name": "mountain')
        self.browser.requests()
        self.type(*"abcdefghijklmnopqrst")
        self.browser.until(lambda: '"mountainabcdefghijklmnopqrst"' in self.document(), "every key")
        self.assertEqual([url for method, url in self.browser.requests() if method == "POST"], [])
        self.browser.button("Draft").click()
        images = ",".join(f".canvas img[data-kind={kind}]" for kind in ("draft", "refining", "refined"))
        self.browser.until(lambda: self.browser.all(images), "the draft, or the image that refines it a second later")


class Assistance(Playground):
    def test_completes_fields_and_values(self):
        """A part of acceptance test 27; modules.test.js has the other positions."""
        for document, expected in (('{"version": 1, ', {"camera", "objects", "lights"}), ('{"version": 1, "objects": [{"type": ', {"sphere", "torus", "mesh"})):
            self.set_document(document)
            self.put_cursor_after(document)
            self.type('"')
            labels = self.browser.until(lambda: self.browser.execute_script(
                "return [...document.querySelector('.editor').shadowRoot.querySelectorAll('.cm-completionLabel')].map(each => each.textContent)"), "completions")
            self.assertLessEqual(expected, {label.strip('"') for label in labels}, document)
            self.type(Keys.ESCAPE)

    def test_leads_from_a_problem_to_its_line(self):
        """A part of acceptance test 28."""
        document = scene(32, 24)
        document["objects"][0]["material"] = "glas"
        document["objects"][1]["normal"] = [0, 0, 0]
        written = json.dumps(document, indent=1)
        reply = json_of(self.daemon.request("POST", "/v1/jobs/validate", document))
        self.set_document(written)
        self.browser.until(lambda: len(self.browser.all(".problems section:first-child li")) == len(reply["errors"]), "problems")
        shown = [[each.text for each in self.browser.all(f".problems section:first-child li {part}")] for part in ("code", "strong")]
        self.assertEqual(shown, [[issue[name] for issue in reply["errors"]] for name in ("pointer", "code")])
        lines = {number for number, line in enumerate(written.splitlines(), 1) if '"glas"' in line or '"normal"' in line}
        self.browser.until(lambda: self.marked_lines() == lines, f"marks at {lines}")
        self.browser.all(".problems section:first-child li button")[0].click()
        at = self.editor("return view.state.sliceDoc(view.state.selection.main.head, view.state.selection.main.head + 6)")
        self.assertEqual(at, '"glas"')

    def test_takes_scenes_from_files_links_and_examples(self):
        """Each replaces the text as one step that can be undone."""
        tiny, before = text("scenes/tiny.json"), self.document()
        self.browser.execute_script("navigator.clipboard.writeText = async (copied) => { window.copied = copied; }")
        self.browser.button("Share").click()
        link = self.browser.until(lambda: self.browser.execute_script("return window.copied"), "the link")
        ways = {"a file": (lambda: self.browser.one(".bar input[type=file]").send_keys(str(SOURCE / "scenes/tiny.json")), tiny),
                "a dropped file": (lambda: self.editor("dropFile(view, ...arguments)", "tiny.json", base64.b64encode(tiny.encode()).decode()), tiny),
                "a link": (lambda: self.browser.execute_script("location.href = arguments[0]", link), before),
                "an example": (lambda: self.browser.execute_script("location.hash = '#/new?example=torus'"), text("scenes/torus.json"))}
        self.open("#/new", lambda: self.browser.execute_script(SCRIPTS + "return editorText()"), "the editor")
        for name, (take, expected) in ways.items():
            self.set_document(scene(name="mine"))
            take()
            self.browser.until(lambda expected=expected: self.document() == expected, name)
            self.browser.until(lambda: self.browser.current_url.endswith("#/new"), "an address without it")
            self.editor("view.focus()")
            ActionChains(self.browser).key_down(Keys.CONTROL).send_keys("z").key_up(Keys.CONTROL).perform()
            self.browser.until(lambda: json.loads(self.document())["name"] == "mine", f"the text before {name}")

    def test_works_by_keys(self):
        """The line between the panes, the view, the list of needs, a render."""
        width = "return document.querySelector('.edit').clientWidth"
        before, camera = self.browser.execute_script(width), json.loads(self.document())["camera"]
        self.browser.one(".splitter").send_keys(Keys.ARROW_RIGHT * 2)
        self.browser.until(lambda: self.browser.execute_script(width) == before + 48, "a wider editor")
        self.browser.one(".canvas").send_keys(Keys.ARROW_LEFT, "+")
        self.browser.until(lambda: json.loads(self.document())["camera"] != camera, "another view")
        self.assertEqual(self.browser.all(".facts"), [])
        self.browser.one(".caption [aria-expanded]").send_keys(Keys.ENTER)
        self.browser.until(lambda: "/objects" in self.browser.text(".facts"), "the needs")
        document = self.document()
        ActionChains(self.browser).key_down(Keys.CONTROL).send_keys(Keys.ENTER).key_up(Keys.CONTROL).perform()
        self.browser.until(lambda: "#/jobs/" in self.browser.current_url, "the job")
        job = self.browser.current_url.split("#/jobs/")[1].split("?")[0]
        self.assertEqual(self.daemon.get(f"/v1/jobs/{job}/scene").body.decode(), document)

    def test_names_a_dropped_file(self):
        """Acceptance test 34. Beside any text that names a file an image becomes a texture."""
        path = SOURCE / "scenes/assets/tile.png"
        digest = sha256(path.read_bytes())
        document = json.dumps({**scene(64, 48), "background": {"color": 0.5}, "textures": {"tile": {"file": ""}}})
        for expected in (["PUT"], []):
            self.set_document(document)
            self.put_cursor_after('"file": "')
            self.browser.requests()
            self.editor("dropFile(view, ...arguments)", "tile.png", base64.b64encode(path.read_bytes()).decode())
            self.editor("view.dispatch({changes: {from: 0, insert: ' '}})")  # before the upload has ended
            self.browser.until(lambda: f'"file": "sha256:{digest}"' in self.document(), "the name of the file")
            self.assertEqual([method for method, url in self.browser.requests() if method == "PUT"], expected)
        self.set_document(scene(64, 48))
        self.editor("dropFile(view, ...arguments)", "tile.png", base64.b64encode(path.read_bytes()).decode())
        self.browser.until(lambda: json.loads(self.document()).get("textures") == {"tile": {"file": f"sha256:{digest}"}}, "the texture")
        model = (SOURCE / "scenes/assets/stone.glb").read_bytes()
        self.editor("dropFile(view, ...arguments)", "stone.glb", base64.b64encode(model).decode())
        self.browser.until(lambda: json.loads(self.document()).get("model") == f"sha256:{sha256(model)}", "the model")
        self.browser.until(lambda: self.browser.all(".canvas img"), "its image")


class ObjectsInTheImage(Playground):
    def test_are_found_in_the_text_by_a_click(self):
        """Objects, instances and visible lights; a click beside them, and one that is no drag, change nothing."""
        ball = {"type": "sphere", "radius": 0.5, "material": "clay"}
        document = {
            "version": 1, "image": {"width": 160, "height": 120}, "camera": {"position": [0, 0, 10], "look_at": [0, 0, 0], "fov": 40},
            "materials": {"clay": {"model": "lambert", "diffuse": 0.8}},
            "lights": [{"type": "point", "position": [0, 5, 5]}, {"type": "sphere", "center": [0, 2.5, 0], "radius": 0.5, "visible": True}],
            "prototypes": {"pair": [{**ball, "center": [0, 0.7, 0]}, {**ball, "center": [0, -0.7, 0]}]},
            "objects": [{**ball, "center": [-3, 0, 0]}, {"type": "instance", "of": "pair"}, {**ball, "center": [3, 0, 0]},
                        {"type": "instance", "of": "pair", "position": [0, -2, 0]}]}
        self.set_document(document)
        self.browser.until(lambda: self.browser.execute_script("return document.querySelector('.canvas img')?.dataset.kind") == "refined", "the image")
        before = self.document()
        canvas = self.browser.one(".canvas")
        unit = min(canvas.size["width"] / 160, canvas.size["height"] / 120) * 120 / (2 * 10 * math.tan(math.radians(20)))
        for x, y, expected in ((-3, 0, document["objects"][0]), (0, 0.7, document["objects"][1]), (0, -0.7, document["objects"][1]),
                               (3, 0, document["objects"][2]), (0, -2.7, document["objects"][3]), (0, 2.5, document["lights"][1])):
            self.editor("view.dispatch({selection: {anchor: 0}})")
            ActionChains(self.browser).move_to_element_with_offset(canvas, round(x * unit), round(-y * unit)).click().perform()
            head = self.browser.until(lambda: self.editor("return view.state.selection.main.head"), "the cursor")
            self.assertEqual(json.JSONDecoder().raw_decode(before[head:])[0], expected)
        self.editor("view.dispatch({selection: {anchor: 0}})")
        ActionChains(self.browser).move_to_element_with_offset(canvas, round(-1.5 * unit), 0).click().perform()
        self.browser.until(lambda: "background" in self.browser.find_element(By.TAG_NAME, "body").text, "the words for the background")
        self.assertEqual(self.editor("return view.state.selection.main.head"), 0)
        self.assertEqual(self.document(), before)


class Orbit(Playground):
    def drag(self, dx, dy, steps=10):
        canvas = self.browser.one(".canvas")
        actions = ActionChains(self.browser, duration=20).move_to_element(canvas).click_and_hold()
        for _ in range(steps):
            actions.move_by_offset(dx // steps, dy // steps)
        actions.release().perform()

    def camera(self):
        return json.loads(self.document())["camera"]

    def test_turns_the_camera_and_is_one_step_of_the_history(self):
        """A part of acceptance test 30."""
        self.browser.all("label.switch input")[1].click()  # no refinement
        before, camera = self.document(), self.camera()
        self.browser.execute_script(SCRIPTS + "recordImages()")
        self.drag(200, 50, steps=20)
        self.browser.until(lambda: self.browser.execute_script("return record.shown.length"), "an image of another view")
        moved = self.camera()
        self.assertNotEqual(moved["position"], camera["position"])
        self.assertEqual(moved["look_at"], camera["look_at"])
        distance = [sum((a - b) ** 2 for a, b in zip(each["position"], each["look_at"])) ** 0.5 for each in (camera, moved)]
        self.assertAlmostEqual(distance[0], distance[1], delta=0.01)
        self.editor("view.focus()")
        ActionChains(self.browser).key_down(Keys.CONTROL).send_keys("z").key_up(Keys.CONTROL).perform()
        self.browser.until(lambda: self.document() == before, "the text as it was")

    def test_the_wheel_comes_closer(self):
        camera = self.camera()
        canvas = self.browser.find_element(By.CSS_SELECTOR, ".canvas")
        ActionChains(self.browser).scroll_from_origin(ScrollOrigin.from_element(canvas), 0, -120).perform()
        self.browser.until(lambda: self.camera() != camera, "another camera")
        self.assertLess(self.camera()["position"][2], camera["position"][2])


del Playground  # only its subclasses have tests
