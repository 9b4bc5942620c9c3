"""The documents are complete: links resolve, and tables name what the code has."""
import json
import os
import re
import unittest

import yaml

from api import scene_schema
from tests.docs.documents import PAGES, anchors, blocks, code_words, links, section
from tests.http.daemon import Daemon, wait_until
from tests.support.sources import SOURCE, text, tracked

SCENE, HTTP, SERVER = "api/docs/scene.md", "api/docs/http.md", "server/README.md"
SCHEMA = scene_schema.load()
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


def values(schema):
    """Words of all enumerations and constants in a JSON schema, at any depth, without CSS colours."""
    found = set()
    for key, value in schema.items() if isinstance(schema, dict) else ():
        if key in ("enum", "const"):
            found |= {word for word in (value if isinstance(value, list) else [value]) if isinstance(word, str)}
        elif key != "color_name":
            found |= values(value)
    return found.union(*map(values, schema)) if isinstance(schema, list) else found


# Beginnings of the cell `type`, by the definitions and types of the schema.
TYPES = {"color": "colour", "color_or_texture": "colour or texture", "texture_or_name": "texture", "asset": "string", "name": "string",
         "time": "time", "attenuation": "string or array", "array": ("array", "`["), "vec2": "`[", "vec3": ("point", "direction")}
SIGNS = (("minimum", ">="), ("exclusiveMinimum", ">"), ("maximum", "<="), ("exclusiveMaximum", "<"))


def range_cell(field):
    """The beginning of the cell `range`."""
    if words := field.get("enum") or field.get("items", {}).get("enum"):
        return ", ".join(f"`{word}`" for word in words)
    low, high = field.get("minimum"), field.get("maximum")
    if field.get("type") == "integer":
        return "" if low < 0 else f"{low} .. " + (f"{high:,}" if high < 2**31 else "")  # a limit may be lower
    if None not in (low, high):
        return f"[{low}, {high}]"
    return ", ".join(f"{sign} {field[key]}" for key, sign in SIGNS if key in field)


def default_cell(field):
    """The beginning of the cell `default`."""
    default = field.get("default", "")
    text = default if isinstance(default, str) else json.dumps(default)
    return f"`{text}`" if isinstance(default, (str, list)) and "default" in field else text


def row_of(name, place):
    """The beginnings of the cells after the name."""
    own = place["properties"][name]
    definition = own.get("$ref", "").rsplit("/", 1)[-1]
    field = {**SCHEMA["$defs"].get(definition, {}), **own}
    kind = TYPES.get(definition) or ("string" if "enum" in field else TYPES.get(field.get("type"), field.get("type", "")))
    is_required = name in place.get("required", [])
    return kind, range_cell(field), "required" if is_required else default_cell(field)


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


class PageForContributors(unittest.TestCase):
    # Of the examples of a section what only their files have, and how many files one example has at most.
    EXAMPLES = {"Add a material parameter": ([r"\bcoat\b"], 6), "Add an output format": ([r"\btiff\b"], 5),
                "Add an endpoint": ([r"/v1/compare\b", r"/openapi\.json", r"jobs/\{id\}/history\b|json_of\(const queue::JobMove\b"], 4)}

    def test_names_the_files_of_each_example(self):
        sources = [SCENE, HTTP] + [str(path) for path in tracked(".h", ".cpp", ".json", ".yaml") if path.parts[0] in ("tracer", "api", "server")]
        for heading, (patterns, most) in self.EXAMPLES.items():
            with self.subTest(heading):
                named = {path.partition("#")[0] for path in re.findall(r"\]\(([^)]*)\)", section("CONTRIBUTING.md", heading))}
                files = [{path for path in sources if re.search(pattern, text(path))} for pattern in patterns]
                self.assertEqual(named, set().union(*files))
                self.assertLessEqual(max(map(len, files)), most)


class SceneFormat(unittest.TestCase):
    def test_describes_every_field_and_value_of_the_schema(self):
        names = {name.removeprefix("$") for name in property_names(SCHEMA)}
        self.assertEqual((names | values(SCHEMA)) - code_words(text(SCENE)), set())

    def test_has_a_row_for_each_field_with_its_type_range_and_default(self):
        sections, definitions = SCHEMA["properties"], SCHEMA["$defs"]
        objects = {"ImageSize": sections["image"], "Camera": sections["camera"], "DepthCue": sections["depth_cue"],
                   "Accuracy": sections["accuracy"], "Output": sections["output"], "JobRequest": sections["job"],
                   "Texture": definitions["texture"], "Material": definitions["material"], "Light": definitions["light"]["oneOf"][-1]}
        tables = scene_schema.tables(text(SCENE))
        self.assertEqual(set(tables), set(objects))
        for struct, rows in tables.items():
            fields = objects[struct]["properties"]
            if struct != "Light":
                self.assertEqual([name for name in rows if "." not in name], list(fields), struct)
            for name, row in rows.items():
                parent, _, inner = name.partition(".")
                with self.subTest(struct=struct, field=name):
                    for cell, beginning in zip(row, row_of(inner or name, fields[parent] if inner else objects[struct])):
                        self.assertTrue(cell.startswith(beginning), f"{cell} instead of {beginning}")

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

    def formats(self):
        """The names, files and media types in the table of formats, which the contract refers to."""
        return set(re.findall(r"^\| `(\w+)` \| `(image\.[\w.]+)` \| `([\w/.-]+)` \|", section(SCENE, "Output"), re.MULTILINE))

    def test_lists_every_format_with_its_media_type(self):
        rows = re.findall(r'\{"(\w+)", "([\w.]+)", "([\w/.-]+)", ImageFormat::', text("tracer/include/tracer/format.h"))
        self.assertEqual(self.formats(), {(name, f"image.{extension}", media_type) for name, extension, media_type in rows})
        described = {(path.rsplit("/", 1)[1], media_type) for path, item in self.openapi["paths"].items() if "}/image." in path
                     for media_type in item["get"]["responses"]["200"]["content"]}
        self.assertEqual({row[1:] for row in self.formats()}, described)

    def test_lists_every_route_and_no_other(self):
        routes = {(method.upper(), path) for path, item in self.openapi["paths"].items() for method in item
                  if method in ("get", "post", "put", "patch", "delete")}
        listed = {("GET", "/v1/jobs/{id}/" + file) for _, file, _ in self.formats()}
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
