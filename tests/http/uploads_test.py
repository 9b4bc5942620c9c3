"""Uploaded files: stored by hash, referenced by scenes, and deleted when no job needs them."""
import os
import socket
import time
import unittest

from tests.http.daemon import Daemon, OneDaemon, json_of, put, scene, sha256, wait_until
from tests.support.whittle import SCENES, succeeded, whittle

TILE = (SCENES / "assets/tile.png").read_bytes()
VASE = (SCENES / "assets/vase.obj").read_bytes()
DAY_S = 86400


def textured(content, **changes):
    color = {"file": "sha256:" + sha256(content)}
    sphere = {"type": "sphere", "center": [0, 0.5, 0], "radius": 0.5, "material": {"color": color}}
    return scene(objects=[sphere], **changes)


def stored_files(daemon):
    """Names of the uploads on disk, including incomplete ones."""
    return sorted(path.name for path in (daemon.data / "uploads").rglob("*") if path.is_file())


def age(daemon, content, days):
    """Sets back the time of the last use."""
    name = sha256(content)
    then = time.time() - days * DAY_S
    os.utime(daemon.data / "uploads" / name[:2] / name, (then, then))


class DamagedImages(unittest.TestCase):
    def test_warnings_of_the_image_library_are_logged(self):
        at = TILE.index(b"IDAT") + 24
        broken = TILE[:at] + bytes([TILE[at] ^ 1]) + TILE[at + 1:]  # its checksum is another
        with Daemon() as daemon:
            daemon.worker_may_speak = True
            put(daemon, broken)
            job = daemon.wait_for_end(daemon.submit(textured(broken)))
            self.assertEqual((job["state"], job["problem"]["code"]), ("failed", "bad_asset"))
            warning = wait_until(lambda: daemon.log_rows("worker_output"), "the warning of libpng")[0]
            self.assertEqual((warning["level"], warning["worker"]), ("warning", str(daemon.worker())))
            self.assertIn("libpng", warning["text"])


