"""The page of a job: progress, error account, heat map, layers of EXR files, actions."""
import base64
import json
import os
import pathlib
import random
import subprocess
import sys
import tempfile
import unittest
import urllib.request

import numpy

from tests.browser.browser import BrowserTest
from tests.http.daemon import json_of, long_scene, scene
from tests.support.images import read_exr_channels
from tests.support.sources import SOURCE
from tests.support.whittle import BIN

SMALL_SCENES = ("cornell", "haze", "instances", "isometric", "lens", "lights", "local_models", "panorama", "relief", "shapes", "tiny",
                "tone", "torus", "transparency")


def example(name, **changes):
    document = json.loads((SOURCE / f"scenes/{name}.json").read_text(encoding="utf-8"))
    return {**document, "image": {"width": 80, "height": 60}, "job": {"cache": "off"}, **changes}


def digits(value):
    """As the page writes numbers: two significant digits below 100."""
    return 0 if value == 0 else float(f"{value:.{2 if abs(value) < 100 else 3 if abs(value) < 1000 else 4}g}")


class JobPage(BrowserTest):
    options = ("--assets", str(SOURCE / "scenes"))

    def finished(self, document):
        job = self.daemon.wait_for_end(self.daemon.submit(document))
        self.assertEqual(job["state"], "succeeded", job["problem"])
        return job

    def table(self):
        """{part: (share in percent, levels)} of the error account."""
        self.browser.until(lambda: self.browser.all(".tab .plain tbody tr"), "the table")
        rows = self.browser.execute_script("return [...document.querySelectorAll('.tab .plain tbody tr')].map(row => [...row.cells].map(cell => cell.innerText.trim()))")
        return {name: (float(share.rstrip(" %") or "nan"), float(levels)) for name, share, levels in rows}

    def read_channels(self, data):
        """The channels of an EXR as the page's worker reads them; a sentence if it refuses the file."""
        return self.browser.execute_async_script("""
          const done = arguments[1], bytes = Uint8Array.from(atob(arguments[0]), c => c.charCodeAt(0)).buffer;
          window.reader ??= new Worker(trustedTypes.createPolicy('test', {createScriptURL: x => x}).createScriptURL(
            document.querySelector('script').src.replace('main.js', 'image-worker.js')), {type: 'module'});
          reader.onmessage = ({data}) => {
            if (data.error !== undefined) { done(data.error); return; }
            const {width, height, channels} = data.result, found = {};
            for (const [name, values] of Object.entries(channels)) {
              const raw = new Uint8Array(values.buffer); let text = '';
              for (let i = 0; i < raw.length; i += 4096) text += String.fromCharCode(...raw.subarray(i, i + 4096));
              found[name] = btoa(text);
            }
            done([width, height, found]);
          };
          reader.postMessage({id: 1, method: 'exr', bytes});""", base64.b64encode(data).decode())


