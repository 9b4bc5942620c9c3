"""Event streams of one job and of all jobs: resumption, limits, and no thread per stream."""
import contextlib
import json
import unittest

from tests.http.daemon import FAR, NOBODY, PATIENCE_S, Daemon, OneDaemon, json_of, long_scene, scene


class Stream(contextlib.AbstractContextManager):
    """A client of an event stream; events are dicts {id, event, data}."""

    def __init__(self, daemon, path, last_event_id=None):
        self.connection = daemon.connection(daemon.port)
        headers = {} if last_event_id is None else {"Last-Event-ID": str(last_event_id)}
        self.connection.request("GET", path, headers=headers)
        self.response = self.connection.getresponse()

    def __exit__(self, *_):
        self.response.close()
        self.connection.close()

    def block(self):
        """Returns the lines up to the next empty one, or None at the end."""
        lines = []
        while True:
            line = self.response.readline().decode()
            if not line:
                return None
            if line == "\n":
                return lines
            lines.append(line.rstrip("\n"))

    def events(self):
        while (lines := self.block()) is not None:
            fields = dict(line.split(": ", 1) for line in lines if not line.startswith(":"))
            if "event" in fields:
                yield {"id": int(fields["id"]), "event": fields["event"], "data": json.loads(fields["data"])}

    def until(self, condition):
        """Returns all events up to the first for which `condition` holds."""
        seen = []
        for event in self.events():
            seen.append(event)
            if condition(event):
                return seen
        raise AssertionError(f"the stream ended before: {seen}")


class EventsOfAJob(OneDaemon):
    options = ("--jobs", "1")

    def test_follow_the_job_to_its_end(self):
        blocker = self.daemon.submit(long_scene())
        job_id = self.daemon.submit(scene(1000, 800, samples=4))
        path = self.daemon.job(job_id)["links"]["events"]
        self.assertEqual(path, f"/v1/jobs/{job_id}/events")
        with Stream(self.daemon, path) as stream:
            self.assertEqual(stream.response.headers["Content-Type"], "text/event-stream")
            self.assertEqual(stream.response.headers["Connection"], "close")
            self.assertEqual(stream.block(), ["retry: 2000"])
            self.daemon.request("POST", f"/v1/jobs/{blocker}/cancel")
            events = list(stream.events())
        names = [event["event"] for event in events]
        self.assertEqual([names[0], names[1], names[-1]], ["state", "state", "done"], names)
        self.assertEqual(set(names[2:-1]) - {"progress"}, set())
        self.assertEqual([events[0]["data"]["state"], events[1]["data"]["state"], events[-1]["data"]["state"]],
                         ["queued", "running", "succeeded"])
        self.assertEqual({event["data"]["id"] for event in events}, {job_id})
        numbers = [event["id"] for event in events]
        self.assertEqual(numbers, sorted(set(numbers)))
        fractions = [event["data"]["progress"] for event in events]
        self.assertEqual(fractions, sorted(fractions))
        self.assertEqual(fractions[-1], 1)

    def test_resume_after_the_last_event_id(self):
        blocker = self.daemon.submit(long_scene())
        job_id = self.daemon.submit(scene())
        path = f"/v1/jobs/{job_id}/events"
        with Stream(self.daemon, path) as stream:
            events = stream.events()
            first = next(events)
            self.daemon.request("POST", f"/v1/jobs/{blocker}/cancel")
            list(events)
        with Stream(self.daemon, path, first["id"]) as stream:
            rest = list(stream.events())
        self.assertEqual([event["data"]["state"] for event in rest], ["running", "succeeded"])
        self.assertGreater(rest[0]["id"], first["id"])
        with Stream(self.daemon, path, rest[0]["id"]) as stream:
            self.assertEqual(list(stream.events()), rest[1:])
        with Stream(self.daemon, path, rest[-1]["id"]) as stream:
            self.assertEqual(stream.response.status, 204)
        for unknown in (1, 10 ** 18, "nonsense"):
            with Stream(self.daemon, path, unknown) as stream:
                self.assertEqual([event["data"]["state"] for event in stream.events()], ["succeeded"])

    def test_end_when_the_job_is_removed(self):
        job_id = self.daemon.submit(scene(job={"run_after": FAR}))
        with Stream(self.daemon, f"/v1/jobs/{job_id}/events") as stream:
            self.daemon.request("DELETE", f"/v1/jobs/{job_id}")
            self.assertEqual(stream.until(lambda event: event["event"] == "done")[-1]["data"]["state"], "removed")


