"""Modules of whittle-submit: sweeps, merge patches and batches, and the requests it sends (to a server with prepared responses)."""
import json
import os
import random
import socket
import subprocess
import sys
import threading
import unittest

from tests.http.webhooks_test import Handler, Receiver
from tests.reader.invalid_documents import merged
from tests.support.whittle import SOURCE, temporary_directory

sys.path.insert(0, str(SOURCE / "api/client"))
from whittle_submit.sweep import (  # pylint: disable=wrong-import-position
    Frame, InputError, NoMergePatch, batch_request, group_frames, merge_patch, parse_sweep, with_value)

SCRIPT = SOURCE / "api/client/whittle-submit"
JOB_ID = "0190a000-0000-7000-8000-000000000001"


class SweepParser(unittest.TestCase):
    def values(self, text):
        return parse_sweep("a=" + text)[1]

    def test_expands_ranges_with_both_ends_and_exact_steps(self):
        self.assertEqual(self.values("30..60:5"), [30, 35, 40, 45, 50, 55, 60])
        self.assertEqual(self.values("0..1:0.1"), [0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1])
        self.assertEqual(self.values("1..3"), [1, 2, 3])
        self.assertEqual(self.values("3..1"), [3, 2, 1])
        self.assertEqual(self.values("1..0:-.25"), [1, 0.75, 0.5, 0.25, 0])
        self.assertEqual(self.values("1..2:0.4"), [1, 1.4, 1.8])
        self.assertEqual(self.values("5..5"), [5])
        self.assertEqual([type(value) for value in self.values("1..2:0.5")], [int, float, int])

    def test_reads_lists_of_json_values_and_strings(self):
        self.assertEqual(self.values("1,2.5,-3"), [1, 2.5, -3])
        self.assertEqual(self.values("[0,1,6],[0,2,6]"), [[0, 1, 6], [0, 2, 6]])
        self.assertEqual(self.values("draft,fine"), ["draft", "fine"])
        self.assertEqual(self.values('"#ff0000",#00ff00,0.5,true'), ["#ff0000", "#00ff00", 0.5, True])
        self.assertEqual(self.values("7"), [7])

    def test_rejects_invalid_ranges_and_paths(self):
        for text in ("1..3:-1", "3..1:1", "1..2:0", "0..1e6"):
            with self.assertRaises(InputError):
                self.values(text)
        for text in ("a", "=1", "a..b=1", ".=1", "a=", "//=1"):
            with self.assertRaises(InputError):
                parse_sweep(text)

    def test_reads_paths_as_dotted_keys_or_json_pointers(self):
        self.assertEqual(parse_sweep("objects.0.radius=1")[0], ("objects", "0", "radius"))
        self.assertEqual(parse_sweep("/materials/a~1b.c/color=1")[0], ("materials", "a/b.c", "color"))


class WithValue(unittest.TestCase):
    def test_sets_a_value_in_a_copy_and_adds_missing_members(self):
        scene = {"camera": {"fov": 40}, "objects": [{"radius": 1}, {"radius": 2}]}
        self.assertEqual(with_value(scene, ("camera", "fov"), 30), {**scene, "camera": {"fov": 30}})
        self.assertEqual(with_value(scene, ("objects", "1", "radius"), 3)["objects"], [{"radius": 1}, {"radius": 3}])
        self.assertEqual(with_value(scene, ("accuracy", "preset"), "fine")["accuracy"], {"preset": "fine"})
        self.assertEqual(scene, {"camera": {"fov": 40}, "objects": [{"radius": 1}, {"radius": 2}]})
        for path in (("objects", "2", "radius"), ("objects", "x"), ("camera", "fov", "deep")):
            with self.assertRaises(InputError):
                with_value(scene, path, 1)


class MergePatch(unittest.TestCase):
    def documents(self):
        generator = random.Random(1)

        def value(depth):
            kind = generator.randrange(8 if depth < 4 else 5)
            if kind >= 6:
                return {generator.choice("abcd"): value(depth + 1) for _ in range(generator.randrange(4))}
            if kind == 5:
                return [value(depth + 1) for _ in range(generator.randrange(3))]
            return generator.choice([0, 1, 1.0, True, False, "a", "", None])

        for _ in range(4000):
            yield {name: value(0) for name in "abc"}, {name: value(0) for name in "bcd"}

    def test_produces_the_document_unless_it_assigns_null(self):
        patches = 0
        for base, document in self.documents():
            try:
                patch = merge_patch(base, document)
            except NoMergePatch:
                self.assertIn("null", json.dumps(document))
                continue
            self.assertEqual(json.dumps(merged(base, patch), sort_keys=True), json.dumps(document, sort_keys=True))
            patches += 1
        self.assertGreater(patches, 500)

    def test_omits_equal_members(self):
        base = {"a": {"b": 1, "c": [1, 2]}, "d": {}}
        self.assertEqual(merge_patch(base, {"a": {"b": 2, "c": [1, 2]}, "d": {}}), {"a": {"b": 2}})