class Account(JobPage):
    def test_shares_sum_to_one_and_levels_equal_the_report(self):
        """Acceptance test 20, for the small examples."""
        settings = ({"target_error": 20}, {"samples": [2, 2], "cutoff": 0.05, "max_depth": 2, "approximate": {"reflections": "environment"}})
        cases = [(name, accuracy) for name in SMALL_SCENES for accuracy in settings]
        jobs = [self.daemon.submit(example(name, accuracy=accuracy)) for name, accuracy in cases]
        self.open("#/nothing")
        for (name, accuracy), job in zip(cases, jobs):
            with self.subTest(name, accuracy=accuracy):
                error = self.daemon.wait_for_end(job)
                self.assertEqual(error["state"], "succeeded", error["problem"])
                self.browser.execute_script("location.hash = '#/nothing'")
                self.browser.until(lambda: not self.browser.all(".tab"), "the page of no job")
                self.browser.execute_script("location.hash = arguments[0]", f"#/jobs/{job}?tab=error")
                error = error["report"]["error"]
                rows = self.table()
                shares = [rows[part][0] for part in ("Sampling", "Truncation", "Approximation")]
                self.assertTrue(all(share >= 0 for share in shares), rows)
                if error["estimate"] > 0:
                    self.assertAlmostEqual(sum(shares), 100, delta=0.15)
                    widths = [float(part.get_attribute("data-share")) for part in self.browser.all(".parts-bar .part")]
                    self.assertAlmostEqual(sum(widths), 1, delta=0.001)
                    self.assertAlmostEqual(widths[0], error["parts"]["sampling"] ** 2 / error["estimate"] ** 2, delta=0.001)
                for row, value in (("Sampling", error["parts"]["sampling"]), ("Approximation", error["parts"]["approximation"]),
                                   ("max_depth alone", error["parts"]["depth"]), ("cutoff alone", error["parts"]["cutoff"]), ("Estimate", error["estimate"])):
                    self.assertAlmostEqual(rows[row][1], digits(value), delta=0.06 * abs(value), msg=f"{row}: {rows}")

    def test_pixels_of_the_map_equal_the_layer(self):
        """Acceptance test 21, with the CLI's own reading of the file in numpy."""
        job = self.finished(example("transparency", accuracy={"samples": [4, 4]}, output={"formats": ["png", "exr"], "layers": ["error", "samples"]}))
        self.open(f"#/jobs/{job['id']}?tab=error")
        self.browser.until(lambda: self.browser.all("img[data-cover]"), "the map")
        width, _, channels = self.read_channels(self.daemon.get(f"/v1/jobs/{job['id']}/image.exr").body)
        values = numpy.frombuffer(base64.b64decode(channels["error"]), numpy.float32)
        white = float(self.browser.one("input.white").get_attribute("value"))
        colors = self.browser.execute_async_script("""const done = arguments[0], image = document.querySelector('img[data-cover]');
          image.decode().then(() => { const canvas = document.createElement('canvas'); canvas.width = image.naturalWidth; canvas.height = image.naturalHeight;
            const context = canvas.getContext('2d'); context.drawImage(image, 0, 0);
            done([...context.getImageData(0, 0, canvas.width, canvas.height).data]); });""")
        pick = random.Random(1)
        for _ in range(20):
            at = pick.randrange(len(values))
            expected = cubehelix(min(1, values[at] / white))
            self.assertLessEqual(max(abs(a - b) for a, b in zip(colors[4 * at:4 * at + 3], expected)), 2, f"x {at % width}")

    def test_offers_to_render_with_the_layers(self):
        job = self.finished(example("tiny", accuracy={"samples": [1, 1]}))
        self.open(f"#/jobs/{job['id']}?tab=error")
        self.browser.button("Render again with them").click()
        self.browser.until(lambda: self.browser.all("img[data-cover]"), "the map")
        other = self.browser.current_url.split("/jobs/")[1].split("?")[0]
        self.assertNotEqual(other, job["id"])
        images = [self.daemon.get(f"/v1/jobs/{each}/image.png").body for each in (job["id"], other)]
        self.assertEqual(*images)


def cubehelix(fraction):
    """Green 2011, equation 2, with start 0.5, rotations -1.5, hue 1, gamma 1."""
    angle = 2 * numpy.pi * (0.5 / 3 + 1 - 1.5 * fraction)
    amplitude = fraction * (1 - fraction) / 2
    matrix = numpy.array([[-0.14861, 1.78277], [-0.29227, -0.90649], [1.97294, 0]])
    color = fraction + amplitude * matrix @ numpy.array([numpy.cos(angle), numpy.sin(angle)])
    return [round(255 * float(value)) for value in numpy.clip(color, 0, 1)]


