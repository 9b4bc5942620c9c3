"""Each third-party library is included in one directory, and modules include each other in one direction.

Debian installs every header in /usr/include, so that linking PRIVATE hides nothing: this test does.
"""
import re
import unittest

from tests.support.sources import text, tracked

# Library, its headers, and the directories or files that may include them.
THIRD_PARTY = [
    ("Embree", r"embree\d?/.*", ["tracer/src/accel/", "tests/bench/bare_embree"]),
    ("OpenImageIO", r"OpenImageIO/.*", ["tracer/src/image_io/oiio_"]),
    ("libpng", r"png\.h", ["tracer/src/image_io/png_file"]),
    ("zlib", r"zlib\.h", ["tracer/src/image_io/png_file", "server/http/handlers/apng"]),
    ("dynamic loading", r"dlfcn\.h", ["tracer/src/image_io/oiio_loader", "tests/"]),
    ("memory mapping", r"sys/mman\.h", ["server/", "tests/"]),
    ("Cairo", r"cairo.*\.h", ["tracer/src/plot/"]),
    ("oneTBB", r"(oneapi/)?tbb/.*", ["tracer/src/", "api/cli/", "server/worker/process/", "tests/stability/"]),
    ("nlohmann-json", r"nlohmann/.*", ["api/src/", "api/include/api/json.h"]),
    ("cpp-httplib", r"httplib\.h", ["server/http/handlers/service_handlers", "tests/http/http_server_test"]),
    ("SQLite", r"sqlite3(ext)?\.h", ["server/storage/sqlite/"]),
    ("libpq", r"libpq-fe\.h|libpq/.*", ["server/storage/postgres/"]),
    ("OpenSSL", r"openssl/.*", ["tracer/src/hash/", "server/webhooks/"]),
    ("pugixml", r"pugixml\.hpp", ["server/storage/s3/"]),
    ("libcurl", r"curl/.*", ["server/webhooks/", "server/storage/s3/"]),
    ("spdlog", r"(spdlog|fmt)/.*", ["server/telemetry/"]),
    ("GoogleTest", r"g(test|mock)/.*", ["tests/"]),
    # Not yet in use everywhere: included in at most these directories.
    ("prometheus-cpp", r"prometheus/.*", ["server/telemetry/"]),
    ("CLI11", r"CLI/.*", ["api/cli/", "server/daemon/"]),
]
OPTIONAL = {"prometheus-cpp", "CLI11", "dynamic loading", "memory mapping"}

# POSIX and Linux headers are allowed everywhere except in the libraries: they use no files, processes or sockets.
SYSTEM = re.compile(r"(sys|netinet|arpa|linux|net)/\w+\.h|\w+\.h")
NO_SYSTEM = ["tracer/include/", "tracer/src/", "api/include/", "api/src/"]
# Headers of the compiler: intrinsics and sanitizer annotations.
COMPILER = re.compile(r"immintrin\.h|sanitizer/\w+\.h")

# Directory or file, and all that its files may include of ours. The first one that matches decides.
DIRECTIONS = [
    ("tracer/include/", ["tracer/include/"]),
    ("tracer/src/plot/", ["tracer/include/", "tracer/src/plot/"]),
    ("tracer/src/display/", ["tracer/include/", "tracer/src/display/", "tracer/src/math/"]),
    ("tracer/src/", ["tracer/include/", "tracer/src/"]),
    ("api/cli/", ["tracer/include/", "api/cli/", "api/include/"]),
    ("api/", ["tracer/include/", "api/"]),
    ("server/support/", ["server/support/"]),
    ("server/daemon/", ["server/", "tracer/include/", "api/include/"]),
    ("server/queue/", ["server/queue/", "server/storage/sql/sql_database.h", "server/support/", "tracer/include/", "api/include/"]),
    ("server/storage/sql/", ["server/storage/sql/"]),
    ("server/storage/postgres/", ["server/queue/", "server/storage/sql/", "server/storage/postgres/", "server/support/"]),
    ("server/storage/sqlite/", ["server/queue/", "server/storage/sql/", "server/storage/sqlite/", "server/storage/files/directory_lock.h",
                                "server/support/", "tracer/include/"]),
    ("server/storage/files/", ["server/queue/", "server/storage/files/", "server/support/", "tracer/include/"]),
    ("server/storage/", ["server/queue/", "server/storage/", "server/support/", "tracer/include/"]),
    ("server/web/", ["server/web/"]),
    ("server/keys/", ["server/keys/", "server/support/", "tracer/include/"]),
    ("server/webhooks/", ["server/queue/", "server/resources/", "server/webhooks/", "server/support/", "tracer/include/", "api/include/"]),
    ("server/telemetry/", ["server/queue/", "server/telemetry/", "server/support/", "api/include/"]),
    ("server/worker/protocol/", ["server/queue/", "server/worker/protocol/", "server/support/", "tracer/include/", "api/include/"]),
    ("server/worker/process/",
     ["server/queue/", "server/worker/protocol/", "server/worker/process/", "server/support/", "tracer/include/", "api/include/"]),
    ("server/worker/supervisor/",
     ["server/queue/", "server/worker/protocol/", "server/worker/supervisor/", "server/support/", "tracer/include/", "api/include/"]),
    ("server/http/resources/", ["server/queue/", "server/http/resources/", "server/support/", "tracer/include/", "api/include/"]),
    ("server/resources/", ["server/queue/", "server/resources/", "server/telemetry/", "server/support/", "tracer/include/", "api/include/"]),
    ("server/http/", ["server/queue/", "server/http/", "server/resources/", "server/keys/", "server/telemetry/", "server/web/", "server/support/",
                      "tracer/include/", "api/include/"]),
    ("tests/", [""]),
]

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
INCLUDE_DIRECTORIES = ["tracer/include/", "api/include/", ""]


