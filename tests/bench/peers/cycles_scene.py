"""Renders a scene of triangle meshes with Cycles; run by Blender's own Python:

    blender --background --factory-startup --python cycles_scene.py -- SCENE.json IMAGE.ppm SETTINGS

SETTINGS is a JSON object: `samples`, `seed`, `threshold` (noise of adaptive sampling, 0 without), `threads`. The image is a
linear 16-bit PPM. Prints `render SECONDS`, without Blender's start.

- The background is a color, a gradient along `up`, or an environment in a file, with the z axis as `up`.
- A material is Lambert's, a diffuse closure of the reflectance `color` with roughness 0, or an emission closure whose
  strength 1 is the radiance `emission`. Both sides of a lamp shine, as Whittle's do.
- The film is a box of one pixel, as Whittle's is by default.
"""
import array
import json
import math
import os
import sys
import time

import bpy
from mathutils import Matrix, Vector


def color(value):
    return [*value, 1] if isinstance(value, list) else [value, value, value, 1]


def sky(document):
    """The world's background; `Incoming` points from the sky to the eye."""
    world, background = bpy.data.worlds.new("world"), document.get("background", 0)
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    result = nodes["Background"].inputs["Color"]
    if not isinstance(background, dict):
        result.default_value = color(background)
    elif "environment" in background:
        image = nodes.new("ShaderNodeTexEnvironment")
        image.image = bpy.data.images.load(os.path.abspath(document["textures"][background["environment"]]["file"]))
        links.new(image.outputs["Color"], result)
    else:
        geometry, up = nodes.new("ShaderNodeNewGeometry"), nodes.new("ShaderNodeVectorMath")
        half, mixed = nodes.new("ShaderNodeMath"), nodes.new("ShaderNodeMixRGB")
        up.operation, half.operation = "DOT_PRODUCT", "MULTIPLY_ADD"
        up.inputs[1].default_value = background["up"]
        half.inputs[1].default_value, half.inputs[2].default_value = -0.5, 0.5
        mixed.inputs[1].default_value, mixed.inputs[2].default_value = color(background["nadir"]), color(background["zenith"])
        links.new(geometry.outputs["Incoming"], up.inputs[0])
        links.new(up.outputs["Value"], half.inputs[0])
        links.new(half.outputs[0], mixed.inputs[0])
        links.new(mixed.outputs[0], result)
    return world


def material(name, value):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    if "emission" in value:
        closure = nodes.new("ShaderNodeEmission")
        closure.inputs["Strength"].default_value = 1
    else:
        closure = nodes.new("ShaderNodeBsdfDiffuse")
        closure.inputs["Roughness"].default_value = 0
    closure.inputs["Color"].default_value = color(value.get("emission", value.get("color")))
    links.new(closure.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made


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
        scene.collection.objects.link(bpy.data.objects.new(str(i), mesh))
    scene.camera = camera(document["camera"])
    scene.collection.objects.link(scene.camera)
    scene.world = sky(document)
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
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    for kind in ("max_bounces", "diffuse_bounces"):
        setattr(cycles, kind, 1024)
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width = 1


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
