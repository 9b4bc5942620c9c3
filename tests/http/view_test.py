"""GET /v1/jobs/{id}/view.png: layers of finished images; POST /v1/live: the live form of a scene."""
import json
import os
import signal
import struct

import numpy

from tests.http.daemon import OneDaemon, json_of, scene, wait_until
from tests.support.images import read_exr_channels, read_png

LAYERS = ["depth", "normal", "albedo", "object_id", "samples", "error"]
CHANNELS = {"depth": ["Z"], "normal": ["normal.X", "normal.Y", "normal.Z"], "albedo": ["albedo.R", "albedo.G", "albedo.B"],
            "samples": ["samples"], "error": ["error"], "color": ["R", "G", "B"], "object_id": ["object_id"]}


def srgb(linear):
    """Codes of linear light (IEC 61966-2-1)."""
    linear = numpy.clip(linear, 0, 1)
    return 255 * numpy.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


class Views(OneDaemon):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        document = scene(60, 40, samples=4, output={"formats": ["png", "exr"], "layers": LAYERS})
        document["accuracy"] = {"target_error": 2}
        document["objects"] = document["objects"][:1] + [{**document["objects"][0], "center": [1, 0.5, 0]}]
        cls.job = cls.daemon.rendered(document)
        cls.channels = read_exr_channels(cls.daemon.get(f"/v1/jobs/{cls.job['id']}/image.exr").body)

    def values(self, layer):
        return numpy.stack([self.channels[name] for name in CHANNELS[layer]], axis=-1).astype(float)

    def view(self, query="", job=None, **headers):
        return self.daemon.get(f"/v1/jobs/{job or self.job['id']}/view.png{query}", **headers)

    def viewed(self, query="", job=None):
        reply = self.view(query, job)
        self.assertEqual((reply.status, reply.headers["Content-Type"]), (200, "image/png"), reply.body)
        return read_png(reply.body)

    def assert_codes(self, image, expected):
        self.assertLessEqual(numpy.abs(image - expected).max(), 0.51)

    def test_waits_for_a_worker_that_starts(self):
        worker = self.daemon.worker()
        os.kill(worker, signal.SIGKILL)
        wait_until(lambda: str(worker) in (row["pid"] for row in self.daemon.log_rows("worker_ended")), "its end")
        self.assert_codes(self.viewed("?exposure=0.5"), srgb(self.values("color") * 2**0.5))

    def test_color_has_an_exposure(self):
        self.assert_codes(self.viewed(), srgb(self.values("color")))
        numpy.testing.assert_array_equal(self.viewed(), read_png(self.daemon.get(self.job["links"]["image"]).body))
        self.assert_codes(self.viewed("?layer=color&exposure=-2.5"), srgb(self.values("color") * 2 ** -2.5))
        self.assert_codes(self.viewed("?layer=albedo&exposure=1"), srgb(self.values("albedo") * 2))

    def test_numbers_have_a_range(self):
        for layer, low, high in (("samples", 2, 20), ("error", 0.5, 3)):
            values = self.values(layer)
            expected = 255 * numpy.clip((values - low) / (high - low), 0, 1)
            self.assert_codes(self.viewed(f"?layer={layer}&range={low},{high}"), expected.repeat(3, axis=2))
            least, most = values.min(), values.max()
            self.assert_codes(self.viewed(f"?layer={layer}"), (255 * (values - least) / (most - least)).repeat(3, axis=2))
        depth = self.values("depth")
        there = numpy.isfinite(depth)
        self.assertTrue(there.any() and not there.all())
        near, far = depth[there].min(), depth[there].max()
        expected = numpy.where(there, 255 * (numpy.where(there, depth, near) - near) / (far - near), 0)
        self.assert_codes(self.viewed("?layer=depth"), expected.repeat(3, axis=2))
        self.assert_codes(self.viewed("?layer=normal"), 127.5 * (self.values("normal") + 1))

    def test_heat_has_the_colors_of_the_heat_map(self):
        # Green 2011, eq. 2: start 0.5, -1.5 rotations, hue 1.
        fraction = numpy.clip(self.values("error") / 4, 0, 1)
        angle = 2 * numpy.pi * (0.5 / 3 + 1 - 1.5 * fraction)
        matrix = numpy.array([[-0.14861, 1.78277], [-0.29227, -0.90649], [1.97294, 0]])
        color = fraction + fraction * (1 - fraction) / 2 * (numpy.cos(angle) * matrix[:, 0] + numpy.sin(angle) * matrix[:, 1])
        self.assert_codes(self.viewed("?layer=error&range=0,4&map=heat"), 255 * numpy.clip(color, 0, 1))

    def test_objects_have_a_color_each(self):
        ids, image = self.values("object_id")[..., 0], self.viewed("?layer=object_id")
        colors = {id_: numpy.unique(image[ids == id_], axis=0).tolist() for id_ in numpy.unique(ids)}
        self.assertEqual([len(one) for one in colors.values()], [1, 1, 1])
        self.assertEqual(colors[0], [[0, 0, 0]])
        self.assertNotEqual(colors[1], colors[2])

    def test_crop_and_max_choose_and_reduce_pixels(self):
        numpy.testing.assert_array_equal(self.viewed("?layer=object_id&crop=13,7,20,11"), self.viewed("?layer=object_id")[7:18, 13:33])
        mean = self.values("color")[8:40].reshape(16, 2, 30, 2, 3).mean(axis=(1, 3))
        self.assert_codes(self.viewed("?crop=0,8,60,32&max=30"), srgb(mean))
        self.assertEqual(self.viewed("?crop=59,39,1,1").shape, (1, 1, 3))
        self.assertEqual(self.viewed("?max=2048").shape, (40, 60, 3))

    def test_is_kept_and_not_modified_for_its_etag(self):
        first = self.view("?layer=error")
        self.assertEqual(self.view("?layer=error", If_None_Match=first.headers["ETag"]).status, 304)
        self.assertEqual(self.view("?layer=error&map=heat", If_None_Match=first.headers["ETag"]).status, 200)

    def test_color_of_a_job_without_exr(self):
        job = self.finished(output={"formats": ["png"]})
        image = read_png(self.daemon.get(job["links"]["image"]).body)
        numpy.testing.assert_array_equal(self.viewed(job=job["id"]), image)
        self.assert_problem(self.view("?layer=depth", job["id"]), 404, "image_not_found")
        webp = self.finished(output={"formats": ["webp"]})
        self.assertEqual(self.viewed(job=webp["id"]).shape, (12, 16, 3))

    def test_needs_the_layer_and_an_image(self):
        plain = self.finished(output={"formats": ["exr"], "layers": ["depth"]})["id"]
        self.assertEqual(self.viewed("?layer=depth", plain).shape, (12, 16, 3))
        for layer in LAYERS[1:]:
            problem = self.assert_problem(self.view("?layer=" + layer, plain), 404, "image_not_found")
            self.assertEqual(problem["detail"], f"the image has no layer {layer}")

    def test_refuses_other_parameters(self):
        for query in ("layer=", "layer=Z", "layer=depth&layer=depth", "exposure=", "exposure=101", "exposure=nan", "exposure=inf", "exposure=1,2",
                      "layer=depth&exposure=1", "range=0,1", "layer=depth&range=1", "layer=depth&range=1,1", "layer=depth&range=2,1",
                      "layer=depth&range=0,1,2", "layer=depth&range=0,inf", "layer=depth&range=,", "layer=depth&range=0,1e999",
                      "map=heat", "layer=error&map=", "layer=object_id&map=gray", "crop=", "crop=0,0,61,1", "crop=0,0,0,1",
                      "crop=60,0,1,1", "crop=0,0,1", "crop=0,0,1,1,1", "crop=-1,0,1,1", "crop=4294967295,0,2,1", "crop=0,4294967296,1,1",
                      "crop=1,0,4294967295,1", "crop=1.5,0,1,1", "max=15", "max=2049", "max=", "max=1e2", "max=16&max=16", "size=9"):
            self.assert_problem(self.view("?" + query), 400, "invalid_query")

    def test_finds_damaged_artifacts(self):
        job = self.finished(output={"formats": ["exr"]}, image={"width": 150, "height": 150})
        sha256 = job["artifacts"][0]["sha256"]
        stored = self.daemon.data / sha256[:2] / sha256
        stored.write_bytes(b"\0" * stored.stat().st_size)
        self.assert_problem(self.view(job=job["id"]), 422, "bad_image")
        stored.unlink()
        self.assert_problem(self.view(job=job["id"]), 500, "image_damaged")
        self.assertEqual(json_of(self.daemon.get("/v1/status"))["ready"], True)


