"""Interiors of triangles with Lambert's reflection, lit by windows and lamps: what Cycles renders as well (cycles_scene.py).

The z axis points up and a unit is a meter.
"""
import math

import numpy

WALLS = {"wall": 0.75, "green": [0.4, 0.6, 0.4], "floor": [0.5, 0.35, 0.2], "cloth": [0.2, 0.3, 0.6], "wood": [0.4, 0.25, 0.1],
         "red": [0.7, 0.1, 0.1]}


def mesh(material, positions, triangles):
    return {"type": "mesh", "material": material, "positions": positions, "triangles": triangles}


def quad(material, a, b, c, d):
    return mesh(material, [a, b, c, d], [[0, 1, 2], [0, 2, 3]])


def box(material, low, high):
    corners = [[(low, high)[i >> axis & 1][axis] for axis in range(3)] for i in range(8)]
    faces = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    return mesh(material, corners, [triangle for a, b, c, d in faces for triangle in ([a, b, c], [a, c, d])])


def ball(material, center, radius, rings=12):
    """A sphere of 4 rings^2 triangles."""
    turns = 2 * rings
    positions = [[center[0] + radius * math.sin(math.pi * j / rings) * math.cos(2 * math.pi * i / turns),
                  center[1] + radius * math.sin(math.pi * j / rings) * math.sin(2 * math.pi * i / turns),
                  center[2] + radius * math.cos(math.pi * j / rings)] for j in range(rings + 1) for i in range(turns)]
    triangles = []
    for j in range(rings):
        for i in range(turns):
            a, b = j * turns + i, j * turns + (i + 1) % turns
            triangles += [[a, a + turns, b]] * (j < rings - 1) + [[b, a if j == rings - 1 else a + turns, b + turns]] * (j > 0)
    return mesh(material, positions, triangles)


def room(x, y, z, window=None):
    """Walls around the origin's corner; `window`: (y, y, z, z) of a hole in the wall at `x`."""
    found = [quad("floor", [0, 0, 0], [x, 0, 0], [x, y, 0], [0, y, 0]), quad("wall", [0, 0, z], [0, y, z], [x, y, z], [x, 0, z]),
             quad("wall", [0, 0, 0], [0, y, 0], [0, y, z], [0, 0, z]), quad("wall", [0, 0, 0], [0, 0, z], [x, 0, z], [x, 0, 0]),
             quad("green", [0, y, 0], [x, y, 0], [x, y, z], [0, y, z])]
    y0, y1, z0, z1 = window or (y, y, z, z)
    for a, b, c, d in ((0, y0, 0, z), (y1, y, 0, z), (y0, y1, 0, z0), (y0, y1, z1, z)):
        if a < b and c < d:
            found.append(quad("wall", [x, a, c], [x, a, d], [x, b, d], [x, b, c]))
    return found


def furniture():
    return [box("cloth", [1.5, 2.6, 0], [3.5, 3.5, 0.45]), box("cloth", [1.5, 3.3, 0.45], [3.5, 3.5, 0.95]),
            box("wood", [2, 1.4, 0.35], [3, 2, 0.4]), ball("red", [2.5, 1.7, 0.55], 0.15)]


def scene(objects, position, look_at, fov, sky=0, lamp=None):
    materials = {name: {"color": color, "model": "lambert"} for name, color in WALLS.items()}
    materials["lamp"] = {"color": 0, "emission": lamp or [4, 3.6, 3]}
    return {"version": 1, "image": {"width": 480, "height": 320}, "background": sky, "materials": materials, "objects": objects,
            "camera": {"position": position, "look_at": look_at, "up": [0, 0, 1], "fov": fov}}


def living_room(sky=1, *more):
    return scene([*room(5, 4, 3, (1.2, 2.7, 1, 2.2)), *furniture(), *more], [0.4, 0.4, 1.6], [3, 3, 0.9], 75, sky)


def hall():
    lamps = [ball("lamp", [1 + 2 * i, 1 + 2 * j, 3.2], 0.06, 4) for i in range(12) for j in range(6)]
    blocks = [box("wood", [3 + 4 * i, 4, 0], [4 + 4 * i, 5, 1.5]) for i in range(5)]
    return scene(room(24, 12, 4) + lamps + blocks, [1, 1, 1.7], [12, 8, 1], 70, lamp=[20, 18, 15])


def corridor():
    """Its light comes through a door from a room with a window."""
    walls = room(2, 12, 2.6, (7.5, 9.5, 0, 2.3)) + room(6, 12, 2.6, (8, 10, 0.9, 2))[:2] + room(6, 12, 2.6, (8, 10, 0.9, 2))[5:]
    return scene([*walls, quad("green", [2, 7, 0], [6, 7, 0], [6, 7, 2.6], [2, 7, 2.6])], [1, 0.5, 1.6], [1.2, 9, 1.2], 60, 4)


def attic():
    """A roof with a window in one of its slopes, below a gradient."""
    def slope(x, y):
        return [x, y, 1 + 0.6 * min(x, 6 - x)]
    roof = [quad("wall", slope(a, c), slope(b, c), slope(b, d), slope(a, d)) for a, b, c, d in
            ((0, 3, 0, 5), (3, 4, 0, 5), (5, 6, 0, 5), (4, 5, 0, 1.5), (4, 5, 3, 5))]
    gables = [mesh("green", [[0, y, 0], [6, y, 0], slope(6, y), slope(3, y), slope(0, y)], [[0, 1, 2], [0, 2, 3], [0, 3, 4]])
              for y in (0, 5)]
    walls = [quad("wall", [x, 0, 0], [x, 5, 0], [x, 5, 1], [x, 0, 1]) for x in (0, 6)]
    floor = quad("floor", [0, 0, 0], [6, 0, 0], [6, 5, 0], [0, 5, 0])
    return scene([*roof, *gables, *walls, floor, *furniture()], [1.4, 0.5, 1.4], [3, 3.2, 0.9], 75,
                 {"zenith": [1, 1.6, 3], "nadir": [0.4, 0.35, 0.3], "up": [0, 0, 1]})


def sunny_room():
    """The texture `sky` is that of write_sky()."""
    return living_room({"environment": "sky", "up": [0, 0, 1]})


INTERIORS = {"window": living_room, "living_room": lambda: living_room(1, ball("lamp", [1, 3.4, 1.6], 0.12)), "hall": hall,
             "corridor": corridor, "attic": attic, "sunny_room": sunny_room}


def write_sky(path, width=256, height=128):
    """A sky with a sun of 2 x 2 texels that shines through the window, by longitude and latitude."""
    latitude = math.pi * (0.5 - (numpy.arange(height) + 0.5) / height)[:, None, None]
    sky = numpy.where(latitude > 0, numpy.array([0.6, 0.8, 1.2]) * (0.5 + 0.5 * numpy.sin(latitude)), [0.25, 0.2, 0.15])
    sky = numpy.repeat(sky, width, axis=1)
    sky[height // 3:height // 3 + 2, width // 2:width // 2 + 2] = 800
    exponent = numpy.floor(numpy.log2(sky.max(-1, keepdims=True))) + 1
    texels = numpy.concatenate([sky * 256 / 2 ** exponent, exponent + 128], -1).astype(numpy.uint8)
    path.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width) + texels.tobytes())
