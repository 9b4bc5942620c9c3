#!/usr/bin/python3
"""Renders the images of scene.md: api/docs/render_images.py WHITTLE [NAME...]

An image shows one shape, light or material on a common stage, or a recipe, whose document is the block of JSON on the page.
"""
import json
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import zlib

DOCS = pathlib.Path(__file__).parent
SIZE = {"width": 160, "height": 120}
SKY = {"zenith": "#7fa8d1", "nadir": "#eef3f8"}
FLOOR = {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": {"color": "#c4c0b8"}}
TILES = {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0],
         "material": {"color": {"checker": ["#c9c4ba", "#8d877c"], "scale": 1}}}
SUN = {"type": "directional", "direction": [-0.9, -1.5, -0.8], "color": [1, 0.96, 0.88], "intensity": 0.95}


def stage(objects, lights=(SUN,), floor=FLOOR, **more):
    return {"version": 1, "image": SIZE, "camera": {"position": [1.2, 2.3, 6], "look_at": [0, 0.85, 0], "fov": 28},
            "background": SKY, "depth_cue": {"front": 7.6, "back": 13, "color": "#e9e6e0"}, "ambient": 0.25,
            "lights": list(lights), "accuracy": {"samples": 64},
            "objects": [floor, *objects], **more}


def painted(repetitions):
    return {"color": {"checker": ["#d9542b", "#f3c9a5"], "scale": repetitions}, "specular": 0.25, "shininess": 40}


def shapes():
    star = [[(1 if i % 2 else 0.45) * x for x in p] for i, p in enumerate(
        [(0, -1), (0.588, -0.809), (0.951, -0.309), (0.951, 0.309), (0.588, 0.809),
         (0, 1), (-0.588, 0.809), (-0.951, 0.309), (-0.951, -0.309), (-0.588, -0.809)])]
    flat = {"color": "#d9542b", "specular": 0.25, "shading": "flat"}
    each = {
        "sphere": {"center": [0, 1, 0], "radius": 1, "material": painted([12, 6])},
        "plane": {"point": [0, 0, 0], "normal": [0.12, 1, 0], "material": painted(1.5)},
        "disc": {"center": [0, 1, 0], "normal": [0.4, 0.4, 1], "radius": 1, "inner_radius": 0.4, "material": painted(6)},
        "cylinder": {"base": [0, 0, 0], "height": 1.8, "radius": 0.7, "material": painted([12, 4])},
        "cone": {"base": [0, 0, 0], "height": 2, "radius": 0.9, "material": painted([12, 5])},
        "box": {"size": [1.5, 1.3, 1.1], "position": [0, 0.65, 0], "rotate": [0, 35, 0], "material": painted(4)},
        "torus": {"center": [0, 0.7, 0], "axis": [0.2, 1, 0.5], "major_radius": 0.8, "minor_radius": 0.32,
                  "material": painted([18, 6])},
        "triangle": {"vertices": [[-1, 0.05, 0.3], [1.1, 0.05, 0], [-0.1, 1.9, -0.3]], "material": painted(4)},
        "mesh": {"positions": [[0, 1, 0.4], [0, 1, -0.4], *([x, 1 - y, 0] for x, y in star)], "rotate": [0, -18, 0],
                 "faces": [[a, *((2 + (i + 1) % 10, 2 + i) if a else (2 + i, 2 + (i + 1) % 10))]
                           for i in range(10) for a in (0, 1)], "material": flat}}
    scenes = {"shape_" + name: stage([{"type": name, **fields}] if name != "plane" else [],
                                     floor={"type": name, **fields} if name == "plane" else FLOOR)
              for name, fields in each.items()}
    pawn = [{"type": "cone", "base": [0, 0, 0], "height": 1, "radius": 0.34, "apex_radius": 0.1, "material": {"color": "#d9542b"}},
            {"type": "sphere", "center": [0, 1.05, 0], "radius": 0.26, "material": {"color": "#f3c9a5", "specular": 0.3}}]
    scenes["shape_instance"] = stage([{"type": "instance", "of": "pawn", "position": [x, 0, z], "scale": s}
                                      for x, z, s in ((-1, 0, 1.3), (0, 0.4, 1), (1, 0, 1.3), (0.3, -1.2, 1.6))],
                                     prototypes={"pawn": pawn})
    return scenes


def lights():
    room = [{"type": "sphere", "center": [-0.5, 0.6, 0], "radius": 0.6, "material": {"color": "#d9542b", "specular": 0.4}},
            {"type": "box", "size": 0.8, "position": [0.8, 0.4, 0.3], "rotate": [0, 30, 0], "material": {"color": "#f3c9a5"}},
            {"type": "plane", "point": [0, 0, -1.6], "normal": [0, 0, 1], "material": {"color": "#cfd3d8"}}]
    each = {
        "point": {"position": [1.4, 2.6, 1.6]},
        "directional": {"direction": [-1, -1.2, -0.8], "intensity": 0.8},
        "spot": {"position": [1.5, 3, 1.5], "target": [-0.1, 0.3, 0], "inner_angle": 14, "outer_angle": 22},
        "line": {"from": [-1.6, 2.4, 0.9], "to": [1.6, 2.4, 0.9]},
        "rect": {"corner": [-0.9, 1.75, -1.3], "edge_u": [1.4, 0, 0], "edge_v": [0, 0.35, 0.35], "visible": True},
        "disc": {"center": [0.9, 1.6, -1], "normal": [-0.4, -0.4, 1], "radius": 0.4, "visible": True},
        "sphere": {"center": [0.45, 1.55, -0.2], "radius": 0.25, "visible": True}}
    scenes = {"light_" + name: stage(room, [{"type": name, **fields}], background=0, ambient=0.06)
              for name, fields in each.items()}
    for scene in scenes.values():
        del scene["depth_cue"]
        scene["accuracy"] = {"samples": 196}
    return scenes


