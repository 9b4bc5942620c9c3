"""Scenes that each spend most of their time in one stage of a job: parsing, building, tracing or encoding."""
import json
import random
import struct
import zlib

from tests.http.daemon import put, scene, sha256
from tests.support.images import write_png


def grid(side):
    """Positions and triangles of a wavy square of 2 x side x side triangles."""
    positions = [(x / side - 0.5, 0.05 * ((x * 7919 + y * 104729) % 97) / 97, y / side - 0.5)
                 for y in range(side + 1) for x in range(side + 1)]
    triangles = []
    for y in range(side):
        for x in range(side):
            i = y * (side + 1) + x
            triangles += [(i, i + side + 1, i + 1), (i + 1, i + side + 1, i + side + 2)]
    return positions, triangles


def ply(side):
    positions, triangles = grid(side)
    head = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(positions)}\nproperty float x\nproperty float y\n"
            f"property float z\nelement face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n")
    return (head.encode() + b"".join(struct.pack("<3f", *p) for p in positions)
            + b"".join(struct.pack("<B3i", 3, *t) for t in triangles))


def stl(side):
    positions, triangles = grid(side)
    rows = [struct.pack("<12fH", 0, 0, 0, *positions[a], *positions[b], *positions[c], 0) for a, b, c in triangles]
    return bytes(80) + struct.pack("<I", len(triangles)) + b"".join(rows)


def glb(side):
    positions, triangles = grid(side)
    corners = b"".join(struct.pack("<3f", *p) for p in positions)
    indices = b"".join(struct.pack("<3I", *t) for t in triangles)
    text = json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": len(corners) + len(indices)}],
        "bufferViews": [{"buffer": 0, "byteLength": len(corners)},
                        {"buffer": 0, "byteOffset": len(corners), "byteLength": len(indices)}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": len(positions), "type": "VEC3",
                       "min": [-1, -1, -1], "max": [1, 1, 1]},
                      {"bufferView": 1, "componentType": 5125, "count": 3 * len(triangles), "type": "SCALAR"}]}).encode()
    text += b" " * (-len(text) % 4)
    binary = corners + indices
    return (struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(binary)) + struct.pack("<I4s", len(text), b"JSON")
            + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary)


def png(side):
    """An image of noise: the slowest content to decode."""
    rows = b"".join(b"\0" + random.Random(y).randbytes(3 * side) for y in range(side))
    return write_png([(b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)), (b"IDAT", zlib.compress(rows, 1)), (b"IEND", b"")])


def with_object(shape):
    return scene(64, 48, objects=[*scene()["objects"], shape])


def mesh_of(name):
    return with_object({"type": "mesh", "file": name, "smooth": True, "material": {"color": 0.5}})


def textured(name):
    material = {"color": "noise"}
    return scene(64, 48, textures={"noise": {"file": name}},
                 objects=[{"type": "sphere", "center": [0, 0.5, 0], "radius": 0.5, "material": material}])


def mirrors():
    return [{"type": "sphere", "center": [x, 0.5, z], "radius": 0.5, "material": {"color": 0.5, "reflection": 0.8}}
            for x in (-0.6, 0.6) for z in (-0.6, 0.6)]


def staged_scenes(daemon):
    """{name: body of POST /v1/jobs}, whose assets `daemon` has."""
    def upload(content):
        reply = put(daemon, content)
        assert reply.status in (200, 201), reply.body
        return f"sha256:{sha256(content)}"
    positions, triangles = grid(29)
    return {
        "large document": with_object({"type": "mesh", "positions": positions, "triangles": triangles,
                                       "material": {"color": 0.5}}),
        "PLY": mesh_of(upload(ply(70))),
        "STL": mesh_of(upload(stl(70))),
        "GLB": mesh_of(upload(glb(70))),
        "PNG texture": textured(upload(png(400))),
        "uniform sampling": scene(120, 90, samples=16, objects=mirrors()),
        "adaptive sampling": scene(80, 60, objects=mirrors(), accuracy={"target_error": 0.3}),
        "encoding": scene(500, 400, output={"formats": ["png", "exr"]}),
    }
