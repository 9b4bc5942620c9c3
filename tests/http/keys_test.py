"""Access to the daemon: keys and their scopes, and without keys this machine's users alone."""
import re
import signal
import unittest

from tests.http.daemon import FAR, NOBODY, Daemon, OneDaemon, failed, json_of, scene, wait_until, whittled
from tests.support.whittle import succeeded, temporary_directory


def bearer(key):
    return {"Authorization": f"Bearer {key}"}


def new_key(path, name, *scopes):
    """The key itself."""
    options = ("--scopes", ",".join(scopes)) if scopes else ()
    return succeeded(whittled("--new-key", name, *options, "--keys", path)).stdout.strip()


class WithKeys(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.directory = temporary_directory(cls)
        cls.path = cls.directory / "keys"
        cls.keys = {"reader": new_key(cls.path, "reader", "jobs:read"), "writer": new_key(cls.path, "writer", "jobs:write"),
                    "both": new_key(cls.path, "both"), "busy": new_key(cls.path, "busy"), "admin": new_key(cls.path, "boss", "admin")}
        cls.daemon = cls.enterClassContext(Daemon("--keys", cls.path, "--key-queued-jobs", "7", "--key-artifact-bytes", "1000000"))

    def send(self, key, method="GET", path="/v1/jobs", body=None, scheme="Bearer"):
        headers = {} if key is None else {"Authorization": f"{scheme} {self.keys.get(key, key)}"}
        return self.daemon.request(method, path, body, headers)

    assert_problem = OneDaemon.assert_problem

    def test_nobody_gets_in_without_a_key_that_is_known_and_sent_as_one(self):
        for method, path, body in (("GET", "/v1/jobs", None), ("POST", "/v1/jobs", scene()), ("POST", "/v1/render", scene()),
                                   ("GET", "/v1/version", None), ("GET", "/v1/events", None), ("HEAD", "/v1/jobs", None)):
            reply = self.send(None, method, path, body)
            self.assertEqual(reply.status, 401, path)
            self.assertEqual(reply.headers["WWW-Authenticate"], "Bearer")
        for key, scheme in ((None, ""), ("whittle_" + "0" * 64, "Bearer"), ("both", "Basic")):
            self.assert_problem(self.send(key, scheme=scheme), 401, "unauthenticated")
        self.assertEqual(self.send("both", scheme="bearer").status, 200)

    def test_a_body_is_not_even_read_without_a_key(self):
        with self.daemon.socket() as connection:
            connection.sendall(b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                               b"Content-Length: 60000000\r\n\r\n")
            self.assertEqual(connection.makefile("rb").readline(), b"HTTP/1.1 401 Unauthorized\r\n")

    def test_scopes_decide_who_reads_and_who_writes(self):
        for key in ("reader", "admin"):
            self.assertEqual(self.send(key).status, 200, key)
        for key in ("both", "writer", "admin"):
            self.assertEqual(self.send(key, "POST", "/v1/jobs", scene()).status, 202, key)
        for key, method, body in (("reader", "POST", scene()), ("writer", "GET", None)):
            reply = self.send(key, method, "/v1/jobs", body)
            problem = self.assert_problem(reply, 403, "forbidden")
            self.assertRegex(problem["detail"], r"scope jobs:(read|write)$")
            self.assertEqual(reply.headers["WWW-Authenticate"], 'Bearer error="insufficient_scope"')
        self.assert_problem(self.send("reader", "DELETE", f"/v1/jobs/{NOBODY}"), 403, "forbidden")

    def test_each_key_can_read_what_it_is_and_has(self):
        for key, name, scopes in (("reader", "reader", ["jobs:read"]), ("writer", "writer", ["jobs:write"]),
                                  ("both", "both", ["jobs:read", "jobs:write"]),
                                  ("admin", "boss", ["jobs:read", "jobs:write", "admin"])):
            reply = self.send(key, path="/v1/me")
            me = json_of(reply)
            self.assertEqual((reply.headers["Cache-Control"], me["name"], me["scopes"]), ("no-store", name, scopes))
            self.assertEqual(me["quotas"], {"queued_jobs": 7, "artifact_bytes": 1_000_000})
        self.assert_problem(self.send("nobody", path="/v1/me"), 401, "unauthenticated")
        self.assert_problem(self.send("writer", path="/v1/queue"), 403, "forbidden")
        self.assertEqual(self.send("reader", "DELETE", "/v1/me").status, 405)
        later, done = (json_of(self.send("busy", "POST", "/v1/jobs", document))["id"] for document in (scene(job={"run_after": FAR}), scene()))
        self.send("busy", path=f"/v1/jobs/{done}?wait=60")
        used = json_of(self.send("busy", path="/v1/me"))["used"]
        self.assertEqual(used["queued_jobs"], 1)
        self.assertGreater(used["artifact_bytes"], 50)
        self.assertEqual(json_of(self.send("reader", path="/v1/me"))["used"], {"queued_jobs": 0, "artifact_bytes": 0})
        jobs = json_of(self.send("reader", path="/v1/jobs?owner=busy"))["items"]
        self.assertEqual([(job["id"], job["owner"]) for job in jobs], [(done, "busy"), (later, "busy")])

    def test_readers_see_views_and_animations_of_others_and_writers_compare_them(self):
        batch = json_of(self.send("both", "POST", "/v1/batches", {"scene": scene(), "frames": [{}, {}]}))
        jobs = [job["id"] for job in json_of(self.send("both", path=batch["links"]["jobs"]))["items"]]
        for job in jobs:
            self.send("both", path=f"/v1/jobs/{job}?wait=60")
        animation = f"/v1/batches/{batch['id']}/animation.apng"
        for path in (f"/v1/jobs/{jobs[0]}/view.png", animation, animation + "?max=16"):
            self.assertEqual(self.send("reader", path=path).status, 200, path)
        pair = {"a": jobs[0], "b": jobs[1]}
        self.assert_problem(self.send("reader", "POST", "/v1/compare", pair), 403, "forbidden")
        self.assertEqual(json_of(self.send("admin", "POST", "/v1/compare", pair))["rmse"], 0)

    def test_a_ticket_reads_one_path_without_a_key(self):
        job = json_of(self.send("both", "POST", "/v1/jobs", scene()))["id"]
        self.send("both", path=f"/v1/jobs/{job}?wait=60")
        path = f"/v1/jobs/{job}/view.png?max=16"
        self.assert_problem(self.send(None, "POST", "/v1/tickets", {"path": path}), 401, "unauthenticated")
        self.assert_problem(self.send("writer", "POST", "/v1/tickets", {"path": path}), 403, "forbidden")
        reply = self.send("reader", "POST", "/v1/tickets", {"path": path})
        self.assertEqual((reply.status, reply.headers["Cache-Control"]), (200, "no-store"), reply.body)
        url = json_of(reply)["url"]
        self.assertTrue(url.startswith(path + "&ticket=reader."), url)
        self.assertEqual(self.send(None, path=url).body, self.send("reader", path=path).body)
        self.assertEqual(self.send(None, "HEAD", url).status, 200)
        ticket = url.split("ticket=")[1]
        other = url[:-1] + ("0" if url[-1] != "0" else "1")
        for wrong in (other, f"/v1/jobs/{job}?ticket={ticket}", url.replace("reader.", "both."), url.replace("=reader.", "=reader.9")):
            self.assert_problem(self.send(None, path=wrong), 401, "unauthenticated")
        for method, body in (("DELETE", None), ("POST", {})):
            self.assert_problem(self.send(None, method, f"/v1/jobs/{job}?ticket={ticket}", body), 401, "unauthenticated")
        for bad in ("/metrics", "http://127.0.0.1/v1/jobs", "/v1/jobs#x", "/v1/a b"):
            self.assert_problem(self.send("reader", "POST", "/v1/tickets", {"path": bad}), 422, "invalid_request")
        self.assertNotIn(ticket, self.daemon.log())

    def test_what_the_service_is_and_how_it_does_needs_no_key(self):
        for path in ("/", "/docs", "/docs/scene", "/openapi.json"):
            self.assertEqual(self.send(None, path=path).status, 200)
        for path in ("/healthz", "/metrics"):
            self.assertEqual(self.daemon.health(path).status, 200)

    def test_the_log_names_the_key_of_a_request(self):
        request_id = self.send("reader").headers["X-Request-Id"]
        rows = wait_until(lambda: [row for row in self.daemon.log_rows() if row.get("request_id") == request_id], "the line")
        self.assertEqual(rows[0]["key"], "reader")

    def test_neither_file_nor_log_has_a_key(self):
        for key in self.keys.values():
            self.assertRegex(key, r"^whittle_[0-9a-f]{64}$")
            self.assertNotIn(key, self.path.read_text())
            self.assertNotIn(key, self.daemon.log())
        self.assertEqual(self.path.stat().st_mode & 0o777, 0o600)

    def test_the_file_is_read_again_on_sighup_and_a_wrong_one_changes_nothing(self):
        path = self.directory / "changing"
        old = new_key(path, "old")
        with Daemon("--keys", path) as daemon:
            def status(key):
                return daemon.request("GET", "/v1/jobs", headers=bearer(key)).status
            self.assertEqual(status(old), 200)
            new = new_key(path, "new")
            self.assertEqual(status(new), 401)
            daemon.process.send_signal(signal.SIGHUP)
            wait_until(lambda: status(new) == 200, "the new key")
            path.write_text("new jobs:read nonsense\n")
            daemon.process.send_signal(signal.SIGHUP)
            wait_until(lambda: daemon.log_rows("key_reload_failed"), "the complaint")
            self.assertEqual(status(old), 200)
            path.write_text("")
            third = new_key(path, "third")
            daemon.process.send_signal(signal.SIGHUP)
            wait_until(lambda: status(third) == 200, "the third key")
            self.assertEqual((status(old), status(new)), (401, 401))

    def test_a_removed_key_loses_the_request_that_is_being_sent(self):
        path = self.directory / "sending"
        sender, _ = new_key(path, "sender"), new_key(path, "other")
        with Daemon("--keys", path) as daemon, daemon.socket() as connection:
            connection.sendall(b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 1000\r\n"
                               b"Expect: 100-continue\r\nAuthorization: Bearer " + sender.encode() + b"\r\n\r\n")
            lines = connection.makefile("rb")
            self.assertEqual(lines.readline() + lines.readline(), b"HTTP/1.1 100 Continue\r\n\r\n")
            path.write_text("".join(line for line in path.read_text().splitlines(True) if line.startswith("other")))
            daemon.process.send_signal(signal.SIGHUP)
            self.assertEqual(lines.readline(), b"HTTP/1.1 401 Unauthorized\r\n")

    def test_a_removed_key_loses_its_streams_and_long_polls(self):
        path = self.directory / "removed"
        keys = {name: bearer(new_key(path, name)) for name in ("kept", "gone")}
        with Daemon("--keys", path) as daemon:
            def opened(key, route, **headers):
                return self.enterContext(daemon.sent("GET", route, None, {**keys[key], **headers}))

            job = json_of(daemon.request("POST", "/v1/jobs", scene(job={"run_after": FAR}), keys["kept"]))["links"]["self"]
            etag = daemon.request("GET", job, None, keys["kept"]).headers["ETag"]
            streams = {key: opened(key, "/v1/events").getresponse() for key in keys}
            polls = {key: opened(key, job + "?wait=60", **{"If-None-Match": etag}) for key in keys}
            path.write_text("".join(line for line in path.read_text().splitlines(True) if not line.startswith("gone")))
            daemon.process.send_signal(signal.SIGHUP)
            self.assertEqual(polls["gone"].getresponse().status, 401)
            streams["gone"].read()  # to its end
            daemon.request("POST", job + "/cancel", None, keys["kept"])
            self.assertEqual(polls["kept"].getresponse().status, 200)
            self.assertTrue(any(b'"cancelled"' in line for line in iter(streams["kept"].readline, b"")))

    def test_a_key_for_a_file_elsewhere_has_its_line_on_stdout(self):
        made = succeeded(whittled("--new-key", "ann", "--scopes", "jobs:read", "--keys", "-"))
        self.assertRegex(made.stdout, r"\Aann jobs:read [0-9a-f]{64}\n\Z")
        key = re.match(r"whittle_[0-9a-f]{64}$", made.stderr, re.MULTILINE).group()
        path = self.directory / "elsewhere"
        path.write_text(made.stdout, encoding="ascii")
        with Daemon("--keys", path) as daemon:
            self.assertEqual(daemon.request("GET", "/v1/jobs", headers=bearer(key)).status, 200)

    def test_errors_in_the_file_are_reported_at_the_start_all_at_once(self):
        path = self.directory / "wrong"
        digits = "0" * 64
        path.write_text(f"# keys\nann jobs:read {digits}\nbob jobs:all {digits}\nb*b admin {digits}\nsue admin 12\nann admin\n"
                        f"joe admin {digits}\n")
        for task in ((), ("--check-config",)):
            error = failed(whittled(*task, "--keys", path, "--data", self.directory / "data"), 2)
            lines = re.findall(r"^whittled: --keys: .*wrong:(\d): ", error, re.MULTILINE)
            self.assertEqual(lines, ["3", "4", "5", "6", "7"], error)
        path.write_text("# none\n")
        self.assertIn("no key", whittled("--check-config", "--keys", path).stderr)
        self.assertIn("cannot read", whittled("--check-config", "--keys", self.directory / "absent").stderr)

    def test_new_keys_need_a_name_scopes_and_a_file(self):
        error = failed(whittled("--new-key", "a b", "--scopes", "jobs:all"), 2)
        for part in ("--new-key: the name", "--scopes: must be", "--new-key: needs --keys"):
            self.assertIn(part, error)
        self.assertEqual(whittled("--new-key", "a", "--keys", self.directory / "no" / "directory").returncode, 1)
        self.assertEqual(whittled("--scopes", "admin", "--check-config").returncode, 2)


class WithoutKeys(OneDaemon):
    def test_requests_for_other_hosts_are_refused(self):
        host = {"Host": "127.0.0.1.evil.example.com"}
        self.assert_problem(self.daemon.request("GET", "/v1/version", headers=host), 421, "misdirected_request")
        self.assertEqual(self.daemon.request("GET", "/metrics", headers=host, port=self.daemon.health_port).status, 421)

    def test_a_page_of_another_site_changes_nothing(self):
        job = f"/v1/jobs/{self.daemon.submit(scene(job={'run_after': FAR}))}"
        for method, path in (("POST", f"{job}/cancel"), ("POST", "/v1/render"), ("DELETE", job)):
            self.assert_problem(self.daemon.request(method, path, headers={"Origin": "https://evil.example.com"}), 403, "cross_site_request")
        self.assertEqual(json_of(self.daemon.request("GET", job, headers={"Sec-Fetch-Site": "cross-site"}))["state"], "queued")
        own = {"Sec-Fetch-Site": "same-origin", "Origin": f"http://127.0.0.1:{self.daemon.port}"}
        self.assertEqual(self.daemon.request("POST", f"{job}/cancel", headers=own).status, 202)

    def test_pages_of_other_sites_cannot_show_its_replies(self):
        job = json_of(self.daemon.request("POST", "/v1/jobs", scene(), {"Prefer": "wait=60"}))
        for path in (job["links"]["image"], job["links"]["preview"], "/v1/jobs", "/none"):
            for method in ("GET", "HEAD"):
                reply = self.daemon.request(method, path)
                self.assertEqual(reply.headers["Cross-Origin-Resource-Policy"], "same-origin", path)
        self.assertEqual(self.daemon.health("/metrics").headers["Cross-Origin-Resource-Policy"], "same-origin")

    def test_sighup_changes_nothing(self):
        self.daemon.process.send_signal(signal.SIGHUP)
        self.assertEqual(self.daemon.get("/v1/version").status, 200)
