"""Models by one command: the document that stands for one, its image, and what is not carried over."""
import base64
import json
import math
import struct
import zlib

import numpy

from tests.support.images import read_hdr, write_png
from tests.support.whittle import DirectoryTest, succeeded, whittle


def png(rows):
    """A PNG of rows of pixels with three or four channels."""
    lines = b"".join(b"\0" + bytes(channel for pixel in row for channel in pixel) for row in rows)
    head = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, {3: 2, 4: 6}[len(rows[0][0])], 0, 0, 0)
    return write_png([(b"IHDR", head), (b"IDAT", zlib.compress(lines)), (b"IEND", b"")])


def squares(materials, images=(), **further):
    """Document and binary buffer: a row of unit squares in the plane z = 0 that face z, and PNGs; texture i is image i."""
    binary, views = b"", []

    def view(content):
        nonlocal binary
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(content)})
        binary += content + b"\0" * (-len(content) % 4)
        return len(views) - 1

    corners, primitives = ((0, 0), (1, 0), (1, 1), (0, 1)), []
    uvs, indices = struct.pack("<8f", *(c for x, y in corners for c in (x, 1 - y))), struct.pack("<6H", 0, 1, 2, 0, 2, 3)
    accessors = [{"bufferView": view(uvs), "componentType": 5126, "count": 4, "type": "VEC2"},
                 {"bufferView": view(indices), "componentType": 5123, "count": 6, "type": "SCALAR"}]
    for i, _ in enumerate(materials):
        positions = struct.pack("<12f", *(c for x, y in corners for c in (x + i, y, 0)))
        accessors.append({"bufferView": view(positions), "componentType": 5126, "count": 4, "type": "VEC3"})
        primitives.append({"attributes": {"POSITION": len(accessors) - 1, "TEXCOORD_0": 0}, "indices": 1, "material": i})
    image_lists = {"images": [{"bufferView": view(image), "mimeType": "image/png"} for image in images], "textures": [{"source": i} for i in range(len(images))]}
    return {"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}], "meshes": [{"primitives": primitives}], "materials": materials, **image_lists, **further,
            "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(binary)}]}, binary


def glb(document, binary):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def extension(name, **fields):
    return {"extensions": {f"KHR_materials_{name}": fields}}


LEAF = png([[(0, 255, 0, 255), (0, 255, 0, 0)]])
QUARTERS = png([[(255, 64, 128), (0, 191, 255)]])
UP = {"translation": [0.5, 0.5, 3]}


class ModelTest(DirectoryTest):
    def write(self, name, content):
        (self.directory / name).parent.mkdir(exist_ok=True)
        (self.directory / name).write_bytes(content if isinstance(content, bytes) else content.encode())

    def imported(self, name, content, omitted=()):
        """The document of a model; `omitted`: ends of the lines about parts that it does not have."""
        self.write(name, content)
        done = succeeded(whittle("import", self.directory / name, "-o", self.directory / "model.json"))
        lines = done.stderr.decode().splitlines()
        self.assertEqual(len(lines), len(omitted), lines)
        for line, end in zip(lines, omitted):
            self.assertTrue(line.endswith(end), line)
        return json.loads((self.directory / "model.json").read_text())

    def image(self, name, *options, document=None):
        """Linear values of a render."""
        if document is not None:
            self.write(name, json.dumps(document))
        succeeded(whittle("render", self.directory / name, "-o", self.directory / "image.hdr", "--quiet", *options))
        return read_hdr((self.directory / "image.hdr").read_bytes())[0]

    def refusal(self, name, content):
        self.write(name, content)
        done = whittle("render", self.directory / name, "-o", self.directory / "image.png")
        self.assertEqual((done.returncode, (self.directory / "image.png").exists()), (1, False), done.stderr)
        return done.stderr.decode().strip()


class GltfModels(ModelTest):
    def test_have_principled_materials(self):
        cases = {
            "metal": ({"pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0.25, 1], "roughnessFactor": 0.25}},
                      {"color": [1, 0.5, 0.25], "metallic": 1, "roughness": 0.25}),
            "textures": ({"pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 1, 1], "baseColorTexture": {"index": 1}, "metallicFactor": 0.5,
                                                   "metallicRoughnessTexture": {"index": 1}}},
                         {"color": {"file": "a.glb", "image": 1, "factor": [1, 0.5, 1]},
                          "metallic": {"file": "a.glb", "image": 1, "channel": "blue", "color_space": "linear", "factor": 0.5},
                          "roughness": {"file": "a.glb", "image": 1, "channel": "green", "color_space": "linear"}}),
            "glass": ({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_ior": {"ior": 1.25},
                                      "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 2,
                                                               "attenuationColor": [1, math.exp(-1), 1]}}},
                      {"transmission": 1, "ior": 1.25, "absorption": [0, 0.5, 0]}),
            "sheet": (extension("transmission", transmissionFactor=0.5, transmissionTexture={"index": 1}),
                      {"transmission": 0.5, "transparency": "filtered",
                       "transmission_color": {"file": "a.glb", "image": 1, "channel": "red", "color_space": "linear"}}),
            "paint": (extension("clearcoat", clearcoatFactor=0.5, clearcoatTexture={"index": 1}, clearcoatRoughnessFactor=0.25),
                      {"coat": {"file": "a.glb", "image": 1, "channel": "red", "color_space": "linear", "factor": 0.5}, "coat_roughness": 0.25}),
            "lamp": ({"emissiveFactor": [0.5, 0.25, 1], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}}},
                     {"emission": [2, 1, 4]}),
            "unlit": ({"pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}, **extension("unlit")},
                      {"color": 0, "specular": 0, "emission": {"file": "a.glb", "image": 1}}),
            "leaf": ({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "alphaMode": "MASK", "alphaCutoff": 0.25},
                     {"opacity": {"file": "a.glb", "image": 0, "channel": "alpha"}, "opacity_cutoff": 0.25}),
            "veil": ({"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]}, "alphaMode": "BLEND"}, {"opacity": 0.5}),
            "paper": (extension("diffuse_transmission", diffuseTransmissionFactor=0.5, diffuseTransmissionColorFactor=[1, 0, 0]),
                      {"diffuse_transmission": 0.5, "diffuse_transmission_color": [1, 0, 0]}),
            "relief": ({"normalTexture": {"index": 1, "scale": 2}},
                       {"normal_map": {"file": "a.glb", "image": 1, "color_space": "linear"}, "normal_scale": 2}),
            "tinted": (extension("specular", specularFactor=0.5, specularColorFactor=[1, 0.5, 0]),
                       {"specular": 0.5, "specular_color": [1, 0.5, 0]}),
            "placed": ({"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0, "extensions": {
                "KHR_texture_transform": {"scale": [2, 4], "offset": [0.5, 0.25]}}}},
                       {"emission": {"file": "a.glb", "image": 0, "scale": [2, 4], "offset": [0.5, -3.25]}})}
        document, binary = squares([{"name": name, **material} for name, (material, _) in cases.items()], [LEAF, QUARTERS])
        found = self.imported("a.glb", glb(document, binary))
        for name, (_, expected) in cases.items():
            with self.subTest(name):
                material = found["materials"][name]
                self.assertEqual({field: material.get(field) for field in expected}, expected)
        self.assertEqual(found["objects"][0]["materials"], {name: name for name in cases})
        self.image("a.glb")  # all of them are valid

    def test_are_seen_by_their_camera_in_their_light(self):
        # A white matt square, 2 below a light of 8 pi candela: its middle has the radiance 8 / 2^2.
        document, binary = squares([{"pbrMetallicRoughness": {"metallicFactor": 0}, **extension("specular", specularFactor=0)}])
        document.update(nodes=[{"mesh": 0}, {"camera": 0, **UP}, {"translation": [0.5, 0.5, 2], "extensions": {"KHR_lights_punctual": {"light": 0}}},
                               {"camera": 0}], scenes=[{"nodes": [0, 1, 2, 3]}],
                        cameras=[{"type": "orthographic", "orthographic": {"xmag": 0.1, "ymag": 0.05, "znear": 0, "zfar": 9}}],
                        extensions={"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 8 * math.pi, "color": [1, 0.5, 0.25], "range": 9}]}})
        found = self.imported("a.glb", glb(document, binary), ["the range of a light is not carried over", "a further camera is not carried over"])
        self.assertEqual((found["image"]["width"], found["image"]["height"]), (960, 480))
        self.assertEqual(found["camera"], {"position": [0.5, 0.5, 3], "look_at": [0.5, 0.5, 2], "up": [0, 1, 0], "type": "orthographic", "height": 0.1})
        self.assertEqual(found["output"]["exposure"], -1)
        found["image"] = {"width": 16, "height": 8}
        values = self.image("model.json", document=found)
        numpy.testing.assert_allclose(values[4, 8], [2, 1, 0.5], rtol=0.02)
        document["extensions"]["KHR_lights_punctual"]["lights"] = [
            {"type": "spot", "intensity": math.pi, "spot": {"outerConeAngle": math.pi / 6}}]
        self.assertEqual(self.imported("a.glb", glb(document, binary), ["a further camera is not carried over"])["lights"][0], {
            "type": "spot", "position": [0.5, 0.5, 2], "attenuation": "inverse_square", "direction": [0, 0, -1], "intensity": 1,
            "inner_angle": 0, "outer_angle": 30})
        # A directional light of 2 pi lux, and a perspective camera that sees 4 units in height there.
        document["extensions"]["KHR_lights_punctual"]["lights"] = [{"type": "directional", "intensity": 2 * math.pi, "color": [1, 0.5, 0.25]}]
        document["cameras"] = [{"type": "perspective", "perspective": {"yfov": 2 * math.atan(2 / 3), "aspectRatio": 2, "znear": 1}}]
        found = self.imported("a.glb", glb(document, binary), ["a further camera is not carried over"])
        self.assertEqual(found["lights"], [{"type": "directional", "direction": [0, 0, -1], "intensity": 2, "color": [1, 0.5, 0.25]}])
        self.assertEqual((found["image"]["width"], found["image"]["height"], found["output"]["exposure"]), (960, 480, -1))
        self.assertAlmostEqual(found["camera"]["fov"], 2 * math.degrees(math.atan(2 / 3)), places=6)
        found["image"] = {"width": 32, "height": 16}
        lit = self.image("model.json", document=found)
        numpy.testing.assert_allclose(lit[6:10, 14:18], numpy.full((4, 4, 3), [2, 1, 0.5]), rtol=0.02)
        self.assertLess(numpy.delete(lit, slice(13, 19), axis=1).max(), 0.01)

    def test_show_images_within_the_file_times_factors(self):
        unlit = {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 1, 1, 1], "baseColorTexture": {"index": 0}}, **extension("unlit")}
        document, binary = squares([unlit], [QUARTERS], samplers=[{"magFilter": 9728}], textures=[{"source": 0, "sampler": 0}])
        document.update(nodes=[{"mesh": 0}, {"camera": 0, **UP}], scenes=[{"nodes": [0, 1]}],
                        cameras=[{"type": "orthographic", "orthographic": {"xmag": 0.5, "ymag": 0.5, "znear": 0, "zfar": 9}}])
        linear = lambda code: (code / 255 / 12.92 if code <= 10 else ((code / 255 + 0.055) / 1.055) ** 2.4)
        uri = "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
        inside = json.dumps({**document, "buffers": [{"byteLength": len(binary), "uri": uri}]})
        beside = json.dumps({**document, "buffers": [{"byteLength": len(binary), "uri": "the%20model.bin"}], "images": [{"uri": "a%2Bb.png"}]})
        self.write("the model.bin", binary)
        self.write("a+b.png", QUARTERS)
        for name, content in (("a.glb", glb(document, binary)), ("b.gltf", inside), ("c.gltf", beside)):
            with self.subTest(name):
                self.write(name, content)
                values = self.image(name)
                height, width = values.shape[:2]
                for column, code in ((width // 4, (255, 64, 128)), (3 * width // 4, (0, 191, 255))):
                    expected = [linear(code[0]) / 2, linear(code[1]), linear(code[2])]
                    numpy.testing.assert_allclose(values[height // 2, column], expected, rtol=0.02, atol=0.01)

    def test_list_each_omission_once(self):
        material = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "emissiveTexture": {"index": 0}}
        document, binary = squares([material, material], [QUARTERS], samplers=[{"wrapS": 33071}], textures=[{"source": 0, "sampler": 0}])
        self.imported("a.glb", glb(document, binary), ["/samplers/0: a wrapT unlike wrapS is not carried over"])

    def test_move_at_a_time(self):
        document, binary = squares([extension("unlit")])
        keys = struct.pack("<2f6f", 0, 2, 0, 0, 0, 4, 0, 0)
        document["accessors"] += [{"bufferView": len(document["bufferViews"]), "componentType": 5126, "count": 2, "type": "SCALAR"},
                                  {"bufferView": len(document["bufferViews"]), "byteOffset": 8, "componentType": 5126, "count": 2, "type": "VEC3"}]
        document["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(keys)})
        document["buffers"] = [{"byteLength": len(binary + keys)}]
        count = len(document["accessors"])
        document["animations"] = [{"samplers": [{"input": count - 2, "output": count - 1}], "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]}]
        self.write("a.glb", glb(document, binary + keys))
        view = {"image": {"width": 60, "height": 10}, "background": 0, "accuracy": {"samples": 1},
                "camera": {"type": "orthographic", "position": [3, 0.5, 5], "look_at": [3, 0.5, 0], "height": 1}}
        # As an option, with a camera of the file: 80 pixels a unit. The sky is darker than the square.
        document.update(nodes=[{"mesh": 0}, {"camera": 0, "translation": [3, 0.5, 5]}], scenes=[{"nodes": [0, 1]}],
                        cameras=[{"type": "orthographic", "orthographic": {"xmag": 3, "ymag": 3, "znear": 0, "zfar": 9}}])
        self.write("b.glb", glb(document, binary + keys))
        for time, first in ((0.5, 80), (9, 320)):
            lit = self.image("b.glb", "--time", time)[240, :, 0] > 0.9
            self.assertEqual((lit.argmax(), lit.sum()), (first, 80), time)
        for time, first in ((None, 0), (0.5, 10), (1, 20), (9, 40)):
            lit = self.image("s.json", document={"version": 1, "model": "a.glb", **view, **({"time": time} if time is not None else {})})[5, :, 0] > 0.5
            self.assertEqual((lit.argmax(), lit.sum()), (first, 10), time)

    def test_are_refused_with_the_place_of_their_error(self):
        document, binary = squares([{}])
        broken = {"not_json.gltf": (b'{"asset"', "byte 8"), "short.glb": (glb(document, binary)[:100], "byte"), "empty.glb": (b"", "is empty"),
                  "wrong.glb": (glb({**document, "materials": [{"alphaMode": "NONE"}]}, binary), "/materials/0: the alphaMode must be"),
                  "range.glb": (glb({**document, "materials": [{"pbrMetallicRoughness": {"metallicFactor": 2}}]}, binary),
                                "/materials/0/pbrMetallicRoughness/metallicFactor: must be a number from 0 to 1, got the number 2"),
                  "missing.gltf": (json.dumps({**document, "buffers": [{"byteLength": 4, "uri": "none.bin"}]}), "/buffers/0/uri: no such file"),
                  "bad.obj": ("v 0 0\nf 1 2 3\n", "line 1"), "bad.ply": ("ply\nformat ascii 1.0\n", "line"), "bad.stl": ("solid a\nfacet\n", "line")}
        for name, (content, place) in broken.items():
            with self.subTest(name):
                self.assertRegex(self.refusal(name, content), rf"^#/model bad_asset {name}: .*{place}")


class ModelsOfEachKind(ModelTest):
    def test_are_seen_under_a_sky_and_a_key_light(self):
        """One tetrahedron has the same image, whatever its file. That of STL, where z is up, lies on its back."""
        corners, faces = ((0, 1, 0), (-1, 0, 1), (1, 0, 1), (0, 0, -1)), ((0, 1, 2), (1, 3, 2), (2, 3, 0), (0, 3, 1))
        soup = [corners[i] for face in faces for i in face]
        lines = lambda before, rows: "".join(f"{before}{' '.join(map(str, row))}\n" for row in rows)
        triples = lambda first: [(i, i + 1, i + 2) for i in range(first, first + 12, 3)]
        stl = "".join(f"facet normal 0 0 0\nouter loop\n{lines('vertex ', ((x, -z, y) for x, y, z in (corners[i] for i in face)))}endloop\nendfacet\n"
                      for face in faces)
        accessor = {"bufferView": 0, "componentType": 5126, "count": 12, "type": "VEC3"}
        gltf = {"asset": {"version": "2.0"}, "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "accessors": [accessor],
                "bufferViews": [{"buffer": 0, "byteLength": 144}], "buffers": [{"byteLength": 144}]}
        models = {"a.obj": lines("v ", soup) + lines("f ", triples(1)), "a.stl": f"solid a\n{stl}endsolid a\n",
                  "a.ply": "ply\nformat ascii 1.0\nelement vertex 12\n" + lines("property float ", "xyz") + "element face 4\n"
                           "property list uchar int vertex_indices\nend_header\n" + lines("", soup) + lines("3 ", triples(0)),
                  "a.glb": glb(gltf, struct.pack("<36f", *(c for corner in soup for c in corner)))}
        images = {}
        for name, content in models.items():
            found, is_stl = self.imported(name, content), name == "a.stl"
            self.assertEqual(found["background"], {"zenith": [0.4, 0.47, 0.56], "nadir": [0.26, 0.25, 0.24], "up": [0, 0, 1] if is_stl else [0, 1, 0]})
            self.assertEqual(found["lights"], [{"type": "directional", "direction": [0.5, 0.8, -1] if is_stl else [0.5, -1, -0.8], "intensity": 0.5}])
            images[name] = self.image(name)
            self.assertLess(numpy.abs(images[name] - images["a.obj"]).mean(), 0.002, name)
        sky, lit, shaded = (images["a.obj"][place].mean(axis=(0, 1)) for place in (numpy.s_[:9, :9], numpy.s_[290:320, 200:300], numpy.s_[290:320, 366:376]))
        self.assertTrue(0.9 > lit.max() > lit.min() > 0.6 and 0.45 > shaded.max() > shaded.min() > 0.2, (lit, shaded))
        numpy.testing.assert_allclose(sky, [0.32, 0.35, 0.38], atol=0.01)


class ObjModels(ModelTest):
    OBJ = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nusemtl red\nf 1 2 3\nusemtl glass\nf 2 4 3\n"

    def test_have_the_materials_of_mtl_files(self):
        self.write("a.mtl", "newmtl red\nKd 0.8 0 0\nKs 0.5 0.5 0.5\nNs 98\nKe 1 2 3\nmap_Kd -s 2 2 oak.png\nmap_d leaf.png\nd 0.5\nbump b.png\n"
                            "newmtl glass\nillum 7\nNi 1.25\nTf 0.5 1 0.5\nnewmtl flat\nillum 0\nKd 1 0.5 0\nnewmtl mirror\nillum 3\nKs 0.9 0.9 0.9\n"
                            "newmtl steel\nPr 0.25\nPm 1\nnorm n.png\n")
        self.write("oak.png", QUARTERS)
        self.write("leaf.png", LEAF)
        self.write("n.png", QUARTERS)
        found = self.imported("a.obj", self.OBJ, ["a.mtl:9: bump is not carried over"])["materials"]
        near = found["red"].pop("roughness")
        self.assertAlmostEqual(near, (2 / 100) ** 0.25, places=5)
        self.assertEqual(found, {
            "red": {"model": "principled", "color": {"scale": [2, 2], "file": "oak.png", "factor": [0.8, 0, 0]}, "specular": 1,
                    "emission": [1, 2, 3], "opacity": {"file": "leaf.png", "channel": "alpha", "factor": 0.5}},
            "glass": {"model": "principled", "color": [0.5, 1, 0.5], "roughness": found["glass"]["roughness"], "ior": 1.25, "transmission": 1},
            "flat": {"model": "principled", "color": 0, "specular": 0, "emission": [1, 0.5, 0]},
            "mirror": {"model": "principled", "color": [0.9, 0.9, 0.9], "roughness": found["mirror"]["roughness"], "specular": 1, "metallic": 1},
            "steel": {"model": "principled", "color": 0.8, "roughness": 0.25, "metallic": 1, "normal_map": {"file": "n.png", "color_space": "linear"}}})
        self.image("a.obj")

    def test_fill_the_image_whatever_their_size_and_place(self):
        for name, size, place in (("small", 1e-6, 0), ("large", 1e6, 0), ("far", 1, 1e5)):
            self.write(f"{name}.obj", "".join(f"v {x * size + place} {y * size} {z * size - place}\n" for x in (0, 1) for y in (0, 3) for z in (0, 1))
                       + "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n")
            values = self.image("s.json", document={"version": 1, "model": f"{name}.obj", "image": {"width": 64, "height": 64}, "background": 0,
                                                    "lights": [], "ambient": 1, "accuracy": {"model": "whitted", "samples": 1}})
            rows = numpy.flatnonzero((values.max(axis=2) > 0.01).any(axis=1))
            self.assertTrue(1 <= rows[0] <= 4 and 59 <= rows[-1] <= 62, (name, rows))
