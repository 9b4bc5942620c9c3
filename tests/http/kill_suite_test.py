"""kill -9 at random moments, while the daemon accepts, renders, writes, finishes, collects: no accepted job is lost, none
finishes twice, no image is half, and every request under an Idempotency-Key is answered as the first time.

WHITTLE_KILLS is the number of kills of the daemon (60 in CI, 200 before a release), WHITTLE_SEED repeats a run.
"""
import contextlib
import os
import random
import signal
import time
import unittest

from tests.http import kills
from tests.http.daemon import Daemon, sha256

KILLS = int(os.environ.get("WHITTLE_KILLS", "60"))
SEED = int(os.environ.get("WHITTLE_SEED", str(random.SystemRandom().randrange(10**9))))


class KillSuite(unittest.TestCase):
    def survive(self, rounds, hurt, clients, statuses, **of_clients):
        """Hurts the daemon in each round, while clients submit; `hurt(daemon, chance)` leaves it running."""
        chance = random.Random(SEED)
        print(f"{rounds} rounds, WHITTLE_SEED={SEED}")
        answered, removed, uploads = {}, set(), set()
        with Daemon("--jobs", "2", "--log-level", "info") as daemon:
            for number in range(rounds):
                crowd = [kills.Client(daemon, f"{number}-{index}", chance.randrange(10**9), **of_clients) for index in range(clients)]
                for client in crowd:
                    client.start()
                time.sleep(chance.uniform(0.0, 0.6))  # the moment is what is tried, not waited for
                hurt(daemon, chance)
                for client in crowd:
                    client.stop.set()
                    client.join()
                    for key, document in list(client.unanswered.items()):
                        first, second = client.submit(key, document), client.submit(key, document)
                        self.assertEqual((second.status, second.body), (first.status, first.body))
                    self.assertLessEqual(client.statuses, statuses)
                    answered |= client.answered
                    removed |= client.removed
                    uploads |= client.uploads
                for key in chance.sample(sorted(answered), min(10, len(answered))):
                    document, body = answered[key]
                    reply = daemon.request("POST", "/v1/jobs", document, {"Idempotency-Key": key})
                    self.assertEqual((reply.body, reply.headers["Idempotent-Replayed"]), (body, "true"), key)
            self.assertGreater(len(answered), rounds)
            kills.check_jobs(self, daemon, answered, removed, of_clients.get("max_attempts", 1))
            for name in uploads:
                self.assertEqual(sha256(daemon.get(f"/v1/assets/{name}").body), name, "an acknowledged upload")
            self.assertLess(daemon.resident_bytes(), 256 << 20)
            self.assertLess(len(os.listdir(f"/proc/{daemon.process.pid}/fd")), 100)
            self.assertEqual(list((daemon.data / "spool").iterdir()), [])

    def test_no_job_is_lost_repeated_or_incomplete(self):
        def kill(daemon, _):
            daemon.restart()
        self.survive(KILLS, kill, 3, {200, 202})

    def test_killed_workers_and_ended_daemons_lose_no_job_either(self):
        def hurt(daemon, chance):
            fate = chance.random()
            if fate < 0.7:
                for pid in daemon.worker_pids():
                    with contextlib.suppress(ProcessLookupError):  # a worker may end by itself
                        os.kill(pid, signal.SIGKILL)
            elif fate < 0.9:
                daemon.restart()
            else:
                self.assertEqual(daemon.terminate(), 0)
                daemon.start()
        # A job that kills happen to hit three times is blameless, so it gets more attempts than that.
        self.survive(5 * KILLS, hurt, 1, {200, 202, 503}, max_attempts=10, pause_s=0.01)