class Uploads(OneDaemon):
    def missing(self, *hashes):
        return json_of(self.daemon.request("POST", "/v1/assets/missing", {"sha256": list(hashes)}), 200)["missing"]

    def test_are_missing_until_stored_and_returned_unchanged(self):
        content = os.urandom(3_000_000)
        name, path = sha256(content), "/v1/assets/" + sha256(content)
        self.assertEqual(self.missing(name, "0" * 64, name), [name, "0" * 64])
        self.assert_problem(self.daemon.get(path), 404, "asset_not_found")
        first = put(self.daemon, content)
        self.assertEqual((first.status, first.headers["Location"]), (201, path))
        self.assertEqual(json_of(first), {"sha256": name, "bytes": 3_000_000})
        self.assertEqual(put(self.daemon, content).status, 200)
        self.assertEqual(self.missing(name, "0" * 64), ["0" * 64])
        reply = self.daemon.get(path)
        self.assertEqual((reply.status, reply.body), (200, content))
        self.assertEqual((reply.headers["ETag"], reply.headers["Content-Type"]), (f'"{name}"', "application/octet-stream"))
        head = self.daemon.request("HEAD", path)
        self.assertEqual((head.status, head.headers["Content-Length"], head.body), (200, "3000000", b""))
        self.assertEqual(self.daemon.get(path, If_None_Match=f'"{name}"').status, 304)
        self.daemon.restart()
        self.assertEqual(self.daemon.get(path).body, content)

    def test_with_a_wrong_hash_store_nothing(self):
        content = os.urandom(2_000_000)  # spooled by the HTTP server
        for name in (sha256(content)[:-1] + "x", sha256(content).upper(), "0" * 64, "x", "..%2e", sha256(content)[1:]):
            before = stored_files(self.daemon)
            detail = self.assert_problem(put(self.daemon, content, name), 422, "asset_mismatch")["detail"]
            self.assertEqual(stored_files(self.daemon), before)
            reason = "the 2000000 bytes have another sha256" if name == "0" * 64 else "64 lower-case hex digits; characters in the path: "
            self.assertIn(reason, detail)
            self.assertEqual(self.daemon.get("/v1/assets/" + name).status, 404)

    def test_that_are_interrupted_leave_nothing(self):
        content = os.urandom(2_000_000)
        head = f"PUT /v1/assets/{sha256(content)} HTTP/1.1\r\nHost: localhost\r\nContent-Length: {len(content)}\r\n\r\n"
        for sent in (0, 1000, 1_500_000, len(content) - 1):
            before = stored_files(self.daemon)
            with self.daemon.socket() as connection:
                connection.sendall(head.encode() + content[:sent])
                connection.shutdown(socket.SHUT_RDWR)
            self.assertEqual(self.missing(sha256(content)), [sha256(content)])
            self.assertEqual(stored_files(self.daemon), before)
            self.assertEqual(list((self.daemon.data / "spool").iterdir()), [])
        self.assertEqual(put(self.daemon, content).status, 201)

    def test_are_never_whole_in_memory(self):
        content = os.urandom(1 << 20) * 120
        before = self.daemon.resident_bytes()
        self.daemon.forget_peak()
        self.assertEqual(put(self.daemon, content).status, 201)
        self.assertEqual(len(self.daemon.get("/v1/assets/" + sha256(content)).body), len(content))
        self.assertLess(self.daemon.peak_bytes() - before, len(content) // 4)

    def test_queried_without_a_list_of_hashes_are_an_invalid_request(self):
        self.assertEqual(self.missing(), [])
        for body, issues in (({}, ["#/sha256 missing_field"]), (b"[]", ["# wrong_type"]), ({"sha256": "0"}, ["#/sha256 wrong_type"]),
                             ({"sha256": {}}, ["#/sha256 wrong_type"]), ({"sha256": ["A" * 64]}, ["#/sha256/0 malformed"]),
                             ({"sha256": [1, "a", None], "more": 1}, ["#/sha256/0 wrong_type", "#/sha256/1 malformed",
                                                                       "#/sha256/2 wrong_type", "#/more unknown_field"]),
                             ({"sha256": [0] * 10_001}, ["#/sha256 limit_exceeded"])):
            problem = self.assert_problem(self.daemon.request("POST", "/v1/assets/missing", body), 422, "invalid_request")
            self.assertEqual([f"{error['pointer']} {error['code']}" for error in problem["errors"]], issues)
            if issues == ["#/sha256 limit_exceeded"]:
                self.assertIn("10000", problem["errors"][0]["detail"])

    def test_missing_for_a_scene_are_reported_at_submission(self):
        content = os.urandom(100)
        for path in ("/v1/jobs", "/v1/render"):
            problem = self.assert_problem(self.daemon.request("POST", path, textured(content)), 422, "bad_scene")
            (issue,) = problem["errors"]
            self.assertEqual((issue["pointer"], issue["code"]), ("#/objects/0/material/color/file", "bad_asset"))
            self.assertIn("PUT /v1/assets/" + sha256(content), issue["detail"])
        verdict = json_of(self.daemon.request("POST", "/v1/jobs/validate", textured(content)))
        self.assertEqual([error["code"] for error in verdict["errors"]], ["bad_asset"])

    def test_render_the_same_image_as_files_on_the_command_line(self):
        mesh = {"type": "mesh", "file": "sha256:" + sha256(VASE), "material": {}}
        for content, document in ((TILE, textured(TILE)), (VASE, scene(objects=[mesh]))):
            self.assertIn(put(self.daemon, content).status, (200, 201))
            reply = self.daemon.request("POST", "/v1/render", document)
            self.assertEqual(reply.status, 200, reply.body)
            out = self.daemon.directory / "out.png"
            succeeded(whittle("render", "-", "--assets", self.daemon.data / "uploads", "-o", out, document=document))
            self.assertEqual(reply.body, out.read_bytes())


class Limit(unittest.TestCase):
    def test_on_their_size_is_enforced_and_reported(self):
        with Daemon("--asset-bytes", "5000", "--body-bytes", "2000") as daemon:
            self.assertEqual(put(daemon, b"x" * 5000).status, 201)
            self.assertIn("asset_bytes is 5000", json_of(put(daemon, b"x" * 5001), 413)["detail"])
            self.assertEqual(daemon.request("POST", "/v1/assets/missing", b" " * 2001).status, 413)
            limits = json_of(daemon.get("/v1/version"))["limits"]
            self.assertEqual((limits["asset_bytes"], limits["asset_hashes"]), (5000, 10_000))


class Collection(unittest.TestCase):
    @staticmethod
    def marker():
        """Returns content whose name is late in the order of the collector."""
        return next(content for content in (b"marker %d" % i for i in range(100_000)) if sha256(content).startswith("fff"))

    def test_deletes_old_uploads_that_no_job_references(self):
        with Daemon("--asset-days", "3", "--jobs", "1") as daemon:
            marker, requested = self.marker(), b"requested"
            running = daemon.start_job()
            for content in (marker, requested, TILE, VASE):
                put(daemon, content)
            waiting = daemon.submit(textured(TILE))
            for content, days in ((marker, 4), (requested, 4), (TILE, 4), (VASE, 2)):
                age(daemon, content, days)
            daemon.request("POST", "/v1/assets/missing", {"sha256": [sha256(requested)]})
            for days, left in ((2, (requested, TILE, VASE)), (4, (requested, TILE))):
                put(daemon, marker)
                age(daemon, marker, 4)
                age(daemon, VASE, days)
                daemon.restart()
                wait_until(lambda: sha256(marker) not in stored_files(daemon), "the collector, which reads the other names before")
                self.assertEqual(stored_files(daemon), sorted(map(sha256, left)))
            daemon.request("POST", f"/v1/jobs/{running}/cancel")
            self.assertEqual(daemon.wait_for_end(waiting)["state"], "succeeded")
