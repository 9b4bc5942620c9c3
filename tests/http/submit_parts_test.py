"""Parts of whittle-submit alone: what values a --set means, which frames go together, and what it sends to a service,
which is a stub here."""
import http.server
import json
import os
import pathlib
import random
import subprocess
import sys
import tempfile
import threading
import unittest

from tests.support.whittle import SOURCE

sys.path.insert(0, str(SOURCE / "api/client"))
from whittle_submit.batches import NoPatch, batch_request, merge_patch, submissions  # pylint: disable=wrong-import-position
from whittle_submit.frames import Frame  # pylint: disable=wrong-import-position
from whittle_submit.sweep import BadSweep, read_sweep, with_value  # pylint: disable=wrong-import-position

SCRIPT = SOURCE / "api/client/whittle-submit"
JOB_ID = "0190a000-0000-7000-8000-000000000001"


class Sweeps(unittest.TestCase):
    def values(self, text):
        return read_sweep("a=" + text)[1]

    def test_of_a_range_have_both_ends_and_exact_steps(self):
        self.assertEqual(self.values("30..60:5"), [30, 35, 40, 45, 50, 55, 60])
        self.assertEqual(self.values("0..1:0.1"), [0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1])
        self.assertEqual(self.values("1..3"), [1, 2, 3])
        self.assertEqual(self.values("3..1"), [3, 2, 1])
        self.assertEqual(self.values("1..0:-.25"), [1, 0.75, 0.5, 0.25, 0])
        self.assertEqual(self.values("1..2:0.4"), [1, 1.4, 1.8])
        self.assertEqual(self.values("5..5"), [5])
        self.assertEqual([type(value) for value in self.values("1..2:0.5")], [int, float, int])

    def test_of_a_list_are_json_or_words(self):
        self.assertEqual(self.values("1,2.5,-3"), [1, 2.5, -3])
        self.assertEqual(self.values("[0,1,6],[0,2,6]"), [[0, 1, 6], [0, 2, 6]])
        self.assertEqual(self.values("draft,fine"), ["draft", "fine"])
        self.assertEqual(self.values('"#ff0000",#00ff00,0.5,true'), ["#ff0000", "#00ff00", 0.5, True])
        self.assertEqual(self.values("7"), [7])

    def test_that_lead_nowhere_or_too_far_are_refused(self):
        for text in ("1..3:-1", "3..1:1", "1..2:0", "0..1e6"):
            with self.assertRaises(BadSweep):
                self.values(text)
        for text in ("a", "=1", "a..b=1", ".=1", "a=", "//=1"):
            with self.assertRaises(BadSweep):
                read_sweep(text)

    def test_places_are_keys_with_dots_or_a_json_pointer(self):
        self.assertEqual(read_sweep("objects.0.radius=1")[0], ("objects", "0", "radius"))
        self.assertEqual(read_sweep("/materials/a~1b.c/color=1")[0], ("materials", "a/b.c", "color"))

    def test_are_set_in_a_copy_and_may_add_what_was_not_there(self):
        scene = {"camera": {"fov": 40}, "objects": [{"radius": 1}, {"radius": 2}]}
        self.assertEqual(with_value(scene, ("camera", "fov"), 30), {**scene, "camera": {"fov": 30}})
        self.assertEqual(with_value(scene, ("objects", "1", "radius"), 3)["objects"], [{"radius": 1}, {"radius": 3}])
        self.assertEqual(with_value(scene, ("accuracy", "preset"), "fine")["accuracy"], {"preset": "fine"})
        self.assertEqual(scene, {"camera": {"fov": 40}, "objects": [{"radius": 1}, {"radius": 2}]})
        for path in (("objects", "2", "radius"), ("objects", "x"), ("camera", "fov", "deep")):
            with self.assertRaises(KeyError):
                with_value(scene, path, 1)


def patched(target, patch):
    """RFC 7396, section 2, as it is written there."""
    if not isinstance(patch, dict):
        return patch
    target = dict(target) if isinstance(target, dict) else {}
    for name, value in patch.items():
        if value is None:
            target.pop(name, None)
        else:
            target[name] = patched(target.get(name), value)
    return target


