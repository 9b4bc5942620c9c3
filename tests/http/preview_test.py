"""GET /v1/jobs/{id}/preview: the image so far."""
import struct
import unittest

import numpy

from tests.http.daemon import NOBODY, SANITIZED, Daemon, OneDaemon, json_of, long_scene, scene, wait_until
from tests.support.images import read_png


def size_of(png):
    return struct.unpack(">II", png[16:24])


class Previews(OneDaemon):
    def preview(self, job_id, query="", **headers):
        return self.daemon.get(f"/v1/jobs/{job_id}/preview{query}", **headers)

    def shown(self, job_id, query=""):
        """None while there is no preview."""
        reply = self.preview(job_id, query)
        return None if reply.status == 204 else reply

    def first(self, job_id, query=""):
        """Returns the first preview; until then the replies are 204."""
        reply = wait_until(lambda: self.shown(job_id, query), "a preview")
        self.assertEqual(reply.status, 200, reply.body)
        return reply

    def running(self, **changes):
        job_id = self.daemon.start_job(long_scene(**changes))
        self.addCleanup(lambda: self.daemon.request("POST", f"/v1/jobs/{job_id}/cancel"))
        return job_id

    def test_shows_a_running_render_small(self):
        job_id = self.running(image={"width": 4000, "height": 2000})
        reply = self.first(job_id)
        self.assertEqual(reply.headers["Content-Type"], "image/png")
        self.assertRegex(reply.headers["ETag"], '^"[0-9a-f]{64}"$')
        self.assertEqual(size_of(reply.body), (512, 256))
        alpha = read_png(reply.body)[..., 3]
        self.assertEqual(set(numpy.unique(alpha)), {0, 255}, "a part of it is there")
        self.assertEqual(size_of(self.first(job_id, "?max=64").body), (64, 32))
        self.assertEqual(size_of(self.first(job_id, "?max=1024").body), (1024, 512))
        self.assertEqual(self.daemon.job(job_id)["links"]["preview"], f"/v1/jobs/{job_id}/preview")

    def test_shows_more_tiles_over_time(self):
        job_id = self.running()
        def covered():
            return (read_png(self.first(job_id).body)[..., 3] == 255).mean()
        first = covered()
        self.assertLess(first, 1)
        wait_until(lambda: covered() > first, "more of the image")

    def test_applies_the_exposure(self):
        small = {"image": {"width": 200, "height": 150}, "accuracy": {"samples": [2000, 2000]}}
        jobs = [self.running(output={"exposure": exposure}, **small) for exposure in (0, -3)]
        def both():
            bright, dark = (read_png(self.first(job_id).body) for job_id in jobs)
            there = (bright[..., 3] == 255) & (dark[..., 3] == 255) & (bright[..., :3].max(axis=2) > 0)
            return (bright[there][:, :3], dark[there][:, :3]) if there.any() else None
        bright, dark = wait_until(both, "the same part of both that is not black")
        self.assertTrue((dark.max(axis=1) < bright.max(axis=1)).all())

    def test_redirects_to_the_image_of_a_succeeded_job(self):
        job = self.finished(output={"formats": ["exr", "png"]})
        reply = self.preview(job["id"])
        self.assertEqual((reply.status, reply.headers["Location"]), (303, f"/v1/jobs/{job['id']}/image.png"))
        self.assert_problem(self.preview(self.finished(output={"formats": ["exr"]})["id"]), 404, "image_not_found")
        measured = self.daemon.submit({"scene": scene(), "settings": {"parameters": ["samples"], "reference_samples": 16}}, "/v1/measure")
        self.daemon.wait_for_end(measured)
        self.assertEqual(self.preview(measured).headers["Location"], f"/v1/jobs/{measured}/measure.png")

    def test_scales_the_image_after_the_end(self):
        job = self.daemon.rendered(scene(300, 200, samples=4))
        reply = self.preview(job["id"], "?max=30")
        self.assertEqual((reply.status, reply.headers["Content-Type"], size_of(reply.body)), (200, "image/png", (30, 20)))
        view = self.daemon.get(f"/v1/jobs/{job['id']}/view.png?max=30").body  # view_test.py compares it with the image
        numpy.testing.assert_array_equal(read_png(reply.body), read_png(view))
        self.assertEqual(self.preview(job["id"], "?max=30", If_None_Match=reply.headers["ETag"]).status, 304)
        for query in ("", "?max=300", "?max=1024"):
            self.assertEqual(self.preview(job["id"], query).status, 303, query)
        answers = {side: self.daemon.in_background("GET", f"/v1/jobs/{job['id']}/preview?max={side}") for side in range(40, 80)}
        self.assertEqual({side: size_of(answer.result().body)[0] for side, answer in answers.items()}, {side: side for side in answers})

    @unittest.skipIf("thread" in SANITIZED, "a worker is killed before the tile in work ends")
    def test_of_a_cancelled_job_is_kept(self):
        job = self.daemon.cancel_in_work(long_scene(image={"width": 4000, "height": 2000}))
        job_id = job["id"]
        self.assertEqual((job["state"], job["links"]["image"], [a["name"] for a in job["artifacts"]]),
                         ("cancelled", None, ["preview.png"]))
        self.assertEqual(self.preview(job_id).headers["Location"], f"/v1/jobs/{job_id}/preview.png")
        png = self.daemon.get(job["artifacts"][0]["url"]).body
        self.assertEqual(size_of(png), (512, 256))
        self.assertTrue((read_png(png)[..., 3] == 255).any())
        self.assertEqual(size_of(self.preview(job_id, "?max=64").body), (64, 32))
        self.assert_problem(self.daemon.get(f"/v1/jobs/{job_id}/image.png"), 404, "image_not_found")
        self.daemon.request("POST", f"/v1/jobs/{job_id}/retry")
        self.assertEqual(self.daemon.job(job_id)["artifacts"], [])
        self.assert_problem(self.daemon.get(f"/v1/jobs/{job_id}/preview.png"), 404, "image_not_found")

    def test_refuses_other_sizes_and_unknown_jobs(self):
        job_id = self.running()
        for query in ("?max=15", "?max=1025", "?max=big", "?max=", "?max=64&max=64", "?size=64"):
            self.assert_problem(self.preview(job_id, query), 400, "invalid_query")
        self.assert_problem(self.preview(NOBODY), 404, "job_not_found")


@unittest.skipIf("thread" in SANITIZED, "a worker is killed before the tile in work ends")
class KeptPreviews(unittest.TestCase):
    def test_outlive_a_restart_and_are_deleted_with_their_job(self):
        with Daemon() as daemon:
            job = daemon.cancel_in_work(long_scene())
            path = f"/v1/jobs/{job['id']}"
            daemon.restart()
            self.assertEqual(daemon.get(path + "/preview.png").status, 200)
            self.assertEqual(daemon.request("DELETE", path).status, 204)
            self.assertEqual(json_of(daemon.get("/v1/status"))["used"]["artifact_bytes"], 0)
