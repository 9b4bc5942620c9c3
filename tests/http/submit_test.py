"""whittle-submit against a real daemon: images, errors, and recovery from interruptions of client, server and connection."""
import collections
import json
import os
import random
import subprocess
import time

from tests.cli import models_test
from tests.http.daemon import PATIENCE_S, Daemon, OneDaemon, failed, long_scene, scene, wait_until
from tests.http.events_test import Stream
from tests.http.relay import Relay
from tests.support.whittle import SCENES, SOURCE, on_terminal, succeeded, temporary_directory, whittle

SCRIPT = SOURCE / "api/client/whittle-submit"
UNREACHABLE = "http://127.0.0.1:1"


class SubmitTest(OneDaemon):
    """Each test has its own directory for scenes and images, and its own batch label."""

    def setUp(self):
        self.directory = temporary_directory(self)
        self.out = self.directory / "out"
        self.name = self.id().rpartition(".")[2]

    def write(self, name, document):
        path = self.directory / name
        path.write_text(json.dumps(document), encoding="utf-8")
        return path

    def command(self, *arguments, url=None):
        return ["/usr/bin/python3", SCRIPT, "--server", url or f"http://127.0.0.1:{self.daemon.port}", "-o", self.out,
                "--name", self.name, *map(str, arguments)]

    def submit(self, *arguments, url=None):
        return subprocess.run(self.command(*arguments, url=url), capture_output=True, text=True, check=False, timeout=PATIENCE_S)

    def submit_all(self, *arguments, url=None):
        """A run in which every frame succeeds."""
        return succeeded(self.submit(*arguments, url=url))

    def jobs(self):
        return self.daemon.jobs(f"&label=batch:{self.name}")

    def images(self):
        """Complete images only: a partial file has a hidden name and may vanish before it is read."""
        return {path.name: path.read_bytes() for path in self.out.glob("[!.]*") if path.suffix != ".state"}

    def rendered(self, document):
        """The image that the command line renders of the document."""
        path = self.directory / "direct.png"
        succeeded(whittle("render", "-", "-o", path, document=document))
        return path.read_bytes()


