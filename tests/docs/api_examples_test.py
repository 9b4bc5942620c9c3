"""Every example of the page /docs runs as it stands there: the curl command and the Python program of each operation."""
import html
import json
import os
import re
import subprocess
import sys
import unittest

from tests.http.daemon import PATIENCE_S, Daemon, json_of, long_scene, scene, sha256
from tests.http.webhooks_test import SECRET_TEXT, Receiver
from tests.support.sources import SOURCE
from tests.support.whittle import temporary_directory

FORMATS = ["png", "exr", "png16", "jpg", "hdr", "webp", "tiff"]
TEXTURE = SOURCE / "scenes/assets/tile.png"
BLOCKS = re.compile(r'<h2 id="(\w+)">(?:(?!<h2).)*?<pre>(.*?)</pre><details><summary>Python</summary><pre>(.*?)</pre></details>', re.DOTALL)
ENDLESS = "getEvents"
SWEEP = {"/camera/fov": [30, 40]}


class ApiExamples(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.directory = temporary_directory(cls)
        (cls.directory / "secret").write_text(SECRET_TEXT, encoding="ascii")
        (cls.directory / "scene.json").write_text(json.dumps(scene()), encoding="utf-8")
        (cls.directory / "texture.png").write_bytes(TEXTURE.read_bytes())
        cls.sha256 = sha256(TEXTURE.read_bytes())
        cls.receiver = cls.enterClassContext(Receiver())
        cls.daemon = cls.enterClassContext(Daemon("--webhook-secret-file", cls.directory / "secret", "--webhook-networks", "127.0.0.0/8"))
        cls.daemon.request("PUT", f"/v1/assets/{cls.sha256}", TEXTURE.read_bytes())
        page = cls.daemon.get("/docs").body.decode()
        cls.examples = {name: [html.unescape(text) for text in texts] for name, *texts in BLOCKS.findall(page)}
        cls.values = cls.values_of_replies()

    @classmethod
    def values_of_replies(cls):
        """Values for the words in capitals."""
        output = {"formats": FORMATS, "layers": ["depth"]}
        job = cls.daemon.rendered(scene(output=output, job={"webhook": {"url": cls.receiver.url()}}))["id"]
        other, batch = cls.daemon.rendered(scene(samples=2))["id"], cls.daemon.finished_batch(scene=scene(), sweep=SWEEP)["id"]
        delivery = json_of(cls.daemon.get(f"/v1/jobs/{job}/deliveries"))["items"][0]["id"]
        test = cls.daemon.request("POST", "/v1/webhooks/test", {"url": cls.receiver.url()}).headers["Location"].rsplit("/", 1)[1]
        tree, file = re.search(r'"/ui/([^"/]+)/([^"]+\.js)"', cls.daemon.get("/", Accept="text/html").body.decode()).groups()
        return {"JOB": job, "OTHER_JOB": other, "BATCH": batch, "DELIVERY": delivery, "TEST": test, "TREE": tree, "FILE": file,
                "SHA256": cls.sha256, "https://example.com/done": cls.receiver.url()}

    @classmethod
    def measurement(cls):
        job = json_of(cls.daemon.request("POST", "/v1/measure", {"scene": scene(), "settings": {"parameters": ["samples"]}}))
        return cls.daemon.wait_for_success(job["id"])["id"]

    @classmethod
    def values_for(cls, operation):
        """The values for an operation that needs another job or batch than a finished render, or changes it."""
        waiting = scene(job={"run_after": "2099-01-01T00:00:00Z"})
        if operation in ("changeJob", "cancelJob", "removeJob", "retryJob"):
            job = cls.daemon.submit(waiting)
            if operation == "retryJob":
                cls.daemon.request("POST", f"/v1/jobs/{job}/cancel")
            return {"JOB": job}
        if operation in ("cancelBatch", "retryBatch"):
            batch = json_of(cls.daemon.request("POST", "/v1/batches", {"scene": waiting, "sweep": SWEEP}))["id"]
            if operation == "retryBatch":
                cls.daemon.request("POST", f"/v1/batches/{batch}/cancel")
            return {"BATCH": batch}
        if operation == "removeBatch":
            return {"BATCH": cls.daemon.finished_batch(scene=scene(), sweep=SWEEP)["id"]}
        if operation == "getPreviewPng":
            return {"JOB": cls.daemon.cancel_in_work(long_scene())["id"]}
        if operation.startswith("getMeasure") or operation == "getReferenceExr":
            return {"JOB": cls.measured}
        return {}

    def run_example(self, operation, command, text):
        for word, value in {**self.values, **self.values_for(operation)}.items():
            text = re.sub(rf"(?<![\w]){re.escape(word)}(?!\w)", value, text)
        text = text.replace("127.0.0.1:8080", f"127.0.0.1:{self.daemon.port}").replace("127.0.0.1:8081", f"127.0.0.1:{self.daemon.health_port}")
        arguments = {"args": [*command, text], "cwd": self.directory, "env": {**os.environ, "no_proxy": "*"}, "text": True}
        if operation == ENDLESS:
            with subprocess.Popen(**arguments, stdout=subprocess.PIPE) as process:
                self.daemon.submit(scene())
                self.assertTrue(process.stdout.readline())
                process.kill()
            return ""
        done = subprocess.run(**arguments, check=False, timeout=PATIENCE_S, capture_output=True)
        self.assertEqual(done.returncode, 0, f"{text}\n{done.stdout}\n{done.stderr}")
        written = re.search(r'-o (\S+)|Path\("(\S+)"\)\.write_bytes', text)
        return (self.directory / (written[1] or written[2])).read_bytes() if written else done.stdout

    def test_every_operation_has_examples_and_they_run(self):
        document = json_of(self.daemon.get("/openapi.json"))
        operations = {operation["operationId"] for item in document["paths"].values() for operation in item.values()
                      if "operationId" in operation}
        self.assertEqual(set(self.examples), operations)
        type(self).measured = self.measurement()
        for operation, (curl, python) in self.examples.items():
            with self.subTest(operation=operation):
                shown = self.run_example(operation, ["bash", "-c"], curl)
                again = self.run_example(operation, [sys.executable, "-c"], python)
                self.assertEqual(bool(shown.strip()), bool(again.strip()))
                if "-o " in curl and operation != "getPreviewPng":
                    self.assertEqual(shown, again)

    def test_python_needs_only_its_standard_library(self):
        for operation, (_, python) in self.examples.items():
            imported = set(re.findall(r"^(?:import|from) (\w+)", python, re.MULTILINE))
            self.assertLessEqual(imported, sys.stdlib_module_names, operation)
