"""Scenes with all shapes as triangle meshes, for renderers that have no others.

Takes spheres, cylinders without caps, discs, boxes, meshes, and instances of them, without textures of another kind than
`checker`. Positions are in scene space, texture coordinates are those of the scene format (api/docs/scene.md). Curved
shapes have so many facets that each is far smaller than a pixel, and smooth normals.
"""
import math

import numpy

AROUND, ALONG = 512, 256  # facets of a sphere: 2e-5 of the radius from it


def transform_of(value):
    """The 4 x 4 matrix of an object's transform, a list of steps."""
    matrix = numpy.eye(4)
    for step in value.get("transform", []):
        (kind, given), made = next(iter(step.items())), numpy.eye(4)
        if kind == "translate":
            made[:3, 3] = given
        elif kind == "scale":
            made[:3, :3] *= numpy.broadcast_to(given, 3)[:, None]
        else:
            x, y, z = given["axis"] / numpy.linalg.norm(given["axis"])
            angle, across = math.radians(given["angle"]), numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            made[:3, :3] += math.sin(angle) * across + (1 - math.cos(angle)) * across @ across  # Rodrigues
        matrix = made @ matrix
    return matrix


def axes(normal, u_axis=None):
    """e0 and e1 of the scene format."""
    n = numpy.array(normal, float) / numpy.linalg.norm(normal)
    if u_axis is None:
        u_axis = (0, 0, 1) if abs(n[0]) > 1 - 1e-9 else (1, 0, 0)
    e0 = numpy.subtract(u_axis, numpy.dot(u_axis, n) * n)
    e0 /= numpy.linalg.norm(e0)
    return n, e0, numpy.cross(n, e0)


def grid(point, columns, rows):
    """The surface `point(u, v)` over the unit square: (positions, triangles, uvs)."""
    u, v = (each.ravel() for each in numpy.meshgrid(numpy.linspace(0, 1, columns + 1), numpy.linspace(0, 1, rows + 1)))
    i = (numpy.arange(rows)[:, None] * (columns + 1) + numpy.arange(columns)).ravel()
    quads = numpy.stack([i, i + 1, i + columns + 2, i + columns + 1], 1)
    return point(u, v), numpy.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), numpy.stack([u, v], 1)


def sphere(value):
    n, e0, e1 = axes(value.get("axis", (0, 1, 0)), value.get("meridian"))

    def point(u, v):
        phi, theta = 2 * math.pi * u[:, None], math.pi * (1 - v[:, None])
        unit = numpy.sin(theta) * (numpy.cos(phi) * e0 + numpy.sin(phi) * e1) + numpy.cos(theta) * n
        return value["center"] + value["radius"] * unit
    return grid(point, AROUND, ALONG)


def cylinder(value):
    start, along = numpy.array(value["from"], float), numpy.subtract(value["to"], value["from"])
    _, e0, e1 = axes(along, value.get("u_axis"))

    def point(u, v):
        phi = 2 * math.pi * u[:, None]
        return start + v[:, None] * along + value["radius"] * (numpy.cos(phi) * e0 + numpy.sin(phi) * e1)
    return grid(point, AROUND, 1)


def disc(value):
    _, e0, e1 = axes(value["normal"], value.get("u_axis"))
    center, radius = numpy.array(value["center"], float), value["radius"]
    phi = 2 * math.pi * numpy.arange(AROUND) / AROUND
    across = numpy.concatenate([[[0, 0]], numpy.stack([numpy.cos(phi), numpy.sin(phi)], 1)])
    ring = numpy.arange(AROUND)
    triangles = numpy.stack([0 * ring, ring + 1, (ring + 1) % AROUND + 1], 1)
    return center + radius * (across[:, :1] * e0 + across[:, 1:] * e1), triangles, across / 2 + 0.5


def box(value):
    low, high = numpy.array(value["min"], float), numpy.array(value["max"], float)
    faces = [((1, 0, 0), (0, 0, -1), (0, 1, 0)), ((-1, 0, 0), (0, 0, 1), (0, 1, 0)), ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
             ((0, 0, -1), (-1, 0, 0), (0, 1, 0)), ((0, 1, 0), (1, 0, 0), (0, 0, -1)), ((0, -1, 0), (1, 0, 0), (0, 0, 1))]
    uvs = numpy.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    corners = [numpy.array(n) + (2 * u - 1) * numpy.array(right) + (2 * v - 1) * numpy.array(up)
               for n, right, up in faces for u, v in uvs]
    first = 4 * numpy.arange(6)[:, None]
    return (low + (numpy.array(corners) + 1) / 2 * (high - low), numpy.concatenate([first + [0, 1, 2], first + [0, 2, 3]]),
            numpy.tile(uvs, (6, 1)))


def mesh(value):
    return numpy.array(value["positions"], float), value["triangles"], numpy.array(value.get("uvs", numpy.zeros((0, 2))))


SHAPES = {"sphere": sphere, "cylinder": cylinder, "disc": disc, "box": box, "mesh": mesh}
CURVED = ("sphere", "cylinder")


def meshes(objects, prototypes, placed=numpy.eye(4)):
    for value in objects:
        matrix = placed @ transform_of(value)
        if value["type"] == "instance":
            yield from meshes(prototypes[value["of"]], prototypes, matrix)
            continue
        positions, triangles, uvs = SHAPES[value["type"]](value)
        yield {"type": "mesh", "positions": (positions @ matrix[:3, :3].T + matrix[:3, 3]).tolist(), "uvs": uvs.tolist(),
               "triangles": numpy.asarray(triangles).tolist(), "material": value["material"],
               "smooth": value["type"] in CURVED}


def scene_of_meshes(scene):
    """The scene without prototypes, whose objects are meshes with `smooth`."""
    kept = {name: value for name, value in scene.items() if name != "prototypes"}
    return {**kept, "objects": list(meshes(scene["objects"], scene.get("prototypes", {})))}
