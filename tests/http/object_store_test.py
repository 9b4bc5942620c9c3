"""Images and uploads in a bucket or a directory that several nodes share, and what happens while the bucket is away."""
import contextlib
import http.client
import io
import json
import os
import pathlib
import subprocess
import tarfile
import tempfile
import threading
import unittest
import urllib.parse

from tests.http.daemon import Daemon, failed, json_of, put, scene, sha256, wait_until, whittled
from tests.http.uploads_test import TILE, textured
from tests.support.postgres import PostgresServer, programs
from tests.support.s3 import ACCESS_KEY, SECRET_KEY, S3Server
from tests.support.whittle import only_in_long_runs, temporary_directory

SMALL = scene(32, 24)
LARGE = scene(1200, 900, samples=1, output={"formats": ["png", "exr"]})  # its EXR has more than 1 MiB
KEYS = {"AWS_ACCESS_KEY_ID": ACCESS_KEY, "AWS_SECRET_ACCESS_KEY": SECRET_KEY}
FAILED_TRIES = 60 if os.environ.get("WHITTLE_LONG") else 6  # of a result that waits: two a second
WAITING_JOBS = 20 if os.environ.get("WHITTLE_LONG") else 4


def artifact_of(job, name):
    return next(artifact for artifact in job["artifacts"] if artifact["name"] == name)


class SharedFilesTest(unittest.TestCase):
    """Nodes with one database; each test has an empty one, and an empty bucket."""

    @classmethod
    def setUpClass(cls):
        cls.server = PostgresServer()
        cls.addClassCleanup(cls.server.close)

    def setUp(self):
        self.bucket = S3Server()
        self.addCleanup(lambda: self.bucket.down())  # pylint: disable=unnecessary-lambda
        self.name = self.server.new_database()
        self.database = ("--database", self.server.uri(self.name))
        self.artifacts = ("--artifacts", "s3://whittle/farm", "--s3-endpoint", self.bucket.endpoint, "--s3-path-style", "on")
        self.options = (*self.database, *self.artifacts)

    def node(self, *options, **changes):
        return self.enterContext(Daemon(*self.options, *options, **{"environment": KEYS, **changes}))

    def keys(self, kind):
        return sorted(key for key in self.bucket.objects.objects if key.startswith(f"farm/{kind}/"))


