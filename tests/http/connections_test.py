"""Connections of the HTTP server: malformed, ambiguous, huge, slow and too many requests, as raw bytes over sockets."""
import contextlib
import itertools
import json
import pathlib
import resource
import socket
import time
import unittest

from tests.http.daemon import PATIENCE_S, SANITIZED, Daemon, OneDaemon, json_of, long_scene, scene, wait_until

SMUGGLED = b"DELETE /v1/jobs/%s HTTP/1.1\r\nHost: localhost\r\n\r\n"


def post(headers, body=b"", target=b"/v1/jobs", version=b"HTTP/1.1"):
    return b"POST " + target + b" " + version + b"\r\nHost: localhost\r\n" + headers + b"\r\n" + body


def get(target=b"/v1/version", headers=b"Host: localhost\r\n"):
    return b"GET " + target + b" HTTP/1.1\r\n" + headers + b"\r\n"


JSON = b"Content-Type: application/json\r\n"
CLOSING = get(b"/", b"Host: localhost\r\nConnection: close\r\n")

# (description, bytes, status): each status, and two interpretations of the end of a body; all others are in request_head_test.cpp.
# SMUGGLED is replaced by a request that must not run: it would delete a job.
MALFORMED = [
    ("empty request line", b"\r\n\r\n", 400),
    ("noise", b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\n", 400),
    ("HTTP/2 preface", b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 505),
    ("unknown method", b"BREW / HTTP/1.1\r\nHost: localhost\r\n\r\n", 501),
    ("17 KiB of headers", get(headers=b"Host: localhost\r\nA: " + b"b" * 17000 + b"\r\n"), 431),
    ("2 KiB of target", get(b"/" + b"a" * 2100), 414),
    ("gzip", post(JSON + b"Content-Encoding: gzip\r\nContent-Length: 3\r\n", b"abc"), 415),
    ("unknown expectation", post(JSON + b"Expect: magic\r\nContent-Length: 3\r\n", b"abc"), 417),
    ("one byte too many announced", post(JSON + b"Expect: 100-continue\r\nContent-Length: 67108865\r\n"), 413),
    ("CL.TE", post(b"Content-Length: 5\r\nTransfer-Encoding: chunked\r\n", b"0\r\n\r\n" + SMUGGLED), 400),
    ("TE alone", post(b"Transfer-Encoding: chunked\r\n", b"0\r\n\r\n" + SMUGGLED), 411),
    ("TE folded", post(b"Transfer-Encoding:\r\n chunked\r\n", b"0\r\n\r\n" + SMUGGLED), 400),
    ("TE after a bare LF", post(b"A: b\nTransfer-Encoding: chunked\r\n", b"0\r\n\r\n" + SMUGGLED), 400),
    ("two Content-Lengths", post(b"Content-Length: 0\r\nContent-Length: 44\r\n", SMUGGLED), 400),
    ("Content-Length behind a NUL", post(b"Content-Length: 0\0\r\n", SMUGGLED), 400),
    ("the body of a GET", b"GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 44\r\n\r\n" + SMUGGLED, 400),
    ("a request in a header", get(headers=b"Host: localhost\r\nA: b\r\r\n" + SMUGGLED), 400),
    ("a request behind an escaped CR LF", get(b"/%0d%0a%0d%0aDELETE%20/v1/jobs/") + SMUGGLED, 400),
]


def exchange(daemon, data, byte_by_byte=False):
    """Returns all replies on one connection until the daemon closes it."""
    answer = b""
    with daemon.socket() as connection:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        try:
            if byte_by_byte:
                for index in range(len(data)):
                    connection.sendall(data[index:index + 1])
            else:
                connection.sendall(data)
            connection.shutdown(socket.SHUT_WR)
            while chunk := connection.recv(65536):
                answer += chunk
        except (BrokenPipeError, ConnectionResetError, OSError):
            pass  # refused before we were done
    return answer


def statuses(answer):
    """Returns the status of each of several replies with Content-Length."""
    found = []
    while answer:
        head, _, rest = answer.partition(b"\r\n\r\n")
        lines = head.split(b"\r\n")
        found.append(int(lines[0].split(b" ")[1]))
        length = next((int(line[16:]) for line in lines if line.lower().startswith(b"content-length: ")), 0)
        answer = rest[length:]
    return found


class Requests(OneDaemon):
    def test_that_are_malformed_are_refused_and_nothing_smuggled_runs(self):
        job_id = self.finished()["id"]
        for (what, data, status), byte_by_byte in itertools.product(MALFORMED, (False, True)):
            with self.subTest(what, byte_by_byte=byte_by_byte):
                data = data.replace(SMUGGLED, SMUGGLED % job_id.encode())
                answer = exchange(self.daemon, data, byte_by_byte)
                self.assertEqual(statuses(answer), [status], answer)
                head, _, body = answer.partition(b"\r\n\r\n")
                self.assertIn(b"\r\nConnection: close", head)
                self.assertIn(b"\r\nContent-Type: application/problem+json", head)
                problem = json.loads(body)
                self.assertEqual(problem["status"], status)
                self.assertIn(b"\r\nX-Request-Id: " + problem["request_id"].encode(), head)
        self.assertEqual(self.daemon.job(job_id)["state"], "succeeded")
        alone = exchange(self.daemon, SMUGGLED % job_id.encode())
        self.assertEqual(statuses(alone), [204], "the smuggled request would have run")

    def test_that_are_pipelined_are_answered_in_order(self):
        body = json.dumps(scene()).encode()
        data = get() + post(JSON + b"Content-Length: %d\r\n" % len(body), body) + get(b"/nothing") + get(b"/?a=1") + CLOSING
        for byte_by_byte in (False, True):
            self.assertEqual(statuses(exchange(self.daemon, data, byte_by_byte)), [200, 202, 404, 400, 200])

    def test_that_are_incomplete_get_no_reply(self):
        self.assertEqual(exchange(self.daemon, b"GET / HTT"), b"")
        self.assertEqual(exchange(self.daemon, post(JSON + b"Content-Length: 10\r\n", b"{")), b"")

    def test_keep_the_connection_by_version_and_header(self):
        for request, stays in ((b"GET / HTTP/1.0\r\n\r\n", False), (b"GET / HTTP/1.0\r\nConnection: keep-alive\r\n\r\n", True),
                               (get(b"/"), True), (CLOSING, False)):
            answer = exchange(self.daemon, request + get(b"/"))
            self.assertEqual(statuses(answer), [200, 200] if stays else [200], request)
            self.assertIn(b"\r\nConnection: keep-alive" if stays else b"\r\nConnection: close", answer.partition(b"\r\n\r\n")[0])

    def test_that_expect_continue_are_answered_before_the_body(self):
        body = json.dumps(scene()).encode()
        with self.daemon.socket() as connection:
            connection.sendall(post(JSON + b"Expect: 100-continue\r\nContent-Length: %d\r\n" % len(body)))
            file = connection.makefile("rb")
            self.assertEqual(file.readline() + file.readline(), b"HTTP/1.1 100 Continue\r\n\r\n")
            connection.sendall(body)
            self.assertEqual(file.readline(), b"HTTP/1.1 202 Accepted\r\n")

    def test_with_a_body_too_large_end_with_a_reply_that_the_client_can_read(self):
        self.assert_problem(self.daemon.request("POST", "/v1/jobs", b"[" * (64 << 20 | 1)), 413, "body_too_large")

    def test_with_64_mib_of_brackets_are_refused_in_bounded_memory(self):
        before = self.daemon.resident_bytes()
        self.daemon.forget_peak()
        self.assertIn("depth", json_of(self.daemon.request("POST", "/v1/jobs", b"[" * (64 << 20)), 413)["detail"])
        self.assertLess(self.daemon.peak_bytes() - before, 300 << 20)
        self.assertEqual(list((self.daemon.data / "spool").iterdir()), [])
        self.assertEqual(self.daemon.get("/v1/version").status, 200)


class ManyClients(unittest.TestCase):
    def test_idle_and_slow_clients_delay_no_request(self):
        with Daemon("--handler-threads", "1") as daemon:
            daemon.rendered(scene())  # the worker runs: the slow clients have ten seconds
            silent = [daemon.socket() for _ in range(400)]
            slow = [daemon.socket() for _ in range(100)]
            body = json.dumps(scene()).encode()
            heads = [get(), post(JSON + b"Content-Length: %d\r\n" % len(body), body)]
            for step in range(40):
                for index, connection in enumerate(slow):
                    connection.sendall(heads[index % 2][step:step + 1])
                self.assertEqual(daemon.get("/v1/version").status, 200)
            daemon.rendered(scene())
            for index, connection in enumerate(slow):  # slow is not wrong: each is answered in the end
                connection.sendall(heads[index % 2][40:])
                self.assertIn(connection.makefile("rb").readline(), (b"HTTP/1.1 200 OK\r\n", b"HTTP/1.1 202 Accepted\r\n"))
            for connection in silent + slow:
                connection.close()

    def test_an_incomplete_head_is_answered_408(self):
        with Daemon() as daemon, daemon.socket() as connection:
            connection.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n")
            self.assertEqual(connection.makefile("rb").readline(), b"HTTP/1.1 408 Request Timeout\r\n")

    def test_a_slow_body_is_answered_408(self):
        with Daemon() as daemon, daemon.socket() as connection:
            connection.sendall(post(JSON + b"Content-Length: 1000000\r\n", b"{"))
            connection.settimeout(0.5)
            answer = b""
            end = time.monotonic() + PATIENCE_S
            while not answer and time.monotonic() < end:
                try:
                    answer = connection.recv(4096)
                except TimeoutError:
                    connection.sendall(b" ")  # always something, never enough
            self.assertTrue(answer.startswith(b"HTTP/1.1 408 "), answer)

    def test_connections_beyond_a_limit_are_answered_503(self):
        for option, limit in (("--connections", 20), ("--connections-per-address", 5)):
            with self.subTest(option), Daemon(option, f"{limit}") as daemon, contextlib.ExitStack() as held:
                crowd = [held.enter_context(daemon.socket()) for _ in range(limit)]
                wait_until(lambda d=daemon: self.turned_away(d), "503 for one more connection")
                crowd.pop().close()
                wait_until(lambda d=daemon: not self.turned_away(d), "room for another")

    @staticmethod
    def turned_away(daemon):
        reply = daemon.get("/v1/version")
        if reply.status == 200:
            return False
        assert reply.status == 503 and json_of(reply)["type"] == "urn:whittle:problem:too_many_connections"
        assert int(reply.headers["Retry-After"]) > 0
        return True

    # UBSan needs a pipe to check whether an object is readable; without descriptors it reports every thrown one.
    @unittest.skipIf("undefined" in SANITIZED, "UBSan needs descriptors of its own")
    def test_exhausted_descriptors_end_no_connection(self):
        with Daemon() as daemon:
            wait_until(lambda: daemon.health("/readyz").status == 200, "the worker")
            open_now = len(list(pathlib.Path(f"/proc/{daemon.process.pid}/fd").iterdir()))
            resource.prlimit(daemon.process.pid, resource.RLIMIT_NOFILE, (open_now + 60, open_now + 60))
            crowd = [daemon.socket() for _ in range(100)]
            wait_until(lambda: daemon.log_rows("descriptors_exhausted"), "exhaustion")
            self.assertEqual(daemon.health("/readyz").status, 200, "the health port has descriptors")
            for connection in crowd:
                connection.close()
            wait_until(lambda: self.served(daemon), "service after the crowd has gone")

    @staticmethod
    def served(daemon):
        try:
            return daemon.get("/v1/version").status == 200
        except OSError:
            return False

    def test_slow_readers_of_an_image_occupy_neither_threads_nor_memory(self):
        with Daemon("--handler-threads", "1") as daemon:
            path = daemon.rendered(scene(2000, 1500, output={"formats": ["exr"]}))["links"]["image"]
            whole = daemon.get(path).body
            self.assertGreater(len(whole), 100_000)
            before = daemon.resident_bytes()
            readers = []
            for _ in range(50):
                connection = socket.socket()
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
                connection.connect(("127.0.0.1", daemon.port))
                connection.sendall(get(path.encode(), b"Host: localhost\r\nConnection: close\r\n"))
                readers.append(connection)
            for connection in readers:
                self.assertEqual(connection.recv(15), b"HTTP/1.1 200 OK")
            self.assertEqual(daemon.get("/v1/version").status, 200)
            self.assertLess(daemon.resident_bytes() - before, 16 << 20)
            rest = b"".join(iter(lambda: readers[0].recv(65536), b""))
            self.assertEqual(rest.partition(b"\r\n\r\n")[2], whole)
            for connection in readers:
                connection.close()

    def test_disconnected_clients_leak_nothing(self):
        with Daemon() as daemon:
            body = json.dumps(long_scene()).encode()
            whole = post(JSON + b"Content-Length: %d\r\n" % len(body), body, target=b"/v1/render")
            cuts = [0, 1, 30, len(whole) - 1, len(whole)]
            for _ in range(20):
                for cut in cuts:
                    with daemon.socket() as connection:
                        connection.sendall(whole[:cut])
            wait_until(lambda: daemon.metrics()["whittle_connections"] == 0, "the end of all connections")
