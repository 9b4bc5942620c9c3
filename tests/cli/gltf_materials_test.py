"""whittle-materials with glTF and OBJ files: coefficients, textures, images within the file, and invalid files."""
import base64
import itertools
import json
import math
import os
import struct
import subprocess
import sys
import zlib

from tests.support.images import read_hdr, write_png
from tests.support.whittle import SOURCE, DirectoryTest, whittle

TOOL = SOURCE / "api" / "client" / "whittle-materials"


def png(rows, bits=8, palette=()):
    """A PNG of rows of pixels with one to four channels; with a palette of pixels, of indices into it."""
    form = {8: "B", 16: "H"}[bits]
    lines = b"".join(b"\0" + struct.pack(f">{sum(map(len, row))}{form}", *(channel for pixel in row for channel in pixel)) for row in rows)
    color_type = 3 if palette else {1: 0, 2: 4, 3: 2, 4: 6}[len(rows[0][0])]
    colors = [(b"PLTE", bytes(channel for color in palette for channel in color[:3]))] if palette else []
    colors += [(b"tRNS", bytes(color[3] for color in palette))] if palette and len(palette[0]) == 4 else []
    return write_png([(b"IHDR", struct.pack(">IIBBBBB", len(rows[0]), len(rows), bits, color_type, 0, 0, 0)), *colors,
                      (b"IDAT", zlib.compress(lines)), (b"IEND", b"")])


