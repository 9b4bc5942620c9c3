"""Files of scenes: read from the asset directory of the daemon, never from outside it."""
import json
import os
import shutil
import unittest

from tests.cli import models_test
from tests.http.daemon import Daemon, OneDaemon, json_of, scene, wait_until
from tests.support.whittle import SCENES, succeeded, temporary_directory, whittle

TEXTURE_FILE = "#/objects/0/material/color/file"


def textured(name):
    return scene(objects=[{"type": "sphere", "center": [0, 0.5, 0], "radius": 0.5, "material": {"color": {"file": name}}}])


def with_mesh(name):
    return scene(objects=[{"type": "mesh", "file": name, "material": {}}])


class Examples(OneDaemon):
    options = ("--assets", str(SCENES))

    def test_equal_the_command_line(self):
        for name in ("textures", "mesh_files", "environment", "relief"):
            with self.subTest(name):
                document = json.loads((SCENES / f"{name}.json").read_text("utf-8"))
                document["image"] = {"width": 160, "height": 90}  # enough, because the files are compared
                reply = self.daemon.request("POST", "/v1/render", document)
                self.assertEqual(reply.status, 200, reply.body)
                here = temporary_directory(self)
                (here / "assets").symlink_to(SCENES / "assets")
                (here / "scene.json").write_text(json.dumps(document), encoding="utf-8")
                succeeded(whittle("render", here / "scene.json", "-o", here / "out.png"))
                self.assertEqual(reply.body, (here / "out.png").read_bytes())

    def test_of_models_equal_the_command_line(self):
        model, glb = SCENES / "assets/stone.glb", {"Content-Type": "model/gltf-binary"}
        out = temporary_directory(self) / "out.png"
        self.assertEqual(whittle("render", model, "-o", out).returncode, 0)
        for body, headers in ((model.read_bytes(), glb), ({"version": 1, "model": "assets/stone.glb"}, None)):
            reply = self.daemon.request("POST", "/v1/render", body, headers=headers)
            self.assertEqual((reply.status, reply.body), (200, out.read_bytes()), reply.body[:200])
        (issue,) = self.assert_problem(self.daemon.request("POST", "/v1/render", b"glTF", headers=glb), 422, "bad_scene")["errors"]
        self.assertEqual((issue["pointer"], issue["code"]), ("#/model", "bad_asset"))

    def test_of_models_are_rendered_by_jobs(self):
        """The worker imports them, so that a broken one is accepted, and its job fails."""
        whole, here = models_test.glb(*models_test.squares([{}])), temporary_directory(self)
        (here / "a.glb").write_bytes(whole)
        succeeded(whittle("render", here / "a.glb", "-o", here / "a.png"))
        for body, place in ((whole, None), (whole[:100], f"byte 8: declares {len(whole)} bytes, the file has 100"), (whole[:7], "byte 7: ")):
            request = body, {"Content-Type": "model/gltf-binary"}
            self.assertTrue(json_of(self.daemon.request("POST", "/v1/jobs/validate", *request))["valid"])
            job = self.daemon.wait_for_end(json_of(self.daemon.request("POST", "/v1/jobs", *request), 202)["id"])
            if place is None:
                self.assertEqual(self.daemon.get(job["links"]["image"]).body, (here / "a.png").read_bytes())
                continue
            (issue,) = job["problem"]["errors"]
            self.assertEqual((job["state"], job["attempt"], issue["pointer"], issue["code"]), ("failed", 1, "#/model", "bad_asset"))
            self.assertIn(place, issue["detail"])


class Names(OneDaemon):
    @classmethod
    def setUpClass(cls):
        cls.outside = temporary_directory(cls)
        cls.directory = cls.outside / "assets"
        cls.directory.mkdir()
        shutil.copy(SCENES / "assets/tile.png", cls.outside / "secret.png")
        (cls.directory / "up.png").symlink_to("../secret.png")
        os.mkfifo(cls.directory / "pipe.png")
        cls.options = ("--assets", str(cls.directory))
        super().setUpClass()

    def test_of_missing_or_special_files_are_rejected_by_every_route(self):
        for name, reason in (("missing.png", "no such file"), ("up.png", "leads out of the asset directory"), ("pipe.png", "is no ordinary file")):
            for path in ("/v1/jobs", "/v1/render"):
                (issue,) = self.assert_problem(self.daemon.request("POST", path, textured(name)), 422, "bad_scene")["errors"]
                self.assertEqual((issue["pointer"], issue["code"]), (TEXTURE_FILE, "bad_asset"))
                self.assertTrue(issue["detail"].startswith(f"{name}: {reason}"), issue)
                self.assertNotIn(str(self.outside), issue["detail"])
        verdict = json_of(self.daemon.request("POST", "/v1/jobs/validate", textured("missing.png")))
        self.assertEqual((verdict["valid"], len(verdict["errors"])), (False, 1))


