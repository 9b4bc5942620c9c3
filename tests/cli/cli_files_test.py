"""What whittle leaves on the disk: the whole picture or nothing, also when the disk or the process fails half-way."""
import json
import os
import pathlib
import shutil
import signal
import stat
import tempfile
import unittest

from tests.support.whittle import BIN, SCENES, scene, whittle

TINY = SCENES / "tiny.json"


def failing(how):
    """An environment in which file calls fail; see failing_files.cpp. The sanitizers want to be loaded first, and are
    told that here they are not."""
    asan = os.environ.get("ASAN_OPTIONS", "") + ":verify_asan_link_order=0"
    return {"LD_PRELOAD": str(BIN / "libfailing_files.so"), "FAILING_FILES": how, "ASAN_OPTIONS": asan}


class PictureFile(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.picture = self.folder / "a.png"

    def render(self, *more, how=None):
        return whittle("render", TINY, "-o", self.picture, *more, environment=failing(how) if how else None)

    def names(self):
        return sorted(path.name for path in self.folder.iterdir())

    def test_replaces_what_had_its_name(self):
        self.picture.write_bytes(b"old")
        self.assertEqual(self.render().returncode, 0)
        self.assertTrue(self.picture.read_bytes().startswith(b"\x89PNG"))
        self.assertEqual(self.names(), ["a.png"])

    def test_has_the_permissions_the_user_gives_to_new_files(self):
        old_mask = os.umask(0o027)
        self.addCleanup(os.umask, old_mask)
        for how in (None, "no_nameless"):
            with self.subTest(how=how):
                self.assertEqual(self.render(how=how).returncode, 0)
                self.assertEqual(stat.S_IMODE(self.picture.stat().st_mode), 0o640)

    def test_appears_too_where_the_file_system_knows_no_nameless_files(self):
        done = self.render("-o", self.folder / "a.exr", how="no_nameless")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.names(), ["a.exr", "a.png"])
        again = self.render(how="no_nameless")
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertEqual(self.names(), ["a.exr", "a.png"])

    def test_keeps_its_old_content_when_the_disk_is_full(self):
        self.picture.write_bytes(b"old")
        done = self.render("-o", self.folder / "b.png", how="full")
        self.assertEqual(done.returncode, 3)
        self.assertIn(b"No space left on device", done.stderr)
        self.assertEqual(self.picture.read_bytes(), b"old")
        self.assertEqual(self.names(), ["a.png"])

    def test_is_not_there_when_the_process_is_killed_with_all_of_it_written(self):
        self.assertEqual(self.render(how="kill_at_flush").returncode, -signal.SIGKILL)
        self.assertEqual(self.names(), [])

    def test_keeps_its_old_content_when_the_process_is_killed_before_the_new_one_has_its_name(self):
        self.picture.write_bytes(b"old")
        self.assertEqual(self.render(how="kill_at_name").returncode, -signal.SIGKILL)
        self.assertEqual(self.picture.read_bytes(), b"old")

    def test_that_cannot_be_written_is_told_with_its_name_before_anything_is_traced(self):
        (self.folder / "folder.png").mkdir()
        for path in (self.folder / "none" / "a.png", self.folder / "folder.png", pathlib.Path("/proc/a.png"),
                     pathlib.Path("/dev/null/a.png")):
            with self.subTest(path=path):
                done = whittle("render", TINY, "-o", path, "-o", self.picture)
                self.assertEqual((done.returncode, done.stdout), (3, b""))
                self.assertRegex(done.stderr.decode(), rf"^whittle: cannot write {path}: .+\n$")
        self.assertEqual(self.names(), ["folder.png"])


class SceneFile(unittest.TestCase):
    def test_that_cannot_be_read_is_told_with_its_name(self):
        for path in ("/nowhere/scene.json", str(SCENES)):
            for command in (["check", path], ["render", path, "-o", "a.png"]):
                with self.subTest(command=command):
                    done = whittle(*command)
                    self.assertEqual((done.returncode, done.stdout), (3, b""))
                    self.assertRegex(done.stderr.decode(), rf"^whittle: cannot read {path}: .+\n$")


