"""Compares api/openapi.yaml with the daemon in both directions: every route is described and every description is a route;
every reply is described and every described reply occurs."""
import hashlib
import json
import re
import subprocess
import unittest
import xml.etree.ElementTree

import jsonschema

from tests.http.contract_parts import NOBODY, ContractParts
from tests.http.daemon import BIN, Daemon, json_of, long_scene, scene, wait_until

METHODS = ("get", "put", "post", "delete", "options", "head", "patch", "trace")

# Described replies that need a broken machine; their problem has the same schema as all others.
NEED_A_BROKEN_MACHINE = {
    ("changeJob", 503), ("getQueue", 503), ("getBatch", 503), ("cancelBatch", 503), ("getBatchArtifacts", 503), ("listJobs", 503), ("listBatches", 503), ("removeBatch", 503), ("getJob", 503), ("removeJob", 503), ("cancelJob", 503), ("getPng", 503), ("getPreviewPng", 503), ("getReferenceExr", 503), ("getPng16", 503),
    ("getExr", 503), ("getJpeg", 503), ("getHdr", 503), ("getWebp", 503), ("getTiff", 503), ("getMetrics", 503),
    ("findMissingAssets", 503), ("putAsset", 503), ("getAsset", 503), ("getDeliveries", 503), ("getMe", 503), ("getAnimation", 503), ("getView", 503), ("compareImages", 503), ("getHistory", 503), ("getStatus", 503), ("listNodes", 503), ("changeJobs", 503), ("getScene", 503), ("redeliver", 503), ("testWebhook", 503), ("getWebhookTest", 503), ("getMeasureJson", 503), ("getMeasureCsv", 503), ("getMeasureSvg", 503), ("getMeasurePng", 503), ("getPreview", 503),
}