class BucketTest(SharedFilesTest):
    def test_every_node_has_the_images_and_uploads_of_all(self):
        with Daemon() as alone:
            put(alone, TILE)
            expected = alone.rendered(textured(TILE))["artifacts"]
        a, b = self.node("--jobs", "1"), self.node("--jobs", "1")
        self.assertEqual(put(a, TILE).status, 201)
        self.assertEqual(put(b, TILE).status, 200)
        self.assertEqual(b.get(f"/v1/assets/{sha256(TILE)}").body, TILE)
        jobs = [b.submit(textured(TILE, name=f"{i}")) for i in range(6)]
        for job in jobs:
            self.assertEqual(a.wait_for_success(job)["artifacts"][0]["sha256"], expected[0]["sha256"])
            images = [node.get(f"/v1/jobs/{job}/image.png").body for node in (a, b)]
            self.assertEqual([sha256(image) for image in images], [expected[0]["sha256"]] * 2)
        self.assertEqual(len(self.keys("artifacts")), 1)
        self.assertEqual(self.keys("assets"), [f"farm/assets/{sha256(TILE)[:2]}/{sha256(TILE)}"])
        for node in (a, b):
            self.assertFalse([path for path in node.data.rglob("*") if path.is_file() and path.name == expected[0]["sha256"]])

    def test_serves_ranges_and_etags_and_everything_that_reads_images(self):
        node = self.node()
        batch = json_of(node.request("POST", "/v1/batches", {"scene": LARGE, "frames": [{"name": name} for name in "ab"]}))
        jobs = [node.wait_for_end(item["id"])["id"] for item in json_of(node.get(f"/v1/jobs?batch={batch['id']}"))["items"]]
        job = node.job(jobs[0])
        exr = artifact_of(job, "image.exr")
        self.assertGreater(exr["bytes"], 1 << 20, "several parts")
        path = f"/v1/jobs/{jobs[0]}/image.exr"
        whole = node.get(path)
        self.assertEqual(sha256(whole.body), exr["sha256"])
        part = node.get(path, Range="bytes=1048000-1049999")
        self.assertEqual((part.status, part.body), (206, whole.body[1048000:1050000]))
        self.assertEqual(node.get(path, Range="bytes=-10").body, whole.body[-10:])
        self.assertEqual(node.get(path, If_None_Match=whole.headers["ETag"]).status, 304)
        head = node.request("HEAD", path)
        self.assertEqual((head.status, head.headers["Content-Length"]), (200, str(exr["bytes"])))
        archive = tarfile.open(fileobj=io.BytesIO(node.get(f"/v1/batches/{batch['id']}/artifacts.tar").body))
        self.assertEqual(sorted(sha256(archive.extractfile(each).read()) for each in archive),
                         sorted(artifact["sha256"] for each in jobs for artifact in node.job(each)["artifacts"]))
        animation = node.get(f"/v1/batches/{batch['id']}/animation.apng")
        self.assertEqual((animation.status, animation.body[:4]), (200, b"\x89PNG"))
        self.assertEqual(len(animation.body), int(animation.headers["Content-Length"]))
        self.assertEqual(node.get(f"/v1/jobs/{jobs[0]}/preview?max=64").body[:4], b"\x89PNG")
        compared = node.request("POST", "/v1/compare", {"a": jobs[0], "b": jobs[1]})
        self.assertEqual((compared.status, json_of(compared)["rmse"]), (200, 0))

    def test_a_damaged_image_is_found_and_rendered_again(self):
        node = self.node()
        for document, name in ((SMALL, "image.png"), (LARGE, "image.exr")):
            job = node.submit(document)
            artifact = artifact_of(node.wait_for_end(job), name)
            key = f"farm/artifacts/{artifact['sha256'][:2]}/{artifact['sha256']}"
            self.bucket.objects.objects[key] = b"x" + self.bucket.objects.objects[key][1:]
            if artifact["bytes"] > 1 << 18:  # its end is not sent
                with self.assertRaises(http.client.IncompleteRead):
                    node.get(f"/v1/jobs/{job}/{name}")
            reply = node.get(f"/v1/jobs/{job}/{name}")
            self.assertEqual((reply.status, json_of(reply)["type"]), (500, "urn:whittle:problem:image_damaged"))
            self.assertEqual(node.request("POST", f"/v1/jobs/{job}/retry").status, 202)
            self.assertEqual(node.wait_for_end(job)["state"], "succeeded")
            self.assertEqual(sha256(node.get(f"/v1/jobs/{job}/{name}").body), artifact["sha256"])

    def test_redirects_large_downloads(self):
        node = self.node("--artifact-redirect", "on")
        job = node.rendered(LARGE)
        exr, png = artifact_of(job, "image.exr"), artifact_of(job, "image.png")
        reply = node.get(exr["url"])
        self.assertEqual((reply.status, reply.headers["Cache-Control"]), (307, "no-store"))
        url = urllib.parse.urlsplit(reply.headers["Location"])
        connection = http.client.HTTPConnection(url.netloc)
        connection.request("GET", f"{url.path}?{url.query}")
        answer = connection.getresponse()
        self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, exr["media_type"]))
        self.assertEqual(sha256(answer.read()), exr["sha256"])
        connection.close()
        self.assertEqual(node.get(png["url"]).status, 200, "it is small")
        self.assertEqual(node.get(exr["url"], Sec_Fetch_Mode="cors").status, 200, "a script of the page")
        self.assertEqual(node.get(exr["url"], If_None_Match=f'"{exr["sha256"]}"').status, 304)
        self.assertEqual(node.request("HEAD", exr["url"]).status, 200)

    def test_whittle_submit_follows_redirects_without_its_key(self):
        directory = temporary_directory(self)
        key = whittled("--new-key", "a", "--keys", directory / "keys").stdout.strip()
        node = self.node("--artifact-redirect", "on", "--keys", str(directory / "keys"))
        (directory / "scene.json").write_text(json.dumps(LARGE))
        subprocess.run([pathlib.Path("api/client/whittle-submit").resolve(), "--server", f"http://127.0.0.1:{node.port}", "scene.json", "--out", "out"],
                       cwd=directory, check=True, capture_output=True, env={**os.environ, "WHITTLE_KEY": key})
        sums = {sha256(path.read_bytes()) for path in (directory / "out").glob("scene*.*r")}
        self.assertTrue(sums & {key.rpartition("/")[2] for key in self.keys("artifacts")})
        self.assertIn("307", str({row.get("status") for row in node.log_rows()}))

    def test_reports_a_bucket_that_cannot_be_used(self):
        def errors(*options, environment=KEYS):
            return failed(whittled("--check-config", *options, environment=environment, cwd=tempfile.gettempdir()), 2)
        good = self.options
        self.assertIn("--artifacts: needs --database", errors(*self.artifacts))
        for changed, sentence in (
                (("--artifacts", "s3://Whittle"), "--artifacts: must be s3://BUCKET"),
                (("--artifacts", "s3://other"), "status 404, NoSuchBucket"),
                (("--artifacts", "/nonexistent"), "/nonexistent is no directory"),
                (("--s3-endpoint", "store:9000"), "--s3-endpoint: must be http://HOST:PORT"),
                (("--s3-region", "eu-central-1"), "expecting 'us-east-1'"),
                (("--s3-path-style", "yes"), "--s3-path-style: must be one of on|off"),
                (("--s3-credentials-file", "/nonexistent"), "cannot read the credentials in /nonexistent")):
            options = dict(zip(good[::2], good[1::2]))
            options.update([changed])
            self.assertIn(sentence, errors(*(word for pair in options.items() for word in pair)))
        self.assertIn("AWS_ACCESS_KEY_ID or AWS_SECRET_ACCESS_KEY is not set", errors(*good, environment={}))
        self.assertIn("SignatureDoesNotMatch", errors(*good, environment={**KEYS, "AWS_SECRET_ACCESS_KEY": "other"}))
        self.assertIn("--artifact-redirect: needs --artifacts", errors(*self.database, "--artifact-redirect", "on"))

    def test_logs_no_credentials(self):
        node = self.node()
        self.assertNotIn(SECRET_KEY, node.log())


