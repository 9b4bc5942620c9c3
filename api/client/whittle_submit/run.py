"""Brings every frame from the document to the picture on the disk, from wherever it is."""
import collections
import hashlib
import json
import time

from whittle_submit.progress import Progress
from whittle_submit.server import Refused, Server, ServerTrouble
from whittle_submit.state import State

EXIT_DONE, EXIT_FAILED, EXIT_BAD_INPUT, EXIT_ENVIRONMENT, EXIT_INTERRUPTED = 0, 1, 2, 3, 130

WATCHED_AT_ONCE = 32   # jobs end about in the order of their submission, so the oldest are asked for
PAUSE_S = 0.25


def dry_run(frames):
    for frame in frames:
        print(f"{frame.name}  {frame.digest[:12]}")
    for path in sorted({str(path) for frame in frames for path in frame.files.values()}):
        print(f"file {path}")
    print(f"{len(frames)} jobs; nothing was sent")
    return EXIT_DONE


class Run:
    def __init__(self, frames, options):
        self.frames, self.options = frames, options
        self.state = State(options.out)
        self.progress = Progress(collections.Counter(frame.batch for frame in frames))
        self.server = Server(options.server, options.key, options.patience, self.progress.say)
        self.batch = options.name or frames[0].batch
        self.failures = 0

    # ---- where a frame is

    def is_done(self, frame):
        """Whether its pictures are on the disk as they were brought."""
        pictures = self.state.of(frame).get("pictures")
        if not pictures:
            return False
        return all(self.sha256_of(self.options.out / name) == digest for name, digest in pictures.items())

    @staticmethod
    def sha256_of(path):
        try:
            with open(path, "rb") as file:
                return hashlib.file_digest(file, "sha256").hexdigest()
        except OSError:
            return None

    def failed_before(self, frame):
        known = self.state.of(frame)
        return known.get("refused") or (known.get("ended") not in (None, "succeeded") and known.get("why"))

    # ---- submitting

    def labels(self, frame):
        """By these a job is found whose submission nobody remembers the reply of."""
        return {"submission": self.state.run, "frame": f"{frame.name} {frame.digest[:16]} {self.state.of(frame)['attempt']}"}

    def labelled_document(self, frame):
        job = frame.document.get("job", {})
        labels = job.get("labels", {}) if isinstance(job, dict) else None
        if not isinstance(labels, dict):
            return frame.document  # the server says what is wrong with it
        return {**frame.document, "job": {**job, "labels": {"batch": self.batch, **labels, **self.labels(frame)}}}

    def key(self, frame, document):
        """The same after any number of deaths, and another for every other document or attempt."""
        digest = hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()
        return f"{self.state.run}-{digest[:32]}-{self.state.of(frame)['attempt']}"

    def submit(self, frame):
        """Gives the frame a job, unless it is refused."""
        known = self.state.of(frame)
        is_pending = known and not known.get("job")  # a death between asking and noting the answer
        if not is_pending:
            self.state.begin(frame)

        def find():
            return self.server.labelled(self.labels(frame))
        try:
            document = self.labelled_document(frame)
            job = (find() if is_pending else None) or self.server.submit(document, self.key(frame, document), find)
            self.state.write({"frame": frame.name, "job": job["id"]})
            return True
        except Refused as refusal:
            if refusal.status in (401, 403, 404, 405):
                raise ServerTrouble(f"the server does not take jobs from us: {refusal}") from refusal
            self.state.write({"frame": frame.name, "refused": str(refusal)})
            self.fail(frame, f"refused: {refusal}")
            return False

    def fail(self, frame, sentence):
        self.failures += 1
        self.progress.ended(frame, sentence, True)

    # ---- watching

    def look_at(self, frame):
        """True when there is nothing more to do for the frame."""
        job = self.server.job(self.state.of(frame)["job"])
        if job is None:  # removed or expired before we had it
            self.progress.say(f"{frame.name}: its job is gone; submitting it anew")
            return not self.submit(frame)
        if job["state"] == "succeeded":
            return self.bring(frame, job)
        if job["state"] in ("failed", "cancelled"):
            problem = job["problem"] or {"code": job["state"], "detail": "by somebody else", "errors": []}
            details = [f"{error['pointer']} {error['detail']}" for error in problem["errors"]]
            why = f"{problem['code']}: {'; '.join(details) or problem['detail']}"
            self.state.write({"frame": frame.name, "ended": job["state"], "why": why})
            self.fail(frame, why)
            return True
        self.progress.running(frame, job["progress"])
        return False

    def bring(self, frame, job):
        pictures = {}
        for artifact in job["artifacts"]:
            path = self.options.out / (frame.name + artifact["name"].removeprefix("image"))
            if self.sha256_of(path) != artifact["sha256"] and not self.server.download(artifact, path):
                self.progress.say(f"{frame.name}: its picture is gone; submitting it anew")
                return not self.submit(frame)
            pictures[path.name] = artifact["sha256"]
        self.state.write({"frame": frame.name, "ended": "succeeded", "pictures": pictures})
        self.progress.ended(frame, ", ".join(pictures), False)
        return True

    def watch(self, frames):
        waiting = collections.deque(frames)
        while waiting:
            looked_at = [waiting.popleft() for _ in range(min(WATCHED_AT_ONCE, len(waiting)))]
            still = [frame for frame in looked_at if not self.look_at(frame)]
            waiting.extendleft(reversed(still))
            if waiting and len(still) == len(looked_at):
                waiting.rotate(-1)  # so that none is forgotten behind long ones
                time.sleep(PAUSE_S)

    # ---- all of it

    def all(self):
        to_do = []
        for frame in self.frames:
            why = self.failed_before(frame)
            if self.is_done(frame):
                self.progress.ended(frame, "is there", False)
            elif why and not self.options.retry_failed:
                self.fail(frame, f"{why} (before; --retry-failed tries again)")
            else:
                if why:
                    self.state.begin(frame)
                to_do.append(frame)
        files = {digest: path for frame in to_do for digest, path in frame.files.items()}
        if files:
            self.server.upload(files, lambda path: self.progress.say(f"uploading {path}"))
        submitted = [frame for frame in to_do if self.state.of(frame).get("job") or self.submit(frame)]
        self.watch(submitted)
        there = len(self.frames) - self.failures
        self.progress.say(f"{there} of {len(self.frames)} scenes have their pictures in {self.options.out}")
        return EXIT_FAILED if self.failures else EXIT_DONE


def run(frames, options):
    return Run(frames, options).all()