def squares(materials, images=(), **further):
    """Document and binary buffer: a row of unit squares in the plane z = 0 that face z, each with its material (None:
    without), and PNGs as buffer views. Texture i is image i."""
    binary, views = b"", []
    def view(content):
        nonlocal binary
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(content)})
        binary += content + b"\0" * (-len(content) % 4)
        return len(views) - 1

    corners = ((0, 0), (1, 0), (1, 1), (0, 1))
    accessors = [{"bufferView": view(struct.pack("<8f", *(c for x, y in corners for c in (x, 1 - y)))), "componentType": 5126,
                  "count": 4, "type": "VEC2"},
                 {"bufferView": view(struct.pack("<6H", 0, 1, 2, 0, 2, 3)), "componentType": 5123, "count": 6, "type": "SCALAR"}]
    primitives = []
    for i, material in enumerate(materials):
        accessors.append({"bufferView": view(struct.pack("<12f", *(c for x, y in corners for c in (x + 1.1 * i, y, 0)))),
                          "componentType": 5126, "count": 4, "type": "VEC3"})
        primitives.append({"attributes": {"POSITION": len(accessors) - 1, "TEXCOORD_0": 0}, "indices": 1,
                           **({"material": i} if material is not None else {})})
    document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                "meshes": [{"primitives": primitives}], "materials": [material or {} for material in materials],
                "images": [{"bufferView": view(image), "mimeType": "image/png"} for image in images],
                "textures": [{"source": i} for i in range(len(images))], **further}
    return {**document, "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(binary)}]}, binary


def glb(document, binary):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def gltf(document, binary):
    uri = "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
    return json.dumps({**document, "buffers": [{"byteLength": len(binary), "uri": uri}]}).encode()


RED_OVER_BLUE = png([[(255, 0, 0)] * 4] * 2 + [[(0, 0, 255)] * 4] * 2)
LEAF = png([[(0, 255, 0, 255), (0, 255, 0, 0)]])


def plain(color=(1, 1, 1, 1), metallic=0, roughness=1, **fields):
    """A material without textures."""
    return {"pbrMetallicRoughness": {"baseColorFactor": list(color), "metallicFactor": metallic, "roughnessFactor": roughness},
            **fields}


def textured(index=0, metallic=0, **fields):
    return {"pbrMetallicRoughness": {"baseColorTexture": {"index": index}, "metallicFactor": metallic}, **fields}


class MaterialsTest(DirectoryTest):
    def write(self, name, content):
        (self.directory / name).parent.mkdir(exist_ok=True)
        (self.directory / name).write_bytes(content if isinstance(content, bytes) else content.encode())

    def outcome(self, *arguments, options=()):
        """Exit code, output and lines of errors of the tool. The option -S of Python leaves out all packages."""
        done = subprocess.run([sys.executable, *options, TOOL, *arguments], cwd=self.directory, capture_output=True, text=True, check=False)
        return done.returncode, done.stdout, done.stderr.splitlines()

    def run_tool(self, content, name="a.glb", options=()):
        """outcome() of a file."""
        self.write(name, content)
        return self.outcome(name, options=options)

    def rendered(self, document):
        """The image of a document in this directory: linear values."""
        self.write("scene.json", json.dumps(document))
        done = whittle("render", self.directory / "scene.json", "-o", self.directory / "image.hdr")
        self.assertEqual(done.returncode, 0, done.stderr)
        return read_hdr((self.directory / "image.hdr").read_bytes())[0]

    def members(self, content, name="a.glb", omitted=(), options=()):
        code, output, errors = self.run_tool(content, name, options)
        self.assertEqual((code, errors), (0, list(omitted)))
        return json.loads(output)

    def files(self):
        return sorted(os.listdir(self.directory))


class Coefficients(MaterialsTest):
    def material(self, material, omitted=(), options=()):
        document, binary = squares([{"name": "m", **material}], [RED_OVER_BLUE, LEAF])
        omitted = [f"a.glb: /materials/0{line} is not carried over" for line in omitted]
        return self.members(glb(document, binary), omitted=omitted, options=options)["materials"]["m"]

    def test_splits_light_by_metallic_and_roughness(self):
        matt = self.material(plain((0.5, 0.25, 0, 1), roughness=0.5))
        self.assertEqual((matt["model"], matt["color"], matt["diffuse"], matt["ambient"]), ("blinn_phong", [0.5, 0.25, 0], 1, 1))
        self.assertEqual((matt["shininess"], matt["specular"]), (2 / 0.5 ** 4 - 2, 0.04 / 4 / 0.5 ** 4))
        self.assertNotIn("reflection", matt)
        metal = self.material(plain((1, 0.5, 0.25, 1), metallic=1, roughness=0.25))
        self.assertEqual((metal["diffuse"], metal["reflection"], metal["reflection_color"], metal["specular_color"]),
                         (0.25, 0.75, [1, 0.5, 0.25], [1, 0.5, 0.25]))
        self.assertEqual(metal["specular"], 0.75 / 4 / 0.25 ** 4)
        self.assertEqual(self.material({})["diffuse"], 1, "a rough metal scatters all light")
        self.assertEqual(self.material(plain(roughness=0))["shininess"], self.material(plain(roughness=0.2))["shininess"])
        specular = {"KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1, 0.5, 0]}}
        tinted = self.material(plain(roughness=1, extensions=specular))
        self.assertEqual(tinted["specular_color"], [1, 0.5, 0])
        self.assertAlmostEqual(tinted["specular"], 0.04 / 2 / 4)
        mixed = self.material(plain((1, 0, 0, 1), metallic=0.5, roughness=0.5))
        self.assertAlmostEqual(mixed["specular"], 0.27 / 4 / 0.5 ** 4)
        self.assertAlmostEqual(mixed["specular_color"][1], 0.02 / 0.27)
        denser = self.material(plain(roughness=1, extensions={"KHR_materials_ior": {"ior": 2}}))
        self.assertAlmostEqual(denser["specular"], 1 / 9 / 4)

    def test_conserves_energy(self):
        materials = [plain((1, 1, 1, 1), metallic, roughness, extensions={
            "KHR_materials_transmission": {"transmissionFactor": clear},
            "KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": diffuse},
            "KHR_materials_volume": {"thicknessFactor": thickness}})
            for metallic, roughness, clear, diffuse, thickness in itertools.product(
                (0, 0.25, 1), (0, 0.5, 1), (0, 0.5, 1), (0, 0.5), (0, 1))]
        code, output, _ = self.run_tool(glb(*squares(materials)))
        self.assertEqual(code, 0)
        for m in json.loads(output)["materials"].values():
            passed = [m.get("reflection", 0), m.get("transmission", 0)]
            whole = m["diffuse"] + m.get("diffuse_transmission", 0) + (max(passed) if m.get("fresnel") else sum(passed))
            self.assertLessEqual(whole, 1 + 1e-12, m)

    def test_makes_glass_sheets_and_leaves(self):
        clear = {"KHR_materials_transmission": {"transmissionFactor": 0.5}}
        sheet = self.material(plain((0, 1, 0, 1), roughness=0, extensions=clear))
        self.assertEqual((sheet["transparency"], sheet["transmission_color"], sheet["diffuse"]), ("filtered", [0, 1, 0], 0.5))
        self.assertAlmostEqual(sheet["transmission"], 0.48)
        self.assertAlmostEqual(sheet["reflection"], 0.02)
        volume = {"KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [1, 0.5, 0]},
                  "KHR_materials_ior": {"ior": 1.25}}
        glass = self.material(plain(roughness=0, extensions={**clear, **volume}))
        self.assertEqual((glass["ior"], glass["fresnel"], glass["transmission"], glass["reflection"]), (1.25, True, 0.5, 0.5))
        self.assertAlmostEqual(glass["absorption"][1], math.log(2) / 2)
        self.assertAlmostEqual(glass["absorption"][2], math.log(1e6) / 2)
        leaf = self.material(plain(extensions={"KHR_materials_diffuse_transmission": {
            "diffuseTransmissionFactor": 0.25, "diffuseTransmissionColorFactor": [0, 1, 0]}}))
        self.assertEqual((leaf["diffuse"], leaf["diffuse_transmission"], leaf["diffuse_transmission_color"]), (0.75, 0.25, [0, 1, 0]))
        self.material(plain(roughness=0.5, alphaMode="BLEND", extensions={**clear, **volume}), omitted=(
            "/pbrMetallicRoughness: the roughness of what is transmitted", "/alphaMode: the opacity of glass"))

    def test_carries_emission_and_opacity(self):
        lamp = self.material(plain(emissiveFactor=[1, 0.5, 0],
                                   extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 4}}))
        self.assertEqual(lamp["emission"], [4, 2, 0])
        self.assertEqual(self.material(plain(emissiveFactor=[1, 1, 1], emissiveTexture={"index": 0}))["emission"], "a.0.png")
        unlit = self.material(textured(extensions={"KHR_materials_unlit": {}}))
        self.assertEqual((unlit["emission"], unlit["diffuse"], unlit["ambient"]), ("a.0.png", 0, 0))
        for mode, alpha, opacity in (("BLEND", 0.25, 0.25), ("MASK", 0.25, 0), ("MASK", 0.75, 1), ("OPAQUE", 0.25, 1)):
            self.assertEqual(self.material(plain((1, 1, 1, alpha), alphaMode=mode)).get("opacity", 1), opacity)
        self.assertEqual(self.material(textured(1, alphaMode="BLEND"))["opacity"], "a.1.png'")
        self.assertNotIn("opacity", self.material(textured(0, alphaMode="BLEND")), "an image without alpha")

    def test_lists_what_is_not_carried_over(self):
        material = {"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 0.5], "baseColorTexture": {"index": 1},
                                             "metallicRoughnessTexture": {"index": 0}},
                    "occlusionTexture": {"index": 0}, "normalTexture": {"index": 0, "scale": 2},
                    "emissiveFactor": [1, 0.5, 1], "emissiveTexture": {"index": 0, "texCoord": 1},
                    "alphaMode": "MASK", "extensions": {"KHR_materials_clearcoat": {}, "KHR_materials_specular": {
                        "specularTexture": {"index": 0}}}}
        always = ["/occlusionTexture: occlusionTexture", "/extensions: KHR_materials_clearcoat"]
        specular = "/extensions/KHR_materials_specular/specularTexture: specularTexture"
        coordinates = "/emissiveTexture: a texture with other coordinates than TEXCOORD_0"
        self.material(material, omitted=[*always, specular, coordinates])
        for name in self.files():
            if name != "a.glb":
                (self.directory / name).unlink()
        self.material(material, options=["-S"], omitted=[
            "/pbrMetallicRoughness: the hue of baseColorFactor beside baseColorTexture", *always,
            "/pbrMetallicRoughness/metallicRoughnessTexture: metallicRoughnessTexture: metallic is 0, roughness its factor, the "
            "texture itself", specular, coordinates, "/normalTexture: the scale of normalTexture",
            "/alphaMode: the sharp edge at alphaCutoff"])
        self.material(plain(emissiveFactor=[0.5, 1, 1], emissiveTexture={"index": 0}), options=["-S"],
                      omitted=[": the factor 1 of emissiveTexture"])


