"""Generated scenes of any size for comparing ray tracers, limited to the features of POV-Ray and mostly of Tachyon.

After Eric Haines, A proposal for standard graphics environments, IEEE CG&A 7(11), 1987 (the Standard Procedural
Databases): its kinds of scenes, not its parameters. Each scene is a function of one number, its size, and deterministic.
"""
import math
import pathlib
import random
import sys

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "scenes"))
from generate import flake, flake_buds, rounded  # pylint: disable=wrong-import-position
from meshes import add, quad, revolved, scaled, unit  # pylint: disable=wrong-import-position
from terrain import ridges  # pylint: disable=wrong-import-position


def scene(name, camera, objects, materials, lights=None, background=(0.08, 0.16, 0.3), ambient=0.1):
    lights = lights or [([6, 9, 8], 0.6), ([-7, 6, 5], 0.4)]
    return {"version": 1, "name": name, "image": {"width": 512, "height": 512}, "camera": camera,
            "background": {"color": list(background)}, "ambient": ambient,
            "lights": [{"type": "point", "position": place, "intensity": light} for place, light in lights],
            "materials": materials, "objects": objects}


def view(position, look_at, fov=40, up=(0, 1, 0)):
    return {"position": list(position), "look_at": list(look_at), "up": list(up), "fov": fov}


def matte(color):
    return {"model": "lambert", "color": list(color)}


def shiny(color, reflection=0.0, specular=0.4, shininess=40):
    return {"model": "phong", "color": list(color), "diffuse": 0.8, "specular": specular, "shininess": shininess,
            "reflection": reflection}


def sphere(center, radius, material):
    return {"type": "sphere", "center": list(center), "radius": radius, "material": material}


def floor(height=0.0, material="floor"):
    return {"type": "plane", "point": [0, height, 0], "normal": [0, 1, 0], "material": material}


def ground(corner, along, across):
    """A floor of two triangles, because bare Embree has no planes."""
    square = quad(corner, along, across)
    del square["uvs"]
    return {**square, "material": "floor"}


def sphereflake(levels=4):
    """9^levels mirror spheres, recursively placed on spheres."""
    spheres = flake((0, 0, 0), 0.5, (0, 0, 1), levels, flake_buds())
    return scene("sphereflake", view((2.1, 1.3, 1.7), (0, 0, 0), 45, (0, 0, 1)),
                 [ground((-12, -12, -0.5), (24, 0, 0), (0, 24, 0))]
                 + [sphere(center, radius, "mirror") for center, radius in spheres],
                 {"floor": matte((0.8, 0.6, 0.26)), "mirror": shiny((0.5, 0.45, 0.35), 0.5, 0.5, 3.0827)},
                 [([4, 3, 2], 0.42), ([1, -4, 4], 0.42), ([-3, 1, 5], 0.42)], (0.078, 0.361, 0.753), 0.06)


def tetra(levels=6):
    """A pyramid of 4^levels tetrahedra of four triangles each; they share no vertices."""
    corners = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]
    positions, triangles = [], []

    def grow(center, size, left):
        if left:
            for corner in corners:
                grow(add(center, scaled(corner, size / 2)), size / 2, left - 1)
            return
        first = len(positions)
        positions.extend(list(add(center, scaled(corner, size))) for corner in corners)
        for a, b, c in ((0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)):
            triangles.append([first + a, first + b, first + c])

    grow((0, 0, 0), 1.0, levels)
    return scene("tetra", view((1.7, 2.2, 2.6), (0, 0.1, 0), 46),
                 [{"type": "mesh", "positions": positions, "triangles": triangles, "material": "stone"}],
                 {"stone": matte((0.9, 0.75, 0.45))})