class Batches(unittest.TestCase):
    def frames(self, count, scene="orbit", **document):
        return [Frame(f"{scene}-{i}", scene, {**document, "i": i}, str(i), {}) for i in range(count)]

    def test_hold_consecutive_frames_of_one_scene_up_to_the_limits_of_a_request(self):
        orbit, alone = self.frames(2500), self.frames(1, "alone")
        self.assertEqual([len(batch) for batch in group_frames(orbit + alone + self.frames(2, "zoom"))], [1000, 1000, 500, 1, 2])
        self.assertEqual([frame for batch in group_frames(orbit) for frame in batch], orbit)
        heavy = self.frames(70, text="x" * (1 << 20))
        self.assertEqual([len(batch) for batch in group_frames(heavy)], [63, 7], "64 MiB of documents")
        self.assertEqual([len(batch) for batch in group_frames([*orbit[:2], Frame("n", "orbit", {"i": None}, "n", {}), *orbit[2:4]])],
                         [2, 3], "a null starts a batch")

    def test_reproduce_the_documents_from_scene_and_patches(self):
        documents = [{"camera": {"fov": fov}, "objects": [1, 2]} for fov in (30, 40, 50)]
        body = batch_request("orbit", documents)
        self.assertEqual([merged(body["scene"], patch) for patch in body["frames"]], documents)
        self.assertEqual(body["frames"], [{}, {"camera": {"fov": 40}}, {"camera": {"fov": 50}}])


class PreparedHandler(Handler):
    """Responds to the first submissions with the answers of its Receiver; the job then fails."""

    protocol_version = "HTTP/1.1"

    def respond(self):
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        self.server.seen.append((self.command, self.path, dict(self.headers), body))
        status, headers = 200, {}
        if self.command == "POST" and self.server.answers:
            status, headers = self.server.answers.pop(0)
        job = {"id": JOB_ID, "state": "failed", "problem": {"code": "internal", "detail": "as prepared", "errors": []}}
        content = json.dumps({"detail": "unavailable"} if status >= 400 else job).encode()
        if "?" in self.path:
            content = b'{"items": [], "next_cursor": null}'
        self.send_response(status)
        for name, value in {"Content-Length": len(content), **headers}.items():
            self.send_header(name, str(value))
        self.end_headers()
        self.wfile.write(content)

    do_GET = do_POST = do_PUT = respond


class Requests(unittest.TestCase):
    def run_script(self, url, *arguments, environment=None):
        directory = temporary_directory(self)
        (directory / "a.json").write_text('{"version": 1}', encoding="utf-8")
        (directory / "key").write_text("from-a-file\n", encoding="utf-8")
        return subprocess.run(["/usr/bin/python3", SCRIPT, "a.json", "--server", url, *arguments], cwd=directory, capture_output=True,
                              text=True, check=False, timeout=600, env={**os.environ, **(environment or {})})

    def submit(self, *arguments, responses=(), environment=None):
        with Receiver(*responses, handler=PreparedHandler) as server:
            return self.run_script(server.url("/prefix/"), *arguments, environment=environment), server.seen

    def test_carry_the_key_of_the_environment_or_file_and_the_path_of_the_server(self):
        for arguments, environment, key in (((), {}, None), ((), {"WHITTLE_KEY": "from-outside"}, "Bearer from-outside"),
                                            (("--key-file", "key"), {"WHITTLE_KEY": "other"}, "Bearer from-a-file")):
            done, requests = self.submit(*arguments, environment=environment)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertEqual({headers.get("Authorization") for _, _, headers, _ in requests}, {key})
            self.assertEqual([path.partition("?")[0] for _, path, _, _ in requests],
                             ["/prefix/v1/jobs", "/prefix/v1/events", "/prefix/v1/jobs", f"/prefix/v1/jobs/{JOB_ID}"])
            self.assertNotIn("from-", done.stderr + done.stdout)

    def test_repeat_a_submission_with_the_same_idempotency_key(self):
        done, requests = self.submit(responses=[(503, {"Retry-After": "0"}), (429, {}), (502, {}), (202, {})])
        posts = [(headers["Idempotency-Key"], body) for method, _, headers, body in requests if method == "POST"]
        self.assertEqual(len(posts), 4)
        self.assertEqual(len(set(posts)), 1)
        self.assertIn("unavailable", done.stderr)
        self.assertIn("a: internal: as prepared", done.stderr)

    def test_over_the_wrong_protocol_end_at_once_with_advice(self):
        alert = b"\x15\x03\x01\x00\x02\x02\x46"  # protocol_version
        for scheme, reply, advice in (("https", b"HTTP/1.1 400 Bad Request\r\n\r\n", "does not use TLS: use http://"),
                                      ("http", alert, "uses TLS: use https://")):
            with self.subTest(scheme), socket.create_server(("127.0.0.1", 0)) as server:
                def answer(listener=server, content=reply):
                    connection, _ = listener.accept()
                    with connection:
                        connection.recv(1 << 16)
                        connection.sendall(content)
                threading.Thread(target=answer, daemon=True).start()
                done = self.run_script(f"{scheme}://127.0.0.1:{server.getsockname()[1]}")
                self.assertNotEqual(done.returncode, 0)
                self.assertIn(advice, done.stderr)

    def test_rejected_for_the_key_end_the_run_with_exit_code_3(self):
        for status in (401, 403):
            done, _ = self.submit(responses=[(status, {})])
            self.assertEqual(done.returncode, 3, done.stderr)
            self.assertIn("does not accept jobs", done.stderr)
