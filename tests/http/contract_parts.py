"""Replies of batches and webhooks, for the comparison with api/openapi.yaml."""
import json
import tempfile

from tests.http.daemon import Daemon, json_of, scene, wait_until

NOBODY = "0190a000-0000-7000-8000-000000000001"


class ContractParts:
    """Part of a TestCase with `daemon` and `check(seen, template, reply, method)`."""

    def check_batches(self, seen):
        good = {"scene": scene(), "frames": [{}, {"name": "second"}]}
        for body in (json.dumps(good).encode(), b"{", b"[" * 100, b'{"scene": {}, "frames": []}'):
            self.check(seen, "/v1/batches", self.daemon.request("POST", "/v1/batches", body), "POST")
        other = self.daemon.request("POST", "/v1/batches", b"{}", {"Content-Type": "text/plain"})
        self.check(seen, "/v1/batches", other, "POST")
        self.check_without_length(seen, "submitBatch", "POST", "/v1/batches")
        waiting = {"scene": scene(job={"run_after": "2099-01-01T00:00:00Z"}), "sweep": {"/camera/fov": [30, 40]}}
        batch_id = json_of(self.daemon.request("POST", "/v1/batches", waiting))["id"]
        done = json_of(self.daemon.request("POST", "/v1/batches", good))["id"]
        wait_until(lambda: json_of(self.daemon.get(f"/v1/batches/{done}"))["state"] == "succeeded", "the batch")
        for id_ in (batch_id, done, NOBODY):
            self.check(seen, "/v1/batches/{id}", self.daemon.get(f"/v1/batches/{id_}"))
            animation = "/v1/batches/{id}/animation.apng"
            for query in ("", "?fps=0"):
                self.check(seen, animation, self.daemon.get(animation.format(id=id_) + query))
            archive = "/v1/batches/{id}/artifacts.tar"
            self.check(seen, archive, self.daemon.get(archive.format(id=id_)))
            for _ in range(2):
                for what in ("cancel", "retry"):
                    path = "/v1/batches/{id}/" + what
                    self.check(seen, path, self.daemon.request("POST", path.format(id=id_)), "POST")
        sizes = json_of(self.daemon.request("POST", "/v1/batches", {"scene": scene(), "sweep": {"/image/width": [8, 9]}}))["id"]
        wait_until(lambda: json_of(self.daemon.get(f"/v1/batches/{sizes}"))["state"] == "succeeded", "two sizes")
        self.check(seen, animation, self.daemon.get(animation.format(id=sizes)))
        for query in ("?limit=2", "?limit=0"):
            self.check(seen, "/v1/batches", self.daemon.get("/v1/batches" + query))
        for method, what in (("DELETE", ""), ("POST", "/cancel"), ("DELETE", ""), ("DELETE", "")):
            path = "/v1/batches/{id}" + what
            self.check(seen, path, self.daemon.request(method, path.format(id=batch_id)), method)

    def check_comparisons(self, seen):
        path = "/v1/compare"
        def compare(body, **headers):
            self.check(seen, path, self.daemon.request("POST", path, body, headers or None), "POST")
        jobs = [self.daemon.submit(scene(width)) for width in (16, 17)]
        expired = self.daemon.submit(scene(job={"expires_in": 1}))
        for job in jobs:
            self.daemon.wait_for_end(job)
        wait_until(lambda: self.daemon.job(expired)["expired"], "expiry")
        compare({"a": jobs[0], "b": jobs[0], "tolerance": 1, "heat": True})
        view = "/v1/jobs/{id}/view.png"
        tag = self.daemon.get(view.format(id=jobs[0])).headers["ETag"]
        for job, query, headers in ((jobs[0], "", {}), (jobs[0], "", {"If_None_Match": tag}), (jobs[0], "?max=1", {}), (NOBODY, "", {})):
            self.check(seen, view, self.daemon.get(view.format(id=job) + query, **headers))
        for b in (jobs[1], NOBODY, expired):
            compare({"a": jobs[0], "b": b})
        for body in ({}, b"{", b"[" * 100):
            compare(body)
        compare(b"{}", **{"Content-Type": "text/plain"})
        self.check_without_length(seen, "compareImages", "POST", path)

    def check_webhooks(self, seen):
        redeliver, test, result = "/v1/jobs/{id}/deliveries/{delivery}/redeliver", "/v1/webhooks/test", "/v1/webhooks/test/{id}"
        webhook = {"url": "http://127.0.0.1:9/"}
        self.check(seen, test, self.daemon.request("POST", test, webhook), "POST")
        job_id = self.daemon.submit(scene())
        with tempfile.NamedTemporaryFile("w") as secret:
            print("whsec_" + 32 * "A", file=secret, flush=True)
            with Daemon("--webhook-secret-file", secret.name) as daemon:
                self.check_without_length(seen, "testWebhook", "POST", test, daemon)
                for body in (webhook, {"url": "ftp://a"}, b"{", b"[" * 100):
                    self.check(seen, test, reply := daemon.request("POST", test, body), "POST")
                    for path in filter(None, (reply.headers["Location"], result.format(id=NOBODY))):
                        self.check(seen, result, daemon.get(path))
                self.check(seen, test, daemon.request("POST", test, b"{}", {"Content-Type": "text/plain"}), "POST")
                job = daemon.wait_for_end(daemon.submit(scene(job={"webhook": webhook})))["id"]
                deliveries = f"/v1/jobs/{job}/deliveries"
                attempted = lambda: (items := json_of(daemon.get(deliveries))["items"]) and items[0]["attempts"] and items[0]["id"]
                sent = wait_until(attempted, "an attempt")
                self.check(seen, "/v1/jobs/{id}/deliveries", daemon.get(deliveries))
                for delivery in (sent, NOBODY):
                    self.check(seen, redeliver, daemon.request("POST", redeliver.format(id=job, delivery=delivery)), "POST")
        self.check(seen, redeliver, self.daemon.request("POST", redeliver.format(id=job_id, delivery=NOBODY)), "POST")

    def check_unreadable_images(self, seen):
        """Problems of files whose bytes have changed, but not their number."""
        document = scene(600, 600, samples=2, output={"formats": ["png", "exr"]})
        batch = json_of(self.daemon.request("POST", "/v1/batches", {"scene": document, "frames": [{}]}))
        job = self.daemon.wait_for_end(json_of(self.daemon.get(batch["links"]["jobs"]))["items"][0]["id"])
        for artifact in job["artifacts"]:
            path = self.daemon.data / artifact["sha256"][:2] / artifact["sha256"]
            path.write_bytes(b"\0" * path.stat().st_size)
        for path, of, query in (("/v1/jobs/{id}/view.png", job, ""), ("/v1/jobs/{id}/preview", job, "?max=16"),
                                ("/v1/batches/{id}/animation.apng", batch, "?max=16")):
            reply = self.daemon.get(path.format(id=of["id"]) + query)
            self.assertEqual(reply.status, 422, path)
            self.check(seen, path, reply)
