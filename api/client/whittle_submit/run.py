"""Brings every frame from the document to the picture on the disk, from wherever it is."""
import collections
import hashlib

from whittle_submit.batches import submissions
from whittle_submit.progress import Progress
from whittle_submit.server import Server
from whittle_submit.state import State
from whittle_submit.submit import Submitter
from whittle_submit.watch import Watch

EXIT_DONE, EXIT_FAILED, EXIT_BAD_INPUT, EXIT_ENVIRONMENT, EXIT_INTERRUPTED = 0, 1, 2, 3, 130


def dry_run(frames):
    for frame in frames:
        print(f"{frame.name}  {frame.digest[:12]}")
    for path in sorted({str(path) for frame in frames for path in frame.files.values()}):
        print(f"file {path}")
    requests = len(submissions(frames))
    print(f"{len(frames)} jobs in {requests} request{'s' if requests > 1 else ''}; nothing was sent")
    return EXIT_DONE


class Run:
    def __init__(self, frames, options):
        self.frames, self.options = frames, options
        self.state = State(options.out)
        self.progress = Progress(collections.Counter(frame.batch for frame in frames))
        self.server = Server(options.server, options.key, options.patience, self.progress.say)
        self.submitter = Submitter(self.server, self.state, options.name or frames[0].batch, self.fail)
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

    # ---- when its job has ended

    def fail(self, frame, sentence):
        self.failures += 1
        self.progress.ended(frame, sentence, True)

    def settle(self, frame, job):
        """The id of another job, where this one has left nothing."""
        if job is None:  # removed or expired before we had it
            self.progress.say(f"{frame.name}: its job is gone; submitting it anew")
            return self.submitter.submit_alone(frame)
        if job["state"] == "succeeded":
            return self.bring(frame, job)
        problem = job["problem"] or {"code": job["state"], "detail": "by somebody else", "errors": []}
        details = [f"{error['pointer']} {error['detail']}" for error in problem["errors"]]
        why = f"{problem['code']}: {'; '.join(details) or problem['detail']}"
        self.state.write({"frame": frame.name, "ended": job["state"], "why": why})
        self.fail(frame, why)
        return None

    def bring(self, frame, job):
        pictures = {}
        for artifact in job["artifacts"]:
            path = self.options.out / (frame.name + artifact["name"].removeprefix("image"))
            if self.sha256_of(path) != artifact["sha256"] and not self.server.download(artifact, path):
                self.progress.say(f"{frame.name}: its picture is gone; submitting it anew")
                return self.submitter.submit_alone(frame)
            pictures[path.name] = artifact["sha256"]
        self.state.write({"frame": frame.name, "ended": "succeeded", "pictures": pictures})
        self.progress.ended(frame, ", ".join(pictures), False)
        return None

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
                    self.state.forget(frame)
                to_do.append(frame)
        files = {digest: path for frame in to_do for digest, path in frame.files.items()}
        if files:
            self.server.upload(files, lambda path: self.progress.say(f"uploading {path}"))
        self.submitter.submit(to_do)
        jobs = [(self.state.of(frame)["job"], frame) for frame in to_do if self.submitter.has_job(frame)]
        Watch(self.server, self.state.run, self.settle, self.progress.running).until_all_ended(jobs)
        there = len(self.frames) - self.failures
        self.progress.say(f"{there} of {len(self.frames)} scenes have their pictures in {self.options.out}")
        return EXIT_FAILED if self.failures else EXIT_DONE


def run(frames, options):
    return Run(frames, options).all()
