"""whittle-submit against the real daemon: what it makes of scenes, and that no death makes it submit anything twice."""
import collections
import json
import os
import pathlib
import pty
import random
import subprocess
import tempfile
import time
import unittest

from tests.http.daemon import PATIENCE_S, Daemon, OneDaemon, json_of, long_scene, scene, wait_until
from tests.http.events_test import Stream
from tests.http.relay import Relay
from tests.support.whittle import SCENES, SOURCE, whittle

SCRIPT = SOURCE / "api/client/whittle-submit"


class WithScript(OneDaemon):
    """Each test has a folder for its scenes and pictures, and counts its jobs by name."""

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.out = self.folder / "out"
        self.name = self.id().rpartition(".")[2]

    def write(self, name, document):
        path = self.folder / name
        path.write_text(json.dumps(document), encoding="utf-8")
        return path

    def command(self, *arguments, url=None):
        return ["/usr/bin/python3", SCRIPT, "--server", url or f"http://127.0.0.1:{self.daemon.port}", "-o", self.out,
                "--name", self.name, *map(str, arguments)]

    def submit(self, *arguments, url=None, environment=None):
        return subprocess.run(self.command(*arguments, url=url), capture_output=True, text=True, check=False,
                              timeout=PATIENCE_S, env={**os.environ, **(environment or {})})

    def jobs(self):
        items, cursor = [], ""
        while cursor is not None:
            page = json_of(self.daemon.get(f"/v1/jobs?label=batch:{self.name}&limit=200{cursor}"))
            items += page["items"]
            cursor = f"&cursor={page['next_cursor']}" if page["next_cursor"] else None
        return items

    def pictures(self):
        """Those that are whole: what is being written has another name, and may be gone before it is read."""
        return {path.name: path.read_bytes() for path in self.out.glob("[!.]*") if path.suffix != ".state"}

    def rendered(self, document):
        """The picture that the command line makes of it."""
        path = self.folder / "direct.png"
        done = whittle("render", "-", "-o", path, document=document)
        self.assertEqual(done.returncode, 0, done.stderr)
        return path.read_bytes()