class Layers(JobPage):
    def test_equal_those_of_another_reader(self):
        """Acceptance test 22, with six layers: every channel bit for bit as the Python reader of tests/support reads it."""
        layers = ["depth", "normal", "albedo", "object_id", "samples", "error"]
        self.open("#/nothing")
        for name, half in (("shapes", False), ("transparency", True)):
            output = {"formats": ["exr"], "layers": layers, "half": half}
            job = self.finished(example(name, accuracy={"samples": [3, 3]}, output=output))
            data = self.daemon.get(f"/v1/jobs/{job['id']}/image.exr").body
            width, height, found = self.read_channels(data)
            expected = read_exr_channels(data)
            self.assertEqual((width, height, set(found)), (80, 60, set(expected)))
            self.assertGreaterEqual(len(found), 13)
            for channel, values in expected.items():
                read = numpy.frombuffer(base64.b64decode(found[channel]), numpy.float32).reshape(height, width)
                numpy.testing.assert_array_equal(read, numpy.asarray(values, numpy.float32).reshape(height, width), channel)

    def test_hostile_files_are_refused_soon(self):
        """Acceptance test 22: the corpus and mutations."""
        self.open("#/nothing")
        job = self.finished(example("tiny", image={"width": 24, "height": 20}, output={"formats": ["exr"], "layers": ["error"]}))
        good = self.daemon.get(f"/v1/jobs/{job['id']}/image.exr").body
        files = [path.read_bytes() for path in sorted((SOURCE / "tests/fuzz/corpus").rglob("*")) if path.is_file() and path.read_bytes()[:4] == b"\x76\x2f\x31\x01"]
        self.assertGreaterEqual(len(files), 10)
        pick = random.Random(7)
        for _ in range(150):
            changed = bytearray(good)
            for _ in range(pick.randint(1, 8)):
                changed[pick.randrange(min(len(changed), 700))] = pick.randrange(256)
            files.append(bytes(changed[:pick.randint(1, len(changed))] if pick.random() < 0.3 else changed))
        for file in files:
            self.assertIsInstance(self.read_channels(file), (str, list))
        self.assertIsInstance(self.read_channels(good), list, "a good file is read after them")


