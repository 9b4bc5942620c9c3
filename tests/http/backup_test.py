"""A backup of a running daemon is a data directory, with which another daemon can start."""
import shutil

from tests.http.daemon import Daemon, OneDaemon, failed, put, scene, sha256, whittled
from tests.support.whittle import temporary_directory

SMALL = 32 << 10  # small_bytes_max of sqlite_stores.cpp
UPLOAD = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


class Backup(OneDaemon):
    """Backups of a daemon with a job that has a small image, a large one, and an upload."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        put(cls.daemon, UPLOAD)
        cls.upload = cls.daemon.data / "uploads" / sha256(UPLOAD)[:2] / sha256(UPLOAD)
        objects = [*scene()["objects"], {"type": "mesh", "file": f"sha256:{sha256(UPLOAD)}", "material": {}}]
        job = cls.daemon.rendered(scene(150, 150, objects=objects, job={"labels": {"shot": "1"}}, output={"formats": ["png", "exr"]}))
        cls.done, cls.artifacts = job["id"], job["artifacts"]

    def setUp(self):
        self.directory = temporary_directory(self)
        self.into = self.directory / "backups" / "monday"

    def back_up(self, data=None):
        return whittled("--data", data or self.daemon.data, "--backup", self.into)

    def test_of_a_running_daemon_contains_its_jobs_images_and_uploads(self):
        images = {artifact["url"]: self.daemon.get(artifact["url"]).body for artifact in self.artifacts}
        png, exr = images.values()
        self.assertLess(len(png), SMALL, "beside the rows")
        self.assertGreater(len(exr), SMALL, "a file")
        running = self.daemon.start_job()
        waiting = [self.daemon.submit(scene(name=f"waiting {i}", job={"priority": 1})) for i in range(20)]
        made = self.back_up()
        self.assertEqual((made.returncode, made.stdout, made.stderr), (0, "", ""))
        self.assertEqual(self.daemon.job(running)["state"], "running")
        after = self.daemon.submit(scene(name="after the backup"))
        self.daemon.request("POST", f"/v1/jobs/{running}/cancel")
        with Daemon(data=self.into) as restored:
            for path, image in images.items():
                self.assertEqual(restored.get(path).body, image)
            self.assertEqual(restored.job(self.done)["labels"], {"shot": "1"})
            self.assertEqual(restored.get(f"/v1/assets/{sha256(UPLOAD)}").body, UPLOAD)
            self.assertEqual(restored.get(f"/v1/jobs/{after}").status, 404)
            restored.wait_for_state(running, "running")
            restored.request("POST", f"/v1/jobs/{running}/cancel")
            for job_id in waiting:
                self.assertEqual(restored.wait_for_end(job_id)["state"], "succeeded")

    def test_is_private_and_preserves_the_day_of_the_last_use_of_an_upload(self):
        self.assertEqual(self.back_up().returncode, 0)
        files = list(self.daemon.data.rglob("*"))
        self.assertIn(self.daemon.data / "whittle.db-wal", files)
        self.assertEqual([file for file in files if file.stat().st_mode & 0o007], [], "for every user")
        self.assertEqual(self.into.stat().st_mode & 0o777, 0o700)
        copy = self.into / self.upload.relative_to(self.daemon.data)
        self.assertEqual(copy.stat().st_mtime_ns // 10**6, self.upload.stat().st_mtime_ns // 10**6)

    def test_overwrites_nothing(self):
        self.into.mkdir(parents=True)
        self.assertIn("exists already", failed(self.back_up()))
        self.assertEqual(list(self.into.iterdir()), [])

    def test_replaces_an_incomplete_backup(self):
        part = self.into.with_name("monday.part")
        part.mkdir(parents=True)
        (part / "whittle.db").write_bytes(b"half a database")
        self.assertEqual(self.back_up().returncode, 0)
        self.assertFalse(part.exists())
        with Daemon(data=self.into) as restored:
            self.assertEqual(restored.job(self.done)["id"], self.done)

    def test_detects_a_damaged_or_missing_image_and_a_missing_upload(self):
        sha = self.artifacts[1]["sha256"]
        image, kept = self.daemon.data / sha[:2] / sha, self.directory / "kept"
        for path, replacement, message in ((image, image.read_bytes()[:-1] + b"?", f"{sha} is damaged"),
                                           (image, None, f"image.exr of job {self.done}"), (self.upload, None, f"the upload {sha256(UPLOAD)}")):
            path.rename(kept)
            if replacement:
                path.write_bytes(replacement)
            made = self.back_up()
            kept.rename(path)
            self.assertIn(message, failed(made))
            self.assertFalse(self.into.exists())
        self.assertEqual(self.back_up().returncode, 0)

    def test_rejects_a_directory_that_is_no_data_directory(self):
        self.assertRegex(failed(self.back_up(self.directory / "nothing")), r"^whittled: --backup: cannot open .*/nothing/whittle\.db: ")

    def test_needs_no_daemon(self):
        with Daemon() as daemon:
            done = daemon.rendered(scene())["id"]
            daemon.kill()
            shutil.copytree(daemon.data, self.directory / "stopped")
        self.assertEqual(self.back_up(self.directory / "stopped").returncode, 0)
        with Daemon(data=self.into) as restored:
            self.assertEqual(restored.job(done)["state"], "succeeded")