def live_parts(body):
    """The header and the bytes of each table."""
    magic, size = struct.unpack_from("<4sI", body)
    assert magic == b"LIVE" and size % 4 == 0
    header = json.loads(body[8:8 + size])
    return header, {each["name"]: body[8 + size + each["offset"]:][:4 * each["columns"] * each["rows"]] for each in header["tables"]}


class Live(OneDaemon):
    def live(self, document):
        return self.daemon.request("POST", "/v1/live", document)

    def test_has_the_tables_and_the_list_of_what_is_left_out(self):
        document = scene(accuracy={"model": "global"}, camera={"position": [0, 0, 5], "look_at": [0, 0, 0], "aperture": 0.5})
        reply = self.live(document)
        self.assertEqual((reply.status, reply.headers["Content-Type"]), (200, "application/octet-stream"), reply.body[:500])
        header, tables = live_parts(reply.body)
        self.assertEqual(sum(map(len, tables.values())) + 8 + struct.unpack_from("<I", reply.body, 4)[0], len(reply.body))
        self.assertEqual([each["pointer"] for each in header["omitted"]], ["/accuracy/model"])
        self.assertEqual(header["camera"]["aperture"], 0.5)
        self.assertEqual(len(tables["materials"]), 4 * 4 * header["material_cells"] * len(header["materials"]))
        self.assertEqual(self.live(document).body, reply.body)

    def test_refuses_what_it_cannot_hold(self):
        far = scene(lights=[{"type": "point", "position": [1e50, 0, 0]}])
        self.assert_problem(self.live(far), 422, "bad_scene")
        self.assertIn("32-bit", json_of(self.live(far))["detail"])
        self.assert_problem(self.live({**scene(), "unknown": 1}), 422, "bad_scene")
        self.assert_problem(self.live(b"{"), 400, "not_json")