class Assets(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def rendered(self, name):
        document = scene("tiny")
        document["objects"][1]["material"] = {"color": {"file": name}}
        (self.folder / "scene.json").write_text(json.dumps(document), encoding="utf-8")
        return whittle("render", self.folder / "scene.json", "-o", self.folder / "out.png", timeout=20)

    def test_are_found_beside_the_scene_and_seen_in_the_picture(self):
        shutil.copy(SCENES / "assets/tile.png", self.folder / "t.png")
        done = self.rendered("t.png")
        self.assertEqual(done.returncode, 0, done.stderr)
        tiled = (self.folder / "out.png").read_bytes()
        whittle("render", SCENES / "tiny.json", "-o", self.folder / "plain.png")
        self.assertNotEqual(tiled, (self.folder / "plain.png").read_bytes())

    def test_that_cannot_be_read_are_told_with_pointer_file_and_reason(self):
        (self.folder / "empty.png").write_bytes(b"")
        (self.folder / "text.png").write_text("no picture", encoding="utf-8")
        os.mkfifo(self.folder / "pipe.png")
        for name, reason in (("missing.png", "no such file"), ("empty.png", "is empty"), ("pipe.png", "no ordinary file"),
                             ("text.png", "no PNG, JPEG, OpenEXR or Radiance HDR file"), (".", "no ordinary file")):
            done = self.rendered(name)
            self.assertEqual(done.returncode, 1, name)
            line = done.stderr.decode().splitlines()[-1]
            self.assertTrue(line.startswith(f"#/objects/1/material/color/file bad_asset {name}: "), line)
            self.assertIn(reason, line)
            self.assertFalse((self.folder / "out.png").exists())

    def with_mesh(self, command, mesh):
        document = scene("tiny")
        document["objects"].append({"type": "mesh", "material": {"color": [0.2, 0.7, 0.3]}, **mesh})
        (self.folder / "scene.json").write_text(json.dumps(document), encoding="utf-8")
        outputs = ["-o", self.folder / "out.png"] if command == "render" else []
        return whittle(command, self.folder / "scene.json", *outputs, timeout=20)

    def test_that_are_meshes_give_the_picture_of_the_same_mesh_written_in_the_document(self):
        (self.folder / "sail.obj").write_text("v 0 0.2 1\nv 1.2 0.4 1\nv 0.4 1.6 0.5\nf 1 2 3\n", encoding="utf-8")
        done = self.with_mesh("render", {"file": "sail.obj"})
        self.assertEqual(done.returncode, 0, done.stderr)
        from_file = (self.folder / "out.png").read_bytes()
        self.with_mesh("render", {"positions": [[0, 0.2, 1], [1.2, 0.4, 1], [0.4, 1.6, 0.5]], "triangles": [[0, 1, 2]]})
        self.assertEqual(from_file, (self.folder / "out.png").read_bytes())
        whittle("render", SCENES / "tiny.json", "-o", self.folder / "plain.png")
        self.assertNotEqual(from_file, (self.folder / "plain.png").read_bytes())

    def test_that_are_no_meshes_are_told_with_pointer_file_and_place(self):
        (self.folder / "nan.obj").write_text("v 0 0 nan", encoding="utf-8")
        (self.folder / "huge.ply").write_text("ply\nformat ascii 1.0\nelement face 999999999\n"
                                              "property list int int vertex_index\nend_header\n", encoding="utf-8")
        (self.folder / "far.gltf").write_text('{"asset": {"version": "2.0"}, "buffers": [{"uri": "/etc/passwd"}]}',
                                              encoding="utf-8")
        for name, reason in (("missing.ply", "no such file"), ("nan.obj", "line 1: must be finite"),
                             ("huge.ply", "line 6: the file is too short"), ("far.gltf", "/buffers/0: must have")):
            for command in ("render", "check"):
                done = self.with_mesh(command, {"file": name})
                self.assertEqual(done.returncode, 1, name)
                line = (done.stderr if command == "render" else done.stdout).decode().splitlines()[-1]
                self.assertTrue(line.startswith(f"#/objects/2/file bad_asset {name}: "), line)
                self.assertIn(reason, line)


if __name__ == "__main__":
    unittest.main()
