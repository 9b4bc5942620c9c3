"""Compare: numbers against the command line, modes, links, the way there."""
import json
import pathlib
import re
import subprocess
import tempfile
import unittest

from selenium.webdriver.common.action_chains import ActionChains

from tests.browser.browser import BrowserTest
from tests.http.daemon import scene
from tests.support.whittle import BIN


class Compare(BrowserTest):
    def rendered(self, **changes):
        job = self.daemon.submit(scene(96, 72, **changes))
        self.assertEqual(self.daemon.wait_for_end(job)["state"], "succeeded")
        return job

    def by_command(self, first, second):
        """`whittle diff --json` of the two PNGs."""
        with tempfile.TemporaryDirectory() as folder:
            paths = []
            for index, job in enumerate((first, second)):
                paths.append(pathlib.Path(folder, f"{index}.png"))
                paths[-1].write_bytes(self.daemon.get(f"/v1/jobs/{job}/image.png").body)
            done = subprocess.run([BIN / "whittle", "diff", *paths, "--json"], check=False, capture_output=True, text=True)
        return json.loads(done.stdout)

    def figures(self):
        """{RMS, bias, PSNR} as the page computed them."""
        values = self.browser.until(lambda: self.browser.all(".facts-list dd[data-value]"), "the numbers")
        return [float(each.get_attribute("data-value").replace("Infinity", "inf")) for each in values]

    def test_has_the_numbers_of_the_command(self):
        """Acceptance test 35."""
        base = self.rendered(name="base")
        for changes in ({"samples": 4}, {"ambient": 0.3}, {"background": {"color": [0.2, 0.1, 0.4]}}, {"output": {"exposure": 1.2}},
                        {"camera": {"position": [0, 1, 6], "look_at": [0, 0.5, 0], "fov": 42}}, {"accuracy": {"samples": [1, 1], "seed": 3}},
                        {"lights": [{"type": "point", "position": [-4, 6, 5]}]}, {"samples": 9}, {"ambient": [0.1, 0.4, 0.2]}):
            other = self.rendered(**changes)
            expected = self.by_command(base, other)
            self.open(f"#/compare?a={base}&b={other}&tolerance={expected['rmse'] + 0.001}")
            rms, bias, psnr = self.figures()
            self.assertAlmostEqual(rms, expected["rmse"], delta=0.001)
            self.assertAlmostEqual(bias, expected["bias"], delta=0.001)
            if expected["psnr_db"] is not None:
                self.assertAlmostEqual(psnr, expected["psnr_db"], delta=0.001)
            self.assertEqual(self.browser.text(".verdict"), "Pass")
            if expected["rmse"] > 0.002:
                self.browser.execute_script("const field = document.querySelector('.tolerance'); field.value = arguments[0];"
                                            "field.dispatchEvent(new Event('input', {bubbles: true}))", str(expected["rmse"] - 0.001))
                self.browser.until(lambda: self.browser.text(".verdict") == "Fail", "the verdict")

    def test_equal_images_differ_by_nothing(self):
        job = self.rendered()
        self.open(f"#/compare?a={job}&b={job}")
        rms, bias, _ = self.figures()
        self.assertEqual((rms, bias), (0, 0))
        self.assertIn("The documents are equal", self.browser.text(".tab"))

    def test_lists_what_differs_only(self):
        first, second = self.rendered(), self.rendered(ambient=0.25)
        self.open(f"#/compare?a={first}&b={second}")
        self.figures()
        self.assertEqual([each.text for each in self.browser.all(".tab td code")], ["/ambient"])

    def test_links_restore_mode_and_place(self):
        """Acceptance test 36."""
        first, second = self.rendered(), self.rendered(ambient=0.25)
        self.open(f"#/compare?a={first}&b={second}")
        self.figures()
        self.browser.button("Difference").click()
        self.browser.until(lambda: self.browser.all(".viewer img"), "the map")
        self.browser.button("+").click()
        self.browser.until(lambda: "z=" in self.browser.current_url, "the zoom in the address")
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

    def test_is_reached_from_a_job(self):
        first, second = self.rendered(name="this"), self.rendered(name="that")
        self.open(f"#/jobs/{second}")
        self.browser.button("Compare").click()
        self.browser.button("this").click()
        self.browser.until(lambda: self.browser.current_url.endswith(f"a={second}&b={first}"), "the comparison")
        self.figures()


def numbers(style):
    return re.findall(r"-?\d+(?:\.\d+)?", style)


if __name__ == "__main__":
    unittest.main()
