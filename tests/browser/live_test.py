"""The live view: its image against that of the service, and what it does in the playground. Chromium traces it on the processor."""
import base64
import json
import re

import numpy
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from tests.browser.browser import BrowserTest
from tests.browser.live_scenes import extremes, generated, large_scene, principled
from tests.http.daemon import wait_until
from tests.support.images import read_png
from tests.support.whittle import SCENES, scene

# Debian's Chromium has no graphics processor in the tests; without the second flag it gives no context at all. Its watchdog would end a
# browser that has too little processor time.
SOFTWARE = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-watchdog")
SIDE = 96
EVERYTHING = ("reflection", "refraction", "fresnel", "shadows", "transmissive_shadows", "transmitted_light", "absorption", "overlapping_media", "depth_cue",
              "environment", "textures", "filtered_textures", "bump", "smooth_normals", "triangles", "spheres", "quadrics", "planes")
# The tables of a document in the tracer of the page.
LOAD = """
const [url, text, options, done] = arguments;
(async () => {
  const {Renderer, readLive} = await import(url);
  const reply = await fetch('/v1/live', {method: 'POST', headers: {'Content-Type': 'application/json'}, body: text});
  if (!reply.ok) throw new Error(await reply.text());
  const live = readLive(await reply.arrayBuffer()), {camera, image: {width, height}, omitted} = live.header;
  live.header.requirements.push(...options.needs ?? []);
  const tracer = window.tracer ??= new Renderer(document.createElement('canvas'));
  tracer.load(live, camera.aperture > 0);
  while (!tracer.ready()) await new Promise((again) => setTimeout(again, 5));
"""
# One centered sample a pixel, as codes.
TRACE = LOAD + """
  tracer.clear(width, height);
  tracer.findMedia(camera);
  for (let first = 0; first < height; first += 4) {
    tracer.trace(camera, {index: -1, points: 16, share: 1, first, rows: Math.min(4, height - first)});
    tracer.gl.finish();
  }
  const codes = tracer.pixels();
  let bytes = '';
  for (const code of codes) bytes += String.fromCharCode(code);
  return {codes: btoa(bytes), width, height, overflows: tracer.overflows(), omitted: omitted.map((each) => each.pointer)};
})().then(done, (error) => done({error: String(error)}));"""


def left_out(document):
    """The parts of a document that the live view does not trace."""
    accuracy, output = document.get("accuracy", {}), document.get("output", {})
    materials = [f"/materials/{name}/shading" for name, each in document.get("materials", {}).items() if each.get("shading") in ("gouraud", "flat_polygon")]
    materials += [f"/materials/{name}/roughness" for name, each in document.get("materials", {}).items() if each.get("model") == "principled" and each.get("roughness", 0.5)]
    return sorted([f"/{section}/{name}" for section, name, is_left_out in (
        ("accuracy", "model", accuracy.get("model") == "global"), ("accuracy", "approximate", accuracy.get("approximate")),
        ("output", "overflow", output.get("overflow") == "scale"), ("output", "palette", output.get("palette")),
        ("camera", "layout", document["camera"].get("layout")), ("image", "crop", document.get("image", {}).get("crop"))) if is_left_out] + materials)


class Live(BrowserTest):
    options = ("--assets", str(SCENES))
    arguments = SOFTWARE

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.browser.set_script_timeout(600)

    def traced(self, document, needs=()):
        # On a busy machine the first one takes longer than a reply may wait.
        wait_until(lambda: self.daemon.request("POST", "/v1/live", document).status != 503, "the live form")
        tree = re.search(r"/ui/([0-9a-f]+)/main\.js", self.browser.page_source).group(1)
        found = self.browser.execute_async_script(TRACE, f"/ui/{tree}/live-view.js", json.dumps(document), {"needs": needs})
        self.assertNotIn("error", found, found.get("error"))
        codes = numpy.frombuffer(base64.b64decode(found["codes"]), numpy.uint8).reshape(found["height"], found["width"], 4)
        return codes[..., :3].astype(float), found

    def rendered(self, document):
        reply = self.daemon.request("POST", "/v1/render", document, {"Accept": "image/png"})
        self.assertEqual(reply.status, 200, reply.body)
        image = read_png(reply.body).astype(float)
        return image[..., :3] * (image[..., 3:] / 255 if image.shape[2] == 4 else 1)

    def expect_equal(self, document, name, needs=(), overflows=False):
        """At most 1 level in 99 % of the pixels, and 0.5 level of root mean square away from edges. Mirror images are sharp in both."""
        accuracy = {key: value for key, value in document.get("accuracy", {}).items() if key in ("max_depth", "cutoff", "seed")}
        output = {key: value for key, value in document.get("output", {}).items() if key in ("exposure", "overflow", "alpha") and value != "scale"}
        live, found = self.traced(document, needs)
        self.assertEqual(sorted(found["omitted"]), left_out(document), name)
        if any(pointer.endswith("/shading") for pointer in found["omitted"]):
            return
        image = self.rendered({**document, "accuracy": {**accuracy, "samples": 1, "approximate": {"mirror_roughness": 1}}, "output": {**output, "formats": ["png"]}})
        difference, around = numpy.abs(live - image), numpy.pad(image, ((1, 1), (1, 1), (0, 0)), mode="edge")
        height, width = image.shape[:2]
        contrast = numpy.max([numpy.abs(around[y:y + height, x:x + width] - image).max(2) for y in range(3) for x in range(3)], axis=0)
        smooth = difference[contrast <= 8]
        with self.subTest(name):
            self.assertLessEqual((difference.max(2) > 1).mean(), 0.01)
            self.assertLessEqual(numpy.sqrt((smooth ** 2).mean()) if smooth.size else 0, 0.5)
            self.assertEqual(found["overflows"] > 0, overflows)


