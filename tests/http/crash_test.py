"""Recovery after kills of the daemon and of its worker, and graceful shutdown."""
import os
import signal
import unittest

from tests.http.daemon import PATIENCE_S, SANITIZED, Daemon, json_of, long_scene, scene, sha256, wait_until


def sha256_of(daemon, job):
    reply = daemon.get(job["links"]["image"])
    assert reply.status == 200, reply
    assert sha256(reply.body) == job["artifacts"][0]["sha256"]
    return sha256(reply.body)


def middling_scene(index):
    """A scene that renders for some tenths of a second; each index gives another image."""
    return scene(600, 400, samples=16, name=f"middling {index}", accuracy={"samples": [16, 16], "seed": index})


class KilledDaemon(unittest.TestCase):
    def test_preserves_accepted_jobs_and_finished_images(self):
        with Daemon("--jobs", "3") as daemon:  # large ones leave the third to small ones
            jobs = [daemon.rendered(middling_scene(index)) for index in range(3)]
            images = {job["id"]: sha256_of(daemon, job) for job in jobs}
            running = [daemon.start_job(long_scene(name=f"long {index}")) for index in range(2)]
            queued = [daemon.submit(middling_scene(index)) for index in range(3)]

            daemon.restart()

            jobs = json_of(daemon.get("/v1/jobs"))["items"]
            self.assertEqual({job["id"] for job in jobs}, {*images, *running, *queued})
            for job_id, image in images.items():
                job = daemon.job(job_id)
                self.assertEqual((job["state"], job["attempt"], sha256_of(daemon, job)), ("succeeded", 1, image))
            for job_id in running:  # they run again, from the start, and the death is not held against them
                job = daemon.wait_for_state(job_id, "running")
                self.assertEqual(job["attempt"], 1)
                daemon.request("POST", f"/v1/jobs/{job_id}/cancel")
            for image, job_id in zip(images.values(), queued):
                self.assertEqual(sha256_of(daemon, daemon.wait_for_success(job_id)), image, "equal documents, equal images")


class KilledWorker(unittest.TestCase):
    def test_costs_one_attempt_of_the_job_and_no_request(self):
        with Daemon("--jobs", "1") as daemon:
            job_id, other = daemon.start_job(long_scene(job={"max_attempts": 3})), daemon.submit(scene())
            for attempt in (1, 2, 3):
                wait_until(lambda n=attempt: daemon.job(job_id)["attempt"] == n, f"attempt {attempt}")
                daemon.wait_for_state(job_id, "running")
                os.kill(daemon.worker(), signal.SIGKILL)
                self.assertEqual(daemon.get("/v1/version").status, 200)
            job = daemon.wait_for_end(job_id)
            self.assertEqual((job["state"], job["attempt"]), ("failed", 3))
            self.assertEqual(job["problem"]["code"], "worker_crashed")
            self.assertEqual(daemon.wait_for_end(other)["state"], "succeeded")


class Draining(unittest.TestCase):
    def test_an_idle_daemon_ends_with_0_on_sigterm_and_on_sigint(self):
        for number in (signal.SIGTERM, signal.SIGINT):
            with Daemon() as daemon:
                idle = daemon.socket()
                daemon.process.send_signal(number)
                self.assertEqual(daemon.process.wait(PATIENCE_S), 0)
                idle.close()
                self.assertEqual(daemon.log_rows()[-1]["event"], "stopped")

    def test_running_job_finishes_new_work_is_refused_reads_are_answered(self):
        with Daemon("--jobs", "1", "--drain-s", "600", "--render-wait-s", "600") as daemon:
            # Seconds of work, so that it still runs when the signal arrives; less under a sanitizer.
            answer = daemon.in_background("POST", "/v1/render", scene(1500, 1000, samples=4 if SANITIZED else 64, name="last"))
            job_id = wait_until(lambda: json_of(daemon.get("/v1/jobs?q=last"))["items"], "the job")[0]["id"]
            daemon.wait_for_state(job_id, "running")
            queued = daemon.submit(scene(name="left for later"))
            daemon.process.terminate()
            wait_until(lambda: daemon.health("/readyz").status == 503, "draining")
            refused = daemon.request("POST", "/v1/jobs", scene())
            self.assertEqual((refused.status, json_of(refused)["type"]), (503, "urn:whittle:problem:draining"))
            self.assertEqual(daemon.job(queued)["state"], "queued")
            waiting = answer.result()
            self.assertEqual((waiting.status, waiting.headers["Content-Type"]), (200, "image/png"))
            self.assertEqual(daemon.process.wait(PATIENCE_S), 0)
            daemon.start()
            self.assertEqual(daemon.wait_for_end(queued)["state"], "succeeded")
            self.assertEqual(daemon.job(job_id)["state"], "succeeded")

    def test_unfinished_job_returns_to_the_queue_without_counting_the_attempt(self):
        with Daemon("--jobs", "1", "--drain-s", "0") as daemon:
            answer = daemon.in_background("POST", "/v1/render", long_scene(name="too long"))
            job_id = wait_until(lambda: json_of(daemon.get("/v1/jobs?q=too"))["items"], "the job")[0]["id"]
            daemon.wait_for_state(job_id, "running")
            self.assertEqual(daemon.terminate(), 0)
            waiting = answer.result()
            self.assertEqual((waiting.status, json_of(waiting)["id"]), (202, job_id))
            daemon.start()
            job = daemon.wait_for_state(job_id, "running")
            self.assertEqual(job["attempt"], 1)

    def test_second_signal_ends_it_at_once(self):
        with Daemon("--jobs", "1", "--drain-s", "86400") as daemon:
            job_id = daemon.start_job()
            daemon.process.terminate()
            wait_until(lambda: daemon.health("/readyz").status == 503, "draining")
            self.assertEqual(daemon.terminate(), -signal.SIGTERM)
            daemon.start()
            self.assertEqual(daemon.wait_for_state(job_id, "running")["attempt"], 1)
