"""Scenes of cameras, lens, depth cue, shading of meshes and tone mapping."""
import math

from meshes import unit


def avenue(count, pitch):
    """Pairs of posts with balls on them, down a road."""
    posts = []
    for i in range(count):
        for side, paint in ((-1, "red"), (1, "blue")):
            x, z = 1.15 * side, -i * pitch
            posts += [{"type": "cylinder", "from": [x, 0, z], "to": [x, 0.8, z], "radius": 0.16, "material": "stone"},
                      {"type": "sphere", "center": [x, 1.05, z], "radius": 0.3, "material": paint}]
    return posts


PAINTS = {
    "road": {"model": "lambert", "color": {"checker": [[0.55, 0.53, 0.5], [0.42, 0.41, 0.4]]}},
    "stone": {"model": "lambert", "color": [0.62, 0.6, 0.55]},
    "red": {"color": [0.72, 0.13, 0.1], "specular": 0.5, "shininess": 90},
    "blue": {"color": [0.12, 0.24, 0.62], "specular": 0.5, "shininess": 90}}
SUN = {"type": "directional", "direction": [-1, -1.4, -0.8], "color": [1, 0.94, 0.84], "intensity": 0.85}
ROAD = {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": "road"}


def lens():
    """An aperture of 0.22 focused on the third pair of posts."""
    return {
        "version": 1, "name": "lens",
        "image": {"width": 720, "height": 405},
        "camera": {"position": [0.2, 1.5, 4.2], "look_at": [0, 0.75, -3.2], "fov": 34, "aperture": 0.22},
        "background": {"zenith": [0.3, 0.5, 0.85], "nadir": [0.85, 0.87, 0.9]},
        "ambient": 0.22, "lights": [SUN], "materials": PAINTS,
        "objects": [ROAD, *avenue(9, 1.6)],
        "accuracy": {"target_error": 1},
    }


def haze():
    """The same road without a lens, in air that thickens from 3 to 22 units."""
    return {
        "version": 1, "name": "haze",
        "image": {"width": 720, "height": 405},
        "camera": {"position": [0.2, 1.5, 4.2], "look_at": [0, 0.75, -3.2], "fov": 34},
        "depth_cue": {"front": 4, "back": 24, "front_scale": 1, "back_scale": 0.04, "color": [0.72, 0.76, 0.8]},
        "background": {"color": [0.72, 0.76, 0.8]},
        "ambient": 0.22, "lights": [SUN], "materials": PAINTS,
        "objects": [ROAD, *avenue(14, 1.6)],
        "accuracy": {"target_error": 1},
    }


def isometric():
    """Steps under an orthographic camera: parallel edges stay parallel."""
    steps = [{"type": "box", "min": [x, 0, z], "max": [x + 1, 0.25 * (1 + (x + 3) + (2 - z)), z + 1],
              "material": "odd" if (x + z) % 2 else "even"} for x in range(-3, 3) for z in range(-3, 3)]
    return {
        "version": 1, "name": "isometric",
        "image": {"width": 600, "height": 480},
        "camera": {"type": "orthographic", "position": [10, 8.66, 10], "look_at": [0, 0.5, 0], "height": 8.4},
        "background": {"color": [0.93, 0.92, 0.88]},
        "ambient": 0.3,
        "lights": [{"type": "directional", "direction": [-0.5, -1.3, -1.1], "intensity": 0.75}],
        "materials": {"odd": {"model": "lambert", "color": [0.84, 0.42, 0.22]},
                      "even": {"model": "lambert", "color": [0.9, 0.8, 0.62]}},
        "objects": steps,
        "accuracy": {"target_error": 1},
    }


def panorama():
    """All around a court of eight columns, and straight up and down."""
    columns = []
    for i in range(8):
        angle = math.radians(45 * i + 22.5)
        x, z = 3.2 * math.sin(angle), -3.2 * math.cos(angle)
        columns += [{"type": "cylinder", "from": [x, 0, z], "to": [x, 2.6, z], "radius": 0.3, "material": "stone"},
                    {"type": "sphere", "center": [x, 2.85, z], "radius": 0.4,
                     "material": {"color": {"hsb": [45 * i, 0.75, 0.85]}, "specular": 0.4}}]
    return {
        "version": 1, "name": "panorama",
        "image": {"width": 800, "height": 400},
        "camera": {"type": "panorama", "position": [0, 1.5, 0], "look_at": [0, 1.5, -1]},
        "background": {"zenith": [0.2, 0.42, 0.85], "nadir": [0.9, 0.9, 0.92]},
        "ambient": 0.25, "lights": [SUN], "materials": PAINTS,
        "objects": [ROAD, *columns],
        "accuracy": {"target_error": 1},
    }


def ball(center, radius, material, slices=14, stacks=8):
    """A coarse globe with the normals of a sphere."""
    around = [[math.cos(2 * math.pi * i / slices), math.sin(2 * math.pi * i / slices)] for i in range(slices)]
    normals = [[0, 1, 0], [0, -1, 0]]
    for j in range(1, stacks):
        polar = math.pi * j / stacks
        normals += [unit([math.sin(polar) * c, math.cos(polar), math.sin(polar) * s]) for c, s in around]
    def at(j, i):
        return 0 if j == 0 else 1 if j == stacks else 2 + (j - 1) * slices + i % slices
    faces = [[at(0, 0), at(1, i + 1), at(1, i)] for i in range(slices)]
    faces += [[at(j, i), at(j, i + 1), at(j + 1, i + 1), at(j + 1, i)] for j in range(1, stacks - 1)
              for i in range(slices)]
    faces += [[at(stacks - 1, i), at(stacks - 1, i + 1), at(stacks, 0)] for i in range(slices)]
    return {"type": "mesh", "positions": [[c + radius * n for c, n in zip(center, normal)] for normal in normals],
            "normals": normals, "faces": faces, "material": material}


def shading():
    """One coarse ball of polygons flat, Gouraud and smooth."""
    def paint(way):
        return {"color": [0.2, 0.45, 0.5], "specular": 0.7, "shininess": 40, "shading": way}

    return {
        "version": 1, "name": "shading",
        "image": {"width": 720, "height": 280},
        "camera": {"position": [0, 1.2, 8], "look_at": [0, 0.92, 0], "fov": 17},
        "background": {"color": [0.8, 0.82, 0.85]},
        "ambient": 0.15,
        "lights": [{"type": "point", "position": [-4, 6, 6], "intensity": 0.9}],
        "materials": {"floor": {"model": "lambert", "color": 0.62},
                      **{way: paint(way) for way in ("flat", "gouraud", "smooth")}},
        "objects": [{"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": "floor"},
                    *(ball([x, 0.9, 0], 0.9, way) for x, way in ((-2, "flat"), (0, "gouraud"), (2, "smooth")))],
        "accuracy": {"target_error": 1},
    }


def tone():
    """More light than a display has, through exposure and Reinhard's curve into a palette of 24 colours."""
    return {
        "version": 1, "name": "tone",
        "image": {"width": 640, "height": 360},
        "camera": {"position": [0, 1.6, 6.5], "look_at": [0, 0.8, 0], "fov": 32},
        "background": {"color": 0},
        "ambient": 0.05,
        "lights": [{"type": "point", "position": [0, 2.6, -0.6], "color": [1, 0.8, 0.55], "intensity": 26,
                    "attenuation": "inverse_square"}],
        "materials": {"wall": {"model": "lambert", "color": [0.7, 0.66, 0.6]},
                      "lamp": {"emission": [30, 24, 16], "color": 0},
                      "glaze": {"color": [0.2, 0.5, 0.35], "specular": 0.8, "shininess": 60}},
        "objects": [{"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": "wall"},
                    {"type": "plane", "point": [0, 0, -2.5], "normal": [0, 0, 1], "material": "wall"},
                    {"type": "sphere", "center": [0, 3.2, -0.6], "radius": 0.3, "material": "lamp"},
                    *({"type": "sphere", "center": [x, 0.6, 0.3], "radius": 0.6, "material": "glaze"}
                      for x in (-2, 0, 2))],
        "accuracy": {"target_error": 1},
        "output": {"exposure": -0.5, "overflow": "reinhard", "palette": 24},
    }
