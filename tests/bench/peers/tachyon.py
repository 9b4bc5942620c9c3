"""Exports a scene of bench_scenes.py to Tachyon 0.99.

- Its camera is left-handed and its samples are at the upper right corners of the pixels: the FRUSTUM, the image plane at
  distance 1, is given from right to left and shifted by half a pixel.
- Colours: its PPM48 is linear with 16 bits.
- Numbers are read as 32-bit floats.
- SPECULAR is the mirror factor, PHONG the highlight's.
- It has no cutoff.
- Transmitted rays keep their direction: OPACITY 1 - K_t is our `filtered`. Cones are rejected.
- Lights are visible spheres: their radius is too small for a ray to hit.
- At the maximum depth it returns the background; Whittle and POV-Ray return black. This difference cannot be configured.
"""
from tests.bench.peers.document import Unsupported, camera, color

LIGHT_RADIUS = 1e-7


def numbers(values):
    return " ".join(f"{value:.9g}" for value in values)


def texture(name, material, ambient):
    highlight = 0 if material["model"] == "lambert" else material["specular"]
    return (f"TEXDEF {name} AMBIENT {material.get('ambient', 1) * ambient:.9g} DIFFUSE {material.get('diffuse', 1):.9g} "
            f"SPECULAR {material.get('reflection', 0):.9g} OPACITY {1 - material.get('transmission', 0):.9g} "
            f"PHONG PLASTIC {highlight:.9g} PHONG_SIZE {material.get('shininess', 32):.9g} "
            f"COLOR {numbers(material['color'])} TEXFUNC 0")


def mesh(value, name, write):
    positions, normals = value["positions"], value.get("normals")
    for face in value["triangles"]:
        corners = " ".join(f"V{i} {numbers(positions[corner])}" for i, corner in enumerate(face))
        if normals:
            write(f"STRI {corners} " + " ".join(f"N{i} {numbers(normals[corner])}" for i, corner in enumerate(face))
                  + f" {name}")
        else:
            write(f"TRI {corners} {name}")


def shape(value, write):
    kind, name = value["type"], value["material"]
    if kind == "mesh":
        mesh(value, name, write)
    elif kind == "sphere":
        write(f"SPHERE CENTER {numbers(value['center'])} RAD {value['radius']:.9g} {name}")
    elif kind == "plane":
        write(f"PLANE CENTER {numbers(value['point'])} NORMAL {numbers(value['normal'])} {name}")
    elif kind == "cylinder":
        write(f"FCYLINDER BASE {numbers(value['from'])} APEX {numbers(value['to'])} RAD {value['radius']:.9g} {name}")
    else:
        raise Unsupported(f"a {kind}")


def write_scene(scene, path):
    """Raises Unsupported; the file is then incomplete."""
    frame, image = camera(scene), scene["image"]
    half_x, half_y = frame.tan_x / image["width"], frame.tan_y / image["height"]  # of a pixel
    window = (frame.tan_x + half_x, -frame.tan_x + half_x, -frame.tan_y - half_y, frame.tan_y - half_y)
    with open(path, "w", encoding="ascii") as file:
        write = lambda line: file.write(line + "\n")
        write(f"BEGIN_SCENE\nRESOLUTION {image['width']} {image['height']}")
        write(f"CAMERA ZOOM 1 ASPECTRATIO 1 ANTIALIASING 0 RAYDEPTH {scene['accuracy']['max_depth'] + 1} "
              f"CENTER {numbers(frame.position)} VIEWDIR {numbers(frame.forward)} UPDIR {numbers(frame.up)} "
              f"FRUSTUM {numbers(window)} END_CAMERA")
        write(f"BACKGROUND {numbers(scene['background']['color'])}")
        for light in scene["lights"]:
            write(f"LIGHT CENTER {numbers(light['position'])} RAD {LIGHT_RADIUS:g} COLOR {numbers(color(light['intensity']))}")
        for name, material in scene["materials"].items():
            write(texture(name, material, scene["ambient"]))
        for value in scene["objects"]:
            shape(value, write)
        write("END_SCENE")
