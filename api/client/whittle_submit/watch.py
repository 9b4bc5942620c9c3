"""Waits for the jobs of frames: listens to the service while that can be had, asks it while not."""
import time

from whittle_submit.events import Events, NoStream, StreamEnded

PAUSE_S, LONGEST_PAUSE_S = 0.25, 4   # between two looks at all jobs, growing while nothing happens
WITHOUT_STREAM_S = 30                # then it is tried again
ENDED = ("succeeded", "failed", "cancelled")


class Watch:
    """`settle(frame, job)` does what there is to do for a frame whose job has ended, or is None where there is none any
    more, and gives the id of the job that takes its place, if any. `running(frame, fraction)` tells how far it is."""

    def __init__(self, server, submission, settle, running):
        self.server, self.submission = server, submission  # the label of all its jobs
        self.settle, self.running = settle, running
        self.waiting = {}  # job's id -> frame
        self.events = Events(server.connect, server.base + "/v1/events", server.headers)

    def until_all_ended(self, jobs):
        """`jobs`: (id, frame) of each."""
        self.waiting = dict(jobs)
        try:
            while self.waiting:
                try:
                    self.listen()
                except StreamEnded:
                    self.ask(0)
                except NoStream:
                    self.ask(WITHOUT_STREAM_S)
        finally:
            self.events.close()

    def listen(self):
        """Until all have ended. What happened before it began is asked for once; it is not missed in between."""
        if not self.events.open():
            self.look_at_all()
        while self.waiting:
            kind, event = self.events.next()
            if kind == "reset":
                self.look_at_all()
            elif (job_id := event.get("id")) in self.waiting:
                if kind == "done":
                    self.end(job_id, self.server.job(job_id))
                elif kind == "progress":
                    self.running(self.waiting[job_id], event["progress"])

    def ask(self, seconds):
        """For so long, at least once."""
        pause = PAUSE_S
        until = time.monotonic() + seconds
        while True:
            pause = PAUSE_S if self.look_at_all() else min(2 * pause, LONGEST_PAUSE_S)
            if not self.waiting:
                return
            time.sleep(pause)
            if time.monotonic() >= until:
                return

    def look_at_all(self):
        """Whether some had ended."""
        before = set(self.waiting)
        unseen = set(before)
        for job in self.server.all_labelled({"submission": self.submission}):
            if job["id"] not in unseen:
                continue
            unseen.remove(job["id"])
            if job["state"] in ENDED:
                self.end(job["id"], job)
            elif job["state"] == "running":
                self.running(self.waiting[job["id"]], job["progress"])
        for job_id in unseen:  # it has lost its label, or is gone
            job = self.server.job(job_id)
            if job is None or job["state"] in ENDED:
                self.end(job_id, job)
        return before != set(self.waiting)

    def end(self, job_id, job):
        if job is not None and job["state"] not in ENDED:
            return  # somebody has had it tried again
        frame = self.waiting.pop(job_id)
        if instead := self.settle(frame, job):
            self.waiting[instead] = frame