class Images(Live):
    def setUp(self):
        super().setUp()
        self.open()

    def test_equal_those_of_the_example_scenes(self):
        for path in sorted(SCENES.glob("*.json")):
            document = scene(path.stem)
            size = {"width": 640, "height": 480, **document.get("image", {})}
            scale = 160 / max(size["width"], size["height"])
            document["image"] = {name: max(1, round(size[name] * scale)) for name in ("width", "height")}
            self.expect_equal(document, path.stem)

    def test_equal_those_of_generated_scenes(self):
        """With two programs, since to compile one takes most of the time here; the examples have one each."""
        for number in range(40):
            self.expect_equal(generated(number, SIDE, SIDE * 3 // 4), f"generated {number}", EVERYTHING)

    def test_equal_those_of_principled_materials(self):
        self.expect_equal(principled(), "principled")

    def test_equal_those_of_extreme_scenes(self):
        """Pixels with rays that have no place are counted, and differ as little."""
        for name, document in extremes().items():
            self.expect_equal(document, name, EVERYTHING, name == "many waiting rays")

    def test_equal_those_of_large_scenes(self):
        for kind in ("triangles", "spheres"):
            self.expect_equal({**large_scene(kind), "image": {"width": SIDE, "height": SIDE * 3 // 4}}, kind)


SMALL = scene("tiny", image={"width": 96, "height": 72}, accuracy={"target_error": 1})
NEAR = 3  # levels: the live view has 16 samples a pixel when it is compared


class Page(Live):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.job = cls.daemon.wait_for_end(cls.daemon.submit(SMALL))["id"]

    def setUp(self):
        super().setUp()
        self.browser.resize(900, 600)
        self.open(f"#/edit/{self.job}?live=on")
        self.resting()

    def caption(self):
        return self.browser.text(".caption [role=status]")

    def resting(self):
        """Waits until the image has all its samples."""
        return self.browser.until(lambda: self.caption().startswith("live, float32") and re.search(r"(?<!of )\b64 samples", self.caption()) and self.caption(), "64 samples")

    def is_near(self):
        """The service's image of the same view is an equal one. A draft of it may differ more, and is replaced."""
        found = re.search(r"([\d.]+) levels from the image", self.caption())
        return found and float(found.group(1)) < NEAR

    def replace(self, old, new):
        self.editor("const at = view.state.doc.toString().indexOf(arguments[0]); if (at < 0) throw new Error(arguments[0]);"
                    "view.dispatch({changes: {from: at, to: at + arguments[0].length, insert: arguments[1]}})", old, new)

    def compilations(self):
        return sum(url.endswith("/v1/live") for _, url in self.browser.requests())

    def test_follows_numbers_and_the_camera_without_the_service(self):
        """Each time the image of the service is an equal one in the end."""
        self.browser.requests()
        steps = (lambda: self.press("w", Keys.ARROW_LEFT, "+"),
                 lambda: self.replace("#c03020", "#2080c0"), lambda: self.replace('"position": [3, 5, 4]', '"position": [-3, 5, 4]'))
        for step in steps:
            step()
            self.browser.until(lambda: "levels from the image" not in self.caption(), "the change")
            self.browser.until(self.is_near, "an equal image of the service")
        self.assertEqual(self.compilations(), 0)
        self.replace('"radius": 0.8', '"radius": 0.6')
        self.browser.until(lambda: self.compilations() > 0, "another compilation")
        self.resting()

    def test_selects_what_is_under_the_pointer(self):
        ActionChains(self.browser).move_to_element(self.browser.one(".canvas")).click().perform()
        selected = self.browser.until(lambda: self.editor("return view.state.selection.ranges.map(({from, to}) => view.state.sliceDoc(from, to)).filter((text) => text)"), "a selection")
        self.assertIn('"sphere"', selected[-1] + selected[0])

    def test_takes_the_place_of_a_job_s_image(self):
        self.open(f"#/jobs/{self.job}")
        self.browser.button("Live").click()
        self.resting()
        self.browser.until(self.is_near, "an equal image of the service")
        self.assertIn("#/jobs/", self.browser.current_url)
        self.press(Keys.ARROW_LEFT)
        self.browser.until(lambda: "levels from the image" not in self.caption(), "the move")
        self.resting()
        self.browser.click("Edit this view", lambda: "#/edit/" in self.browser.current_url, "the playground")
        self.resting()
        edited = json.loads(self.editor("return view.state.doc.toString()"))
        self.assertNotEqual(edited["camera"]["position"], SMALL["camera"]["position"])
        self.open(f"#/jobs/{self.job}?live=on")
        self.resting()
        self.browser.click("Live", lambda: self.browser.all(".viewer .zoom"), "the image of the job")

    def press(self, *keys):
        ActionChains(self.browser).send_keys_to_element(self.browser.one(".canvas"), *keys).perform()

    def test_stops_while_its_tab_is_in_the_background(self):
        self.browser.execute_script("""window.moments = [];
          document.addEventListener('visibilitychange', () => moments.push([document.visibilityState, Number(document.querySelector('[data-samples]')?.dataset.samples)]));""")
        first = self.browser.current_window_handle
        self.press("w")
        self.browser.switch_to.new_window("tab")
        self.browser.set_script_timeout(600)
        self.browser.execute_async_script("let left = 90; const done = arguments[0], next = () => --left ? requestAnimationFrame(next) : done(); next();")
        self.browser.close()
        self.browser.switch_to.window(first)
        self.resting()
        moments = self.browser.execute_script("return moments")
        self.assertEqual([each[0] for each in moments[:2]], ["hidden", "visible"])
        self.assertLessEqual(moments[1][1] - moments[0][1], 1)

    def test_is_used_without_a_pointer(self):
        """Tab reaches the switch and the image, whose keys move the camera; Tab leaves it again."""
        self.browser.click("Live", lambda: not self.browser.all(".live canvas"), "the end of the live view")
        self.browser.execute_script("document.activeElement.blur()")

        def tab_to(selector):
            for _ in range(80):
                ActionChains(self.browser).send_keys(Keys.ESCAPE, Keys.TAB).perform()
                if self.browser.execute_script("return document.activeElement.matches(arguments[0])", selector):
                    return
            self.fail(f"Tab does not reach {selector}")

        tab_to(".live-switch")
        ActionChains(self.browser).send_keys(Keys.ENTER).perform()
        self.resting()
        tab_to(".canvas")
        before = self.editor("return view.state.doc.toString()")
        ActionChains(self.browser).send_keys("d", "s", Keys.ARROW_UP, "-").perform()
        self.browser.until(lambda: self.editor("return view.state.doc.toString()") != before, "the camera in the text")
        self.resting()
        tab_to(".caption button")

    def test_fits_screens_and_survives_the_loss_of_its_context(self):
        for width, height, density in ((390, 844, 3), (3840, 2160, 1), (900, 600, 1)):
            self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": width, "height": height, "deviceScaleFactor": density, "mobile": False})
            self.browser.until(lambda: self.browser.execute_script(
                "const c = document.querySelector('.live canvas'), box = c.closest('.canvas'), d = devicePixelRatio;"
                "return Math.abs(Math.min(box.clientWidth * d / 96, box.clientHeight * d / 72, Math.sqrt(4194304 / 6912)) * 96 - c.width) < 2"), f"a image for {width} pixels")
        self.browser.execute_script("document.querySelector('.live canvas').getContext('webgl2').getExtension('WEBGL_lose_context').loseContext()")
        self.browser.until(lambda: any("images come from the service" in each.text for each in self.browser.all(".banner")), "the note")
        self.assertEqual(self.browser.all(".live canvas"), [])
        self.browser.until(lambda: self.browser.all(".canvas img"), "a draft")
        self.browser.button("Live").click()
        self.resting()


class WithoutWebGL(BrowserTest):
    arguments = ("--disable-3d-apis",)

    def test_shows_a_note_and_drafts(self):
        self.open("#/new?live=on", lambda: any("no WebGL2" in each.text for each in self.browser.all(".banner")), "the note")
        self.browser.until(lambda: self.browser.all(".canvas img"), "a draft")