class Patches(unittest.TestCase):
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

    def test_make_of_a_document_the_other_unless_a_null_says_what_they_cannot(self):
        told = 0
        for base, document in self.documents():
            try:
                patch = merge_patch(base, document)
            except NoPatch:
                self.assertIn("null", json.dumps(document))
                continue
            self.assertEqual(json.dumps(patched(base, patch), sort_keys=True), json.dumps(document, sort_keys=True))
            told += 1
        self.assertGreater(told, 500)

    def test_say_nothing_of_what_is_the_same(self):
        base = {"a": {"b": 1, "c": [1, 2]}, "d": {}}
        self.assertEqual(merge_patch(base, {"a": {"b": 2, "c": [1, 2]}, "d": {}}), {"a": {"b": 2}})

    def frames(self, count, batch="orbit", **document):
        return [Frame(f"{batch}-{i}", batch, {**document, "i": i}, str(i), {}) for i in range(count)]

    def test_of_one_scene_go_together_up_to_what_a_request_holds(self):
        orbit, alone = self.frames(2500), self.frames(1, "alone")
        self.assertEqual([len(batch) for batch in submissions(orbit + alone + self.frames(2, "zoom"))], [1000, 1000, 500, 1, 2])
        self.assertEqual([frame for batch in submissions(orbit) for frame in batch], orbit)
        heavy = self.frames(70, text="x" * (1 << 20))
        self.assertEqual([len(batch) for batch in submissions(heavy)], [63, 7], "of 64 MiB as documents")
        self.assertEqual([len(batch) for batch in submissions([*orbit[:2], Frame("n", "orbit", {"i": None}, "n", {}), *orbit[2:4]])],
                         [2, 3], "a null begins anew")

    def test_are_in_a_request_that_means_the_documents(self):
        documents = [{"camera": {"fov": fov}, "objects": [1, 2]} for fov in (30, 40, 50)]
        body = batch_request("orbit", documents)
        self.assertEqual([patched(body["scene"], patch) for patch in body["frames"]], documents)
        self.assertEqual(body["frames"], [{}, {"camera": {"fov": 40}}, {"camera": {"fov": 50}}])


class Stub(http.server.ThreadingHTTPServer):
    """A service whose first answers to a submission are these (status, headers), and which then has the job fail."""

    def __init__(self, *answers):
        super().__init__(("127.0.0.1", 0), Handler)
        self.answers = list(answers)
        self.seen = []  # (method, path, headers, body)


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def answer(self):
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        self.server.seen.append((self.command, self.path, dict(self.headers), body))
        status, headers = 200, {}
        if self.command == "POST" and self.server.answers:
            status, headers = self.server.answers.pop(0)
        job = {"id": JOB_ID, "state": "failed", "problem": {"code": "internal", "detail": "a stub", "errors": []}}
        content = json.dumps({"detail": "not now"} if status >= 400 else job).encode()
        if "?" in self.path:
            content = b'{"items": [], "next_cursor": null}'
        self.send_response(status)
        for name, value in {"Content-Length": len(content), **headers}.items():
            self.send_header(name, str(value))
        self.end_headers()
        self.wfile.write(content)

    do_GET = do_POST = do_PUT = answer

    def log_message(self, *_):
        pass


class Requests(unittest.TestCase):
    def submit(self, *arguments, answers=(), environment=None):
        with tempfile.TemporaryDirectory() as name, Stub(*answers) as stub:
            threading.Thread(target=stub.serve_forever, daemon=True).start()
            folder = pathlib.Path(name)
            (folder / "a.json").write_text('{"version": 1}', encoding="utf-8")
            (folder / "key").write_text("from-a-file\n", encoding="utf-8")
            done = subprocess.run(["/usr/bin/python3", SCRIPT, "a.json", "--server", f"http://127.0.0.1:{stub.server_port}/prefix/",
                                   *arguments], cwd=folder, capture_output=True, text=True, check=False, timeout=120,
                                  env={**os.environ, **(environment or {})})
            stub.shutdown()
            return done, stub.seen

    def test_carry_the_key_of_the_environment_or_the_file_to_below_the_servers_path(self):
        for arguments, environment, key in (((), {}, None), ((), {"WHITTLE_KEY": "from-outside"}, "Bearer from-outside"),
                                            (("--key-file", "key"), {"WHITTLE_KEY": "other"}, "Bearer from-a-file")):
            done, seen = self.submit(*arguments, environment=environment)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertEqual({headers.get("Authorization") for _, _, headers, _ in seen}, {key})
            self.assertEqual([path.partition("?")[0] for _, path, _, _ in seen],
                             ["/prefix/v1/jobs", "/prefix/v1/events", "/prefix/v1/jobs", f"/prefix/v1/jobs/{JOB_ID}"])
            self.assertNotIn("from-", done.stderr + done.stdout)

    def test_of_a_submission_carry_one_idempotency_key_however_often_they_are_repeated(self):
        done, seen = self.submit(answers=[(503, {"Retry-After": "0"}), (429, {}), (502, {}), (202, {})])
        posts = [(headers["Idempotency-Key"], body) for method, _, headers, body in seen if method == "POST"]
        self.assertEqual(len(posts), 4)
        self.assertEqual(len(set(posts)), 1)
        self.assertIn("not now", done.stderr)
        self.assertIn("a: internal: a stub", done.stderr)

    def test_that_are_refused_for_the_key_end_it_without_blaming_the_scene(self):
        for status in (401, 403):
            done, _ = self.submit(answers=[(status, {})])
            self.assertEqual(done.returncode, 3, done.stderr)
            self.assertIn("does not take jobs from us", done.stderr)


if __name__ == "__main__":
    unittest.main()
