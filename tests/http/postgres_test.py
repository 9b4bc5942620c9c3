"""The daemon with a PostgreSQL database: the same interface, and what happens when the database is away."""
import unittest

from tests.http.daemon import FAR, Daemon, failed, json_of, scene, wait_until, whittled
from tests.support.postgres import PostgresServer

SMALL = scene(32, 24)


class PostgresTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = PostgresServer(["fsync=on"])
        cls.addClassCleanup(cls.server.close)

    def setUp(self):
        self.database = self.server.new_database()
        self.option = ("--database", self.server.uri(self.database))

    def test_renders_the_same_image_as_with_sqlite(self):
        images = []
        for options in ((), self.option):
            with Daemon(*options) as daemon:
                images.append(daemon.get(daemon.rendered(SMALL)["links"]["image"]).body)
        self.assertEqual(images[0], images[1])

    def test_keeps_the_jobs_over_kill_9(self):
        with Daemon(*self.option) as daemon:
            path = daemon.rendered(SMALL)["links"]["image"]
            image = daemon.get(path).body
            waiting = daemon.submit(scene(job={"run_after": FAR}))
            daemon.restart()
            self.assertEqual(daemon.get(path).body, image)
            self.assertEqual(daemon.job(waiting)["state"], "queued")
            self.assertEqual(len(json_of(daemon.get("/v1/jobs"))["items"]), 2)

    def test_answers_503_while_the_database_is_away(self):
        with Daemon(*self.option) as daemon:
            job = daemon.rendered(SMALL)["id"]
            for end in (self.server.stop, self.server.kill):
                end()
                try:
                    for answer in (daemon.get(f"/v1/jobs/{job}"), daemon.request("POST", "/v1/jobs", SMALL)):
                        self.assertEqual(answer.status, 503)
                        self.assertEqual(json_of(answer)["type"].rpartition(":")[2], "store_unavailable")
                        self.assertIn("retry-after", answer.headers)
                finally:
                    self.server.start()
                wait_until(lambda: daemon.get(f"/v1/jobs/{job}").status == 200, "the database")
                daemon.rendered(SMALL)

    def test_a_render_survives_the_absence_of_the_database(self):
        with Daemon(*self.option) as daemon:
            job = daemon.start_job(scene(800, 600, samples=16))
            self.server.stop()
            try:
                wait_until(lambda: any(row["during"] == "succeed" for row in daemon.log_rows("store_failure")), "the end of the render")
            finally:
                self.server.start()
            wait_until(lambda: daemon.get(f"/v1/jobs/{job}").status == 200, "the database")
            ended = daemon.wait_for_end(job)
            self.assertEqual((ended["state"], ended["attempt"]), ("succeeded", 1))

    def test_reports_a_database_that_cannot_be_used(self):
        for database in ("postgres://nobody@/none?host=/nonexistent", "no=connection"):
            error = failed(whittled("--check-config", "--database", database, cwd=self.server.directory), 2)
            self.assertIn("whittled: --database: PostgreSQL: ", error)

    def test_shows_no_password(self):
        uri = self.option[1].replace("postgres@", "postgres:hunter2@")
        for database in (uri, f"host={self.server.directory} user=postgres password=hunter2 dbname={self.database}"):
            with Daemon("--database", database) as daemon:
                self.assertIn("***", daemon.log())
                self.assertNotIn("hunter2", daemon.log())

    def test_backup_points_to_the_tool_of_the_database(self):
        self.assertIn("pg_dump", failed(whittled(*self.option, "--backup", "copy", cwd=self.server.directory), 2))
