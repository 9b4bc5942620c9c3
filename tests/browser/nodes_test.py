"""The page of one node of several: all nodes, and jobs of any of them."""
import unittest

from tests.browser.browser import Browser, BrowserTest
from tests.cluster.nodes import Cluster
from tests.http.daemon import long_scene, scene


class Nodes(BrowserTest):
    @classmethod
    def setUpClass(cls):
        cls.cluster = Cluster()
        cls.addClassCleanup(cls.cluster.__exit__)
        cls.daemon = cls.cluster.node("api")
        cls.worker = cls.cluster.node("worker", "--jobs", "3")
        cls.cluster.wait_for_nodes(2)
        cls.browser = Browser(arguments=cls.arguments)
        cls.addClassCleanup(cls.browser.quit)

    def rows(self):
        """{role: jobs} of the first panel."""
        cells = [[cell.text for cell in row.find_elements("css selector", "td")] for row in self.browser.all(".columns .panel:first-child tbody tr")]
        return {role: jobs for _, role, jobs, *_ in cells}

    def test_are_listed_with_their_jobs(self):
        job = self.daemon.submit(long_scene())
        self.daemon.wait_for_state(job, "running")
        self.open("#/system")
        self.browser.until(lambda: self.rows() == {"api": "0 / 0", "worker": "1 / 3"}, "both nodes")
        self.daemon.request("POST", f"/v1/jobs/{job}/cancel")
        self.browser.until(lambda: self.rows() == {"api": "0 / 0", "worker": "0 / 3"}, "the end of the job")

    def test_show_the_images_of_others(self):
        """The queue follows events of a job that another node renders, and the job's page has its image."""
        self.open("#/")
        self.browser.one(".queue")
        job = self.daemon.submit(scene(name="elsewhere"))
        row = self.browser.until(lambda: next((each for each in self.browser.all(f'tr[data-id="{job}"]') if "succeeded" in each.text.lower()), None), "the end in the list")
        row.find_element("css selector", ".c-name a").click()
        self.browser.until(lambda: self.browser.execute_script("const image = document.querySelector('.viewer .canvas img'); return image && image.naturalWidth > 0"), "the image")


if __name__ == "__main__":
    unittest.main()
