"""Modules of the page in Node.js, without a browser: modules.test.js, and the reader of EXR files against that of tests/support."""
import base64
import json
import os
import random
import struct
import subprocess
import unittest

import numpy

from tests.fuzz import seeds
from tests.http.page_test import CACHE
from tests.support.images import read_exr_channels
from tests.support.sources import SOURCE, text
from tests.support.whittle import BIN, DirectoryTest, scene, succeeded, whittle


def node(*arguments):
    return subprocess.run(["node", *map(str, arguments)], cwd=CACHE / "sources", check=False, capture_output=True, text=True, timeout=300,
                          env={**os.environ, "WHITTLE_PAGE": str(BIN.parent / "server/web/files"), "WHITTLE_SCHEMA": str(BIN.parent / "api/schemas/scene.schema.json")})


class Modules(unittest.TestCase):
    def test_pass_their_tests(self):
        succeeded(node("--test", SOURCE / "tests/browser/modules.test.js"))


class Exr(DirectoryTest):
    def rendered(self, name, half, **image):
        document = scene(name, image={"width": 80, "height": 60, **image}, accuracy={"samples": [3, 3]}, output={
            "formats": ["exr"], "layers": ["depth", "normal", "albedo", "object_id", "samples", "error"], "half": half})
        succeeded(whittle("render", "-", "-o", self.directory / f"{name}.exr", document=document))
        return (self.directory / f"{name}.exr").read_bytes()

    def read(self):
        done = succeeded(node("--input-type=module", "--eval", text("tests/browser/scripts.js") + "await printChannels(process.argv[1])", self.directory))
        return json.loads(done.stdout)

    def test_channels_equal_those_of_another_reader(self):
        files = {f"{name}.exr": self.rendered(name, half) for name, half in (("shapes", False), ("transparency", True))}
        for name, channels in self.read().items():
            expected = read_exr_channels(files[name])
            self.assertEqual(set(channels), set(expected))
            self.assertGreaterEqual(len(channels), 13)
            for channel, values in expected.items():
                read = numpy.frombuffer(base64.b64decode(channels[channel]), numpy.float32).reshape(values.shape)
                numpy.testing.assert_array_equal(read, numpy.asarray(values, numpy.float32), channel)

    def test_hostile_files_are_refused(self):
        """The corpus and mutations: each is read or refused with a sentence, and a good file is read after them."""
        good = self.rendered("tiny", False, width=24, height=20)
        files = [seed for seed in seeds.read("image").values() if seed[:4] == b"\x76\x2f\x31\x01"]
        self.assertGreaterEqual(len(files), 10)
        window = good.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
        files.append(good[:window] + struct.pack("<4i", 0, 0, 32767, 32767) + good[window + 16:])
        pick = random.Random(7)
        for _ in range(300):
            changed = bytearray(good)
            for _ in range(pick.randint(1, 8)):
                changed[pick.randrange(min(len(changed), 700))] = pick.randrange(256)
            files.append(bytes(changed[:pick.randint(1, len(changed))] if pick.random() < 0.3 else changed))
        for index, content in enumerate(files):
            (self.directory / f"{index:04}").write_bytes(content)
        found = self.read()
        self.assertEqual(len(found), len(files) + 1)
        refused = [each for each in found.values() if isinstance(each, str)]
        self.assertGreater(len(refused), 50)
        self.assertEqual([each for each in refused if not each or "undefined" in each], [])
        self.assertTrue(any(each.startswith("the EXR file is too large: 32768 x 32768") for each in refused))
        self.assertIsInstance(found["tiny.exr"], dict)
