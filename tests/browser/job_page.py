"""The page of a job, for its tests: examples, the error account, layers of EXR files as the page reads them."""
import base64
import json
import random

import numpy

from tests.browser.browser import BrowserTest
from tests.fuzz import seeds
from tests.support.images import read_exr_channels
from tests.support.sources import SOURCE

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

    def check_account(self, job):
        """Acceptance test 20 for one job: shares sum to one, levels equal the report."""
        ended = self.daemon.wait_for_end(job)
        self.assertEqual(ended["state"], "succeeded", ended["problem"])
        self.browser.execute_script("location.hash = '#/nothing'")
        self.browser.until(lambda: not self.browser.all(".tab"), "the page of no job")
        self.browser.execute_script("location.hash = arguments[0]", f"#/jobs/{job}?tab=error")
        error = ended["report"]["error"]
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

    def check_layers(self, name, half):
        """Acceptance test 22 for one example: the page reads every channel as the reader of tests/support does."""
        output = {"formats": ["exr"], "layers": ["depth", "normal", "albedo", "object_id", "samples", "error"], "half": half}
        job = self.finished(example(name, accuracy={"samples": [3, 3]}, output=output))
        data = self.daemon.get(f"/v1/jobs/{job['id']}/image.exr").body
        width, height, found = self.read_channels(data)
        expected = read_exr_channels(data)
        self.assertEqual((width, height, set(found)), (80, 60, set(expected)))
        self.assertGreaterEqual(len(found), 13)
        for channel, values in expected.items():
            read = numpy.frombuffer(base64.b64decode(found[channel]), numpy.float32).reshape(height, width)
            numpy.testing.assert_array_equal(read, numpy.asarray(values, numpy.float32).reshape(height, width), channel)

    def check_links(self, name):
        """Acceptance test 23 for one example: the first need of the cost leads to the value that has it."""
        job = self.finished(example(name, accuracy={"samples": [1, 1]}))
        self.open(f"#/jobs/{job['id']}?tab=cost")
        link = self.browser.until(lambda: self.browser.all(".needs a"), "the needs")[0]
        pointer = link.text
        link.click()
        self.browser.until(lambda: self.browser.execute_script("return !!document.querySelector('.editor')?.shadowRoot?.querySelector('.cm-content')"), "the editor")
        value = json.loads(json.dumps(example(name)))
        for part in pointer.split("/")[1:]:
            value = value[int(part)] if isinstance(value, list) else value[part]

        def found():
            at, text = self.editor("return [view.state.selection.main.head, view.state.doc.toString()]")
            return at > 0 and json.JSONDecoder().raw_decode(text[at:])[0] == value
        self.browser.until(found, pointer)

    def mutations(self, good, count):
        """The EXR files of the corpus, then changed copies of a good one."""
        files = [seed for seed in seeds.read("image").values() if seed[:4] == b"\x76\x2f\x31\x01"]
        self.assertGreaterEqual(len(files), 10)
        pick = random.Random(7)
        for _ in range(count):
            changed = bytearray(good)
            for _ in range(pick.randint(1, 8)):
                changed[pick.randrange(min(len(changed), 700))] = pick.randrange(256)
            files.append(bytes(changed[:pick.randint(1, len(changed))] if pick.random() < 0.3 else changed))
        return files