def materials():
    glass = {"color": 0, "specular": 0.6, "shininess": 300, "transmission": 1}
    bumps = {"noise": [0, 1], "scale": [24, 12], "octaves": 3}
    each = {
        "lambert": {"model": "lambert", "color": "#d9542b"},
        "phong": {"color": "#d9542b", "specular": 0.5, "shininess": 20},
        "blinn_phong": {"model": "blinn_phong", "color": "#d9542b", "specular": 0.5, "shininess": 20},
        "ambient": {"color": "#d9542b", "diffuse": 0, "ambient": 2.5},
        "emission": {"color": 0, "emission": "#ffd27a"},
        "reflection": {"color": 0.05, "reflection": 0.85},
        "metal": {"color": "#7a5a18", "specular": 0.6, "specular_color": "gold", "reflection": 0.6,
                  "reflection_color": "#ffd97a", "shininess": 80},
        "lacquer": {"color": "#a01818", "specular": 0.5, "shininess": 200, "reflection": 1, "fresnel": True},
        "glass": glass,
        "absorption": {**glass, "absorption": [0.2, 1.2, 1.6]},
        "interpolated": {"color": "#d9542b", "transmission": 0.6, "transparency": "interpolated"},
        "filtered": {"color": 0.1, "transmission": 0.9, "transmission_color": "#f4a13c", "transparency": "filtered"},
        "checker": {"color": {"checker": ["#d9542b", "#f3c9a5"], "scale": [16, 8]}},
        "gradient": {"color": {"gradient": ["#d9542b", "#f6e3cf"]}},
        "noise": {"color": {"noise": ["#7a2f18", "#f6e3cf"], "scale": [10, 5], "octaves": 5}},
        "bump": {"color": "#d9542b", "specular": 0.4, "shininess": 30, "bump": {"texture": bumps, "scale": 0.08}},
        "cut_out": {"color": "#d9542b", "opacity": {"checker": [1, 0], "scale": [16, 8]}},
        "lantern": {"color": "#5a2415", "emission": {"checker": [0, "#ffc45a"], "scale": [16, 8]}},
        "stained": {"color": 0.1, "transmission": 0.9, "transparency": "filtered",
                    "transmission_color": {"checker": ["#f4a13c", "#3c8ef4"], "scale": [8, 4]}},
        "inlay": {"color": "#7a5a18", "reflection": 0.7, "reflection_color": {"checker": ["#ffd97a", 0], "scale": [16, 8]}}}
    ball = {"type": "sphere", "center": [0, 1, 0], "radius": 1, "axis": [0.2, 1, 0.2]}
    return {"material_" + name: stage([{**ball, "material": fields}], floor=TILES) for name, fields in each.items()}


def recipes():
    """The blocks of JSON under the headings of the section Recipes."""
    section = (DOCS / "scene.md").read_text(encoding="utf-8").split("\n## Recipes\n")[1].split("\n## ")[0]
    found = re.findall(r"\n### ([^\n]+)\n.*?```json\n(.*?)```", section, re.S)
    return {"recipe_" + title.lower().replace(" ", "_"): json.loads(block) for title, block in found}


def scenes():
    return {**shapes(), **lights(), **materials(), **recipes()}


def label_png(width=96, height=48):
    """The label that a recipe names: a sun between two bands."""
    def color(x, y):
        if y < 5 or y >= height - 5 or x < 3 or x >= width - 3:
            return (150, 30, 30)
        r = ((x - width / 2) ** 2 + (y - height / 2) ** 2) ** 0.5
        return (226, 150, 40) if r < 11 or (r < 16 and (x + y) % 4 < 2) else (246, 236, 214)
    rows = b"".join(b"\0" + bytes(c for x in range(width) for c in color(x, y)) for y in range(height))
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def render(whittle, name, document, target):
    with tempfile.TemporaryDirectory() as directory:
        (pathlib.Path(directory) / "label.png").write_bytes(label_png())
        scene = pathlib.Path(directory) / "scene.json"
        scene.write_text(json.dumps(document))
        return subprocess.run([whittle, "render", scene, "-o", target / f"{name}.png"], capture_output=True, check=False)


def main():
    whittle, *names = sys.argv[1:]
    for name, document in scenes().items():
        if names and name not in names:
            continue
        done = render(whittle, name, document, DOCS / "images")
        if done.returncode != 0:
            sys.exit(f"{name}: {done.stderr.decode()}")


if __name__ == "__main__":
    main()