class Contract(ContractParts, unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()
        cls.addClassCleanup(cls.daemon.__exit__)
        cls.document = json_of(cls.daemon.get("/openapi.json"))
        cls.operations = {}  # (METHOD, path template): operation
        for path, item in cls.document["paths"].items():
            for method in METHODS:
                if method in item:
                    operation = dict(item[method])
                    operation["parameters"] = item.get("parameters", []) + operation.get("parameters", [])
                    cls.operations[method.upper(), path] = operation

    def resolve(self, node):
        while "$ref" in node:
            self.assertTrue(node["$ref"].startswith("#/"), node)
            target = self.document
            for key in node["$ref"][2:].split("/"):
                target = target[key]
            node = target
        return node

    def nodes(self, node):
        yield node
        children = node.values() if isinstance(node, dict) else node if isinstance(node, list) else ()
        for child in children:
            yield from self.nodes(child)

    def test_document_is_valid(self):
        self.assertTrue(self.document["openapi"].startswith("3.1."))
        for node in self.nodes(self.document):
            if isinstance(node, dict) and "$ref" in node and node["$ref"] != "schemas/scene.schema.json":
                self.resolve(node)
        for schema in self.document["components"]["schemas"].values():
            jsonschema.Draft202012Validator.check_schema(schema)
        ids = [operation["operationId"] for operation in self.operations.values()]
        self.assertEqual(len(ids), len(set(ids)))
        for (_, path), operation in self.operations.items():
            declared = {self.resolve(p)["name"] for p in operation["parameters"] if self.resolve(p)["in"] == "path"}
            self.assertEqual(declared, set(re.findall(r"\{(\w+)\}", path)), path)

    def test_every_component_is_used(self):
        used = {node["$ref"] for node in self.nodes(self.document) if isinstance(node, dict) and "$ref" in node}
        for kind, components in self.document["components"].items():
            if kind == "securitySchemes":  # named, not referred to
                self.assertEqual(self.document["security"], [{}, *({name: []} for name in components)])
                continue
            for name in components:
                self.assertIn(f"#/components/{kind}/{name}", used)

    def test_routes_and_document_are_the_same(self):
        printed = subprocess.run([BIN / "list_routes"], check=True, capture_output=True, text=True).stdout
        routes = {}
        for line in printed.splitlines():
            method, path, query = line.split(" ")
            routes[method, path] = set(filter(None, query.split(",")))
        described = {}
        for key, operation in self.operations.items():
            described[key] = {self.resolve(p)["name"] for p in operation["parameters"] if self.resolve(p)["in"] == "query"}
        self.assertEqual(routes, described)

    # ---- replies

    def check(self, seen, template, reply, method="GET"):
        """Asserts that the operation at `template` describes `reply`."""
        operation = self.operations[method, template]
        self.assertIn(str(reply.status), operation["responses"], f"{method} {template}: {reply.body[:500]}")
        seen.add((operation["operationId"], reply.status))
        response = self.resolve(operation["responses"][str(reply.status)])
        for name, header in response.get("headers", {}).items():
            if header.get("required", True):
                self.assertIn(name, reply.headers, f"{method} {template} {reply.status}")
        self.assertIn("X-Request-Id", reply.headers)
        content = response.get("content")
        if not content:
            self.assertEqual(reply.body, b"", template)
            return
        media_type = reply.headers["Content-Type"].split(";")[0]
        self.assertIn(media_type, content)
        schema = content[media_type].get("schema")
        if schema and media_type.endswith("json"):
            schema = {**schema, "components": self.document["components"]}
            jsonschema.Draft202012Validator(schema).validate(json_of(reply))

    def check_without_length(self, seen, operation, method, path, daemon=None):
        with (daemon or self.daemon).socket() as connection:
            connection.sendall(f"{method} {path} HTTP/1.1\r\nHost: localhost\r\nIf-Match: *\r\n\r\n".encode())
            self.assertIn(b" 411 ", connection.makefile("rb").readline())
        seen.add((operation, 411))

    def test_replies_match_their_descriptions(self):
        seen = set()
        self.check_service(seen)
        self.check_submissions(seen)
        self.check_jobs(seen)
        self.check_images(seen)
        self.check_measurements(seen)
        self.check_previews(seen)
        self.check_unreadable_images(seen)
        self.check_events(seen)
        self.check_assets(seen)
        self.check_changes(seen)
        self.check_expired_jobs(seen)
        self.check_batches(seen)
        self.check_comparisons(seen)
        self.check_webhooks(seen)
        self.check_refusals_of_a_busy_daemon(seen)
        described = {(operation["operationId"], int(status))
                     for operation in self.operations.values() for status in operation["responses"]}
        bugs = {(operation["operationId"], 500) for operation in self.operations.values()}
        self.assertLessEqual(bugs, described)
        redirects = {reply for reply in described if reply[1] == 307}  # of a bucket: object_store_test.py
        self.assertEqual(described - seen - bugs - redirects, NEED_A_BROKEN_MACHINE)

    def check_service(self, seen):
        for path in ("/", "/docs", "/docs/scene", "/openapi.json", "/schemas/scene.schema.json", "/v1/version", "/v1/me", "/v1/status"):
            self.check(seen, path, self.daemon.get(path))
        page = self.daemon.get("/", Accept="text/html")
        self.check(seen, "/", page)
        self.check(seen, "/", self.daemon.get("/", Accept="text/html", If_None_Match=page.headers["ETag"]))
        script = re.search(r'"(/ui/[^"]+\.js)"', page.body.decode()).group(1)
        for path, headers in ((script, {}), (script, {"If_None_Match": "*"}), ("/ui/0/main.js", {})):
            self.check(seen, "/ui/{tree}/{file}", self.daemon.get(path, **headers))
        self.check(seen, "/v1/status", self.daemon.get("/v1/status?history=maybe"))
        for path in ("/docs/scene", "/docs"):
            reply = self.daemon.get(path)
            self.check(seen, path, self.daemon.get(path, If_None_Match=reply.headers["ETag"]))
            page = reply.body.decode()
            xml.etree.ElementTree.fromstring(re.sub(r"<meta [^>]*>|<!doctype html>", "", page))  # well-formed
        for method, path in self.operations:
            self.assertIn(f"{method} {path}<", page)
        self.check(seen, "/healthz", self.daemon.health("/healthz"))
        self.check(seen, "/metrics", self.daemon.health("/metrics"))
        wait_until(lambda: self.daemon.health("/readyz").status == 200, "readiness")
        self.check(seen, "/readyz", self.daemon.health("/readyz"))

    def check_submissions(self, seen):
        bodies = {
            "good": json.dumps(scene()), "bad": json.dumps(scene(colour="red")), "not JSON": "{", "deep": "[" * 100,
        }
        bodies_of = {"/v1/measure": {**bodies, "good": json.dumps({"scene": scene(job={"run_after": "2099-01-01T00:00:00Z"})})}}
        for path in ("/v1/jobs", "/v1/jobs/validate", "/v1/render", "/v1/measure"):
            for body in bodies_of.get(path, bodies).values():
                self.check(seen, path, self.daemon.request("POST", path, body.encode()), "POST")
            other = self.daemon.request("POST", path, b"{}", {"Content-Type": "text/plain"})
            self.check(seen, path, other, "POST")
            self.check(seen, path, self.daemon.request("POST", path), "POST")
            self.check_without_length(seen, self.operations["POST", path]["operationId"], "POST", path)
        waited = self.daemon.request("POST", "/v1/jobs", scene(), {"Prefer": "wait=60"})
        self.check(seen, "/v1/jobs", waited, "POST")
        unacceptable = self.daemon.request("POST", "/v1/render", scene(), {"Accept": "image/gif"})
        self.check(seen, "/v1/render", unacceptable, "POST")
        with Daemon("--jobs", "1") as daemon:
            daemon.start_job()
            for status, end_it in ((409, lambda job: daemon.request("POST", job["links"]["cancel"])),
                                   (404, lambda job: daemon.request("DELETE", job["links"]["self"]))):
                reply = self.render_until(daemon, end_it)
                self.assertEqual(reply.status, status)
                self.check(seen, "/v1/render", reply, "POST")

    @staticmethod
    def render_until(daemon, end_it):
        """Returns the reply to a render during which `end_it(job)` ends the queued job."""
        answer = daemon.in_background("POST", "/v1/render", scene(name="waits"))
        path = "/v1/jobs?state=queued&q=waits"
        end_it(wait_until(lambda: json_of(daemon.request("GET", path))["items"], "the job")[0])
        return answer()

    def check_jobs(self, seen):
        job_id = self.daemon.submit(scene(job={"labels": {"a": "b"}}))
        self.check(seen, "/v1/jobs/{id}/deliveries", self.daemon.get(f"/v1/jobs/{job_id}/deliveries"))
        self.check(seen, "/v1/jobs/{id}/scene", self.daemon.get(f"/v1/jobs/{job_id}/scene"))
        self.check(seen, "/v1/jobs/{id}/history", self.daemon.get(f"/v1/jobs/{job_id}/history"))
        for path in ("/v1/jobs/{id}", "/v1/jobs/{id}/cancel", "/v1/jobs/{id}/deliveries", "/v1/jobs/{id}/scene", "/v1/jobs/{id}/history"):
            method = "POST" if path.endswith("cancel") else "GET"
            self.check(seen, path, self.daemon.request(method, path.format(id=NOBODY)), method)
        self.daemon.wait_for_end(job_id)
        path = f"/v1/jobs/{job_id}"
        reply = self.daemon.get(path)
        self.check(seen, "/v1/jobs/{id}", reply)
        self.check(seen, "/v1/jobs/{id}", self.daemon.get(path, If_None_Match=reply.headers["ETag"]))
        self.check(seen, "/v1/jobs/{id}/cancel", self.daemon.request("POST", path + "/cancel"), "POST")
        self.check(seen, "/v1/jobs/{id}", self.daemon.get(path + "?wait=soon"))
        self.check(seen, "/v1/jobs", self.daemon.get("/v1/jobs?limit=1"))
        self.check(seen, "/v1/jobs", self.daemon.get("/v1/jobs?nonsense=1"))
        for _ in range(2):
            self.check(seen, "/v1/jobs/{id}", self.daemon.request("DELETE", path), "DELETE")
        running = self.daemon.start_job()
        self.check(seen, "/v1/jobs/{id}", self.daemon.get(f"/v1/jobs/{running}"))
        self.check(seen, "/v1/jobs/{id}", self.daemon.request("DELETE", f"/v1/jobs/{running}"), "DELETE")
        self.check(seen, "/v1/jobs/{id}/cancel", self.daemon.request("POST", f"/v1/jobs/{running}/cancel"), "POST")

    def check_changes(self, seen):
        path = f"/v1/jobs/{self.daemon.submit(scene())}"
        self.daemon.wait_for_end(path.split("/")[-1])
        def change(body, template="/v1/jobs/{id}", url=path, **headers):
            headers = {"If-Match": "*", **{name.replace("_", "-"): value for name, value in headers.items()}}
            headers = {name: value for name, value in headers.items() if value}
            self.check(seen, template, self.daemon.request("PATCH", url, body, headers), "PATCH")
        for body in (b'{"name": "new"}', b'{"priority": 1}', b'{"priority": -1}', b"{", b"[" * 100):
            change(body)
        change(b"{}", Content_Type="text/plain")
        change(b"{}", If_Match='"0-0"')
        change(b"{}", If_Match=None)
        change(b"{}", url=f"/v1/jobs/{NOBODY}")
        self.check_without_length(seen, "changeJob", "PATCH", path)
        retry = "/v1/jobs/{id}/retry"
        self.check(seen, retry, self.daemon.request("POST", path + "/retry"), "POST")
        self.check(seen, retry, self.daemon.request("POST", retry.format(id=NOBODY)), "POST")
        cancelled = self.daemon.submit(scene(job={"run_after": "2099-01-01T00:00:00Z"}))
        self.daemon.request("POST", f"/v1/jobs/{cancelled}/cancel")
        self.check(seen, retry, self.daemon.request("POST", retry.format(id=cancelled)), "POST")
        self.check(seen, "/v1/queue", self.daemon.get("/v1/queue"))
        self.check(seen, "/v1/nodes", self.daemon.get("/v1/nodes"))
        bulk = "/v1/jobs/bulk"
        for body in ({"action": "cancel", "ids": [NOBODY, cancelled]}, {"action": "cancel"}, b"{", b"[" * 100):
            self.check(seen, bulk, self.daemon.request("POST", bulk, body), "POST")
        self.check(seen, bulk, self.daemon.request("POST", bulk, b"{}", {"Content-Type": "text/plain"}), "POST")
        self.check_without_length(seen, "changeJobs", "POST", bulk)
        document = scene(name="twice", job={"cache": "use"})
        self.daemon.wait_for_end(self.daemon.submit(document))
        self.check(seen, "/v1/jobs", self.daemon.request("POST", "/v1/jobs", document), "POST")

    def check_expired_jobs(self, seen):
        done = self.daemon.submit(scene(job={"expires_in": 1}))
        key = {"Idempotency-Key": "expires"}
        brief = scene(job={"expires_in": 1})
        brief_id = self.daemon.request("POST", "/v1/render", brief, key).headers["Content-Location"].split("/")[3]
        cancelled = self.daemon.submit(scene(job={"expires_in": 1, "run_after": "2099-01-01T00:00:00Z"}))
        self.daemon.request("POST", f"/v1/jobs/{cancelled}/cancel")
        wait_until(lambda: self.daemon.job(done)["expired"] and self.daemon.job(cancelled)["expired"], "expiry")
        for path in self.document["paths"]:
            if path.startswith(("/v1/jobs/{id}/image.", "/v1/jobs/{id}/measure.", "/v1/jobs/{id}/preview.", "/v1/jobs/{id}/reference.")) or path.endswith(("/preview", "/scene", "/view.png")):
                self.check(seen, path, self.daemon.get(path.format(id=done)))
        wait_until(lambda: self.daemon.job(brief_id)["expired"], "expiry")
        self.check(seen, "/v1/render", self.daemon.request("POST", "/v1/render", brief, key), "POST")
        change = self.daemon.request("PATCH", f"/v1/jobs/{done}", {"expires_at": None}, {"If-Match": "*"})
        self.check(seen, "/v1/jobs/{id}", change, "PATCH")
        self.check(seen, "/v1/jobs/{id}/retry", self.daemon.request("POST", f"/v1/jobs/{cancelled}/retry"), "POST")

    def check_images(self, seen):
        job = self.daemon.wait_for_end(self.daemon.submit(scene(output={
            "formats": ["png", "png16", "exr", "jpg", "hdr", "webp", "tiff"]})))
        self.check_artifacts(seen, job)

    def check_measurements(self, seen):
        body = {"scene": scene(), "settings": {"parameters": ["samples"], "reference_samples": 16}}
        reply = self.daemon.request("POST", "/v1/measure", body, {"Prefer": "wait=60"})
        self.check(seen, "/v1/measure", reply, "POST")
        self.check_artifacts(seen, self.daemon.wait_for_end(json_of(reply)["id"]))

    def check_previews(self, seen):
        template = "/v1/jobs/{id}/preview"
        waiting = self.daemon.submit(scene(job={"run_after": "2099-01-01T00:00:00Z"}))
        done = self.daemon.submit(scene())
        self.daemon.wait_for_end(done)
        for job_id in (waiting, done, NOBODY):
            self.check(seen, template, self.daemon.get(template.format(id=job_id)))
        self.daemon.request("POST", f"/v1/jobs/{waiting}/cancel")
        running = template.format(id=self.daemon.submit(long_scene()))
        self.check(seen, template, self.daemon.get(running + "?max=none"))
        def not_modified():
            first = self.daemon.get(running)
            again = self.daemon.get(running, If_None_Match=first.headers["ETag"] or "none")
            for reply in (first, again):
                self.check(seen, template, reply)
            return again.status == 304
        wait_until(not_modified, "the same preview twice")
        self.daemon.request("POST", running.replace("preview", "cancel"))
        self.check_artifacts(seen, self.daemon.cancel_in_work(long_scene()))

    def check_artifacts(self, seen, job):
        for artifact in job["artifacts"]:
            template = "/v1/jobs/{id}/" + artifact["name"]
            whole = self.daemon.get(artifact["url"])
            self.check(seen, template, whole)
            self.check(seen, template, self.daemon.get(artifact["url"], Range="bytes=0-3"))
            self.check(seen, template, self.daemon.get(artifact["url"], Range="bytes=99999999-"))
            self.check(seen, template, self.daemon.get(artifact["url"], If_None_Match=whole.headers["ETag"]))
            self.check(seen, template, self.daemon.get(template.format(id=NOBODY)))

    def check_events(self, seen):
        for query in (f"batch={NOBODY}", "job=1"):
            self.check(seen, "/v1/events", self.daemon.get(f"/v1/events?{query}"))
        with Daemon("--streams", "1") as daemon:
            job = daemon.wait_for_end(daemon.submit(scene()))
            path = job["links"]["events"]
            schema = {"$ref": "#/components/schemas/Event", "components": self.document["components"]}

            def nothing_is_left_to_report():
                reply = daemon.get(path)
                self.check(seen, "/v1/jobs/{id}/events", reply)
                fields = dict(line.split(": ", 1) for line in reply.body.decode().splitlines() if line)
                jsonschema.Draft202012Validator(schema).validate(json.loads(fields["data"]))
                reply = daemon.get(path, Last_Event_ID=fields["id"])
                self.check(seen, "/v1/jobs/{id}/events", reply)
                return reply.status == 204

            # A job seen to have ended before that was, an event reports its end once more.
            wait_until(nothing_is_left_to_report, "the end of the job's events")
            self.check(seen, "/v1/jobs/{id}/events", daemon.get(f"/v1/jobs/{NOBODY}/events"))
            self.check(seen, "/v1/events", daemon.request("HEAD", "/v1/events"))
            with daemon.socket() as connection:
                connection.sendall(b"GET /v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n")
                connection.recv(15)
                for template in ("/v1/events", "/v1/jobs/{id}/events"):
                    self.check(seen, template, daemon.get(template.format(id=job["id"])))

    def check_assets(self, seen):
        template, path = "/v1/assets/{sha256}", "/v1/assets/" + hashlib.sha256(b"abc").hexdigest()
        for body in (b"abd", b"abc", b"abc"):
            self.check(seen, template, self.daemon.request("PUT", path, body), "PUT")
        self.check_without_length(seen, "putAsset", "PUT", path)
        with self.daemon.socket() as connection:
            connection.sendall(f"PUT {path} HTTP/1.1\r\nHost: localhost\r\nContent-Length: 256000001\r\n\r\n".encode())
            self.assertIn(b" 413 ", connection.makefile("rb").readline())
            seen.add(("putAsset", 413))
        reply = self.daemon.get(path)
        self.check(seen, template, reply)
        self.check(seen, template, self.daemon.get(path, If_None_Match=reply.headers["ETag"]))
        self.check(seen, template, self.daemon.get("/v1/assets/" + "0" * 64))
        for question, name, good in (("/v1/assets/missing", "findMissingAssets", {"sha256": ["0" * 64]}),
                                     ("/v1/tickets", "createTicket", {"path": "/v1/jobs?limit=1"})):
            for body in (good, {}, b"{", b"[" * 100):
                self.check(seen, question, self.daemon.request("POST", question, body), "POST")
            self.check(seen, question, self.daemon.request("POST", question, b"{}", {"Content-Type": "text/plain"}), "POST")
            self.check_without_length(seen, name, "POST", question)

    def check_refusals_of_a_busy_daemon(self, seen):
        with Daemon("--queued-jobs", "1", "--jobs", "1", "--render-wait-s", "0") as daemon:
            running = daemon.start_job()
            batch = {"scene": scene(job={"run_after": "2099-01-01T00:00:00Z"}), "frames": [{}]}
            batch_id = json_of(daemon.request("POST", "/v1/batches", batch))["id"]
            daemon.request("POST", f"/v1/batches/{batch_id}/cancel")
            self.check(seen, "/v1/render", daemon.request("POST", "/v1/render", scene()), "POST")
            measurement = {"scene": scene()}
            for path, body in (("/v1/jobs", scene()), ("/v1/render", scene()), ("/v1/measure", measurement)):
                self.check(seen, path, daemon.request("POST", path, body), "POST")
            daemon.process.terminate()
            wait_until(lambda: daemon.health("/readyz").status == 503, "draining")
            self.check(seen, "/readyz", daemon.health("/readyz"))
            self.check(seen, "/v1/jobs", daemon.request("POST", "/v1/jobs", scene()), "POST")
            reply = daemon.request("POST", f"/v1/jobs/{running}/retry")
            self.check(seen, "/v1/jobs/{id}/retry", reply, "POST")
            batch = {"scene": scene(), "frames": [{}]}
            self.check(seen, "/v1/batches", daemon.request("POST", "/v1/batches", batch), "POST")
            reply = daemon.request("POST", f"/v1/batches/{batch_id}/retry")
            self.check(seen, "/v1/batches/{id}/retry", reply, "POST")
        with Daemon("--key-queued-jobs", "1") as daemon:
            daemon.submit(scene(job={"run_after": "2099-01-01T00:00:00Z"}))
            for path, body in (("/v1/jobs", scene()), ("/v1/render", scene()), ("/v1/measure", measurement)):
                self.check(seen, path, daemon.request("POST", path, body), "POST")
            batch = {"scene": scene(), "frames": [{}]}
            self.check(seen, "/v1/batches", daemon.request("POST", "/v1/batches", batch), "POST")


if __name__ == "__main__":
    unittest.main()