class BadFiles(unittest.TestCase):
    def setUp(self):
        self.directory = temporary_directory(self)
        shutil.copy(SCENES / "assets/tile.png", self.directory / "tile.png")
        shutil.copy(SCENES / "assets/vase.obj", self.directory / "vase.obj")

    def daemon(self, *options):
        return self.enterContext(Daemon("--assets", self.directory, *options))

    def assert_fails(self, job, pointer, reason):
        """Asserts that the job failed with one issue at its first attempt."""
        self.assertEqual((job["state"], job["attempt"], job["problem"]["code"]), ("failed", 1, "bad_asset"), job)
        (issue,) = job["problem"]["errors"]
        self.assertEqual((issue["pointer"], issue["code"]), (pointer, "bad_asset"))
        self.assertIn(reason, issue["detail"])

    def test_fail_only_their_job_with_its_pointer(self):
        (self.directory / "text.png").write_text("no image", encoding="utf-8")
        (self.directory / "nan.obj").write_text("v 0 0 nan", encoding="utf-8")
        daemon = self.daemon()
        worker = wait_until(daemon.worker, "a worker")
        for document, pointer, reason in ((textured("text.png"), TEXTURE_FILE, "text.png: is no PNG, JPEG"),
                                          (with_mesh("nan.obj"), "#/objects/0/file", "nan.obj: line 1: must be finite")):
            self.assert_fails(daemon.wait_for_end(daemon.submit(document)), pointer, reason)
        reply = daemon.request("POST", "/v1/render", textured("text.png"))
        self.assertEqual((reply.status, json_of(reply)["errors"][0]["pointer"]), (422, TEXTURE_FILE))
        self.assertEqual(daemon.request("POST", "/v1/render", textured("tile.png")).status, 200)
        self.assertEqual(daemon.worker(), worker)
        self.assertIn(worker, daemon.worker_pids())

    def test_removed_or_changed_after_submission_fail_the_job(self):
        (self.directory / "pipe.png").touch()
        daemon = self.daemon("--jobs", "1")
        first = daemon.start_job()
        jobs = [daemon.submit(textured(name)) for name in ("tile.png", "pipe.png")]
        for name in ("tile.png", "pipe.png"):
            (self.directory / name).unlink()
        os.mkfifo(self.directory / "pipe.png")
        daemon.request("POST", f"/v1/jobs/{first}/cancel")
        self.assert_fails(daemon.wait_for_end(jobs[0]), TEXTURE_FILE, "tile.png: no such file")
        self.assert_fails(daemon.wait_for_end(jobs[1]), TEXTURE_FILE, "pipe.png: is no ordinary file")

    def test_exceed_the_limit_of_triangles(self):
        daemon = self.daemon("--triangles", "100")
        job = daemon.wait_for_end(daemon.submit(with_mesh("vase.obj")))
        self.assert_fails(job, "#/objects/0/file", "the limit triangles is 100")


class AssetDirectory(unittest.TestCase):
    def test_is_required_for_scenes_with_files(self):
        with Daemon() as daemon:
            for document in (textured("tile.png"), with_mesh("/etc/passwd")):
                (issue,) = json_of(daemon.request("POST", "/v1/jobs", document), 422)["errors"]
                self.assertEqual(issue["code"], "unsupported")
                self.assertIn("--assets", issue["detail"])

    def test_may_be_relative_to_the_working_directory(self):
        with Daemon("--assets", os.path.relpath(SCENES)) as daemon:
            self.assertEqual(daemon.request("POST", "/v1/render", textured("assets/tile.png")).status, 200)
