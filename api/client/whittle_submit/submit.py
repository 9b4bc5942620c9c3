"""Gives frames their jobs: many of one scene in one request, none of them twice."""
import hashlib
import json

from whittle_submit.batches import batch_request, submissions
from whittle_submit.server import Refused, ServerTrouble

NOT_FOR_US = (401, 403)   # it is the key, not the scene
NO_SUCH_PLACE = (404, 405)


class Submitter:
    """`name` is the label and the batches' name; `refused(frame, sentence)` is told of scenes that are no good."""

    def __init__(self, server, state, name, refused):
        self.server, self.state, self.name, self.refused = server, state, name, refused

    # ---- what a job is known by

    def label(self, frame, attempt):
        return f"{frame.name} {frame.digest[:16]} {attempt}"

    def labels(self, frame):
        """By these a job is found whose submission nobody remembers the reply of."""
        return {"submission": self.state.run, "frame": self.label(frame, self.state.of(frame)["attempt"])}

    def labelled_document(self, frame):
        job = frame.document.get("job", {})
        labels = job.get("labels", {}) if isinstance(job, dict) else None
        if not isinstance(labels, dict):
            return frame.document  # the server says what is wrong with it
        return {**frame.document, "job": {**job, "labels": {"batch": self.name, **labels, **self.labels(frame)}}}

    def key(self, body, attempt):
        """The same after any number of deaths, and another for every other body or attempt."""
        digest = hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()
        return f"{self.state.run}-{digest[:32]}-{attempt}"

    # ---- all of them

    def submit(self, frames):
        """Gives each of `frames` a job, unless it is refused."""
        if not self.state.is_new and self.without_job(frames):
            self.find_jobs(self.without_job(frames))
        # A death between asking and noting the answer: asked again in the same words it is the same request.
        for batch in self.begun_together(self.without_job(frames)):
            self.submit_together(batch)
        for frame in self.without_job(frames):
            if self.is_begun_alone(frame):
                self.submit_alone(frame)
        for batch in submissions(self.without_job(frames)):
            if len(batch) == 1:
                self.submit_alone(batch[0])
            else:
                self.state.begin(*batch)
                self.submit_together(batch)

    def has_job(self, frame):
        return "job" in self.state.of(frame)

    def without_job(self, frames):
        return [frame for frame in frames if not self.has_job(frame) and "refused" not in self.state.of(frame)]

    def is_begun_alone(self, frame):
        return bool(self.state.of(frame)) and "batch" not in self.state.of(frame)

    def find_jobs(self, frames):
        """Notes the jobs that the server has of frames which we know none of."""
        there = {job["labels"].get("frame"): job["id"] for job in self.server.all_labelled({"submission": self.state.run})}
        entries = []
        for frame in frames:
            attempt = self.state.of(frame).get("attempt") or self.state.next_attempt(frame)
            if job_id := there.get(self.label(frame, attempt)):
                entries += [{"frame": frame.name, "digest": frame.digest, "attempt": attempt},
                            {"frame": frame.name, "job": job_id}]
        if entries:
            self.state.write(*entries)

    def begun_together(self, frames):
        """The batches among `frames` that are as they were begun."""
        batches = {}
        for frame in frames:
            name, size = self.state.of(frame).get("batch", (None, 0))
            if name:
                batches.setdefault((name, size), []).append(frame)
        return [batch for (_, size), batch in batches.items() if len(batch) == size]

    # ---- one request

    def submit_together(self, batch):
        """Precondition: they were begun."""
        body = batch_request(self.name, [self.labelled_document(frame) for frame in batch])

        def find():
            job = self.server.labelled(self.labels(batch[0]))
            return job and {"id": job["batch"]}
        try:
            reply = self.server.submit("/v1/batches", body, self.key(body, "batch"), find, now_or_never=True)
            jobs = {job["labels"].get("frame"): job["id"] for job in self.server.jobs_of_batch(reply["id"])}
        except Refused as refusal:
            if refusal.status in NOT_FOR_US:
                raise ServerTrouble(f"the server does not take jobs from us: {refusal}") from refusal
            jobs = {}  # one of them is no good, or they are too many at once: alone each has its own answer
        self.state.write(*({"frame": frame.name, "job": jobs[self.labels(frame)["frame"]]} for frame in batch
                           if self.labels(frame)["frame"] in jobs))
        for frame in batch:
            if not self.has_job(frame):
                self.state.begin(frame)
                self.submit_alone(frame)

    def submit_alone(self, frame):
        """The job's id, or None where the frame is refused."""
        if self.has_job(frame) or not self.is_begun_alone(frame):
            self.state.begin(frame)
        try:
            document = self.labelled_document(frame)
            key = self.key(document, self.state.of(frame)["attempt"])
            job = self.server.submit("/v1/jobs", document, key, lambda: self.server.labelled(self.labels(frame)))
            self.state.write({"frame": frame.name, "job": job["id"]})
            return job["id"]
        except Refused as refusal:
            if refusal.status in NOT_FOR_US + NO_SUCH_PLACE:
                raise ServerTrouble(f"the server does not take jobs from us: {refusal}") from refusal
            self.state.write({"frame": frame.name, "refused": str(refusal)})
            self.refused(frame, f"refused: {refusal}")
            return None
