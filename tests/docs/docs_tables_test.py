"""The documents are complete: links resolve, and tables name what the code has."""
import json
import os
import re
import unittest

import yaml

from tests.docs.documents import PAGES, anchors, blocks, code_words, links, section
from tests.http.daemon import Daemon, wait_until
from tests.support.sources import SOURCE, text

SCENE, HTTP, SERVER = "api/docs/scene.md", "api/docs/http.md", "server/README.md"
MAX_COMMANDS_NOT_RUN = 12


def property_names(schema):
    """Names of all properties in a JSON schema, at any depth."""
    names = set()
    if isinstance(schema, dict):
        names |= set(schema.get("properties", {}))
        schema = list(schema.values())
    if isinstance(schema, list):
        names |= set().union(*map(property_names, schema))
    return names


class EveryPage(unittest.TestCase):
    def test_links_to_existing_files_and_headings(self):
        for page in PAGES:
            for path, anchor in links(page):
                with self.subTest(page=page, link=f"{path}#{anchor}"):
                    target = (SOURCE / page).parent / path if path else SOURCE / page
                    self.assertTrue(target.exists())
                    if anchor:
                        self.assertIn(anchor, anchors(os.path.relpath(target, SOURCE)))

    def test_names_files_that_exist(self):
        for page in ("ARCHITECTURE.md", "CONTRIBUTING.md"):
            named = set(re.findall(r"\b(?:tracer|api|server|tests)/[\w/.-]*\w", text(page)))
            self.assertGreater(len(named), 10)
            self.assertEqual([path for path in sorted(named) if not (SOURCE / path).exists()], [], page)

    def test_marks_commands_that_are_not_run(self):
        marked = [(page, block) for page in PAGES for block in blocks(page, "console")]
        for page, block in marked:
            with self.subTest(page=page, code=block.code):
                self.assertRegex(block.comment, r"\A(not run: \w+ \w+|run by tests/)")
                if block.comment.startswith("run by "):
                    test = text(block.comment.removeprefix("run by "))
                    self.assertIn(page, test)
        self.assertLessEqual(len([block for _, block in marked if block.comment.startswith("not run")]), MAX_COMMANDS_NOT_RUN)

    def test_names_programs_that_exist(self):
        for page in PAGES:
            for block in blocks(page, "console"):
                for program in re.findall(r"^((?:server|tests|docker|api)/\S+)", block.code, re.MULTILINE):
                    self.assertTrue(os.access(SOURCE / program, os.X_OK), f"{page}: {program}")

    def test_has_json_that_parses(self):
        for page in PAGES:
            for block in blocks(page, "json"):
                with self.subTest(page=page, code=block.code):
                    json.loads(block.code)

    def test_uses_no_other_language_of_blocks(self):
        languages = {block.language for page in PAGES for block in blocks(page)}
        self.assertLessEqual(languages, {"sh", "console", "json", "cpp"})


class Readme(unittest.TestCase):
    def test_names_the_two_commands_to_start(self):
        self.assertEqual(blocks("README.md", "console")[0].code.split(), ["server/run", "tests/run"])


class SceneFormat(unittest.TestCase):
    def test_describes_every_field_and_value_of_the_schema(self):
        schema = text("api/schemas/scene.schema.json")
        schema = re.sub(r'"color_name": {.*?\]\s*},', "", schema, flags=re.S)  # the page refers to CSS
        values = {value for enum in re.findall(r'"(?:enum|const)": (\[[^]]*\]|"\w+")', schema)
                  for value in re.findall(r'"([\w+-]+)"', enum)}
        names = {name.removeprefix("$") for name in property_names(json.loads(schema))}
        self.assertEqual((names | values) - code_words(text(SCENE)), set())

    def test_lists_every_code_of_an_issue(self):
        sources = [path for directory in ("api/src", "tracer/src/scene", "tracer/src/mesh_io", "server/http")
                   for path in sorted((SOURCE / directory).rglob("*.cpp"))]
        used = {code for path in sources for code in re.findall(
            r'"((?:unknown|missing|wrong|duplicate|circular)_[a-z]+|conflict|out_of_range|degenerate|malformed|not_finite|'
            r'limit_exceeded|unsupported|bad_asset|too_many_issues)"', path.read_text())}
        self.assertGreater(len(used), 15)
        self.assertEqual(used - code_words(section(SCENE, "Errors")), set())


class HttpContract(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.openapi = yaml.safe_load(text("api/openapi.yaml"))

    def test_lists_every_route_and_no_other(self):
        routes = {(method.upper(), path) for path, item in self.openapi["paths"].items() for method in item
                  if method in ("get", "post", "put", "patch", "delete")}
        listed = set()
        for line in section(HTTP, "Routes").splitlines():
            method, path = None, ""
            for span in re.findall(r"`([^`]+)`", line):
                if found := re.fullmatch(r"([A-Z]+) (/\S*)", span):
                    method, path = found.groups()
                elif re.fullmatch(r"(image|measure)\.[\w.]+", span):  # a further artifact of the route before
                    path = path[:path.rindex("/") + 1] + span
                else:
                    continue
                listed.add((method, path))
        self.assertEqual(listed, routes)

    def test_describes_every_field_and_parameter(self):
        schemas, parameters = self.openapi["components"]["schemas"], set()
        for item in self.openapi["paths"].values():
            for operation in item.values():
                if isinstance(operation, dict):
                    parameters |= {parameter["name"] for parameter in operation.get("parameters", []) if "name" in parameter}
        names = property_names(schemas) | parameters | set(self.openapi["components"]["parameters"])
        self.assertEqual(names - code_words(text(HTTP)) - code_words(text(SCENE)), set())

    def test_lists_every_problem_with_its_status_and_delay(self):
        rules = re.findall(r'Failure \w+\{\s*"(\w+)",\s*(\d+),\s*"[^"]*"(?:,\s*Level::\w+)?(?:,\s*(\d+))?\s*\}', text("server/http/problem.h"))
        listed = set()
        for status, codes, delay in re.findall(r"^\| (\d+) \| ([^|]+) \|[^|]*\| (\d*) ?\|$", section(HTTP, "Problems"), re.MULTILINE):
            listed |= {(code, status, delay or "0") for code in code_words(codes)}
        self.assertGreater(len(rules), 40)
        self.assertEqual(listed, {(code, status, delay or "0") for code, status, delay in rules})


class Daemons(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = cls.enterClassContext(Daemon())

    def metric_names(self):
        return set(re.findall(r"^# TYPE (\w+)", self.daemon.health("/metrics").body.decode(), re.MULTILINE))

    def test_metrics_are_all_listed(self):
        listed = {name for name in code_words(section(SERVER, "Metrics")) if re.match("(whittle|process)_", name)}
        self.assertGreater(len(listed), 15)
        wait_until(lambda: "whittle_worker_resident_memory_bytes" in self.metric_names(), "the worker to start")
        self.assertEqual(self.metric_names(), listed)

    def test_limits_are_all_listed(self):
        limits = set(json.loads(self.daemon.get("/v1/version").body)["limits"])
        self.assertEqual(limits - code_words(section(HTTP, "Limits")) - code_words(section(SCENE, "Limits")), set())


if __name__ == "__main__":
    unittest.main()
