"""Each third-party library has its room, and modules include each other in one direction only.

Debian puts every header in /usr/include, so linking PRIVATE hides nothing: what keeps the rooms closed is this test.
"""
import re
import unittest

from tests.support.sources import text, tracked

# Library, its headers, and where they may be named.
ROOMS = [
    ("Embree", r"embree\d?/.*", ["tracer/src/accel/", "tests/bench/bare_embree"]),
    ("OpenImageIO", r"OpenImageIO/.*", ["tracer/src/image_io/oiio_"]),
    ("libpng", r"(png|zlib)\.h", ["tracer/src/image_io/png_file"]),
    ("the loader of modules", r"dlfcn\.h", ["tracer/src/image_io/open_image_io", "tests/"]),
    ("the kernel's pages", r"sys/mman\.h", ["tracer/src/large_pages.cpp", "server/", "tests/"]),
    ("Cairo", r"cairo.*\.h", ["tracer/src/plot/"]),
    ("oneTBB", r"(oneapi/)?tbb/.*", ["tracer/src/", "tracer/cli/", "server/worker/", "tests/stability/"]),
    ("nlohmann-json", r"nlohmann/.*", ["api/src/"]),
    ("simdjson", r"simdjson\.h", ["api/src/json/quick"]),
    ("cpp-httplib", r"httplib\.h", ["server/http/"]),
    ("SQLite", r"sqlite3(ext)?\.h", ["server/storage/sqlite/"]),
    ("OpenSSL", r"openssl/.*", ["server/storage/files/", "server/webhooks/", "tracer/src/cache/"]),
    ("libcurl", r"curl/.*", ["server/webhooks/"]),
    ("spdlog", r"(spdlog|fmt)/.*", ["server/telemetry/"]),
    ("GoogleTest", r"g(test|mock)/.*", ["tests/"]),
]

# Linux and POSIX are at home everywhere but in the library: it knows no files, processes or sockets.
SYSTEM = re.compile(r"(sys|netinet|arpa|linux|net)/\w+\.h|\w+\.h")
NO_SYSTEM = ["tracer/include/", "tracer/src/", "api/include/", "api/src/"]
# The compiler's own: intrinsics are arithmetic, annotations are comments to a sanitizer.
COMPILER = re.compile(r"immintrin\.h|sanitizer/\w+\.h")

# Folder, and the only folders of ours its files may include from. The first folder that fits a file decides.
DIRECTIONS = [
    ("tracer/include/", ["tracer/include/"]),
    ("tracer/src/film/", ["tracer/include/", "tracer/src/film/", "tracer/src/math/"]),
    ("tracer/src/plot/", ["tracer/include/", "tracer/src/plot/"]),
    ("tracer/src/", ["tracer/include/", "tracer/src/"]),
    ("tracer/cli/", ["tracer/include/", "tracer/cli/", "api/include/"]),
    # What the service answers is written from the queue's plain values.
    ("api/include/api/replies.h", ["tracer/include/", "api/include/", "server/jobs/"]),
    ("api/src/replies", ["tracer/include/", "api/include/", "api/src/", "server/jobs/"]),
    ("api/", ["tracer/include/", "api/"]),
    ("server/main.cpp", ["server/", "tracer/include/", "api/include/"]),
    ("server/settings", ["server/", "api/include/"]),
    ("server/backup", ["server/backup", "server/jobs/", "server/storage/"]),
    ("server/jobs/", ["server/jobs/", "tracer/include/", "api/include/"]),
    ("server/storage/sqlite/", ["server/jobs/", "server/storage/sqlite/", "tracer/include/"]),
    ("server/storage/files/", ["server/jobs/", "server/storage/files/"]),
    ("server/storage/memory/", ["server/jobs/", "server/storage/memory/", "server/storage/files/sha256.h"]),
    ("server/config/", ["server/config/", "server/keys/", "tracer/include/"]),
    ("server/keys/", ["server/keys/", "server/storage/files/sha256.h", "tracer/include/"]),
    ("server/webhooks/", ["server/jobs/", "server/webhooks/", "tracer/include/", "api/include/"]),
    ("server/telemetry/", ["server/jobs/", "server/telemetry/", "api/include/api/report.h"]),
    ("server/worker/", ["server/jobs/", "server/worker/", "tracer/include/", "api/include/"]),
    ("server/http/", ["server/jobs/", "server/http/", "server/keys/", "server/telemetry/", "tracer/include/", "api/include/"]),
    ("tests/", [""]),
]

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
INCLUDE_FOLDERS = ["tracer/include/", "api/include/", ""]


def includes(path):
    return INCLUDE.findall(text(path))


def ours(name, files):
    """The repository's file that an include of `name` means; None when it is none of ours."""
    return next((f for f in (f"{folder}{name}" for folder in INCLUDE_FOLDERS) if f in files), None)


class Includes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.paths = tracked(".h", ".cpp")
        cls.files = {str(path) for path in cls.paths}

    def test_look_at_real_sources(self):
        self.assertGreater(len(self.paths), 50)
        for library, headers, _ in ROOMS[:14]:
            used = [path for path in self.paths for _, name in includes(path) if re.fullmatch(headers, name)]
            self.assertTrue(used, f"nothing includes {library}: its rule would hold whatever happened")

    def all_includes(self):
        return ((path, bracket, name) for path in self.paths for bracket, name in includes(path))

    def test_of_third_party_headers_stay_in_their_rooms(self):
        strays = [f"{path} includes <{name}>, but {library} lives in {rooms}"
                  for path, bracket, name in self.all_includes() for library, headers, rooms in ROOMS
                  if bracket == "<" and re.fullmatch(headers, name) and not str(path).startswith(tuple(rooms))]
        self.assertEqual(strays, [])

    def test_of_anything_else_in_angle_brackets_are_the_standard_library_or_the_system(self):
        for path, bracket, name in self.all_includes():
            standard = re.fullmatch(r"[a-z_0-9]+", name) or COMPILER.fullmatch(name)
            if bracket == '"' or standard or any(re.fullmatch(headers, name) for _, headers, _ in ROOMS):
                continue
            self.assertTrue(SYSTEM.fullmatch(name), f"{path}: <{name}> has no room")
            self.assertFalse(str(path).startswith(tuple(NO_SYSTEM)),
                             f"{path} includes <{name}>: tracer and api know no operating system")

    def test_in_quotes_name_files_of_this_repository_seen_from_the_top(self):
        strays = [f'{path} includes "{name}"' for path, bracket, name in self.all_includes()
                  if bracket == '"' and not any(f"{folder}{name}" in self.files for folder in INCLUDE_FOLDERS)]
        self.assertEqual(strays, [])

    def test_go_one_way_between_modules(self):
        strays = []
        for path in self.paths:
            rule = next((targets for folder, targets in DIRECTIONS if str(path).startswith(folder)), None)
            self.assertIsNotNone(rule, f"{path} lies in no folder that has a direction")
            targets = {ours(name, self.files) for _, name in includes(path)} - {None}
            strays += [f"{path} includes {target}, but may only look into {rule}"
                       for target in targets if not target.startswith(tuple(rule))]
        self.assertEqual(strays, [])


if __name__ == "__main__":
    unittest.main()
