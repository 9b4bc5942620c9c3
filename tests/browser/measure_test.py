"""The trade-off page: the points of a measurement as a plot and as a table, choices, and what follows from them."""
import json
import urllib.parse

from tests.browser.browser import BrowserTest
from tests.http.daemon import json_of, scene
from tests.support.sources import SOURCE


class TradeOff(BrowserTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        document = {**json.loads((SOURCE / "scenes/tiny.json").read_text(encoding="utf-8")), "image": {"width": 48, "height": 36}}
        cls.rendered = cls.daemon.wait_for_end(cls.daemon.submit({**document, "accuracy": {"samples": [1, 1]}}))["id"]
        request = {"scene": document, "settings": {"parameters": ["target_error", "samples"], "reference_samples": 64}}
        cls.job = cls.daemon.wait_for_end(json_of(cls.daemon.request("POST", "/v1/measure", request))["id"])
        assert cls.job["state"] == "succeeded", cls.job["problem"]
        cls.points = cls.job["measurement"]["points"]

    def set_limit(self, limited, value):
        self.browser.execute_script("const field = document.querySelector(`input[data-limit=${arguments[0]}]`); field.value = arguments[1];"
                                    "field.dispatchEvent(new Event('input', {bubbles: true}))", limited, str(value))

    def chosen(self):
        """The index of the selected point, which plot and table agree on."""
        in_plot = [each.get_attribute("data-point") for each in self.browser.all(".tradeoff g[data-selected=true]")]
        in_table = [each.get_attribute("data-point") for each in self.browser.all(".points tr[aria-current]")]
        return int(in_plot[0]) if in_plot and in_plot == in_table else None

    def test_plot_and_table_show_every_point(self):
        """A part of acceptance test 37."""
        self.open(f"#/measure/{self.job['id']}", lambda: self.browser.all(".tradeoff g"), "the plot")
        self.assertEqual({int(each.get_attribute("data-point")) for each in self.browser.all(".tradeoff g")}, set(range(len(self.points))))
        rows = {int(row.get_attribute("data-point")): [cell.text for cell in row.find_elements("css selector", "td")]
                for row in self.browser.all(".points tbody tr")}
        self.assertEqual(set(rows), set(range(len(self.points))))
        for index, point in enumerate(self.points):
            name, seconds, error, claimed = rows[index]
            self.assertIn(f"{point['parameter']} {point['value']}", name)
            self.assertEqual("best" in name, index in self.job["measurement"]["pareto_front"])
            self.assertAlmostEqual(float(seconds.split()[0]) / (1000 if seconds.endswith(" ms") else 1), point["seconds"], delta=0.06 * point["seconds"])
            self.assertEqual(error.startswith("≤"), "error" in point["upper_limits"])
            self.assertAlmostEqual(float(error.strip("≤ ")), point["error"], delta=0.06 * point["error"])
            self.assertAlmostEqual(float(claimed.split()[0]), point["claimed"], delta=0.06 * point["claimed"])
        heights = self.browser.execute_script("return Object.fromEntries([...document.querySelectorAll('.tradeoff g')].map(each => "
                                              "[each.dataset.point, new DOMMatrix(getComputedStyle(each.querySelector('.mark')).transform).f]))")
        by_error = sorted((point["error"], -heights[str(index)]) for index, point in enumerate(self.points) if point["error"] > 0)
        self.assertEqual([height for _, height in by_error], sorted(height for _, height in by_error), "a greater error is drawn higher")
        self.browser.button("True error", ".points").click()
        first = [int(row.get_attribute("data-point")) for row in self.browser.all(".points tbody tr")]
        errors = [self.points[index]["error"] for index in first]
        self.assertEqual(errors, sorted(errors))

    def test_picks_the_best_point_within_a_limit(self):
        """A part of acceptance test 37."""
        self.open(f"#/measure/{self.job['id']}", lambda: self.browser.all(".tradeoff g"), "the plot")
        front = [self.points[index] for index in self.job["measurement"]["pareto_front"]]
        for limited, other, limit in (("claimed", "seconds", 1), ("claimed", "seconds", 4), ("seconds", "claimed", sorted(each["seconds"] for each in front)[len(front) // 2])):
            best = min((each for each in front if each[limited] <= limit), key=lambda each: each[other])
            self.set_limit(limited, limit)
            self.browser.until(lambda best=best: self.chosen() == self.points.index(best), f"{limited} {limit}")
        self.set_limit("seconds", 1e-9)
        self.browser.until(lambda: "No setting is that fast" in self.browser.text(".choice [role=status]"), "the refusal")

    def test_renders_and_edits_with_the_chosen_setting(self):
        """A part of acceptance test 37."""
        index = next(i for i, each in enumerate(self.points) if each["parameter"] == "samples" and each["value"] == "4")
        self.open(f"#/measure/{self.job['id']}?point={index}")
        self.browser.button("Render with it").click()
        other = self.browser.until(lambda: "/jobs/" in self.browser.current_url and self.browser.current_url.split("/jobs/")[1], "the job")
        self.assertEqual(self.daemon.job(other)["accuracy"], self.points[index]["settings"])
        self.assertNotIn("scene", json_of(self.daemon.get(f"/v1/jobs/{other}/scene")))
        self.open(f"#/measure/{self.job['id']}?point={index}")
        self.browser.click("Put into the document", lambda: self.browser.all(".canvas img"), "the draft")
        edited = json.loads(self.editor("return view.state.doc.toString()"))
        self.assertEqual(edited["accuracy"], self.points[index]["settings"])
        self.assertEqual(edited["name"], "tiny")

    def test_compares_a_setting_with_the_reference(self):
        """The new render against reference.exr: the error that the measurement found for the setting."""
        index = next(i for i, each in enumerate(self.points) if each["parameter"] == "samples" and each["value"] == "4")
        self.open(f"#/measure/{self.job['id']}?point={index}")
        self.browser.button("Compare with the reference").click()
        rms = self.browser.until(lambda: self.browser.all(".facts-list dd[data-value]"), "the numbers")[0].get_attribute("data-value")
        self.assertIn(f"#/compare?a={self.job['id']}/reference.exr&b=", urllib.parse.unquote(self.browser.current_url))
        self.assertAlmostEqual(float(rms), self.points[index]["error"], delta=0.1 * self.points[index]["error"] + self.job["measurement"]["reference"]["error"])
        self.browser.until(lambda: self.browser.execute_script("return [...document.querySelectorAll('.canvas img')].map((each) => each.naturalWidth)") == [48, 48], "both images")

    def test_is_where_a_measurement_of_a_job_leads(self):
        self.open(f"#/jobs/{self.rendered}")
        self.browser.click("Measure", lambda: "#/measure/" in self.browser.current_url, "the page")
        self.browser.until(lambda: "The reference is computed" in self.browser.text(".measure") or self.browser.all(".tradeoff g"), "its progress")
        measured = self.browser.current_url.split("/measure/")[1].split("?")[0]
        self.daemon.request("POST", f"/v1/jobs/{measured}/cancel")
        self.open("#/")
        link = self.browser.one(f'.rows tr[data-id="{self.job["id"]}"] .c-name a')
        self.assertTrue(link.get_attribute("href").endswith(f"#/measure/{self.job['id']}"))

    def test_has_no_points_of_a_render(self):
        self.open(f"#/measure/{self.daemon.submit(scene())}", lambda: "This job is a render" in self.browser.text(".empty"), "the sentence")
