"""Files that whittle writes and reads: an image file is complete or absent, also if the disk or the process fails."""
import json
import math
import os
import pathlib
import shutil
import signal
import stat
import unittest

from tests.support.images import read_exr
from tests.support.whittle import BIN, SCENES, DirectoryTest, scene, succeeded, whittle

TINY = SCENES / "tiny.json"


def failing(how):
    """An environment in which file calls fail; see failing_files.cpp. AddressSanitizer expects to be the first library
    and must not check that here."""
    asan = os.environ.get("ASAN_OPTIONS", "") + ":verify_asan_link_order=0"
    return {"LD_PRELOAD": str(BIN / "libfailing_files.so"), "FAILING_FILES": how, "ASAN_OPTIONS": asan}


class MeshFile(DirectoryTest):
    # Faces between z = 0 and z = 1: a square, a bent quadrilateral, a pentagon, a concave hexagon, a triangle and one that is
    # folded, so that its triangles have no mean normal.
    FACES = [[(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(2, 0, 0), (3, 0, 0.5), (3, 1, 0), (2, 1, 0.5)],
             [(4, 0, 0), (5, 0, 0), (5, 0.5, 0), (4.5, 1, 0), (4, 0.5, 0)],
             [(6, 0, 0), (7, 0, 0), (7, 0.2, 0), (6.2, 0.2, 0), (6.2, 1, 0), (6, 1, 0)], [(8, 0, 0), (9, 0, 0), (8, 1, 0)],
             [(10, 0, 0), (10.5, 0, 0), (10.5, 1, 0), (11, 1, 0)]]
    LIGHT = (3, 0.5, 2)

    def meshes(self):
        """The faces as numbers in the document, as an OBJ of two parts, and as a PLY."""
        points = [point for face in self.FACES for point in face]
        faces = [[len(sum(self.FACES[:i], [])) + j for j in range(len(face))] for i, face in enumerate(self.FACES)]
        obj, ply = self.directory / "a.obj", self.directory / "a.ply"
        obj.write_text("".join("v {} {} {}\n".format(*point) for point in points) + "".join(
            f"usemtl part{i % 2}\nf {' '.join(str(j + 1) for j in face)}\n" for i, face in enumerate(faces)), encoding="utf-8")
        ply.write_text(
            f"ply\nformat ascii 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\n"
            f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
            + "".join("{} {} {}\n".format(*point) for point in points)
            + "".join(f"{len(face)} {' '.join(map(str, face))}\n" for face in faces), encoding="utf-8")
        return [{"positions": points, "faces": faces}, {"file": str(obj)}, {"file": str(ply)},
                {"file": str(obj), "materials": {"part0": "n", "part1": "m"}}]

    def test_has_one_color_for_each_face_if_polygons_are_flat(self):
        white = {"model": "lambert", "color": 1, "ambient": 0, "diffuse": 1, "shading": "flat_polygon"}
        images = []
        for mesh in self.meshes():
            succeeded(whittle("render", "-", "-o", self.directory / "a.exr", document={
                "version": 1, "image": {"width": 220, "height": 20}, "accuracy": {"samples": 1}, "output": {"formats": ["exr"]},
                "camera": {"type": "orthographic", "position": [5.5, 0.5, 9], "look_at": [5.5, 0.5, 0], "height": 1},
                "lights": [{"type": "point", "position": self.LIGHT}], "materials": {"m": white, "n": dict(white)},
                "objects": [{"type": "mesh", **mesh, "material": "m"}]}))
            images.append(read_exr((self.directory / "a.exr").read_bytes())[..., 0])
            for i in range(len(self.FACES)):
                values = set(images[-1][:, 40 * i:40 * i + 20].flatten().tolist()) - {0}
                self.assertEqual(len(values), 1, f"{list(mesh)}, face {i}")
            for x, center in ((0, (0.5, 0.5)), (160, (8 + 1 / 3, 1 / 3))):  # Lambert's law at the centroid
                across = [l - c for l, c in zip(self.LIGHT, center)]
                self.assertAlmostEqual(images[-1][18, x + 1], 2 / math.hypot(*across, 2), places=6)
        for image in images[1:]:
            self.assertTrue((abs(image - images[0]) < 1e-6).all())


class ImageFile(DirectoryTest):
    def setUp(self):
        super().setUp()
        self.image = self.directory / "a.png"

    def render(self, *more, how=None):
        return whittle("render", TINY, "-o", self.image, *more, environment=failing(how) if how else None)

    def names(self):
        return sorted(path.name for path in self.directory.iterdir())

    def test_of_a_format_that_cannot_hold_the_image_is_refused_before_the_render(self):
        long = {"version": 1, "image": {"width": 16384, "height": 1}, "camera": {"position": [0, 0, 9], "look_at": [0, 0, 0]}}
        done = whittle("render", "-", "-o", self.image, "-o", self.directory / "b.webp", document=long)
        self.assertEqual(done.returncode, 3)
        self.assertIn(b"b.webp: a webp file has at most 16383 pixels on a side", done.stderr)
        self.assertEqual(self.names(), [])

    def test_replaces_a_file_of_the_same_name(self):
        self.image.write_bytes(b"old")
        self.assertEqual(self.render().returncode, 0)
        self.assertTrue(self.image.read_bytes().startswith(b"\x89PNG"))
        self.assertEqual(self.names(), ["a.png"])

    def test_has_the_permissions_of_the_umask(self):
        old_mask = os.umask(0o027)
        self.addCleanup(os.umask, old_mask)
        for how in (None, "no_nameless"):
            with self.subTest(how=how):
                self.assertEqual(self.render(how=how).returncode, 0)
                self.assertEqual(stat.S_IMODE(self.image.stat().st_mode), 0o640)

    def test_is_written_on_file_systems_without_o_tmpfile(self):
        succeeded(self.render("-o", self.directory / "a.exr", how="no_nameless"))
        self.assertEqual(self.names(), ["a.exr", "a.png"])
        succeeded(self.render(how="no_nameless"))
        self.assertEqual(self.names(), ["a.exr", "a.png"])

    def test_keeps_its_old_content_if_the_disk_is_full(self):
        self.image.write_bytes(b"old")
        done = self.render("-o", self.directory / "b.png", how="full")
        self.assertEqual(done.returncode, 3)
        self.assertIn(b"No space left on device", done.stderr)
        self.assertEqual(self.image.read_bytes(), b"old")
        self.assertEqual(self.names(), ["a.png"])

    def test_is_absent_if_the_process_is_killed_before_the_flush(self):
        self.assertEqual(self.render(how="kill_at_flush").returncode, -signal.SIGKILL)
        self.assertEqual(self.names(), [])

    def test_keeps_its_old_content_if_the_process_is_killed_before_the_rename(self):
        self.image.write_bytes(b"old")
        self.assertEqual(self.render(how="kill_at_name").returncode, -signal.SIGKILL)
        self.assertEqual(self.image.read_bytes(), b"old")

    def test_that_cannot_be_written_is_reported_by_name_before_the_render(self):
        (self.directory / "directory.png").mkdir()
        for path in (self.directory / "none" / "a.png", self.directory / "directory.png", pathlib.Path("/proc/a.png"),
                     pathlib.Path("/dev/null/a.png")):
            with self.subTest(path=path):
                done = whittle("render", TINY, "-o", path, "-o", self.image)
                self.assertEqual((done.returncode, done.stdout), (3, b""))
                self.assertRegex(done.stderr.decode(), rf"^whittle: cannot write {path}: .+\n$")
        self.assertEqual(self.names(), ["directory.png"])


class SceneFile(unittest.TestCase):
    def test_that_cannot_be_read_is_reported_by_name(self):
        for path in ("/nowhere/scene.json", str(SCENES)):
            for command in (["check", path], ["render", path, "-o", "a.png"]):
                with self.subTest(command=command):
                    done = whittle(*command)
                    self.assertEqual((done.returncode, done.stdout), (3, b""))
                    self.assertRegex(done.stderr.decode(), rf"^whittle: cannot read {path}: .+\n$")


class Assets(DirectoryTest):
    def rendered(self, name):
        document = scene("tiny")
        document["objects"][1]["material"] = {"color": {"file": name}}
        (self.directory / "scene.json").write_text(json.dumps(document), encoding="utf-8")
        return whittle("render", self.directory / "scene.json", "-o", self.directory / "out.png")

    def test_are_relative_to_the_scene_and_visible_in_the_image(self):
        shutil.copy(SCENES / "assets/tile.png", self.directory / "t.png")
        succeeded(self.rendered("t.png"))
        tiled = (self.directory / "out.png").read_bytes()
        whittle("render", SCENES / "tiny.json", "-o", self.directory / "plain.png")
        self.assertNotEqual(tiled, (self.directory / "plain.png").read_bytes())

    def test_that_cannot_be_read_are_reported_with_pointer_file_and_reason(self):
        (self.directory / "empty.png").write_bytes(b"")
        (self.directory / "text.png").write_text("no image", encoding="utf-8")
        os.mkfifo(self.directory / "pipe.png")
        for name, reason in (("missing.png", "no such file"), ("empty.png", "is empty"), ("pipe.png", "not a regular file"),
                             ("text.png", "no PNG, JPEG, OpenEXR or Radiance HDR file"), (".", "not a regular file")):
            done = self.rendered(name)
            self.assertEqual(done.returncode, 1, name)
            line = done.stderr.decode().splitlines()[-1]
            self.assertTrue(line.startswith(f"#/objects/1/material/color/file bad_asset {name}: "), line)
            self.assertIn(reason, line)
            self.assertFalse((self.directory / "out.png").exists())
