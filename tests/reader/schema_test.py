"""The JSON Schema and the reader agree: on the examples, on every invalid scene, on every field."""

import copy
import glob
import json
import os
import unittest

import jsonschema

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def load(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return json.load(file)


SCHEMA = load("api/schemas/scene.schema.json")


def accepts(document, schema=SCHEMA):
    return jsonschema.Draft202012Validator(schema).is_valid(document)


def shortened(value):
    """The document with a thousand elements of each longer array, first to last: they are alike, and this is Python."""
    if isinstance(value, dict):
        return {key: shortened(member) for key, member in value.items()}
    if isinstance(value, list):
        return [shortened(element) for element in value[::len(value) // 1000 + 1]]
    return value


def expectations():
    """file -> "sees", "blind" or "not read" (not JSON, or too large to be looked at)."""
    result = {}
    with open(os.path.join(ROOT, "scenes/invalid/expected.txt"), encoding="utf-8") as lines:
        for line in lines:
            if line.startswith("#"):
                continue
            words = line.split()
            if words[1] in ("not_json", "too_large"):
                result[words[0]] = "not read"
            elif len(words) == 3:
                result[words[0]] = "sees"
            else:
                result.setdefault(words[0], "blind")
    return result


def properties(schema, path=()):
    """Paths to every property that some part of the schema defines."""
    for key, value in schema.items() if isinstance(schema, dict) else enumerate(schema):
        if key == "properties":
            yield from (path + (key, name) for name in value)
        if isinstance(value, (dict, list)):
            yield from properties(value, path + (key,))


def without(schema, path):
    copied = copy.deepcopy(schema)
    parent = copied
    for key in path[:-1]:
        parent = parent[key]
    del parent[path[-1]]
    return copied


class SchemaTest(unittest.TestCase):
    def test_the_schema_is_a_schema(self):
        jsonschema.Draft202012Validator.check_schema(SCHEMA)

    def test_every_example_passes(self):
        files = glob.glob(os.path.join(ROOT, "scenes/*.json"))
        self.assertTrue(files)
        for path in files:
            with self.subTest(os.path.basename(path)):
                self.assertTrue(accepts(shortened(load(path))))

    def test_every_invalid_scene_fails_unless_a_schema_cannot_see_it(self):
        seen = expectations()
        self.assertGreater(list(seen.values()).count("sees"), 200)
        for name, expected in seen.items():
            if expected != "not read":
                with self.subTest(name):
                    self.assertEqual(accepts(load("scenes/invalid/" + name)), expected == "blind")

    def test_the_document_that_uses_every_field_passes_and_uses_every_property(self):
        documents = [load(path) for path in sorted(glob.glob(os.path.join(ROOT, "tests/reader/every_field*.json")))]
        self.assertTrue(all(accepts(document) for document in documents))
        for path in properties(SCHEMA):
            if "if" in path:  # a condition, not a field
                continue
            with self.subTest("/".join(map(str, path))):
                lesser = without(SCHEMA, path)
                self.assertFalse(all(accepts(document, lesser) for document in documents),
                                 "no field of the documents needs this property")


if __name__ == "__main__":
    unittest.main()
