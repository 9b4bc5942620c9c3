"""GET /v1/status: the health of the service for clients, from the same source as the metrics."""
import unittest

from tests.http.daemon import FAR, SANITIZED, Daemon, OneDaemon, json_of, scene, wait_until

SERIES = ("queued", "running", "ended", "failed", "wait_p50_ms", "wait_p95_ms", "rays", "rss_bytes")


class Status(OneDaemon):
    options = ("--jobs", "2")

    def status(self):
        reply = self.daemon.get("/v1/status")
        self.assertEqual((reply.status, reply.headers["Cache-Control"]), (200, "no-store"))
        return json_of(reply)

    def test_equals_the_metrics_at_rest(self):
        self.finished()
        self.daemon.submit(scene(job={"run_after": FAR}))
        wait_until(lambda: self.status()["ready"], "readiness")
        status, metrics = self.status(), self.daemon.metrics()
        worker, = status["workers"]
        self.assertEqual((worker["pid"], worker["jobs"], worker["places"]), (self.daemon.worker(), 0, 2))
        if "thread" not in SANITIZED:  # no sandbox there
            self.assertRegex(worker["sandbox"], "seccomp")
        exact = {"whittle_event_listeners": status["streams"]["open"], "whittle_upload_bytes": status["used"]["uploads_bytes"],
                 "whittle_artifact_bytes": status["used"]["artifact_bytes"],
                 "whittle_artifact_limit_bytes": status["limits"]["artifact_bytes"],
                 "whittle_disk_reserve_bytes": status["disk"]["reserve_bytes"],
                 'whittle_cache_bytes{kind="geometry"}': status["caches"]["geometry_bytes"],
                 'whittle_cache_bytes{kind="images"}': status["caches"]["image_bytes"]}
        exact |= {f'whittle_jobs{{state="{state}"}}': count for state, count in status["queue"]["jobs"].items()}
        self.assertEqual({name: metrics[name] for name in exact}, exact)
        for name, value in (("whittle_disk_free_bytes", status["disk"]["free_bytes"]),
                            ("process_resident_memory_bytes", status["memory"]["rss_bytes"]),
                            ("whittle_worker_resident_memory_bytes", worker["rss_bytes"])):
            self.assertLess(abs(metrics[name] / value - 1), 0.5, name)
        version = json_of(self.daemon.get("/v1/version"))
        self.assertEqual(status["version"], {name: version[name] for name in ("version", "build")})
        self.assertLessEqual(version["limits"].items(), status["limits"].items())
        self.assertEqual((status["queue"], status["used"]["queued_jobs"]), (json_of(self.daemon.get("/v1/queue")), 1))

    def test_has_a_history(self):
        running = self.daemon.start_job()
        ended = self.finished()["id"]
        history = wait_until(lambda: (h := self.status()["history"])["ended"] and sum(h["ended"]) and h["running"][-1] and h,
                             "a step with an end")
        self.assertEqual((history["step_s"], {len(history[name]) for name in SERIES}), (5, {len(history["queued"])}))
        step = next(i for i, count in enumerate(history["ended"]) if count)
        self.assertGreaterEqual(history["wait_p95_ms"][step], history["wait_p50_ms"][step])
        self.assertGreaterEqual(history["rays"][step], sum(self.daemon.job(ended)["report"]["rays"].values()))
        self.assertGreater(history["rss_bytes"][-1], 1 << 20)
        self.assertRegex(history["until"], r"^20\d\d-.*Z$")
        self.daemon.request("POST", f"/v1/jobs/{running}/cancel")
        self.daemon.wait_for_end(running)

    def test_leaves_the_history_out_for_frequent_requests(self):
        whole, short = self.daemon.get("/v1/status?history=true"), self.daemon.get("/v1/status?history=false")
        self.assertIsNone(json_of(short)["history"])
        self.assertEqual(json_of(short).keys(), json_of(whole).keys())
        for query in ("?history=no", "?history=", "?history=true&history=false"):
            self.assert_problem(self.daemon.get("/v1/status" + query), 400, "invalid_query")


class UnreadyStatus(unittest.TestCase):
    def test_names_the_reason(self):
        with Daemon("--jobs", "1") as daemon:
            daemon.start_job()
            daemon.process.terminate()
            status = wait_until(lambda: (now := json_of(daemon.get("/v1/status")))["draining"] and now, "draining")
            self.assertEqual((status["ready"], status["reason"]), (False, "draining"))
