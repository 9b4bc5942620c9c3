"""The page at / and its files: negotiation, caching, policy, compression; the build of the files."""
import base64
import gzip
import json
import os
import pathlib
import re
import subprocess
import unittest

from tests.http.daemon import Daemon, OneDaemon, json_of, sha256
from tests.support.sources import SOURCE, text
from tests.support.whittle import BIN, temporary_directory

BROWSER = "text/html,application/xhtml+xml,application/xml;q=0.9,image/avif,image/webp,*/*;q=0.8"
POLICY = ("default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; worker-src 'self'; "
          "base-uri 'none'; form-action 'none'; frame-ancestors 'none'; require-trusted-types-for 'script'")
# Found by configure, outside of the source directory.
CACHE = pathlib.Path(os.environ.get("WHITTLE_WEB_CACHE", SOURCE / "build" / "web"))


def build(cache, out):
    subprocess.run(["/usr/bin/python3", SOURCE / "server/web/build.py", cache, out], check=True, timeout=400)
    (tree,) = re.findall(r'return "([0-9a-f]{16})"', (out / "page_table.cpp").read_text(encoding="ascii"))
    return tree


def node(script, *arguments):
    """The output of a module in the directory of the page's sources."""
    return subprocess.run(["node", "--input-type=module", "--eval", script, *arguments], cwd=CACHE / "sources", check=True, capture_output=True,
                          text=True, timeout=600).stdout


class Page(OneDaemon):
    def page(self, **headers):
        return self.daemon.get("/", Accept=BROWSER, **headers)

    def files(self):
        """Paths of all files of the page, from the build's own table."""
        tree = re.search(r"/ui/([0-9a-f]{16})/main\.js", self.page().body.decode()).group(1)
        names = sorted(path.name for path in (BIN.parent / "server/web/files").iterdir())
        return [f"/ui/{tree}/{name}" for name in names if name != "index.html"]

    def test_is_text_for_programs_and_html_for_browsers(self):
        for accept in ("*/*", "text/plain", "application/json", ""):
            reply = self.daemon.get("/", Accept=accept)
            self.assertEqual((reply.status, reply.headers["Content-Type"]), (200, "text/plain; charset=utf-8"), accept)
            self.assertIn("Accept", reply.headers["Vary"])
        page = self.page()
        self.assertEqual((page.status, page.headers["Content-Type"]), (200, "text/html; charset=utf-8"))
        self.assertLess(len(page.body), 3000)

    def test_has_a_strict_policy(self):
        headers = self.page().headers
        expected = {"Content-Security-Policy": POLICY, "Referrer-Policy": "no-referrer", "Cross-Origin-Opener-Policy": "same-origin",
                    "Cross-Origin-Resource-Policy": "same-origin", "Vary": "Accept, Accept-Encoding", "Cache-Control": "no-cache"}
        self.assertEqual({name: headers[name] for name in expected}, expected)

    def test_names_no_other_host_and_holds_no_inline_code(self):
        page = self.page().body.decode()
        self.assertNotRegex(page, r"https?:|<style|\sstyle=|\son\w+=")
        self.assertEqual(re.findall(r"<script[^>]*>([^<]*)", page), [""])
        for path in self.files():
            if path.endswith((".js", ".css")):
                found = set(re.findall(r"""(?:import|from|url)\s*\(?\s*["'](https?:[^"']+)""", self.daemon.get(path).body.decode()))
                self.assertEqual(found, set(), path)

    def test_is_not_sent_again_if_it_is_known(self):
        for headers in ({}, {"Accept_Encoding": "gzip"}):
            page = self.page(**headers)
            again = self.page(If_None_Match=page.headers["ETag"], **headers)
            self.assertEqual((again.status, again.body, again.headers["ETag"]), (304, b"", page.headers["ETag"]))
            self.assertNotIn("Content-Encoding", again.headers)

    def test_files_never_change_and_are_compressed(self):
        paths, raw_bytes, packed_bytes = self.files(), 0, 0
        self.assertGreaterEqual(len(paths), 6)
        for path in paths:
            raw, packed = self.daemon.get(path), self.daemon.get(path, Accept_Encoding="br, gzip")
            self.assertEqual((raw.status, packed.status, raw.headers["Cache-Control"]), (200, 200, "max-age=31536000, immutable"), path)
            self.assertIn(sha256(raw.body), raw.headers["ETag"])
            self.assertEqual((raw.headers["X-Content-Type-Options"], raw.headers["Vary"]), ("nosniff", "Accept-Encoding"))
            self.assertEqual((packed.headers["Content-Encoding"], gzip.decompress(packed.body) == raw.body), ("gzip", True), path)
            self.assertNotEqual(raw.headers["ETag"], packed.headers["ETag"])
            if path.endswith(".js"):
                raw_bytes, packed_bytes = raw_bytes + len(raw.body), packed_bytes + len(packed.body)
            known = self.daemon.get(path, If_None_Match=raw.headers["ETag"])
            self.assertEqual((known.status, known.body), (304, b""))
        self.assertLessEqual(packed_bytes, 0.4 * raw_bytes)
        tree = paths[0].split("/")[2]
        for path in ("/ui/0000000000000000/main.js", f"/ui/{tree}/nothing.js", f"/ui/{tree}/index.html", f"/ui/{tree}"):
            self.assert_problem(self.daemon.get(path), 404, "not_found")

    def test_version_shows_whether_there_is_a_page(self):
        self.assertIs(json_of(self.daemon.get("/v1/version"))["dashboard"], True)
        with Daemon("--dashboard", "off") as daemon:
            reply = daemon.get("/", Accept=BROWSER)
            self.assertEqual(reply.headers["Content-Type"], "text/plain; charset=utf-8")
            self.assertIs(json_of(daemon.get("/v1/version"))["dashboard"], False)
            for path in self.files()[:2]:
                self.assert_problem(daemon.get(path), 404, "not_found")


