"""whittle-materials: statements of MTL files as materials of a document that whittle accepts, invalid files, images that
are computed, and --into."""
import json

import numpy

from tests.cli.gltf_materials_test import LEAF, RED_OVER_BLUE, MaterialsTest, glb, plain, png, squares, textured
from tests.support.images import read_hdr


class Materials(MaterialsTest):
    def of_mtl(self, *texts):
        """outcome() of files a.mtl, b.mtl of these texts."""
        names = [f"{name}.mtl" for name, _ in zip("ab", texts)]
        for name, text in zip(names, texts):
            self.write(name, text)
        return self.outcome(*names)

    def translated(self, text):
        code, output, errors = self.of_mtl(text)
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

    def test_takes_the_color_of_illum_0_as_it_is(self):
        self.assertEqual(self.material("Kd 1 0.5 0\nillum 0\n"), {
            "model": "lambert", "color": 0, "ambient": 0, "diffuse": 0, "emission": [1, 0.5, 0]})
        self.assertEqual(self.material("map_Kd a.png\nillum 0\nd 0.5\n")["emission"], "a.png")

    def test_multiplies_textures_by_the_colors_beside_them(self):
        self.write("tex/oak.png", RED_OVER_BLUE)
        self.write("tex/a.mtl", "newmtl a\nKd 0.5 0.25 0.25\nmap_Kd -s 2 2 oak.png\nKs 0.5 0.5 0.5\nmap_Ks oak.png\nillum 3\n"
                                "newmtl b\nKe 3 3 9\nmap_Ke oak.png\nd 0.5\nmap_d oak.png\n")
        members = self.members("mtllib tex/a.mtl\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n", "a.obj", omitted=[
            "tex/a.mtl:7: map_d is the luminance of its image: the hue, in b, is not carried over"])
        a, b, textures = members["materials"]["a"], members["materials"]["b"], members["textures"]
        self.assertEqual((a["diffuse"], a["specular_color"], a["reflection_color"]), (0.5, "oak.png", "oak.png"))
        self.assertEqual(textures["a.0.Kd.hdr"], {"file": "tex/a.0.Kd.hdr", "scale": [2, 2]})
        for name, top, bottom in ((a["color"], [1, 0, 0], [0, 0, 0.5]), (b["emission"], [3, 0, 0], [0, 0, 9]),
                                  (b["opacity"], [0.1063] * 3, [0.0361] * 3)):
            image, _ = read_hdr((self.directory / textures[name]["file"]).read_bytes())
            for row, expected in ((0, top), (3, bottom)):
                self.assertLess(numpy.abs(image[row] - expected).max(), max(expected) / 100, name)

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
        code, output, errors = self.of_mtl("newmtl a\nmap_Ns n.png\nKa spectral a.rfl 1\nmap_Kd -mm 0 2 -blendu off a.png\nd -halo 1\n"
                                           "bump -bm 2 b.png\nKd 1 0 0\nmap_d d.png\nd 0.5\n")
        self.assertEqual(code, 0)
        self.assertEqual(json.loads(output)["materials"]["a"]["color"], "a.png")
        self.assertEqual(errors, [f"a.mtl:{line}: {what} is not carried over" for line, what in (
            (2, "map_Ns"), (3, "Ka spectral"), (4, "map_Kd -mm"), (4, "map_Kd -blendu"), (5, "d -halo"), (6, "bump"),
            (1, "the hue of Kd beside map_Kd, in a,"),
            (1, "map_d as one number instead of three, because its image cannot be read, in a,"), (1, "d beside map_d, in a,"))])

        for statements, what in (("illum 10\n", "illum 10"), ("d 0.5\nTf 1 0 0\n", "Tf of a surface that is no glass"),
                                 ("illum 7\nmap_d a.png\n", "map_d of glass"), ("map_Ks a.png\n", "map_Ks without Ks")):
            self.assertEqual(self.of_mtl("newmtl a\n" + statements)[2], [f"a.mtl:1: {what}, in a, is not carried over"])

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
                self.assertEqual(self.of_mtl(text), (1, "", [message]))
        self.assertEqual(self.of_mtl("newmtl a\n", "newmtl a\n"), (1, "", ['b.mtl: the material "a" is in two files']))
        self.assertEqual((self.outcome()[0], self.outcome("none.mtl")[0]), (2, 1))

    def test_makes_members_of_a_document_for_the_parts_of_an_obj(self):
        found = self.translated("newmtl red\nKd 0.8 0 0\nKs 1 1 1\nNs 20\nnewmtl glass\nillum 7\nNi 1.5\nKd 0 0 0\n"
                                "newmtl shiny\nKs 0.5 0.5 0.5\nillum 5\nNi 1.4\nnewmtl thin\nd 0.5\nKe 1 1 1\n")
        self.write("strip.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 2 0\nv 1 2 0\nusemtl red\nf 1 2 3\nusemtl glass\nf 2 4 3\n"
                                "usemtl shiny\nf 3 4 5\nusemtl thin\nf 4 6 5\n")
        self.rendered({"version": 1, "image": {"width": 16, "height": 16}, "camera": {"position": [0.5, 1, 4], "look_at": [0.5, 1, 0]},
                       "background": "white", "lights": [{"type": "point", "position": [1, 1, 5]}], **found,
                       "objects": [{"type": "mesh", "file": "strip.obj", "material": {}, "materials": {name: name for name in found["materials"]}}]})


