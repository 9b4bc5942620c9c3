"""kill -9 at random moments, while the daemon accepts, renders, writes, finishes, collects: no accepted job is lost, none
finishes twice, no image is half, and every request under an Idempotency-Key is answered as the first time.

WHITTLE_KILLS is the number of kills (20 in CI, 200 before a release), WHITTLE_SEED repeats a run.
"""
import collections
import hashlib
import http.client
import json
import os
import random
import re
import threading
import time
import unittest

from tests.http.daemon import Daemon, json_of, scene, wait_until

KILLS = int(os.environ.get("WHITTLE_KILLS", "20"))
SEED = int(os.environ.get("WHITTLE_SEED", str(random.SystemRandom().randrange(10**9))))
CLIENTS = 3


class Client(threading.Thread):
    """Submits jobs under different Idempotency-Keys until the daemon is killed, and records the replies."""

    def __init__(self, daemon, name, seed):
        super().__init__(name=name)
        self.daemon_process, self.random = daemon, random.Random(seed)
        self.answered = {}    # key: (document, body)
        self.unanswered = {}  # key: document
        self.removed = set()  # ids whose removal was tried

    def document(self):
        side = self.random.choice([16, 16, 64, 200])
        job = {"cache": self.random.choice(["use", "refresh", "off"])}
        if self.random.random() < 0.2:
            job["expires_in"] = 1
        seed = self.random.randrange(5)
        formats = ["png", "exr"] if side == 200 else ["png"]  # a small image, and one that is a file
        return scene(side, side, job=job, name="killed", accuracy={"samples": [4, 4], "seed": seed}, output={"formats": formats})

    def submit(self, key, document):
        return self.daemon_process.request("POST", "/v1/jobs", document, {"Idempotency-Key": key})

    def run(self):
        for number in range(10**6):
            key, document = f"{self.name}-{number}", self.document()
            self.unanswered[key] = document
            try:
                reply = self.submit(key, document)
                if reply.status not in (200, 202):
                    raise AssertionError(reply.body)
                job_id = json_of(reply)["id"]
                self.answered[key] = (document, reply.body)
                del self.unanswered[key]
                if self.random.random() < 0.1:
                    self.removed.add(job_id)
                    self.daemon_process.request("DELETE", f"/v1/jobs/{job_id}")
            except (OSError, http.client.HTTPException):
                return  # killed, perhaps in the middle of a reply


class KillSuite(unittest.TestCase):
    def test_no_job_is_lost_repeated_or_incomplete(self):
        chance = random.Random(SEED)
        print(f"WHITTLE_KILLS={KILLS} WHITTLE_SEED={SEED}")
        answered, removed = {}, set()
        with Daemon("--jobs", "2") as daemon:
            for kill in range(KILLS):
                clients = [Client(daemon, f"{kill}-{index}", chance.randrange(10**9)) for index in range(CLIENTS)]
                for client in clients:
                    client.start()
                time.sleep(chance.uniform(0.0, 0.6))  # the moment is what is tried, not waited for
                daemon.kill()
                for client in clients:
                    client.join()
                daemon.start()
                for client in clients:
                    answered.update(client.answered)
                    removed |= client.removed
                    for key, document in client.unanswered.items():
                        first, second = client.submit(key, document), client.submit(key, document)
                        self.assertIn(first.status, (200, 202), first.body)
                        self.assertEqual((second.status, second.body), (first.status, first.body))
                        answered[key] = (document, first.body)
                self.check_replays(daemon, chance, answered)
            self.check_end(daemon, answered, removed)

    def check_replays(self, daemon, chance, answered):
        for key in chance.sample(sorted(answered), min(10, len(answered))):
            document, body = answered[key]
            reply = daemon.request("POST", "/v1/jobs", document, {"Idempotency-Key": key})
            self.assertEqual((reply.body, reply.headers["Idempotent-Replayed"]), (body, "true"), key)

    def check_end(self, daemon, answered, removed):
        def unfinished():
            queue = json_of(daemon.get("/v1/queue"))
            return queue["jobs"]["queued"] + queue["jobs"]["running"]
        left = unfinished()
        while left > 0:  # patience is for one job: there are thousands after many kills
            wait_until(lambda before=left: unfinished() < before, f"the end of one of {left} jobs")
            left = unfinished()
        ids = [json.loads(body)["id"] for _, body in answered.values()]
        self.assertEqual(len(ids), len(set(ids)), "each key has a job of its own")
        self.assertGreater(len(ids), KILLS)
        self.assertEqual(self.listed(daemon) - removed, set(ids) - removed, "none lost, none that nobody requested")
        images = collections.defaultdict(set)
        for document, body in answered.values():
            job_id = json.loads(body)["id"]
            if job_id not in removed:
                self.check_job(daemon, daemon.job(job_id), document, images)
        for document, shas in images.items():
            self.assertEqual(len(shas), 1, f"equal documents, equal images: {document}")
        self.check_files(daemon)
        self.check_log(daemon)

    @staticmethod
    def listed(daemon):
        ids, cursor = set(), ""
        while cursor is not None:
            page = json_of(daemon.get(f"/v1/jobs?limit=200{cursor}"))
            ids |= {job["id"] for job in page["items"]}
            cursor = f"&cursor={page['next_cursor']}" if page["next_cursor"] else None
        return ids

    def check_job(self, daemon, job, document, images):
        self.assertEqual(job["state"], "succeeded", job["problem"])
        self.assertLessEqual(job["attempt"], 1, "a killed daemon costs no attempt")
        for artifact in job["artifacts"]:
            reply = daemon.get(artifact["url"])
            if reply.status == 410 and "expires_in" in document["job"]:
                continue
            self.assertEqual(reply.status, 200, reply.body)
            self.assertEqual(hashlib.sha256(reply.body).hexdigest(), artifact["sha256"])
            key = json.dumps([artifact["name"], {**document, "job": None}], sort_keys=True)
            images[key].add(artifact["sha256"])

    def check_files(self, daemon):
        """Asserts that all files of the directory are complete."""
        count = 0
        for path in daemon.data.glob("??/*"):
            if re.fullmatch(r"[0-9a-f]{64}", path.name):
                count += 1
                self.assertEqual(hashlib.sha256(path.read_bytes()).hexdigest(), path.name)
        self.assertGreater(count, 0)

    def check_log(self, daemon):
        ends = collections.Counter()
        for path in daemon.directory.glob("log-*"):
            for line in path.read_text("utf-8").splitlines():
                try:
                    row = json.loads(line)
                except ValueError:
                    continue  # cut off by a kill
                if row.get("event") == "job_succeeded":
                    ends[row["job_id"]] += 1
        self.assertEqual([job_id for job_id, times in ends.items() if times > 1], [], "finished twice")


if __name__ == "__main__":
    unittest.main()