class Build(unittest.TestCase):
    def test_is_reproducible_in_other_directories(self):
        one, other, cache = (temporary_directory(self) for _ in range(3))
        for name in ("package.json", "package-lock.json", ".npmrc", "installed"):
            (cache / name).write_bytes((CACHE / name).read_bytes())
        (cache / "node_modules").symlink_to(CACHE / "node_modules")
        self.assertEqual(build(CACHE, one / "out"), build(cache, other / "out"))
        for path in (one / "out/packed").iterdir():
            self.assertEqual(path.read_bytes(), (other / "out/packed" / path.name).read_bytes(), path.name)

    def test_modules_are_typed(self):
        checked = subprocess.run([CACHE / "node_modules/.bin/tsc", "--project", CACHE / "sources/tsconfig.json"], check=False,
                                 capture_output=True, text=True, timeout=300)
        self.assertEqual(checked.returncode, 0, checked.stdout)

    def test_hashes_without_a_secure_context(self):
        """The page's own SHA-256, which is used over plain HTTP, against hashlib; lengths around the ends of blocks."""
        texts = [bytes(i * 7 % 256 for i in range(size)) for size in (0, 1, 55, 56, 63, 64, 65, 119, 120, 1000, 20_003)]
        script = """import {plainSha256} from './sha256.js';
          for (const text of JSON.parse(process.argv[1])) console.log(plainSha256(Uint8Array.from(Buffer.from(text, 'base64')).buffer));"""
        hashes = node(script, json.dumps([base64.b64encode(each).decode() for each in texts])).split()
        self.assertEqual(hashes, [sha256(each) for each in texts])

    def test_camera_moves_keep_the_distance(self):
        """Orbiting turns about look_at; a pan moves both points alike."""
        script = """import {orbited, panned} from './orbit.js';
          const view = {position: [3, 2, 9], look_at: [1, 0.5, 0], up: [0, 1, 0]}, length = (v) => Math.hypot(...v);
          const arm = ({position, look_at}) => position.map((x, i) => x - look_at[i]);
          for (const turned of [orbited(view, 0.7, 0.3), orbited(view, -2, 5), panned(view, 0.2, -0.1)]) console.log(length(arm(turned)) / length(arm(view)));
          console.log(length(arm(panned(view, 0.2, 0.1)).map((x, i) => x - arm(view)[i])));"""
        *ratios, shift = map(float, node(script).split())
        for ratio in ratios:
            self.assertAlmostEqual(ratio, 1, places=12)
        self.assertAlmostEqual(shift, 0, places=12)

    def test_packages_are_pinned_by_hash_and_name_no_host(self):
        locked = json.loads(text("server/web/package-lock.json"))
        wanted = json.loads(text("server/web/package.json"))
        for name, version in {**wanted["dependencies"], **wanted["devDependencies"]}.items():
            self.assertRegex(version, r"^\d+\.\d+\.\d+$", name)
        for name, package in locked["packages"].items():
            if name:
                self.assertRegex(package["integrity"], r"^sha512-", name)
                self.assertNotIn("resolved", package)
        self.assertNotIn("://", text("server/web/package-lock.json"))
