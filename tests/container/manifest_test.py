"""The Kubernetes manifest as podman plays it: the same pod, with its claim, its settings and its keys.

What needs a cluster is not tried here: the service and its name, the network policy, which podman has no place for, and
the probes by themselves, which the test sends in their place.
"""
import os
import tempfile
import unittest

import yaml

from tests.container import images, machine
from tests.container.container import Running
from tests.container.engine import attempt, podman
from tests.http.daemon import json_of, scene
from tests.http.keys_test import new_key
from tests.support.sources import SOURCE, text

MANIFESTS = SOURCE / "docker" / "k8s"


def documents(name):
    with open(MANIFESTS / name, encoding="utf-8") as file:
        return list(yaml.safe_load_all(file))


class Pod(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        images.whittle()
        if reason := machine.why_no_networks():
            raise unittest.SkipTest(f"a pod has a network: {reason}")
        cls.directory = cls.enterClassContext(tempfile.TemporaryDirectory())
        keys = os.path.join(cls.directory, "keys")
        cls.key = new_key(keys, "test")
        # podman 4.3 mounts a secret's data as it stands, not decoded from base64, so it is not played but made.
        secret = {"apiVersion": "v1", "kind": "Secret", "metadata": {"name": "whittle-keys"}, "data": {"keys": text(keys)}}
        podman("secret", "create", "whittle-keys", "-", input=yaml.safe_dump(secret))
        cls.addClassCleanup(attempt, "secret", "rm", "whittle-keys")
        cls.addClassCleanup(attempt, "volume", "rm", "--force", "whittle-data", "whittle-keys", "whittle-config")
        cls.addClassCleanup(cls.play, [], "--down")
        cls.play(documents("storage.yaml"))
        cls.play()
        (deployment,) = documents("deployment.yaml")
        cls.spec = deployment["spec"]["template"]["spec"]
        cls.daemon = Running("whittle-pod-0-whittled").until_ready()

    @classmethod
    def play(cls, played=(), *options):
        path = os.path.join(cls.directory, "played.yaml")
        with open(path, "w", encoding="utf-8") as file:
            yaml.safe_dump_all(played or documents("config.yaml") + documents("deployment.yaml"), file)
        podman("play", "kube", *options, path)

    def test_renders_for_a_key(self):
        allowed = {"Authorization": f"Bearer {self.key}", "Accept": "image/png"}
        self.assertEqual(self.daemon.request("POST", "/v1/render", scene()).status, 401)
        reply = self.daemon.request("POST", "/v1/render", scene(), allowed)
        self.assertEqual((reply.status, reply.body[:4]), (200, b"\x89PNG"), reply)

    def test_answers_every_probe(self):
        (container,) = self.spec["containers"]
        for kind in ("startupProbe", "livenessProbe", "readinessProbe"):
            probe = container[kind]["httpGet"]
            self.assertEqual(probe["port"], "health")
            self.assertEqual(self.daemon.health(probe["path"]).status, 200, kind)
        self.assertIn(b"whittle_", self.daemon.health("/metrics").body)

    def test_keeps_its_jobs_in_the_claim(self):
        key = {"Authorization": f"Bearer {self.key}"}
        job_id = json_of(self.daemon.request("POST", "/v1/jobs", scene(), {**key, "Prefer": "wait=30"}))["id"]
        self.play([], "--down")
        self.play()
        self.daemon.until_ready()
        self.assertEqual(self.daemon.request("GET", f"/v1/jobs/{job_id}", headers=key).status, 200)