class Submission(SubmitTest):
    def test_downloads_an_image_of_each_scene_and_value(self):
        self.write("a.json", scene())
        self.write("b.json", scene(output={"formats": ["png", "exr"]}))
        done = self.submit_all(self.directory / "*.json", "--set", "camera.fov=30..40:5", "--set", "image.width=20")
        images = self.images()
        self.assertEqual(sorted(images), sorted([f"{stem}-fov={fov}.png" for stem in "ab" for fov in (30, 35, 40)]
                                                + [f"b-fov={fov}.exr" for fov in (30, 35, 40)]))
        expected = scene(20, camera={"position": [0, 1, 6], "look_at": [0, 0.5, 0], "fov": 35})
        self.assertEqual(images["a-fov=35.png"], self.rendered(expected))
        self.assertEqual(len(self.jobs()), 6)
        lines = done.stderr.splitlines()
        self.assertEqual(len(lines), 7, "without a terminal: a line for each frame, and the total")
        self.assertTrue(lines[5].startswith("[6/6] "), lines)

    def test_uploads_models(self):
        chair = self.directory / "chair.glb"
        chair.write_bytes(models_test.glb(*models_test.squares([{"pbrMetallicRoughness": {"roughnessFactor": 0.3}}])))
        self.submit_all(chair, "--set", "image.width=32,48")
        for width in (32, 48):
            document = self.write(f"{width}.json", {"version": 1, "model": "chair.glb", "image": {"width": width}})
            succeeded(whittle("render", document, "-o", self.directory / "direct.png"))
            self.assertEqual(self.images()[f"chair-width={width}.png"], (self.directory / "direct.png").read_bytes())

    def test_reports_images_that_miss_their_target(self):
        self.write("a.json", scene(accuracy={"samples": [1, 1], "target_error": 0.001}))
        self.write("b.json", scene(accuracy={"samples": [1, 1], "target_error": 255}))
        done = self.submit_all(self.directory / "*.json")
        self.assertEqual(sorted(self.images()), ["a.png", "b.png"])
        self.assertRegex(done.stderr, r"(?m)^a: error at most [0-9.]+ levels, target 0\.001 not reached$")
        self.assertNotIn("b: ", done.stderr.replace("] b: ", ""))
        again = self.submit(self.directory / "*.json", "--require-target")  # of images that are complete already
        self.assertEqual((again.returncode, "1 of them miss" in again.stderr), (1, True), again.stderr)

    def test_second_run_submits_nothing_and_downloads_missing_images(self):
        path = self.write("a.json", scene())
        command = (path, "--set", "camera.fov=30,40")
        self.submit_all(*command)
        before = self.images()
        (self.out / "a-fov=30.png").unlink()
        (self.out / "a-fov=40.png").write_bytes(b"half")
        self.submit_all(*command)
        self.assertEqual(self.images(), before)
        self.assertEqual(len(self.jobs()), 2)
        self.submit_all(*command, url=UNREACHABLE)

    def test_second_run_renders_changed_scenes_and_images_of_deleted_jobs(self):
        for name in "ab":
            self.write(f"{name}.json", scene())
        command = (self.directory / "a.json", self.directory / "b.json")
        self.submit_all(*command)
        before = self.images()
        self.write("a.json", scene(ambient=0.5))
        self.submit_all(*command)
        after = self.images()
        self.assertNotEqual(after["a.png"], before["a.png"])
        self.assertEqual(after["b.png"], before["b.png"])
        self.assertEqual(len(self.jobs()), 3)
        for job in self.jobs():
            self.daemon.request("DELETE", job["links"]["self"])
        (self.out / "b.png").unlink()
        self.submit_all(*command)
        self.assertEqual(self.images(), after)
        self.assertEqual(len(self.jobs()), 1)

    def requests(self, method, path):
        """Logged requests, counted by status."""
        rows = [row for row in self.daemon.log_rows() if row.get("method") == method and row.get("path", "").startswith(path)]
        return collections.Counter(row["status"] for row in rows)

    def test_submits_a_sweep_in_one_request_and_follows_events_instead_of_polling(self):
        posts = self.requests("POST", "/v1/")
        lists = self.requests("GET", "/v1/jobs?")
        path = self.write("a.json", scene(100, 80, samples=16))
        self.submit_all(path, "--set", "camera.fov=21..50", "--set", "accuracy.seed=1,2")
        self.assertEqual(self.requests("POST", "/v1/") - posts, {202: 1})
        jobs = self.jobs()
        self.assertEqual(len({job["batch"] for job in jobs}), 1)
        self.assertEqual(len({job["labels"]["frame"] for job in jobs}), 60)
        polls = sum((self.requests("GET", "/v1/jobs?") - lists).values()) - 1  # self.jobs() above
        self.assertLessEqual(polls, 4, "one after submission, one when the stream opens, few if it breaks")

    def test_polls_while_no_event_stream_is_available(self):
        with Daemon("--streams", "1") as daemon, Stream(daemon, "/v1/events"):
            path = self.write("a.json", scene())
            self.submit_all(path, "--set", "camera.fov=30,40", url=f"http://127.0.0.1:{daemon.port}")
            self.assertEqual(len(self.images()), 2)

    def test_submits_values_that_no_merge_patch_expresses_alone(self):
        path = self.write("a.json", scene())
        error = failed(self.submit(path, "--set", 'background={"color": 0.1},null,{"color": 0.5}'))
        self.assertRegex(error, r"a-background=null: rejected: #/background wrong_type: ")
        self.assertEqual(sorted(self.images()), ["a-background=0000.png", "a-background=0002.png"])

    def test_uploads_each_file_once_and_refers_to_it_by_hash(self):
        (self.directory / "shots").mkdir()
        for name in "ab":
            document = scene(objects=[{"type": "mesh", "file": "../vase.obj", "material": {"color": {"file": "../tile.png"}}}],
                             job={"labels": {"file": "../not/a/file"}})
            self.write(f"shots/{name}.json", document)
        for file in ("vase.obj", "tile.png"):
            (self.directory / file).write_bytes((SCENES / "assets" / file).read_bytes())
        done = self.submit_all(self.directory / "shots/a.json", self.directory / "shots/b.json")
        self.assertEqual(done.stderr.count("uploading "), 2)
        self.submit(self.directory / "shots/a.json", "--set", "camera.fov=20")
        puts = [row for row in self.daemon.log_rows() if row.get("method") == "PUT"]
        self.assertEqual([row["status"] for row in puts], [201, 201])
        os.chdir(self.directory / "shots")
        self.addCleanup(os.chdir, SOURCE)
        document = json.loads((self.directory / "shots/b.json").read_text(encoding="utf-8"))
        self.assertEqual(self.images()["b.png"], self.rendered(document))
        self.assertEqual(self.jobs()[0]["labels"]["file"], "../not/a/file")

    def test_dry_run_sends_nothing(self):
        path = self.write("a.json", scene())
        done = self.submit_all(path, "--set", "camera.fov=1..3", "--dry-run", url=UNREACHABLE)
        self.assertIn("a-fov=2 ", done.stdout)
        self.assertIn("3 jobs in 1 request; nothing was sent", done.stdout)
        self.assertFalse(self.out.exists())

    def test_shows_a_bar_for_each_scene_on_a_terminal(self):
        for name in "ab":
            self.write(f"{name}.json", scene())
        output = succeeded(on_terminal(*self.command(self.directory / "*.json", "--set", "camera.fov=1..3"))).stdout
        self.assertRegex(output, rb"#{10}-{20} 1/3 [ab]\r?\n")
        self.assertNotIn(b"[1/6]", output)
        self.assertIn(b"6 of 6 frames", output)