class Submitting(WithScript):
    def test_brings_a_picture_of_each_scene_and_value(self):
        self.write("a.json", scene())
        self.write("b.json", scene(output={"formats": ["png", "exr"]}))
        done = self.submit(self.folder / "*.json", "--set", "camera.fov=30..40:5", "--set", "image.width=20")
        self.assertEqual(done.returncode, 0, done.stderr)
        pictures = self.pictures()
        self.assertEqual(sorted(pictures), sorted([f"{stem}-fov={fov}.png" for stem in "ab" for fov in (30, 35, 40)]
                                                  + [f"b-fov={fov}.exr" for fov in (30, 35, 40)]))
        expected = scene(20, camera={"position": [0, 1, 6], "look_at": [0, 0.5, 0], "fov": 35})
        self.assertEqual(pictures["a-fov=35.png"], self.rendered(expected))
        self.assertEqual(len(self.jobs()), 6)
        lines = done.stderr.splitlines()
        self.assertEqual(len(lines), 7, "no terminal: a line for each, and the sum")
        self.assertTrue(lines[5].startswith("[6/6] "), lines)

    def test_again_asks_for_nothing_that_is_there_and_brings_what_is_gone(self):
        path = self.write("a.json", scene())
        command = (path, "--set", "camera.fov=30,40")
        self.assertEqual(self.submit(*command).returncode, 0)
        before = self.pictures()
        (self.out / "a-fov=30.png").unlink()
        (self.out / "a-fov=40.png").write_bytes(b"half")
        again = self.submit(*command)
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertEqual(self.pictures(), before)
        self.assertEqual(len(self.jobs()), 2)
        self.assertEqual(self.submit(*command, url="http://127.0.0.1:1").returncode, 0, "without any server")

    def test_again_renders_what_was_changed_or_is_gone_everywhere(self):
        for name in "ab":
            self.write(f"{name}.json", scene())
        command = (self.folder / "a.json", self.folder / "b.json")
        self.assertEqual(self.submit(*command).returncode, 0)
        before = self.pictures()
        self.write("a.json", scene(ambient=0.5))
        self.assertEqual(self.submit(*command).returncode, 0)
        after = self.pictures()
        self.assertNotEqual(after["a.png"], before["a.png"])
        self.assertEqual(after["b.png"], before["b.png"])
        self.assertEqual(len(self.jobs()), 3)
        for job in self.jobs():
            self.daemon.request("DELETE", job["links"]["self"])
        (self.out / "b.png").unlink()
        self.assertEqual(self.submit(*command).returncode, 0)
        self.assertEqual(self.pictures(), after)
        self.assertEqual(len(self.jobs()), 1)

    def requests(self, method, path):
        """Those of this test's script, for no other runs: how many, by their status."""
        rows = [row for row in self.daemon.log_rows() if row.get("method") == method and row.get("path", "").startswith(path)]
        return collections.Counter(row["status"] for row in rows)

    def test_submits_a_sweep_in_one_request_and_listens_instead_of_asking(self):
        posts = self.requests("POST", "/v1/")
        asked = self.requests("GET", "/v1/jobs?")
        path = self.write("a.json", scene(100, 80, samples=16))
        done = self.submit(path, "--set", "camera.fov=21..50", "--set", "accuracy.seed=1,2")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.requests("POST", "/v1/") - posts, {202: 1})
        jobs = self.jobs()
        self.assertEqual(len({job["batch"] for job in jobs}), 1)
        self.assertEqual(len({job["labels"]["frame"] for job in jobs}), 60)
        looks = sum((self.requests("GET", "/v1/jobs?") - asked).values()) - 1  # ours just now
        self.assertLessEqual(looks, 4, "one after the batch was accepted, one when the stream began, few where it broke")

    def test_brings_pictures_while_there_is_no_stream_to_listen_to(self):
        with Daemon("--streams", "1") as daemon, Stream(daemon, "/v1/events"):
            path = self.write("a.json", scene())
            done = self.submit(path, "--set", "camera.fov=30,40", url=f"http://127.0.0.1:{daemon.port}")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(len(self.pictures()), 2)

    def test_values_that_no_merge_patch_can_say_come_alone(self):
        path = self.write("a.json", scene())
        done = self.submit(path, "--set", 'background={"color": 0.1},null,{"color": 0.5}')
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertRegex(done.stderr, r"a-background=null: refused: #/background wrong_type: ")
        self.assertEqual(sorted(self.pictures()), ["a-background=0000.png", "a-background=0002.png"])

    def test_uploads_each_file_once_and_names_it_by_its_hash(self):
        (self.folder / "shots").mkdir()
        for name in "ab":
            document = scene(objects=[{"type": "mesh", "file": "../vase.obj", "material": {"color": {"file": "../tile.png"}}}],
                             job={"labels": {"file": "../not/a/file"}})
            self.write(f"shots/{name}.json", document)
        for file in ("vase.obj", "tile.png"):
            (self.folder / file).write_bytes((SCENES / "assets" / file).read_bytes())
        done = self.submit(self.folder / "shots/a.json", self.folder / "shots/b.json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr.count("uploading "), 2)
        self.submit(self.folder / "shots/a.json", "--set", "camera.fov=20")
        puts = [row for row in self.daemon.log_rows() if row.get("method") == "PUT"]
        self.assertEqual([row["status"] for row in puts], [201, 201])
        os.chdir(self.folder / "shots")
        self.addCleanup(os.chdir, SOURCE)
        self.assertEqual(self.pictures()["b.png"], self.rendered(json.loads((self.folder / "shots/b.json").read_text())))
        self.assertEqual(self.jobs()[0]["labels"]["file"], "../not/a/file")

    def test_dry_run_sends_nothing(self):
        path = self.write("a.json", scene())
        done = self.submit(path, "--set", "camera.fov=1..3", "--dry-run", url="http://127.0.0.1:1")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("a-fov=2 ", done.stdout)
        self.assertIn("3 jobs in 1 request; nothing was sent", done.stdout)
        self.assertFalse(self.out.exists())

    def test_on_a_terminal_shows_a_bar_for_each_batch(self):
        for name in "ab":
            self.write(f"{name}.json", scene())
        ours, theirs = pty.openpty()
        with subprocess.Popen(self.command(self.folder / "*.json", "--set", "camera.fov=1..3"), stdout=theirs,
                              stderr=theirs, stdin=theirs, env={**os.environ, "TERM": "xterm"}) as process:
            os.close(theirs)
            shown = b""
            try:
                while piece := os.read(ours, 65536):
                    shown += piece
            except OSError:
                pass  # the other end is closed
        os.close(ours)
        self.assertEqual(process.returncode, 0, shown)
        self.assertRegex(shown, rb"#{10}-{20} 1/3 [ab]\r?\n")
        self.assertNotIn(b"[1/6]", shown)
        self.assertIn(b"6 of 6 scenes", shown)


class Outcomes(WithScript):
    def test_refused_and_failed_scenes_are_told_and_do_not_hold_up_others(self):
        self.write("bad.json", scene(colour="red"))
        self.write("good.json", scene())
        (self.folder / "text.png").write_text("no picture")
        self.write("ugly.json", scene(background={"environment": {"file": "text.png"}}))
        command = (self.folder / "*.json",)
        done = self.submit(*command)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertRegex(done.stderr, r"bad: refused: #/colour unknown_field: ")
        self.assertRegex(done.stderr, r"ugly: bad_asset: #/background/environment/file ")
        self.assertEqual(sorted(self.pictures()), ["good.png"])
        again = self.submit(*command)
        self.assertEqual(again.returncode, 1)
        self.assertIn("--retry-failed", again.stderr)
        self.assertEqual(len(self.jobs()), 2)
        (self.folder / "text.png").write_bytes((SCENES / "assets/tile.png").read_bytes())
        self.write("bad.json", scene())
        self.assertEqual(self.submit(*command).returncode, 0, "both were mended")
        self.assertEqual(len(self.jobs()), 4)

    def test_refused_values_of_a_sweep_do_not_hold_up_others(self):
        path = self.write("a.json", scene())
        command = (path, "--set", "camera.fov=30,999,40")
        done = self.submit(*command)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertRegex(done.stderr, r"a-fov=999: refused: #/camera/fov out_of_range: ")
        self.assertEqual(sorted(self.pictures()), ["a-fov=30.png", "a-fov=40.png"])
        self.assertIn("--retry-failed", self.submit(*command).stderr)
        self.assertEqual(len(self.jobs()), 2)

    def test_more_at_once_than_the_queue_takes_come_one_after_the_other(self):
        with Daemon("--queued-jobs", "2", "--jobs", "1") as daemon:
            path = self.write("a.json", scene())
            done = self.submit(path, "--set", "camera.fov=31..40", url=f"http://127.0.0.1:{daemon.port}")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(len(self.pictures()), 10)

    def test_cancelled_job_counts_as_failed_until_it_is_retried(self):
        path = self.write("a.json", scene(3000, 3000, samples=4))
        with subprocess.Popen(self.command(path), stderr=subprocess.PIPE, text=True) as process:
            job = wait_until(self.jobs, "the job")[0]
            self.daemon.request("POST", f"/v1/jobs/{job['id']}/cancel")
            _, said = process.communicate(timeout=PATIENCE_S)
        self.assertEqual(process.returncode, 1)
        self.assertIn("a: cancelled", said)
        self.assertEqual(self.submit(path).returncode, 1)
        self.assertEqual(len(self.jobs()), 1)
        retried = self.submit(path, "--retry-failed")
        self.assertEqual(retried.returncode, 0, retried.stderr)
        self.assertEqual(len(self.jobs()), 2)

    def test_mistakes_of_the_user_are_told_before_anything_is_sent(self):
        good = self.write("good.json", scene())
        self.write("twice.json", {})
        (self.folder / "twice.json").write_text('{"version": 1, "version": 1}', encoding="utf-8")
        (self.folder / "nan.json").write_text('{"version": NaN}', encoding="utf-8")
        self.write("file.json", scene(background={"environment": {"file": "nowhere.png"}}))
        (self.folder / "key").write_text("two words")
        for arguments, word in (((), "SCENE"), ((self.folder / "no.json",), "no such file"),
                                ((self.folder / "twice.json",), "twice"), ((self.folder / "nan.json",), "NaN"),
                                ((self.folder / "file.json",), "--server-files"),
                                ((good, "--set", "camera.fov"), "PATH=VALUES"), ((good, "--set", "camera.fov="), "PATH="),
                                ((good, "--set", "camera.fov=1..3:-1"), "away"), ((good, "--set", "a=1..1e9"), "at most"),
                                ((good, "--set", "objects.9.radius=1"), "index"), ((good, "--set", "name.a=1"), "cannot be"),
                                ((good, "--set", "a=1", "--set", "/a=2"), "twice"), ((good, "--wat"), "--wat"),
                                ((good, "--server", "localhost"), "http://"), ((good, "--key-file", self.folder / "key"), "key")):
            done = self.submit(*arguments)
            self.assertEqual((done.returncode, done.stdout), (2, ""), arguments)
            self.assertIn(word, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertEqual(self.jobs(), [])

    def test_files_of_the_server_may_be_left_to_it(self):
        with Daemon("--assets", str(SCENES)) as daemon:
            path = self.write("a.json", scene(background={"environment": {"file": "assets/tile.png"}}))
            done = self.submit(path, "--server-files", url=f"http://127.0.0.1:{daemon.port}")
            self.assertEqual(done.returncode, 0, done.stderr)

    def test_server_that_does_not_answer_ends_it_with_3_after_its_patience(self):
        path = self.write("a.json", scene())
        done = self.submit(path, "--patience", "0", url="http://127.0.0.1:1")
        self.assertEqual(done.returncode, 3)
        self.assertIn("does not answer", done.stderr)
        self.assertIn("The same command goes on", done.stderr)
        self.assertEqual(self.submit(path).returncode, 0)

    def test_two_in_one_folder_do_not_run_at_once(self):
        path = self.write("a.json", long_scene())
        with subprocess.Popen(self.command(path), stderr=subprocess.DEVNULL) as process:
            job = wait_until(self.jobs, "the job")[0]
            second = self.submit(path)
            self.assertEqual(second.returncode, 3)
            self.assertIn("in use", second.stderr)
            process.kill()
        self.daemon.request("POST", f"/v1/jobs/{job['id']}/cancel")


class Deaths(WithScript):
    options = ("--jobs", "2")
    FRAMES = 24

    def command_of_a_sweep(self, url=None, samples=4):
        path = self.write("orbit.json", scene(160, 120, samples=samples))
        return self.command(path, "--set", f"camera.fov=20..{19 + self.FRAMES}", url=url)

    def assert_all_there_and_none_twice(self):
        self.assertEqual(len(self.pictures()), self.FRAMES, sorted(self.pictures()))
        jobs = self.jobs()
        self.assertEqual(len(jobs), self.FRAMES)
        self.assertEqual(len({job["labels"]["frame"] for job in jobs}), self.FRAMES)
        for artifact in (job["artifacts"][0] for job in jobs):
            self.assertIn(self.daemon.get(artifact["url"]).body, self.pictures().values())

    def test_of_the_script_at_any_moment_cost_nothing(self):
        generator = random.Random(1)
        command = self.command_of_a_sweep()
        deaths = 0
        for life in range(200):
            with subprocess.Popen(command, stderr=subprocess.DEVNULL) as process:
                try:
                    # Longer from life to life: on a slow machine the first die before they have begun.
                    process.wait((0.1 + generator.random() * 0.4) * (1 + life / 10))
                    break
                except subprocess.TimeoutExpired:
                    process.kill()
                    deaths += 1
        self.assertEqual(process.returncode, 0)
        self.assertGreater(deaths, 0)
        self.assert_all_there_and_none_twice()

    def test_of_the_server_are_waited_out(self):
        with Relay(lambda: self.daemon.port) as relay:
            with subprocess.Popen(self.command_of_a_sweep(relay.url, samples=64), stderr=subprocess.PIPE, text=True) as process:
                for count in (1, self.FRAMES // 2):
                    wait_until(lambda n=count: len(self.jobs()) >= n and (n == 1 or len(self.pictures()) >= n), "frames")
                    self.daemon.kill()
                    time.sleep(0.3)
                    self.daemon.start()
                _, said = process.communicate(timeout=PATIENCE_S)
        self.assertEqual(process.returncode, 0, said)
        self.assertIn("waiting for http://", said)
        self.assert_all_there_and_none_twice()

    def test_of_the_connection_while_jobs_are_accepted_make_no_second_ones(self):
        with Relay(lambda: self.daemon.port) as relay:
            relay.replies_to_lose = 3  # of the batch, and of two that come alone
            command = self.command_of_a_sweep(relay.url)
            alone = [self.write(f"{name}.json", scene()) for name in "ab"]
            done = subprocess.run([*command[:-2], *alone, *command[-2:]], capture_output=True, text=True, check=False,
                                  timeout=PATIENCE_S)
            self.assertEqual((done.returncode, relay.replies_to_lose), (0, 0), done.stderr)
        self.assertEqual(len({job["labels"]["frame"] for job in self.jobs()}), len(self.jobs()))
        self.assertEqual(len(self.jobs()), len(self.pictures()))

    def test_of_the_stream_are_resumed_or_asked_around(self):
        with Relay(lambda: self.daemon.port) as relay:
            with subprocess.Popen(self.command_of_a_sweep(relay.url, samples=128), stderr=subprocess.PIPE, text=True) as process:
                while process.poll() is None:
                    relay.cut()
                    time.sleep(0.1)
                said = process.stderr.read()
        self.assertEqual(process.returncode, 0, said)
        self.assertGreater(relay.cuts, 0)
        self.assert_all_there_and_none_twice()

    def test_of_the_script_before_it_notes_the_servers_answer_make_no_second_job(self):
        command = self.command_of_a_sweep()
        subprocess.run(command, check=True, stderr=subprocess.DEVNULL, timeout=PATIENCE_S)
        state = self.out / "whittle-submit.state"
        lines = state.read_bytes().splitlines(keepends=True)
        begun = [index for index, line in enumerate(lines) if b'"digest"' in line]
        state.write_bytes(b"".join(lines[:begun[5] + 1]) + b'{"frame": "orb')
        for path in self.out.glob("*.png"):
            path.unlink()
        subprocess.run(command, check=True, stderr=subprocess.DEVNULL, timeout=PATIENCE_S)
        # What it knows nothing of any more the daemon does, by the keys it is sent again with.
        self.assertEqual(len(self.jobs()), self.FRAMES)
        self.assertEqual(len(self.pictures()), self.FRAMES)


if __name__ == "__main__":
    unittest.main()
