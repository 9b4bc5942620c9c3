"""Clients of a daemon that is killed, and the checks that nothing accepted is lost, repeated or incomplete."""
import collections
import http.client
import json
import random
import re
import threading

from tests.http.daemon import json_of, put, scene, sha256, wait_until


class Client(threading.Thread):
    """Submits jobs under different Idempotency-Keys until it is stopped or the daemon is killed, and records the replies."""

    def __init__(self, daemon, name, seed, max_attempts=3, pause_s=0):
        super().__init__(name=name)
        self.daemon_under_test, self.random, self.max_attempts, self.pause_s = daemon, random.Random(seed), max_attempts, pause_s
        self.stop = threading.Event()
        self.answered = {}    # key: (document, body)
        self.unanswered = {}  # key: document
        self.removed = set()  # ids whose removal was tried
        self.uploads = set()  # hashes of acknowledged uploads
        self.statuses = set()

    def document(self):
        side = self.random.choice([16, 16, 64, 200])
        job = {"cache": self.random.choice(["use", "refresh", "off"]), "max_attempts": self.max_attempts}
        if self.random.random() < 0.2:
            job["expires_in"] = 1
        seed = self.random.randrange(5)
        formats = ["png", "exr"] if side == 200 else ["png"]  # a small image, and one that is a file
        return scene(side, side, job=job, name="killed", accuracy={"samples": [4, 4], "seed": seed}, output={"formats": formats})

    def submit(self, key, document):
        reply = self.daemon_under_test.request("POST", "/v1/jobs", document, {"Idempotency-Key": key})
        self.statuses.add(reply.status)
        if reply.status in (200, 202):
            self.answered[key] = (document, reply.body)
            self.unanswered.pop(key, None)
        return reply

    def run(self):
        number = 0
        while not self.stop.wait(self.pause_s):
            key, document = f"{self.name}-{number}", self.document()
            number += 1
            self.unanswered[key] = document
            try:
                reply, chance = self.submit(key, document), self.random.random()
                if chance < 0.1 and key in self.answered:
                    self.removed.add(json_of(reply)["id"])
                    self.daemon_under_test.request("DELETE", f"/v1/jobs/{json_of(reply)['id']}")
                elif chance > 0.9:
                    content = self.random.randbytes(400_000)
                    if put(self.daemon_under_test, content).status == 201:
                        self.uploads.add(sha256(content))
            except (OSError, http.client.HTTPException):
                return  # killed, perhaps in the middle of a reply


def wait_for_all(daemon):
    def unfinished():
        queue = json_of(daemon.get("/v1/queue"))
        return queue["jobs"]["queued"] + queue["jobs"]["running"]
    while (left := unfinished()) > 0:  # patience is for one job: there are thousands after many kills
        wait_until(lambda before=left: unfinished() < before, f"the end of one of {left} jobs")


def check_jobs(test, daemon, answered, removed=(), attempts_max=1):
    """Asserts that the accepted jobs, and no others, have succeeded with complete images, equal ones for equal documents."""
    wait_for_all(daemon)
    ids = [json.loads(body)["id"] for _, body in answered.values()]
    test.assertEqual(len(ids), len(set(ids)), "each key has a job of its own")
    test.assertEqual({job["id"] for job in daemon.jobs()} - set(removed), set(ids) - set(removed), "none lost, none that nobody requested")
    images = collections.defaultdict(set)
    for document, body in answered.values():
        job_id = json.loads(body)["id"]
        if job_id in removed:
            continue
        job = daemon.job(job_id)
        test.assertEqual(job["state"], "succeeded", job["problem"])
        test.assertLessEqual(job["attempt"], attempts_max)
        reply = daemon.get(f"/v1/jobs/{job_id}/scene")
        test.assertIn((reply.status, reply.status == 410 or json_of(reply) == document), ((200, True), (410, "expires_in" in document["job"])))
        for artifact in job["artifacts"]:
            reply = daemon.get(artifact["url"])
            if reply.status == 410 and "expires_in" in document["job"]:
                continue
            test.assertEqual((reply.status, sha256(reply.body)), (200, artifact["sha256"]))
            images[json.dumps([artifact["name"], {**document, "job": None}], sort_keys=True)].add(artifact["sha256"])
    for document, shas in images.items():
        test.assertEqual(len(shas), 1, f"equal documents, equal images: {document}")
    check_files(test, daemon)
    check_ends_once(test, daemon)


def check_files(test, daemon):
    """Asserts that all files of the directory are complete."""
    files = [path for path in [*daemon.data.glob("??/*"), *daemon.data.glob("uploads/??/*")] if re.fullmatch(r"[0-9a-f]{64}", path.name)]
    for path in files:
        test.assertEqual(sha256(path.read_bytes()), path.name, "a half file under its name")
    test.assertTrue(files)


def check_ends_once(test, daemon):
    ends = collections.Counter()
    for path in daemon.directory.glob("log-*"):
        for line in path.read_text("utf-8").splitlines(keepends=True):
            row = json.loads(line) if line.endswith("\n") else {"event": "cut off by a kill"}
            if row["event"] in ("job_succeeded", "job_failed"):
                ends[row["job_id"]] += 1
    test.assertEqual([job_id for job_id, times in ends.items() if times > 1], [], "ended twice")
