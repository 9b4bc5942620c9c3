#!/usr/bin/python3
"""Writes the example scenes beside this file: scenes/generate.py [DIRECTORY].

The output is the same every time, and a test compares the committed files with it. It needs the standard library only.
Each scene is one function that reads like its document. Lengths are scene units; y is up unless the camera has an `up`.
"""
import json
import math
import pathlib
import struct
import sys
import zlib

from features import instances, lights, shapes, torus, transparency
from interiors import color_bleeding, daylight, integrating_sphere
from mesh_files import FILES, mesh_files
from meshes import add, box, cavity, lens, prism, quad, scaled, turned, unit
from terrain import gradient_noise, ridges
from views import haze, isometric, lens as lens_scene, panorama, shading, tone
from worlds import cornell_box, cube, environment, evening, relief, studs, tile


# ---- writing -------------------------------------------------------------------------------------------------------

def rounded(value, digits=6):
    """`value` with its numbers rounded to so many significant digits; whole numbers are written as integers."""
    if isinstance(value, float):
        short = float(f"{value:.{digits}g}")
        return int(short) if short.is_integer() and abs(short) < 1e15 else short
    if isinstance(value, dict):
        return {key: rounded(item, digits) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [rounded(item, digits) for item in value]
    return value


def text_of(scene):
    """The document with one line per field, object, light, texture and material: diffs stay small."""
    compact = lambda value: json.dumps(value, separators=(",", ":"))
    lines = []
    for key, value in scene.items():
        if key in ("lights", "objects"):
            items = ",\n    ".join(compact(item) for item in value)
            lines.append(f'  "{key}": [\n    {items}\n  ]')
        elif key in ("textures", "materials"):
            items = ",\n    ".join(f"{json.dumps(name)}: {compact(item)}" for name, item in value.items())
            lines.append(f'  "{key}": {{\n    {items}\n  }}')
        else:
            lines.append(f'  "{key}": {json.dumps(value)}')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def png(width, height, color_at):
    """An 8-bit RGB image: color_at(x, y) in 0..255, row 0 on top."""
    rows = b"".join(b"\0" + bytes(channel for x in range(width) for channel in color_at(x, y)) for y in range(height))
    chunk = lambda kind, data: (struct.pack(">I", len(data)) + kind + data
                                + struct.pack(">I", zlib.crc32(kind + data)))
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 9))
            + chunk(b"IEND", b""))


# ---- the scenes ----------------------------------------------------------------------------------------------------

