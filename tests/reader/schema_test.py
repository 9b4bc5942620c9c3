"""The JSON Schema and the reader agree on the examples, on the invalid documents and on every field; the tables of fields and words
name the members and enumerators that they stand for."""

import copy
import json
import re
import unittest

import jsonschema

from api import scene_schema as tables
from tests.reader import invalid_documents
from tests.support.sources import SOURCE

SCHEMA = tables.load()


def load(pattern):
    """{path: document}"""
    return {path: json.loads(path.read_text("utf-8")) for path in sorted(SOURCE.glob(pattern))}


def accepts(document, schema=SCHEMA):
    return jsonschema.Draft202012Validator(schema).is_valid(document)


def shortened(value):
    """The document with a thousand evenly spaced elements of each longer array: validation in Python is slow."""
    if isinstance(value, dict):
        return {key: shortened(member) for key, member in value.items()}
    if isinstance(value, list):
        return [shortened(element) for element in value[::len(value) // 1000 + 1]]
    return value


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
    def test_is_a_valid_schema(self):
        jsonschema.Draft202012Validator.check_schema(SCHEMA)

    def test_accepts_every_example(self):
        scenes = load("scenes/*.json")
        self.assertTrue(scenes)
        for path, document in scenes.items():
            with self.subTest(path.name):
                self.assertTrue(accepts(shortened(document)))

    def test_rejects_every_invalid_document_whose_error_a_schema_can_express(self):
        cases = [case for case in invalid_documents.bases() + invalid_documents.cases() if case.is_read and case.request == "scene"]
        self.assertGreater([case.schema_accepts for case in cases].count(False), 150)
        for case in cases:
            with self.subTest(case.name):
                self.assertEqual(accepts(json.loads(case.text)), case.schema_accepts)

    def test_defines_only_properties_that_the_documents_of_every_field_use(self):
        documents = load("tests/reader/every_field*.json").values()
        self.assertTrue(all(accepts(document) for document in documents))
        for path in properties(SCHEMA):
            if "if" in path:  # a condition, not a field
                continue
            with self.subTest("/".join(map(str, path))):
                reduced = without(SCHEMA, path)
                self.assertFalse(all(accepts(document, reduced) for document in documents),
                                 "no field of the documents needs this property")


class FieldTables(unittest.TestCase):
    def test_call_members_by_their_names(self):
        rows = [(struct, name, re.sub("_(deg|s)$", "", member)) for struct, body in tables.STRUCTS.items()
                for _, name, member, *_ in tables.FIELD.findall(body)]
        self.assertGreater(len(rows), 100)
        self.assertEqual([row for row in rows if row[1] != row[2] and row[2] not in ("colors", "texture")], [])

    def test_call_enumerators_by_their_names(self):
        enum = re.compile(r"^ *enum class (\w+) \{([^}]*)\};", re.MULTILINE)
        scopes = [("", tables.SOURCE)] + [(f"{struct}::", body) for struct, body in tables.STRUCT.findall(tables.SOURCE)]
        values = {scope + name: re.findall(r"\w+", re.sub(r"///.*", "", listed)) for scope, body in scopes for name, listed in enum.findall(body)}
        self.assertGreater(len(tables.ENUMS), 15)
        self.assertEqual(tables.ENUMS["Format"], values["Format"])
        for name, first, words in tables.WORDS.findall(tables.SOURCE):
            with self.subTest(name):
                words = re.findall(r"\w+", words)
                start = 0 if first == "first" else values[name].index(first.rsplit("::", 1)[1])
                self.assertEqual(values[name][start:start + len(words)], words)
