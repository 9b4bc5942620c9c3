"""Faults of the page that the tests of the page must report: each is put into a copy of it, and one named test fails."""
import contextlib
import http.client
import http.server
import pathlib
import re
import shutil
import subprocess
import tempfile
import threading
import unittest
from unittest import mock

from tests.browser import job_test
from tests.http import page_test
from tests.http.daemon import Daemon
from tests.support.sources import SOURCE

TYPES = {".js": "text/javascript; charset=utf-8", ".css": "text/css; charset=utf-8", ".html": "text/html; charset=utf-8", ".svg": "image/svg+xml"}


def build_page(directory, name, old, new):
    """The files of the page with one change of a source."""
    sources, cache = directory / "web", directory / "cache"
    shutil.copytree(SOURCE / "server/web", sources)
    text = (sources / name).read_text(encoding="utf-8")
    assert text.count(old) == 1, f"{old!r} is not in {name}"
    (sources / name).write_text(text.replace(old, new), encoding="utf-8")
    cache.mkdir()
    for each in ("package.json", "package-lock.json", ".npmrc", "installed"):
        shutil.copyfile(page_test.CACHE / each, cache / each)
    (cache / "node_modules").symlink_to(page_test.CACHE / "node_modules")
    subprocess.run(["/usr/bin/python3", sources / "build.py", cache, directory / "out"], check=True, timeout=400)
    return directory / "out/files"


class Proxy(http.server.ThreadingHTTPServer):
    """Between a browser and a daemon: serves a page of its own, or drops a header of the daemon's replies."""

    daemon_threads = True

    def __init__(self, port, page, dropped):
        self.target, self.page, self.dropped = port, page, dropped
        super().__init__(("127.0.0.1", 0), ProxyHandler)
        threading.Thread(target=self.serve_forever, daemon=True).start()


class ProxyHandler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.0"  # the end of a reply is that of its connection

    def forward(self):
        headers = {name: value for name, value in self.headers.items() if name not in ("Connection", "Accept-Encoding")}
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        connection = http.client.HTTPConnection("127.0.0.1", self.server.target, timeout=120)
        with contextlib.closing(connection), contextlib.suppress(ConnectionError):
            connection.request(self.command, self.path, body or None, headers)
            reply = connection.getresponse()
            changed = self.changed(reply)
            self.send_response(200 if changed is not None else reply.status)
            for name, value in reply.getheaders():
                if name in (self.server.dropped, "Connection") or (changed is not None and name in ("Content-Length", "Content-Type")):
                    continue
                self.send_header(name, value)
            if changed is not None:
                self.send_header("Content-Type", TYPES[changed.suffix])
            self.end_headers()
            if changed is not None:
                self.wfile.write(changed.read_bytes())
                return
            while piece := reply.read1(65536):
                self.wfile.write(piece)

    def changed(self, reply):
        """The changed file in place of the daemon's."""
        if self.server.page is None or self.command != "GET":
            return None
        if self.path == "/" and reply.getheader("Content-Type", "").startswith("text/html"):
            return self.server.page / "index.html"
        name = re.fullmatch(r"/ui/[0-9a-f]{16}/([\w.-]+\.(?:js|css|svg))", self.path)
        return self.server.page / name[1] if name and (self.server.page / name[1]).exists() else None

    do_GET = do_HEAD = do_POST = do_PATCH = do_DELETE = forward

    def log_message(self, *_):
        pass


def behind_proxy(page, dropped):
    """A daemon class whose port is that of a proxy."""
    class Behind(Daemon):
        def start(self):
            super().start()
            self.proxy = Proxy(self.port, page, dropped)
            self.port = self.proxy.server_port

        def __exit__(self, *arguments):
            self.proxy.shutdown()
            self.proxy.server_close()
            super().__exit__(*arguments)
    return Behind


class Mutations(unittest.TestCase):
    """Acceptance test 48."""

    def run_named(self, case, name, page=None, dropped=None):
        """The messages of the failures of one test."""
        result = unittest.TestResult()
        with mock.patch("tests.browser.browser.Daemon", behind_proxy(page, dropped)), mock.patch("tests.http.daemon.Daemon", behind_proxy(page, dropped)), \
             mock.patch("tests.browser.job_test.SMALL_SCENES", ("tiny",)):
            unittest.TestSuite([case(name)]).run(result)
        self.assertEqual(result.testsRun, 1)
        return "\n".join(text for _, text in result.failures + result.errors)

    def changed(self, name, old, new):
        directory = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        return build_page(directory, name, old, new)

    def test_of_none_there_is_no_failure(self):
        page = self.changed("main.js", "/** The page:", "/** A page:")
        for case, name in ((page_test.Page, "test_has_a_strict_policy"), (page_test.Page, "test_names_no_other_host_and_holds_no_inline_code"),
                           (job_test.Account, "test_shares_sum_to_one_and_levels_equal_the_report")):
            self.assertEqual(self.run_named(case, name, page), "", name)

    def test_a_missing_policy_is_reported(self):
        self.assertIn("Content-Security-Policy", self.run_named(page_test.Page, "test_has_a_strict_policy", dropped="Content-Security-Policy") or "nothing failed")

    def test_an_inline_script_is_reported(self):
        page = self.changed("index.html", "</head>", "<script>document.title = 'inline'</script></head>")
        self.assertIn("inline", self.run_named(page_test.Page, "test_names_no_other_host_and_holds_no_inline_code", page))
        self.assertIn("Content Security Policy", self.run_named(job_test.Account, "test_shares_sum_to_one_and_levels_equal_the_report", page))

    def test_an_address_of_another_host_is_reported(self):
        page = self.changed("main.js", "startStream();\neffect", "import('https://cdn.example/library.js');\nstartStream();\neffect")
        self.assertIn("cdn.example", self.run_named(page_test.Page, "test_names_no_other_host_and_holds_no_inline_code", page))

    def test_a_wrong_unit_of_the_error_is_reported(self):
        page = self.changed("error-tab.js", "const sampling = parts.sampling ** 2,", "const sampling = parts.sampling,")
        self.assertIn("AssertionError", self.run_named(job_test.Account, "test_shares_sum_to_one_and_levels_equal_the_report", page))


if __name__ == "__main__":
    unittest.main()
