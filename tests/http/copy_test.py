"""--copy-to: the data of a stopped daemon, to a database and a bucket and back, whole or in several attempts."""
import os
import subprocess

from tests.http.daemon import FAR, PATIENCE_S, Daemon, failed, json_of, put, scene, sha256, wait_until
from tests.http.object_store_test import KEYS, SharedFilesTest
from tests.http.uploads_test import TILE, VASE, textured
from tests.support.whittle import BIN, succeeded, temporary_directory

LARGE = scene(700, 500, output={"formats": ["png", "exr"]})  # too large for a row of the database
IDEMPOTENT = {"Idempotency-Key": "night-17"}


def fill(daemon):
    """Something of everything that is stored. Returns the answer under an Idempotency-Key."""
    for content in (TILE, VASE):
        put(daemon, content)
    jobs = [daemon.submit(document) for document in (
        scene(32, 24), LARGE, textured(TILE, job={"labels": {"shot": "17"}, "priority": 3}),
        scene(job={"webhook": {"url": "http://127.0.0.1:9/closed"}}))]
    batch = json_of(daemon.request("POST", "/v1/batches", {"name": "orbit", "scene": textured(TILE), "frames": [{"camera": {"fov": fov}} for fov in (30, 40, 50)]}))
    jobs += [item["id"] for item in json_of(daemon.get(f"/v1/jobs?batch={batch['id']}"))["items"]]
    cancelled = daemon.submit(scene(job={"run_after": FAR}))
    daemon.request("POST", f"/v1/jobs/{cancelled}/cancel")
    daemon.submit(scene(name="later", job={"run_after": FAR}))
    reply = daemon.request("POST", "/v1/jobs", scene(name="once"), IDEMPOTENT)
    for job in (*jobs, json_of(reply)["id"]):
        daemon.wait_for_end(job)
    wait_until(lambda: json_of(daemon.get(f"/v1/jobs/{jobs[3]}/deliveries"))["items"][0]["attempts"], "the first attempt of the webhook")
    return json_of(reply)["id"]


def content_of(daemon):
    """Everything that a client can read, without what changes with time."""
    content = {}
    jobs = json_of(daemon.get("/v1/jobs?limit=100"))["items"]
    for job in jobs:
        path = f"/v1/jobs/{job['id']}"
        content[path] = daemon.job(job["id"])
        for part in ("history", "scene"):
            content[f"{path}/{part}"] = daemon.get(f"{path}/{part}").body
        # Attempts go on.
        content[f"{path}/deliveries"] = [(each["id"], each["event"], each["created_at"]) for each in json_of(daemon.get(f"{path}/deliveries"))["items"]]
        for artifact in job["artifacts"]:
            image = daemon.get(artifact["url"])
            content[artifact["url"]] = (image.status, sha256(image.body) == artifact["sha256"])
    for batch in json_of(daemon.get("/v1/batches"))["items"]:
        content[f"/v1/batches/{batch['id']}"] = json_of(daemon.get(f"/v1/batches/{batch['id']}"))
    for upload in (TILE, VASE):
        content[sha256(upload)] = daemon.get(f"/v1/assets/{sha256(upload)}").body == upload
    status = json_of(daemon.get("/v1/queue"))
    content["queue"] = status["jobs"] if "jobs" in status else {name: value for name, value in status.items() if isinstance(value, int)}
    return content