class Textures(MaterialsTest):
    def test_writes_images_within_the_file_beside_it(self):
        for name, content in (("a.glb", glb(*squares([textured()], [RED_OVER_BLUE]))),
                              ("b.gltf", gltf(*squares([textured()], [RED_OVER_BLUE])))):
            for _ in range(2):  # the second time it exists
                members = self.members(content, name)
                self.assertEqual((self.directory / f"{name[0]}.0.png").read_bytes(), RED_OVER_BLUE)
            self.assertEqual(members["textures"], {f"{name[0]}.0.png": {"file": f"{name[0]}.0.png"}})
        self.assertEqual(self.files(), ["a.0.png", "a.glb", "b.0.png", "b.gltf"])

    def test_leaves_files_with_another_content_as_they_are(self):
        content = glb(*squares([textured(0), textured(1)], [RED_OVER_BLUE, LEAF]))
        for mine in (b"mine", LEAF + b"mine"):
            (self.directory / "a.1.png").write_bytes(mine)
            self.assertEqual(self.run_tool(content), (1, "", ["a.1.png: exists with another content"]))
            self.assertEqual((self.directory / "a.1.png").read_bytes(), mine)
            self.assertEqual(self.files(), ["a.1.png", "a.glb"])

    def test_carries_samplers_transforms_and_other_files(self):
        (self.directory / "oak board.png").write_bytes(RED_OVER_BLUE)
        transform = {"KHR_texture_transform": {"scale": [2, 3], "offset": [0.5, 0.25]}}
        document, binary = squares([{"normalTexture": {"index": 0, "extensions": transform}}], samplers=[
            {"wrapS": 33071, "wrapT": 33071, "magFilter": 9728}], images=[])
        document.update(images=[{"uri": "oak%20board.png"}], textures=[{"source": 0, "sampler": 0}])
        members = self.members(glb(document, binary))
        self.assertEqual(members["textures"], {"oak board.png": {
            "file": "oak board.png", "color_space": "linear", "wrap": "clamp", "filter": "nearest", "scale": [2, 3],
            "offset": [0.5, -2.25]}})
        self.assertEqual(self.files(), ["a.glb", "oak board.png"])
        document["images"] = [{"uri": "none.png"}]
        self.assertEqual(self.run_tool(glb(document, binary)),
                         (1, "", ["a.glb: /images/0/uri: cannot be read: No such file or directory"]))
        document["images"] = [{"uri": "https://example.org/a.png"}]
        self.members(glb(document, binary), omitted=["a.glb: /images/0/uri: an image at another place (https://example.org/a.png) "
                                                     "is not carried over"])

    def test_makes_a_mesh_with_its_materials_that_whittle_renders(self):
        materials = [textured(0, name="up"), plain((0, 1, 0, 1)), None, textured(1, name="leaf", alphaMode="BLEND")]
        document, binary = squares(materials, [RED_OVER_BLUE, LEAF])
        document["materials"].append({"name": "unused"})
        members = self.members(glb(document, binary))
        self.assertEqual(members["objects"][0]["materials"], {"#1": "#1", "leaf": "leaf", "up": "up"})
        self.assertIn("unused", members["materials"])
        for x, up, down in ((0.5, (255, 0, 0), (0, 0, 255)), (1.6, (0, 255, 0), (0, 255, 0)), (2.7, (255,) * 3, (255,) * 3)):
            self.assertEqual(self.colors(members, x), (up, down), x)

    def colors(self, members, x):
        """The upper and the lower color of the square in the middle of x, in even light."""
        rows = self.rendered({"version": 1, "image": {"width": 8, "height": 8}, "background": "black", "ambient": 1, "output": {"formats": ["hdr"]},
                              "camera": {"type": "orthographic", "position": [x, 0.5, 5], "look_at": [x, 0.5, 0], "height": 0.9}, **members})
        return tuple(tuple(int(255 * channel + 0.5) for channel in rows[row][4]) for row in (1, 6))


