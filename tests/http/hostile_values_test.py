"""Every field of the format with values that break programs: NaN, infinities, the ends of the numbers, null, the empty."""
import copy
import json
import os

from tests.http.daemon import OneDaemon
from tests.support.whittle import SOURCE

NOT_JSON = ("NaN", "Infinity", "-Infinity")
VALUES = NOT_JSON + ("1e308", "-1e308", "1e309", "5e-324", "-0", "-0.0", "4294967296", "9223372036854775807",
                     "9223372036854775808", "-9223372036854775809", "18446744073709551616", "null", "true", '""',
                     '"\\u0000"', "[]", "{}")
# A part that contains all fields and all values: smaller than their number and coprime to it. $WHITTLE_LONG tries each with each.
STEP = 1 if os.environ.get("WHITTLE_LONG") else 13
HERE = "the place of the value"


def every_field():
    """Documents that together contain every field."""
    for path in sorted((SOURCE / "tests/reader").glob("every_field*.json")):
        yield path.name, json.loads(path.read_text("utf-8"))


def drawable(document):
    """A small document with the same fields except for files and times."""
    document = copy.deepcopy(document)
    textures = document.get("textures", {})
    gone = [name for name, texture in textures.items() if "file" in texture]
    if not document.get("objects") or json.dumps(document).count('"file"') != len(gone):
        return None
    for name in gone:
        del textures[name]
    for material in document["materials"].values():
        material.pop("normal_map", None)
    return {**document, "job": {"cache": "off"}, "image": {"width": 8, "height": 6},
            "accuracy": {"samples": [1, 2], "max_depth": 3, "cutoff": 0.01},
            "output": {"formats": ["png"], "overflow": "clamp", "exposure": 0.5}}


def pointers(node, path=()):
    """Pointers to every value of a document except the root."""
    for key, value in node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ():
        yield path + (key,)
        yield from pointers(value, path + (key,))


def with_value(document, pointer, value):
    changed = copy.deepcopy(document)
    node = changed
    for key in pointer[:-1]:
        node = node[key]
    node[pointer[-1]] = HERE
    return json.dumps(changed).replace(json.dumps(HERE), value).encode()


def changes(document):
    """Yields (description, bytes) for every change of one value of a document."""
    every = [(pointer, value) for pointer in pointers(document) for value in VALUES]
    return ((f"#/{'/'.join(map(str, pointer))} = {value}", value, with_value(document, pointer, value))
            for pointer, value in every[::STEP])


class HostileValues(OneDaemon):
    options = ("--render-wait-s", "20")  # some values that are accepted make a render without an end

    def setUp(self):
        self.kept = self.daemon.connection(self.daemon.port)
        self.addCleanup(self.kept.close)

    def post(self, path, body):
        self.kept.request("POST", path, body=body, headers={"Content-Type": "application/json"})
        response = self.kept.getresponse()
        return response.status, response.headers, response.read()

    def test_in_any_field_are_accepted_or_reported_with_a_pointer(self):
        tried = 0
        for name, document in every_field():
            for what, value, body in changes(document):
                status, _, answer = self.post("/v1/jobs/validate", body)
                answer = json.loads(answer)
                tried += 1
                if value in NOT_JSON:
                    self.assertEqual((status, answer["status"]), (400, 400), f"{name}: {what}")
                    continue
                self.assertEqual(status, 200, f"{name}: {what}: {answer}")
                if not answer["valid"]:
                    self.assertTrue(all(error["pointer"].startswith("#") and error["detail"]
                                        for error in answer["errors"]), f"{name}: {what}: {answer}")
        self.assertGreater(tried, 8000 / STEP)

    def test_that_are_accepted_crash_no_worker(self):
        drawn = 0
        for name, document in every_field():
            document = drawable(document)
            for what, value, body in changes(document) if document else ():
                if value in NOT_JSON:
                    continue
                status, headers, answer = self.post("/v1/render", body)
                self.assertIn(status, (200, 202, 400, 413, 422), f"{name}: {what}: {answer[:500]}")
                drawn += status == 200
                if status == 202:
                    self.daemon.request("POST", headers["Location"] + "/cancel")
        self.assertGreater(drawn, 500 / STEP)
        self.assertEqual(len(self.daemon.log_rows("worker_started")), 1)