@only_in_long_runs
class BackupTest(SharedFilesTest):
    def test_a_dump_and_then_a_copy_of_the_bucket_have_every_image(self):
        node = self.node()
        deleted = node.rendered(scene(20, 10, name="deleted"))["id"]
        ending = threading.Event()
        jobs = []

        def submit_until_end():
            while not ending.is_set():
                jobs.append(node.submit(scene(24 + len(jobs), 18)))  # each has an image of its own
        load = threading.Thread(target=submit_until_end)
        load.start()
        try:
            wait_until(lambda: sum(node.job(job)["state"] == "succeeded" for job in list(jobs)) > 5, "some images")
            dump = subprocess.run([programs() / "pg_dump", self.server.uri(self.name)], check=True, capture_output=True).stdout
            submitted = len(jobs)
            self.assertEqual(node.request("DELETE", f"/v1/jobs/{deleted}").status, 204)
            wait_until(lambda: len(jobs) > submitted + 5, "more jobs between the two copies")
            copy = dict(self.bucket.objects.objects)
        finally:
            ending.set()
            load.join()
        node.kill()
        self.bucket.objects.objects.clear()
        self.bucket.objects.objects.update(copy)
        self.name = self.server.new_database()
        self.options = ("--database", self.server.uri(self.name), *self.artifacts)
        subprocess.run([programs() / "psql", "-qX", "-v", "ON_ERROR_STOP=1", self.server.uri(self.name)], input=dump, check=True,
                       stdout=subprocess.DEVNULL)
        rows = self.server.sql(self.name, "SELECT id FROM jobs WHERE state = 'succeeded'").split()
        restored = self.node("--lease-s", "2")
        for job in rows:
            image = restored.get(f"/v1/jobs/{job}/image.png")
            self.assertEqual(image.status, 200, image.body)
            self.assertEqual(sha256(image.body), restored.job(job)["artifacts"][0]["sha256"])
        print(f"restored {len(rows)} images of {len(rows)} succeeded jobs; {len(jobs)} were submitted during the backup")
        self.assertIn(deleted, rows)
        self.assertGreater(len(rows), 5)
        running = self.server.sql(self.name, "SELECT id FROM jobs WHERE ended_at IS NULL").split()
        for job in running:
            self.assertEqual(restored.wait_for_end(job)["state"], "succeeded", "it runs again")