def rings(levels=4):
    """Rings of cylinders with spheres at their joints above a mirror floor."""
    objects, links = [floor()], 18
    for level in range(levels):
        count = levels - level
        for i in range(count):
            for k in range(count):
                center = ((i - (count - 1) / 2) * 2.2, 1 + 1.35 * level, (k - (count - 1) / 2) * 2.2)
                tilt = 0.5 * (i - k) + level
                joints = []
                for link in range(links):
                    around = 2 * math.pi * link / links
                    x, y = math.cos(around), math.sin(around) * 0.9
                    joints.append(add(center, (x * math.cos(tilt), y, x * math.sin(tilt))))
                for a, b in zip(joints, joints[1:] + joints[:1]):
                    objects.append(sphere(a, 0.11, "joint"))
                    objects.append({"type": "cylinder", "from": list(a), "to": list(b), "radius": 0.09, "caps": False,
                                    "material": "link"})
    return scene("rings", view((9, 7, 11), (0, 2.4, 0), 38), objects,
                 {"floor": shiny((0.5, 0.5, 0.55), 0.3, 0), "link": shiny((0.7, 0.5, 0.2), 0.25),
                  "joint": shiny((0.6, 0.6, 0.65), 0.4)})


def height_field(cells, size, height):
    step = size / cells
    at = lambda i, j: (i * step - size / 2, height(i * step - size / 2, j * step - size / 2), j * step - size / 2)
    positions = [list(at(i, j)) for j in range(cells + 1) for i in range(cells + 1)]
    corner = lambda i, j: j * (cells + 1) + i
    triangles = []
    for j in range(cells):
        for i in range(cells):
            a, b, c, d = corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j)
            triangles += [[a, b, c], [a, c, d]]
    return {"type": "mesh", "positions": positions, "triangles": triangles}


def mountain(cells=128):
    """A fractal terrain of 2 cells^2 flat triangles below four mirror spheres."""
    rocks = height_field(cells, 6.0, lambda x, z: 1.6 * ridges(0.3 * x + 11.7, 0.3 * z + 4.2) - 0.6)
    spheres = [sphere((x, 1.25, z), 0.45, "mirror") for x, z in ((-1, -1), (1, -0.8), (-0.8, 1), (1, 1.1))]
    return scene("mountain", view((3.6, 3.3, 4.6), (0, 0.35, 0), 40), [{**rocks, "material": "rock"}] + spheres,
                 {"rock": matte((0.55, 0.5, 0.38)), "mirror": shiny((0.15, 0.15, 0.2), 0.7, 0.5, 80)})


def gear(center, teeth, radius, depth, turn, material):
    """A gear with its axis along z: an outline of four corners per tooth, its two faces fans around the center."""
    corners = 4 * teeth
    outline = []
    for i in range(corners):
        angle = turn + 2 * math.pi * i / corners
        reach = radius if i % 4 < 2 else 0.82 * radius
        outline.append((reach * math.cos(angle), reach * math.sin(angle)))
    positions = [list(add(center, (x, y, z))) for z in (depth / 2, -depth / 2) for x, y in outline + [(0, 0)]]
    triangles, back = [], corners + 1
    for i in range(corners):
        j = (i + 1) % corners
        triangles += [[corners, i, j], [back + corners, back + j, back + i], [i, back + i, back + j], [i, back + j, j]]
    return {"type": "mesh", "positions": positions, "triangles": triangles, "material": material}


def gears(count=6):
    """count^2 gears, partly mirrors; every third is clear glass without refraction, which every tracer supports."""
    objects = [ground((-40, -count * 0.95 - 0.2, 40), (80, 0, 0), (0, 0, -80))]
    for i in range(count):
        for k in range(count):
            center = (1.75 * (i - (count - 1) / 2), 1.75 * (k - (count - 1) / 2), 0.35 * ((i + 2 * k) % 4))
            objects.append(gear(center, 18, 0.97, 0.3, 0.05 * (i - k), ("glass", "brass", "steel")[(i + k) % 3]))
    glass = {"model": "phong", "color": [0.1, 0.2, 0.2], "diffuse": 0.2, "ambient": 0.2, "specular": 0.5,
             "shininess": 60, "reflection": 0.15, "transmission": 0.75, "transparency": "filtered"}
    return scene("gears", view((3.2, 2.4, 2.2 * count + 4), (0, 0, 0), 38), objects,
                 {"floor": matte((0.5, 0.55, 0.5)), "brass": shiny((0.7, 0.5, 0.15), 0.2),
                  "steel": shiny((0.35, 0.38, 0.42), 0.4), "glass": glass})


