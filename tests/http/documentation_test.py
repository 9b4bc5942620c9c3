"""The documentation that the daemon serves: the page for people, the schema of scenes, and the documents of jobs."""
import html
import json
import re
import unittest

import jsonschema

from tests.http.daemon import OneDaemon, json_of, scene
from tests.support.sources import text


class Documentation(OneDaemon):
    def test_serves_the_schema_of_scenes_and_accepts_documents_that_name_it(self):
        reply = self.daemon.get("/schemas/scene.schema.json")
        self.assertEqual((reply.status, reply.headers["Content-Type"]), (200, "application/schema+json"))
        schema = json_of(reply)
        self.assertEqual(schema, json.loads(text("api/schemas/scene.schema.json")))
        document = {"$schema": f"http://127.0.0.1:{self.daemon.port}/schemas/scene.schema.json", **scene(job={"cache": "use"})}
        jsonschema.Draft202012Validator(schema).validate(document)
        first = self.daemon.wait_for_end(self.daemon.submit(document))
        self.assertEqual(first["state"], "succeeded")
        del document["$schema"]
        self.assertEqual(self.daemon.request("POST", "/v1/jobs", document).headers["X-Cache"], "hit")

    def test_documents_scenes_and_problems_for_people(self):
        page = html.unescape(self.daemon.get("/docs").body.decode())
        codes = set(re.findall(r'Failure \w+\{\s*"(\w+)"', text("server/http/problem.h")))
        self.assertEqual({code for code in codes if not re.search(rf"<code>\d\d\d {code}</code>", page)}, set())
        for name in ("camera.position", "objects", "accuracy.target_error", "job.webhook.url"):
            self.assertIn(f"<code>{name}</code>", page)


class Documents(OneDaemon):
    def test_are_returned_as_submitted(self):
        document = json.dumps(scene(name="as submitted"), indent=3).encode()
        job = json_of(self.daemon.request("POST", "/v1/jobs", document))
        reply = self.daemon.get(job["links"]["scene"])
        self.assertEqual((reply.status, reply.headers["Content-Type"], reply.body), (200, "application/json", document))
        batch = json_of(self.daemon.request("POST", "/v1/batches", {"scene": scene(), "sweep": {"/image/width": [8, 9]}}))
        for job in json_of(self.daemon.get(batch["links"]["jobs"]))["items"]:
            document = json_of(self.daemon.get(job["links"]["scene"]))
            self.assertEqual(document, scene(width=job["image"]["width"]))


if __name__ == "__main__":
    unittest.main()
