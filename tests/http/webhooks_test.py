"""Webhooks: signed deliveries of the end of jobs, also over kills of the daemon, and never to private addresses."""
import base64
import hashlib
import hmac
import http.server
import json
import threading
import unittest

from tests.http.daemon import Daemon, failed, json_of, long_scene, scene, wait_until, whittled
from tests.support.whittle import temporary_directory

SECRET = bytes(range(32))
SECRET_TEXT = "whsec_" + base64.b64encode(SECRET).decode()
JOB_SCHEMA_PARTS = ("id", "name", "state", "report", "artifacts", "problem", "links")


class Receiver(http.server.ThreadingHTTPServer):
    """Replies to POSTs with these (status, headers), then 204, and records them. A status "endless" never ends."""

    def __init__(self, *answers, handler=None):
        super().__init__(("127.0.0.1", 0), handler or Handler)
        self.answers = list(answers)
        self.seen = []  # (path, headers, body)
        threading.Thread(target=self.serve_forever, args=(0.01,), daemon=True).start()

    def __exit__(self, *error):
        self.shutdown()
        super().__exit__(*error)

    def url(self, path="/done", host="127.0.0.1"):
        return f"http://{host}:{self.server_port}{path}"


class Handler(http.server.BaseHTTPRequestHandler):
    def answer(self):
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        self.server.seen.append((self.path, {name.lower(): value for name, value in self.headers.items()}, body))
        status, headers = self.server.answers.pop(0) if self.server.answers else (204, {})
        if status == "endless":
            self.send_response(200)
            self.end_headers()
            try:
                while True:
                    self.wfile.write(b"x" * 10_000)
            except OSError:
                return
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()

    do_POST = do_GET = answer

    def log_message(self, *_):
        pass


class WithReceiver(unittest.TestCase):
    def setUp(self):
        self.directory = temporary_directory(self)
        (self.directory / "secret").write_text(SECRET_TEXT + "\n", encoding="ascii")

    def receiver(self, *answers):
        return self.enterContext(Receiver(*answers))

    def daemon(self, *options, networks="127.0.0.0/8", environment=None):
        return self.enterContext(Daemon("--webhook-secret-file", self.directory / "secret", "--webhook-networks", networks,
                                        *options, environment=environment))

    def submit(self, daemon, url, events=None, **changes):
        webhook = {"url": url, **({"events": events} if events else {})}
        return daemon.submit({**scene(), **changes, "job": {"webhook": webhook, "cache": "off"}})

    @staticmethod
    def deliveries(daemon, job_id):
        return json_of(daemon.get(f"/v1/jobs/{job_id}/deliveries"))["items"]

    def wait_for_attempt(self, daemon, job_id):
        """Waits for the first attempt and returns the only delivery of the job."""
        def attempted():
            found = self.deliveries(daemon, job_id)
            return found[0] if found and found[0]["attempts"] else None
        return wait_until(attempted, f"an attempt for {job_id}")

    def assert_signed(self, headers, body):
        signed = f"{headers['webhook-id']}.{headers['webhook-timestamp']}.".encode() + body
        expected = base64.b64encode(hmac.new(SECRET, signed, hashlib.sha256).digest()).decode()
        self.assertEqual(headers["webhook-signature"], "v1," + expected)


class Delivery(WithReceiver):
    def test_is_signed_and_contains_the_job(self):
        receiver = self.receiver()
        daemon = self.daemon("--jobs", "1")
        running = self.submit(daemon, receiver.url("/cancelled"), **{k: v for k, v in long_scene().items() if k != "name"})
        daemon.wait_for_state(running, "running")
        daemon.request("POST", f"/v1/jobs/{running}/cancel")
        succeeded = self.submit(daemon, receiver.url("/succeeded?key=1"))
        wait_until(lambda: len(receiver.seen) == 2, "two messages")
        ends = {path: (headers, body) for path, headers, body in receiver.seen}
        for path, job_id, state in (("/cancelled", running, "cancelled"), ("/succeeded?key=1", succeeded, "succeeded")):
            headers, body = ends[path]
            self.assert_signed(headers, body)
            self.assertEqual(headers["content-type"], "application/json")
            self.assertNotIn("expect", headers)
            message = json.loads(body)
            self.assertEqual(set(message), {"type", "timestamp", "data"})
            self.assertEqual(message["type"], f"job.{state}")
            sent, kept = message["data"], daemon.job(job_id)
            self.assertEqual({name: sent[name] for name in JOB_SCHEMA_PARTS}, {name: kept[name] for name in JOB_SCHEMA_PARTS})
            delivery = self.wait_for_attempt(daemon, job_id)
            self.assertEqual((delivery["state"], delivery["event"], delivery["attempts"][0]["status"]),
                             ("delivered", f"job.{state}", 204))
            self.assertEqual(delivery["id"], headers["webhook-id"])
        self.assertNotIn(SECRET_TEXT, daemon.log())

    def test_continues_after_kills_with_the_same_message(self):
        receiver = self.receiver((500, {}))
        daemon = self.daemon("--jobs", "1")
        first = self.submit(daemon, receiver.url("/first"))
        self.wait_for_attempt(daemon, first)
        running = self.submit(daemon, receiver.url("/second"), image={"width": 900, "height": 700})
        daemon.restart()
        daemon.wait_for_end(running)
        wait_until(lambda: {path for path, _, _ in receiver.seen[1:]} >= {"/first", "/second"}, "both messages")
        messages = [(headers["webhook-id"], body) for path, headers, body in receiver.seen if path == "/first"]
        self.assertEqual(len(messages), 2)
        self.assertEqual(messages[0], messages[1])
        for _, headers, body in receiver.seen:
            self.assert_signed(headers, body)
        wait_until(lambda: self.deliveries(daemon, first)[0]["state"] == "delivered", "the note of the second attempt")
        (delivery,) = self.deliveries(daemon, first)
        self.assertEqual([attempt["status"] for attempt in delivery["attempts"]], [500, 204])


