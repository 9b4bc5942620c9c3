"""A long batch in miniature: whittle-submit delivers every frame of an orbit while the server is killed and restarted."""
import json
import math
import pathlib
import subprocess
import tempfile
import unittest

from tests.http.daemon import PATIENCE_S, Daemon, json_of, wait_until
from tests.http.relay import Relay
from tests.support.whittle import SOURCE, scene

FRAMES = 60
OBJECTS = 821  # a plane and four of the five levels of spheres: the smallest ones only make documents longer


def orbit(position):
    """Camera positions around the z axis, as a list for --set."""
    x, y, z = position
    radius, start = math.hypot(x, y), math.atan2(y, x)
    angles = [start + 2 * math.pi * frame / FRAMES for frame in range(FRAMES)]
    return ",".join(json.dumps([radius * math.cos(angle), radius * math.sin(angle), z]) for angle in angles)


class Orbit(unittest.TestCase):
    def render(self, directory, kills):
        """Returns the images by name. The server is killed each time `kills` images are complete."""
        directory.mkdir()
        path = directory / "orbit.json"
        document = scene("sphereflake", image={"width": 64, "height": 64}, accuracy={"samples": [4, 4]})
        del document["objects"][OBJECTS:]
        path.write_text(json.dumps(document), encoding="utf-8")
        with Daemon("--jobs", "2") as daemon, Relay(lambda: daemon.port) as relay:
            command = ["/usr/bin/python3", SOURCE / "api/client/whittle-submit", "--server", relay.url, "-o", directory, path,
                       "--set", f"camera.position={orbit(document['camera']['position'])}"]
            with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
                for count in kills:
                    wait_until(lambda n=count: len(list(directory.glob("*.png"))) >= n, f"{count} frames")
                    daemon.kill()
                    daemon.start()
                _, output = process.communicate(timeout=PATIENCE_S)
            self.assertEqual(process.returncode, 0, output)
            self.assertEqual(len(json_of(daemon.get("/v1/jobs?limit=200"))["items"]), FRAMES, "a frame was submitted twice")
        return {image.name: image.read_bytes() for image in directory.glob("*.png")}

    def test_images_are_identical_if_the_server_is_killed_twice(self):
        with tempfile.TemporaryDirectory() as name:
            expected = self.render(pathlib.Path(name) / "undisturbed", [])
            actual = self.render(pathlib.Path(name) / "killed", [FRAMES // 6, FRAMES // 2])
        self.assertEqual(len(set(expected.values())), FRAMES)
        self.assertEqual(actual, expected)


if __name__ == "__main__":
    unittest.main()
