"""Vectors, and the meshes the example scenes are made of, as mesh objects of the scene document without their material:
triangles run counter-clockwise seen from the front.
"""
import math


def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def scaled(a, factor):
    return tuple(x * factor for x in a)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    return scaled(a, 1 / math.sqrt(dot(a, a)))


def turned(v, axis, angle):
    """`v` turned about the unit `axis` by `angle` radians, counter-clockwise (Rodrigues)."""
    c, s = math.cos(angle), math.sin(angle)
    return add(add(scaled(v, c), scaled(cross(axis, v), s)), scaled(axis, dot(axis, v) * (1 - c)))


def quad(corner, along, across):
    """Front side: along x across. (u,v) = (0,0) at the corner."""
    corners = [corner, add(corner, along), add(add(corner, along), across), add(corner, across)]
    return {"type": "mesh", "positions": corners, "triangles": [[0, 1, 2], [0, 2, 3]],
            "uvs": [[0, 0], [1, 0], [1, 1], [0, 1]]}


def box(low, high, turn_deg=0.0):
    """Walls of their own corners, so each is flat; turned about the vertical through its middle."""
    middle = scaled(add(low, high), 0.5)
    half = scaled(add(high, scaled(low, -1)), 0.5)
    positions, triangles = [], []
    for axis in range(3):
        for side in (-1, 1):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            for su, sv in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                corner = [0.0, 0.0, 0.0]
                corner[axis], corner[u], corner[v] = side * half[axis], su * half[u], sv * half[v]
                positions.append(add(middle, turned(tuple(corner), (0, 1, 0), math.radians(turn_deg))))
            first = len(positions) - 4
            order = (0, 1, 2, 3) if side > 0 else (0, 3, 2, 1)
            a, b, c, d = (first + i for i in order)
            triangles += [[a, b, c], [a, c, d]]
    return {"type": "mesh", "positions": positions, "triangles": triangles}


def revolved(profile, normals, slices, place):
    """A closed solid: `profile` is [(radius, height)] from bottom pole to top pole with its outward normals; `place`
    converts a point given along (side, up, side) to world space, and a normal if its second argument is true."""
    positions, directions, triangles, rings = [], [], [], []
    for (radius, height), (out, up) in zip(profile, normals):
        pole = radius < 1e-9
        ring = []
        for i in range(1 if pole else slices):
            c, s = math.cos(2 * math.pi * i / slices), math.sin(2 * math.pi * i / slices)
            ring.append(len(positions))
            positions.append(place((radius * c, height, radius * s), False))
            directions.append(place((out * c, up, out * s), True))
        rings.append(ring)
    for low, high in zip(rings, rings[1:]):
        for i in range(slices):
            a, b = low[i % len(low)], low[(i + 1) % len(low)]
            d, c = high[i % len(high)], high[(i + 1) % len(high)]
            if a != b:
                triangles.append([a, d, b])
            if c != d:
                triangles.append([b, d, c])
    return {"type": "mesh", "positions": positions, "triangles": triangles, "normals": directions}


def cavity(center, radius, slices=96, stacks=48):
    """A hollow inside of a solid: a sphere whose front is its inside. Outer surface and cavity together bound
    the glass between them, which is what a hollow ball is."""
    angles = [math.pi * (i / stacks - 0.5) for i in range(stacks + 1)]
    circle = [(math.cos(a) if 0 < i < stacks else 0.0, math.sin(a)) for i, a in enumerate(angles)]
    ball = revolved([scaled(p, radius) for p in circle], circle, slices,
                    lambda p, direction: p if direction else add(center, p))
    ball["triangles"] = [[a, c, b] for a, b, c in ball["triangles"]]
    ball["normals"] = [scaled(n, -1) for n in ball["normals"]]
    return ball


def lens(center, radius, thickness, tilt_deg, slices=72, rings=20):
    """Two caps of one sphere, rim to rim, standing upright with its axis along z, turned about the vertical."""
    sag = thickness / 2
    curvature = (radius * radius + sag * sag) / (2 * sag)
    edge = math.asin(radius / curvature)
    half = [(curvature * math.sin(edge * i / rings), sag - curvature * (1 - math.cos(edge * i / rings)))
            for i in range(rings + 1)]
    slope = [(math.sin(edge * i / rings), math.cos(edge * i / rings)) for i in range(rings + 1)]
    profile = [(r, -h) for r, h in half] + half[::-1]
    normals = [(o, -u) for o, u in slope] + slope[::-1]

    def place(point, direction):
        lying = (point[0], point[2], point[1])
        upright = turned((lying[0], -lying[1], lying[2]), (0, 1, 0), math.radians(tilt_deg))
        return upright if direction else add(center, upright)

    return revolved(profile, normals, slices, place)


def prism(center, side, length, turn_deg):
    """A triangular bar lying on one face; five flat faces, so no normals."""
    height = side * math.sqrt(3) / 2
    ends = [(-side / 2, 0.0), (side / 2, 0.0), (0.0, height)]
    at = lambda x, y, z: add(center, turned((x, y, z), (0, 1, 0), math.radians(turn_deg)))
    front = [at(x, y, length / 2) for x, y in ends]
    back = [at(x, y, -length / 2) for x, y in ends]
    triangles = [[0, 1, 2], [3, 5, 4]]
    for i in range(3):
        j = (i + 1) % 3
        triangles += [[i, i + 3, j + 3], [i, j + 3, j]]
    return {"type": "mesh", "positions": front + back, "triangles": triangles}