class CopyTest(SharedFilesTest):
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.directory = temporary_directory(cls)
        (cls.directory / "secret").write_text("whsec_" + "MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw" + "\n")
        cls.webhooks = ("--webhook-secret-file", str(cls.directory / "secret"), "--webhook-networks", "127.0.0.0/8")
        with Daemon(*cls.webhooks, data=cls.directory / "data") as daemon:
            cls.once = fill(daemon)
            cls.content = content_of(daemon)
            daemon.terminate()

    def command(self, *options):
        return ([BIN / "whittled", *map(str, options)], {"cwd": self.directory, "env": {**os.environ, **KEYS}, "text": True})

    def run_command(self, *options):
        words, settings = self.command(*options)
        return subprocess.run(words, check=False, capture_output=True, **settings)

    def to_cluster(self):
        return ("--data", self.directory / "data", "--copy-to", self.server.uri(self.name), *self.artifacts)

    def copy(self, *options):
        result = succeeded(self.run_command(*options))
        self.assertIn("all tables are equal", result.stderr)

    def assert_same(self, *options, **changes):
        with Daemon(*self.webhooks, *options, environment=KEYS, **changes) as daemon:
            self.assertEqual(content_of(daemon), self.content)
            repeated = daemon.request("POST", "/v1/jobs", scene(name="once"), IDEMPOTENT)
            self.assertEqual((json_of(repeated)["id"], repeated.headers["Idempotent-Replayed"]), (self.once, "true"))
            self.assertEqual(daemon.wait_for_end(daemon.submit(textured(TILE, name="new")))["state"], "succeeded")
            daemon.terminate()

    def test_copies_everything_to_a_cluster_and_back(self):
        self.copy(*self.to_cluster())
        back = self.directory / f"back-{self.name}"
        self.copy(*self.options, "--copy-to", back)
        self.assert_same(*self.options)
        self.assert_same(data=back)
        self.assertFalse(back.with_name(back.name + ".part").exists())

    def kill_in_the_middle(self, *options, until, requests=1):
        """kill -9 as soon as `until()`. The bucket answers some requests, the check of its name and those for images, then fails."""
        self.bucket.objects.status = 503
        self.bucket.objects.skip_faults = requests
        self.bucket.objects.faults["status"] = 1 << 30
        words, settings = self.command(*options)
        with subprocess.Popen(words, stderr=subprocess.PIPE, **settings) as process:
            wait_until(lambda: until() or process.poll() is not None, "the middle of the copy")
            self.assertIsNone(process.poll(), "it still runs")
            process.kill()
            process.communicate(timeout=PATIENCE_S)
        self.bucket.objects.faults["status"] = self.bucket.objects.skip_faults = 0

    def rows(self, table):
        exists = self.server.sql(self.name, f"SELECT to_regclass('{table}') IS NOT NULL") == "t"
        return int(self.server.sql(self.name, f"SELECT count(*) FROM {table}")) if exists else 0

    def test_continues_after_kill_9(self):
        self.kill_in_the_middle(*self.to_cluster(), until=lambda: self.rows("jobs"))
        self.assertIn("unfinished copy", self.run_command("--check-config", *self.options).stderr)
        self.kill_in_the_middle(*self.to_cluster(), until=lambda: self.bucket.objects.objects, requests=12)
        self.assertIn("unfinished copy", self.run_command("--check-config", *self.options).stderr)
        self.copy(*self.to_cluster())
        self.assert_same(*self.options)

    def test_continues_a_copy_to_a_directory_after_kill_9(self):
        self.copy(*self.to_cluster())
        back = self.directory / f"resumed-{self.name}"
        part = back.with_name(back.name + ".part") / "whittle.db"
        self.kill_in_the_middle(*self.options, "--copy-to", back, until=lambda: part.exists() and part.stat().st_size, requests=4)
        self.assertFalse(back.exists())
        self.copy(*self.options, "--copy-to", back)
        self.assert_same(data=back)

    def test_reports_a_damaged_image_and_continues_when_it_is_gone(self):
        self.copy(*self.to_cluster())
        key = next(key for key in self.bucket.objects.objects if "/artifacts/" in key)
        good = self.bucket.objects.objects[key]
        self.bucket.objects.objects[key] = b"x" + good[1:]
        back = self.directory / f"damaged-{self.name}"
        error = failed(self.run_command(*self.options, "--copy-to", back))
        self.assertIn(key.rpartition("/")[2] + " is missing or damaged", error)
        self.bucket.objects.objects[key] = good
        self.copy(*self.options, "--copy-to", back)

    def test_finds_a_source_that_was_changed_meanwhile(self):
        self.kill_in_the_middle(*self.to_cluster(), until=lambda: self.rows("deliveries"))
        self.server.sql(self.name, "UPDATE jobs SET name = 'other' WHERE name = 'later'")
        self.assertIn("the copy of the table jobs has", failed(self.run_command(*self.to_cluster())))

    def test_refuses_what_is_no_empty_end(self):
        self.copy(*self.to_cluster())
        self.assertIn("has tables already", self.run_command(*self.to_cluster()).stderr)
        self.assertIn("exists already", self.run_command(*self.options, "--copy-to", self.directory).stderr)
        self.assertIn("has no data of a daemon", self.run_command("--data", self.directory / "none", *self.to_cluster()[2:]).stderr)
        with Daemon(data=self.directory / "data"):
            self.assertIn("is in use by process", self.run_command(*self.to_cluster()[:3], self.server.uri(self.server.new_database()), *self.artifacts).stderr)
        for options, sentence in ((("--copy-to", ""), "needs the URI"), (("--copy-to", "postgres:///x"), "needs --artifacts"),
                                  (("--copy-to", "directory", *self.artifacts), "needs --database"),
                                  (("--copy-to", "postgres:///x", *self.options), "--database is that of a copy to a directory")):
            self.assertIn(sentence, failed(self.run_command(*options), 2))
