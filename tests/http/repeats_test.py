"""Repeated requests: Idempotency-Key and the result cache."""

from tests.http.daemon import OneDaemon, json_of, scene


class IdempotentSubmission(OneDaemon):
    def submit(self, document, key, path="/v1/jobs"):
        return self.daemon.request("POST", path, document, {"Idempotency-Key": key})

    def test_repeats_the_first_reply(self):
        first = self.submit(scene(name="once"), "key-1")
        self.assertEqual((first.status, first.headers["Idempotent-Replayed"]), (202, None))
        job_id = json_of(first)["id"]
        self.daemon.wait_for_end(job_id)
        for _ in range(2):
            again = self.submit(scene(name="once"), "key-1")
            self.assertEqual((again.status, again.body, again.headers["Location"], again.headers["Idempotent-Replayed"]),
                             (202, first.body, first.headers["Location"], "true"))
        self.daemon.request("DELETE", f"/v1/jobs/{job_id}")
        self.assertEqual(self.submit(scene(name="once"), "key-1").body, first.body)
        self.assertEqual(json_of(self.daemon.get("/v1/jobs?q=once"))["items"], [])

    def test_with_another_document_is_refused(self):
        self.submit(scene(name="one"), "key-2")
        self.assert_problem(self.submit(scene(name="two"), "key-2"), 422, "idempotency_key_reused")

    def test_after_a_rejection_counts_as_the_first(self):
        self.assert_problem(self.submit(scene(colour="red"), "key-4"), 422, "bad_scene")
        self.assertEqual(self.submit(scene(), "key-4").status, 202)

    def test_rejects_invalid_keys(self):
        for key in ("", "a b", "x" * 256):
            self.assert_problem(self.submit(scene(), key), 400, "invalid_header")
        self.assertEqual(self.submit(scene(), "x" * 255).status, 202)


class IdempotentRendering(OneDaemon):
    def render(self, document, key, **headers):
        return self.daemon.request("POST", "/v1/render", document, {"Idempotency-Key": key, **headers})

    def test_replies_with_the_image_of_the_first_job(self):
        document = scene(name="rendered once")
        first, again = self.render(document, "a"), self.render(document, "a")
        self.assertEqual((first.headers["Idempotent-Replayed"], again.headers["Idempotent-Replayed"]), (None, "true"))
        self.assertEqual((again.status, again.headers["Content-Location"], again.body), (200, first.headers["Content-Location"], first.body))

    def test_waits_for_the_running_job(self):
        document = scene(600, 400, samples=64, name="under way")
        answers = [self.daemon.in_background("POST", "/v1/render", document, {"Idempotency-Key": "b"}) for _ in range(4)]
        replies = [answer.result() for answer in answers]
        self.assertEqual({(reply.status, reply.body) for reply in replies}, {(200, replies[0].body)})
        self.assertEqual(len(json_of(self.daemon.get("/v1/jobs?q=under%20way"))["items"]), 1)
        self.assertEqual(sum(reply.headers["Idempotent-Replayed"] == "true" for reply in replies), 3)

    def test_has_no_image_after_the_removal_of_the_job(self):
        document = scene(name="removed")
        path = self.render(document, "d").headers["Content-Location"].rsplit("/", 1)[0]
        self.assertEqual(self.daemon.request("DELETE", path).status, 204)
        self.assert_problem(self.render(document, "d"), 404, "job_not_found")


class ResultCache(OneDaemon):
    def submit(self, document):
        reply = self.daemon.request("POST", "/v1/jobs", document)
        self.assertIn(reply.status, (200, 202), reply.body)
        self.assertEqual(reply.headers["X-Cache"], "hit" if reply.status == 200 else None)
        job = json_of(reply)
        self.assertEqual(job["state"] == "succeeded", reply.status == 200)
        self.daemon.wait_for_end(job["id"])
        return reply.status == 200

    def test_renders_equal_images_once(self):
        document = scene(name="cached", job={"cache": "use", "labels": {"n": "1"}})
        self.assertFalse(self.submit(document))
        reply = self.daemon.request("POST", "/v1/jobs", {**dict(reversed(document.items())), "job": {"name": "other"}})
        self.assertEqual((reply.status, reply.headers["X-Cache"]), (200, "hit"))
        job = json_of(reply)
        self.assertEqual((job["name"], job["labels"], job["progress"]), ("other", {}, 1))
        (first,) = json_of(self.daemon.get("/v1/jobs?q=cached"))["items"]
        self.daemon.request("DELETE", first["links"]["self"])
        image = self.daemon.get(job["links"]["image"])
        self.assertEqual((image.status, image.headers["ETag"]), (200, f'"{first["artifacts"][0]["sha256"]}"'), "it has the image of its own")
        self.assertTrue(self.submit(document))

    def test_can_be_bypassed_by_the_job(self):
        document = scene(name="asks")
        self.assertFalse(self.submit({**document, "job": {"cache": "off"}}))
        self.assertFalse(self.submit({**document, "job": {"cache": "refresh"}}), "off leaves nothing for others")
        self.assertFalse(self.submit({**document, "job": {"cache": "refresh"}}))
        self.assertTrue(self.submit({**document, "job": {}}), "refresh leaves its image for others")
        self.assertFalse(self.submit({**document, "job": {"cache": "off"}}))

    def test_excludes_time_budgets(self):
        document = scene(name="budget", accuracy={"time_budget_ms": 50}, job={"cache": "use"})
        self.assertFalse(self.submit(document))
        self.assertFalse(self.submit(document))

    def test_answers_a_render_at_once(self):
        document = scene(name="render", job={"cache": "use"})
        first, second = (self.daemon.request("POST", "/v1/render", document) for _ in range(2))
        self.assertEqual((first.status, first.headers["X-Cache"]), (200, None))
        self.assertEqual((second.status, second.headers["X-Cache"]), (200, "hit"))
        self.assertEqual(first.body, second.body)
        other = self.daemon.request("POST", "/v1/render", document, {"Accept": "image/x-exr"})
        self.assertEqual((other.headers["X-Cache"], other.headers["Content-Type"]), (None, "image/x-exr"))
