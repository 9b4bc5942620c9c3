"""A run: submits the frames that have no image yet, waits for their jobs and downloads the images.

The state file records each step before or after it, so that an interrupted run can be continued by the same command.
"""
import fcntl
import json
import os
import time
import uuid

from whittle_submit.server import EventStream, Rejected, Server, ServerError, StreamClosed, StreamUnavailable
from whittle_submit.sweep import batch_request, file_digest, group_frames, json_digest

STATE_FILE = "whittle-submit.state"
UNAUTHORIZED = (401, 403)  # the key is wrong, not the scene
WRONG_URL = (404, 405)
FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.25, 4  # between polls, doubled while no job ends
POLLING_S = 30                            # without a stream, until it is opened again
FINAL = ("succeeded", "failed", "cancelled")


class StateError(Exception):
    """The state file cannot be used; the message gives the reason."""


class State:
    """Journal of one output directory, one JSON object in each line: first {"run"}, then entries of frames by name.
    {"frame", "digest", "attempt"} precedes a submission, with "batch": [id, size] if it is submitted in a batch.
    {"frame", "job"} or {"frame", "rejected"} follows it, then {"frame", "ended", "images", "missed"} or {"frame", "ended", "reason"}.
    {"frame", "reset"} discards all but the number of attempts."""

    def __init__(self, directory):
        directory.mkdir(parents=True, exist_ok=True)
        self.path = directory / STATE_FILE
        self.file = open(self.path, "a+b")  # pylint: disable=consider-using-with
        try:
            fcntl.flock(self.file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise StateError(f"{self.path} is in use by another whittle-submit") from error
        self.run = None
        self.frames = {}  # name -> merged entries
        self.load()
        self.is_new = self.run is None
        if self.is_new:
            self.write({"run": str(uuid.uuid4())})
            descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
            os.fsync(descriptor)
            os.close(descriptor)

    def load(self):
        self.file.seek(0)
        size = 0
        for line in self.file:
            if not line.endswith(b"\n"):
                break  # the process was killed while it wrote this line
            try:
                self.apply(json.loads(line))
            except (ValueError, KeyError, TypeError, AttributeError) as error:
                raise StateError(f"{self.path} is not a state file of this version; move it away") from error
            size += len(line)
        self.file.truncate(size)

    def apply(self, entry):
        if "run" in entry:
            self.run = entry["run"]
        elif "digest" in entry:  # a new attempt
            self.frames[entry["frame"]] = dict(entry)
        elif "reset" in entry:
            self.frames[entry["frame"]] = {"attempt": self.frames[entry["frame"]]["attempt"]}
        else:
            self.frames[entry["frame"]].update(entry)

    def write(self, *entries):
        """Appends the entries durably, in this order."""
        for entry in entries:
            self.file.write(json.dumps(entry).encode() + b"\n")
        self.file.flush()
        os.fsync(self.file.fileno())
        for entry in entries:
            self.apply(entry)

    def of(self, frame):
        """The merged entries of the frame; {} if its document has changed since."""
        entries = self.frames.get(frame.name, {})
        return entries if entries.get("digest") == frame.digest else {}

    def next_attempt(self, frame):
        return self.frames.get(frame.name, {}).get("attempt", 0) + 1

    def begin(self, *frames):
        """Starts a new attempt at each frame; several frames are one batch."""
        batch = {"batch": [str(uuid.uuid4()), len(frames)]} if len(frames) > 1 else {}
        self.write(*({"frame": frame.name, "digest": frame.digest, "attempt": self.next_attempt(frame), **batch}
                     for frame in frames))


class Submitter:
    """Submits frames in batches, each frame once. `name` is the label "batch"; `report_rejected(frame, message)` is called
    for invalid scenes."""

    def __init__(self, server, state, name, report_rejected):
        self.server, self.state, self.name, self.report_rejected = server, state, name, report_rejected

    @staticmethod
    def frame_label(frame, attempt):
        return f"{frame.name} {frame.digest[:16]} {attempt}"

    def labels(self, frame):
        """Labels that identify the job of the frame if the response to its submission is lost."""
        return {"submission": self.state.run, "frame": self.frame_label(frame, self.state.of(frame)["attempt"])}

    def labelled_document(self, frame):
        job = frame.document.get("job", {})
        labels = job.get("labels", {}) if isinstance(job, dict) else None
        if not isinstance(labels, dict):
            return frame.document  # the server rejects it with the reason
        return {**frame.document, "job": {**job, "labels": {"batch": self.name, **labels, **self.labels(frame)}}}

    def idempotency_key(self, body, attempt):
        """A function of run, body and attempt, so that a continued run repeats the same request."""
        return f"{self.state.run}-{json_digest(body)[:32]}-{attempt}"

    def has_job(self, frame):
        return "job" in self.state.of(frame)

    def pending(self, frames):
        return [frame for frame in frames if not self.has_job(frame) and "rejected" not in self.state.of(frame)]

    def is_begun_alone(self, frame):
        return bool(self.state.of(frame)) and "batch" not in self.state.of(frame)

    def submit(self, frames):
        """Submits those of `frames` that have no job."""
        if not self.state.is_new and self.pending(frames):
            self.recover_jobs(self.pending(frames))
        # Interrupted between request and response: the same request is repeated, and the server recognises its key.
        for batch in self.interrupted_batches(self.pending(frames)):
            self.submit_batch(batch)
        for frame in self.pending(frames):
            if self.is_begun_alone(frame):
                self.submit_alone(frame)
        for batch in group_frames(self.pending(frames)):
            if len(batch) == 1:
                self.submit_alone(batch[0])
            else:
                self.state.begin(*batch)
                self.submit_batch(batch)

    def recover_jobs(self, frames):
        """Records jobs that the server has and the state file does not."""
        jobs = {job["labels"].get("frame"): job["id"] for job in self.server.jobs({"submission": self.state.run})}
        entries = []
        for frame in frames:
            attempt = self.state.of(frame).get("attempt") or self.state.next_attempt(frame)
            if job_id := jobs.get(self.frame_label(frame, attempt)):
                entries += [{"frame": frame.name, "digest": frame.digest, "attempt": attempt},
                            {"frame": frame.name, "job": job_id}]
        if entries:
            self.state.write(*entries)

    def interrupted_batches(self, frames):
        """Batches that were begun and whose frames are all among `frames`, unchanged."""
        batches = {}
        for frame in frames:
            batch_id, size = self.state.of(frame).get("batch", (None, 0))
            if batch_id:
                batches.setdefault((batch_id, size), []).append(frame)
        return [batch for (_, size), batch in batches.items() if len(batch) == size]

    def submit_batch(self, batch):
        """Submits frames that were begun together. Frames that get no job in the batch are submitted alone."""
        body = batch_request(self.name, [self.labelled_document(frame) for frame in batch])

        def find():
            job = self.server.newest_job(self.labels(batch[0]))
            return job and {"id": job["batch"]}
        try:
            reply = self.server.submit("/v1/batches", body, self.idempotency_key(body, "batch"), find, wait_for_queue=False)
            jobs = {job["labels"].get("frame"): job["id"] for job in self.server.jobs(batch=reply["id"])}
        except Rejected as rejection:
            if rejection.status in UNAUTHORIZED:
                raise ServerError(f"the server does not accept jobs: {rejection}") from rejection
            jobs = {}  # one frame is invalid, or the batch is too large: alone, each frame gets its own response
        labels = {frame.name: self.labels(frame)["frame"] for frame in batch}
        self.state.write(*({"frame": frame.name, "job": jobs[labels[frame.name]]} for frame in batch
                           if labels[frame.name] in jobs))
        for frame in batch:
            if not self.has_job(frame):
                self.state.begin(frame)
                self.submit_alone(frame)

    def submit_alone(self, frame):
        """Returns the job's id, or None if the frame is rejected."""
        if self.has_job(frame) or not self.is_begun_alone(frame):
            self.state.begin(frame)
        try:
            document = self.labelled_document(frame)
            key = self.idempotency_key(document, self.state.of(frame)["attempt"])
            job = self.server.submit("/v1/jobs", document, key, lambda: self.server.newest_job(self.labels(frame)))
            self.state.write({"frame": frame.name, "job": job["id"]})
            return job["id"]
        except Rejected as rejection:
            if rejection.status in UNAUTHORIZED + WRONG_URL:
                raise ServerError(f"the server does not accept jobs: {rejection}") from rejection
            self.state.write({"frame": frame.name, "rejected": str(rejection)})
            self.report_rejected(frame, f"rejected: {rejection}")
            return None


class JobWatcher:
    """Waits for jobs: follows the event stream, or polls if there is none. `on_end(frame, job)` handles an ended job, None if
    it no longer exists, and returns the id of a replacement, if any. `on_progress(frame, fraction)` reports progress."""

    def __init__(self, server, submission, on_end, on_progress):
        self.server, self.submission = server, submission  # a label of all jobs of the run
        self.on_end, self.on_progress = on_end, on_progress
        self.waiting = {}  # job id -> frame
        self.events = EventStream(server)

    def wait(self, jobs):
        """Waits until all `jobs` (id, frame) have ended."""
        self.waiting = dict(jobs)
        try:
            while self.waiting:
                try:
                    self.follow_events()
                except StreamClosed:
                    self.poll(0)
                except StreamUnavailable:
                    self.poll(POLLING_S)
        finally:
            self.events.close()

    def follow_events(self):
        if not self.events.open():
            self.refresh()  # states before the first event
        while self.waiting:
            event_type, event = self.events.next()
            if event_type == "reset":
                self.refresh()
            elif (job_id := event.get("id")) in self.waiting:
                if event_type == "done":
                    self.update(job_id, self.server.job(job_id))
                elif event_type == "progress":
                    self.on_progress(self.waiting[job_id], event["progress"])

    def poll(self, seconds):
        """Polls for `seconds`, at least once."""
        pause = FIRST_PAUSE_S
        until = time.monotonic() + seconds
        while True:
            pause = FIRST_PAUSE_S if self.refresh() else min(2 * pause, LONGEST_PAUSE_S)
            if not self.waiting:
                return
            time.sleep(pause)
            if time.monotonic() >= until:
                return

    def refresh(self):
        """Requests the state of all jobs. Returns True if one has ended."""
        before = set(self.waiting)
        unlisted = set(before)
        for job in self.server.jobs({"submission": self.submission}):
            if job["id"] in unlisted:
                unlisted.remove(job["id"])
                self.update(job["id"], job)
        for job_id in unlisted:  # the label was changed, or the job no longer exists
            self.update(job_id, self.server.job(job_id))
        return before != set(self.waiting)

    def update(self, job_id, job):
        if job is None or job["state"] in FINAL:
            frame = self.waiting.pop(job_id)
            if replacement := self.on_end(frame, job):
                self.waiting[replacement] = frame
        elif job["state"] == "running":
            self.on_progress(self.waiting[job_id], job["progress"])


def missed_target(job):
    """The error of a render that missed a target error of its document, or None."""
    error = job["report"]["error"]
    if error["met"]:
        return None
    missed = [f"{part} at most {error[found]:.3g} levels, target {error[target]:.3g}"
              for part, found, target in (("error", "estimate", "target"), ("worst tile", "worst_tile", "tile_target"))
              if error[target] is not None and error[found] > error[target]]
    return "; ".join(missed) + " not reached"


class Run:
    """The frames of one command, `progress` of which is shown to the user."""

    def __init__(self, frames, options, progress):
        self.frames, self.options, self.progress = frames, options, progress
        self.state = State(options.out)
        self.server = Server(options.server, options.key, options.patience, progress.message)
        self.submitter = Submitter(self.server, self.state, options.name or frames[0].scene, self.fail)
        self.failures = self.missed = 0  # frames without an image, images that miss their target

    def execute(self):
        """Returns the number of frames that have no image."""
        pending = [frame for frame in self.frames if self.needs_job(frame)]
        files = {digest: path for frame in pending for digest, path in frame.files.items()}
        if files:
            self.server.upload(files)
        self.submitter.submit(pending)
        jobs = [(self.state.of(frame)["job"], frame) for frame in pending if self.submitter.has_job(frame)]
        JobWatcher(self.server, self.state.run, self.on_end, self.progress.running).wait(jobs)
        return self.failures

    def needs_job(self, frame):
        """Reports frames that need none. Resets failed frames that are to be submitted again."""
        entries = self.state.of(frame)
        images = entries.get("images")
        if images and all(self.has_content(name, digest) for name, digest in images.items()):
            self.missed += entries.get("missed") is not None
            self.progress.ended(frame, "already complete", False)
            return False
        failure = entries.get("rejected") or (entries.get("ended") != "succeeded" and entries.get("reason"))
        if failure and not self.options.retry_failed:
            self.fail(frame, f"{failure} (in an earlier run; --retry-failed submits it again)")
            return False
        if failure:
            self.state.write({"frame": frame.name, "reset": True})
        return True

    def has_content(self, name, digest):
        path = self.options.out / name
        try:
            return file_digest(path) == digest
        except OSError:
            return False

    def fail(self, frame, message):
        self.failures += 1
        self.progress.ended(frame, message, True)

    def on_end(self, frame, job):
        """Returns the id of a new job if nothing is left of this one."""
        if job is None:  # deleted or expired before its images were downloaded
            self.progress.message(f"{frame.name}: its job no longer exists; submitting it again")
            return self.submitter.submit_alone(frame)
        if job["state"] == "succeeded":
            return self.download(frame, job)
        problem = job["problem"] or {"code": job["state"], "detail": "by another client", "errors": []}
        details = [f"{error['pointer']} {error['detail']}" for error in problem["errors"]]
        reason = f"{problem['code']}: {'; '.join(details) or problem['detail']}"
        self.state.write({"frame": frame.name, "ended": job["state"], "reason": reason})
        self.fail(frame, reason)
        return None

    def download(self, frame, job):
        images = {}
        for artifact in job["artifacts"]:
            path = self.options.out / (frame.name + artifact["name"].removeprefix("image"))
            if not self.has_content(path.name, artifact["sha256"]) and not self.server.download(artifact, path):
                self.progress.message(f"{frame.name}: its image no longer exists; submitting it again")
                return self.submitter.submit_alone(frame)
            images[path.name] = artifact["sha256"]
        missed = missed_target(job)
        self.state.write({"frame": frame.name, "ended": "succeeded", "images": images, "missed": missed})
        if missed:
            self.progress.message(f"{frame.name}: {missed}")
        self.missed += missed is not None
        self.progress.ended(frame, ", ".join(images), False)
        return None
