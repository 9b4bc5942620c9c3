"""Renders a scene of triangle meshes with Cycles; run by Blender's own Python:

    blender --background --factory-startup --python cycles_scene.py -- SCENE.json IMAGE.ppm SETTINGS

SETTINGS is a JSON object: `samples`, `seed`, `threshold` (noise of adaptive sampling, 0 without), `clamp` (of indirect
light, 0 without), `bounces`, `threads`. The image is a linear 16-bit PPM. Prints `render SECONDS`, without Blender's start.

- Materials are Lambert's and mirrors: a diffuse closure of the reflectance `color` x `diffuse` with roughness 0, a glossy one
  of `reflection` with roughness 0, and an emission closure whose strength 1 is the radiance `emission`. Both sides of a lamp
  shine, as Whittle's do. A color may be a checker.
- The film is a box of one pixel, as Whittle's is by default.
"""
import array
import json
import math
import sys
import time

import bpy
from mathutils import Matrix, Vector


def color(nodes, links, value):
    """The colour, or the output of nodes for a checker."""
    if not isinstance(value, dict):
        return [*([value] * 3 if isinstance(value, (int, float)) else value), 1]
    place, checker = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeTexChecker")
    links.new(place.outputs["UV"], checker.inputs["Vector"])
    checker.inputs["Scale"].default_value = value["scale"]
    # Of the squares with z = 0, those with an even sum have the second colour.
    for name, of in zip(("Color2", "Color1"), value["checker"]):
        checker.inputs[name].default_value = color(nodes, links, of)
    return checker.outputs["Color"]


def material(name, value):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()

    def closure(kind, of, **inputs):
        node = nodes.new(f"ShaderNode{kind}")
        for key, given in {"Color": of, **inputs}.items():
            if hasattr(given, "node"):
                links.new(given, node.inputs[key])
            else:
                node.inputs[key].default_value = given
        return node.outputs[0]

    share, reflected, emission = value.get("diffuse", 1), value.get("reflection", 0), value.get("emission", [0, 0, 0])
    parts = []
    if share:
        own = color(nodes, links, value.get("color", 1))
        parts.append(closure("BsdfDiffuse", own if share == 1 else [share * part for part in own[:3]] + [1], Roughness=0))
    if reflected:
        parts.append(closure("BsdfGlossy", [reflected] * 3 + [1], Roughness=0))
    if any(emission):
        parts.append(closure("Emission", [*emission, 1], Strength=1))
    shader = parts[0]
    for part in parts[1:]:
        both = nodes.new("ShaderNodeAddShader")
        links.new(shader, both.inputs[0])
        links.new(part, both.inputs[1])
        shader = both.outputs[0]
    links.new(shader, nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made


def light(value):
    """Directional, or a point with the attenuation inverse_square; without size. A light of intensity I gives an irradiance of
    pi I cos in Whittle; the energy of a sun is its irradiance in Blender, that of a point its power."""
    kind, power = ("SUN", math.pi) if value["type"] == "directional" else ("POINT", 4 * math.pi ** 2)
    made = bpy.data.lights.new("light", kind)
    made.energy = power * value["intensity"]
    if kind == "SUN":
        made.angle = 0
    else:
        made.shadow_soft_size = 0
    made.cycles.max_bounces = 1024
    placed = bpy.data.objects.new("light", made)
    if kind == "SUN":
        placed.rotation_euler = Vector(value["direction"]).to_track_quat("-Z", "Y").to_euler()
    else:
        placed.location = value["position"]
    return placed


def camera(value):
    made = bpy.data.cameras.new("camera")
    made.sensor_fit = "VERTICAL"  # the angle is that of the height
    made.angle = math.radians(value["fov"])
    made.clip_start, made.clip_end = 1e-3, 1e6
    placed = bpy.data.objects.new("camera", made)
    position, target = Vector(value["position"]), Vector(value["look_at"])
    back = (position - target).normalized()
    right = Vector(value.get("up", (0, 1, 0))).cross(back).normalized()
    placed.matrix_world = Matrix.Translation(position) @ Matrix((right, back.cross(right), back)).transposed().to_4x4()
    return placed


def build(document):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    materials = {name: material(name, value) for name, value in document["materials"].items()}
    for i, value in enumerate(document["objects"]):
        mesh = bpy.data.meshes.new(str(i))
        mesh.from_pydata(value["positions"], [], value["triangles"])
        mesh.materials.append(materials[value["material"]])
        mesh.polygons.foreach_set("use_smooth", [value.get("smooth", False)] * len(mesh.polygons))
        if value.get("uvs"):
            corner = array.array("i", [0]) * len(mesh.loops)
            mesh.loops.foreach_get("vertex_index", corner)
            mesh.uv_layers.new().data.foreach_set("uv", [part for each in corner for part in value["uvs"][each]])
        scene.collection.objects.link(bpy.data.objects.new(str(i), mesh))
    for value in document.get("lights", []):
        scene.collection.objects.link(light(value))
    scene.camera = camera(document["camera"])
    scene.collection.objects.link(scene.camera)
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (
        *document.get("background", {}).get("color", [0, 0, 0]), 1)
    return scene


def settle(scene, document, settings, image):
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = document["image"]["width"], document["image"]["height"]
    render.resolution_percentage = 100
    render.threads_mode, render.threads = "FIXED", settings["threads"]
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    render.filepath = image + ".exr"
    cycles.device, cycles.use_denoising = "CPU", False
    cycles.samples, cycles.seed = settings["samples"], settings["seed"]
    cycles.use_adaptive_sampling = settings["threshold"] > 0
    cycles.adaptive_threshold = settings["threshold"]
    cycles.sample_clamp_direct, cycles.sample_clamp_indirect = 0, settings["clamp"]
    for kind in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces"):
        setattr(cycles, kind, settings["bounces"])
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width = 1
    cycles.blur_glossy = 0  # mirrors stay sharp after diffuse bounces


def write_ppm(scene, image):
    """The linear image, row 0 on top, in 16 bits."""
    rendered = bpy.data.images.load(image + ".exr")
    width, height = rendered.size
    values = array.array("f", [0]) * (4 * width * height)
    rendered.pixels.foreach_get(values)
    codes = array.array("H", (min(65535, max(0, round(65535 * values[4 * ((height - 1 - y) * width + x) + channel])))
                              for y in range(height) for x in range(width) for channel in range(3)))
    if sys.byteorder == "little":
        codes.byteswap()
    with open(image, "wb") as file:
        file.write(f"P6\n{width} {height}\n65535\n".encode() + codes.tobytes())


def main():
    path, image, settings = sys.argv[sys.argv.index("--") + 1:]
    with open(path, encoding="utf-8") as file:
        document = json.load(file)
    scene = build(document)
    settle(scene, document, json.loads(settings), image)
    start = time.perf_counter()
    bpy.ops.render.render(write_still=True)
    print(f"render {time.perf_counter() - start:.3f}")
    write_ppm(scene, image)


main()
