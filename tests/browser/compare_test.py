"""Compare: numbers against the command line, modes, links, the way there."""
import json
import re

import numpy
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

from tests.browser.browser import SCRIPTS, BrowserTest
from tests.http.daemon import json_of, scene, sha256
from tests.support.images import read_png
from tests.support.whittle import temporary_directory, whittle


class Compare(BrowserTest):
    def rendered(self, **changes):
        return self.daemon.rendered(scene(96, 72, **changes))["id"]

    def by_command(self, first, second, name="image.png"):
        """`whittle diff --json` of the files of two jobs."""
        paths = []
        for job in (first, second):
            paths.append(temporary_directory(self) / name)
            paths[-1].write_bytes(self.daemon.get(f"/v1/jobs/{job}/{name}").body)
        return json.loads(whittle("diff", *paths, "--json").stdout)

    def figures(self):
        """{RMS, bias, PSNR} as the page computed them."""
        values = self.browser.until(lambda: self.browser.all(".facts-list dd[data-value]"), "the numbers")
        return [float(each.get_attribute("data-value").replace("Infinity", "inf")) for each in values]

    def assert_shows(self, expected):
        """The numbers of the command on the page, and its greatest difference."""
        rms, bias, psnr = self.figures()
        self.assertAlmostEqual(rms, expected["rmse"], delta=0.001)
        self.assertAlmostEqual(bias, expected["bias"], delta=0.001)
        if expected["psnr_db"] is not None:
            self.assertAlmostEqual(psnr, expected["psnr_db"], delta=0.001)
        x, y, levels = (float(part) for part in numbers(self.browser.text(".facts-list .link")))
        self.assertAlmostEqual(levels, expected["greatest"], delta=0.05 * expected["greatest"])  # two digits are shown
        if expected["worst"] and len(expected["worst"]) < 5:
            self.assertIn((x, y), [(each["x"], each["y"]) for each in expected["worst"]])

    def test_has_the_numbers_of_the_command(self):
        """Acceptance test 35."""
        base = self.rendered(name="base")
        for changes in ({"samples": 9}, {"background": {"color": [0.2, 0.1, 0.4]}}, {"camera": {"position": [0, 1, 6], "look_at": [0, 0.5, 0], "fov": 42}},
                        {"accuracy": {"samples": [1, 1], "seed": 3}}):
            other = self.rendered(**changes)
            expected = self.by_command(base, other)
            self.open(f"#/compare?a={base}&b={other}&tolerance={expected['rmse'] + 0.001}")
            self.assert_shows(expected)
            self.assertEqual(self.browser.text(".verdict"), "Pass")
            if expected["rmse"] > 0.002:
                self.browser.execute_script(SCRIPTS + "type('.tolerance', arguments[0])", str(expected["rmse"] - 0.001))
                self.browser.until(lambda: self.browser.text(".verdict") == "Fail", "the verdict")

    def test_lets_the_service_compare_what_it_cannot(self):
        """Acceptance test 35 for jobs without a PNG; the view.png of each is shown, and the service's heat map."""
        jobs = [self.rendered(name="linear", output={"formats": ["exr"]}, **changes) for changes in ({}, {"ambient": 0.2})]
        expected = self.by_command(*jobs, "image.exr")
        self.assertGreater(expected["rmse"], 1)
        self.browser.requests()
        self.open(f"#/compare?a={jobs[0]}&b={jobs[1]}&tolerance={expected['rmse'] - 0.001}")
        self.assert_shows(expected)
        self.assertEqual(self.browser.text(".verdict"), "Fail")
        self.assertIn("Compared by the service (OpenEXR, OpenEXR)", self.browser.text(".tab"))
        self.assertIn(("POST", self.address("v1/compare")), self.browser.requests())
        self.browser.until(lambda: self.widths(".canvas img") == [96, 96], "both images")
        self.assertFalse(self.browser.button("Sign").is_enabled())
        self.browser.click("Difference", lambda: self.widths(".canvas img") == [96], "the heat map")

    def widths(self, selector):
        return self.browser.execute_script("return [...document.querySelectorAll(arguments[0])].map((each) => each.naturalWidth)", selector)

    def test_compares_with_a_file_of_the_user(self):
        """A reference by its hash: uploaded once, linear images are shown as sRGB."""
        job, other = self.rendered(name="tried"), self.rendered(name="reference", ambient=0.2, output={"formats": ["png", "exr"]})
        for name in ("image.png", "image.exr"):
            path = temporary_directory(self) / name
            path.write_bytes(self.daemon.get(f"/v1/jobs/{other}/{name}").body)
            self.open(f"#/compare?a={job}")
            self.browser.one("input[type=file]").send_keys(str(path))
            upload = sha256(path.read_bytes())
            self.browser.until(lambda upload=upload: f"b={upload}" in self.browser.current_url, "the hash in the address")
            expected = json_of(self.daemon.request("POST", "/v1/compare", {"a": job, "b": upload}))
            self.assert_shows(expected)
            self.browser.until(lambda: self.widths(".canvas img") == [96, 96], "both images")
            self.assertEqual(self.browser.all(".tab thead"), [])  # a file has no document
        drawn = self.browser.execute_script(SCRIPTS + "return codesOf('.canvas img[data-cover]')")
        exact = read_png(self.daemon.get(f"/v1/jobs/{other}/image.png").body)
        difference = numpy.abs(numpy.array(drawn).reshape(72, 96, 3) - exact[:, :, :3].astype(int))
        self.assertLessEqual(difference.max(), 1)  # the PNG is of the values before they were rounded to halves

    def test_lists_what_differs_and_links_restore_mode_and_place(self):
        """Acceptance test 36."""
        first, second = self.rendered(), self.rendered(ambient=0.25)
        self.open(f"#/compare?a={first}&b={second}")
        self.figures()
        self.assertEqual([each.text for each in self.browser.all(".tab td code")], ["/ambient"])
        self.browser.click("Difference", lambda: self.browser.all(".viewer img"), "the map")
        self.browser.click("+", lambda: "z=" in self.browser.current_url, "the zoom in the address")
        address, style = self.browser.current_url, self.browser.one(".viewer img").get_attribute("style")
        self.open()
        self.browser.get("about:blank")
        self.browser.get(address)
        self.browser.until(lambda: self.browser.all(".viewer img"), "the map")
        self.assertEqual(self.browser.button("Difference").get_attribute("aria-pressed"), "true")
        restored = self.browser.one(".viewer img").get_attribute("style")
        self.assertEqual([round(float(part)) for part in numbers(restored)], [round(float(part)) for part in numbers(style)])

    def test_does_not_blink_if_motion_is_unwanted(self):
        """Acceptance test 46."""
        first, second = self.rendered(), self.rendered(ambient=0.25)
        self.browser.prefer(prefers_reduced_motion="reduce")
        self.open(f"#/compare?a={first}&b={second}&mode=blink")
        self.assertFalse(self.browser.button("Blink").is_enabled())
        self.assertEqual(self.browser.all(".blink"), [])
        self.browser.prefer(prefers_reduced_motion="no-preference")
        self.open(f"#/compare?a={first}&b={second}&mode=blink")
        shown = set()
        self.browser.until(lambda: shown.add(self.browser.text(".blink strong")) or len(shown) == 2, "both images")
        ActionChains(self.browser).send_keys(" ").perform()
        self.browser.button("Play")

    def test_equal_images_differ_by_nothing_and_a_tolerance_has_decimals(self):
        job = self.rendered()
        self.open(f"#/compare?a={job}&b={job}&tolerance=0")
        self.assertEqual(self.figures(), [0, 0, float("inf")])
        self.assertTrue(self.browser.text(".viewer .switch").startswith("A | B"))
        self.assertIn("The documents are equal", self.browser.text(".tab"))
        field = self.browser.one(".tolerance")
        self.assertEqual(field.get_attribute("value"), "0")
        for typed in ("0.05", "1e-3"):
            field.send_keys(Keys.CONTROL, "a")
            field.send_keys(typed)
            self.assertEqual(field.get_attribute("value"), typed)
            self.browser.until(lambda typed=typed: self.browser.current_url.endswith(f"tolerance={typed}"), "the address")


def numbers(style):
    return re.findall(r"-?\d+(?:\.\d+)?", style)