def torus(center, radius, thickness, around, across):
    positions, normals, triangles = [], [], []
    for i in range(around):
        c, s = math.cos(2 * math.pi * i / around), math.sin(2 * math.pi * i / around)
        for k in range(across):
            out, up = math.cos(2 * math.pi * k / across), math.sin(2 * math.pi * k / across)
            reach = radius + thickness * out
            positions.append(list(add(center, (reach * c, reach * s, thickness * up))))
            normals.append([out * c, out * s, up])
            a, b = i * across + k, i * across + (k + 1) % across
            d, e = (i + 1) % around * across + k, (i + 1) % around * across + (k + 1) % across
            triangles += [[a, d, e], [a, e, b]]
    return {"type": "mesh", "positions": positions, "normals": normals, "triangles": triangles}


def pot(slices=96):
    """A surface of revolution with a torus as its handle, both with smooth normals, on a table of plain tiles."""
    stacks, profile = slices // 2, []
    for i in range(stacks + 1):
        at = math.pi * (i / stacks - 0.5)
        profile.append((math.cos(at) * (1 + 0.25 * math.sin(2.2 * at + 0.4)) if 0 < i < stacks else 0.0, math.sin(at)))
    normals = []
    for i in range(stacks + 1):
        (r0, h0), (r1, h1) = profile[max(i - 1, 0)], profile[min(i + 1, stacks)]
        normals.append((0, -1) if i == 0 else (0, 1) if i == stacks else unit((h1 - h0, r0 - r1)))
    body = revolved(profile, normals, slices, lambda p, direction: p if direction else add(p, (0, 1.001, 0)))
    tiles = [{**ground((x, 0, z + 1), (1, 0, 0), (0, 0, -1)), "material": "light" if (x + z) % 2 else "dark"}
             for x in range(-5, 5) for z in range(-5, 5)]
    return scene("pot", view((2.6, 2.9, 4.2), (0.2, 0.85, 0), 36),
                 tiles + [{**body, "material": "clay"},
                          {**torus((1.1, 1.15, 0), 0.55, 0.12, slices, slices // 4), "material": "clay"}],
                 {"clay": shiny((0.55, 0.25, 0.15), 0.2, 0.6, 60), "light": matte((0.75, 0.75, 0.7)),
                  "dark": matte((0.25, 0.22, 0.3))})


def tree(levels=8):
    """A binary tree with 2^levels tips, of cones with spheres at their joints."""
    objects = [floor()]

    def branch(base, direction, length, radius, left):
        tip = add(base, scaled(direction, length))
        objects.append({"type": "cone", "base": list(base), "apex": list(tip), "radius": radius,
                        "apex_radius": 0.7 * radius, "caps": False, "material": "bark"})
        objects.append(sphere(tip, 0.7 * radius, "bark"))
        if left == 0:
            return
        side = unit((direction[1] + 0.1, direction[2] - 0.3, direction[0] + 0.2))
        for sign in (1, -1):
            branch(tip, unit(add(direction, scaled(side, sign * 0.62))), 0.78 * length, 0.7 * radius, left - 1)
            side = unit((side[2], side[0], side[1]))

    branch((0, 0, 0), (0, 1, 0), 1.0, 0.14, levels)
    return scene("tree", view((2.2, 2.4, 5.4), (0, 1.9, 0), 40), objects,
                 {"floor": matte((0.45, 0.55, 0.3)), "bark": shiny((0.5, 0.35, 0.2), 0.0, 0.2, 20)})


def lattice(side=6):
    """A crystal of mirrors: side^3 spheres on a grid with cylinders along its edges."""
    objects, offset = [], (side - 1) / 2
    for x in range(side):
        for y in range(side):
            for z in range(side):
                position = (x - offset, y - offset, z - offset)
                objects.append(sphere(position, 0.19, "mirror"))
                for step in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
                    if max(a + b for a, b in zip((x, y, z), step)) < side:
                        objects.append({"type": "cylinder", "from": list(position), "to": list(add(position, step)),
                                        "radius": 0.06, "caps": False, "material": "rod"})
    return scene("lattice", view((1.3 * side, 0.9 * side, 1.7 * side), (0, 0, 0), 36), objects,
                 {"mirror": shiny((0.5, 0.2, 0.15), 0.4), "rod": shiny((0.3, 0.4, 0.5), 0.4)},
                 [([2 * side, 3 * side, 3 * side], 0.6), ([-2 * side, side, 2 * side], 0.4)])


def molecule(count=20000):
    """A large sphere filled with spheres at integer coordinates, so that a million of them fit into a document."""
    generator, reach = random.Random(1), 400
    objects = []
    while len(objects) < count:
        center = [generator.randrange(-reach, reach + 1) for _ in range(3)]
        if sum(x * x for x in center) <= reach * reach:
            objects.append(sphere(center, max(2, round(500 / count ** (1 / 3))), "cno"[generator.randrange(3)]))
    return scene("molecule", view((500, 450, 900), (0, 0, 0), 42), objects,
                 {"c": shiny((0.25, 0.25, 0.28)), "n": shiny((0.15, 0.25, 0.7)), "o": shiny((0.7, 0.12, 0.1))},
                 [([900, 1500, 1400], 0.7), ([-1200, 500, 900], 0.35)])


def waves(triangles=200000):
    """A wave surface of many small triangles with smooth normals, at a grazing view angle."""
    slope = lambda x, z: (0.3 * math.cos(2.1 * x + 0.7 * z), 0.22 * math.cos(2.9 * z - 1.3 * x + 1))
    sea = height_field(max(2, round(math.sqrt(triangles / 2))), 12.0,
                       lambda x, z: 0.3 / 2.1 * math.sin(2.1 * x + 0.7 * z) + 0.22 / 2.9 * math.sin(2.9 * z - 1.3 * x + 1))
    sea["normals"] = []
    for x, _, z in sea["positions"]:
        a, b = slope(x, z)
        sea["normals"].append(list(unit((-(a - 1.3 / 2.9 * b), 1, -(0.7 / 2.1 * a + b)))))
    return scene("waves", view((1, 1.6, 6.5), (0, 0, 0), 45),
                 [{**sea, "material": "water"}, sphere((0, 0.7, 0), 0.7, "buoy")],
                 {"water": shiny((0.1, 0.3, 0.35), 0.3, 0.5, 90), "buoy": shiny((0.8, 0.2, 0.1))})


SCENES = {make.__name__: make for make in (sphereflake, tetra, rings, mountain, gears, pot, tree, lattice, molecule, waves)}


def document(name, accuracy, size=None, width=512, height=512):
    """The document of a scene. Numbers are rounded once, the same for every program; documents are limited to 64 MB."""
    content = SCENES[name](size) if size else SCENES[name]()
    return rounded({**content, "accuracy": accuracy, "image": {"width": width, "height": height}}, 7)


def write_waves(triangle_count, path):
    """Writes a wave surface of about that many triangles as binary PLY: ten million do not fit into a document."""
    cells = max(2, round(math.sqrt(triangle_count / 2)))
    along = numpy.linspace(-6, 6, cells + 1)
    x, z = numpy.meshgrid(along, along)
    height = 0.3 / 2.1 * numpy.sin(2.1 * x + 0.7 * z) + 0.22 / 2.9 * numpy.sin(2.9 * z - 1.3 * x + 1)
    corner = numpy.arange((cells + 1) ** 2, dtype=numpy.int32).reshape(cells + 1, cells + 1)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    faces = numpy.empty(2 * cells * cells, [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"] = 3
    faces["corners"] = numpy.concatenate([numpy.stack([a, b, c], -1), numpy.stack([a, c, d], -1)]).reshape(-1, 3)
    with open(path, "wb") as file:
        file.write(b"ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\n"
                   b"property float z\nelement face %d\nproperty list uchar int vertex_indices\nend_header\n"
                   % (x.size, faces.size))
        numpy.stack([x, height, z], -1).astype("<f4").tofile(file)
        faces.tofile(file)
    return faces.size
