"""Options from flags, environment and file: validation, precedence, and the effect of each option."""
import contextlib
import json
import shutil
import sqlite3

from tests.http.daemon import Daemon, failed, json_of, long_scene, scene, wait_until, whittled
from tests.support.whittle import DirectoryTest, succeeded, temporary_directory


class Options(DirectoryTest):
    def test_everything_that_would_stop_the_start_is_reported_at_once(self):
        file, none = self.directory / "file", self.directory / "none"
        file.write_text("")
        wrong = {"--jobs": "many", "--assets": none, "--keys": none, "--data": file / "data", "--webhook-secret-file": none,
                 "--webhook-networks": "everywhere", "--listen": "192.0.2.1:8080"}
        options = [text for option in wrong.items() for text in option]
        for task in ((), ("--check-config",)):
            result = whittled(*task, *options)
            self.assertEqual((result.returncode, result.stdout), (2, ""))
            places = [line.split(": ")[1] for line in result.stderr.splitlines()]
            self.assertEqual(sorted(places), sorted(wrong), result.stderr)
        self.assertEqual(list(self.directory.iterdir()), [file])

    def test_data_of_another_program_stops_the_start(self):
        for text, word in (("PRAGMA application_id = 0x57687474; PRAGMA user_version = 3; CREATE TABLE jobs (id)", "version 3"),
                           ("PRAGMA user_version = 3; CREATE TABLE jobs (id)", "another program"), (None, "not a database")):
            with self.subTest(word):
                path = temporary_directory(self) / "whittle.db"
                if text:
                    with contextlib.closing(sqlite3.connect(path)) as database:
                        database.executescript(text)
                else:
                    path.write_text("text" * 1000)
                before = path.read_bytes()
                result = whittled("--check-config", "--data", path.parent)
                self.assertEqual((result.returncode, path.read_bytes()), (2, before))
                self.assertRegex(result.stderr, f"whittled: --data: .*{word}")

    def test_check_config_creates_nothing_and_warns_of_a_running_daemon(self):
        self.assertEqual(whittled("--check-config", "--data", self.directory / "a/b").returncode, 0)
        self.assertEqual(list(self.directory.iterdir()), [])
        with Daemon() as daemon:
            result = succeeded(whittled("--check-config", "--data", daemon.data, "--listen", f"127.0.0.1:{daemon.port}"))
            self.assertRegex(result.stderr, "warning: --listen: .*Address already in use")
            self.assertIn("warning: --data: ", result.stderr)

    def test_check_config_prints_the_options_in_file_format(self):
        first = succeeded(whittled("--check-config", "--jobs", "3", "--log-level", "debug", "--listen", "[::1]:81"))
        self.assertIn("jobs = 3\n", first.stdout)
        file = self.directory / "whittle.conf"
        file.write_text(first.stdout)
        second = whittled("--check-config", "--config", file)
        self.assertEqual(second.stdout, first.stdout)

    def test_probe_reports_readiness_with_the_reason(self):
        with Daemon() as daemon:
            place = f"127.0.0.1:{daemon.health_port}"
            ready = wait_until(lambda: (answer := whittled("--probe", "--health-listen", place)).returncode == 0 and answer, "the worker to start")
        self.assertEqual((ready.stdout, ready.stderr), ("", f"whittled: {place}: ready\n"))
        gone = whittled("--probe", "--health-listen", place)
        self.assertEqual((gone.returncode, gone.stdout), (1, ""))
        self.assertRegex(gone.stderr, f"{place}: no answer .*health_listen")
        with Daemon("--disk-free-bytes", str(1 << 50)) as daemon:
            place = f"127.0.0.1:{daemon.health_port}"
            unready = whittled("--probe", "--health-listen", place)
        self.assertEqual((unready.returncode, unready.stdout), (1, ""))
        self.assertIn(f"{place}: status 503: ", unready.stderr)

    def test_check_config_reports_ignored_variables(self):
        result = succeeded(whittled("--check-config", environment={"WHITTLE_PORT": "tcp://10.0.0.1:80"}))
        self.assertIn("WHITTLE_PORT", result.stderr)

    def test_help_and_version_end_at_once(self):
        self.assertIn("--render-wait-s", whittled("--help").stdout)
        self.assertRegex(whittled("--version").stdout, r"^whittled \d+\.\d+\.\d+")

    def test_limits_on_scenes_are_enforced_and_reported(self):
        sphere = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": {}}
        mesh = {"type": "mesh", "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]],
                "triangles": [[0, 1, 2], [1, 3, 2]], "material": {}}
        light = {"type": "point", "position": [0, 5, 0]}
        for flag, bad in (("--pixels", scene(20, 20)), ("--samples-times-pixels", scene(20, 20)), ("--objects", scene(objects=[sphere] * 400)),
                          ("--triangles", scene(objects=[mesh] * 200)), ("--lights", scene(lights=[light] * 400))):
            with self.subTest(flag), Daemon(flag, "399") as daemon:
                errors = json_of(daemon.request("POST", "/v1/jobs", bad), 422)["errors"]
                self.assertEqual([error["code"] for error in errors], ["limit_exceeded"], errors)
                self.assertIn("399", errors[0]["detail"])
                self.assertEqual(daemon.request("POST", "/v1/jobs", scene(15, 15)).status, 202)

    def test_limits_on_running_jobs_stop_them(self):
        with Daemon("--wall-time-s", "1") as daemon:
            job = daemon.wait_for_end(daemon.submit(long_scene(job={"max_attempts": 1})))
            self.assertEqual(job["problem"]["code"], "timed_out")
            self.assertIn("wall_time_s", job["problem"]["detail"])
        with Daemon("--job-memory-bytes", "1048576") as daemon:
            for path, body in (("/v1/jobs", scene(200, 200)), ("/v1/batches", {"scene": scene(200, 200), "frames": [{}]})):
                problem = json_of(daemon.request("POST", path, body), 422)
                self.assertIn("job_memory_bytes is 1048576, the estimate for the scene is 1601300", problem["errors"][0]["detail"])
            # Vertices without triangles are not in the estimate; the memory limit of the running job stops them.
            mesh = {"type": "mesh", "positions": [[i, 0, i % 3] for i in range(200_000)], "triangles": [[0, 1, 2]], "material": {}}
            greedy = scene(100, 100, samples=4096, objects=[mesh, *scene()["objects"]], job={"max_attempts": 1})
            job = daemon.wait_for_end(daemon.submit(greedy))
            self.assertEqual(job["problem"]["code"], "out_of_memory")
            self.assertIn("job_memory_bytes", job["problem"]["detail"])

    def test_the_log_has_the_settings_once_at_its_level(self):
        with Daemon("--log-level", "warning") as daemon:
            daemon.request("POST", "/v1/jobs", b"{")
            self.assertEqual(daemon.get("/").status, 200)
            self.assertEqual([row for row in daemon.log_rows() if row["level"] in ("debug", "info")], [])
        with Daemon("--drain-s", "19") as daemon:
            self.assertEqual([row["drain_s"] for row in daemon.log_rows("starting")], ["19"])

    def test_the_oldest_images_are_deleted_above_artifact_bytes(self):
        with Daemon("--artifact-bytes", "1") as daemon:
            job_id = daemon.submit(scene())
            job = wait_until(lambda: (job := daemon.job(job_id))["expired"] and job, "the images to expire")
            self.assertEqual((job["state"], job["artifacts"]), ("succeeded", []))
            self.assertEqual(daemon.get(f"/v1/jobs/{job_id}/image.png").status, 410)
            expected = {'whittle_jobs_expired_total{reason="artifact_bytes"}': 1, "whittle_artifact_bytes": 0, "whittle_artifact_limit_bytes": 1}
            self.assertLessEqual(expected.items(), daemon.metrics().items())

    def test_images_may_have_half_of_the_disk_by_default(self):
        with Daemon() as daemon:
            limit = daemon.metrics()["whittle_artifact_limit_bytes"]
            self.assertAlmostEqual(limit / shutil.disk_usage(daemon.data).total, 0.5, delta=0.01)

    def test_port_and_directory_in_use_are_reported(self):
        with Daemon() as daemon:
            for arguments, word in ((("--listen", f"127.0.0.1:{daemon.port}", "--data", daemon.directory / "other"), "listen"),
                                    (("--listen", "127.0.0.1:0", "--data", daemon.data), "in use")):
                error = failed(whittled("--health-listen", "127.0.0.1:0", *arguments))
                last = [json.loads(line) for line in error.splitlines()][-1]
                self.assertEqual(last["event"], "startup_failed")
                self.assertIn(word, last["detail"])