def luminance(*rgb):
    """Linear values of sRGB code values from 0 to 1, by IEC 61966-2-1 and ITU-R BT.709."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in rgb]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


class Opacity(MaterialsTest):
    """map_d is one number: the image is rendered on a plane that glows white, over black."""

    ALPHA = "map_d is the alpha of its image: the rest of it, in m,"
    HUE = "map_d is the luminance of its image: the hue, in m,"
    # An image of two texels, the opacities that it stands for, and what is listed.
    CASES = {
        "rgb": (png([[(255, 0, 0), (0, 0, 255)]]), (luminance(1, 0, 0), luminance(0, 0, 1)), [HUE]),
        "gray rgb": (png([[(51, 51, 51), (255, 255, 255)]]), (luminance(.2, .2, .2), 1), []),
        "gray of 16 bits": (png([[(13107,), (65535,)]], 16), (luminance(.2, .2, .2), 1), []),
        "rgba": (png([[(255, 0, 0, 51), (0, 0, 255, 204)]]), (.2, .8), [ALPHA]),
        "white rgba": (png([[(255, 255, 255, 51), (255, 255, 255, 204)]]), (.2, .8), []),
        "rgba of constant alpha": (png([[(255, 0, 0, 51), (0, 0, 255, 51)]]), (.2, .2), [ALPHA]),
        "opaque rgba": (png([[(255, 0, 0, 255), (0, 0, 255, 255)]]), (luminance(1, 0, 0), luminance(0, 0, 1)), [HUE]),
        "palette with alpha": (png([[(0,), (1,)]], palette=[(255, 0, 0, 51), (0, 0, 255, 204)]), (.2, .8), [ALPHA])}

    def test_is_alpha_or_else_luminance(self):
        cases = [(name, *case, factor) for name, case in self.CASES.items() for factor in (1, 0.5)]
        cases.append(("-imfchan m", self.CASES["rgba"][0], (.2, .8), [], 1))
        statements, listed = [], []
        for i, (name, image, _, omitted, factor) in enumerate(cases):
            self.write(f"{i}.png", image)
            option = name + " " if name.startswith("-") else ""
            statements.append(f"newmtl m{i}\nillum 0\nKd 1 1 1\nd {factor}\nmap_d {option}{i}.png\n")
            listed += [f"a.mtl:{1 + 5 * i}: {what.replace('in m', f'in m{i}')} is not carried over" for what in omitted]
        members = self.members("".join(statements), "a.mtl", omitted=listed)
        for texture in members["textures"].values():
            texture["filter"] = "nearest"
        squares_of = [{"type": "mesh", "positions": [[2 * i, 0, 0], [2 * i + 2, 0, 0], [2 * i + 2, 1, 0], [2 * i, 1, 0]],
                       "faces": [[0, 1, 2, 3]], "uvs": [[0, 0], [1, 0], [1, 1], [0, 1]], "material": f"m{i}"}
                      for i in range(len(cases))]
        (pixels,) = self.rendered({
            "version": 1, "image": {"width": 2 * len(cases), "height": 1}, "camera": {
                "type": "orthographic", "position": [len(cases), .5, 5], "look_at": [len(cases), .5, 0], "height": 1},
            "accuracy": {"samples": 1}, "output": {"formats": ["hdr"]}, "objects": squares_of, **members})
        for i, (name, _, opacities, _, factor) in enumerate(cases):
            for pixel, opacity in zip(pixels[2 * i:2 * i + 2], opacities):
                with self.subTest(name, factor=factor):
                    self.assertLess(numpy.abs(pixel - opacity * factor).max(), opacity * factor / 60)


METAL_OVER_MATT = png([[(0, 64, 255)] * 4, [(0, 128, 255)] * 4, [(255, 255, 0)] * 4, [(255, 255, 0)] * 4])


class ComputedImages(MaterialsTest):
    """Products of textures and factors."""

    def images_of(self, material, images, omitted=()):
        for name in self.files():
            (self.directory / name).unlink()
        document, binary = squares([{"name": "m", **material}], images)
        members = self.members(glb(document, binary), omitted=omitted)
        material = members["materials"]["m"]
        values = {field: read_hdr((self.directory / texture["file"]).read_bytes())[0]
                  for field, name in material.items()
                  if isinstance(name, str) and (texture := members["textures"].get(name)) and texture["file"].endswith(".hdr")}
        return material, values, members

    def near(self, image, expected):
        self.assertLess(numpy.abs(image - numpy.array(expected)).max(), 1 / 128)

    def test_are_made_of_metallic_and_roughness(self):
        factors = {"baseColorFactor": [1, 0.5, 1, 1], "baseColorTexture": {"index": 0}, "roughnessFactor": 0.5,
                   "metallicRoughnessTexture": {"index": 1}}
        material, images, _ = self.images_of({"pbrMetallicRoughness": factors}, [LEAF, METAL_OVER_MATT], omitted=[
            "a.glb: /materials/0/pbrMetallicRoughness/metallicRoughnessTexture: the width of highlights by texel: they have "
            "that of the mean roughness 0.34, the texture's is not carried over"])
        green, rough = numpy.array([0, 0.5, 0]), (64 / 510, 128 / 510)
        for row, r in enumerate(rough):
            self.near(images["color"][row], green * r)
            self.near(images["reflection_color"][row], green * (1 - r))
            self.near(images["specular_color"][row] * material["specular"] * 8 / (material["shininess"] + 2), green * (1 - r))
        self.near(images["color"][2:], green)
        self.near(images["reflection_color"][2:], 0)
        self.near(images["specular_color"][2:] * material["specular"] * 8 / (material["shininess"] + 2), 0.04)
        self.assertEqual((material["diffuse"], material["reflection"]), (1, 1))
        self.assertAlmostEqual(material["shininess"], 2 / (sum(rough) / 4 + 0.25) ** 4 - 2, places=3)
        self.assertLessEqual((images["color"] + images["reflection_color"]).max(), 1)

    def test_are_means_if_the_textures_are_placed_differently(self):
        moved = {"index": 1, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}}
        material, images, _ = self.images_of(
            {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": moved}}, [LEAF, METAL_OVER_MATT],
            omitted=["a.glb: /materials/0/pbrMetallicRoughness/metallicRoughnessTexture: metallicRoughnessTexture, placed unlike "
                     "baseColorTexture: its means are, the texture itself is not carried over"])
        self.assertEqual((material["color"], images), ("a.0.png", {}))
        self.assertAlmostEqual(material["reflection"], 0.5 * (1 - (64 + 128 + 510) / 1020), places=6)

    def test_are_colors_if_they_are_even(self):
        even = png([[(255, 51, 255)] * 2])
        material, images, _ = self.images_of({"pbrMetallicRoughness": {
            "baseColorFactor": [1, 0.5, 0.25, 1], "metallicRoughnessTexture": {"index": 0}}}, [even])
        self.assertEqual(images, {})
        self.near(numpy.array(material["reflection_color"]), [0.8, 0.4, 0.2])
        self.near(numpy.array(material["color"]), [0.2, 0.1, 0.05])

    def test_are_products_with_factors(self):
        material, images, _ = self.images_of({**textured(), "emissiveFactor": [1, 0.5, 1], "emissiveTexture": {"index": 0},
                                              "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 8}}},
                                             [RED_OVER_BLUE])
        self.near(images["emission"][0], [8, 0, 0])
        self.near(images["emission"][3], [0, 0, 8])
        _, images, _ = self.images_of(textured(extensions={"KHR_materials_unlit": {}}) | {"pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0}, "baseColorFactor": [0.5, 0.5, 0.25, 1]}}, [RED_OVER_BLUE])
        self.near(images["emission"][3], [0, 0, 0.25])
        slope = png([[(255, 128, 255), (128, 128, 255)]])
        _, images, members = self.images_of({"normalTexture": {"index": 0, "scale": 0.5}}, [slope])
        self.near(images["normal_map"][0, 0], numpy.array([0.5, 0, 1]) / 1.25 ** 0.5 / 2 + 0.5)
        self.assertEqual(members["textures"]["a.0.normal.hdr"], {"file": "a.0.normal.hdr"}, "Radiance HDR is linear")

    def test_cut_out_at_the_alpha_cutoff(self):
        shades = png([[(0, 255, 0, alpha) for alpha in (0, 100, 150, 255)]])
        for mode, fields, opacity in (("MASK", {}, (0, 0, 1, 1)), ("MASK", {"alphaCutoff": 0.25}, (0, 1, 1, 1)),
                                      ("BLEND", {}, (0, 50 / 255, 75 / 255, 0.5))):
            material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0, "baseColorFactor": [
                1, 1, 1, 1 if mode == "MASK" else 0.5]}, "alphaMode": mode, **fields}
            _, images, members = self.images_of(material, [shades])
            self.near(images["opacity"][0, :, 0], opacity)
            self.assertEqual(members["textures"]["a.0.opacity.hdr"].get("filter"), "nearest" if mode == "MASK" else None)


class Scenes(MaterialsTest):
    """--into."""

    def run_into(self, scene):
        self.write("a.glb", glb(*squares([plain((1, 0, 0, 1), name="red")])))
        self.write("scene.json", scene)
        return self.outcome("a.glb", "--into", "scene.json")

    def test_have_the_members_of_the_files_beside_theirs(self):
        scene = {"version": 1, "image": {"width": 8, "height": 8}, "background": "black", "ambient": 1,
                 "camera": {"type": "orthographic", "position": [0.5, 0.5, 5], "look_at": [0.5, 0.5, 0], "height": 0.9},
                 "materials": {"blue": {"color": "blue"}},
                 "objects": [{"type": "plane", "point": [0, 0, -1], "normal": [0, 0, 1], "material": "blue"}]}
        code, output, errors = self.run_into(json.dumps(scene))
        self.assertEqual((code, errors), (0, []))
        document = json.loads(output)
        self.assertEqual((sorted(document["materials"]), len(document["objects"])), (["blue", "red"], 2))
        numpy.testing.assert_allclose(self.rendered(document)[4][4], [1, 0, 0], atol=0.01)

    def test_are_refused_if_they_have_the_same_names_or_are_invalid(self):
        for scene, sentence in (('{"materials": {"red": {}}}', "/materials/red of the scene: a file has the same name"),
                                ('{"objects": {}}', "/objects of the scene must be an array"),
                                ("[]", "scene.json: must be an object"),
                                ("{", "scene.json: Expecting property name enclosed in double quotes: line 1 column 2 (char 1)")):
            self.assertEqual(self.run_into(scene), (1, "", [sentence]))
