"""Compares api/openapi.yaml with the daemon in both directions: every route is described and every description is a route;
every reply is described and every described reply occurs."""
import json
import re
import subprocess
import xml.etree.ElementTree

import jsonschema

from tests.http.contract_parts import ContractParts
from tests.http.daemon import BIN, FAR, NOBODY, Daemon, OneDaemon, json_of, long_scene, scene, sha256, wait_until

METHODS = ("get", "put", "post", "delete", "options", "head", "patch", "trace")

# Operations whose reply 503 needs a broken machine; its problem has the same schema as all others.
NEED_A_BROKEN_MACHINE = """
    cancelBatch cancelJob changeJob changeJobs compareImages findMissingAssets getAnimation getAsset getBatch getBatchArtifacts getDeliveries getExr
    getHdr getHistory getJob getJpeg getMe getMeasureCsv getMeasureJson getMeasurePng getMeasureSvg getMetrics getPng getPng16 getPreview getPreviewPng
    getQueue getReferenceExr getScene getStatus getTiff getView getWebhookTest getWebp listBatches listJobs listNodes makeLiveForm putAsset redeliver
    removeBatch removeJob testWebhook""".split()


class Contract(ContractParts, OneDaemon):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.document = json_of(cls.daemon.get("/openapi.json"))
        cls.operations = {}  # (METHOD, path template): operation
        for path, item in cls.document["paths"].items():
            for method in METHODS:
                if method in item:
                    operation = dict(item[method])
                    operation["parameters"] = item.get("parameters", []) + operation.get("parameters", [])
                    cls.operations[method.upper(), path] = operation

    def setUp(self):
        self.seen = set()  # (operation, status) of the replies so far

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

    def check(self, template, reply, method="GET"):
        """Asserts that the operation at `template` describes `reply`."""
        operation = self.operations[method, template]
        self.assertIn(str(reply.status), operation["responses"], f"{method} {template}: {reply.body[:500]}")
        self.seen.add((operation["operationId"], reply.status))
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

    def send(self, method, template, body=None, headers=None, query="", daemon=None, **place):
        """Checks and returns the reply of the operation at `template`, whose {id} and the like are in `place`."""
        reply = (daemon or self.daemon).request(method, template.format(**place) + query, body, headers)
        self.check(template, reply, method)
        return reply

    def get(self, template, query="", headers=None, daemon=None, **place):
        return self.send("GET", template, None, headers, query, daemon, **place)

    def post(self, template, body=None, headers=None, daemon=None, **place):
        return self.send("POST", template, body, headers, daemon=daemon, **place)

    def get_again(self, template, query="", **place):
        """The reply, and another one to a client that has it."""
        reply = self.get(template, query, **place)
        self.get(template, query, {"If-None-Match": reply.headers["ETag"]}, **place)
        return reply

    def refused_by_head(self, status, method, template, headers="", daemon=None, **place):
        """Checks the status of a request that is answered before its body."""
        with (daemon or self.daemon).socket() as connection:
            connection.sendall(f"{method} {template.format(**place)} HTTP/1.1\r\nHost: localhost\r\n{headers}\r\n".encode())
            self.assertIn(f" {status} ".encode(), connection.makefile("rb").readline())
        self.seen.add((self.operations[method, template]["operationId"], status))

    def post_each(self, template, *bodies, daemon=None):
        """Posts the bodies, and those that every operation refuses: no JSON, too deep, of another type, without length."""
        for body in (*bodies, b"{", b"[" * 100):
            self.post(template, body, daemon=daemon)
        self.post(template, b"{}", {"Content-Type": "text/plain"}, daemon)
        self.refused_by_head(411, "POST", template, daemon=daemon)

    def test_replies_match_their_descriptions(self):
        for check in (self.check_service, self.check_submissions, self.check_jobs, self.check_images, self.check_measurements,
                      self.check_previews, self.check_unreadable_images, self.check_events, self.check_assets, self.check_changes,
                      self.check_expired_jobs, self.check_batches, self.check_comparisons, self.check_webhooks,
                      self.check_refusals_of_a_busy_daemon):
            with self.subTest(check.__name__):
                check()
        described = {(operation["operationId"], int(status))
                     for operation in self.operations.values() for status in operation["responses"]}
        bugs = {(operation["operationId"], 500) for operation in self.operations.values()}
        self.assertLessEqual(bugs, described)
        redirects = {reply for reply in described if reply[1] == 307}  # of a bucket: object_store_test.py
        self.assertEqual(described - self.seen - bugs - redirects, {(name, 503) for name in NEED_A_BROKEN_MACHINE})

    def check_service(self):
        for path in ("/", "/openapi.json", "/schemas/scene.schema.json", "/v1/version", "/v1/me", "/v1/status"):
            self.get(path)
        page = self.get("/", headers={"Accept": "text/html"})
        self.get("/", headers={"Accept": "text/html", "If-None-Match": page.headers["ETag"]})
        tree, file = re.search(r'"/ui/([^/"]+)/([^"]+\.js)"', page.body.decode()).groups()
        for directory, headers in ((tree, {}), (tree, {"If-None-Match": "*"}), ("0", {})):
            self.get("/ui/{tree}/{file}", headers=headers, tree=directory, file=file)
        self.get("/v1/status", "?history=maybe")
        for path in ("/docs/scene", "/docs"):
            page = self.get_again(path).body.decode()
            xml.etree.ElementTree.fromstring(re.sub(r"<meta [^>]*>|<!doctype html>", "", page))  # well-formed
        for method, path in self.operations:
            self.assertIn(f"{method} {path}<", page)
        wait_until(lambda: self.daemon.health("/readyz").status == 200, "readiness")
        for path in ("/healthz", "/metrics", "/readyz"):
            self.check(path, self.daemon.health(path))

    def check_submissions(self):
        for path in ("/v1/jobs", "/v1/jobs/validate", "/v1/live", "/v1/render", "/v1/measure"):
            good = {"scene": scene(job={"run_after": FAR})} if path == "/v1/measure" else scene()
            self.post_each(path, good, scene(colour="red"), None)
        self.post("/v1/jobs", scene(), {"Prefer": "wait=60"})
        self.post("/v1/render", scene(), {"Accept": "image/gif"})
        with Daemon("--jobs", "1") as daemon:
            daemon.start_job()
            for status, end_it in ((409, lambda job: daemon.request("POST", job["links"]["cancel"])),
                                   (404, lambda job: daemon.request("DELETE", job["links"]["self"]))):
                reply = self.render_until(daemon, end_it)
                self.assertEqual(reply.status, status)
                self.check("/v1/render", reply, "POST")

    @staticmethod
    def render_until(daemon, end_it):
        """Returns the reply to a render during which `end_it(job)` ends the queued job."""
        answer = daemon.in_background("POST", "/v1/render", scene(name="waits"))
        end_it(wait_until(lambda: json_of(daemon.get("/v1/jobs?state=queued&q=waits"))["items"], "the job")[0])
        return answer.result()

    def check_jobs(self):
        job = self.daemon.submit(scene(job={"labels": {"a": "b"}}))
        for what in ("deliveries", "scene", "history"):
            for id_ in (job, NOBODY):
                self.get("/v1/jobs/{id}/" + what, id=id_)
        self.get("/v1/jobs/{id}", id=NOBODY)
        self.post("/v1/jobs/{id}/cancel", id=NOBODY)
        self.daemon.wait_for_end(job)
        self.get_again("/v1/jobs/{id}", id=job)
        self.post("/v1/jobs/{id}/cancel", id=job)
        self.get("/v1/jobs/{id}", "?wait=soon", id=job)
        self.get("/v1/jobs", "?limit=1")
        self.get("/v1/jobs", "?nonsense=1")
        running = self.daemon.start_job()
        self.get("/v1/jobs/{id}", id=running)
        for id_ in (job, job, running):
            self.send("DELETE", "/v1/jobs/{id}", id=id_)
        self.post("/v1/jobs/{id}/cancel", id=running)

    def check_changes(self):
        job = self.daemon.rendered(scene())["id"]
        for body, headers, id_ in (({"name": "new"}, {}, job), ({"priority": 1}, {}, job), ({"priority": -1}, {}, job), (b"{", {}, job),
                                   (b"[" * 100, {}, job), (b"{}", {"Content-Type": "text/plain"}, job), (b"{}", {"If-Match": '"0-0"'}, job),
                                   (b"{}", {}, NOBODY)):
            self.send("PATCH", "/v1/jobs/{id}", body, {"If-Match": "*", **headers}, id=id_)
        self.send("PATCH", "/v1/jobs/{id}", b"{}", id=job)
        self.refused_by_head(411, "PATCH", "/v1/jobs/{id}", "If-Match: *\r\n", id=job)
        cancelled = self.daemon.submit(scene(job={"run_after": FAR}))
        self.daemon.request("POST", f"/v1/jobs/{cancelled}/cancel")
        for id_ in (job, NOBODY, cancelled):
            self.post("/v1/jobs/{id}/retry", id=id_)
        self.get("/v1/queue")
        self.get("/v1/nodes")
        self.post_each("/v1/jobs/bulk", {"action": "cancel", "ids": [NOBODY, cancelled]}, {"action": "cancel"})
        document = scene(name="twice", job={"cache": "use"})
        self.daemon.rendered(document)
        self.post("/v1/jobs", document)

    def check_expired_jobs(self):
        brief, key = scene(job={"expires_in": 1}), {"Idempotency-Key": "expires"}
        done = self.daemon.submit(brief)
        rendered = self.daemon.request("POST", "/v1/render", brief, key).headers["Content-Location"].split("/")[3]
        cancelled = self.daemon.submit(scene(job={"expires_in": 1, "run_after": FAR}))
        self.daemon.request("POST", f"/v1/jobs/{cancelled}/cancel")
        wait_until(lambda: all(self.daemon.job(id_)["expired"] for id_ in (done, rendered, cancelled)), "expiry")
        for path in self.document["paths"]:
            if re.fullmatch(r"/v1/jobs/\{id\}/((image|measure|preview|reference)\..*|preview|scene|view\.png)", path):
                self.get(path, id=done)
        self.post("/v1/render", brief, key)
        self.send("PATCH", "/v1/jobs/{id}", {"expires_at": None}, {"If-Match": "*"}, id=done)
        self.post("/v1/jobs/{id}/retry", id=cancelled)

    def check_images(self):
        self.check_artifacts(self.daemon.rendered(scene(output={"formats": ["png", "png16", "exr", "jpg", "hdr", "webp", "tiff"]})))

    def check_measurements(self):
        body = {"scene": scene(), "settings": {"parameters": ["samples"], "reference_samples": 16}}
        reply = self.post("/v1/measure", body, {"Prefer": "wait=60"})
        self.check_artifacts(self.daemon.wait_for_end(json_of(reply)["id"]))

    def check_previews(self):
        template = "/v1/jobs/{id}/preview"
        waiting = self.daemon.submit(scene(job={"run_after": FAR}))
        for job_id in (waiting, self.daemon.rendered(scene())["id"], NOBODY):
            self.get(template, id=job_id)
        self.daemon.request("POST", f"/v1/jobs/{waiting}/cancel")
        running = self.daemon.submit(long_scene())
        self.get(template, "?max=none", id=running)

        def not_modified():
            first = self.get(template, id=running)
            return self.get(template, headers={"If-None-Match": first.headers["ETag"] or "none"}, id=running).status == 304
        wait_until(not_modified, "the same preview twice")
        self.daemon.request("POST", f"/v1/jobs/{running}/cancel")
        self.check_artifacts(self.daemon.cancel_in_work(long_scene()))

    def check_artifacts(self, job):
        for artifact in job["artifacts"]:
            template = "/v1/jobs/{id}/" + artifact["name"]
            self.get_again(template, id=job["id"])
            for range_ in ("bytes=0-3", "bytes=99999999-"):
                self.get(template, headers={"Range": range_}, id=job["id"])
            self.get(template, id=NOBODY)

    def check_events(self):
        for query in (f"?batch={NOBODY}", "?job=1"):
            self.get("/v1/events", query)
        with Daemon("--streams", "1") as daemon:
            job_id, of_job = daemon.rendered(scene())["id"], "/v1/jobs/{id}/events"
            schema = {"$ref": "#/components/schemas/Event", "components": self.document["components"]}

            def nothing_is_left_to_report():
                reply = self.get(of_job, daemon=daemon, id=job_id)
                fields = dict(line.split(": ", 1) for line in reply.body.decode().splitlines() if line)
                jsonschema.Draft202012Validator(schema).validate(json.loads(fields["data"]))
                return self.get(of_job, headers={"Last-Event-ID": fields["id"]}, daemon=daemon, id=job_id).status == 204

            # A job seen to have ended before that was, an event reports its end once more.
            wait_until(nothing_is_left_to_report, "the end of the job's events")
            self.get(of_job, daemon=daemon, id=NOBODY)
            self.check("/v1/events", daemon.request("HEAD", "/v1/events"))
            with daemon.socket() as connection:
                connection.sendall(b"GET /v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n")
                connection.recv(15)
                for template in ("/v1/events", of_job):
                    self.get(template, daemon=daemon, id=job_id)

    def check_assets(self):
        template, name = "/v1/assets/{sha256}", sha256(b"abc")
        for body in (b"abd", b"abc", b"abc"):
            self.send("PUT", template, body, sha256=name)
        self.refused_by_head(411, "PUT", template, sha256=name)
        self.refused_by_head(413, "PUT", template, "Content-Length: 256000001\r\n", sha256=name)
        self.get_again(template, sha256=name)
        self.get(template, sha256="0" * 64)
        self.post_each("/v1/assets/missing", {"sha256": ["0" * 64]}, {})
        self.post_each("/v1/tickets", {"path": "/v1/jobs?limit=1"}, {})

    def check_refusals_of_a_busy_daemon(self):
        measurement, batch = {"scene": scene()}, {"scene": scene(), "frames": [{}]}
        bodies = {"/v1/jobs": scene(), "/v1/render": scene(), "/v1/measure": measurement}
        with Daemon("--queued-jobs", "1", "--jobs", "1", "--render-wait-s", "0") as daemon:
            running = daemon.start_job()
            batch_id = json_of(daemon.request("POST", "/v1/batches", {**batch, "scene": scene(job={"run_after": FAR})}))["id"]
            daemon.request("POST", f"/v1/batches/{batch_id}/cancel")
            self.post("/v1/render", scene(), daemon=daemon)
            for path, body in bodies.items():
                self.post(path, body, daemon=daemon)
            daemon.process.terminate()
            wait_until(lambda: daemon.health("/readyz").status == 503, "draining")
            self.check("/readyz", daemon.health("/readyz"))
            for template, body, id_ in (("/v1/jobs", scene(), ""), ("/v1/jobs/{id}/retry", None, running), ("/v1/batches", batch, ""),
                                        ("/v1/batches/{id}/retry", None, batch_id)):
                self.post(template, body, daemon=daemon, id=id_)
        with Daemon("--key-queued-jobs", "1") as daemon:
            daemon.submit(scene(job={"run_after": FAR}))
            for path, body in {**bodies, "/v1/batches": batch}.items():
                self.post(path, body, daemon=daemon)
