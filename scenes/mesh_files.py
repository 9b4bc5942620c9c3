"""Meshes in files of three formats, and the scene that shows them: a knot, a vase and a cut stone."""
import json
import math
import struct

from meshes import add, cross, scaled, unit


def grid_triangles(rows, columns, last_row):
    """Two triangles for each cell of a grid of rows that close upon themselves; the last row may join the first."""
    for i in range(rows if last_row else rows - 1):
        for j in range(columns):
            a, b = i * columns + j, i * columns + (j + 1) % columns
            c, d = (b + columns) % (rows * columns), (a + columns) % (rows * columns)
            yield from ((a, b, c), (a, c, d))


def knot_ply(rows=220, columns=20, thickness=0.34):
    """A tube along a trefoil, binary and without normals: `smooth` makes them."""
    def along(t):
        return (math.sin(t) + 2 * math.sin(2 * t), math.cos(t) - 2 * math.cos(2 * t), -math.sin(3 * t))

    positions = []
    for i in range(rows):
        t, step = 2 * math.pi * i / rows, 1e-3
        tangent = unit(add(along(t + step), scaled(along(t - step), -1)))
        across = unit(cross(tangent, (math.cos(t), -math.sin(t), 2)))
        up = cross(tangent, across)
        for j in range(columns):
            turn = 2 * math.pi * j / columns
            offset = add(scaled(across, math.cos(turn)), scaled(up, math.sin(turn)))
            positions.append(add(along(t), scaled(offset, thickness)))
    triangles = list(grid_triangles(rows, columns, True))
    head = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(positions)}\nproperty float x\n"
            f"property float y\nproperty float z\nelement face {len(triangles)}\n"
            "property list uchar ushort vertex_indices\nend_header\n")
    # Rounded to thousandths: another C library's last bit must not change the file.
    return (head.encode() + b"".join(struct.pack("<3f", *(round(x, 3) for x in p)) for p in positions)
            + b"".join(struct.pack("<B3H", 3, *triangle) for triangle in triangles))


def vase_obj(rows=40, columns=48):
    """A turned vase of quads with texture coordinates, which meet again at a seam where positions do not."""
    lines = ["# a turned vase"]
    for i in range(rows):
        v = i / (rows - 1)
        radius = 0.42 + 0.3 * math.sin(0.4 + 4.6 * v) * (1 - 0.35 * v) + 0.08 * v ** 8
        lines += [f"v {radius * math.cos(turn):.4f} {2 * v:.4f} {-radius * math.sin(turn):.4f}"
                  for turn in (2 * math.pi * j / columns for j in range(columns))]
    lines += [f"vt {j / columns:.5f} {i / (rows - 1):.5f}" for i in range(rows) for j in range(columns + 1)]
    corner = lambda i, j: f"{i * columns + j % columns + 1}/{i * (columns + 1) + j + 1}"
    lines += [f"f {corner(i, j)} {corner(i, j + 1)} {corner(i + 1, j + 1)} {corner(i + 1, j)}"
              for i in range(rows - 1) for j in range(columns)]
    return ("\n".join(lines) + "\n").encode()


def stone_glb(sides=8):
    """A brilliant of flat facets about y: table, crown, pavilion; two nodes of it, one of them smaller and apart."""
    ring = lambda radius, y, shift: [(radius * math.cos(2 * math.pi * (j + shift) / sides), y,
                                      -radius * math.sin(2 * math.pi * (j + shift) / sides)) for j in range(sides)]
    table, girdle, low = ring(0.55, 0.36, 0), ring(1, 0, 0.5), (0, -0.82, 0)
    facets = []
    for j in range(sides):
        k = (j + 1) % sides
        facets += [((0, 0.36, 0), table[j], table[k]), (table[j], girdle[j], table[k]),
                   (table[k], girdle[j], girdle[k]), (low, girdle[k], girdle[j])]
    data = b"".join(struct.pack("<3f", *(round(x, 5) for x in corner)) for facet in facets for corner in facet)
    turn = math.sin(math.radians(-55) / 2), math.cos(math.radians(-55) / 2)
    document = {
        "asset": {"version": "2.0"}, "buffers": [{"byteLength": len(data)}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3 * len(facets), "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"children": [1, 2]},
                  {"mesh": 0, "translation": [0, 0.83, 0]},
                  {"mesh": 0, "translation": [1.25, 0.36, 0.9], "scale": [0.42, 0.42, 0.42],
                   "rotation": [0, 0, round(turn[0], 5), round(turn[1], 5)]}],
        "scenes": [{"nodes": [0]}]}
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    return (b"glTF" + struct.pack("<II", 2, 28 + len(text) + len(data)) + struct.pack("<I", len(text)) + b"JSON" + text
            + struct.pack("<I", len(data)) + b"BIN\0" + data)


FILES = {"knot.ply": knot_ply, "vase.obj": vase_obj, "stone.glb": stone_glb}


def mesh_files():
    """A smooth knot of a PLY, a tiled vase of an OBJ, glass stones of a GLB."""
    return {
        "version": 1, "name": "mesh files",
        "image": {"width": 800, "height": 450},
        "camera": {"position": [0.2, 2.6, 8.4], "look_at": [0.1, 1.05, 0], "fov": 34},
        "background": {"color": [0.6, 0.68, 0.78]},
        "ambient": 0.2,
        "lights": [{"type": "point", "position": [-4, 8, 6], "intensity": 0.7},
                   {"type": "point", "position": [6, 5, 5], "color": [1, 0.85, 0.65], "intensity": 0.35}],
        "textures": {"tiles": {"file": "assets/tile.png", "scale": [12, 8]}},
        "materials": {
            "floor": {"color": [0.55, 0.52, 0.5], "reflection": 0.06},
            "brass": {"color": [0.72, 0.48, 0.16], "diffuse": 0.7, "specular": 0.7, "shininess": 60, "reflection": 0.18},
            "glazed": {"color": "tiles", "specular": 0.4, "shininess": 120, "reflection": 0.05},
            "crystal": {"color": 1, "ambient": 0.03, "diffuse": 0, "specular": 0.6, "shininess": 400, "transmission": 1,
                        "ior": 1.9, "transmission_color": [0.86, 0.95, 1]}},
        "objects": [
            {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": "floor"},
            {"type": "mesh", "file": "assets/knot.ply", "smooth": True, "material": "brass",
             "transform": [{"scale": 0.42}, {"rotate": {"axis": [0, 1, 0], "angle": 20}}, {"translate": [0.1, 1.45, -0.6]}]},
            {"type": "mesh", "file": "assets/vase.obj", "smooth": True, "material": "glazed",
             "transform": [{"scale": 1.1}, {"translate": [-2.6, 0.001, 0]}]},
            {"type": "mesh", "file": "assets/stone.glb", "material": "crystal",
             "transform": [{"rotate": {"axis": [0, 1, 0], "angle": 12}}, {"translate": [2.3, 0.002, 0.4]}]}],
        "accuracy": {"target_error": 1},
    }
