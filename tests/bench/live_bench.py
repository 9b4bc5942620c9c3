#!/usr/bin/env -S /usr/bin/python3 -u
"""The live view of the page in a headless Chromium, whose graphics processor is this machine's processor.

    tests/bench/live_bench.py [--frames 5]

For each scene: the size of its tables; the time of POST /v1/live, the least of some requests that each change a color, so that the
geometry is in the worker's cache and the tables are made and sent again (the triangles are in a file, the spheres in the document); the time of a frame of 320 x 240 with one sample a pixel, the least
of some; and frames per second beside those of one sphere, a figure that holds for graphics processors too.
"""
import argparse
import json
import math
import pathlib
import re
import shutil
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from tests.bench.peers import bench_scenes  # pylint: disable=wrong-import-position
from tests.browser.browser import Browser  # pylint: disable=wrong-import-position
from tests.browser.live_scenes import large_scene  # pylint: disable=wrong-import-position
from tests.browser.live_test import LOAD, SOFTWARE  # pylint: disable=wrong-import-position
from tests.http.daemon import Daemon  # pylint: disable=wrong-import-position
from tests.support.whittle import SCENES, scene  # pylint: disable=wrong-import-position

SIZE = {"width": 320, "height": 240}
# Milliseconds of each frame, the first one with the compilation of the program.
FRAMES = LOAD + """
  const times = [];
  for (let frame = 0; frame < options.frames; ++frame) {
    const begin = performance.now();
    tracer.clear(width, height);
    tracer.findMedia(camera);
    tracer.trace(camera, {index: -1, points: 1, share: 1, first: 0, rows: height});
    tracer.pixels();
    times.push(performance.now() - begin);
  }
  return times;
})().then(done, (error) => done(String(error)));"""


def scenes(directory):
    sphere = {"version": 1, "camera": {"position": [0, 0, 5], "look_at": [0, 0, 0]}, "lights": [{"type": "point", "position": [3, 4, 5]}],
              "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": {"color": [0.8, 0.3, 0.1]}}]}
    yield "one sphere", sphere
    for name in ("tiny", "shapes", "whitted", "glass", "textures", "mountain"):
        yield name, scene(name)
    bench_scenes.write_waves(100_352, directory / "waves.ply")
    yield "triangles", {**sphere, "camera": {"position": [0, 6, 12], "look_at": [0, 0, 0]}, "objects": [{"type": "mesh", "file": "waves.ply", "material": {"color": 0.5}}]}
    yield "spheres", large_scene("spheres")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=5)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory, Daemon("--assets", directory) as daemon:
        shutil.copytree(SCENES / "assets", f"{directory}/assets")
        browser = Browser(arguments=SOFTWARE)
        browser.set_script_timeout(3600)
        browser.get(f"http://127.0.0.1:{daemon.port}/")
        tree = re.search(r"/ui/([0-9a-f]+)/main\.js", browser.page_source).group(1)
        print(f"{'scene':20} {'tables':>10} {'request':>10} {'frame':>10} {'frames/s':>9} {'of one sphere':>14}")
        first = None
        for name, document in scenes(pathlib.Path(directory)):
            document = {**document, "image": SIZE}
            seconds = math.inf
            for turn in range(options.frames):
                body = json.dumps({**document, "ambient": 0.1 + turn / 1000})
                begin = time.perf_counter()
                reply = daemon.request("POST", "/v1/live", body.encode())
                seconds = min(seconds, time.perf_counter() - begin)
                if reply.status != 200:
                    sys.exit(f"{name}: {reply.status} {reply.body[:300]}")
            times = browser.execute_async_script(FRAMES, f"/ui/{tree}/live-view.js", json.dumps(document), {"frames": 1 + options.frames})
            if isinstance(times, str):
                sys.exit(f"{name}: {times}")
            frame = min(times[1:])
            first = first or frame
            print(f"{name:20} {len(reply.body) / 1e6:7.2f} MB {1e3 * seconds:7.0f} ms {frame:7.1f} ms {1e3 / frame:9.1f} {first / frame:14.3f}")
        browser.quit()


if __name__ == "__main__":
    main()
