"""Replies of batches and webhooks, for the comparison with api/openapi.yaml."""
import tempfile

from tests.http.daemon import FAR, NOBODY, Daemon, json_of, scene, wait_until


class ContractParts:
    """Part of a TestCase with `daemon` and the functions of Contract that check replies."""

    def check_batches(self):
        self.post_each("/v1/batches", {"scene": scene(), "frames": [{}]}, {"scene": {}, "frames": []})
        batch = "/v1/batches/{id}"
        body = {"scene": scene(job={"run_after": FAR}), "sweep": {"/camera/fov": [30, 40]}}
        waiting = json_of(self.daemon.request("POST", "/v1/batches", body))["id"]
        done = self.daemon.finished_batch(scene=scene(), frames=[{}, {"name": "second"}])["id"]
        for id_ in (waiting, done, NOBODY):
            for what, query in (("", ""), ("/animation.apng", ""), ("/animation.apng", "?fps=0"), ("/artifacts.tar", "")):
                self.get(batch + what, query, id=id_)
            for what in ("/cancel", "/retry", "/cancel", "/retry"):
                self.post(batch + what, id=id_)
        self.get(batch + "/animation.apng", id=self.daemon.finished_batch(scene=scene(), sweep={"/image/width": [8, 9]})["id"])
        for query in ("?limit=2", "?limit=0"):
            self.get("/v1/batches", query)
        for method, what in (("DELETE", ""), ("POST", "/cancel"), ("DELETE", ""), ("DELETE", "")):
            self.send(method, batch + what, id=waiting)

    def check_comparisons(self):
        expired = self.daemon.submit(scene(job={"expires_in": 1}))
        jobs = [self.daemon.rendered(scene(width))["id"] for width in (16, 17)]
        wait_until(lambda: self.daemon.job(expired)["expired"], "expiry")
        same, missing = ({"a": jobs[0], "b": b} for b in (jobs[0], NOBODY))
        self.post_each("/v1/compare", {**same, "tolerance": 1, "heat": True}, {**same, "b": jobs[1]}, missing, {**same, "b": expired}, {})
        view = "/v1/jobs/{id}/view.png"
        self.get_again(view, id=jobs[0])
        self.get(view, "?max=1", id=jobs[0])
        self.get(view, id=NOBODY)

    def check_webhooks(self):
        redeliver, test, result = "/v1/jobs/{id}/deliveries/{delivery}/redeliver", "/v1/webhooks/test", "/v1/webhooks/test/{id}"
        webhook = {"url": "http://127.0.0.1:9/"}
        self.post(test, webhook)
        self.post(redeliver, id=self.daemon.submit(scene()), delivery=NOBODY)
        with tempfile.NamedTemporaryFile("w") as secret:
            print("whsec_" + 32 * "A", file=secret, flush=True)
            with Daemon("--webhook-secret-file", secret.name) as daemon:
                self.post_each(test, {"url": "ftp://a"}, daemon=daemon)
                sent = self.post(test, webhook, daemon=daemon).headers["Location"].rpartition("/")[2]
                for id_ in (sent, NOBODY):
                    self.get(result, daemon=daemon, id=id_)
                job = daemon.rendered(scene(job={"webhook": webhook}))
                deliveries = lambda: json_of(self.get("/v1/jobs/{id}/deliveries", daemon=daemon, id=job["id"]))["items"]
                sent = wait_until(lambda: (items := deliveries()) and items[0]["attempts"] and items[0]["id"], "an attempt")
                for delivery in (sent, NOBODY):
                    self.post(redeliver, daemon=daemon, id=job["id"], delivery=delivery)

    def check_unreadable_images(self):
        """Problems of files whose bytes have changed, but not their number."""
        document = scene(600, 600, samples=2, output={"formats": ["png", "exr"]})
        batch = self.daemon.finished_batch(scene=document, frames=[{}])
        (job,) = json_of(self.daemon.get(batch["links"]["jobs"]))["items"]
        for artifact in job["artifacts"]:
            path = self.daemon.data / artifact["sha256"][:2] / artifact["sha256"]
            path.write_bytes(b"\0" * path.stat().st_size)
        for path, id_, query in (("/v1/jobs/{id}/view.png", job["id"], ""), ("/v1/jobs/{id}/preview", job["id"], "?max=16"),
                                 ("/v1/batches/{id}/animation.apng", batch["id"], "?max=16")):
            self.assertEqual(self.get(path, query, id=id_).status, 422, path)
