"""The documentation that the daemon serves: the page for people, the schema of scenes, and the documents of jobs."""
import collections
import html
import html.parser
import json
import re

import jsonschema

from api import scene_schema
from tests.http.daemon import OneDaemon, json_of, scene
from tests.support.sources import text

SCHEMA = scene_schema.load()


class ScenePage(html.parser.HTMLParser):
    """Reads the page of the scene format: (name, requiredness or default, numbers of the range, description) of each field."""

    def __init__(self):
        super().__init__()
        self.fields, self.anchors, self.links = [], set(), set()
        self.paragraphs, self.place = [], ""

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        self.anchors |= {"#" + attrs["id"]} if "id" in attrs else set()
        self.links |= {attrs["href"]} if "href" in attrs else set()
        if tag in ("dt", "dd", "p"):
            self.place = tag
            self.paragraphs = [*([] if tag == "dt" else self.paragraphs), ""]

    def handle_data(self, data):
        if self.place:
            self.paragraphs[-1] += data

    def handle_endtag(self, tag):
        if tag == "dd":
            name, _, facts, description = self.paragraphs
            need = re.search(r"; (required|default .*)$", facts, re.DOTALL)
            facts = facts[:need.start()] if need else facts
            range_ = re.fullmatch(r"(?:integer|number) ([^a-z]+)", facts)
            self.fields.append([name, need[1] if need else "", range_[1] if range_ else "", description])
        self.place = "" if tag in ("dt", "dd") else self.place


def schema_fields(node, schema):
    """The same from the schema, without the order of the page."""
    found = []
    if isinstance(node, dict):
        for name, field in node.get("properties", {}).items() if isinstance(node.get("properties"), dict) else ():
            if "additionalProperties" not in node:
                continue  # a condition, not fields
            whole = {**(schema["$defs"][field["$ref"].rsplit("/", 1)[1]] if "$ref" in field else {}), **field}
            need = "required" if name in node.get("required", []) else f"default {json.dumps(whole['default'])}" if "default" in whole else ""
            signs = (("minimum", "≥"), ("exclusiveMinimum", ">"), ("maximum", "≤"), ("exclusiveMaximum", "<"))
            ranges = ", ".join(f"{sign} {whole[key]}" for key, sign in signs if key in whole)
            found.append([name, need, ranges, field.get("description", "")])
        node = list(node.values())
    for part in node if isinstance(node, list) else ():
        found += schema_fields(part, schema)
    return found


class Documentation(OneDaemon):
    def test_serves_the_schema_of_scenes_and_accepts_documents_that_name_it(self):
        reply = self.daemon.get("/schemas/scene.schema.json")
        self.assertEqual((reply.status, reply.headers["Content-Type"]), (200, "application/schema+json"))
        schema = json_of(reply)
        self.assertEqual(schema, SCHEMA)
        document = {"$schema": f"http://127.0.0.1:{self.daemon.port}/schemas/scene.schema.json", **scene(job={"cache": "use"})}
        jsonschema.Draft202012Validator(schema).validate(document)
        self.daemon.rendered(document)
        del document["$schema"]
        self.assertEqual(self.daemon.request("POST", "/v1/jobs", document).headers["X-Cache"], "hit")

    def test_documents_problems_for_people(self):
        page = html.unescape(self.daemon.get("/docs").body.decode())
        codes = set(re.findall(r'Failure \w+\{\s*"(\w+)"', text("server/http/problem.h")))
        self.assertEqual({code for code in codes if not re.search(rf"<code>\d\d\d {code}</code>", page)}, set())
        self.assertIn('href="/docs/scene"', page)

    def test_documents_every_field_of_scenes_as_the_schema_does(self):
        page = ScenePage()
        page.feed(self.daemon.get("/docs/scene").body.decode())
        expected, shown = (collections.Counter(map(json.dumps, fields)) for fields in (schema_fields(SCHEMA, SCHEMA), page.fields))
        self.assertEqual(shown, expected)
        self.assertEqual(page.links - page.anchors, {"/schemas/scene.schema.json", "/docs", "/docs/scene", "/", "/#/new", "/#/batches", "/#/system"})
        for anchor in ("#camera", "#accuracy.approximate", "#light-spot", "#camera.fov-field"):
            self.assertIn(anchor, page.anchors)

    def test_pages_for_people_have_no_script_and_are_sent_once(self):
        for path in ("/docs", "/docs/scene"):
            page = self.daemon.get(path)
            self.assertEqual(page.headers["Content-Security-Policy"], "default-src 'none'; style-src 'unsafe-inline'")
            again = self.daemon.get(path, If_None_Match=page.headers["ETag"])
            self.assertEqual((again.status, again.body, again.headers["ETag"]), (304, b"", page.headers["ETag"]))


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