def tiny():
    """The smallest image with a reflection: benchmarks of the queue submit it thousands of times."""
    return {
        "version": 1, "name": "tiny",
        "image": {"width": 16, "height": 16},
        "camera": {"position": [0, 1, 4], "look_at": [0, 0.7, 0], "fov": 40},
        "background": {"color": [0.2, 0.4, 0.8]},
        "lights": [{"type": "point", "position": [3, 5, 4]}],
        "objects": [
            {"type": "sphere", "center": [0, 0.8, 0], "radius": 0.8,
             "material": {"color": "#c03020", "diffuse": 0.7, "reflection": 0.3}},
            {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": {"color": 0.6}}],
        "accuracy": {"target_error": 8},
    }


def whitted():
    """After Turner Whitted, An improved illumination model for shaded display, CACM 23(6), 1980, figure 7: a hollow
    glass ball before a mirror ball over a floor of red and yellow squares."""
    ball = (-0.35, 1.75, 0.9)
    floor = quad((-4.5, 0, 4.5), (9, 0, 0), (0, 0, -22))
    glass = {"color": 1, "ambient": 0, "diffuse": 0.03, "specular": 0.6, "shininess": 200, "transmission": 1,
             "reflection": 0.97, "ior": 1.5, "transmission_color": [0.93, 0.95, 0.95]}
    return {
        "version": 1, "name": "Whitted 1980",
        "image": {"width": 640, "height": 480},
        "camera": {"position": [0.0, 1.9, 6.6], "look_at": [0.15, 1.3, 0], "fov": 42},
        "background": {"color": [0.1, 0.26, 0.6]},
        "ambient": 0.2,
        "lights": [{"type": "point", "position": [-3.5, 8, 6], "intensity": 0.85}],
        "textures": {"squares": {"checker": [[0.75, 0.03, 0.02], [0.9, 0.75, 0.05]], "scale": [9, 22]}},
        "materials": {
            "floor": {"model": "lambert", "color": "squares"},
            "glass": glass,
            "mirror": {"color": [0.85, 0.87, 0.9], "diffuse": 0.12, "ambient": 0.12, "specular": 0.7, "shininess": 120,
                       "reflection": 0.82}},
        "objects": [
            {**floor, "material": "floor"},
            {"type": "sphere", "center": ball, "radius": 1.0, "material": "glass"},
            {**cavity(ball, 0.93), "material": "glass"},
            {"type": "sphere", "center": [1.15, 1.05, -0.9], "radius": 1.05, "material": "mirror"}],
        "accuracy": {"target_error": 1},
    }


def flake(center, radius, direction, levels, buds):
    """Eric Haines, A proposal for standard graphics environments, IEEE CG&A 7(11), 1987: nine balls of a third of the
    radius bloom on each ball, six around its waist and three above, turned so that +z goes to `direction`."""
    yield center, radius
    if levels == 0:
        return
    if direction[2] >= 1:
        turn = lambda v: v
    elif direction[2] <= -1:
        turn = lambda v: turned(v, (0, 1, 0), math.pi)
    else:
        axis, angle = unit((-direction[1], direction[0], 0)), math.acos(direction[2])
        turn = lambda v: turned(v, axis, angle)
    for bud in buds:
        out = turn(bud)
        yield from flake(add(center, scaled(out, radius * 4 / 3)), radius / 3, out, levels - 1, buds)


def flake_buds():
    """Three directions 60 degrees apart, tipped until two lie in the waist, then repeated every third of a turn."""
    side = math.sqrt(0.5)
    tip = unit((1, -1, 0))
    trio = [turned(v, tip, math.asin(2 / math.sqrt(6)))
            for v in ((side, side, 0), (side, 0, -side), (0, side, -side))]
    return [turned(v, (0, 0, 1), third * 2 * math.pi / 3) for third in range(3) for v in trio]


def sphereflake():
    """The balls of the Standard Procedural Databases at size factor 4, in their own frame: z is up. 7,381 balls, and
    the floor as an endless plane: 7,382 objects."""
    spheres = flake((0, 0, 0), 0.5, (0, 0, 1), 4, flake_buds())
    return {
        "version": 1, "name": "sphereflake",
        "image": {"width": 512, "height": 512},
        "camera": {"position": [2.1, 1.3, 1.7], "look_at": [0, 0, 0], "up": [0, 0, 1], "fov": 45},
        "background": {"color": [0.078, 0.361, 0.753]},
        "ambient": 0.06,
        "lights": [{"type": "point", "position": position, "intensity": 0.42}
                   for position in ([4, 3, 2], [1, -4, 4], [-3, 1, 5])],
        "materials": {
            "floor": {"model": "lambert", "color": [1, 0.75, 0.33], "diffuse": 0.8},
            "ball": {"color": [1, 0.9, 0.7], "diffuse": 0.5, "specular": 0.5, "shininess": 3.0827, "reflection": 0.5}},
        "objects": [{"type": "plane", "point": [0, 0, -0.5], "normal": [0, 0, 1], "material": "floor"}]
                   + [{"type": "sphere", "center": center, "radius": radius, "material": "ball"}
                      for center, radius in spheres],
        "accuracy": {"target_error": 1},
    }


def cornell():
    """A room after Cornell's (Goral, Torrance, Greenberg, Battaile 1984), with balls for its boxes: one mirror, one
    glass, and a block to show the corners of a hard shadow."""
    side = 5.5
    wall = lambda corner, along, across, material: {**quad(corner, along, across), "material": material}
    return {
        "version": 1, "name": "room",
        "image": {"width": 512, "height": 512},
        "camera": {"position": [2.75, 2.75, 13.6], "look_at": [2.75, 2.75, 0], "fov": 36.5},
        "ambient": 0.16,
        "lights": [{"type": "point", "position": [2.75, 5.2, 2.9], "color": [1, 0.93, 0.8], "intensity": 1.05,
                    "attenuation": [0.6, 0, 0.05]}],
        "materials": {
            "white": {"model": "lambert", "color": [0.73, 0.72, 0.69]},
            "red": {"model": "lambert", "color": [0.6, 0.06, 0.05]},
            "green": {"model": "lambert", "color": [0.1, 0.42, 0.1]},
            "lamp": {"model": "lambert", "emission": [3, 2.8, 2.4]},
            "mirror": {"color": 0.9, "ambient": 0.05, "diffuse": 0.05, "specular": 0.6, "shininess": 300,
                       "reflection": 0.92},
            "glass": {"color": 1, "ambient": 0, "diffuse": 0.02, "specular": 0.7, "shininess": 300,
                      "transmission": 0.98, "reflection": 0.98, "ior": 1.5}},
        "objects": [
            wall((0, 0, side), (side, 0, 0), (0, 0, -side), "white"),
            wall((0, side, 0), (side, 0, 0), (0, 0, side), "white"),
            wall((0, 0, 0), (side, 0, 0), (0, side, 0), "white"),
            wall((0, 0, side), (0, 0, -side), (0, side, 0), "red"),
            wall((side, 0, 0), (0, 0, side), (0, side, 0), "green"),
            wall((2.1, side - 0.001, 2.3), (1.3, 0, 0), (0, 0, 1.2), "lamp"),
            {**box((0.55, 0, 0.7), (2.05, 2.9, 2.2), 18.0), "material": "white"},
            {"type": "sphere", "center": [3.75, 1.1, 1.65], "radius": 1.1, "material": "mirror"},
            {"type": "sphere", "center": [2.2, 0.8, 3.9], "radius": 0.8, "material": "glass"}],
        "accuracy": {"target_error": 1},
    }


def glass():
    """Solids of glass side by side: a solid ball, a hollow one, a dense one, a lens, a prism, a block. Nothing touches
    the floor: of two surfaces in one place, rounding would decide which one a ray hits first."""
    def dielectric(ior, tint):
        return {"color": 1, "ambient": 0, "diffuse": 0.0, "specular": 0.6, "shininess": 400, "transmission": 1,
                "ior": ior, "transmission_color": tint}

    hollow = (-2.35, 1.0, -0.3)
    return {
        "version": 1, "name": "glass",
        "image": {"width": 720, "height": 432},
        "camera": {"position": [0.2, 2.7, 9.2], "look_at": [0.05, 0.72, 0], "fov": 30},
        "background": {"color": [0.5, 0.64, 0.84]},
        "ambient": 0.2,
        "lights": [{"type": "point", "position": [-5, 9, 5], "intensity": 0.65},
                   {"type": "point", "position": [6, 7, 4], "color": [1, 0.9, 0.75], "intensity": 0.35}],
        "textures": {"squares": {"checker": [[0.8, 0.8, 0.78], [0.12, 0.16, 0.22]], "scale": [20, 16]}},
        "materials": {
            "floor": {"model": "lambert", "color": "squares"},
            "crown": dielectric(1.5, [0.96, 0.98, 0.97]),
            "thin": dielectric(1.45, [0.96, 0.96, 0.98]),
            "diamond": dielectric(2.4, [0.98, 0.98, 1]),
            "water": dielectric(1.33, [0.75, 0.92, 0.98]),
            "ruby": dielectric(1.77, [0.95, 0.4, 0.35]),
            "emerald": dielectric(1.57, [0.45, 0.9, 0.55]),
            "red": {"color": [0.7, 0.08, 0.05], "specular": 0.3},
            "yellow": {"color": [0.85, 0.6, 0.06], "specular": 0.3},
            "blue": {"color": [0.06, 0.16, 0.6], "specular": 0.3}},
        "objects": [
            {**quad((-8, 0, 5), (16, 0, 0), (0, 0, -12.8)), "material": "floor"},
            {"type": "sphere", "center": [-0.1, 1.1, -1.1], "radius": 1.1, "material": "crown"},
            {"type": "sphere", "center": hollow, "radius": 1.0, "material": "thin"},
            {**cavity(hollow, 0.88), "material": "thin"},
            {**box((1.75, 0.01, -2.0), (3.05, 1.31, -0.7), 32.0), "material": "ruby"},
            {**lens((1.75, 0.72, 1.2), 0.72, 0.42, 24.0), "material": "crown"},
            {**prism((-1.75, 0.01, 1.9), 0.85, 1.2, 62.0), "material": "emerald"},
            {"type": "sphere", "center": [-0.45, 0.42, 1.5], "radius": 0.42, "material": "diamond"},
            {"type": "sphere", "center": [0.62, 0.3, 2.1], "radius": 0.3, "material": "water"},
            {"type": "sphere", "center": [-1.35, 0.6, -3.6], "radius": 0.6, "material": "red"},
            {"type": "sphere", "center": [0.9, 0.6, -4.4], "radius": 0.6, "material": "yellow"},
            {"type": "sphere", "center": [3.3, 0.5, 0.2], "radius": 0.5, "material": "blue"}],
        "accuracy": {"target_error": 1},
    }


def local_models():
    """The same ball under the three local models, with the same shininess: Blinn's lobe is the wider one."""
    def ball(x, material):
        return {"type": "sphere", "center": [x, 1, 0], "radius": 1, "material": material}

    surface = {"color": [0.16, 0.3, 0.62], "diffuse": 0.8, "specular": 0.6, "shininess": 24}
    return {
        "version": 1, "name": "local models",
        "image": {"width": 720, "height": 300},
        "camera": {"position": [0, 1.7, 8.5], "look_at": [0, 0.92, 0], "fov": 20},
        "background": {"color": [0.75, 0.78, 0.82]},
        "ambient": 0.18,
        "lights": [{"type": "point", "position": [-4, 6, 6], "intensity": 0.75},
                   {"type": "directional", "direction": [-1, -0.6, -0.5], "color": [1, 0.85, 0.65], "intensity": 0.25}],
        "materials": {
            "floor": {"model": "lambert", "color": [0.62, 0.6, 0.56]},
            "lambert": {"model": "lambert", **surface},
            "phong": {"model": "phong", **surface},
            "blinn_phong": {"model": "blinn_phong", **surface}},
        "objects": [
            {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": "floor"},
            ball(-2.3, "lambert"), ball(0, "phong"), ball(2.3, "blinn_phong")],
        "accuracy": {"target_error": 1},
    }


def mountain(cells=440, size=13.0):
    """A massif over a still lake, in bands of colour that share their normals. Ground deep under water, which no ray
    reaches, is omitted: more than 100,000 triangles remain."""
    def height(x, z):
        massif = math.exp(-((x / 4.6) ** 2 + ((z + 1.2) / 2.9) ** 2))
        shore = gradient_noise(x * 0.35 + 7.3, z * 0.35 + 2.1, 40)
        rough = ridges(0.27 * x + 11.7, 0.27 * z + 4.2)
        return 3.1 * massif * rough ** 1.2 + 0.45 * shore * (1 - massif) + 0.12 * rough - 0.5

    step = size / cells
    ground = [[height((i - 1) * step - size / 2, (j - 1) * step - size / 2) for i in range(cells + 3)]
              for j in range(cells + 3)]  # with a border of one, for the normals of the outermost

    def vertex(i, j):
        return (i * step - size / 2, ground[j + 1][i + 1], j * step - size / 2)

    def normal(i, j):
        dx = ground[j + 1][i + 2] - ground[j + 1][i]
        dz = ground[j + 2][i + 1] - ground[j][i + 1]
        return unit((-dx, 2 * step, -dz))

    def band(i, j):
        """By height and steepness, with ragged edges: snow lies high and where it can, trees climb from the shore."""
        y, flat = vertex(i, j)[1] + 0.2 * gradient_noise(i * 0.13, j * 0.13, 41), normal(i, j)[1]
        if y > 0.95 and flat > 0.98 - 0.3 * y:
            return "snow"
        if y < 0.035:
            return "sand"
        if flat < 0.6:
            return "cliff"
        if y < 0.3:
            return "forest"
        return "meadow" if y < 0.6 and flat > 0.7 else "scree"

    cells_of = {"snow": [], "scree": [], "cliff": [], "meadow": [], "forest": [], "sand": []}
    for j in range(cells):
        for i in range(cells):
            if max(vertex(i + di, j + dj)[1] for di in (0, 1) for dj in (0, 1)) > -0.02:
                cells_of[band(i, j)].append((i, j))

    def mesh(material):
        index, triangles = {}, []
        for i, j in cells_of[material]:
            a, b, c, d = (index.setdefault(corner, len(index))
                          for corner in ((i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)))
            triangles += [[a, b, c], [a, c, d]]
        return {"type": "mesh", "positions": rounded([vertex(*at) for at in index], 4), "triangles": triangles,
                "normals": rounded([normal(*at) for at in index], 3), "material": material}

    def ground_of(color):
        return {"model": "lambert", "color": color}

    return {
        "version": 1, "name": "mountain",
        "image": {"width": 800, "height": 450},
        "camera": {"position": [0.6, 0.62, 8.2], "look_at": [0, 0.62, -1.0], "fov": 27},
        "background": {"color": [0.3, 0.5, 0.82]},
        "ambient": [0.14, 0.19, 0.28],
        "lights": [{"type": "directional", "direction": [0.85, -0.5, -0.42], "color": [1, 0.84, 0.62],
                    "intensity": 1.15}],
        "materials": {
            "snow": ground_of([0.86, 0.88, 0.92]), "scree": ground_of([0.3, 0.27, 0.24]),
            "cliff": ground_of([0.19, 0.16, 0.145]), "meadow": ground_of([0.17, 0.2, 0.07]),
            "forest": ground_of([0.05, 0.1, 0.035]), "sand": ground_of([0.42, 0.36, 0.26]),
            "water": {"color": [0.015, 0.06, 0.085], "specular": 0.2, "shininess": 200, "reflection": 0.6}},
        "objects": [{"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": "water"}]
                   + [mesh(material) for material in cells_of],
        "accuracy": {"target_error": 1},
    }


def textures():
    """Marble of noise, tiles from an image, a sky of a gradient, a checker to the horizon."""
    def ball(x, z, radius, material):
        return {"type": "sphere", "center": [x, radius, z], "radius": radius, "material": material}

    return {
        "version": 1, "name": "textures",
        "image": {"width": 800, "height": 450},
        "camera": {"position": [0, 1.7, 7.5], "look_at": [0, 0.95, 0], "fov": 36},
        "background": {"color": [0.62, 0.76, 0.92]},
        "ambient": 0.25,
        "lights": [{"type": "point", "position": [-5, 8, 6], "color": [1, 0.96, 0.9], "intensity": 0.85}],
        "textures": {
            "floor": {"checker": ["#d8d0c0", "#5a3b34"]},
            "marble": {"noise": ["#202a38", "#fffaf0"], "octaves": 7, "scale": [9, 14]},
            "tiles": {"file": "assets/tile.png", "scale": [8, 4]},
            "tile": {"file": "assets/tile.png"},
            "dusk": {"gradient": ["#f2b36b", "#274690"], "wrap": "clamp"}},
        "materials": {
            "floor": {"color": "floor", "specular": 0.1},
            "marble": {"color": "marble", "diffuse": 0.93, "specular": 0.5, "shininess": 90, "reflection": 0.06},
            "tiles": {"color": "tiles", "specular": 0.6, "shininess": 150, "reflection": 0.08},
            "tile": {"color": "tile", "specular": 0.3},
            "sky": {"color": "dusk", "ambient": 0, "diffuse": 1, "specular": 0.4, "shininess": 60},
            "mirror": {"color": 0.04, "specular": 0.6, "shininess": 300, "reflection": 0.9}},
        "objects": [
            {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": "floor"},
            ball(-2.35, 0, 1.0, "marble"), ball(0, -0.3, 1.0, "tiles"),
            {"type": "cylinder", "from": [2.2, 0, -0.4], "to": [2.2, 2.0, -0.4], "radius": 0.75, "material": "sky"},
            {"type": "box", "min": [1.15, 0, 1.5], "max": [1.95, 0.8, 2.3], "material": "tile"},
            ball(-0.95, 2.0, 0.45, "mirror")],
        "accuracy": {"target_error": 1},
    }


SCENES = (tiny, whitted, sphereflake, cornell, cornell_box, color_bleeding, daylight, integrating_sphere, mountain,
          glass, local_models, shapes, torus, instances, lights, transparency, textures, lens_scene, haze, isometric,
          panorama, shading, tone, environment, cube, relief, mesh_files)


def main():
    directory = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent)
    for scene in SCENES:
        (directory / f"{scene.__name__}.json").write_text(text_of(rounded(scene())), encoding="utf-8")
    (directory / "assets").mkdir(exist_ok=True)
    for name, width, height, color_at in (("tile", 64, 64, tile), ("studs", 64, 64, studs), ("evening", 512, 256, evening)):
        (directory / f"assets/{name}.png").write_bytes(png(width, height, color_at))
    for name, write in FILES.items():
        (directory / "assets" / name).write_bytes(write())


if __name__ == "__main__":
    main()