def includes(path):
    return INCLUDE.findall(text(path))


def ours(name, files):
    """The file of the repository that an include of `name` resolves to, or None."""
    return next((f for f in (f"{directory}{name}" for directory in INCLUDE_DIRECTORIES) if f in files), None)


class Includes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.paths = tracked(".h", ".cpp")
        cls.files = {str(path) for path in tracked()}

    def test_every_rule_has_includes_to_check(self):
        self.assertGreater(len(self.paths), 50)
        for library, headers, _ in THIRD_PARTY:
            used = [path for path in self.paths for _, name in includes(path) if re.fullmatch(headers, name)]
            self.assertTrue(used or library in OPTIONAL, f"nothing includes {library}: its rule checks nothing")

    def all_includes(self):
        return ((path, bracket, name) for path in self.paths for bracket, name in includes(path))

    def test_third_party_headers_are_confined(self):
        strays = [f"{path} includes <{name}>, but {library} is confined to {places}"
                  for path, bracket, name in self.all_includes() for library, headers, places in THIRD_PARTY
                  if bracket == "<" and re.fullmatch(headers, name) and not str(path).startswith(tuple(places))]
        self.assertEqual(strays, [])

    def test_other_headers_in_angle_brackets_are_standard_or_system(self):
        for path, bracket, name in self.all_includes():
            standard = re.fullmatch(r"[a-z_0-9]+", name) or COMPILER.fullmatch(name)
            if bracket == '"' or standard or any(re.fullmatch(headers, name) for _, headers, _ in THIRD_PARTY):
                continue
            self.assertTrue(SYSTEM.fullmatch(name), f"{path}: <{name}> is listed nowhere")
            self.assertFalse(str(path).startswith(tuple(NO_SYSTEM)),
                             f"{path} includes <{name}>: tracer and api use no operating system")

    def test_quoted_includes_are_paths_from_the_root(self):
        strays = [f'{path} includes "{name}"' for path, bracket, name in self.all_includes()
                  if bracket == '"' and not any(f"{directory}{name}" in self.files for directory in INCLUDE_DIRECTORIES)]
        self.assertEqual(strays, [])

    def test_modules_include_in_one_direction(self):
        strays = []
        for path in self.paths:
            rule = next((targets for directory, targets in DIRECTIONS if str(path).startswith(directory)), None)
            self.assertIsNotNone(rule, f"{path} is in no directory of DIRECTIONS")
            targets = {ours(name, self.files) for _, name in includes(path)} - {None}
            strays += [f"{path} includes {target}, but may include only {rule}"
                       for target in targets if not target.startswith(tuple(rule))]
        self.assertEqual(strays, [])

    def test_intervals_are_part_of_the_proof(self):
        """A render without accuracy.proof runs no interval arithmetic: nothing else includes it, and one condition selects it."""
        users = {str(path) for path, _, name in self.all_includes() if name.startswith("tracer/src/certify/")}
        self.assertEqual({path for path in users if not path.startswith(("tracer/src/certify/", "tests/"))}, {"tracer/src/sampling/proof.h"})
        users = {str(path) for path, _, name in self.all_includes() if name == "tracer/src/sampling/proof.h"}
        self.assertEqual({path for path in users if not path.startswith("tests/")}, {"tracer/src/sampling/proof.cpp", "tracer/src/render/render.cpp"})
        calls = re.findall(r".*prove_error\(.*", text("tracer/src/render/render.cpp"))
        self.assertEqual(len(calls), 1)
        self.assertIn("if (rendered && scene.accuracy.proof)", calls[0])
