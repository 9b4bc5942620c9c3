"""Images: rendered while the client waits, or downloaded from a job."""
import contextlib
import sqlite3
import unittest

from tests.http.daemon import Daemon, OneDaemon, json_of, long_scene, scene, sha256, wait_until

PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
EXR_MAGIC = b"\x76\x2f\x31\x01"
LARGE = scene(150, 150, output={"formats": ["exr"]})  # too large for a row of the database


class Damage(unittest.TestCase):
    def assert_damaged(self, daemon, job):
        for headers in ({}, {"Range": "bytes=0-9"}):
            reply = daemon.get(job["links"]["image"], **headers)
            self.assertEqual((reply.status, json_of(reply)["type"]), (500, "urn:whittle:problem:image_damaged"), headers)

    def assert_rendered_again(self, daemon, job, image):
        self.assertEqual(daemon.request("POST", f"/v1/jobs/{job['id']}/retry").status, 202)
        self.assertEqual(daemon.wait_for_end(job["id"])["state"], "succeeded")
        self.assertEqual(daemon.get(job["links"]["image"]).body, image)

    def test_is_found_at_each_read(self):
        with Daemon() as daemon, contextlib.closing(sqlite3.connect(daemon.data / "whittle.db")) as database:
            large, small = (daemon.rendered(document) for document in (LARGE, scene()))
            name = large["artifacts"][0]["sha256"]
            file = daemon.data / name[:2] / name
            image, row = (daemon.get(job["links"]["image"]).body for job in (large, small))

            def change_row():
                with database:
                    made = database.execute("UPDATE small_artifacts SET bytes = ?", (row[:-1] + bytes([row[-1] ^ 1]),))
                self.assertEqual(made.rowcount, 1)
            for job, whole, damage in ((large, image, lambda: file.write_bytes(image[:-1])), (large, image, lambda: file.write_bytes(image + b"?")),
                                       (large, image, lambda: file.write_bytes(b"")), (large, image, file.unlink), (small, row, change_row)):
                damage()
                self.assert_damaged(daemon, job)
                self.assert_rendered_again(daemon, job, whole)

    def test_a_changed_image_is_an_error_and_rendered_again_by_a_retry(self):
        with Daemon() as daemon:
            jobs = [daemon.rendered(LARGE) for _ in range(2)]
            name = jobs[0]["artifacts"][0]["sha256"]
            image = daemon.get(jobs[0]["links"]["image"]).body
            self.assertEqual(daemon.request("POST", f"/v1/jobs/{jobs[0]['id']}/retry").status, 409, "it is undamaged")
            daemon.kill()
            file = daemon.data / name[:2] / name
            file.write_bytes(image[:-1] + bytes([image[-1] ^ 1]))
            with Daemon(data=daemon.data) as restarted:
                found = wait_until(lambda: restarted.log_rows("artifact_damaged"), "the event")
                self.assertEqual([row["sha256"] for row in found], [name], "found in the background")
                self.assert_damaged(restarted, jobs[0])
                self.assert_rendered_again(restarted, jobs[0], image)
                self.assertEqual(restarted.get(jobs[1]["links"]["image"]).body, image, "equal images are one file")


