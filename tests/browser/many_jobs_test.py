"""Many jobs: the queue, the contact sheet and the animation of a batch."""
import time

import numpy
from selenium.webdriver.common.action_chains import ActionChains

from tests.browser.batches_test import LATER, BatchesTest
from tests.browser.browser import BrowserTest
from tests.http.daemon import json_of, scene
from tests.support.images import read_png


# Scrolls ten rows a frame as far as row 1,990, and records the longest frame and the most rows.
SCROLL = """window.longest = 0; window.most = 0; window.scrolled = false;
let last = 0, place = 0;
(function frame(now) {
  if (last) longest = Math.max(longest, now - last);
  last = now;
  most = Math.max(most, document.querySelectorAll('.rows tbody tr[data-id]').length);
  if (place === 1990) { scrolled = true; return; }
  const rows = document.querySelector('.rows');
  if (rows.scrollTop === 44 * place) place += 10;  // else the list ends before, until more of it is read
  rows.scrollTop = 44 * place;
  requestAnimationFrame(frame);
})(0);"""


class FullQueue(BrowserTest):
    options = ("--queued-jobs", "100000")

    def test_shows_the_first_rows_of_100000_jobs_at_once(self):
        """Acceptance test 13; the times and the heap are printed."""
        for batch in range(10):
            frames = [{"name": f"frame {10_000 * batch + index}"} for index in range(10_000)]
            reply = self.daemon.request("POST", "/v1/batches", {"scene": scene(job=LATER), "frames": frames})
            self.assertEqual(reply.status, 202, reply.body)
        begin = time.monotonic()
        self.open("#/")
        self.browser.until(lambda: self.browser.all(".rows tbody tr[data-id]"), "rows")
        print(f"first rows of 100,000 after {time.monotonic() - begin:.2f} s")
        self.browser.until(lambda: any("100 k" in each.text for each in self.browser.all(".count")), "the count")
        self.browser.execute_script(SCROLL)
        self.browser.until(lambda: self.browser.execute_script("return scrolled"), "the end of the scrolling")
        rows = self.browser.execute_script("return most")
        self.assertLessEqual(rows, 60)
        self.browser.until(lambda: "frame 98010" in self.browser.execute_script("return [...document.querySelectorAll('.rows .c-name a')].map((each) => each.textContent)"), "row 1,990")
        self.browser.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
        heap = self.browser.execute_cdp_cmd("Runtime.getHeapUsage", {})["usedSize"] / 1e6
        print(f"scrolled through 2,000 rows: longest frame {self.browser.execute_script('return longest'):.0f} ms, {rows} rows, heap {heap:.0f} MB")


class ManyJobs(BatchesTest):
    def test_shows_few_cells_of_many_jobs(self):
        """2,500 jobs in rows and columns, and 450 images in sequence: what is in view exists, and is loaded."""
        batch_id = self.submitted(scene=scene(job=LATER), sweep={"/camera/fov": list(range(20, 70)), "/image/width": list(range(8, 58))})
        self.open(f"#/batches/{batch_id}")
        self.browser.until(lambda: len(self.cells()) > 20, "cells")
        self.browser.execute_script("const axes = document.querySelector('.axes'), main = document.querySelector('main');"
                                    "axes.scrollLeft = axes.scrollWidth; main.scrollTop = main.scrollHeight;")
        self.browser.until(lambda: self.cells().get(2499) == "queued" and 0 not in self.cells(), "the last cell")
        self.assertLessEqual(len(self.browser.all(".cell")), 100)
        self.assertEqual(self.browser.all(".axes tbody tr th")[-1].text, "69")
        self.daemon.request("POST", f"/v1/batches/{batch_id}/cancel")
        batch_id = self.ended(self.submitted(scene=scene(128, 96), frames=[{"camera": {"fov": 30 + index / 15}} for index in range(450)]))
        self.browser.requests()
        self.open(f"#/batches/{batch_id}")
        self.browser.until(lambda: len(self.browser.all(".cell img")) > 20, "images")
        self.browser.execute_script("const main = document.querySelector('main'); main.scrollTop = main.scrollHeight;")
        self.browser.until(lambda: self.cells().get(449) == "succeeded" and 0 not in self.cells(), "the last image")
        self.browser.until(lambda: self.browser.all('.cell[data-index="449"] img'), "its image")
        self.assertLessEqual(len(self.browser.all(".cell")), 100)
        previews = {url for _, url in self.browser.requests() if "/preview?max=" in url}
        total = sum(len(self.daemon.get(url.split(str(self.daemon.port))[1]).body or self.image_of(url)) for url in previews)
        print(f"{len(previews)} thumbnails, {total / 1000:.0f} kB, in two views of 450")
        self.assertLessEqual(total, 2 * 400_000)

    def image_of(self, preview):
        """The image that a preview leads to."""
        return self.daemon.get(preview.split(str(self.daemon.port))[1].split("/preview")[0] + "/image.png").body

    def shown(self):
        return self.browser.execute_script("return document.querySelector('.player canvas')?.dataset.shown ?? ''")

    def test_plays_the_images(self):
        """Acceptance test 40; the number of late images is printed."""
        batch_id = self.ended(self.submitted(scene=scene(640, 360), frames=[{"camera": {"fov": 30 + index / 5}} for index in range(100)]))
        self.open(f"#/batches/{batch_id}")
        self.browser.button("Animation").click()
        self.browser.until(lambda: self.shown() == "0", "the first image")
        for label, place in (("Last", "99"), ("First", "0"), ("Middle", "49")):
            self.browser.button(label, ".player").click()
            self.browser.until(lambda place=place: self.shown() == place, label)
        ActionChains(self.browser).send_keys(".").send_keys(".").send_keys(",").perform()
        self.browser.until(lambda: self.shown() == "50", "steps by key")
        self.browser.execute_script("const place = document.querySelector('.player input[type=range]'); place.value = 0; place.dispatchEvent(new Event('input', {bubbles: true}));"
                                    "window.seen = []; new MutationObserver(() => seen.push(Number(document.querySelector('.player canvas').dataset.shown)))"
                                    ".observe(document.querySelector('.player canvas'), {attributeFilter: ['data-shown']})")
        self.browser.until(lambda: self.shown() == "0", "the begin")
        self.browser.button("Play", ".player").click()
        self.browser.until(lambda: len(self.browser.execute_script("return seen")) >= 99, "a turn")
        self.browser.button("Pause", ".player").click()
        seen = self.browser.execute_script("return seen")
        late = int(self.browser.one(".player canvas").get_attribute("data-dropped"))
        print(f"{late} of {len(seen) + late} images were late at 24 images/s")
        steps = [(b - a) % 100 for a, b in zip(seen, seen[1:], strict=False)]
        self.assertGreaterEqual(min(steps), 1)
        self.assertLessEqual(sum(step - 1 for step in steps), late)
        place = int(self.browser.until(self.shown, "an image"))
        drawn = self.browser.execute_script("const canvas = document.querySelector('.player canvas'); return [...canvas.getContext('2d').getImageData(0, 180, 640, 1).data]")
        jobs = json_of(self.daemon.get(f"/v1/jobs?batch={batch_id}&limit=200"))["items"]
        exact = read_png(self.daemon.get(f"/v1/jobs/{jobs[99 - place]['id']}/image.png").body)
        numpy.testing.assert_array_equal(numpy.array(drawn).reshape(640, 4)[:, :3], exact[180, :, :3])