class BucketAwayTest(SharedFilesTest):
    @contextlib.contextmanager
    def away(self):
        self.bucket.down()
        try:
            yield
        finally:
            self.bucket = self.bucket.up()

    @staticmethod
    def wait_for_a_result_that_waits(node):
        wait_until(lambda: node.log_rows("results_wait"), "a result that waits")

    def assert_rendered_once(self, node, job):
        ended = node.wait_for_end(job)
        self.assertEqual((ended["state"], ended["attempt"]), ("succeeded", 1))
        self.assertEqual(sha256(node.get(f"/v1/jobs/{job}/image.png").body), ended["artifacts"][0]["sha256"])
        return ended

    def test_finished_images_wait_on_the_disk_and_are_stored_afterwards(self):
        node = self.node("--jobs", "2")
        before = node.rendered(SMALL)["id"]
        slow = node.start_job(scene(800, 600, samples=16))
        with self.away():
            jobs = [slow, *(node.submit(scene(40, 30, name=f"{i}")) for i in range(WAITING_JOBS))]
            self.wait_for_a_result_that_waits(node)
            reply = node.get(f"/v1/jobs/{before}/image.png")
            self.assertEqual((reply.status, json_of(reply)["type"]), (503, "urn:whittle:problem:store_unavailable"))
            self.assertIn("retry-after", reply.headers)
            self.assertEqual(node.job(before)["state"], "succeeded", "jobs can be read")
            wait_until(lambda: all(node.job(job)["state"] == "running" for job in jobs), "all jobs, which two slots render")
            wait_until(lambda: len(node.log_rows("store_failure")) >= FAILED_TRIES, "some tries")
        for job in jobs:
            self.assert_rendered_once(node, job)
        wait_until(lambda: node.log_rows("results_stored"), "the end of the waiting")
        print(f"bucket away for {FAILED_TRIES} tries: {len(jobs)} of {len(jobs)} results stored, 0 attempts lost")

    def test_starts_no_job_beyond_the_space_for_waiting_images(self):
        node = self.node("--jobs", "1", "--waiting-bytes", "1")
        with self.away():
            first = node.submit(SMALL)
            self.wait_for_a_result_that_waits(node)
            second = node.submit(SMALL)
            wait_until(lambda: len(node.log_rows("store_failure")) > 2, "some tries")
            self.assertEqual((node.job(first)["state"], node.job(second)["state"]), ("running", "queued"))
        for job in (first, second):
            self.assert_rendered_once(node, job)

    def test_a_job_whose_upload_cannot_be_fetched_loses_no_attempt(self):
        a = self.node()
        put(a, TILE)
        a.terminate()
        b = self.node()
        with self.away():
            job = b.submit(textured(TILE))
            wait_until(lambda: "assets_unavailable" in b.get(f"/v1/jobs/{job}/history").body.decode(), "its return to the queue")
        self.assert_rendered_once(b, job)

    def test_a_cached_image_that_is_away_is_rendered_again(self):
        node = self.node()
        document = scene(32, 24, job={"cache": "use"})
        first = node.rendered(document)
        with self.away():
            job = node.submit(document)
            self.wait_for_a_result_that_waits(node)
        self.assertEqual(self.assert_rendered_once(node, job)["artifacts"][0]["sha256"], first["artifacts"][0]["sha256"])

    def test_a_killed_node_loses_no_job(self):
        a = self.node()
        with self.away():
            job = a.submit(SMALL)
            self.wait_for_a_result_that_waits(a)
            a.kill()
        self.server.sql(self.name, "UPDATE jobs SET lease_until = 1 WHERE state = 'running'")
        self.assert_rendered_once(self.node(), job)


class SharedDirectoryTest(SharedFilesTest):
    def setUp(self):
        super().setUp()
        self.directory = temporary_directory(self)
        self.options = (*self.database, "--artifacts", str(self.directory))

    def test_every_node_has_the_images_and_uploads_of_all(self):
        a, b = self.node("--jobs", "1"), self.node("--jobs", "1")
        put(a, TILE)
        jobs = [a.submit(textured(TILE, name=f"{i}")) for i in range(4)]
        for job in jobs:
            ended = b.wait_for_success(job)
            for node in (a, b):
                self.assertEqual(sha256(node.get(f"/v1/jobs/{job}/image.png").body), ended["artifacts"][0]["sha256"])
        self.assertTrue((self.directory / "assets" / sha256(TILE)[:2] / sha256(TILE)).exists())

    def test_reports_what_needs_a_bucket(self):
        error = failed(whittled("--check-config", *self.options, "--artifact-redirect", "on", cwd=tempfile.gettempdir()), 2)
        self.assertIn("--artifact-redirect: needs --artifacts with a bucket", error)