class Rendering(OneDaemon):
    def test_replies_with_the_image_of_the_job(self):
        reply = self.daemon.request("POST", "/v1/render", scene())
        self.assertEqual((reply.status, reply.headers["Content-Type"]), (200, "image/png"))
        self.assertTrue(reply.body.startswith(PNG_MAGIC))
        kept = self.daemon.get(reply.headers["Content-Location"])
        self.assertEqual(kept.body, reply.body)
        self.assertEqual(kept.headers["ETag"], reply.headers["ETag"])

    def test_selects_the_format_by_accept(self):
        for accept, media_type, magic in (("image/x-exr", "image/x-exr", EXR_MAGIC),
                                          ("image/png;q=0.5, image/x-exr", "image/x-exr", EXR_MAGIC),
                                          ("image/jpeg", "image/jpeg", b"\xff\xd8\xff"),
                                          ("image/vnd.radiance", "image/vnd.radiance", b"#?RADIANCE"),
                                          ("image/webp", "image/webp", b"RIFF"),
                                          ("image/tiff", "image/tiff", b"II*\0"),
                                          ("image/*", "image/png", PNG_MAGIC),
                                          ("text/html, */*;q=0.1", "image/png", PNG_MAGIC)):
            reply = self.daemon.request("POST", "/v1/render", scene(), {"Accept": accept})
            self.assertEqual((reply.status, reply.headers["Content-Type"]), (200, media_type), accept)
            self.assertTrue(reply.body.startswith(magic), accept)

    def test_reports_the_error_of_each_file(self):
        document = scene(accuracy={"samples": [4, 4], "target_error": 100}, output={"formats": ["png", "jpg", "exr"]})
        reply = self.daemon.request("POST", "/v1/render", document)
        self.assertEqual(reply.status, 200)
        job = json_of(self.daemon.get(reply.headers["Content-Location"].rsplit("/", 1)[0]))
        image, files = job["report"]["error"], job["report"]["artifacts"]
        self.assertEqual([file["name"] for file in files], [artifact["name"] for artifact in job["artifacts"]])
        png, jpg, exr = [file["error"] for file in files]
        self.assertTrue(0 == exr["encoding"] < png["encoding"] < min(0.5, jpg["encoding"]), files)
        self.assertAlmostEqual(exr["estimate"], image["estimate"])
        for error in (png, jpg):
            self.assertGreater(error["estimate"], image["estimate"])
            self.assertLessEqual(error["estimate"], image["estimate"] + error["encoding"])
            self.assertTrue(error["met"])

    def test_prefers_the_first_format_of_the_document(self):
        reply = self.daemon.request("POST", "/v1/render", scene(output={"formats": ["exr", "png"]}))
        self.assertEqual(reply.headers["Content-Type"], "image/x-exr")

    def test_selects_a_format_that_holds_the_image(self):
        long = scene(16384, 1)
        reply = self.daemon.request("POST", "/v1/render", long, {"Accept": "image/webp, image/png;q=0.5"})
        self.assertEqual((reply.status, reply.headers["Content-Type"]), (200, "image/png"))
        reply = self.daemon.request("POST", "/v1/render", long, {"Accept": "image/webp"})
        self.assert_problem(reply, 406, "not_acceptable")

    def test_job_of_a_disconnected_client_continues(self):
        with self.daemon.sent("POST", "/v1/render", long_scene(name="left alone")):
            items = wait_until(lambda: json_of(self.daemon.get("/v1/jobs?q=left%20alone"))["items"], "the job")
        job = self.daemon.wait_for_state(items[0]["id"], "running")
        self.assertEqual(self.daemon.request("POST", job["links"]["cancel"]).status, 202)
        self.assertEqual(self.daemon.wait_for_end(job["id"])["state"], "cancelled")


class Image(OneDaemon):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.job = cls.daemon.rendered(scene(64, 48))
        cls.path = cls.job["links"]["image"]
        cls.whole = cls.daemon.get(cls.path).body

    def test_has_its_sha256_as_etag_and_is_immutable(self):
        reply = self.daemon.get(self.path)
        name = sha256(reply.body)
        self.assertLessEqual({"sha256": name, "bytes": len(reply.body), "url": self.path}.items(), self.job["artifacts"][0].items())
        self.assertEqual(reply.headers["ETag"], f'"{name}"')
        self.assertIn("immutable", reply.headers["Cache-Control"])
        self.assertEqual(reply.headers["Accept-Ranges"], "bytes")
        again = self.daemon.get(self.path, If_None_Match=reply.headers["ETag"])
        self.assertEqual((again.status, again.body), (304, b""))

    def test_is_served_in_ranges(self):
        size = len(self.whole)
        for requested, begin, end in (("0-0", 0, 1), ("10-19", 10, 20), ("5-", 5, size), ("-7", size - 7, size),
                                      (f"{size - 1}-{size + 100}", size - 1, size)):
            reply = self.daemon.get(self.path, Range=f"bytes={requested}")
            self.assertEqual((reply.status, reply.body), (206, self.whole[begin:end]), requested)
            self.assertEqual(reply.headers["Content-Range"], f"bytes {begin}-{end - 1}/{size}")

        reply = self.daemon.get(self.path, Range=f"bytes={size}-")
        self.assert_problem(reply, 416, "range_not_satisfiable")
        self.assertEqual(reply.headers["Content-Range"], f"bytes */{size}")
        for if_range, status in ((self.daemon.get(self.path).headers["ETag"], 206), ('"other"', 200)):
            self.assertEqual(self.daemon.get(self.path, Range="bytes=0-1", If_Range=if_range).status, status)

    def test_head_has_the_same_headers_without_a_body(self):
        with self.daemon.sent("HEAD", self.path) as connection:
            head = connection.getresponse()
            head.read()
            connection.request("GET", self.path)  # the next reply begins where the headers ended
            get = connection.getresponse()
            self.assertEqual((head.status, get.status, get.read()), (200, 200, self.whole))
        for name in ("Content-Length", "Content-Type", "ETag", "Cache-Control"):
            self.assertEqual(head.headers[name], get.headers[name])
        self.assertEqual(head.headers["Content-Length"], str(len(self.whole)))

    def test_is_not_found_in_a_format_that_was_not_requested(self):
        problem = self.assert_problem(self.daemon.get(self.path.replace("png", "exr")), 404, "image_not_found")
        self.assertIn("image.exr", problem["detail"])
        self.assert_problem(self.daemon.get(self.path.replace("png", "bmp")), 404, "not_found")
