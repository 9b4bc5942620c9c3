"""POST /v1/compare: the difference of two images."""
import json
import struct
import unittest
import zlib

import numpy

from tests.http.daemon import FAR, Daemon, OneDaemon, json_of, put, scene, sha256, wait_until
from tests.support.images import read_png, write_png
from tests.support.whittle import only_in_long_runs, temporary_directory, whittle


def gray_png(width, height, code, header_only=False):
    """An RGB image of one gray, or the start of one."""
    data = b"" if header_only else zlib.compress((b"\0" + bytes([code]) * (3 * width)) * height, 1)
    return write_png([(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)), (b"IDAT", data), (b"IEND", b"")])


class Compare(OneDaemon):
    def compare(self, a, b, **body):
        return self.daemon.request("POST", "/v1/compare", {"a": a, "b": b, **body})

    def compared(self, a, b, **body):
        def answered():
            reply = self.compare(a, b, **body)
            return None if reply.status == 503 and "Retry-After" in reply.headers else reply
        # On a busy machine the worker takes longer than a reply may wait.
        return json_of(wait_until(answered, "the comparison"), 200)

    def upload(self, data):
        self.assertIn(put(self.daemon, data).status, (200, 201))
        return sha256(data)

    def render(self, formats, fov=40, **size):
        document = scene(**{"width": 64, "height": 48, **size}, output={"formats": formats})
        document["camera"]["fov"] = fov
        return self.daemon.rendered(document)

    def image(self, job, name):
        return self.daemon.get(f"/v1/jobs/{job['id']}/{name}").body

    def by_command(self, a, b, *options):
        """Output of the command line for the same bytes."""
        directory = temporary_directory(self)
        paths = [directory / name for name in ("a", "b", "heat.png")]
        paths[0].write_bytes(a)
        paths[1].write_bytes(b)
        done = whittle("diff", paths[0], paths[1], "--json", "--heat", paths[2], *options)
        return json.loads(done.stdout), paths[2].read_bytes()

    def test_is_that_of_the_command_line(self):
        jobs = [self.render(["png", "exr"], fov) for fov in (40, 44)]
        ids = [job["id"] for job in jobs]
        for name in ("image.png", "image.exr"):
            a, b = (self.image(job, name) for job in jobs)
            expected, heat = self.by_command(a, b, "--tolerance", "1")
            self.assertGreater(expected["rmse"], 1)
            found = self.compared(*(f"{id_}/{name}" for id_ in ids), tolerance=1, heat=True)
            numpy.testing.assert_array_equal(read_png(self.daemon.get(found.pop("heat_map")).body), read_png(heat))
            self.assertEqual(found, expected)
            uploads = [self.upload(a), self.upload(b)]
            self.assertEqual(self.compared(*uploads)["rmse"], expected["rmse"])
            self.assertEqual(self.compared(ids[0] + "/" + name, uploads[1])["rmse"], expected["rmse"])
        found = self.compared(*ids, tolerance=255)
        self.assertEqual((found["formats"], found["within_tolerance"], found["heat_white"], found["heat_map"]),
                         (["PNG", "PNG"], True, None, None))

    def test_takes_the_first_format_that_both_jobs_have(self):
        both, linear, lossy = self.render(["png", "exr"]), self.render(["exr"]), self.render(["webp"])
        self.assertEqual(self.compared(both["id"], linear["id"])["formats"], ["OpenEXR"] * 2)
        self.assertEqual(self.compared(both["id"], lossy["id"])["formats"], ["PNG", "WebP"])
        self.assertEqual(self.compared(linear["id"], both["id"] + "/image.png")["formats"], ["OpenEXR", "PNG"])

    @only_in_long_runs
    def test_takes_more_than_64_megapixels(self):
        uploads = [self.upload(gray_png(8192, 8704, code)) for code in (100, 101)]
        found = self.compared(*uploads, tolerance=1.5, heat=True)
        self.assertEqual((found["width"], found["height"], found["rmse"], found["within_tolerance"]), (8192, 8704, 1, True))
        self.assertEqual(read_png(self.daemon.get(found["heat_map"]).body).shape, (2048, 1927, 3))

    def test_refuses_what_is_no_image(self):
        good = gray_png(16, 16, 9)
        bad = [b"", b"text", good[:-20], gray_png(1_000_000, 1_000_000, 9, header_only=True),
               self.image(self.render(["exr"]), "image.exr")[:-100], b"\x76\x2f\x31\x01" + bytes(range(256)) * 9]
        for data in bad:
            for pair in ((data, good), (good, data)):
                problem = self.assert_problem(self.compare(*(self.upload(one) for one in pair)), 422, "bad_image")
                self.assertIn("image a " if pair[0] is data else "image b ", problem["detail"])
        self.assertEqual(self.compared(*[self.upload(good)] * 2)["rmse"], 0, "the worker goes on")

    def test_refuses_what_does_not_exist(self):
        done = self.render(["png"])["id"]
        waiting = self.daemon.submit(scene(job={"run_after": FAR}))
        for name, code in (("../x", "job_not_found"), ("x" * 200, "job_not_found"), (waiting, "image_not_found"),
                           (done + "/image.exr", "image_not_found"), (done + "/../" + done, "image_not_found"), ("0" * 64, "asset_not_found")):
            for pair in ((done, name), (name, done)):
                self.assert_problem(self.compare(*pair), 404, code)
        self.assertEqual(self.compare(done, done + "/").status, 200)

    def test_refuses_other_requests(self):
        for body, pointers in (({}, ["/a", "/b"]), ({"a": 1, "b": ""}, ["/a"]), ({"a": "x", "b": "y", "tolerance": -1}, ["/tolerance"]),
                               ({"a": "x", "b": "y", "tolerance": "1", "heat": 1, "c": 0}, ["/tolerance", "/heat", "/c"]),
                               ({"a": "x" * 257, "b": "y"}, ["/a"])):
            problem = self.assert_problem(self.daemon.request("POST", "/v1/compare", body), 422, "invalid_request")
            self.assertEqual([error["pointer"] for error in problem["errors"]], ["#" + one for one in pointers])


class Limits(unittest.TestCase):
    def test_pixels_are_limited_by_the_memory_of_a_job(self):
        with Daemon("--job-memory-bytes", str(64 << 20)) as daemon:  # 1 Mpx
            daemon.rendered(scene())  # the worker runs
            images = [gray_png(width, 1024, 7) for width in (1024, 1025)]
            for image in images:
                put(daemon, image)
            replies = [daemon.request("POST", "/v1/compare", {"a": sha256(image), "b": sha256(image)}) for image in images]
            self.assertEqual([reply.status for reply in replies], [200, 422], replies)
            self.assertIn("the limit pixels is 1048576", json_of(replies[1])["detail"])

    def test_heat_map_needs_space_for_uploads(self):
        for limit, statuses in (("1000000", [200, 200]), ("1", [503, 200])):
            with self.subTest(limit), Daemon("--uploads-bytes", limit) as daemon:
                job = daemon.rendered(scene())["id"]
                replies = [daemon.request("POST", "/v1/compare", {"a": job, "b": job, "heat": heat}) for heat in (True, False)]
                self.assertEqual([reply.status for reply in replies], statuses, replies)
        self.assertEqual(json_of(replies[0])["type"], "urn:whittle:problem:uploads_full")