class AddressFilter(WithReceiver):
    def assert_not_reached(self, daemon, receiver, url):
        delivery = self.wait_for_attempt(daemon, self.submit(daemon, url))
        self.assertEqual(delivery["state"], "pending", url)
        self.assertIsNone(delivery["attempts"][0]["status"], url)
        self.assertIsNotNone(delivery["next_attempt_at"])
        self.assertEqual(receiver.seen, [], url)
        return delivery["attempts"][0]["detail"]

    def test_blocks_private_addresses_in_any_notation(self):
        receiver = self.receiver()
        daemon = self.daemon(networks="")
        port = receiver.server_port
        for host in ("127.0.0.1", "localhost", "127.1", "2130706433", "0x7f.1", "0177.0.0.1", "[::1]", "[::ffff:127.0.0.1]",
                     "0.0.0.0", "169.254.169.254", "10.0.0.1", "[fe80::1]", "[fd00::1]", "LOCALHOST", "127.0.0.1."):
            detail = self.assert_not_reached(daemon, receiver, f"http://{host}:{port}/")
            self.assertRegex(detail, "is not public|resolve|URL", host)
        self.assertRegex(self.assert_not_reached(daemon, receiver, receiver.url(host="localhost")),
                         r"address (127\.0\.0\.1|::1) is not public")

    def test_ignores_proxies_of_the_environment(self):
        proxy = self.receiver()
        daemon = self.daemon(networks="", environment={name: proxy.url("") for name in ("http_proxy", "HTTP_PROXY", "ALL_PROXY")})
        self.assertIn("not public", self.assert_not_reached(daemon, proxy, "http://10.0.0.1/"))

    def test_follows_no_redirects(self):
        other = self.receiver()
        receiver = self.receiver((302, {"Location": other.url()}), (307, {"Location": other.url()}))
        daemon = self.daemon()
        for status in (302, 307):
            delivery = self.wait_for_attempt(daemon, self.submit(daemon, receiver.url()))
            self.assertEqual((delivery["state"], delivery["attempts"][0]["status"]), ("pending", status))
        self.assertEqual(other.seen, [])

    def test_limits_endless_replies(self):
        receiver = self.receiver(("endless", {}))
        daemon = self.daemon()
        delivery = self.wait_for_attempt(daemon, self.submit(daemon, receiver.url()))
        self.assertIn("more than 65536 bytes", delivery["attempts"][0]["detail"])

    def test_daemon_stops_while_a_receiver_is_silent(self):
        receiver = self.receiver()
        lock = threading.Event()
        self.addCleanup(lock.set)
        receiver.RequestHandlerClass = type("Silent", (Handler,), {"do_POST": lambda _: lock.wait(600)})
        daemon = self.daemon()
        daemon.wait_for_end(self.submit(daemon, receiver.url()))
        self.assertEqual(daemon.terminate(), 0)


class Options(WithReceiver):
    def test_without_a_secret_webhooks_are_rejected(self):
        with Daemon() as daemon:
            reply = daemon.request("POST", "/v1/jobs", scene(job={"webhook": {"url": "https://example.com/"}}))
            (issue,) = json_of(reply, 422)["errors"]
            self.assertEqual((issue["pointer"], issue["code"]), ("#/job/webhook", "unsupported"))
            self.assertIn("--webhook-secret-file", issue["detail"])

    def test_an_invalid_secret_is_not_shown(self):
        bad = self.directory / "bad"
        bad.write_text("whsec_c2hvcnQgYnV0IHNlY3JldA==", encoding="ascii")
        error = failed(whittled("--check-config", "--webhook-secret-file", bad), 2)
        self.assertRegex(error, "whittled: --webhook-secret-file: .*24 to 64 bytes")
        self.assertNotIn("c2hvcnQ", error)


class Calls(WithReceiver):
    def test_are_repeated_on_request_with_the_same_id_and_body(self):
        receiver = self.receiver((410, {}))  # abandoned at once
        daemon = self.daemon()
        job_id = self.submit(daemon, receiver.url())
        refused = wait_until(lambda: [each for each in self.deliveries(daemon, job_id) if each["state"] == "abandoned"], "the refused delivery")
        reply = daemon.request("POST", f"/v1/jobs/{job_id}/deliveries/{refused[0]['id']}/redeliver")
        self.assertEqual(reply.status, 202)
        (delivered,) = wait_until(lambda: [each for each in self.deliveries(daemon, job_id) if each["state"] == "delivered"], "the second delivery")
        self.assertEqual([attempt["status"] for attempt in delivered["attempts"]], [410, 204])
        first, second = receiver.seen
        self.assertEqual((first[1]["webhook-id"], first[2]), (second[1]["webhook-id"], second[2]))

    def test_can_be_tested_without_a_job_or_retries(self):
        receiver = self.receiver((204, {}), (500, {}))
        daemon = self.daemon()
        for state, status in (("delivered", 204), ("abandoned", 500)):
            reply = daemon.request("POST", "/v1/webhooks/test", {"url": receiver.url()})
            self.assertEqual(reply.status, 202)
            def result(path=reply.headers["Location"]):
                return json_of(daemon.get(path))["items"][0]
            wait_until(lambda s=state, r=result: r()["state"] == s, state)
            self.assertEqual((result()["event"], [attempt["status"] for attempt in result()["attempts"]]), ("webhook.test", [status]))
        self.assertEqual([json.loads(body)["type"] for _, _, body in receiver.seen], ["webhook.test"] * 2)
