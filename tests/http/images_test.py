"""Images: rendered while the client waits, or downloaded from a job."""
import contextlib
import hashlib
import http.client
import json
import sqlite3
import unittest

from tests.http.daemon import Daemon, OneDaemon, json_of, long_scene, scene, wait_until

PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
EXR_MAGIC = b"\x76\x2f\x31\x01"


class Damage(unittest.TestCase):
    def assert_damaged(self, daemon, job):
        for headers in ({}, {"Range": "bytes=0-9"}):
            reply = daemon.get(job["links"]["image"], **headers)
            self.assertEqual((reply.status, json_of(reply)["type"]), (500, "urn:whittle:problem:image_damaged"), headers)

    def assert_rendered_again(self, daemon, job, image):
        self.assertEqual(daemon.request("POST", f"/v1/jobs/{job['id']}/retry").status, 202)
        self.assertEqual(daemon.wait_for_end(job["id"])["state"], "succeeded")
        self.assertEqual(daemon.get(job["links"]["image"]).body, image)

    def test_a_cut_or_missing_image_is_found_at_each_read(self):
        with Daemon() as daemon:
            job = daemon.wait_for_end(daemon.submit(scene(150, 150, output={"formats": ["exr"]})))
            image = daemon.get(job["links"]["image"]).body
            sha256 = hashlib.sha256(image).hexdigest()
            file = daemon.data / sha256[:2] / sha256
            for damage in (lambda: file.write_bytes(image[:-1]), lambda: file.write_bytes(image + b"?"),
                           lambda: file.write_bytes(b""), file.unlink):
                damage()
                self.assert_damaged(daemon, job)
                self.assert_rendered_again(daemon, job, image)

    def test_a_changed_small_image_is_found_at_each_read(self):
        with Daemon() as daemon:
            job = daemon.wait_for_end(daemon.submit(scene()))
            image = daemon.get(job["links"]["image"]).body
            changed = image[:-1] + bytes([image[-1] ^ 1])
            with contextlib.closing(sqlite3.connect(daemon.data / "whittle.db")) as database, database:
                made = database.execute("UPDATE small_artifacts SET bytes = ?", (changed,))
                self.assertEqual(made.rowcount, 1)
            self.assert_damaged(daemon, job)
            self.assert_rendered_again(daemon, job, image)

    def test_a_changed_image_is_an_error_and_rendered_again_by_a_retry(self):
        with Daemon() as daemon:
            ids = [daemon.submit(scene(150, 150, output={"formats": ["exr"]})) for _ in range(2)]
            jobs = [daemon.wait_for_end(job_id) for job_id in ids]
            sha256 = jobs[0]["artifacts"][0]["sha256"]
            image = daemon.get(jobs[0]["links"]["image"]).body
            retried = daemon.request("POST", f"/v1/jobs/{ids[0]}/retry")
            self.assertEqual(retried.status, 409, "it is undamaged")
            daemon.kill()
            file = daemon.data / sha256[:2] / sha256
            file.write_bytes(image[:-1] + bytes([image[-1] ^ 1]))
            with Daemon(data=daemon.data) as restarted:
                found = wait_until(lambda: [row["sha256"] for row in restarted.log_rows() if row["event"] == "artifact_damaged"], "the event")
                self.assertEqual(found, [sha256], "found in the background")
                reply = restarted.get(jobs[0]["links"]["image"])
                self.assertEqual((reply.status, json_of(reply)["type"]), (500, "urn:whittle:problem:image_damaged"))
                self.assertEqual(restarted.request("POST", f"/v1/jobs/{ids[0]}/retry").status, 202)
                again = restarted.wait_for_end(ids[0])
                self.assertEqual((again["state"], again["artifacts"][0]["sha256"]), ("succeeded", sha256))
                for job in jobs:
                    self.assertEqual(restarted.get(job["links"]["image"]).body, image, "equal images are one file")

    def test_a_batch_with_a_changed_image_is_cut_short(self):
        with Daemon() as daemon:
            batch = json_of(daemon.request("POST", "/v1/batches", {
                "scene": scene(150, 150, output={"formats": ["exr"]}), "frames": [{}]}))
            job = wait_until(lambda: next((job for job in json_of(daemon.get(batch["links"]["jobs"]))["items"]
                                           if job["state"] == "succeeded"), None), "the batch")
            sha256 = job["artifacts"][0]["sha256"]
            file = daemon.data / sha256[:2] / sha256
            file.write_bytes(file.read_bytes()[:-1] + b"?")
            with self.assertRaises(http.client.IncompleteRead):
                daemon.get(batch["links"]["self"] + "/artifacts.tar")


class Rendering(OneDaemon):
    options = ("--render-wait-s", "60")

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
        with self.daemon.socket() as connection:
            body = json.dumps(long_scene(name="left alone")).encode()
            connection.sendall(b"POST /v1/render HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                               b"Content-Length: %d\r\n\r\n" % len(body) + body)
            items = wait_until(lambda: json_of(self.daemon.get("/v1/jobs?q=left%20alone"))["items"], "the job")
        job = self.daemon.wait_for_state(items[0]["id"], "running")
        self.assertEqual(self.daemon.request("POST", job["links"]["cancel"]).status, 202)
        self.assertEqual(self.daemon.wait_for_end(job["id"])["state"], "cancelled")


class Image(OneDaemon):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        job_id = cls.daemon.submit(scene(64, 48, output={"formats": ["png"]}))
        cls.job = cls.daemon.wait_for_end(job_id)
        cls.path = cls.job["links"]["image"]
        assert cls.job["links"]["measurement"] is None, cls.job["links"]
        cls.whole = cls.daemon.get(cls.path).body

    def test_has_its_sha256_as_etag_and_is_immutable(self):
        reply = self.daemon.get(self.path)
        sha256 = hashlib.sha256(reply.body).hexdigest()
        artifact = self.job["artifacts"][0]
        self.assertEqual((artifact["sha256"], artifact["bytes"], artifact["url"]), (sha256, len(reply.body), self.path))
        self.assertEqual(reply.headers["ETag"], f'"{sha256}"')
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
        head, get = self.daemon.request("HEAD", self.path), self.daemon.get(self.path)
        self.assertEqual((head.status, head.body), (200, b""))
        for name in ("Content-Length", "Content-Type", "ETag", "Cache-Control"):
            self.assertEqual(head.headers[name], get.headers[name])
        self.assertEqual(head.headers["Content-Length"], str(len(self.whole)))

    def test_is_not_found_in_a_format_that_was_not_requested(self):
        problem = self.assert_problem(self.daemon.get(self.path.replace("png", "exr")), 404, "image_not_found")
        self.assertIn("image.exr", problem["detail"])
        self.assert_problem(self.daemon.get(self.path.replace("png", "bmp")), 404, "not_found")


if __name__ == "__main__":
    unittest.main()
