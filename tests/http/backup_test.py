"""A backup of a running daemon is a data directory, with which another daemon can start."""
import hashlib
import pathlib
import shutil
import subprocess
import tempfile
import unittest

from tests.http.daemon import BIN, Daemon, scene

SMALL = 32 << 10  # small_bytes_max of sqlite_stores.cpp


def back_up(data, into):
    return subprocess.run([BIN / "whittled", "--data", data, "--backup", into], capture_output=True, text=True, check=False,
                          timeout=600)


class Backup(unittest.TestCase):
    def setUp(self):
        self.directory = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.into = self.directory / "backups" / "monday"

    def test_of_a_running_daemon_contains_its_jobs_images_and_uploads(self):
        asset = b"some bytes that nobody reads"
        name = hashlib.sha256(asset).hexdigest()
        with Daemon() as daemon:
            done = daemon.submit(scene(150, 150, job={"name": "done", "labels": {"shot": "1"}}, output={"formats": ["png", "exr"]}))
            daemon.wait_for_end(done)
            images = {file: daemon.get(f"/v1/jobs/{done}/{file}").body for file in ("image.png", "image.exr")}
            self.assertLess(len(images["image.png"]), SMALL, "beside the rows")
            self.assertGreater(len(images["image.exr"]), SMALL, "a file")
            running = daemon.start_job()
            waiting = [daemon.submit(scene(name=f"waiting {i}", job={"priority": 1})) for i in range(20)]
            daemon.request("PUT", f"/v1/assets/{name}", asset)
            made = back_up(daemon.data, self.into)
            self.assertEqual((made.returncode, made.stdout, made.stderr), (0, "", ""))
            self.assertEqual(daemon.job(running)["state"], "running")
            after = daemon.submit(scene(name="after the backup"))
        with Daemon(data=self.into) as restored:
            for file, image in images.items():
                self.assertEqual(restored.get(f"/v1/jobs/{done}/{file}").body, image)
            self.assertEqual(restored.job(done)["labels"], {"shot": "1"})
            self.assertEqual(restored.get(f"/v1/assets/{name}").body, asset)
            self.assertEqual(restored.get(f"/v1/jobs/{after}").status, 404)
            restored.wait_for_state(running, "running")
            restored.request("POST", f"/v1/jobs/{running}/cancel")
            for job_id in waiting:
                self.assertEqual(restored.wait_for_end(job_id)["state"], "succeeded")

    def test_preserves_the_day_of_the_last_use_of_an_upload(self):
        asset = b"old"
        name = hashlib.sha256(asset).hexdigest()
        with Daemon() as daemon:
            daemon.request("PUT", f"/v1/assets/{name}", asset)
            original = daemon.data / "uploads" / name[:2] / name
            back_up(daemon.data, self.into)
            copy = self.into / "uploads" / name[:2] / name
            self.assertEqual(copy.stat().st_mtime_ns // 10**6, original.stat().st_mtime_ns // 10**6)

    def test_is_private(self):
        with Daemon() as daemon:
            daemon.wait_for_end(daemon.submit(scene(150, 150, output={"formats": ["exr"]})))
            back_up(daemon.data, self.into)
            files = list(daemon.data.rglob("*"))
            self.assertIn(daemon.data / "whittle.db-wal", files)
            self.assertEqual([file for file in files if file.stat().st_mode & 0o007], [], "for every user")
        self.assertEqual(self.into.stat().st_mode & 0o777, 0o700)

    def test_overwrites_nothing(self):
        self.into.mkdir(parents=True)
        with Daemon() as daemon:
            made = back_up(daemon.data, self.into)
        self.assertEqual(made.returncode, 1)
        self.assertIn("exists already", made.stderr)
        self.assertEqual(list(self.into.iterdir()), [])

    def test_replaces_an_incomplete_backup(self):
        part = self.into.with_name("monday.part")
        part.mkdir(parents=True)
        (part / "whittle.db").write_bytes(b"half a database")
        with Daemon() as daemon:
            done = daemon.submit(scene())
            self.assertEqual(back_up(daemon.data, self.into).returncode, 0)
        self.assertFalse(part.exists())
        with Daemon(data=self.into) as restored:
            self.assertEqual(restored.job(done)["id"], done)

    def test_detects_a_damaged_image(self):
        with Daemon() as daemon:
            job = daemon.wait_for_end(daemon.submit(scene(150, 150, output={"formats": ["exr"]})))
            sha256 = job["artifacts"][0]["sha256"]
            image = daemon.data / sha256[:2] / sha256
            image.write_bytes(image.read_bytes()[:-1] + b"?")
            made = back_up(daemon.data, self.into)
        self.assertEqual(made.returncode, 1)
        self.assertIn(f"{sha256} is damaged", made.stderr)
        self.assertFalse(self.into.exists())

    def test_detects_a_missing_image_or_upload(self):
        asset = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
        name = hashlib.sha256(asset).hexdigest()
        mesh = {"type": "mesh", "file": f"sha256:{name}", "material": {}}
        with Daemon() as daemon:
            daemon.request("PUT", f"/v1/assets/{name}", asset)
            document = scene(150, 150, output={"formats": ["exr"]})
            job = daemon.wait_for_end(daemon.submit(document | {"objects": document["objects"] + [mesh]}))
            self.assertEqual(job["state"], "succeeded", job["problem"])
            sha256 = job["artifacts"][0]["sha256"]
            for path, message in ((daemon.data / sha256[:2] / sha256, f"image.exr of job {job['id']}"),
                                  (daemon.data / "uploads" / name[:2] / name, f"the upload {name}")):
                path.rename(self.directory / "kept")
                made = back_up(daemon.data, self.into)
                self.assertEqual(made.returncode, 1, message)
                self.assertIn(message, made.stderr)
                self.assertFalse(self.into.exists())
                (self.directory / "kept").rename(path)
            self.assertEqual(back_up(daemon.data, self.into).returncode, 0)

    def test_rejects_a_directory_that_is_no_data_directory(self):
        made = back_up(self.directory / "nothing", self.into)
        self.assertEqual(made.returncode, 1)
        self.assertRegex(made.stderr, r"^whittled: --backup: cannot open .*/nothing/whittle\.db: ")

    def test_needs_no_daemon(self):
        with Daemon() as daemon:
            done = daemon.submit(scene())
            daemon.wait_for_end(done)
            daemon.kill()
            shutil.copytree(daemon.data, self.directory / "stopped")
        self.assertEqual(back_up(self.directory / "stopped", self.into).returncode, 0)
        with Daemon(data=self.into) as restored:
            self.assertEqual(restored.job(done)["state"], "succeeded")


if __name__ == "__main__":
    unittest.main()
