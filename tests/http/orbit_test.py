"""A night's work in small: whittle-submit brings every frame of an orbit, whatever the server dies of on the way."""
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


def orbit(position):
    """The camera's positions around the z axis, as a list for --set."""
    x, y, z = position
    radius, start = math.hypot(x, y), math.atan2(y, x)
    angles = [start + 2 * math.pi * frame / FRAMES for frame in range(FRAMES)]
    return ",".join(json.dumps([radius * math.cos(angle), radius * math.sin(angle), z]) for angle in angles)


class Orbit(unittest.TestCase):
    def render(self, folder, kills):
        """The pictures by name, the server killed once so many of them are there."""
        folder.mkdir()
        path = folder / "orbit.json"
        document = scene("sphereflake", image={"width": 64, "height": 64}, accuracy={"samples": [4, 4]})
        path.write_text(json.dumps(document), encoding="utf-8")
        with Daemon("--jobs", "2") as daemon, Relay(lambda: daemon.port) as relay:
            command = ["/usr/bin/python3", SOURCE / "api/client/whittle-submit", "--server", relay.url, "-o", folder, path,
                       "--set", f"camera.position={orbit(document['camera']['position'])}"]
            with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
                for count in kills:
                    wait_until(lambda n=count: len(list(folder.glob("*.png"))) >= n, f"{count} frames")
                    daemon.kill()
                    daemon.start()
                _, said = process.communicate(timeout=PATIENCE_S)
            self.assertEqual(process.returncode, 0, said)
            self.assertEqual(len(json_of(daemon.get("/v1/jobs?limit=200"))["items"]), FRAMES, "none twice")
        return {picture.name: picture.read_bytes() for picture in folder.glob("*.png")}

    def test_of_the_sphereflake_is_the_same_with_the_server_killed_twice(self):
        with tempfile.TemporaryDirectory() as name:
            undisturbed = self.render(pathlib.Path(name) / "undisturbed", [])
            disturbed = self.render(pathlib.Path(name) / "disturbed", [FRAMES // 6, FRAMES // 2])
        self.assertEqual(len(set(undisturbed.values())), FRAMES)
        self.assertEqual(disturbed, undisturbed)


if __name__ == "__main__":
    unittest.main()