class EventsOfAllJobs(unittest.TestCase):
    def test_describe_their_jobs_and_select_a_batch(self):
        with Daemon() as daemon:
            batch = json_of(daemon.request("POST", "/v1/batches", {"scene": scene(name="frame"), "frames": [{}, {}]}))["id"]
            body = {"scene": scene(name="measured", accuracy={}), "settings": {"parameters": ["samples"], "reference_samples": 16}}
            with Stream(daemon, "/v1/events") as of_all, Stream(daemon, f"/v1/events?batch={batch}") as of_batch:
                draft = daemon.rendered(scene(name="draft", job={"keep": False}))["id"]
                measured = json_of(daemon.request("POST", "/v1/measure", body))["id"]
                daemon.wait_for_end(measured)
                for job in json_of(daemon.get(f"/v1/jobs?batch={batch}"))["items"]:
                    daemon.wait_for_end(job["id"])
                    daemon.request("DELETE", job["links"]["self"])
                removed = lambda events: lambda event: event["data"]["state"] == "removed" and len(events.append(event) or events) == 2
                every, some = of_all.until(removed([])), of_batch.until(removed([]))
            self.assertNotIn(draft, {event["data"]["id"] for event in every})
            of_measured = [event["data"] for event in every if event["data"]["id"] == measured]
            self.assertEqual({(data["kind"], data["name"], data["batch"], data["owner"]) for data in of_measured},
                             {("measure", "measured", None, None)})
            self.assertEqual({(event["data"]["kind"], event["data"]["name"], event["data"]["batch"]) for event in some},
                             {("render", "frame", batch)})
            for query, status in ((f"batch={NOBODY}", 404), ("batch=", 404), ("batch=%00", 400), ("batch=x", 404), ("job=1", 400),
                                  (f"batch={batch}&batch={batch}", 400)):
                self.assertEqual(daemon.get(f"/v1/events?{query}").status, status, query)

    def test_resume_or_reset(self):
        with Daemon() as daemon:
            with Stream(daemon, "/v1/events") as stream:
                daemon.submit(scene(name="one"))
                last = stream.until(lambda event: event["event"] == "done")[-1]["id"]
            missed = daemon.rendered(scene(name="two"))["id"]
            with Stream(daemon, "/v1/events", last) as stream:
                seen = stream.until(lambda event: event["event"] == "done")
                self.assertEqual({event["data"]["id"] for event in seen}, {missed})
                self.assertEqual([event["data"]["state"] for event in seen if event["event"] != "progress"],
                                 ["queued", "running", "succeeded"])
            daemon.terminate()
            daemon.start()  # its history of events is empty
            with Stream(daemon, "/v1/events", last) as stream:
                reset = next(stream.events())
                self.assertEqual(reset["event"], "reset")
                self.assertGreater(reset["id"], last)

    def test_occupy_no_threads(self):
        with Daemon("--handler-threads", "1") as daemon:
            threads = len(list(daemon.threads()))
            streams = [Stream(daemon, "/v1/events") for _ in range(300)]
            self.assertLess(len(list(daemon.threads())), threads + 10)
            job_id = daemon.submit(scene())
            for stream in streams:
                done = stream.until(lambda event: event["event"] == "done")[-1]
                self.assertEqual((done["data"]["id"], done["data"]["state"]), (job_id, "succeeded"))
                stream.__exit__()

    def test_end_on_drain_after_the_jobs(self):
        options = ("--jobs", "1", "--drain-s", "600")  # however slow the machine: a job not done by then goes back
        with Daemon(*options) as daemon, Stream(daemon, "/v1/events") as stream:
            daemon.submit(scene(2000, 1500, samples=4))  # long enough for events
            stream.until(lambda event: event["event"] == "progress")  # a job no worker has begun goes back to the queue
            daemon.process.terminate()
            events = list(stream.events())
            self.assertEqual(events[-1]["data"]["state"], "succeeded")
            self.assertEqual(daemon.process.wait(PATIENCE_S), 0)
