"""whittle-materials: statements of MTL files as materials of a document that whittle accepts, and invalid files."""
import json
import pathlib
import subprocess
import tempfile
import unittest

from tests.support.whittle import SOURCE, whittle

TOOL = SOURCE / "api" / "client" / "whittle-materials"


def run(*texts):
    """Exit code, output and the lines of errors for files a.mtl, b.mtl, ... of these texts."""
    with tempfile.TemporaryDirectory() as directory:
        paths = []
        for name, text in zip("ab", texts):
            paths.append(pathlib.Path(directory) / f"{name}.mtl")
            paths[-1].write_bytes(text if isinstance(text, bytes) else text.encode())
        done = subprocess.run([TOOL, *paths], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout, done.stderr.replace(directory + "/", "").splitlines()


class Materials(unittest.TestCase):
    def translated(self, text):
        code, output, errors = run(text)
        self.assertEqual((code, errors), (0, []))
        return json.loads(output)

    def material(self, statements):
        return self.translated("newmtl m\n" + statements)["materials"]["m"]

    def test_gives_the_coefficients_of_the_local_model(self):
        material = self.material("Kd 0.5 0.25 0\nKa 0.25\nKs 0 0.5 1\nNs 60\nKe 1 2 3\nillum 2\n")
        self.assertEqual(material, {"model": "phong", "color": [1, 0.5, 0], "diffuse": 0.5, "ambient": 0.25, "specular": 1,
                                    "specular_color": [0, 0.5, 1], "shininess": 60, "emission": [1, 2, 3]})
        self.assertEqual(self.material("Ks 1 1 1\nillum 1\n")["model"], "lambert")
        self.assertNotIn("specular", self.material("Ks 1 1 1\nillum 1\n"))

    def test_makes_mirrors_glass_and_cut_outs(self):
        mirror = self.material("Ks 0.5 0.25 0\nillum 3\n")
        self.assertEqual((mirror["reflection"], mirror["reflection_color"], mirror["fresnel"]), (0.5, [1, 0.5, 0], False))
        self.assertTrue(self.material("Ks 1 1 1\nillum 5\nNi 1.4\n")["fresnel"])
        glass = self.material("Kd 1 1 1\nd 0.25\nNi 1.4\nTf 0.5 1 0.5\nillum 7\n")
        self.assertEqual((glass["transmission"], glass["ior"], glass["transmission_color"], glass["diffuse"]),
                         (1, 1.4, [0.5, 1, 0.5], 0.25))
        self.assertNotIn("opacity", glass)
        self.assertEqual(self.material("d 0.25\n")["opacity"], 0.25)
        self.assertEqual(self.material("Tr 0.25\n")["opacity"], 0.75)

    def test_names_textures_by_their_files_once(self):
        found = self.translated("newmtl a\nmap_Kd -s 2 3 1 -o 0.5 -clamp on tex\\oak board.png\nnorm tex/n.png\n"
                                "newmtl b\nmap_Kd -s 2 3 1 -o 0.5 -clamp on tex/oak board.png\nmap_Ke other/oak board.png\n"
                                "map_d -imfchan m leaf.png\n")
        oak = {"file": "tex/oak board.png", "scale": [2, 3], "offset": [0.5, 0], "wrap": "clamp"}
        self.assertEqual(found["textures"], {
            "oak board.png": oak, "n.png": {"file": "tex/n.png", "color_space": "linear"},
            "oak board.png'": {"file": "other/oak board.png"}, "leaf.png": {"file": "leaf.png", "channel": "alpha"}})
        a, b = found["materials"]["a"], found["materials"]["b"]
        self.assertEqual((a["color"], a["normal_map"], b["color"], b["emission"], b["opacity"]),
                         ("oak board.png", "n.png", "oak board.png", "oak board.png'", "leaf.png"))

    def test_lists_what_is_not_carried_over(self):
        code, output, errors = run("newmtl a\nmap_Ns n.png\nKa spectral a.rfl 1\nmap_Kd -mm 0 2 -blendu off a.png\nd -halo 1\n"
                                   "bump -bm 2 b.png\nKd 1 0 0\nmap_d d.png\nd 0.5\n")
        self.assertEqual(code, 0)
        self.assertEqual(json.loads(output)["materials"]["a"]["color"], "a.png")
        self.assertEqual(errors, [f"a.mtl:{line}: {what} is not carried over" for line, what in (
            (2, "map_Ns"), (3, "Ka spectral"), (4, "map_Kd -mm"), (4, "map_Kd -blendu"), (5, "d -halo"), (6, "bump"),
            (1, "the hue of Kd beside map_Kd, in a,"), (1, "d beside map_d, in a,"))])

    def test_refuses_invalid_files_with_the_place(self):
        for text, message in (
                ("Kd 1 1 1\n", "a.mtl:1: Kd stands before the first newmtl"), ("newmtl\n", "a.mtl:1: newmtl has no name"),
                ("newmtl a\nKd 1 1\n", "a.mtl:2: Kd must have one or three numbers"),
                ("newmtl a\nKd 1 1 x\n", "a.mtl:2: Kd must have 1 to 3 finite numbers"),
                ("newmtl a\nNs nan\n", "a.mtl:2: Ns must have 1 finite numbers"),
                ("newmtl a\nKs 1 -1 1\n", "a.mtl:2: Ks must be >= 0"), ("newmtl a\nnewmtl a\n",
                                                                         'a.mtl:2: the material "a" is defined twice'),
                ("newmtl a\nmap_Kd -s\n", "a.mtl:2: -s of map_Kd has no value"),
                ("newmtl a\nmap_Kd -what 1 x.png\n", "a.mtl:2: map_Kd has the unknown option -what"),
                ("newmtl a\nmap_Kd -clamp on\n", "a.mtl:2: map_Kd names no file"),
                (b"newmtl a\n" + b"#" * 16_000_000, "a.mtl: has more than 16000000 bytes")):
            with self.subTest(message):
                self.assertEqual(run(text), (1, "", [message]))
        self.assertEqual(run("newmtl a\n", "newmtl a\n"), (1, "", ['b.mtl: the material "a" is in two files']))
        self.assertEqual(subprocess.run([TOOL], capture_output=True, check=False).returncode, 2)
        self.assertEqual(subprocess.run([TOOL, "none.mtl"], capture_output=True, check=False).returncode, 1)

    def test_makes_members_of_a_document_for_the_parts_of_an_obj(self):
        found = self.translated("newmtl red\nKd 0.8 0 0\nKs 1 1 1\nNs 20\nnewmtl glass\nillum 7\nNi 1.5\nKd 0 0 0\n"
                                "newmtl shiny\nKs 0.5 0.5 0.5\nillum 5\nNi 1.4\nnewmtl thin\nd 0.5\nKe 1 1 1\n")
        with tempfile.TemporaryDirectory() as directory:
            target = pathlib.Path(directory)
            (target / "strip.obj").write_text(
                "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 2 0\nv 1 2 0\nusemtl red\nf 1 2 3\nusemtl glass\nf 2 4 3\n"
                "usemtl shiny\nf 3 4 5\nusemtl thin\nf 4 6 5\n", encoding="utf-8")
            scene = {"version": 1, "image": {"width": 16, "height": 16}, "camera": {"position": [0.5, 1, 4], "look_at": [0.5, 1, 0]},
                     "background": "white", "lights": [{"type": "point", "position": [1, 1, 5]}], **found,
                     "objects": [{"type": "mesh", "file": "strip.obj", "material": {},
                                  "materials": {name: name for name in found["materials"]}}]}
            (target / "scene.json").write_text(json.dumps(scene), encoding="utf-8")
            done = whittle("render", target / "scene.json", "-o", target / "image.png")
            self.assertEqual(done.returncode, 0, done.stderr)
            scene["objects"][0]["materials"]["blue"] = "red"
            (target / "scene.json").write_text(json.dumps(scene), encoding="utf-8")
            done = whittle("render", target / "scene.json", "-o", target / "image.png")
            self.assertEqual(done.returncode, 1)
            self.assertIn("/objects/0/materials/blue", str(done.stderr))


if __name__ == "__main__":
    unittest.main()