class Life(JobPage):
    def test_shows_a_running_job_and_cancels_it(self):
        """Acceptance test 19: the image changes before the end, with few requests."""
        job = self.daemon.submit(long_scene())
        self.daemon.wait_for_state(job, "running")
        self.open(f"#/jobs/{job}")
        self.expected.append("/preview")  # asked for while the job is cancelled
        sources = set()
        self.browser.until(lambda: self.browser.all(".viewer img") and sources.add(self.browser.one(".viewer img").get_attribute("src")) or len(sources) >= 3, "three previews")
        self.browser.button("Cancel").click()
        self.browser.button("Cancel it", "dialog[open]").click()
        self.browser.until(lambda: self.browser.text(".bar .state") == "cancelled", "the end")

    def test_reports_a_race_for_the_priority(self):
        """Acceptance test 24."""
        job = self.daemon.submit(scene(job={"run_after": "2099-01-01T00:00:00Z"}))
        self.open(f"#/jobs/{job}")
        field = self.browser.one("input.priority")
        self.expected.append("412")
        self.daemon.request("PATCH", f"/v1/jobs/{job}", {"priority": 7}, {"If-Match": "*"})
        self.browser.execute_script("arguments[0].value = '70'; arguments[0].dispatchEvent(new Event('change', {bubbles: true}))", field)
        said = self.browser.until(lambda: self.browser.text("[aria-live]"), "the race")
        self.assertRegex(said, r"priority is 7, you asked for 70")
        self.assertEqual(self.daemon.job(job)["priority"], 7)

    def test_says_why_a_job_failed(self):
        reply = self.daemon.request("POST", "/v1/jobs", scene(name="late", job={"deadline": "2020-01-01T00:00:00Z"}))
        job = json_of(reply)["id"]
        self.daemon.wait_for_state(job, "failed")
        self.open(f"#/jobs/{job}")
        self.assertIn("deadline_exceeded", self.browser.text(".note"))
        self.browser.button("Retry").click()
        self.browser.until(lambda: self.daemon.job(job)["state"] == "succeeded", "the retry")
        self.browser.until(lambda: self.browser.all(".viewer img"), "the image")
        self.browser.button("History", ".tabs").click()
        moves = json_of(self.daemon.get(f"/v1/jobs/{job}/history"))["items"]
        expected = [[move["at"], move["state"], move["code"] or ""] for move in moves]
        self.browser.until(lambda: self.browser.execute_script(
            "return [...document.querySelectorAll('.moves tbody tr')].map(row => [row.querySelector('time').dateTime, "
            "row.querySelector('.state').textContent.trim(), row.querySelector('code')?.textContent ?? ''])"
            ".map(([at, state, code]) => [at, state, state === 'running' ? '' : code])") == expected, "the moves")
        self.assertIn("deadline_exceeded", [code for _, _, code in expected])

    def test_links_lead_to_the_line_that_needs_a_feature(self):
        """Acceptance test 23, for some examples."""
        for name in ("transparency", "torus", "shapes"):
            job = self.finished(example(name, accuracy={"samples": [1, 1]}))
            self.open(f"#/jobs/{job['id']}?tab=cost")
            link = self.browser.until(lambda: self.browser.all(".needs a"), "the needs")[0]
            pointer = link.text
            link.click()
            self.browser.until(lambda: self.browser.all(".canvas img"), "the draft")
            at, text = self.editor("return [view.state.selection.main.head, view.state.doc.toString()]")
            value = json.loads(text)
            for part in pointer.split("/")[1:]:
                value = value[int(part)] if isinstance(value, list) else value[part]
            parsed, _ = json.JSONDecoder().raw_decode(text[at:])
            self.assertEqual(parsed, value, pointer)

    def test_the_document_is_shown_whole_in_an_editor_that_changes_nothing(self):
        """Of a document that is larger than the 100,000 characters that were once shown."""
        document = example("tiny", accuracy={"samples": [1, 1]})
        document["objects"] += [{**document["objects"][0], "radius": 0.5 + index / 10_000} for index in range(800)]
        text = json.dumps(document, indent=2)
        self.assertGreater(len(text), 100_000)
        job = self.finished(text.encode())
        self.open(f"#/jobs/{job['id']}?tab=document")
        self.browser.until(lambda: self.browser.all(".document .editor"), "the editor")
        self.browser.until(lambda: self.browser.execute_script("return document.querySelector('.editor').shadowRoot?.querySelector('.cm-content')"), "its text").send_keys("x")
        self.assertEqual(self.editor("return view.state.doc.toString()"), text)
        scripts = self.browser.execute_script("return performance.getEntriesByType('resource').map((each) => each.name)")
        self.assertFalse([each for each in scripts if "schema" in each])

    def test_the_copied_commands_render_the_same_image(self):
        """Acceptance test 26, also for Python and the command line."""
        job = self.finished(example("tiny", accuracy={"samples": [2, 2]}))
        self.open(f"#/jobs/{job['id']}?tab=document")
        self.browser.execute_script("Object.defineProperty(navigator, 'clipboard', {value: {writeText: async (text) => { window.copied = text; }}})")
        with urllib.request.urlopen(self.address(f"v1/jobs/{job['id']}/image.png")) as reply:
            image = reply.read()
        for name, program in (("curl", ["bash"]), ("Python", [sys.executable]), ("whittle command", ["bash"])):
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                self.browser.execute_script("window.copied = ''")
                self.browser.button(f"Copy as {name}").click()
                command = self.browser.until(lambda: self.browser.execute_script("return window.copied"), "the command")
                subprocess.run(program, input=command, text=True, check=True, cwd=folder, env={**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}"})
                self.assertEqual(pathlib.Path(folder, "image.png").read_bytes(), image)


del JobPage

if __name__ == "__main__":
    unittest.main()