class Errors(SubmitTest):
    def test_rejected_and_failed_scenes_are_reported_and_the_others_completed(self):
        self.write("bad.json", scene(colour="red"))
        self.write("good.json", scene())
        (self.directory / "text.png").write_text("no image", encoding="utf-8")
        self.write("ugly.json", scene(background={"environment": {"file": "text.png"}}))
        command = (self.directory / "*.json",)
        error = failed(self.submit(*command))
        self.assertRegex(error, r"bad: rejected: #/colour unknown_field: ")
        self.assertRegex(error, r"ugly: bad_asset: #/background/environment/file ")
        self.assertEqual(sorted(self.images()), ["good.png"])
        self.assertIn("--retry-failed", failed(self.submit(*command)))
        self.assertEqual(len(self.jobs()), 2)
        (self.directory / "text.png").write_bytes((SCENES / "assets/tile.png").read_bytes())
        self.write("bad.json", scene())
        self.submit_all(*command)
        self.assertEqual(len(self.jobs()), 4)

    def test_rejected_values_of_a_sweep_are_reported_and_the_others_completed(self):
        path = self.write("a.json", scene())
        command = (path, "--set", "camera.fov=30,999,40")
        self.assertRegex(failed(self.submit(*command)), r"a-fov=999: rejected: #/camera/fov out_of_range: ")
        self.assertEqual(sorted(self.images()), ["a-fov=30.png", "a-fov=40.png"])
        self.assertIn("--retry-failed", self.submit(*command).stderr)
        self.assertEqual(len(self.jobs()), 2)

    def test_batch_larger_than_the_queue_is_submitted_job_by_job(self):
        with Daemon("--queued-jobs", "2", "--jobs", "1") as daemon:
            path = self.write("a.json", scene())
            self.submit_all(path, "--set", "camera.fov=31..34", url=f"http://127.0.0.1:{daemon.port}")
            self.assertEqual(len(self.images()), 4)

    def test_cancelled_job_counts_as_failed_until_it_is_retried(self):
        path = self.write("a.json", scene(3000, 3000))
        with subprocess.Popen(self.command(path), stderr=subprocess.PIPE, text=True) as process:
            job = wait_until(self.jobs, "the job")[0]
            self.daemon.request("POST", f"/v1/jobs/{job['id']}/cancel")
            _, output = process.communicate(timeout=PATIENCE_S)
        self.assertEqual(process.returncode, 1)
        self.assertIn("a: cancelled", output)
        self.assertEqual(self.submit(path).returncode, 1)
        self.assertEqual(len(self.jobs()), 1)
        self.submit_all(path, "--retry-failed")
        self.assertEqual(len(self.jobs()), 2)

    def test_invalid_input_is_reported_before_any_request(self):
        good = self.write("good.json", scene())
        (self.directory / "twice.json").write_text('{"version": 1, "version": 1}', encoding="utf-8")
        (self.directory / "nan.json").write_text('{"version": NaN}', encoding="utf-8")
        self.write("file.json", scene(background={"environment": {"file": "nowhere.png"}}))
        (self.directory / "key").write_text("two words", encoding="utf-8")
        for arguments, word in (((), "SCENE"), ((self.directory / "no.json",), "no such file"),
                                ((self.directory / "twice.json",), "duplicate"), ((self.directory / "nan.json",), "NaN"),
                                ((self.directory / "file.json",), "--server-files"),
                                ((good, "--set", "camera.fov"), "PATH=VALUES"), ((good, "--set", "camera.fov="), "PATH="),
                                ((good, "--set", "camera.fov=1..3:-1"), "never"), ((good, "--set", "a=1..1e9"), "maximum"),
                                ((good, "--set", "objects.9.radius=1"), "index"), ((good, "--set", "name.a=1"), "cannot be"),
                                ((good, "--set", "a=1", "--set", "/a=2"), "twice"), ((good, "--wat"), "--wat"),
                                ((good, "--server", "localhost"), "http://"),
                                ((good, "--key-file", self.directory / "key"), "key")):
            done = self.submit(*arguments)
            self.assertEqual((done.returncode, done.stdout), (2, ""), arguments)
            self.assertIn(word, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertEqual(self.jobs(), [])

    def test_option_server_files_allows_files_of_the_server(self):
        with Daemon("--assets", str(SCENES)) as daemon:
            path = self.write("a.json", scene(background={"environment": {"file": "assets/tile.png"}}))
            self.submit_all(path, "--server-files", url=f"http://127.0.0.1:{daemon.port}")

    def test_server_that_does_not_respond_gives_exit_code_3(self):
        path = self.write("a.json", scene())
        error = failed(self.submit(path, "--patience", "0", url=UNREACHABLE), 3)
        self.assertIn("does not respond", error)
        self.assertIn("Run the same command again", error)
        self.submit_all(path)

    def test_output_directory_is_locked_by_one_run(self):
        path = self.write("a.json", long_scene())
        with subprocess.Popen(self.command(path), stderr=subprocess.DEVNULL) as process:
            job = wait_until(self.jobs, "the job")[0]
            self.assertIn("in use", failed(self.submit(path), 3))
            process.kill()
        self.daemon.request("POST", f"/v1/jobs/{job['id']}/cancel")


class Recovery(SubmitTest):
    """No interruption loses an image or submits a frame twice."""

    options = ("--jobs", "2")
    FRAMES = 24

    def sweep_command(self, url=None, samples=4):
        path = self.write("orbit.json", scene(160, 120, samples=samples))
        return self.command(path, "--set", f"camera.fov=20..{19 + self.FRAMES}", url=url)

    def assert_complete_without_duplicates(self):
        self.assertEqual(len(self.images()), self.FRAMES, sorted(self.images()))
        jobs = self.jobs()
        self.assertEqual(len(jobs), self.FRAMES)
        self.assertEqual(len({job["labels"]["frame"] for job in jobs}), self.FRAMES)
        for artifact in (job["artifacts"][0] for job in jobs):
            self.assertIn(self.daemon.get(artifact["url"]).body, self.images().values())

    def test_client_killed_at_any_moment(self):
        generator = random.Random(1)
        command = self.sweep_command()
        kills = 0
        for attempt in range(200):
            with subprocess.Popen(command, stderr=subprocess.DEVNULL) as process:
                try:
                    # The limit grows, as a slow machine may need longer to start the client than the first limits.
                    process.wait((0.1 + generator.random() * 0.4) * (1 + attempt / 10))
                    break
                except subprocess.TimeoutExpired:
                    process.kill()
                    kills += 1
        self.assertEqual(process.returncode, 0)
        self.assertGreater(kills, 0)
        self.assert_complete_without_duplicates()

    def test_client_killed_before_it_records_the_response(self):
        command = self.sweep_command()
        subprocess.run(command, check=True, stderr=subprocess.DEVNULL, timeout=PATIENCE_S)
        state = self.out / "whittle-submit.state"
        lines = state.read_bytes().splitlines(keepends=True)
        begun = [index for index, line in enumerate(lines) if b'"digest"' in line]
        state.write_bytes(b"".join(lines[:begun[5] + 1]) + b'{"frame": "orb')
        for path in self.out.glob("*.png"):
            path.unlink()
        subprocess.run(command, check=True, stderr=subprocess.DEVNULL, timeout=PATIENCE_S)
        self.assertEqual(len(self.jobs()), self.FRAMES)
        self.assertEqual(len(self.images()), self.FRAMES)

    def test_server_killed_and_restarted(self):
        with Relay(lambda: self.daemon.port) as relay:
            messages = self.directory / "messages"
            with open(messages, "wb") as written, subprocess.Popen(self.sweep_command(relay.url, samples=32), stderr=written) as process:
                for jobs, images in ((1, 0), (self.FRAMES, self.FRAMES // 2)):
                    wait_until(lambda j=jobs, i=images: len(self.jobs()) >= j and len(self.images()) >= i, "frames")
                    before = messages.read_text("utf-8").count("waiting for http://")
                    self.daemon.kill()
                    wait_until(lambda b=before: messages.read_text("utf-8").count("waiting for http://") > b, "the client, which waits")
                    self.daemon.start()
                process.wait(PATIENCE_S)
        self.assertEqual(process.returncode, 0, messages.read_text("utf-8"))
        self.assert_complete_without_duplicates()

    def test_responses_to_submissions_lost(self):
        with Relay(lambda: self.daemon.port) as relay:
            relay.responses_to_lose = 3  # one of a batch, and two of single jobs
            command = self.sweep_command(relay.url)
            alone = [self.write(f"{name}.json", scene()) for name in "ab"]
            done = subprocess.run([*command[:-2], *alone, *command[-2:]], capture_output=True, text=True, check=False, timeout=PATIENCE_S)
            self.assertEqual((done.returncode, relay.responses_to_lose), (0, 0), done.stderr)
        self.assertEqual(len({job["labels"]["frame"] for job in self.jobs()}), len(self.jobs()))
        self.assertEqual(len(self.jobs()), len(self.images()))

    def test_event_streams_cut(self):
        with Relay(lambda: self.daemon.port) as relay:
            with subprocess.Popen(self.sweep_command(relay.url, samples=32), stderr=subprocess.PIPE, text=True) as process:
                while process.poll() is None:
                    relay.cut_streams()
                    time.sleep(0.02)
                output = process.stderr.read()
        self.assertEqual(process.returncode, 0, output)
        self.assertGreater(relay.cuts, 0)
        self.assert_complete_without_duplicates()