class Objs(MaterialsTest):
    def test_reads_the_libraries_of_an_obj(self):
        self.write("mats/a b.mtl", "newmtl up\nmap_Kd up.png\nKa 1\nnewmtl unused\n")
        self.write("c.mtl", "newmtl green\nKd 0 1 0\nbump x.png\n")
        members = self.members("mtllib mats/a b.mtl\nmtllib c.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl up\nf 1 2 3\nusemtl green\n"
                               "f 1 3 2\nusemtl none\nf 2 3 1\nusemtl unused\n", "a.obj", omitted=(
            "c.mtl:3: bump is not carried over", 'a.obj:11: the material "none" is in none of its MTL files'))
        self.assertEqual(members["objects"], [{"type": "mesh", "file": "a.obj", "material": {},
                                               "materials": {"green": "green", "up": "up"}}])
        self.assertEqual(members["textures"], {"up.png": {"file": "mats/up.png"}})
        self.assertEqual(self.run_tool("v 0 0 0\n", "a.obj"), (1, "", ["a.obj: is neither a glTF file nor an OBJ with faces"]))
        self.assertEqual(self.run_tool("mtllib d.mtl\nf 1 2 3\n", "a.obj"), (1, "", ["d.mtl: No such file or directory"]))


class InvalidFiles(MaterialsTest):
    def refused(self, content, sentence):
        with self.subTest(sentence):
            self.assertEqual(self.run_tool(content), (1, "", [f"a.glb: {sentence}"]))
            self.assertEqual(self.files(), ["a.glb"])

    def test_names_the_place_in_the_container(self):
        whole = glb(*squares([textured()], [RED_OVER_BLUE]))
        self.refused(whole[:8], "byte 8: the file ends within its header")
        self.refused(whole[:4] + b"\1" + whole[5:], "byte 4: must be version 2 of GLB, got 1")
        self.refused(whole[:-4], f"byte 8: declares {len(whole)} bytes, the file has {len(whole) - 4}")
        self.refused(whole[:8] + (16).to_bytes(4, "little") + whole[12:], "byte 12: the file ends within a chunk")
        self.refused("{", "its JSON: Expecting property name enclosed in double quotes: line 1 column 2 (char 1)")
        self.refused('{"asset": {"version": NaN}}', "its JSON: NaN is no JSON")
        self.refused('{"a": ' + "[" * 100_000, "its JSON: maximum recursion depth exceeded while decoding a JSON array "
                     "from a unicode string")
        self.refused('{"asset": {"version": "1.0"}}', "/asset/version: must be 2.x")

    def test_names_the_pointer_of_values(self):
        def changed(**further):
            document, binary = squares([textured()], [RED_OVER_BLUE])
            return glb({**document, **further}, binary)

        huge = 10 ** 400
        for further, sentence in (
                ({"materials": {}}, "/materials: must be an array"),
                ({"materials": [[]]}, "/materials/0: must be an object"),
                ({"materials": [{"name": 1}]}, "/materials/0/name: must be a string"),
                ({"materials": [plain((1, 1, 1))]}, "/materials/0/pbrMetallicRoughness/baseColorFactor: must be 4 numbers"),
                ({"materials": [plain((1, 1, 1, huge))]},
                 "/materials/0/pbrMetallicRoughness/baseColorFactor/3: must be a number from 0 to 1"),
                ({"materials": [plain(metallic="1")]}, "/materials/0/pbrMetallicRoughness/metallicFactor: must be a number from 0 to 1"),
                ({"materials": [plain(alphaMode="X")]}, "/materials/0/alphaMode: must be OPAQUE, MASK or BLEND"),
                ({"materials": [textured(1)]},
                 "/materials/0/pbrMetallicRoughness/baseColorTexture/index: must be an integer from 0 to 0"),
                ({"textures": []}, "/materials/0/pbrMetallicRoughness/baseColorTexture/index: refers to a list without elements"),
                ({"textures": [{"source": huge}]}, "/textures/0/source: must be an integer from 0 to 0"),
                ({"textures": [{"source": 0, "sampler": 0}], "samplers": [{"wrapS": 1}]},
                 "/samplers/0: wrapS and wrapT must be 10497, 33071 or 33648"),
                ({"images": [{"bufferView": 99}]}, "/images/0/bufferView: must be an integer from 0 to 3"),
                ({"images": [{"uri": "data:image/png;base64,***"}]}, "/images/0/uri: is no base64"),
                ({"images": [{}]}, '/images/0: must have "bufferView"'),
                ({"buffers": [{"byteLength": 4_000_000_000}]},
                 f"/buffers/0: declares 4000000000 bytes, there are {len(squares([None], [RED_OVER_BLUE])[1])}"),
                ({"buffers": [{"byteLength": 8, "uri": "a.bin"}]},
                 "/buffers/0/uri: names another file, which is not opened: a mesh must be one file"),
                ({"nodes": [{"children": [0]}]}, "/nodes/0/children/0: the node is reached twice: nodes must make a tree, without "
                 "circles"),
                ({"nodes": [{"mesh": 1}]}, "/nodes/0/mesh: must be an integer from 0 to 0")):
            self.refused(changed(**further), sentence)
        document, binary = squares([textured()], [RED_OVER_BLUE])
        document["bufferViews"][3]["byteLength"] += 1000
        self.refused(glb(document, binary), f"/bufferViews/3: ends at byte {len(binary) - (-len(RED_OVER_BLUE) % 4) + 1000}, "
                     f"its buffer has {len(binary)}")

    def test_survives_half_surrogates_and_deep_nodes(self):
        document, binary = squares([plain(name="\ud800")])
        depth = 20_000
        document["nodes"] = [{"children": [i + 1]} for i in range(depth)] + [{"mesh": 0}]
        self.assertEqual(self.members(glb(document, binary))["objects"][0]["materials"], {"\ud800": "\ud800"})
