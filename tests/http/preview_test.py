"""GET /v1/jobs/{id}/preview: the image so far."""
import struct
import threading
import time
import unittest

import numpy

from tests.http.daemon import OneDaemon, json_of, long_scene, scene, wait_until
from tests.support.images import read_png

NOBODY = "0190a000-0000-7000-8000-000000000001"
LATER = {"run_after": "2099-01-01T00:00:00Z"}


def size_of(png):
    return struct.unpack(">II", png[16:24])


class Previews(OneDaemon):
    def preview(self, job_id, query="", **headers):
        return self.daemon.get(f"/v1/jobs/{job_id}/preview{query}", **headers)

    def first(self, job_id, query=""):
        """Returns the first preview; until then the replies are 204."""
        def picture():
            reply = self.preview(job_id, query)
            self.assertIn(reply.status, (200, 204), reply.body)
            return reply if reply.status == 200 else None
        return wait_until(picture, "a preview")

    def running(self, **changes):
        job_id = self.daemon.submit(long_scene(**changes))
        self.daemon.wait_for_state(job_id, "running")
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
        wait_until(lambda: covered() > first, "more of the picture")

    def test_equals_the_image_where_tiles_are_complete(self):
        job_id = self.daemon.submit(scene(300, 200, samples=600))
        self.daemon.wait_for_state(job_id, "running")
        early = read_png(self.first(job_id).body)
        job = self.daemon.wait_for_end(job_id)
        picture = read_png(self.daemon.get(job["links"]["image"]).body)
        self.assertEqual(early.shape[:2], picture.shape[:2])
        there = early[..., 3] == 255
        self.assertTrue(there.any())
        numpy.testing.assert_array_equal(early[there][:, :3], picture[there])

    def test_applies_the_exposure(self):
        small = {"image": {"width": 200, "height": 150}, "accuracy": {"samples": [2000, 2000]}}
        jobs = [self.running(output={"exposure": exposure}, **small) for exposure in (0, -3)]
        def both():
            bright, dark = (read_png(self.first(job_id).body) for job_id in jobs)
            there = (bright[..., 3] == 255) & (dark[..., 3] == 255) & (bright[..., :3].max(axis=2) > 0)
            return (bright[there][:, :3], dark[there][:, :3]) if there.any() else None
        bright, dark = wait_until(both, "the same part of both that is not black")
        self.assertTrue((dark.max(axis=1) < bright.max(axis=1)).all())

    def test_shows_adaptive_renders(self):
        job_id = self.running(accuracy={"target_error": 0.01})
        self.assertEqual(size_of(self.first(job_id).body), (512, 512))

    def test_is_not_modified_for_its_etag(self):
        job_id = self.running()
        def not_modified():
            reply = self.first(job_id)
            again = self.preview(job_id, If_None_Match=reply.headers["ETag"])
            self.assertIn(again.status, (200, 304))
            return again if again.status == 304 else None
        again = wait_until(not_modified, "the same picture twice")
        self.assertEqual(again.body, b"")

    def test_simultaneous_requests_get_the_same_preview(self):
        job_id = self.running()
        self.first(job_id)
        replies = []
        threads = [threading.Thread(target=lambda: replies.append(self.preview(job_id))) for _ in range(40)]
        begin = time.monotonic()
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        seconds = time.monotonic() - begin
        self.assertEqual({reply.status for reply in replies}, {200})
        made = len({reply.headers["ETag"] for reply in replies})
        self.assertLessEqual(made, 2 + 2 * seconds, "made twice a second at most")

    def test_is_empty_for_a_queued_job(self):
        job_id = self.daemon.submit(scene(job=LATER))
        reply = self.preview(job_id)
        self.assertEqual((reply.status, reply.body, reply.headers["Cache-Control"]), (204, b"", "no-store"))
        self.daemon.request("POST", f"/v1/jobs/{job_id}/cancel")
        self.assert_problem(self.preview(job_id), 404, "image_not_found")

    def test_redirects_to_the_image_of_a_succeeded_job(self):
        job = self.finished(output={"formats": ["exr", "png"]})
        reply = self.preview(job["id"])
        self.assertEqual((reply.status, reply.headers["Location"]), (303, f"/v1/jobs/{job['id']}/image.png"))
        self.assert_problem(self.preview(self.finished(output={"formats": ["exr"]})["id"]), 404, "image_not_found")
        measured = json_of(self.daemon.request("POST", "/v1/measure", {
            "scene": scene(), "settings": {"parameters": ["samples"], "reference_samples": 16}}))["id"]
        self.daemon.wait_for_end(measured)
        self.assertEqual(self.preview(measured).headers["Location"], f"/v1/jobs/{measured}/measure.png")

    def test_waiting_request_is_answered_at_the_end_of_the_job(self):
        job_id = self.running(accuracy={"samples": [1000, 1000]})  # a tile takes its time
        replies = []
        thread = threading.Thread(target=lambda: replies.append(self.preview(job_id)))
        thread.start()
        self.daemon.request("POST", f"/v1/jobs/{job_id}/cancel")
        thread.join()
        self.assertIn(replies[0].status, (200, 204, 404))
        wait_until(lambda: self.preview(job_id).status == 404, "the end")

    def test_refuses_other_sizes_and_unknown_jobs(self):
        job_id = self.running()
        for query in ("?max=15", "?max=1025", "?max=big", "?max=", "?max=64&max=64", "?size=64"):
            self.assert_problem(self.preview(job_id, query), 400, "invalid_query")
        self.assert_problem(self.preview(NOBODY), 404, "job_not_found")

    def test_is_gone_for_an_expired_job(self):
        job_id = self.daemon.submit(scene(job={"expires_in": 1}))
        wait_until(lambda: self.daemon.job(job_id)["expired"], "expiry")
        self.assert_problem(self.preview(job_id), 410, "job_expired")


if __name__ == "__main__":
    unittest.main()
